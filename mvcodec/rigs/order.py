"""The order of cameras on their grid, as the points show it that they see.

In a rectified array a point of disparity d is at ``P - C * d`` in a camera at C on the grid. So points of
different disparities tell the cameras' places from each other's (the first singular vector of where they
are), whatever constant shift a camera has.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.rigs.features import Tracks

Vectors = NDArray[np.float64]

FEWEST_SURE = 24
"""Points without which nothing is said."""

_DEPTH_PX = 1.5
"""Spread of disparities from which on they tell the cameras' places."""
_IN_PLACE, _OUT_OF_PLACE = 0.25, 0.4
"""Steps: cameras are told to stand elsewhere where that fits so well, and what is said fits so badly."""
_FILLINGS = 8
_RANK_SHARE = 0.35


def other_order(tracks: Tracks, places: Vectors) -> str | None:
    """Says which order of the cameras fits, where that is another than is said; None where all is well.

    Args:
        tracks: points that the cameras show.
        places: float64 (N, 2), (x, y) where the cameras are said to be, steps.
    """
    found = _shown_places(tracks)
    if found is not None and len(places) > 2:
        shown, disparity_sign = found
        fits = [_assigned(sign * shown, places) for sign in (disparity_sign, -disparity_sign)]
        said = min(_misfit(sign * shown, places) for sign in (1, -1))
        error, order = fits[0]
        if fits[1][1] == tuple(range(len(places))):
            error, order = fits[1]
        if order != tuple(range(len(places))) and error < _IN_PLACE and said > _OUT_OF_PLACE:
            return _order_text(tracks.cameras, order)
    disparity = said_disparities(tracks, places)
    if len(disparity) >= FEWEST_SURE and np.percentile(disparity, 95) < -1.0:
        order = _reversed(tracks.cameras)
        return _order_text(tracks.cameras, order)
    return None


def _shown_places(tracks: Tracks) -> tuple[Vectors, float] | None:
    """(N, 2) places of the cameras as the points show them, of any scale, and the sign that makes most of
    the points' disparities positive; None where their depths are too alike.
    """
    often = tracks.seen.sum(axis=1) >= max(3, tracks.seen.shape[1] // 2)
    if np.count_nonzero(often) < FEWEST_SURE:
        return None
    for degree in (0, 1, 2):
        found = _first_direction(tracks.xy_px[often], tracks.seen[often], degree)
        if found is not None:
            return found
    return None


def _first_direction(xy: Vectors, seen: NDArray[np.bool_], degree: int) -> tuple[Vectors, float] | None:
    """As `_shown_places`. What cameras that are turned or distort show is a polynomial of the place.

    Args:
        xy: (T, N, 2), px.
        seen: (T, N).
        degree: of the polynomial that is taken out.
    """
    there = seen[..., None]
    filled = np.where(there, xy, (xy * there).sum(axis=1, keepdims=True) / there.sum(axis=1, keepdims=True))
    kept = np.ones(len(xy), bool)
    for _ in range(_FILLINGS):
        # Where a camera doesn't see a point, the model of the last step says where it would.
        mean = filled.mean(axis=1, keepdims=True)
        apart = (filled - mean).reshape(len(xy), -1)
        terms = _terms(mean[:, 0], degree)
        smooth = terms @ np.linalg.lstsq(terms[kept], apart[kept], rcond=None)[0]
        centred = apart - smooth
        _, values, rows = np.linalg.svd(centred[kept], full_matrices=False)
        fitted = np.outer(centred @ rows[0], rows[0])
        error = (np.abs(centred - fitted).reshape(xy.shape) * there).max(axis=(1, 2))
        kept = error <= max(3 * float(np.median(error)), 1.0)
        if np.count_nonzero(kept) < FEWEST_SURE:
            return None
        filled = np.where(there, xy, mean + (smooth + fitted).reshape(xy.shape))
    if values[0] < _DEPTH_PX * np.sqrt(np.count_nonzero(kept)) or values[1] > _RANK_SHARE * values[0]:
        return None
    shown = -rows[0].reshape(-1, 2)
    middle = np.median(apart[kept], axis=0).reshape(-1, 2)
    return shown, float(np.sign(-(middle * shown).sum())) or 1.0


def _terms(xy: Vectors, degree: int) -> Vectors:
    """(T, K): the terms of a polynomial of the place."""
    x, y = ((xy - xy.mean(axis=0)) / max(float(xy.std()), 1.0)).T
    terms = [np.ones_like(x), x, y, x * x, x * y, y * y]
    return np.stack(terms[: (degree + 1) * (degree + 2) // 2], axis=1)


def _scaled(shown: Vectors, places: Vectors) -> Vectors:
    """Centred, and as spread out as the places are."""
    centred = shown - shown.mean(axis=0)
    wanted, found = ((places - places.mean(axis=0)) ** 2).sum(), (centred**2).sum()
    return np.asarray(centred * np.sqrt(wanted / max(found, 1e-12)))


def _misfit(shown: Vectors, places: Vectors) -> float:
    """How far the worst camera is from where it is said to be, steps of the cameras that are looked at."""
    centred = places - places.mean(axis=0)
    return float(np.linalg.norm(_scaled(shown, places) - centred, axis=1).max() / _spacing(places))


def _assigned(shown: Vectors, places: Vectors) -> tuple[float, tuple[int, ...]]:
    """(misfit, order): camera n stands at place order[n], by the least total distance."""
    centred, scaled = places - places.mean(axis=0), _scaled(shown, places)
    distance = np.linalg.norm(scaled[:, None] - centred[None], axis=2)
    order = distance.argmin(axis=1)
    if len(set(order)) < len(order):  # the nearest place of each is the best, unless two want the same
        from scipy.optimize import linear_sum_assignment  # takes long to load, and is rarely needed

        _, order = linear_sum_assignment(distance**2)
    worst = float(distance[np.arange(len(order)), order].max() / _spacing(places))
    return worst, tuple(int(place) for place in order)


def _spacing(places: Vectors) -> float:
    """The least distance of two cameras."""
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    return float(apart[apart > 0].min())


def _reversed(cameras: tuple[Position, ...]) -> tuple[int, ...]:
    """Each camera at the place across from it."""
    rows = sorted({row for row, _ in cameras})
    cols = sorted({col for _, col in cameras})
    across = {(row, col): (rows[-1 - rows.index(row)], cols[-1 - cols.index(col)]) for row, col in cameras}
    return tuple(cameras.index(across[camera]) for camera in cameras)


def _order_text(cameras: tuple[Position, ...], order: tuple[int, ...]) -> str:
    """Camera n stands at place order[n]: which pictures belong where, row order."""
    rows = sorted({row for row, _ in cameras})
    cols = sorted({col for _, col in cameras})
    at = [cameras[order.index(place)] for place in range(len(cameras))]
    grid = [at[line * len(cols) : (line + 1) * len(cols)] for line in range(len(rows))]
    words = "; ".join(" ".join(camera_name(camera) for camera in line) for line in grid)
    kind = _kind(cameras, order)
    return f"the cameras stand in another order ({kind}); the order that fits, row by row: {words}"


def _kind(cameras: tuple[Position, ...], order: tuple[int, ...]) -> str:
    """What was done to the order, in words."""
    there = [cameras[place] for place in order]
    rows = sorted({row for row, _ in cameras})
    cols = sorted({col for _, col in cameras})
    column_of = {(camera[1], place[1]) for camera, place in zip(cameras, there, strict=True)}
    row_of = {(camera[0], place[0]) for camera, place in zip(cameras, there, strict=True)}
    by_columns, by_rows = len(column_of) == len(cols), len(row_of) == len(rows)
    if by_columns and by_rows:
        changed = [
            word
            for word, changes in (("rows", row_of), ("columns", column_of))
            if any(one != other for one, other in changes)
        ]
        return f"{' and '.join(changed)} swapped" if len(cameras) > 2 else f"{changed[0]} in reverse"
    if len(rows) == len(cols) and all(
        (rows.index(place[0]), cols.index(place[1])) == (cols.index(camera[1]), rows.index(camera[0]))
        for camera, place in zip(cameras, there, strict=True)
    ):
        return "rows and columns transposed"
    return "cameras swapped"


def said_disparities(tracks: Tracks, places: Vectors) -> Vectors:
    """(T,): disparity of each point for a step, px, where cameras stand as is said."""
    if not len(tracks.seen):
        return np.empty(0)
    weights = tracks.seen[..., None] / tracks.seen.sum(axis=1)[:, None, None]

    def centred(values: Vectors) -> Vectors:
        return np.asarray((values - (values * weights).sum(axis=1, keepdims=True)) * tracks.seen[..., None])

    leans, xy = centred(np.broadcast_to(places, tracks.xy_px.shape)), centred(tracks.xy_px)
    return np.asarray(-(xy * leans).sum(axis=(1, 2)) / np.maximum((leans**2).sum(axis=(1, 2)), 1e-12))


def camera_name(camera: Position) -> str:
    """ROW,COL."""
    return f"{camera[0]},{camera[1]}"
