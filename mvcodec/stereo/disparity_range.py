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
from mvcodec.frames import FloatMap, FrameSet, Mask, Picture
from mvcodec.stereo.ambiguity import unambiguous
from mvcodec.stereo.consistency import drop_speckles, left_right_check
from mvcodec.stereo.pairwise import CameraPair, camera_pairs, transposed
from mvcodec.stereo.sgbm import Sgbm, SgbmSettings
from mvcodec.workers import run_all

FALLBACK_RANGE_PX = (0.0, 16.0)
"""Of pictures in which nothing can be matched: any range does, a small one costs least."""

MAX_FRAMES = 3
MAX_PAIRS = 12
WIDEST_SHARE = 0.45
"""Search span on either side of zero, of the picture's width."""

COARSE_WIDTH, FINE_WIDTH = 240, 480
MIN_MATCHED_SHARE = 0.005

_CAREFUL = SgbmSettings(block_size=3, p1=8, p2=32, uniqueness_percent=10)
_BORDER_SHARE = 1 / 64
_WINDOW = 5
_MIN_CONTRAST = 2.5
_MIN_CORRELATION = 0.7
_TEXTURED_SHARE = 0.1
"""Of a picture that has contrast: less is too little to match by."""
_DARK_LEVEL = 12.0
_MIN_PATCH_PX = 20
_MAX_GAP_BINS = 2
# A small near object matters more than a small far one: it hides what is behind it. So less
# support is asked of it, of the pixels of a pair: of values apart from all others, and of the
# last of those in the main run.
_NEAR_CLUSTER, _FAR_CLUSTER = 0.0007, 0.003
_REPEATED_CLUSTER = 0.3
_NEAR_TAIL, _FAR_TAIL = 0.0005, 0.001
_NEAR_MARGIN, _FAR_MARGIN = 0.1, 0.02
_LEAST_MARGIN_PX = 1.0
_BESIDE_HINT = 0.5
"""Of a hint's extent, how far beyond it is looked: further, chance would find more than scenes hold."""


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
    array: CameraArray, frame_sets: Sequence[FrameSet], hint_px: tuple[float, float] | None = None
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
    # A hint that is too narrow is to be seen as such.
    around = hint_px and (
        hint_px[0] - _BESIDE_HINT * (hint_px[1] - hint_px[0]),
        hint_px[1] + _BESIDE_HINT * (hint_px[1] - hint_px[0]),
    )
    found = _search(jobs, COARSE_WIDTH, around)
    coarse = _union(found)
    share = float(np.mean([item.share for item in found]))
    if coarse is None or share < MIN_MATCHED_SHARE:
        fallback = hint_px or coarse or FALLBACK_RANGE_PX
        warnings.warn(
            f"{array.name or 'input'}: {_reason(jobs)} ({share:.1%} of the pixels found"
            f" a partner); disparity range set to {fallback[0]:g}..{fallback[1]:g} px",
            MvCodecWarning,
            stacklevel=2,
        )
        return fallback
    # The fine pass sees small near objects that the coarse one lost, hence the wider span on that side.
    extent = coarse[1] - coarse[0]
    slack = max(4.0, array.width / 64)
    span = coarse[0] - 0.1 * extent - slack, coarse[1] + 0.3 * extent + slack
    fine = _union(_search(jobs, FINE_WIDTH, _inside(span, around)))
    low, high = fine or coarse
    if hint_px is not None:
        hint_px = _widened(hint_px, (low, high), array.name)
    extent = high - low
    low -= _LEAST_MARGIN_PX + _FAR_MARGIN * extent
    high += _LEAST_MARGIN_PX + _NEAR_MARGIN * extent
    return _inside((float(math.floor(low)), float(math.ceil(high))), hint_px)


def _reason(jobs: Sequence[_Job]) -> str:
    """Why pictures don't match: what contrast they have, and how bright they are."""
    pictures = [_shrunk(picture, COARSE_WIDTH) for job in jobs for picture in (job.left, job.right)]
    levels = [cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32) for picture in pictures]
    textured = [float(np.mean(_variance(grey) > _MIN_CONTRAST**2)) for grey in levels]
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


def _widened(hint_px: tuple[float, float], seen_px: tuple[float, float], name: str) -> tuple[float, float]:
    """The hint, or further where the pictures show more than that; which is told."""
    low, high = seen_px
    beyond = low < hint_px[0] - _LEAST_MARGIN_PX, high > hint_px[1] + _LEAST_MARGIN_PX
    if not any(beyond):
        return hint_px
    margin = _LEAST_MARGIN_PX
    wider = (
        float(math.floor(low - margin)) if beyond[0] else hint_px[0],
        float(math.ceil(high + margin + _NEAR_MARGIN * (high - low))) if beyond[1] else hint_px[1],
    )
    warnings.warn(
        f"{name or 'input'}: the pictures show disparities of {low:.0f}..{high:.0f} px, beyond the stated"
        f" {hint_px[0]:g}..{hint_px[1]:g} px; widened to {wider[0]:g}..{wider[1]:g} px"
        " (state disparity_per_step_px anew, or leave it out)",
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
    values, sure = _sure_matches(left, right, span)
    tails = _tails(values[sure], sure.size)
    return _Found((tails[0] * unit, tails[1] * unit) if tails else None, float(sure.mean()))


def _shrunk(picture: Picture, width: int) -> Picture:
    height, full_width = picture.shape[:2]
    if full_width <= width:
        return picture
    size = width, max(1, round(height * width / full_width))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _sure_matches(left: Picture, right: Picture, span_px: tuple[float, float]) -> tuple[FloatMap, Mask]:
    """Left disparities, and where they are beyond doubt."""
    raw_left, raw_right = Sgbm(_CAREFUL).raw_pair(left, right, span_px)
    sure = left_right_check(*raw_left, *raw_right, partner_is_right=True)
    values = raw_left[0]
    height, width = values.shape
    levels, levels_right = (np.asarray(cv2.cvtColor(p, cv2.COLOR_RGB2GRAY), np.uint8) for p in (left, right))
    grey, grey_right = levels.astype(np.float32), levels_right.astype(np.float32)
    columns = np.arange(width, dtype=np.float32)[None] - values
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    partner = cv2.remap(grey_right, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    # Noise has contrast of its own, but no likeness in the other picture: both are asked for.
    sure &= _alike(grey, np.asarray(partner, np.float32))
    sure = drop_speckles(values, sure, _MIN_PATCH_PX)
    return values, _not_repeated(values, sure, unambiguous(levels, levels_right, values, span_px))


def _not_repeated(values: FloatMap, sure: Mask, unique: Mask) -> Mask:
    """Sure matches less ambiguous ones, but of these the many that say the same stay.

    On repeated texture the surroundings bring most of a wall to its place, and some of it a period
    beside. Without any of it the wall would be lost.
    """
    doubtful = sure & ~unique
    if not doubtful.any():
        return sure
    kept = drop_speckles(values, sure & unique, _MIN_PATCH_PX)
    bins = np.floor(values).astype(np.int64)
    first = bins[doubtful].min()
    counts = np.bincount(bins[doubtful] - first)
    runs = _runs(counts)
    most = max(counts[start:end].sum() for start, end in runs)
    for start, end in runs:
        if counts[start:end].sum() >= _REPEATED_CLUSTER * most:
            kept |= doubtful & (bins >= start + first) & (bins < end + first)
    return kept


def _mean(pixels: FloatMap) -> FloatMap:
    """Of each pixel's window."""
    return np.asarray(cv2.blur(pixels, (_WINDOW, _WINDOW)), np.float32)


def _variance(pixels: FloatMap) -> FloatMap:
    """Of each pixel's window."""
    mean = _mean(pixels)
    return np.asarray(_mean(pixels * pixels) - mean * mean, np.float32)


def _alike(first: FloatMap, second: FloatMap) -> Mask:
    """Where windows of two pictures have contrast and correlate (NCC, equation 3.6)."""

    variance_a, variance_b = _variance(first), _variance(second)
    covariance = _mean(first * second) - _mean(first) * _mean(second)
    contrast = np.minimum(variance_a, variance_b) > _MIN_CONTRAST**2
    correlated = covariance > _MIN_CORRELATION * np.sqrt(np.maximum(variance_a * variance_b, 0))
    return np.asarray(contrast & correlated)


def _tails(values: NDArray[np.float32], pixels: int) -> tuple[float, float] | None:
    """(lo, hi) of the values, less what too few pixels share at either end."""
    if values.size == 0:
        return None
    first = math.floor(values.min())
    bins = np.bincount(np.floor(values).astype(np.int64) - first)
    runs = _runs(bins)
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


def _runs(bins: NDArray[np.int64]) -> list[tuple[int, int]]:
    """[start, end) of runs of filled bins, small gaps tolerated."""
    filled = np.flatnonzero(bins > 0)
    breaks = np.flatnonzero(np.diff(filled) > _MAX_GAP_BINS + 1)
    starts = filled[np.concatenate([[0], breaks + 1])]
    ends = filled[np.concatenate([breaks, [filled.size - 1]])] + 1
    return list(zip(starts.tolist(), ends.tolist(), strict=True))
