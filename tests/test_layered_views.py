"""The default renderer on whole scenes: as its twin does, alike from both sides, the same in every thread."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
import view_twins as twins
from layered_scenes import render, room, with_disparities
from numpy.typing import NDArray
from plane_scene import grid

from mvcodec.array import Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.evaluation.metrics import luma, psnr
from mvcodec.frames import DecodedSet
from mvcodec.synthesis.layered import Layered, LayeredSettings

Turn = Callable[[NDArray[np.generic]], NDArray[np.generic]]


@pytest.mark.parametrize("seed", range(4))
def test_whole_views_against_the_twin(seed: int) -> None:
    """Maps that don't fit each other: random boxes at random disparities in every camera."""
    rng = np.random.default_rng(seed)
    array = [grid(2, 2, 23, 17), grid(1, 2, 20, 15), grid(2, 1, 14, 19), grid(3, 3, 17, 16, rho=0.6)][seed]
    pictures = {c: rng.integers(0, 256, (array.height, array.width, 3), dtype=np.uint8) for c in array.real}
    values = {}
    for camera in array.real:
        values[camera] = np.full((array.height, array.width), rng.uniform(-2, 0), np.float32)
        for d in rng.uniform(-6, 9, 3):
            top, left = rng.integers(0, array.height - 6), rng.integers(0, array.width - 6)
            values[camera][top : top + rng.integers(4, 12), left : left + rng.integers(4, 12)] = d
    decoded = with_disparities(DecodedSet(array, 0, 0, pictures, {}, (-6.0, 9.0)), values)
    chosen = LayeredSettings(hole_reach_px=5)
    for _ in range(2):
        viewpoint = Viewpoint(rng.uniform(0, array.rows - 1), rng.uniform(0, array.cols - 1))
        view = Layered(chosen).render(decoded, viewpoint)
        colours, disparity, seen_by, painted = twins.render(decoded, viewpoint, chosen)
        np.testing.assert_allclose(view.disparity_px, disparity, atol=1e-4)
        np.testing.assert_array_equal(view.seen_by, seen_by)
        np.testing.assert_allclose(view.pixels[~painted], colours[~painted], atol=0.52)
        np.testing.assert_allclose(view.pixels[painted], colours[painted], atol=1.01)


def turned(
    decoded: DecodedSet, turn: Turn, place: Callable[[float, float], tuple[float, float]]
) -> DecodedSet:
    def there(camera: Position) -> Position:
        row, col = place(*camera)
        return int(row), int(col)

    flipped = {c: np.ascontiguousarray(turn(p), np.uint8) for c, p in decoded.pictures.items()}
    maps = {c: np.ascontiguousarray(turn(d.values_px), np.float32) for c, d in decoded.disparities.items()}
    height, width = next(iter(maps.values())).shape
    array = replace(decoded.array, width=width, height=height)
    pictures = {there(camera): picture for camera, picture in flipped.items()}
    bare = replace(decoded, array=array, pictures=pictures, disparities={})
    return with_disparities(bare, {there(camera): map_ for camera, map_ in maps.items()})


@pytest.mark.parametrize("way", ["left-right", "up-down", "transposed"])
def test_a_turned_array_gives_turned_views(way: str) -> None:
    decoded, _ = room(3, 3, 2)
    turns: dict[str, tuple[Turn, Callable[[float, float], tuple[float, float]]]] = {
        "left-right": (lambda picture: picture[:, ::-1], lambda row, col: (row, 2 - col)),
        "up-down": (lambda picture: picture[::-1], lambda row, col: (2 - row, col)),
        "transposed": (lambda picture: picture.swapaxes(0, 1), lambda row, col: (col, row)),
    }
    turn, place = turns[way]
    for row, col in ((0.83, 1.27), (0.31, 0.71), (1.39, 1.9)):
        view = render(decoded, row, col)
        other = render(turned(decoded, turn, place), *place(row, col))
        error = np.abs(turn(view.pixels).astype(int) - other.pixels.astype(int)).max(axis=2)
        assert (error > 1).mean() < 0.003
        assert error.mean() < 0.05


def test_the_order_of_cameras_is_nothing() -> None:
    decoded, _ = room(3, 3, 2)
    reverse = replace(
        decoded,
        pictures={c: decoded.pictures[c] for c in reversed(decoded.array.real)},
        disparities={c: decoded.disparities[c] for c in reversed(decoded.array.real)},
    )
    np.testing.assert_array_equal(render(decoded, 0.3, 1.1).pixels, render(reverse, 0.3, 1.1).pixels)


def test_nothing_jumps_at_the_borders_of_cells() -> None:
    """Views a five-hundredth of a step apart, on a border and on either side of it."""
    decoded, _ = room(5, 5, 2)
    for row, col in ((1, 2), (2, 1), (3, 2), (2, 3), (2.0001, 2)):
        border = render(decoded, row, col)
        for down, right in ((0.002, 0), (0, 0.002), (-0.002, 0), (0, -0.002)):
            beside = render(decoded, row + down, col + right)
            change = np.abs(border.pixels.astype(int) - beside.pixels)
            assert change.mean() < 0.3
            assert (change > 30).mean() < 0.001


def test_the_room_from_its_corners() -> None:
    decoded, truth = room(3, 3, 2)
    for place in set(truth) - set(decoded.pictures):
        picture, depth = truth[place]
        view = render(decoded, *place)
        assert psnr(luma(picture), luma(view.pixels)) > 35
        assert (np.abs(view.disparity_px - depth) > 1).mean() < 0.02
        assert (view.seen_by > 0).mean() > 0.99


def test_threads_share_one_renderer() -> None:
    first, _ = room(3, 3, 2)
    second = replace(first, pictures={c: 255 - p for c, p in first.pictures.items()})
    jobs = [(s, Viewpoint(r, c)) for r in (0.4, 1, 1.7) for c in (0, 0.6, 1.3) for s in (first, second)]
    alone = [Layered().render(decoded, viewpoint) for decoded, viewpoint in jobs]
    for order in (jobs, sorted(jobs, key=lambda job: job[0] is first)):
        renderer = Layered()
        with ThreadPoolExecutor(8) as pool:
            futures = [pool.submit(renderer.render, *job) for job in order * 2]
            together = [future.result() for future in futures]
        for job, view in zip(order * 2, together, strict=True):
            expected = alone[jobs.index(job)]
            np.testing.assert_array_equal(view.pixels, expected.pixels)
            np.testing.assert_array_equal(view.disparity_px, expected.disparity_px)
            np.testing.assert_array_equal(view.seen_by, expected.seen_by)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("tolerance_px", 0.0, "0.001..1000"),
        ("ratio", 0.99, "1..1000"),
        ("reach_px", 0.49, "0.5..1"),
        ("reach_px", 1.01, "0.5..1"),
        ("spread", 0.0, "0.001..1000"),
        ("edge_trust", 1.5, "0.001..1"),
        ("sharpness", 0.1, "-1..0"),
        ("hole_reach_px", 0, "1..4096"),
        ("tolerance_px", float("nan"), "0.001..1000"),
    ],
)
def test_settings_are_checked(name: str, value: float, expected: str) -> None:
    with pytest.raises(SettingError) as error:
        LayeredSettings(**{name: value})  # type: ignore[arg-type]
    kind = "whole " if name == "hole_reach_px" else ""
    assert str(error.value).startswith(
        f"LayeredSettings.{name}: found {value}, expected a {kind}number, {expected}"
    )
