"""The renderer's kernels against plain NumPy: ray by ray, from the definitions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import skimage
from numpy.typing import NDArray

from mvcodec.kernels.illumination import Rays, Solids, find_blocked, gather_light
from mvcodec.kernels.texture import filtered, light_at
from mvcodec.scenes.lighting import LightBaker, Lighting, LightMaps
from mvcodec.scenes.renderer import LitScene, Optics
from mvcodec.scenes.solids import Rectangle, Shape, Sphere, Surface, box, floor, rectangle, rolled, spun
from mvcodec.scenes.textures import PHOTOGRAPHS, photograph, pyramids

Vectors = NDArray[np.float64]
OPTICS = Optics(60, 40, 60.0)


def some_shapes() -> list[Shape]:
    """A wall, a floor, a turned box and two spheres that hide each other in part."""
    return [
        rectangle((0.0, 0.0, 6.0), 9.0, 7.0, Surface("coffee")),
        floor((-4.0, 4.0), (0.3, 6.0), 0.8, Surface("gravel", (0, 0, 3, 2))),
        *box((-0.5, 0.4, 3.0), (0.7, 0.6, 0.5), Surface("chelsea"), yaw=0.6),
        Sphere((0.5, 0.1, 3.2), 0.4, Surface("astronaut"), spun(0.4)),
        Sphere((0.8, -0.1, 2.7), 0.25, Surface("moon"), rolled(1.0)),
    ]


def flat_light(shapes: Sequence[Shape], factor: float = 1.0) -> LightMaps:
    """The same light everywhere."""
    sizes = np.ones((len(shapes), 2), np.int64)
    return LightMaps(np.full((len(shapes), 3), factor, np.float32), sizes)


def cast(shape: Shape, eye: Vectors, directions: Vectors) -> tuple[Vectors, Vectors]:
    """Plain twin: depth along each direction (..., 3) (inf: missed) and the point of sight."""
    if isinstance(shape, Rectangle):
        normal = np.cross(shape.across, shape.down)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = ((shape.corner - eye) @ normal) / (directions @ normal)
            points = eye + depth[..., None] * directions
            u = (points - shape.corner) @ shape.across / (shape.across @ shape.across)
            v = (points - shape.corner) @ shape.down / (shape.down @ shape.down)
            hit = (depth > 0) & (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
    else:
        centre = np.array(shape.centre) - eye
        a, b = (directions**2).sum(-1), directions @ centre
        root = b**2 - a * (centre @ centre - shape.radius**2)
        with np.errstate(invalid="ignore"):
            depth = (b - np.sqrt(root)) / a
        points = eye + depth[..., None] * directions
        hit = (root >= 0) & (depth > 0)
    return np.where(hit, depth, np.inf), points


def directions_of(optics: Optics, factor: int = 1) -> Vectors:
    """Through the centres of the pixels, or of factor x factor parts of each."""
    cx, cy = optics.centre_px
    offset = (factor - 1) / (2 * factor)
    y, x = np.mgrid[: optics.height * factor, : optics.width * factor] / factor - offset
    return np.stack([(x - cx) / optics.focal_px, (y - cy) / optics.focal_px, np.ones_like(x)], axis=-1)


def texture_place(shape: Shape, points: Vectors) -> tuple[Vectors, Vectors]:
    """Plain twin: u, v in sizes of the photograph."""
    if isinstance(shape, Rectangle):
        u = (points - shape.corner) @ shape.across / (shape.across @ shape.across)
        v = (points - shape.corner) @ shape.down / (shape.down @ shape.down)
    else:
        globe = ((points - np.array(shape.centre)) / shape.radius) @ shape.turn.T
        u = np.arctan2(globe[..., 0], globe[..., 2]) / (2 * np.pi) + 0.5
        v = np.arccos(np.clip(globe[..., 1], -1, 1)) / np.pi
    u0, v0, du, dv = shape.surface.window
    return u0 + u * du, v0 + v * dv


def mirrored(index: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    index = index % (2 * size)
    return np.where(index < size, index, 2 * size - 1 - index)


def brute_force(shapes: Sequence[Shape], optics: Optics, eye: Vectors, factor: int) -> Vectors:
    """Plain twin of the whole renderer: the mean of factor x factor point samples in each pixel."""
    directions = directions_of(optics, factor)
    colours = np.zeros(directions.shape)
    nearest = np.full(directions.shape[:2], np.inf)
    for shape in shapes:
        depth, points = cast(shape, eye, directions)
        seen = depth < nearest
        nearest[seen] = depth[seen]
        picture = photograph(shape.surface.photograph)
        height, width = picture.shape[:2]
        u, v = texture_place(shape, points[seen])
        x, y = (
            mirrored(np.floor(place * side).astype(int), side) for place, side in ((u, width), (v, height))
        )
        colours[seen] = picture[y, x] * np.array(shape.surface.tint)
    parts = colours.reshape(optics.height, factor, optics.width, factor, 3)
    return np.asarray(parts.mean(axis=(1, 3)))


@pytest.mark.parametrize("eye", [(0.0, 0.0, 0.0), (0.3, -0.2, 0.0)])
def test_depth_is_that_of_the_nearest_surface(eye: tuple[float, float, float]) -> None:
    shapes = some_shapes()
    _, inverse_depth = LitScene(shapes, flat_light(shapes)).render(OPTICS, eye)
    directions = directions_of(OPTICS)
    nearest = np.min([cast(shape, np.array(eye), directions)[0] for shape in shapes], axis=0)
    assert len(np.unique(nearest.round(2))) > 50
    np.testing.assert_allclose(inverse_depth, 1 / nearest, rtol=1e-6)


def test_pictures_are_close_to_brute_force_supersampling() -> None:
    shapes = some_shapes()
    picture, _ = LitScene(shapes, flat_light(shapes)).render(OPTICS, (0.1, 0.05, 0.0))
    expected = brute_force(shapes, OPTICS, np.array([0.1, 0.05, 0.0]), 16)
    error = picture - expected
    assert np.abs(error.mean(axis=(0, 1))).max() < 0.5
    # The filter is not a box over the pixel's square, but one sample a pixel is much farther off.
    aliased = brute_force(shapes, OPTICS, np.array([0.1, 0.05, 0.0]), 1) - expected
    assert np.sqrt((error**2).mean()) < 0.4 * np.sqrt((aliased**2).mean())


def test_nothing_is_black_and_what_is_behind_is_unseen() -> None:
    shapes: list[Shape] = [rectangle((0.0, 0.0, -2.0), 9.0, 9.0, Surface("coffee"))]
    shapes += [Sphere((0.0, 0.0, -3.0), 0.5, Surface("moon"), rolled(0.0))]
    picture, inverse_depth = LitScene(shapes, flat_light(shapes)).render(OPTICS, (0.0, 0.0, 0.0))
    assert not picture.any()
    assert not inverse_depth.any()


def test_a_surface_that_passes_the_camera_is_drawn() -> None:
    shapes: list[Shape] = [floor((-50.0, 50.0), (-5.0, 50.0), 0.8, Surface("gravel"))]
    _, inverse_depth = LitScene(shapes, flat_light(shapes)).render(OPTICS, (0.0, 0.0, 0.0))
    expected, _ = cast(shapes[0], np.zeros(3), directions_of(OPTICS))
    np.testing.assert_allclose(inverse_depth, 1 / expected, rtol=1e-6)
    assert (inverse_depth[-1] > 0).all()


def test_edges_are_smooth_and_turning_is_seen() -> None:
    white = Surface("coffee", (0.02, 0.02, 1e-4, 1e-4))
    edge: list[Shape] = [
        Rectangle(np.array([-1.0, -3.0, 3.0]), np.array([2.0, 0.9, 0]), np.array([-1.8, 4, 0]), white)
    ]
    picture, _ = LitScene(edge, flat_light(edge)).render(OPTICS, (0.0, 0.0, 0.0))
    levels = np.unique(picture[..., 0])
    assert 5 <= len(levels) <= 17  # 4 x 4 samples
    balls = [[Sphere((0.0, 0.0, 2.0), 0.5, Surface("brick"), rolled(angle))] for angle in (0.0, 0.5)]
    seen = [LitScene(ball, flat_light(ball)).render(OPTICS, (0.0, 0.0, 0.0))[0].astype(int) for ball in balls]
    assert np.abs(seen[0] - seen[1]).mean() > 1


# Textures


def test_texture_filter_is_bilinear_without_a_footprint() -> None:
    picture = photograph("chelsea")
    texels, levels = pyramids([photograph("moon"), picture])
    height, width = picture.shape[:2]
    for u, v in np.random.default_rng(2).uniform(-1, 2, (40, 2)):
        x, y = u * width - 0.5, v * height - 0.5
        left, top = int(np.floor(x)), int(np.floor(y))
        xs, ys = mirrored(np.array([left, left + 1]), width), mirrored(np.array([top, top + 1]), height)
        weights = np.outer([1 - (y - top), y - top], [1 - (x - left), x - left])
        expected = (picture[np.ix_(ys, xs)] * weights[..., None]).sum(axis=(0, 1))
        found = filtered(texels, levels, 1, u, v, 1e-6, 0.0, 0.0, 1e-6)
        np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("footprint", [(8, 8), (16, 16), (32, 4), (4, 32), (2, 8), (24, 8)])
def test_texture_filter_is_the_mean_over_whole_texels_of_a_level(footprint: tuple[int, int]) -> None:
    """Taps that fall on texels of one level add up to the mean over the footprint."""
    picture = photograph("astronaut")
    texels, levels = pyramids([picture])
    wide, high = footprint
    step = min(footprint)
    for x, y in np.random.default_rng(3).integers(0, (512 - 40) // step, (60, 2)) * step:
        expected = picture[y : y + high, x : x + wide].mean(axis=(0, 1))
        place = (x + wide / 2) / 512, (y + high / 2) / 512
        found = filtered(texels, levels, 0, *place, wide / 512, 0.0, 0.0, high / 512)
        np.testing.assert_allclose(found, expected, atol=2.0)


def test_pyramids_end_in_the_mean() -> None:
    texels, levels = pyramids([photograph("coffee"), photograph("moon")])
    for number, name in enumerate(("coffee", "moon")):
        start, width, height = levels[number, -1]
        assert (width, height) == (1, 1)
        assert np.abs(texels[start] - photograph(name).mean(axis=(0, 1))).max() < 3
        start, width, height = levels[number, 0]
        np.testing.assert_array_equal(
            texels[start : start + width * height].reshape(height, width, 3), photograph(name)
        )


@pytest.mark.parametrize("closed", [False, True])
def test_light_maps_are_bilinear(closed: bool) -> None:
    chance = np.random.default_rng(4)
    light = chance.uniform(0, 2, (5 + 6 * 4, 3)).astype(np.float32)
    maps = np.array([[0, 5, 1], [5, 6, 4]])
    grid = light[5:].reshape(4, 6, 3)
    grid = np.pad(grid, ((1, 1), (0, 0), (0, 0)), "edge")
    grid = np.pad(grid, ((0, 0), (1, 1), (0, 0)), "wrap" if closed else "edge")
    for u, v in chance.uniform(0, 1, (40, 2)):
        x, y = u * 6 + 0.5, v * 4 + 0.5
        left, top = int(x), int(y)
        weights = np.outer([1 - (y - top), y - top], [1 - (x - left), x - left])
        expected = (grid[top : top + 2, left : left + 2] * weights[..., None]).sum(axis=(0, 1))
        np.testing.assert_allclose(light_at(light, maps, 1, closed, u, v), expected, rtol=1e-5)


def test_every_photograph_lies_in_the_wheel() -> None:
    folder = Path(skimage.__file__).parent / "data"
    for name in PHOTOGRAPHS:
        assert list(folder.glob(f"{name}*")), name
        assert photograph(name).shape[2] == 3
        assert max(photograph(name).shape[:2]) <= 640


# Light


def some_solids() -> tuple[Solids, list[Shape]]:
    shapes = some_shapes()
    flat = [shape for shape in shapes if isinstance(shape, Rectangle)]
    round_ = [shape for shape in shapes if isinstance(shape, Sphere)]
    solids = Solids(
        np.array([shape.corner for shape in flat]),
        np.array([shape.normal for shape in flat]),
        np.array([shape.across / (shape.across @ shape.across) for shape in flat]),
        np.array([shape.down / (shape.down @ shape.down) for shape in flat]),
        np.array([[*shape.centre, shape.radius] for shape in round_]),
    )
    return solids, shapes


def test_light_is_that_of_the_free_rays() -> None:
    solids, shapes = some_solids()
    chance = np.random.default_rng(6)
    points = chance.uniform((-1, -0.4, 2.4), (1.2, 0.8, 4), (200, 3))
    normals = chance.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    lamp = chance.uniform((-1, -1, 1), (1, -0.5, 3), (8, 3))
    blocked = np.zeros((200, 9), np.bool_)
    rays = Rays(lamp, np.array([[0.0, 0.0, 1.0]]), 0.7)
    find_blocked(solids, points, normals, rays, blocked)
    out = np.empty((200, 2))
    gather_light(points, normals, lamp, blocked, out)
    assert 0.02 < blocked.mean() < 0.9
    for point, normal, (direct, free) in zip(points, normals, out, strict=True):
        start = point + 1e-4 * normal
        depths = np.min([cast(shape, start, normal[None])[0][0] for shape in shapes])
        assert free == (depths >= 0.7)
        total = 0.0
        for place in lamp:
            towards = place - point
            cosine = normal @ towards / np.linalg.norm(towards)
            hidden = np.min([cast(shape, start, (place - start)[None])[0][0] for shape in shapes]) < 1
            total += 0.0 if hidden else max(cosine, 0.0) / (towards @ towards)
        assert direct == pytest.approx(total / len(lamp), rel=1e-9)


def test_directions_are_turned_about_the_normal() -> None:
    """Rays to all sides of a surface, and a plate before one half of them."""
    from mvcodec.scenes.lighting import _rays

    rays = _rays(Lighting((0.0, -2.0, 0.0), (1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), samples=400))
    assert rays.around[:, 2].mean() == pytest.approx(2 / 3, abs=0.01)  # of the cosine's density
    np.testing.assert_allclose(np.linalg.norm(rays.around, axis=1), 1)
    np.testing.assert_allclose(rays.around[:, :2].mean(axis=0), 0, atol=0.02)
    for normal in np.eye(3).tolist() + (-np.eye(3)).tolist():
        n = np.array(normal)
        side = np.roll(n, 1)
        plate = Rectangle(
            50 * side - 40 * n - 60 * np.roll(n, 2), 120 * np.roll(n, 2), 120 * n, Surface("moon")
        )
        near = Rectangle(plate.corner - 49.9 * side, plate.across, plate.down, plate.surface)
        solids = Solids(
            near.corner[None],
            near.normal[None],
            (near.across / (near.across @ near.across))[None],
            (near.down / (near.down @ near.down))[None],
            np.empty((0, 4)),
        )
        blocked = np.zeros((1, len(rays.lamp) + len(rays.around)), np.bool_)
        find_blocked(solids, np.zeros((1, 3)), n[None], Rays(rays.lamp, rays.around, 1e6), blocked)
        assert blocked[0, len(rays.lamp) :].mean() == pytest.approx(0.5, abs=0.05)


def test_light_of_standing_and_moving_shapes_is_that_of_all_together() -> None:
    """What is kept of the standing shapes changes nothing, and shadows move."""
    shapes = some_shapes()
    lighting = Lighting((-1.0, -2.5, 2.0), (1.0, 1.0), (9.0, 8.0, 7.0), (0.4, 0.4, 0.5), samples=16)
    apart = LightBaker(shapes[:-2], lighting).bake(shapes[-2:])
    together = LightBaker(shapes, lighting).bake([])
    np.testing.assert_array_equal(apart.sizes, together.sizes)
    np.testing.assert_allclose(apart.factors, together.factors, rtol=1e-6)
    moved = Sphere((-0.9, -0.1, 4.0), 0.25, Surface("moon"), rolled(1.0))
    other = LightBaker(shapes[:-2], lighting).bake([shapes[-2], moved])
    assert np.abs(other.factors - apart.factors).max() > 0.1
    assert apart.factors.min() >= 0
