"""The compiled loops of the default renderer against their plain twins, on random input."""

from __future__ import annotations

import numpy as np
import pytest
import view_twins as twins
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from view_kernel_input import SHAPES, Shape, in_bands, in_pairs, in_steps, seeds, shapes, smoother, some_maps

from mvcodec.frames import FloatMap, Mask
from mvcodec.kernels import (
    view_colour,
    view_depth,
    view_fetch,
    view_holes,
    view_marks,
    view_planes,
    view_vectors,
)
from mvcodec.synthesis.layered import LayeredSettings

Planes = tuple[NDArray[np.int16], NDArray[np.int16], NDArray[np.float32], NDArray[np.float32]]


def test_the_kernels_share_one_value_for_the_unknown() -> None:
    assert np.float32(twins.UNKNOWN) == view_depth.UNKNOWN
    assert view_fetch.CONTOUR < -1e6


# --- moving a map to the view


def moved(disparity: FloatMap, shift: tuple[float, float], reach: float) -> FloatMap:
    margin = view_depth.MARGIN
    out = np.full((disparity.shape[0] + 2, disparity.shape[1] + 2 * margin), np.nan, np.float32)
    view_depth.splat(disparity, *shift, reach, out)
    beside = out[:, : margin - 1], out[:, 1 - margin :]
    assert all((columns == view_depth.UNKNOWN).all() for columns in beside)
    return out[:, margin - 1 : 1 - margin]


@settings(max_examples=60, deadline=None)
@given(seeds, shapes, st.integers(-16, 16), st.integers(-16, 16), st.sampled_from([0.5, 0.58, 0.75, 0.99]))
def test_splat(seed: int, shape: Shape, right: int, down: int, reach: float) -> None:
    disparity = some_maps(np.random.default_rng(seed), 1, shape)[0]
    shift = right / 8, down / 8
    np.testing.assert_array_equal(moved(disparity, shift, reach), twins.splat(disparity, *shift, reach))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.25, 0.0), (0.0, -0.75), (-1.5, 0.625), (0.5, 0.5)])
def test_splat_of_every_shape(shape: Shape, shift: tuple[float, float]) -> None:
    for seed in range(10):
        disparity = some_maps(np.random.default_rng(seed), 1, shape)[0]
        np.testing.assert_array_equal(moved(disparity, shift, 0.58), twins.splat(disparity, *shift, 0.58))


def test_splat_of_what_leaves_the_picture_far_away() -> None:
    disparity = np.array([[2000.0, 0.0, -2000.0]], np.float32)
    out = moved(disparity, (0.5, 0.25), 0.5)
    np.testing.assert_array_equal(
        out[1], np.array([twins.UNKNOWN, twins.UNKNOWN, 0, twins.UNKNOWN, twins.UNKNOWN], np.float32)
    )
    assert (out[0, 0], out[2, -1]) == (2000, -2000)


def test_splat_closes_the_cracks_of_a_stretched_surface() -> None:
    """A slope stretched by an eighth: nearest pixels alone leave cracks, a reach of .58 leaves none."""
    slope = np.tile(np.arange(40) / 4 + 0.3, (3, 1)).astype(np.float32)
    nearest, wider = (
        moved(slope, (-0.5, 0.0), reach)[1:-1, 1:40] > view_depth.UNKNOWN for reach in (0.5, 0.58)
    )
    assert not nearest.all()
    assert wider.all()


# --- filling


@settings(max_examples=60, deadline=None)
@given(seeds, shapes, st.sampled_from([0.1, 0.5, 0.9, 1.0]))
def test_fill_background(seed: int, shape: Shape, holes: float) -> None:
    disparity = some_maps(np.random.default_rng(seed), 1, shape, holes)[0]
    filled = disparity.copy()
    in_bands(shape[0], filled, lambda *band: view_depth.fill_background(filled, -9.0, *band))
    np.testing.assert_array_equal(filled, twins.fill_background(disparity, -9.0))
    assert (filled > -100).all()


# --- colour


@pytest.mark.parametrize("shape", SHAPES)
def test_split_luma(shape: Shape) -> None:
    border = view_fetch.BORDER
    picture = np.random.default_rng(3).integers(0, 256, (*shape, 3), dtype=np.uint8)
    size = shape[0] + 2 * border, shape[1] + 2 * border
    pairs, colour = np.full((2, *size, 2), -9, np.int16)
    view_planes.split_luma(picture, pairs, colour)
    luma, differences = twins.split_luma(picture, border)
    below = np.concatenate([luma[1:], luma[-1:]])
    for found, expected in ((pairs, np.stack([luma, below], axis=-1)), (colour, differences)):
        np.testing.assert_allclose(found / view_vectors.LEVELS, expected, atol=0.51 / view_vectors.LEVELS)


@pytest.mark.parametrize("sharpness", [-1.0, -0.7, 0.0])
def test_weights_of_a_fetch_sum_up_to_one(sharpness: float) -> None:
    weights = view_vectors.fetch_weights(sharpness).reshape(-1, view_vectors.SHARES).astype(int)
    assert (weights[:, :16].sum(axis=1) == view_vectors.ONE).all()
    assert (weights[:, 16:].sum(axis=1) == 2 * view_vectors.ONE).all()
    # The first place is the pixel itself: second row, second column.
    assert weights[0, 3] == view_vectors.ONE


def test_the_twins_know_how_fine_a_fetch_is() -> None:
    assert twins.STEPS == view_vectors.STEPS


def fetchable(disparity: FloatMap, tolerance: float) -> FloatMap:
    """The twin of `mark_contours`."""
    wide, inner = twins.spread(disparity, 1, 2), twins.spread(disparity, 0, 1)
    marked = np.where((wide > 2 * tolerance) | (inner > tolerance), view_fetch.CONTOUR, disparity)
    return np.asarray(np.pad(marked, view_fetch.BORDER, mode="edge"), np.float32)


@settings(max_examples=40, deadline=None)
@given(seeds, shapes, st.sampled_from([0.5, 1.5]))
def test_mark_contours(seed: int, shape: Shape, tolerance: float) -> None:
    rng = np.random.default_rng(seed)
    disparity = smoother(some_maps(rng, 1, shape), rng)[0]
    found = np.full((shape[0] + 2 * view_fetch.BORDER, shape[1] + 2 * view_fetch.BORDER), np.nan, np.float32)
    view_planes.mark_contours(disparity, tolerance, found)
    np.testing.assert_array_equal(found, fetchable(disparity, tolerance))


def planes_of(sources: list[twins.Source], tolerance: float) -> Planes:
    """The arrays that `blend` takes."""
    split = [twins.split_luma(source.picture, view_fetch.BORDER) for source in sources]
    planes = view_planes.make_room(len(sources), *sources[0].disparity.shape)
    planes[0][:] = in_pairs(np.array([luma for luma, _ in split]))
    planes[1][:] = in_steps(np.array([colour for _, colour in split]))
    planes[2][:] = [source.disparity for source in sources]
    planes[3][:] = [fetchable(source.disparity, tolerance) for source in sources]
    return planes


def check_blend(rng: np.random.Generator, shape: Shape, count: int, chosen: LayeredSettings) -> Mask:
    """Compare on random input; returns which pixels some camera sees."""
    maps = smoother(some_maps(rng, count + 1, shape), rng)
    # Cameras beside a view and above it have kernels of their own: a third of all shifts is 0.
    shifts = rng.integers(-8, 9, (count, 2)) * (rng.random((count, 2)) < 2 / 3) / 8
    sources = [
        twins.Source(
            rng.integers(0, 256, (*shape, 3), dtype=np.uint8),
            disparity,
            (float(right), float(down)),
            float(rng.integers(1, 17) / 16),
        )
        for disparity, (right, down) in zip(maps[1:], shifts, strict=True)
    ]
    view, tolerance = maps[0], chosen.tolerance_px
    pixels = np.full((*shape, 3), 77, np.uint8)
    seen_by = np.full(shape, 99, np.uint8)
    # The cameras of a view are some of all: here every other one, from the last to the first.
    crowd = [sources[i // 2] for i in range(2 * count)][::-1]
    arguments = (
        np.arange(0, 2 * count, 2),
        planes_of(crowd, tolerance),
        np.array([source.shift for source in sources[::-1]], np.float32),
        np.array([source.weight for source in sources[::-1]], np.float32),
        view,
        tolerance,
        chosen.edge_trust,
        chosen.sharpness,
        view_vectors.fetch_weights(chosen.sharpness),
        pixels,
        seen_by,
    )
    in_bands(shape[0], pixels, lambda *band: view_colour.blend(*arguments, *band))
    expected, expected_seen = twins.blend(sources, view, chosen)
    np.testing.assert_array_equal(seen_by, expected_seen)
    # Half a level where a byte is rounded; the rest is what planes and weights in whole numbers leave.
    assert np.abs(pixels - expected).max() <= 0.55
    return np.asarray(seen_by > 0)


@settings(max_examples=40, deadline=None)
@given(
    seeds,
    st.tuples(st.integers(1, 20), st.integers(1, 20)),
    st.integers(1, 4),
    st.sampled_from([0.5, 1.5]),
    st.tuples(st.sampled_from([0.25, 1.0]), st.sampled_from([-1.0, -0.65, 0.0])),
)
def test_blend(seed: int, shape: Shape, count: int, tolerance: float, fetch: tuple[float, float]) -> None:
    chosen = LayeredSettings(tolerance_px=tolerance, edge_trust=fetch[0], sharpness=fetch[1])
    check_blend(np.random.default_rng(seed), shape, count, chosen)


@pytest.mark.parametrize("shape", SHAPES)
def test_blend_of_every_shape(shape: Shape) -> None:
    seen = [check_blend(np.random.default_rng(seed), shape, 4, LayeredSettings()) for seed in range(8)]
    assert 0 < np.mean(seen) < 1 or shape == (1, 1)


@settings(max_examples=40, deadline=None)
@given(seeds, shapes, st.sampled_from([0.05, 0.5, 0.9, 1.0]), st.integers(1, 9))
def test_paint_holes(seed: int, shape: Shape, holes: float, reach: int) -> None:
    rng = np.random.default_rng(seed)
    disparity = some_maps(rng, 1, shape)[0]
    picture = rng.integers(0, 256, (*shape, 3), dtype=np.uint8)
    seen_by = (rng.random(shape) >= holes).astype(np.uint8)
    picture[seen_by == 0] = 0
    expected = twins.paint_holes(picture, disparity, seen_by, 1.5, reach)
    arguments = picture, disparity, seen_by, 1.5, reach
    in_bands(shape[0], picture, lambda *band: view_holes.paint_holes(*arguments, *band))
    assert np.abs(picture.astype(int) - expected).max() <= 1
    np.testing.assert_array_equal(picture[seen_by > 0], expected[seen_by > 0])


@pytest.mark.parametrize("width", [1, 31, 32, 33, 100])
@pytest.mark.parametrize("share", [0.0, 0.05, 1.0])
def test_list_marked(width: int, share: float) -> None:
    marks = (np.random.default_rng(width).random(width) < share).astype(np.uint8)
    chosen = np.full(width, -1, np.int32)
    count = view_marks.list_marked(marks, chosen)
    np.testing.assert_array_equal(chosen[:count], np.flatnonzero(marks))
