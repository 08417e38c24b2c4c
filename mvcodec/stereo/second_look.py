"""A second look, at full size, at blocks of pictures whose small copies did not show enough.

There the whole pictures are searched again by semi-global matching. What is found counts where other
cameras' maps confirm it. Where those see through what the small copies said, the farther surface beside it
stands there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import DisparityMap, FloatMap, Mask
from mvcodec.stereo.consistency import fill_from_farther, median_but_thin
from mvcodec.stereo.doubts import BLOCK, BORDER, WINDOW, Blocks, Places
from mvcodec.stereo.joint_settings import JointSettings
from mvcodec.stereo.matching_view import CameraPartners, MatchingViews, comparison
from mvcodec.stereo.partners import neighbours, steps
from mvcodec.stereo.scanlines import ScratchPool, decide
from mvcodec.workers import run_all

AT_ONCE = 2
"""Blocks that are searched side by side: as many as the caches hold."""
MEDIAN_SIZE = 3
BEHIND_PX = 1.5


def look_again(
    array: CameraArray,
    views: MatchingViews,
    maps: Mapping[Position, DisparityMap],
    blocks: Mapping[Position, Blocks],
    range_px: tuple[float, float],
    settings: JointSettings,
    pool: ScratchPool,
) -> dict[Position, DisparityMap]:
    """Maps of all real cameras, with these blocks of them searched again.

    Args:
        views: the pictures as they are matched.
        maps: what small copies gave, brought back to full size.
        range_px: nothing outside of it is found.
    """
    from mvcodec.kernels.table import kernel

    def search(camera: Position) -> tuple[FloatMap, Mask]:
        return _searched(
            array, camera, views, maps[camera].values_px, blocks[camera], range_px, settings, pool
        )

    found = dict(zip(maps, run_all(search, maps), strict=True))
    others = {camera: neighbours(array, camera) for camera in maps}

    def confirm(camera: Position) -> Mask:
        raw, searched = found[camera]
        there = np.stack([found[other][0] for other in others[camera]])
        where = steps(array, camera, others[camera])
        kept: Mask = kernel("completion.confirmed")(raw, searched, there, where, settings.tolerance_px)
        return kept

    kept = dict(zip(maps, run_all(confirm, maps), strict=True))
    sure = {camera: kept[camera] | (maps[camera].valid & ~found[camera][1]) for camera in maps}

    def merge(camera: Position) -> DisparityMap:
        raw, searched = found[camera]
        values = np.where(kept[camera], raw, maps[camera].values_px)
        wrong = kernel("completion.seen_through")(
            values,
            searched & ~kept[camera],
            np.stack([found[other][0] for other in others[camera]]),
            np.stack([sure[other] for other in others[camera]]),
            steps(array, camera, others[camera]),
            BEHIND_PX,
        )
        filled = np.minimum(values, fill_from_farther(values, ~wrong, range_px[0]))
        limits = settings.tolerance_px, settings.thin_px
        smooth = median_but_thin(filled, kept[camera], MEDIAN_SIZE, limits, range_px)
        return DisparityMap(smooth, kept[camera] | maps[camera].valid)

    return dict(zip(maps, run_all(merge, maps), strict=True))


def _searched(
    array: CameraArray,
    camera: Position,
    views: MatchingViews,
    values: FloatMap,
    blocks: Blocks,
    range_px: tuple[float, float],
    settings: JointSettings,
    pool: ScratchPool,
) -> tuple[FloatMap, Mask]:
    """A camera's map with its blocks as they are found, and where they are."""
    penalties = replace(settings.matching_penalties, diagonals=False)
    those, grey = CameraPartners.of(array, camera), views.grey_of(camera)
    found, searched = np.array(values), np.zeros(values.shape, np.bool_)
    for places, (low, high) in _in_parts(blocks):
        windows = np.clip(places - BORDER, 0, [array.height - WINDOW, array.width])
        compare = comparison(array, those, views, low, settings)

        with pool.lend() as scratch:
            side_by_side = decide(
                partial(_costs_of_rows, compare, windows),
                _beside_each_other(grey, windows),
                low,
                high - low + 1,
                penalties,
                scratch,
                begins=range(0, WINDOW * len(windows), WINDOW),
            )
        _put_back(np.clip(side_by_side.disparity, *range_px), places, windows, found, searched)
    return found, searched


def _costs_of_rows(
    compare: Callable[[Places, NDArray[np.uint8]], None],
    windows: Places,
    first: int,
    costs: NDArray[np.uint8],
) -> None:
    compare(windows + np.array([first, 0]), costs)


def _in_parts(blocks: Blocks) -> Iterator[tuple[Places, tuple[int, int]]]:
    """Blocks that are searched at once, and the range of disparities that they need, px."""
    for first in range(0, len(blocks.places), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        ranges = blocks.ranges_px[part]
        yield blocks.places[part], (int(ranges[:, 0].min()), int(ranges[:, 1].max()))


def _beside_each_other(grey: NDArray[np.uint8], windows: Places) -> NDArray[np.uint8]:
    """Windows of a picture, uint8 (WINDOW, N * WINDOW); 0 beyond its right border."""
    found = np.zeros((WINDOW, len(windows) * WINDOW), np.uint8)
    for number, (row, column) in enumerate(windows):
        part = grey[row : row + WINDOW, column : column + WINDOW]
        found[:, number * WINDOW :][:, : part.shape[1]] = part
    return found


def _put_back(
    side_by_side: FloatMap, places: Places, windows: Places, values: FloatMap, searched: Mask
) -> None:
    """Put blocks of windows, float32 (WINDOW, N * WINDOW), into a map, and mark them."""
    for number, ((row, column), (top, left)) in enumerate(zip(places, windows, strict=True)):
        place = slice(row, row + BLOCK), slice(column, column + BLOCK)
        height, width = values[place].shape
        values[place] = side_by_side[row - top :, number * WINDOW + column - left :][:height, :width]
        searched[place] = True
