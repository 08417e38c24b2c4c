"""Sub-pixel refinement by the pictures: on waves that are known between their pixels."""

from __future__ import annotations

import numpy as np
import pytest
import subpixel_twin
from numpy.typing import NDArray

from mvcodec.frames import FloatMap
from mvcodec.kernels.subpixel_pull import add_pull
from mvcodec.stereo.subpixel import MOST_PX, refine

HEIGHT, WIDTH = 48, 56
INNER = np.s_[10:-10, 10:-10]  # partners see all of it, and windows do not reach what they miss
EVERY = np.ones((HEIGHT, WIDTH), np.bool_)
TRUE_PX = 3.37

STEPS = {
    "right": [(1, 0)],
    "left": [(-1, 0)],
    "lower": [(0, 1)],
    "upper": [(0, -1)],
    "right and lower, rho 2": [(1, 0), (0, 2)],
    "all four": [(-1, 0), (1, 0), (0, -1), (0, 1)],
}


def waves(x: NDArray[np.floating], y: NDArray[np.floating]) -> FloatMap:
    """Grey at any place: six waves of 6 to 9 px, of all directions."""
    rng = np.random.default_rng(1)
    grey = np.full(np.broadcast_shapes(x.shape, y.shape), 127.0)
    for direction in np.linspace(0, np.pi, 6, endpoint=False) + 0.2:
        frequency, phase = 2 * np.pi / rng.uniform(6, 9), rng.uniform(0, 2 * np.pi)
        grey += 18 * np.sin(frequency * (np.cos(direction) * x + np.sin(direction) * y) + phase)
    return grey.astype(np.float32)


def seen(by_x: float, by_y: float, disparity: float = TRUE_PX) -> FloatMap:
    """The picture of a partner of a surface of one disparity."""
    return waves(np.arange(WIDTH)[None] + by_x * disparity, np.arange(HEIGHT)[:, None] + by_y * disparity)


def flat(disparity: float) -> FloatMap:
    return np.full((HEIGHT, WIDTH), disparity, np.float32)


def refined(
    start: FloatMap, steps: list[tuple[float, float]], *, times: int = 1, partner_px: float = TRUE_PX
) -> FloatMap:
    partners = [(seen(*step), flat(partner_px)) for step in steps]
    for _ in range(times):
        start = refine(start, EVERY, seen(0, 0), partners, np.array(steps, np.float32))
    return start


@pytest.mark.parametrize("steps", list(STEPS.values()), ids=list(STEPS))
@pytest.mark.parametrize("error", [-0.3, 0.3])
def test_two_steps_find_the_true_disparity(steps: list[tuple[float, float]], error: float) -> None:
    found = refined(flat(TRUE_PX + error), steps, times=2)
    assert found.dtype == np.float32
    # OpenCV's bicubic is not exact between pixels: what it reads is up to 0.03 px beside.
    assert np.abs(found - TRUE_PX)[INNER].mean() < 0.05
    assert np.quantile(np.abs(found - TRUE_PX)[INNER], 0.8) < 0.06


@pytest.mark.parametrize("steps", list(STEPS.values()), ids=list(STEPS))
def test_the_true_disparity_stays(steps: list[tuple[float, float]]) -> None:
    assert np.abs(refined(flat(TRUE_PX), steps) - TRUE_PX)[INNER].max() < 0.05


@pytest.mark.parametrize("error", [-0.3, 0.3])
def test_half_a_baseline_tells_half_as_much(error: float) -> None:
    found = refined(flat(TRUE_PX + error), [(0, -0.5)], times=4)
    assert np.abs(found - TRUE_PX)[INNER].mean() < 0.1


def test_every_pixel_follows_its_own_surface() -> None:
    start = flat(TRUE_PX)
    start[:, : WIDTH // 2] += 0.3
    start[:, WIDTH // 2 :] -= 0.3
    found = refined(start, [(1, 0), (0, 1)], times=2)
    away_from_the_step = np.r_[10 : WIDTH // 2 - 6, WIDTH // 2 + 6 : WIDTH - 10]
    assert np.abs(found - TRUE_PX)[10:-10, away_from_the_step].mean() < 0.05


def test_one_step_goes_no_farther_than_its_limit() -> None:
    found = refined(flat(TRUE_PX - 0.9), [(1, 0), (0, 1)])
    change = (found - np.float32(TRUE_PX - 0.9))[INNER]
    assert change.max() == pytest.approx(MOST_PX, abs=1e-5)
    assert np.median(change) > 0.3


def test_invalid_pixels_do_not_change() -> None:
    valid = np.random.default_rng(2).uniform(size=EVERY.shape) < 0.5
    start = flat(TRUE_PX + 0.3)
    found = refine(start, valid, seen(0, 0), [(seen(1, 0), flat(TRUE_PX))], np.array([(1, 0)], np.float32))
    assert (found[~valid] == start[~valid]).all()
    assert (found[INNER] != start[INNER])[valid[INNER]].mean() > 0.95
    assert (start == flat(TRUE_PX + 0.3)).all()


@pytest.mark.parametrize("partner_px", [TRUE_PX - 5, TRUE_PX + 5])
def test_partner_on_another_surface_has_no_say(partner_px: float) -> None:
    start = flat(TRUE_PX + 0.3)
    assert (refined(start, [(1, 0)], partner_px=partner_px) == start).all()


def test_partner_on_another_surface_does_not_spoil_what_the_other_says() -> None:
    steps = np.array([(1, 0), (0, 1)], np.float32)
    start = flat(TRUE_PX + 0.3)
    right, elsewhere = (seen(1, 0), flat(TRUE_PX)), (seen(7, 2, 9.0), flat(9.0))
    alone = refine(start, EVERY, seen(0, 0), [right], steps[:1])
    both = refine(start, EVERY, seen(0, 0), [right, elsewhere], steps)
    np.testing.assert_array_equal(both, alone)


def test_partner_of_another_brightness_has_little_say() -> None:
    steps = np.array([(1, 0), (-1, 0)], np.float32)
    brighter = seen(-1, 0) + 100
    partners = [(seen(1, 0), flat(TRUE_PX)), (brighter, flat(TRUE_PX))]
    found = flat(TRUE_PX + 0.3)
    for _ in range(3):
        found = refine(found, EVERY, seen(0, 0), partners, steps)
    assert np.abs(found - TRUE_PX)[INNER].mean() < 0.15
    assert np.abs(refine(flat(TRUE_PX), EVERY, seen(0, 0), partners[1:], steps[1:]) - TRUE_PX).mean() > 0.15


def test_nothing_is_learnt_from_beyond_the_frame() -> None:
    for by_x, by_y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        far = float(WIDTH + 8)
        partner = [(seen(by_x, by_y, far), flat(far))]
        found = refine(flat(far + 0.3), EVERY, seen(0, 0), partner, np.array([(by_x, by_y)], np.float32))
        assert (found == flat(far + 0.3)).all()


def test_texture_along_the_baseline_only_is_no_evidence() -> None:
    """Horizontal stripes look alike from every camera of a row, whatever their distance."""
    stripes = np.broadcast_to(seen(0, 0)[:, :1], (HEIGHT, WIDTH)).copy()
    start = flat(TRUE_PX + 0.3)
    across = refine(start, EVERY, stripes, [(stripes, flat(TRUE_PX))], np.array([(1, 0)], np.float32))
    np.testing.assert_allclose(across, start, atol=1e-3)
    lower = np.broadcast_to(seen(0, 1)[:, :1], (HEIGHT, WIDTH)).copy()
    down = refine(start, EVERY, stripes, [(lower, flat(TRUE_PX))], np.array([(0, 1)], np.float32))
    assert np.abs(down - TRUE_PX)[INNER].mean() < 0.1


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1)], ids=str)
def test_survives_tiny_pictures(size: tuple[int, int]) -> None:
    grey = np.random.default_rng(3).uniform(0, 255, size).astype(np.float32)
    start = np.full(size, 0.4, np.float32)
    steps = np.array([(1, 0), (0, 1)], np.float32)
    found = refine(start, np.ones(size, np.bool_), grey, [(grey, start)] * 2, steps)
    assert np.isfinite(found).all()
    assert np.abs(found - start).max() <= MOST_PX + 1e-6


@pytest.mark.parametrize("size", [(6, 9), (1, 1), (1, 7), (5, 1), (9, 70)], ids=str)
@pytest.mark.parametrize("slope", [5.0, 0.02])
@pytest.mark.parametrize(("along_rows", "step"), [(True, 1.0), (True, -1.0), (False, 0.5), (False, -2.0)])
def test_pull_equals_its_plain_twin(
    size: tuple[int, int], slope: float, along_rows: bool, step: float
) -> None:
    rng = np.random.default_rng(8)
    # Where it changes little, neighbours are seen side by side.
    disparity = rng.uniform(0.5 - slope / 2, 0.5 + slope / 2, size).astype(np.float32)
    grey, *other = rng.uniform(0, 80, (3, *size)).astype(np.float32)
    seen = rng.uniform(-2, 3, size).astype(np.float32)
    pull, weight = np.zeros(size, np.float32), np.zeros(size, np.float32)
    arguments = disparity, grey, other[0], other[1] - 40, seen, along_rows, step, 1.5, 10.0
    add_pull(*arguments, pull, weight)
    of_partner = other[0], other[1] - 40, seen
    expected = subpixel_twin.add_pull(disparity, grey, of_partner, along_rows, step, 1.5, 10.0)
    np.testing.assert_allclose(pull, expected[0], rtol=2e-3, atol=1e-2)
    np.testing.assert_allclose(weight, expected[1], rtol=2e-3, atol=1e-2)
