"""Real cameras' pictures with less coding noise: what is taken out, and what stays as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Position, Viewpoint
from mvcodec.frames import DecodedSet, Picture
from mvcodec.kernels.camera_mixing import mix
from mvcodec.synthesis.cross_view import can_be_filtered
from mvcodec.synthesis.layered import Layered, LayeredSettings
from mvcodec.workers import threads

ERROR = 36.0


def noisy(rows: int, cols: int, step: int = 2) -> tuple[DecodedSet, DecodedSet]:
    """A scene of soft texture, and the same with independent noise of mean square ERROR in each camera."""
    scene = PlaneScene(grid(rows, cols, 67, 45, step=step), 2, (Plane(6, (8, 12, 30, 40)),))
    for texture in scene.textures:
        texture[:] = 60 + texture // 2
    clean = scene.decoded()
    rng = np.random.default_rng(7)

    def spoiled(picture: Picture) -> Picture:
        noise = rng.normal(0, ERROR**0.5, picture.shape[:2])[..., None]
        return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)

    pictures = {camera: spoiled(picture) for camera, picture in clean.pictures.items()}
    return clean, replace(clean, pictures=pictures, coding_error=ERROR)


def shown(decoded: DecodedSet, camera: Position, strength: float = 0.5) -> Picture:
    return Layered(LayeredSettings(filter=strength)).render(decoded, Viewpoint(*camera)).pixels


def error(picture: Picture, truth: Picture) -> float:
    return float(np.mean((picture.astype(np.float64) - truth) ** 2))


@pytest.mark.parametrize("shape", [(1, 3), (3, 1), (3, 3), (5, 5)])
def test_noise_that_each_camera_has_of_its_own_is_taken_out(shape: tuple[int, int]) -> None:
    clean, decoded = noisy(*shape)
    for camera in clean.array.real:
        before = error(decoded.pictures[camera], clean.pictures[camera])
        assert error(shown(decoded, camera), clean.pictures[camera]) < 0.8 * before


def test_pictures_stay_as_decoded_where_nothing_is_known_or_asked_for() -> None:
    _, decoded = noisy(3, 3)
    camera = decoded.array.real[0]
    own = decoded.pictures[camera]
    np.testing.assert_array_equal(shown(replace(decoded, coding_error=None), camera), own)
    np.testing.assert_array_equal(shown(replace(decoded, coding_error=0.0), camera), own)
    np.testing.assert_array_equal(shown(decoded, camera, strength=0), own)
    np.testing.assert_array_equal(shown(replace(decoded, absent=(camera,)), camera), own)
    np.testing.assert_array_equal(shown(replace(decoded, absent=decoded.array.real[1:]), camera), own)


def test_other_cameras_that_see_something_else_are_not_believed() -> None:
    clean, decoded = noisy(1, 3)
    first, other = clean.array.real
    strange = {first: decoded.pictures[first], other: 255 - decoded.pictures[other]}
    before = error(decoded.pictures[first], clean.pictures[first])
    assert error(shown(replace(decoded, pictures=strange), first), clean.pictures[first]) < 1.1 * before


def test_missing_cameras_are_not_asked() -> None:
    _, decoded = noisy(3, 3)
    first, other, *_ = decoded.array.real
    strange = {**decoded.pictures, other: np.zeros_like(decoded.pictures[other])}
    without = replace(decoded, pictures=strange, absent=(other,))
    with_it = replace(decoded, absent=(other,))
    np.testing.assert_array_equal(shown(without, first), shown(with_it, first))


def test_a_single_camera_has_none_to_ask() -> None:
    _, decoded = noisy(1, 1, step=1)
    assert not can_be_filtered(decoded, (0, 0))
    np.testing.assert_array_equal(shown(decoded, (0, 0)), decoded.pictures[0, 0])


@pytest.mark.parametrize("count", [2, 3, 8])
def test_any_number_of_threads_gives_the_same_picture(count: int) -> None:
    _, decoded = noisy(3, 3)
    with threads(1):
        expected = shown(decoded, (0, 0))
    with threads(count):
        np.testing.assert_array_equal(shown(decoded, (0, 0)), expected)


def mix_twin(
    own: Picture,
    others: Picture,
    seen_by: NDArray[np.uint8],
    squares: NDArray[np.float32],
    counts: NDArray[np.float32],
    part: float,
    most: float,
) -> Picture:
    mean = np.divide(squares, counts, out=np.zeros_like(squares), where=counts > 0)
    weights = np.full_like(mean, most)
    np.divide(np.float32(part), mean, out=weights, where=mean > 0)
    weights = np.where(seen_by > 0, np.minimum(weights, np.float32(most)), np.float32(0))
    moved = own + weights[..., None] * (others.astype(np.float32) - own)
    return np.asarray(np.floor(moved + np.float32(0.5)), np.uint8)


@pytest.mark.parametrize("shape", [(1, 1), (5, 3), (17, 31)])
@pytest.mark.parametrize("seen", [0, 3])
def test_the_kernel_does_as_its_twin(shape: tuple[int, int], seen: int) -> None:
    rng = np.random.default_rng(shape[0] + seen)
    own, others = (rng.integers(0, 256, (*shape, 3), dtype=np.uint8) for _ in range(2))
    seen_by = rng.integers(0, seen + 1, shape, dtype=np.uint8)
    counts = rng.integers(1, 82, shape).astype(np.float32)
    squares = np.where(rng.random(shape) < 0.2, 0, rng.integers(0, 5000, shape)).astype(np.float32)
    found = np.zeros_like(own)
    rows = shape[0] // 2
    mix(own, others, seen_by, squares, counts, 9.0, 0.7, found, 0, rows)
    mix(own, others, seen_by, squares, counts, 9.0, 0.7, found, rows, shape[0])
    expected = mix_twin(own, others, seen_by, squares, counts, 9.0, 0.7)
    # Products are rounded in another order: half a grey level falls to either side.
    assert np.abs(found.astype(int) - expected).max() <= 1
    assert np.mean(found != expected) < 0.02
