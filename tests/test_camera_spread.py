"""The spread over which cameras are averaged follows from noise and misplacement."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from plane_scene import PlaneScene, grid

from mvcodec.frames import DecodedSet, DisparityMap
from mvcodec.synthesis.camera_spread import FALLBACK, LEAST, MOST, measure_spread


def scene(rows: int = 2, cols: int = 2) -> DecodedSet:
    """A soft texture on one plane, its maps exact."""
    decoded = PlaneScene(grid(rows, cols, 320, 240), 8).decoded()
    soft = {
        camera: np.asarray(cv2.GaussianBlur(picture, (0, 0), 2), np.uint8)
        for camera, picture in decoded.pictures.items()
    }
    return replace(decoded, pictures=soft)


def noisy(decoded: DecodedSet, sigma: float) -> DecodedSet:
    rng = np.random.default_rng(1)
    pictures = {
        camera: (picture + rng.normal(0, sigma, picture.shape)).clip(0, 255).astype(np.uint8)
        for camera, picture in decoded.pictures.items()
    }
    return replace(decoded, pictures=pictures)


def misplaced(decoded: DecodedSet, sigma_px: float) -> DecodedSet:
    """The maps off by smooth errors, one for each camera."""
    rng = np.random.default_rng(2)
    disparities = {}
    for camera, map_ in decoded.disparities.items():
        error = cv2.GaussianBlur(rng.normal(0, 1, map_.values_px.shape).astype(np.float32), (0, 0), 4)
        values = map_.values_px + np.float32(sigma_px) * error / error.std()
        disparities[camera] = DisparityMap(values, map_.valid)
    return replace(decoded, disparities=disparities)


def test_noise_widens_and_misplacement_narrows() -> None:
    off = misplaced(scene(), 0.6)
    clean, grainy, very_grainy = (measure_spread(noisy(off, sigma)) for sigma in (0.0, 2.0, 4.0))
    assert LEAST <= clean < grainy < very_grainy <= MOST
    assert measure_spread(noisy(misplaced(scene(), 0.8), 2.0)) < grainy


def test_plain_surroundings_do_not_hide_that_edges_are_misplaced() -> None:
    off = misplaced(scene(), 0.8)
    flat = {camera: picture.copy() for camera, picture in off.pictures.items()}
    for picture in flat.values():
        picture[: 3 * len(picture) // 4] = 90
    assert measure_spread(off) == LEAST
    assert measure_spread(replace(off, pictures=flat)) == LEAST


def test_noise_alone_asks_for_an_even_average() -> None:
    assert measure_spread(noisy(scene(), 6.0)) == MOST


def test_a_difference_in_brightness_is_not_noise() -> None:
    off = misplaced(scene(), 0.4)
    brighter = {camera: p + np.uint8(4 * place) for place, (camera, p) in enumerate(off.pictures.items())}
    assert measure_spread(replace(off, pictures=brighter)) == measure_spread(off)


def test_cameras_in_line_or_alone_fall_back() -> None:
    assert measure_spread(scene(1, 3)) == FALLBACK
    square = scene()
    alone = replace(square, pictures={(0, 0): square.pictures[0, 0]})
    assert measure_spread(alone) == FALLBACK


def test_cameras_that_share_no_surface_fall_back() -> None:
    square = scene()
    rows = np.arange(240, dtype=np.float32)[:, None] % 5 * np.ones(320, np.float32)
    apart = {
        camera: DisparityMap(rows + 10 * place, map_.valid)
        for place, (camera, map_) in enumerate(square.disparities.items())
    }
    assert measure_spread(replace(square, disparities=apart)) == FALLBACK
