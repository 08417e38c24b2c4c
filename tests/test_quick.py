"""The quick synthesizer: its loops against plain twins, what it shares with the default one, and its room."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Viewpoint
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import FloatMap, Picture
from mvcodec.kernels import quick_runs, view_planes, view_quick
from mvcodec.synthesis.layered import Layered
from mvcodec.synthesis.quick import Quick
from mvcodec.synthesis.synthesizers import QUICKER, SYNTHESIZERS

Shape = tuple[int, int]
SHAPES = [(1, 1), (1, 13), (13, 1), (2, 3), (9, 11), (3, 37), (2, 32)]
TOLERANCE = 1.5


def fetch_twin(picture: Picture, x: float, y: float) -> NDArray[np.float64]:
    """Bilinear at a place rounded to 1 / STEPS px, then rounded to whole grey levels."""
    height, width = picture.shape[:2]
    x, y = (np.floor(value * quick_runs.STEPS + 0.5) / quick_runs.STEPS for value in (x, y))
    left, top = int(x), int(y)
    right, low = min(left + 1, width - 1), min(top + 1, height - 1)
    above = (left + 1 - x) * picture[top, left] + (x - left) * picture[top, right]
    below = (left + 1 - x) * picture[low, left] + (x - left) * picture[low, right]
    return np.asarray(np.floor((top + 1 - y) * above + (y - top) * below + 0.5))


def blend_twin(
    pictures: list[Picture],
    maps: NDArray[np.float32],
    shifts: NDArray[np.float32],
    weights: list[int],
    view: FloatMap,
) -> tuple[Picture, NDArray[np.uint8]]:
    height, width = view.shape
    out, seen_by = np.zeros((height, width, 3), np.uint8), np.zeros((height, width), np.uint8)
    for y, x in np.ndindex(height, width):
        total, colour = 0, np.zeros(3)
        for picture, own, shift, weight in zip(pictures, maps, shifts, weights, strict=True):
            at_x, at_y = x + shift[0] * view[y, x], y + shift[1] * view[y, x]
            if not (-0.5 < at_x < width - 0.5 and -0.5 < at_y < height - 0.5):
                continue
            at_x, at_y = min(max(at_x, 0), width - 1), min(max(at_y, 0), height - 1)
            if abs(own[int(at_y + 0.5), int(at_x + 0.5)] - view[y, x]) > TOLERANCE:
                continue
            total += weight
            colour += weight * fetch_twin(picture, at_x, at_y)
            seen_by[y, x] += 1
        if total:
            out[y, x] = np.floor(colour / total + 0.5)
    return out, seen_by


def room(count: int, shape: Shape) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
    wider = count, shape[0] + 1, shape[1] + 1
    return view_planes.reserve(wider, np.dtype(np.uint32)), view_planes.reserve(wider, np.dtype(np.float32))


def check_blend(seed: int, shape: Shape, count: int) -> None:
    rng = np.random.default_rng(seed)
    # Multiples of 1/16 px, so that the twin rounds as the loop does.
    surfaces = rng.integers(-48, 49, 3) / 16
    maps = np.asarray(rng.choice(surfaces, (count + 1, *shape)), np.float32)
    pictures = [rng.integers(0, 256, (*shape, 3), dtype=np.uint8) for _ in range(count)]
    shifts = np.asarray(rng.integers(-1, 2, (count, 2)), np.float32)
    weights = [int(weight) for weight in rng.integers(1, 1 + view_quick.WEIGHTS // count, count)]
    # The cameras of a view are some of all, in any order: here every other one, the last first.
    packed, own = room(2 * count, shape)
    cameras = np.arange(2 * count - 2, -1, -2)
    for camera, picture, disparity in zip(cameras, pictures[::-1], maps[:0:-1], strict=True):
        view_quick.pack(picture, disparity, packed[camera], own[camera])
    out, seen_by = np.full((*shape, 3), 77, np.uint8), np.full(shape, 99, np.uint8)
    cut = shape[0] // 3
    for first, last in ((cut, shape[0]), (0, cut)):
        view_quick.blend(
            cameras,
            packed,
            own,
            shifts[::-1].copy(),
            np.array(weights[::-1], np.uint64),
            maps[0],
            TOLERANCE,
            out,
            seen_by,
            first,
            last,
        )
    expected, expected_seen = blend_twin(pictures, maps[1:], shifts, weights, maps[0])
    np.testing.assert_array_equal(seen_by, expected_seen)
    assert np.abs(out.astype(int) - expected).max() <= 1  # a mean that lies between two levels


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.tuples(st.integers(1, 14), st.integers(1, 14)), st.integers(1, 4))
def test_blend(seed: int, shape: Shape, count: int) -> None:
    check_blend(seed, shape, count)


@pytest.mark.parametrize("shape", SHAPES)
def test_blend_of_every_shape(shape: Shape) -> None:
    for seed in range(6):
        check_blend(seed, shape, 4)


def test_white_stays_white_at_full_weight() -> None:
    shape = (3, 4)
    packed, own = room(4, shape)
    for camera in range(4):
        view_quick.pack(
            np.full((*shape, 3), 255, np.uint8), np.zeros(shape, np.float32), packed[camera], own[camera]
        )
    out, seen_by = np.empty((*shape, 3), np.uint8), np.empty(shape, np.uint8)
    view = np.zeros(shape, np.float32)
    weights = np.full(4, view_quick.WEIGHTS // 4, np.uint64)
    shifts = np.zeros((4, 2), np.float32)
    view_quick.blend(np.arange(4), packed, own, shifts, weights, view, 1.0, out, seen_by, 0, 3)
    assert (out == 255).all()
    assert (seen_by == 4).all()


def scene(frame_seed: int, size: tuple[int, int] = (96, 64)) -> PlaneScene:
    return PlaneScene(grid(3, 3, *size, step=2), frame_seed, (Plane(9, (20, 40, 50, 80)),))


def test_resembles_the_view_that_it_stands_in_for() -> None:
    assert all(name in SYNTHESIZERS for name in (*QUICKER, *QUICKER.values()))
    decoded, place = scene(3).decoded(), Viewpoint(0.9, 1.2)
    fine, quick = Layered().render(decoded, place), Quick().render(decoded, place)
    inside = slice(8, -8), slice(8, -8)
    assert np.median(np.abs(fine.disparity_px - quick.disparity_px)[inside]) < 0.01
    assert psnr(fine.pixels[inside], quick.pixels[inside]) > 25  # white noise: linear and cubic differ most


def test_keeps_nothing_of_another_set() -> None:
    quick = Quick()
    for seed, size in ((3, (96, 64)), (4, (96, 64)), (5, (61, 47)), (3, (96, 64))):
        decoded = scene(seed, size).decoded()
        for place in (Viewpoint(0.5, 1.5), Viewpoint(1.25, 0.5)):
            found, fresh = quick.render(decoded, place), Quick().render(decoded, place)
            np.testing.assert_array_equal(found.pixels, fresh.pixels)
            np.testing.assert_array_equal(found.disparity_px, fresh.disparity_px)
