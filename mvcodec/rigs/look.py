"""A quick look at one frame set: do rows and columns agree, are the cameras where they are said to be?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import Picture
from mvcodec.rigs.features import (
    FEWEST,
    Features,
    Tracks,
    agreeing,
    find_features,
    linked,
    match,
    neighbours,
)
from mvcodec.rigs.odd_camera import odd_camera
from mvcodec.rigs.order import FEWEST_SURE, camera_name, other_order, said_disparities
from mvcodec.workers import run_all

Vectors = NDArray[np.float64]

APART_PX = 0.75
"""Neighbours' rows (columns) that are farther apart are told of."""

MENDS = "`mvcodec rectify` mends that"

_MOST_SIDE, _MOST_CAMERAS = 4, 25
_MANY_CAMERAS = 9
_PIXELS = 4 * 480 * 270
"""Of all pictures together, so that a look is quick."""
_FEATURES = 700
_SURE_SHARE = 0.5
_OTHER_WAY_SHARE = 0.7
_TURN_DEG = 25.0
_EQUAL_LEVELS = 0.5
_TEXTURE_LEVELS = 4.0


@dataclass(frozen=True, slots=True)
class Concern:
    """Something that the pictures show to be wrong.

    Attributes:
        kind: `misaligned`, `order`, `equal`, `upside down`, `on its side`, `dark`, `blank`, `mirrored`,
            `alone` or `behind infinity`.
        text: one line for people: what, how much, and what to do.
    """

    kind: str
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What was found: features, matches that agree, tracks, and how to match another picture."""

    cameras: tuple[Position, ...]
    features: Mapping[Position, Features]
    links: Mapping[tuple[Position, Position], NDArray[np.int64]]
    tracks: Tracks
    matched: Callable[[Picture, Position], int]


def look_at(
    array: CameraArray, pictures: Mapping[Position, Picture], *, rectified: bool = True
) -> list[Concern]:
    """What is wrong with an array, as far as one frame set shows.

    Args:
        array: its geometry.
        pictures: uint8 (H, W, 3) RGB of every real camera.
        rectified: they ought to be; else rows and columns may disagree.

    Returns:
        Nothing where all is well, or too little can be seen.
    """
    cameras = _some(array)
    if len(cameras) < 2:
        return []
    concerns = _equal(cameras, pictures)
    if concerns:
        return concerns
    seen = _found(cameras, pictures)
    odd = odd_camera(pictures, seen.features, seen.links, seen.matched)
    if odd is not None:
        return [Concern(*odd)]
    concerns = _turned(seen)
    if concerns:
        return concerns
    places = np.array([_place(array, camera) for camera in cameras], np.float64)
    order = other_order(seen.tracks, places)
    if order is not None:
        return [Concern("order", order)]
    return [*_misaligned(seen), *_behind(array, seen, places)] if rectified else []


def _some(array: CameraArray) -> tuple[Position, ...]:
    """The real cameras, or an evenly spread grid of them where there are many."""

    if len(array.real) <= _MOST_CAMERAS:
        return array.real

    def few(places: tuple[int, ...]) -> list[int]:
        every = -(-len(places) // _MOST_SIDE)
        return list(places[::every])

    return tuple((row, col) for row in few(array.real_rows) for col in few(array.real_cols))


def _place(array: CameraArray, camera: Position) -> tuple[float, float]:
    """(x, y) in steps to the right; of a single column in steps down."""
    rho = array.rho if array.cols > 1 else 1.0
    return float(camera[1]), camera[0] * rho


def _equal(cameras: tuple[Position, ...], pictures: Mapping[Position, Picture]) -> list[Concern]:
    small = {at: cv2.resize(pictures[at], (96, 64), interpolation=cv2.INTER_AREA) for at in cameras}
    for index, one in enumerate(cameras):
        if small[one].std(axis=(0, 1)).mean() < _TEXTURE_LEVELS:
            continue
        for other in cameras[index + 1 :]:
            if np.abs(small[one].astype(np.int16) - small[other]).mean() > _EQUAL_LEVELS:
                continue
            apart = cv2.absdiff(pictures[one], pictures[other])
            if apart.mean() <= _EQUAL_LEVELS:
                text = (
                    f"cameras {camera_name(one)} and {camera_name(other)} show the same picture;"
                    " give each camera's own file or topic"
                )
                return [Concern("equal", text)]
    return []


def _found(cameras: tuple[Position, ...], pictures: Mapping[Position, Picture]) -> _Seen:
    height, width = pictures[cameras[0]].shape[:2]
    scale = min(1.0, float(np.sqrt(_PIXELS / (height * width * len(cameras)))))
    most = max(220, _FEATURES * 4 // max(len(cameras), 4))

    def features(picture: Picture) -> Features:
        return _features(picture, scale, most)

    found = dict(zip(cameras, run_all(features, [pictures[at] for at in cameras]), strict=True))
    pairs = [
        (one, other)
        for one, other in neighbours(cameras)
        if len(cameras) <= _MANY_CAMERAS or one[0] == other[0] or one[1] == other[1]
    ]
    kept = run_all(lambda pair: _matches(found[pair[0]], found[pair[1]], 1.5 / scale), pairs)
    links = dict(zip(pairs, kept, strict=True))

    def matched(picture: Picture, other: Position) -> int:
        return len(_matches(features(picture), found[other], 1.5 / scale))

    return _Seen(cameras, found, links, linked(cameras, found, links, 0), matched)


def _features(picture: Picture, scale: float, most: int) -> Features:
    """Of a copy that is smaller by `scale`, in px of the picture itself."""
    height, width = picture.shape[:2]
    if scale < 1:
        size = max(1, round(width * scale)), max(1, round(height * scale))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    found = find_features(picture, most)
    factor = np.array([width / picture.shape[1], height / picture.shape[0]])
    return replace(found, xy_px=(found.xy_px + 0.5) * factor - 0.5)


def _matches(one: Features, other: Features, threshold_px: float) -> NDArray[np.int64]:
    """Matches that agree with one geometry, where most do."""
    pairs = match(one, other)
    kept = pairs[agreeing(one.xy_px[pairs[:, 0]], other.xy_px[pairs[:, 1]], threshold_px)]
    return kept if len(kept) >= max(FEWEST, _SURE_SHARE * len(pairs)) else kept[:0]


def _turned(seen: _Seen) -> list[Concern]:
    """A camera that is upside down or on its side: by the directions of features (clockwise, degrees)."""
    against: dict[Position, list[tuple[Position, int]]] = {camera: [] for camera in seen.cameras}
    along: dict[Position, int] = dict.fromkeys(seen.cameras, 0)
    for (one, other), kept in seen.links.items():
        if len(kept) < FEWEST:
            continue
        turn = seen.features[one].angles_deg[kept[:, 0]] - seen.features[other].angles_deg[kept[:, 1]]
        quarters = np.rint(turn / 90).astype(np.int64)
        near = np.abs(turn - 90 * quarters) < _TURN_DEG
        shares = [float(np.mean(near & (quarters % 4 == quarter))) for quarter in range(4)]
        quarter = int(np.argmax(shares))
        if quarter and shares[quarter] > _OTHER_WAY_SHARE:
            against[one].append((other, quarter))
            against[other].append((one, -quarter % 4))
        else:
            along[one] += 1
            along[other] += 1
    worst = max(seen.cameras, key=lambda camera: len(against[camera]) - along[camera])
    if not against[worst]:
        return []
    upright, quarter = against[worst][0]
    how = "upside down" if quarter == 2 else "on its side"
    by = (
        "180 degrees"
        if quarter == 2
        else f"90 degrees {'counter-clockwise' if quarter == 1 else 'clockwise'}"
    )
    text = f"camera {camera_name(worst)} is {how} against {camera_name(upright)}; turn its picture by {by}"
    return [Concern(how, text)]


def _misaligned(seen: _Seen) -> list[Concern]:
    worst: tuple[float, Position, Position, str] | None = None
    for (one, other), kept in seen.links.items():
        if len(kept) < FEWEST_SURE or (one[0] != other[0] and one[1] != other[1]):
            continue
        axis, word = (1, "rows") if one[0] == other[0] else (0, "columns")
        apart = seen.features[one].xy_px[kept[:, 0], axis] - seen.features[other].xy_px[kept[:, 1], axis]
        median = float(np.median(np.abs(apart)))
        if median > APART_PX and (worst is None or median > worst[0]):
            worst = median, one, other, word
    if worst is None:
        return []
    size, one, other, word = worst
    pair = f"{camera_name(one)} and {camera_name(other)}"
    text = f"the {word} of cameras {pair} are {size:.1f} px apart: not rectified; {MENDS}"
    return [Concern("misaligned", text)]


def _behind(array: CameraArray, seen: _Seen, places: Vectors) -> list[Concern]:
    """Points behind infinity, where a calibration says where that is."""
    disparity = said_disparities(seen.tracks, places)
    if not array.calibration.given or len(disparity) < FEWEST:
        return []
    share = float(np.mean(disparity < array.calibration.d_inf_px_per_step - APART_PX))
    if share < 0.2:
        return []
    text = (
        f"{share:.0%} of the points lie behind infinity by the calibration given; are the cameras in"
        " reverse order, or is d_inf_px_per_step another one?"
    )
    return [Concern("behind infinity", text)]
