"""The range of disparities between neighbouring real cameras, estimated from pictures."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray
from mvcodec.errors import MvCodecWarning, SettingError
from mvcodec.frames import FrameSet, Picture
from mvcodec.stereo.pairwise import CameraPair, camera_pairs, transposed
from mvcodec.stereo.sure_matches import filled_runs, sure_matches, textured_share
from mvcodec.workers import run_all

FALLBACK_RANGE_PX = (0.0, 16.0)
"""Of pictures in which nothing can be matched: any range does, a small one costs least."""

MAX_FRAMES = 3
MAX_PAIRS = 12
WIDEST_SHARE = 0.45
"""Search span on either side of zero, of the picture's width."""

COARSE_WIDTH, FINE_WIDTH = 240, 480
MIN_MATCHED_SHARE = 0.005

_BORDER_SHARE = 1 / 64
_TEXTURED_SHARE = 0.1
"""Of a picture that has contrast: less is too little to match by."""
_DARK_LEVEL = 12.0
# A small near object matters more than a small far one: it hides what is behind it. So less
# support is asked of it, of the pixels of a pair: of values apart from all others, and of the
# last of those in the main run.
_NEAR_CLUSTER, _FAR_CLUSTER = 0.0007, 0.003
_NEAR_TAIL, _FAR_TAIL = 0.0005, 0.001
_NEAR_MARGIN, _FAR_MARGIN = 0.1, 0.02
_LEAST_MARGIN_PX = 1.0
_HINT_SLACK_PX = 0.5
"""What pictures show beyond a hint by no more than this does not contradict it."""
_HINT_ADVICE = "state disparity_per_step_px anew, or leave it out"
_BESIDE_HINT, _LEAST_BESIDE_PX = 0.5, 4.0
"""Of a hint's extent, and px, how far beyond it is looked: further, chance would find more than there is."""


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    """A pair to match along rows; `rho` turns its pixels into those of the array's disparity."""

    left: Picture
    right: Picture
    rho: float


@dataclass(frozen=True, slots=True)
class _Found:
    """What one pair tells: (lo, hi) in px of the array's disparity, and the share of pixels matched."""

    range_px: tuple[float, float] | None
    share: float


def estimate_range(
    array: CameraArray,
    frame_sets: Sequence[FrameSet],
    hint_px: tuple[float, float] | None = None,
    advice: str = _HINT_ADVICE,
) -> tuple[float, float]:
    """Range of disparity between neighbouring real cameras, with a margin.

    Coarse to fine: small copies of the pairs are matched over a wide span, larger ones over
    what that found. Only pixels count that both directions agree on, in textured surroundings
    that look alike in both pictures, and nowhere else as much; values must be shared by a minimum
    of pixels of a pair.

    Args:
        array: the geometry.
        frame_sets: some of the input (up to three are used, spread evenly), with every real
            camera's picture.
        hint_px: (lo, hi) between neighbouring real cameras that the result stays inside, unless the pictures
            show more: then it is widened, and a MvCodecWarning says so.
        advice: what that warning says that can be done.

    Returns:
        (lo, hi), px, lo < hi; lo may be negative. Where next to nothing matches, a MvCodecWarning
        names the cause, and the hint, or else 0..16, is returned.

    Raises:
        SettingError: no frame set, or a hint with lo >= hi.
    """
    if hint_px is not None and not hint_px[0] < hint_px[1]:
        raise SettingError("disparity range hint", f"{hint_px[0]:g}..{hint_px[1]:g}", "lo < hi")
    if not frame_sets:
        raise SettingError("estimate_range frame_sets", "none", "at least one frame set")
    jobs = _jobs(array, frame_sets)
    if not jobs:
        return hint_px or FALLBACK_RANGE_PX
    coarse, seen, share = _seen(array, jobs, hint_px)
    if seen is None:
        fallback = hint_px or coarse or FALLBACK_RANGE_PX
        warnings.warn(
            f"{array.name or 'input'}: {_reason(jobs)} ({share:.1%} of the pixels found"
            f" a partner); disparity range set to {fallback[0]:g}..{fallback[1]:g} px",
            MvCodecWarning,
            stacklevel=2,
        )
        return fallback
    low, high = seen
    if hint_px is not None:
        hint_px = _widened(hint_px, seen, array.name, advice)
    extent = high - low
    low -= _LEAST_MARGIN_PX + _FAR_MARGIN * extent
    high += _LEAST_MARGIN_PX + _NEAR_MARGIN * extent
    return _inside((float(math.floor(low)), float(math.ceil(high))), hint_px)


def make_room(
    array: CameraArray, frame_sets: Sequence[FrameSet], stated_px: tuple[float, float], advice: str
) -> tuple[float, float]:
    """A range that somebody stated, or a wider one where the pictures show more: a MvCodecWarning says so.

    Of live pictures: later ones may show what the first don't.

    Args:
        array, frame_sets: as in `estimate_range`.
        stated_px: (lo, hi) between neighbouring real cameras, px, lo < hi. The result is never narrower.
        advice: what the warning says that can be done.
    """
    jobs = _jobs(array, frame_sets)
    seen = _seen(array, jobs, stated_px)[1] if jobs else None
    return stated_px if seen is None else _widened(stated_px, seen, array.name, advice)


def _seen(
    array: CameraArray, jobs: Sequence[_Job], hint_px: tuple[float, float] | None
) -> tuple[tuple[float, float] | None, tuple[float, float] | None, float]:
    """(lo, hi), px, that small copies show; that larger ones do, if enough matches; the share that does."""
    around = hint_px and _around(hint_px)
    found = _search(jobs, COARSE_WIDTH, around)
    if around and _share(found) < MIN_MATCHED_SHARE:
        around, found = None, _search(jobs, COARSE_WIDTH, None)
    coarse, share = _union(found), _share(found)
    if coarse is None or share < MIN_MATCHED_SHARE:
        return coarse, None, share
    # The fine pass sees small near objects that the coarse one lost, hence the wider span on that side.
    extent = coarse[1] - coarse[0]
    slack = max(4.0, array.width / 64)
    span = coarse[0] - 0.1 * extent - slack, coarse[1] + 0.3 * extent + slack
    return coarse, _union(_search(jobs, FINE_WIDTH, _inside(span, around))) or coarse, share


def _around(hint_px: tuple[float, float]) -> tuple[float, float]:
    """What is searched, px: a hint that is too narrow is to be seen as such."""
    beside = max(_BESIDE_HINT * (hint_px[1] - hint_px[0]), _LEAST_BESIDE_PX)
    return hint_px[0] - beside, hint_px[1] + beside


def _share(found: Sequence[_Found]) -> float:
    return float(np.mean([item.share for item in found]))


def _reason(jobs: Sequence[_Job]) -> str:
    """Why pictures don't match: what contrast they have, and how bright they are."""
    pictures = [_shrunk(picture, COARSE_WIDTH) for job in jobs for picture in (job.left, job.right)]
    levels = [cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32) for picture in pictures]
    textured = [textured_share(grey) for grey in levels]
    if min(textured) >= _TEXTURED_SHARE:
        return (
            "the cameras' pictures don't match; are they of one moment, in the order of the grid, and"
            " rectified (`mvcodec rectify`)?"
        )
    if float(np.median([grey.mean() for grey in levels])) < _DARK_LEVEL:
        return "too little texture to match in pictures so dark"
    return "too little texture to match"


def _inside(range_px: tuple[float, float], hint_px: tuple[float, float] | None) -> tuple[float, float]:
    if hint_px is None:
        return range_px
    low, high = max(range_px[0], hint_px[0]), min(range_px[1], hint_px[1])
    return (low, high) if low < high else hint_px


def _widened(
    hint_px: tuple[float, float], seen_px: tuple[float, float], name: str, advice: str
) -> tuple[float, float]:
    """The hint, or further where the pictures show more than that; which is told."""
    low, high = seen_px
    beyond = low < hint_px[0] - _HINT_SLACK_PX, high > hint_px[1] + _HINT_SLACK_PX
    if not any(beyond):
        return hint_px
    margin = _LEAST_MARGIN_PX
    wider = (
        float(math.floor(low - margin)) if beyond[0] else hint_px[0],
        float(math.ceil(high + margin + _NEAR_MARGIN * (high - low))) if beyond[1] else hint_px[1],
    )
    warnings.warn(
        f"{name or 'input'}: the pictures show disparities of {low:.1f}..{high:.1f} px, beyond the stated"
        f" {hint_px[0]:g}..{hint_px[1]:g} px; widened to {wider[0]:g}..{wider[1]:g} px"
        f" ({advice})",
        MvCodecWarning,
        stacklevel=3,
    )
    return wider


def _union(found: Sequence[_Found]) -> tuple[float, float] | None:
    ranges = [item.range_px for item in found if item.range_px]
    if not ranges:
        return None
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def _jobs(array: CameraArray, frame_sets: Sequence[FrameSet]) -> list[_Job]:
    """Up to MAX_PAIRS pairs of pictures, spread over the frames, the rows and the columns."""
    frames = [frame_sets[i] for i in _spread(len(frame_sets), MAX_FRAMES)]
    pairs = camera_pairs(array)
    each = max(MAX_PAIRS // len(frames) // 2, 1)
    chosen: list[CameraPair] = []
    for vertical in (False, True):
        group = [pair for pair in pairs if pair.vertical is vertical]
        chosen += [group[i] for i in _spread(len(group), each)]
    return [_job(frame, pair, array.cell_rho) for frame in frames for pair in chosen]


def _spread(count: int, wanted: int) -> list[int]:
    """Up to `wanted` indices of `count`, the first and the last among them."""
    return sorted({round(i) for i in np.linspace(0, count - 1, min(count, wanted))}) if count else []


def _job(frame: FrameSet, pair: CameraPair, rho: float) -> _Job:
    left, right = _trimmed(frame.pictures[pair.first]), _trimmed(frame.pictures[pair.second])
    if pair.vertical:
        return _Job(transposed(left), transposed(right), rho)
    return _Job(left, right, 1.0)


def _trimmed(picture: Picture) -> Picture:
    """Without its rim: dark frames around pictures match at disparity 0, whatever is behind them."""
    height, width = picture.shape[:2]
    y, x = int(height * _BORDER_SHARE), int(width * _BORDER_SHARE)
    return picture[y : height - y, x : width - x]


def _search(jobs: Sequence[_Job], width: int, span_px: tuple[float, float] | None) -> list[_Found]:
    return run_all(lambda job: _search_pair(job, width, span_px), jobs)


def _search_pair(job: _Job, width: int, span_px: tuple[float, float] | None) -> _Found:
    full_width = job.left.shape[1]
    left, right = _shrunk(job.left, width), _shrunk(job.right, width)
    # px of the array's disparity for each px of these pictures.
    unit = full_width / left.shape[1] / job.rho
    widest = WIDEST_SHARE * left.shape[1]
    span = (-widest, widest)
    if span_px is not None:
        span = max(span_px[0] / unit, -left.shape[1]), min(span_px[1] / unit, left.shape[1])
    if not span[0] < span[1]:
        return _Found(None, 0.0)
    values, sure = sure_matches(left, right, span)
    tails = _tails(values[sure], sure.size)
    return _Found((tails[0] * unit, tails[1] * unit) if tails else None, float(sure.mean()))


def _shrunk(picture: Picture, width: int) -> Picture:
    height, full_width = picture.shape[:2]
    if full_width <= width:
        return picture
    size = width, max(1, round(height * width / full_width))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _tails(values: NDArray[np.float32], pixels: int) -> tuple[float, float] | None:
    """(lo, hi) of the values, less what too few pixels share at either end."""
    if values.size == 0:
        return None
    first = math.floor(values.min())
    bins = np.bincount(np.floor(values).astype(np.int64) - first)
    runs = filled_runs(bins)
    while runs and bins[runs[0][0] : runs[0][1]].sum() < _FAR_CLUSTER * pixels:
        runs.pop(0)
    while runs and bins[runs[-1][0] : runs[-1][1]].sum() < _NEAR_CLUSTER * pixels:
        runs.pop()
    if not runs:
        return None
    kept = np.sort(values[(values >= runs[0][0] + first) & (values < runs[-1][1] + first)])
    last = kept.size - 1
    low = kept[min(int(_FAR_TAIL * pixels), last)]
    high = kept[max(last - int(_NEAR_TAIL * pixels), 0)]
    return float(min(low, high)), float(high)
