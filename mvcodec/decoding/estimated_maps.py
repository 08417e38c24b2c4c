"""Maps of a stream that holds none, matched on its decoded pictures."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace

import cv2
import numpy as np

from mvcodec.array import CameraArray, Position
from mvcodec.decoding.derived_maps import derive_map
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet, DisparityMap, Picture
from mvcodec.layers.refinement import make_matcher
from mvcodec.stereo.matcher import Matcher
from mvcodec.stream import StreamHeader
from mvcodec.synthesis.cross_view import STRENGTH, filter_picture
from mvcodec.synthesis.fetch_sources import Sources
from mvcodec.workers import run_all

DEFAULT_MATCHER = "joint"
QUICK_MATCHER = "realtime"

SMOOTH_WINDOW, SMOOTH_PX, SMOOTH_REACH_PX = 7, 1.0, 2.0
"""Of `Smoothed`: the window, px, and how much nearness of disparities and of pixels count; measured in
docs/measurements.md."""


class MapsOnDemand(Mapping[Position, DisparityMap]):
    """The maps of one frame set, matched when the first of them is looked at. Thread-safe.

    Matching costs far more than decoding, and frame sets that are only passed on the way to another one
    need none.

    Args:
        cameras: those that have a map.
        find: makes all maps at once.
    """

    def __init__(
        self, cameras: Collection[Position], find: Callable[[], Mapping[Position, DisparityMap]]
    ) -> None:
        self._cameras = tuple(cameras)
        self._find = find
        self._found: Mapping[Position, DisparityMap] | None = None
        self._lock = threading.Lock()

    def __getitem__(self, camera: Position) -> DisparityMap:
        if camera not in self._cameras:
            raise KeyError(camera)
        with self._lock:
            if self._found is None:
                self._found = self._find()
        return self._found[camera]

    def __iter__(self) -> Iterator[Position]:
        return iter(self._cameras)

    def __len__(self) -> int:
        return len(self._cameras)


class Smoothed:
    """A matcher whose maps are smoothed within surfaces: coding noise in pictures makes noise in maps.

    Args:
        matcher: what matches.
    """

    def __init__(self, matcher: Matcher) -> None:
        self._matcher = matcher

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher.match`."""
        maps = self._matcher.match(array, pictures, range_px)
        return dict(zip(maps, run_all(_smoothed, maps.values()), strict=True))


def _smoothed(found: DisparityMap) -> DisparityMap:
    values = cv2.bilateralFilter(found.values_px, SMOOTH_WINDOW, SMOOTH_PX, SMOOTH_REACH_PX)
    return DisparityMap(np.asarray(values, np.float32), found.valid)


def decoding_matcher(header: StreamHeader, asked: str | Matcher | None) -> Matcher:
    """What estimates the maps of a stream: the matcher asked for, else the one that its settings name.

    Settings that name none, or one that is not known here, leave it to DEFAULT_MATCHER. Maps of matchers by
    name are `Smoothed`; those of one's own stay as they are.

    Raises:
        SettingError: the matcher asked for is not known.
    """
    if asked is not None:
        return Smoothed(make_matcher(asked)) if isinstance(asked, str) else asked
    try:
        return Smoothed(make_matcher(str(header.settings.get("matcher", DEFAULT_MATCHER))))
    except SettingError:
        return Smoothed(make_matcher(DEFAULT_MATCHER))


def can_be_estimated(array: CameraArray, there: Collection[Position]) -> bool:
    """Whether maps can be estimated where only some real cameras are there."""
    return len(array.real) == len(there) or any(len(_block(array, there, camera)) > 1 for camera in there)


def estimate_maps(
    array: CameraArray,
    pictures: Mapping[Position, Picture],
    range_px: tuple[float, float],
    matcher: Matcher,
    coding_error: float | None = None,
) -> dict[Position, DisparityMap]:
    """The maps of real cameras from their decoded pictures.

    Where cameras are missing, each of the others is matched within the largest full block of cameras that
    it stands in; one that has lost all its neighbours takes what the others' maps say of it.

    Args:
        pictures: uint8 (H, W, 3) RGB of real cameras; `can_be_estimated` holds for them.
        range_px: (lo, hi), px between neighbouring real cameras; the maps keep within it.
        coding_error: as `DecodedSet.coding_error`; where it is known, and all cameras are there, pictures are
            filtered before they are matched, by maps that are found quickly.
    """
    if len(pictures) == len(array.real):
        if coding_error is not None and len(pictures) > 1:
            pictures = _filtered(array, pictures, range_px, coding_error)
        return matcher.match(array, pictures, range_px)
    found: dict[Position, DisparityMap] = {}
    for camera in pictures:
        block = _block(array, pictures, camera)
        if camera not in found and len(block) > 1:
            found |= _match_block(array, block, pictures, range_px, matcher)
    alone = [camera for camera in pictures if camera not in found]
    return found | {camera: derive_map(array, found, range_px, camera) for camera in alone}


def _filtered(
    array: CameraArray,
    pictures: Mapping[Position, Picture],
    range_px: tuple[float, float],
    coding_error: float,
) -> dict[Position, Picture]:
    """The pictures with less coding noise, see `mvcodec.synthesis.cross_view`."""
    maps = make_matcher(QUICK_MATCHER).match(array, pictures, range_px)
    decoded = DecodedSet(array, 0, 0, pictures, maps, range_px, coding_error=coding_error)
    sources = Sources(decoded, None)
    return {camera: filter_picture(decoded, camera, sources, STRENGTH) for camera in array.real}


def _block(array: CameraArray, there: Collection[Position], camera: Position) -> tuple[Position, ...]:
    """The larger of two full blocks around a camera: grown along its row first, or along its column."""
    rows, cols = array.real_rows, array.real_cols
    row, col = rows.index(camera[0]), cols.index(camera[1])

    def full(top: int, left: int, bottom: int, right: int) -> bool:
        inside = top >= 0 and left >= 0 and bottom < len(rows) and right < len(cols)
        return inside and all(
            (rows[y], cols[x]) in there for y in range(top, bottom + 1) for x in range(left, right + 1)
        )

    best: tuple[Position, ...] = ()
    sideways, upright = ((0, -1, 0, 0), (0, 0, 0, 1)), ((-1, 0, 0, 0), (0, 0, 1, 0))
    for ways in (sideways + upright, upright + sideways):
        top, left, bottom, right = row, col, row, col
        for up, west, down, east in ways:
            while full(top + up, left + west, bottom + down, right + east):
                top, left, bottom, right = top + up, left + west, bottom + down, right + east
        cameras = tuple((r, c) for r in rows[top : bottom + 1] for c in cols[left : right + 1])
        best = max(best, cameras, key=len)
    return best


def _match_block(
    array: CameraArray,
    block: tuple[Position, ...],
    pictures: Mapping[Position, Picture],
    range_px: tuple[float, float],
    matcher: Matcher,
) -> dict[Position, DisparityMap]:
    rows, cols = (tuple(sorted(set(axis))) for axis in zip(*block, strict=True))
    (top, left), (bottom, right) = block[0], block[-1]
    column = len(cols) == 1
    # In an array of one column disparity belongs to its vertical baseline.
    scale = array.cell_rho if column else 1.0
    part = replace(
        array,
        rows=bottom - top + 1,
        cols=right - left + 1,
        real_rows=tuple(row - top for row in rows),
        real_cols=tuple(col - left for col in cols),
        rho=1.0 if column else array.rho,
        disparity_per_step_px=None,
    )
    moved = {(row - top, col - left): pictures[row, col] for row, col in block}
    maps = matcher.match(part, moved, (range_px[0] * scale, range_px[1] * scale))
    return {
        (row + top, col + left): DisparityMap(found.values_px / np.float32(scale), found.valid)
        for (row, col), found in maps.items()
    }
