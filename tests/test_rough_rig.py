"""The rough sample rig: each flaw alone, exact truth, and pictures that show what the truth says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mvcodec.array import Viewpoint
from mvcodec.errors import SettingError
from mvcodec.kernels.raycast import straightened
from mvcodec.output.scene_folder import write_sample
from mvcodec.scenes.renderer import Optics
from mvcodec.scenes.rough_rig import FLAWS, RoughCamera, RoughRigSettings, RoughScene
from mvcodec.scenes.scene import RoomScene, SceneSettings

SMALL = SceneSettings(grid=(1, 2), frames=2, size=(96, 64))


def test_a_flaw_is_the_same_alone_as_among_others() -> None:
    everything = RoughRigSettings.from_text("rough:7").cameras(2, 2)
    for flaw, fields in (
        ("angles", ["angles_deg"]),
        ("positions", ["offset_steps"]),
        ("focal", ["focal_factor"]),
        ("distortion", ["k1"]),
        ("gain", ["gain"]),
        ("delay", ["late_frames"]),
    ):
        alone = RoughRigSettings.from_text(f"rough:7,only={flaw}").cameras(2, 2)
        for place, camera in alone.items():
            for name in RoughCamera.__slots__:
                expected = everything[place] if name in fields else RoughCamera()
                assert getattr(camera, name) == getattr(expected, name)


def test_flaws_stay_within_their_bounds_and_one_camera_is_late() -> None:
    for seed in range(5):
        cameras = RoughRigSettings(seed).cameras(3, 3).values()
        assert max(abs(angle) for camera in cameras for angle in camera.angles_deg) <= 1.5
        assert max(abs(offset) for camera in cameras for offset in camera.offset_steps) <= 0.01
        assert all(0.99 <= camera.focal_factor <= 1.01 and 0.8 <= camera.gain <= 1.2 for camera in cameras)
        assert all(-0.13 <= camera.k1 <= -0.07 for camera in cameras)
        assert sum(camera.late_frames for camera in cameras) == 1


@pytest.mark.parametrize("text", ["smooth", "rough:", "rough:x", "rough,only=", "rough:1,only=tilt"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(SettingError, match="rig"):
        RoughRigSettings.from_text(text)


def test_no_flaw_is_the_ideal_picture() -> None:
    rough = RoughScene(RoomScene(SMALL), {(0, 1): RoughCamera()}, RoughRigSettings())
    picture, disparity = rough.render(Viewpoint(0, 1), 1)
    assert disparity is None
    np.testing.assert_array_equal(picture, RoomScene(SMALL).render(Viewpoint(0, 1), 1)[0])


def test_a_late_camera_shows_the_frame_before() -> None:
    room = RoomScene(SMALL)
    rough = RoughScene(room, {(0, 0): RoughCamera(late_frames=1)}, RoughRigSettings())
    np.testing.assert_array_equal(rough.render(Viewpoint(0, 0), 1)[0], room.render(Viewpoint(0, 0), 0)[0])


def test_gain_is_a_factor_on_the_light() -> None:
    room = RoomScene(SMALL)
    plain, _ = room.look((0, 0, 0), 0)
    dim, _ = room.look((0, 0, 0), 0, gain=0.8)
    assert np.abs(dim - 0.8 * plain.astype(float)).max() <= 1.0


def test_a_turned_and_distorting_camera_sees_what_lies_in_each_pixels_direction() -> None:
    """Depth along each ray is that of the straight camera along the same ray, near the wall and the floor."""
    room = RoomScene(SceneSettings(grid=(1, 2), frames=1, size=(192, 128)))
    camera = RoughCamera(angles_deg=(1.0, -1.4, 0.7), focal_factor=1.01, k1=-0.1)
    optics = Optics(192, 128, 192 * camera.focal_factor, camera.k1)
    _, inverse = room.look((0, 0, 0), 0, optics, camera.turn)
    _, straight = room.look((0, 0, 0), 0)
    cx, cy = optics.centre_px
    agreed = []
    for y in range(12, 116, 4):
        for x in range(12, 180, 4):
            place = straightened((x - cx) / optics.focal_px, (y - cy) / optics.focal_px, optics.k1, optics.k2)
            ray = np.array([*place, 1.0])
            towards = camera.turn.T @ ray
            u, v = towards[:2] / towards[2] * 192 + (cx, cy)
            # The point along this ray is as far along the array's axis as the straight camera sees it.
            expected = straight[round(float(v)), round(float(u))]
            agreed.append(abs(inverse[y, x] / towards[2] - expected) < 0.01 * expected)
    assert np.mean(agreed) > 0.9


def test_the_lens_is_inverted_exactly() -> None:
    for k1, k2 in ((-0.13, 0.0), (-0.28, 0.07), (0.1, 0.02)):
        x, y = straightened(0.4, -0.3, k1, k2)
        square = x * x + y * y
        factor = 1 + square * (k1 + square * k2)
        np.testing.assert_allclose((x * factor, y * factor), (0.4, -0.3), atol=1e-9)


def test_the_sample_folder_says_the_truth_and_no_calibration(tmp_path: Path) -> None:
    write_sample(tmp_path, settings=SMALL, rig=RoughRigSettings(3))
    manifest = json.loads((tmp_path / "array.json").read_text())
    assert not {"calibration", "disparity_per_step_px", "truth"} & set(manifest)
    truth = json.loads((tmp_path / "rig_truth.json").read_text())
    assert truth["flaws"] == list(FLAWS)
    camera = RoughRigSettings(3).cameras(1, 2)[0, 1]
    assert truth["cameras"]["r00_c01"]["k1"] == camera.k1
    np.testing.assert_array_equal(truth["cameras"]["r00_c01"]["rotation"], camera.turn)
