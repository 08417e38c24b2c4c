"""The matcher for moving pictures in real time: small copies are matched, and their maps brought back.

Large pictures are matched at half or a quarter of their size; their own edges then say where the surfaces of
the small map end (`mvcodec.kernels.enlargement`). Only cameras whose map is wanted are matched: what their
partners see is read off their own costs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np

from mvcodec.array import CameraArray, Position
from mvcodec.frames import DisparityMap, Picture
from mvcodec.stereo.doubts import Blocks, doubtful, most_doubtful
from mvcodec.stereo.joint import Joint
from mvcodec.stereo.joint_settings import REALTIME, SMALL_PICTURES, JointSettings
from mvcodec.workers import run_all

MOST_PX = (240_000, 900_000)
"""Pictures of more pixels than the first are matched at half their size, than the second at a quarter."""

AGREEMENT_PX = 3.0
"""Neighbouring samples of a small map that differ by no more are one surface."""
COLOUR_STEP = 40.0
"""The colour difference, summed over R, G and B, that counts as much as one sample of distance."""


class Realtime:
    """The `realtime` matcher, a `SelectiveMatcher` and a `HalvingMatcher`."""

    def __init__(self, settings: JointSettings | None = None, most_px: tuple[int, ...] = MOST_PX) -> None:
        """Match at half the size where pictures have more than most_px[0] pixels, and so on."""
        chosen = settings or JointSettings(**REALTIME)
        # What is searched again at full size is as good without diagonals before.
        self._joint = Joint(replace(chosen, diagonals=chosen.diagonals and not chosen.search_share))
        steps = max(chosen.subpixel_steps, chosen.full_size_steps)
        self._unshrunk = Joint(replace(chosen, **SMALL_PICTURES, subpixel_steps=steps))
        self._most_px = most_px

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher.match`. `valid` is where a partner confirms the pixel."""
        return self.match_cameras(array, pictures, range_px, array.real, fresh=True)

    def match_cameras(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
    ) -> dict[Position, DisparityMap]:
        """See `SelectiveMatcher.match_cameras`."""
        halvings = self._halvings(array)
        # Without the check by their own costs, maps confirm each other, and all are needed.
        matched = cameras if self._joint.settings.self_check else array.real
        if halvings == 0:
            maps = self._unshrunk.maps_of(array, pictures, range_px, matched, fresh)
        else:
            small, shrunk = self._small_maps(array, pictures, range_px, matched, fresh, halvings)
            maps = _brought_back(small, pictures, shrunk)
            if self._joint.settings.search_share and len(array.real) > 1:
                blocks = self._doubtful_blocks(array, small, shrunk, range_px[1])
                maps = self._joint.looked_at_again(array, pictures, maps, blocks, range_px)
            maps = self._joint.refined(array, pictures, maps, range_px, cameras)
        return {camera: maps[camera] for camera in cameras}

    def match_halved(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
    ) -> dict[Position, DisparityMap] | None:
        """See `HalvingMatcher.match_halved`. None too where maps are refined by the whole pictures."""
        settings, halvings = self._joint.settings, self._halvings(array)
        if halvings == 0 or settings.full_size_steps or not settings.self_check:
            return None
        maps, _ = self._small_maps(array, pictures, range_px, cameras, fresh, halvings)
        return {camera: DisparityMap(found.values_px * 2, found.valid) for camera, found in maps.items()}

    def _halvings(self, array: CameraArray) -> int:
        return sum(array.width * array.height > most for most in self._most_px)

    def _match_shrunk(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
        halvings: int,
    ) -> dict[Position, DisparityMap]:
        """Maps of these pictures, by copies that are halved so many times."""
        if halvings == 0:
            return self._joint.maps_of(array, pictures, range_px, cameras, fresh)
        maps, shrunk = self._small_maps(array, pictures, range_px, cameras, fresh, halvings)
        return _brought_back(maps, pictures, shrunk)

    def _doubtful_blocks(
        self,
        array: CameraArray,
        maps: Mapping[Position, DisparityMap],
        shrunk: Mapping[Position, Picture],
        nearest_px: float,
    ) -> dict[Position, Blocks]:
        """Which blocks of the pictures small maps are in doubt of."""
        small, size = _smaller(array), (array.height, array.width)
        most = self._joint.settings.search_share
        values = {camera: found.values_px for camera, found in maps.items()}
        greys = self._joint.equal_greys(shrunk)

        def blocks(camera: Position) -> Blocks:
            doubts = doubtful(small, camera, values, greys)
            return most_doubtful(doubts, values[camera], size, most, nearest_px)

        return dict(zip(maps, run_all(blocks, maps), strict=True))

    def _small_maps(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
        halvings: int,
    ) -> tuple[dict[Position, DisparityMap], dict[Position, Picture]]:
        """Maps of copies of half the size, in their px, and the copies."""
        small = _smaller(array)
        shrunk = dict(zip(pictures, run_all(_halved, pictures.values()), strict=True))
        span = range_px[0] / 2, range_px[1] / 2
        return self._match_shrunk(small, shrunk, span, cameras, fresh, halvings - 1), shrunk


def _smaller(array: CameraArray) -> CameraArray:
    """Of pictures of half the size."""
    return replace(array, width=-(-array.width // 2), height=-(-array.height // 2))


def _brought_back(
    maps: Mapping[Position, DisparityMap],
    pictures: Mapping[Position, Picture],
    shrunk: Mapping[Position, Picture],
) -> dict[Position, DisparityMap]:
    """Maps of copies of half the size, as large as the pictures."""
    doubled = run_all(lambda camera: _doubled(maps[camera], pictures[camera], shrunk[camera]), maps)
    return dict(zip(maps, doubled, strict=True))


def _halved(picture: Picture) -> Picture:
    height, width = picture.shape[:2]
    even = picture
    if height % 2 or width % 2:
        border = 0, height % 2, 0, width % 2
        even = np.asarray(cv2.copyMakeBorder(picture, *border, cv2.BORDER_REPLICATE), np.uint8)
    size = even.shape[1] // 2, even.shape[0] // 2
    return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA), np.uint8)


def _doubled(small: DisparityMap, picture: Picture, shrunk: Picture) -> DisparityMap:
    from mvcodec.kernels.table import kernel

    height, width = picture.shape[:2]
    values_px = np.empty((height, width), np.float32)
    kernel("enlargement.enlarge")(small.values_px * 2, picture, shrunk, AGREEMENT_PX, COLOUR_STEP, values_px)
    size = 2 * small.valid.shape[1], 2 * small.valid.shape[0]
    valid = np.asarray(
        cv2.resize(small.valid.view(np.uint8), size, interpolation=cv2.INTER_NEAREST), np.uint8
    )
    return DisparityMap(values_px, valid[:height, :width].view(np.bool_))
