"""Cameras that expose differently: how much is measured, and what matching makes of it."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_scene import Planes, linear_or_grid

from mvcodec.array import CameraArray, Position
from mvcodec.frames import Picture
from mvcodec.stereo import exposure
from mvcodec.stereo.joint import Joint

RANGE_PX = (0.0, 20.0)
GAINS = {
    (0, 0): (1.0, 0.9, 1.0),
    (0, 1): (0.85, 0.85, 0.85),
    (1, 0): (1.1, 1.0, 0.9),
    (1, 1): (0.8, 0.9, 1.0),
}


def exposed(
    pictures: dict[Position, Picture], gains: dict[Position, tuple[float, float, float]]
) -> dict[Position, Picture]:
    return {
        camera: np.rint(p * 0.9 * np.array(gains[camera])).astype(np.uint8) for camera, p in pictures.items()
    }


def true_gains(scene: Planes, pictures: dict[Position, Picture]) -> dict[Position, np.ndarray]:
    """As `camera_gains` finds them where matching finds the truth."""

    def match(array: CameraArray, *_: object) -> tuple[object, object]:
        maps = {camera: scene.disparity_px(camera) for camera in array.real}
        return maps, {camera: np.ones((array.height, array.width), np.bool_) for camera in array.real}

    return exposure.camera_gains(scene.array, pictures, RANGE_PX, match)  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [(2, 2), (1, 2), (2, 1)])
def test_gains_of_every_channel_are_measured(shape: tuple[int, int]) -> None:
    scene = Planes(linear_or_grid(*shape, 150, 100), 2, 14)
    found = true_gains(scene, exposed(scene.pictures(), GAINS))
    logs = np.log([GAINS[camera] for camera in scene.array.real])
    expected = logs.mean(axis=0) - logs
    assert np.log([found[camera] for camera in scene.array.real]) == pytest.approx(expected, abs=0.01)


def test_cameras_that_hardly_differ_stay_as_they_are() -> None:
    scene = Planes(linear_or_grid(2, 2, 150, 100), 2, 14)
    slightly = {camera: (1.0 + 0.01 * camera[0],) * 3 for camera in scene.array.real}
    assert all((gain == 1).all() for gain in true_gains(scene, exposed(scene.pictures(), slightly)).values())


def test_pictures_that_share_nothing_stay_as_they_are() -> None:
    array = linear_or_grid(1, 2, 60, 40)
    dark = {camera: np.zeros((40, 60, 3), np.uint8) for camera in array.real}
    assert all((gain == 1).all() for gain in true_gains(Planes(array, 2, 6), dark).values())


def test_matching_does_without_equal_exposure() -> None:
    array = linear_or_grid(2, 2, 150, 100)
    scene = Planes(array, 2.3, 14)
    # Of low contrast, in which the factors weigh more than the texture.
    faint = {camera: (110 + p // 8).astype(np.uint8) for camera, p in scene.pictures().items()}
    equal = dict.fromkeys(array.real, (1.0, 1.0, 1.0))
    errors = []
    for gains in (equal, GAINS):
        maps = Joint().match(array, exposed(faint, gains), RANGE_PX)
        errors.append(
            np.mean(
                [np.abs(maps[camera].values_px - scene.disparity_px(camera)) > 0.5 for camera in array.real]
            )
        )
    assert errors[1] < errors[0] + 0.01
