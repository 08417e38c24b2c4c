"""Rigs: cameras from points, from files, their frame, their colours, and the quick look."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.errors import InputError, SettingError
from mvcodec.frames import FrameSet, Picture
from mvcodec.rigs.adjustment import Priors, adjust, straight_radius
from mvcodec.rigs.calibration_files import read_cameras
from mvcodec.rigs.colour_match import matched_colours
from mvcodec.rigs.features import Tracks
from mvcodec.rigs.framing import NothingInCommon, framed
from mvcodec.rigs.from_scene import rig_from_adjusted
from mvcodec.rigs.known import rig_from_cameras
from mvcodec.rigs.remap import Rectifier, project, widest_slope
from mvcodec.rigs.residuals import rays, rectified_tracks, residuals_of
from mvcodec.rigs.rig import Lens, Rectified, Rig, RigCamera, read_rig, rig_text

Vectors = NDArray[np.float64]
SIZE = (320, 200)


def an_array(rows: int = 2, cols: int = 2, size: tuple[int, int] = SIZE) -> CameraArray:
    real = tuple(range(rows)), tuple(range(cols))
    return CameraArray(rows, cols, *size, 10.0, *real, Calibration.nominal(*size))


def a_camera(turn_deg: tuple[float, float, float], place: Position, k1: float = 0.0) -> RigCamera:
    lens = Lens("pinhole", (320.0, 320.0), (159.5, 99.5), (k1, 0.0, 0.0, 0.0))
    turn = Rotation.from_rotvec(turn_deg, degrees=True).as_matrix()
    return RigCamera(lens, turn, np.array([place[1], place[0], 0.0]), np.ones(3), np.zeros(3))


def a_rig(k1: float = -0.1) -> Rig:
    """Four turned cameras that see the same things."""
    turns = {
        (0, 0): (0.8, -0.4, 0.6),
        (0, 1): (-0.5, 0.9, -0.3),
        (1, 0): (0.2, 0.5, -0.9),
        (1, 1): (-0.6, -0.9, 0.5),
    }
    cameras = {at: a_camera(turn, at, k1) for at, turn in turns.items()}
    view = framed(cameras, SIZE, Rectified(*SIZE, 320.0, (0.0, 0.0)))
    return Rig(2, 2, SIZE, cameras, view, "scene", {})


def points_seen(rig: Rig, count: int = 400, noise_px: float = 0.0) -> Tracks:
    """Random points of different depths, where the cameras of a rig see them."""
    draw = np.random.default_rng(5)
    slopes, w = draw.uniform((-0.45, -0.28), (0.45, 0.28), (count, 2)), draw.uniform(0.03, 0.12, count)
    places = np.zeros((count, len(rig.cameras), 2))
    for number, camera in enumerate(rig.cameras.values()):
        towards = np.column_stack([slopes, np.ones(count)]) - camera.place * w[:, None]
        places[:, number] = project(camera.lens, towards @ camera.turn.T)
    places += draw.normal(0, noise_px, places.shape)
    seen = ((places >= 0) & (places <= np.array(SIZE) - 1)).all(axis=2)
    seen &= seen.sum(axis=1, keepdims=True) >= 2
    tracks = Tracks(tuple(rig.cameras), places, seen, np.zeros(count, np.int64))
    return tracks.kept(seen)


def turn_errors_deg(rig: Rig, turns: list[Vectors]) -> Vectors:
    """Once one common rotation is taken out."""
    found = Rotation.from_matrix(turns)
    true = Rotation.from_matrix([camera.turn for camera in rig.cameras.values()])
    common = (found.inv() * true).mean()
    return np.asarray(np.degrees((found * common * true.inv()).magnitude()))


def test_cameras_are_found_from_points_though_a_tenth_of_these_are_wrong() -> None:
    rig = a_rig()
    tracks = points_seen(rig, noise_px=0.1)
    wrong = np.random.default_rng(1).random(len(tracks.seen)) < 0.1
    places = tracks.xy_px.copy()
    places[wrong, 0] += np.random.default_rng(2).uniform(-20, 20, (np.count_nonzero(wrong), 2))
    grid = np.array([(col, row) for row, col in rig.cameras], float)
    found = adjust(replace(tracks, xy_px=places), grid, SIZE, 320.0)
    turns = list(Rotation.from_rotvec(found.cameras.turns).as_matrix())
    assert np.median(turn_errors_deg(rig, turns)) < 0.08
    assert np.median(np.abs(found.residual_px[found.tracks.seen])) < 0.15
    straight = rig_from_adjusted(an_array(), found)
    after = residuals_of(rectified_tracks(straight, found.tracks), straight.rectified.rho)
    assert after.rows.median is not None
    assert after.rows.median < 0.2
    before = residuals_of(found.tracks)
    assert before.rows.median is not None
    assert before.rows.median > 3


def test_a_focal_length_that_is_known_stays() -> None:
    rig = a_rig()
    tracks = points_seen(rig, 120)
    grid = np.array([(col, row) for row, col in rig.cameras], float)
    known, free = (adjust(tracks, grid, SIZE, 300.0, focal_known=said).cameras for said in (True, False))
    assert np.exp(np.log(known.focal_px).mean()) == pytest.approx(300, rel=1e-3)
    assert np.exp(np.log(free.focal_px).mean()) == pytest.approx(320, rel=0.03)


def test_the_jacobian_is_that_of_the_residuals() -> None:
    from mvcodec.rigs.adjustment import _Problem

    ideal = {at: a_camera((0, 0, 0), at) for at in a_rig().cameras}
    rig = replace(a_rig(), cameras=ideal)
    tracks = points_seen(rig, 40)
    problem = _Problem(np.array([(c, r) for r, c in rig.cameras], float), SIZE, 320.0, Priors())
    values = np.zeros(problem.unknowns)
    made = problem._jacobian(values, tracks)
    for index in range(problem.unknowns):
        ends = []
        for step in (-1e-5, 1e-5):
            moved = values.copy()
            moved[index] += step
            ends.append(problem.reprojected(problem.cameras(moved), tracks)[0])
        numeric = (ends[1] - ends[0]) / 2e-5
        # Kaufman's form leaves out what is of the order of the residuals, which are 0 here.
        np.testing.assert_allclose(made[..., index], numeric, atol=1e-3)


def test_a_straight_radius_is_the_lens_undone() -> None:
    radius = np.linspace(0, 0.9, 50)
    for k1, k2 in ((-0.28, 0.07), (0.1, 0.0)):
        bent = radius * (1 + radius**2 * (k1 + radius**2 * k2))
        np.testing.assert_allclose(straight_radius(bent, np.array(k1), np.array(k2)), radius, atol=1e-6)


def test_rays_undo_projection_for_both_lens_models() -> None:
    slopes = np.random.default_rng(0).uniform(-0.5, 0.5, (100, 2))
    directions = np.column_stack([slopes, np.ones(100)])
    for lens in (
        Lens("pinhole", (300.0, 310.0), (160.0, 95.0), (-0.28, 0.07, 1e-4, -2e-4)),
        Lens("fisheye", (300.0, 310.0), (160.0, 95.0), (0.05, -0.01, 0.002, 0.0)),
    ):
        np.testing.assert_allclose(rays(lens, project(lens, directions)), slopes, atol=1e-6)


def test_a_rig_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    rig = a_rig()
    path = tmp_path / "rig.json"
    path.write_text(rig_text(rig))
    again = read_rig(path)
    assert rig_text(again) == rig_text(rig)
    with pytest.raises(SettingError, match="grid of the input"):
        again.array(an_array(1, 2))
    with pytest.raises(SettingError, match="size of the input"):
        again.array(an_array(size=(64, 48)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "other"}, "kind"),
        ({"rows": 0}, "rows"),
        ({"cameras": {}}, "r00_c00"),
        ({"rectified": {"width": 10, "height": 10, "focal_px": -1, "centre_px": [1, 1]}}, "focal_px"),
    ],
)
def test_a_wrong_rig_file_names_the_key(tmp_path: Path, change: dict[str, object], words: str) -> None:
    path = tmp_path / "rig.json"
    path.write_text(json.dumps(json.loads(rig_text(a_rig())) | change))
    with pytest.raises(InputError, match=words):
        read_rig(path)


def test_a_rotation_that_is_none_is_refused(tmp_path: Path) -> None:
    document = json.loads(rig_text(a_rig()))
    document["cameras"]["r00_c01"]["rotation"][0][0] = 3.0
    path = tmp_path / "rig.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"r00_c01.*rotation"):
        read_rig(path)


def test_what_all_cameras_see_is_valid_in_all_of_them() -> None:
    rig = a_rig()
    rectifier = Rectifier(rig)
    assert all(rectifier.valid(at).all() for at in rig.cameras)
    whole = replace(rig, rectified=framed(rig.cameras, SIZE, rig.rectified, "all"))
    assert (whole.rectified.width, whole.rectified.height) == SIZE
    assert not all(Rectifier(whole).valid(at).all() for at in rig.cameras)
    sized = framed(rig.cameras, SIZE, rig.rectified, "common", (160, 160))
    assert (sized.width, sized.height) == (160, 160)
    assert all(Rectifier(replace(rig, rectified=sized)).valid(at).all() for at in rig.cameras)


def test_cropping_moves_nothing_by_parts_of_a_pixel() -> None:
    cameras = {at: a_camera((0, 0, 0), at) for at in ((0, 0), (0, 1))}
    view = framed(cameras, SIZE, Rectified(*SIZE, 320.0, (0.0, 0.0)))
    cx, cy = view.centre_px
    assert view.focal_px == 320.0
    assert ((cx - 159.5) % 1, (cy - 99.5) % 1) == (0.0, 0.0)


def test_cameras_that_look_away_from_each_other_are_refused() -> None:
    cameras = {(0, 0): a_camera((0, 40, 0), (0, 0)), (0, 1): a_camera((0, -40, 0), (0, 1))}
    with pytest.raises(NothingInCommon, match="in common"):
        framed(cameras, SIZE, Rectified(*SIZE, 320.0, (0.0, 0.0)))


def test_an_ideal_camera_keeps_its_picture() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (*SIZE[::-1], 3), np.uint8)
    cameras = {(0, 0): a_camera((0, 0, 0), (0, 0))}
    rig = Rig(1, 1, SIZE, cameras, Rectified(*SIZE, 320.0, (159.5, 99.5)), "file", {})
    np.testing.assert_array_equal(Rectifier(rig).picture((0, 0), picture), picture)


def test_pictures_between_pixels_keep_their_finest_detail_and_their_flat_parts() -> None:
    cameras = {(0, 0): a_camera((0, 0, 0), (0, 0))}
    rig = Rig(1, 1, SIZE, cameras, Rectified(*SIZE, 320.0, (160.0, 99.5)), "file", {})
    wave = 128 + 60 * np.sin(2 * np.pi * 0.38 * np.arange(SIZE[0]))
    for line, spread in ((wave, 60 / np.sqrt(2)), (np.full(SIZE[0], 90.0), 0.0)):
        picture = np.broadcast_to(np.rint(line)[None, :, None], (*SIZE[::-1], 3)).astype(np.uint8)
        inside = Rectifier(rig).picture((0, 0), picture)[20:-20, 20:-20].astype(float)
        assert 0.92 * spread <= inside.std() <= 1.05 * spread
        assert abs(inside.mean() - line.mean()) < 1


def matched(pictures: dict[Position, Picture]) -> Rectifier:
    """Of cameras in a row that see each point at the same place of their pictures, by 500 points."""
    draw = np.random.default_rng(4)
    places = draw.uniform(10, 180, (500, 1, 2)).repeat(len(pictures), axis=1)
    seen = np.ones(places.shape[:2], bool)
    tracks = Tracks(tuple(pictures), places, seen, np.zeros(500, np.int64))
    cameras = {at: a_camera((0, 0, 0), at) for at in pictures}
    rig = Rig(1, len(pictures), SIZE, cameras, Rectified(*SIZE, 320.0, (159.5, 99.5)), "scene", {})
    return Rectifier(matched_colours(rig, tracks, [FrameSet(0, 0, pictures)]))


def soft_noise(low: float, high: float) -> Vectors:
    """(H, W, 3): something to compare colours by."""
    draw = np.random.default_rng(4)
    noise = cv2.GaussianBlur(draw.integers(0, 256, (*SIZE[::-1], 3), np.uint8), (0, 0), 3)
    return np.asarray(np.clip((noise.astype(float) - 128) * 3 + 120, low, high))


def test_gains_and_offsets_are_taken_out() -> None:
    """Two cameras show the same picture, one of them dimmer and lifted."""
    light = soft_noise(20, 230)
    pictures: dict[Position, Picture] = {
        (0, 0): light.astype(np.uint8),
        (0, 1): np.rint(light * 0.8 + 3).astype(np.uint8),
    }
    rectifier = matched(pictures)
    one, other = (rectifier.picture(at, pictures[at]).astype(int) for at in pictures)
    assert np.abs(one - other).mean() < 1.0


def test_what_is_white_to_the_brightest_camera_becomes_white_for_all() -> None:
    light = soft_noise(20, 200)
    light[150:] = 290.0
    pictures: dict[Position, Picture] = {
        (0, col): np.clip(np.rint(light * gain), 0, 255).astype(np.uint8)
        for col, gain in enumerate((0.8, 1.0, 0.85))
    }
    rectifier = matched(pictures)
    for at, picture in pictures.items():
        assert rectifier.picture(at, picture)[160:].mean() > 250


def test_one_camera_that_is_far_too_bright_does_not_make_all_so() -> None:
    light = soft_noise(20, 110)
    pictures: dict[Position, Picture] = {
        (0, col): np.rint(light * gain).astype(np.uint8) for col, gain in enumerate((1, 1, 1, 2.0))
    }
    rectifier = matched(pictures)
    mean = 2**0.25
    for at, picture in pictures.items():
        assert rectifier.picture(at, picture).mean() == pytest.approx(1.25 * mean * light.mean(), rel=0.02)


EUROC = """%YAML:1.0
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, {x}, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
resolution: [320, 200]
camera_model: pinhole
intrinsics: [300, 301, 159, 99] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0001, 0.0]
"""
KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [300, 301, 159, 99]
  distortion_model: equidistant
  distortion_coeffs: [0.01, 0.0, 0.0, 0.0]
  resolution: [320, 200]
cam1:
  T_cn_cnm1:
  - [1, 0, 0, -0.1]
  - [0, 1, 0, 0]
  - [0, 0, 1, 0]
  - [0, 0, 0, 1]
  camera_model: pinhole
  intrinsics: [300, 301, 159, 99]
  distortion_model: radtan
  distortion_coeffs: [-0.28, 0.07, 0.0001, 0.0]
  resolution: [320, 200]
"""
ROS = """image_width: 320
image_height: 200
camera_name: left
camera_matrix: {{rows: 3, cols: 3, data: [300, 0, 159, 0, 301, 99, 0, 0, 1]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: [-0.28, 0.07, 0.0001, 0, 0]}}
rectification_matrix: {{rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}}
projection_matrix: {{rows: 3, cols: 4, data: [290, 0, 160, {tx}, 0, 290, 100, 0, 0, 0, 1, 0]}}
"""


@pytest.mark.parametrize("kind", ["euroc", "kalibr", "ros"])
def test_calibration_files_of_three_kinds_are_one_rig(tmp_path: Path, kind: str) -> None:
    texts = {
        "euroc": [EUROC.format(x=0.0), EUROC.format(x=0.1)],
        "kalibr": [KALIBR],
        "ros": [ROS.format(tx=0.0), ROS.format(tx=-29.0)],
    }[kind]
    paths = [tmp_path / f"{number}.yaml" for number in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text)
    cameras = read_cameras(paths)
    rig = rig_from_cameras(an_array(1, 2), cameras, "files", "file")
    assert rig.rectified.baseline_m == pytest.approx(0.1)
    assert rig.cameras[0, 1].lens.coefficients[0] == -0.28
    assert rig.cameras[0, 0].lens.focal_px == (300.0, 301.0)
    np.testing.assert_allclose(rig.cameras[0, 1].turn, np.eye(3), atol=1e-12)
    with pytest.raises(InputError, match="reverse"):
        rig_from_cameras(an_array(1, 2), cameras[::-1], "files", "file")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [1", "malformed YAML"),
        ("- 1\n", "no keys"),
        ("a: 1\n", "the keys a"),
        (EUROC.format(x=0.0).replace("radial-tangential", "wavy"), "wavy"),
        (EUROC.format(x=0.0).replace("[300, 301, 159, 99]", "[300, x, 159, 99]"), "intrinsics"),
    ],
)
def test_a_wrong_calibration_file_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "cam.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_cameras([path])
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wide_lens_shows_nothing_twice() -> None:
    """Brown's polynomial turns back: what it says of rays beyond is none of the picture."""
    bent = replace(
        a_camera((0, 0, 0), (0, 0)).lens, focal_px=(180.0, 180.0), coefficients=(-0.2, 0.0, 0.0, 0.0)
    )
    turns_back = 1 / np.sqrt(3 * 0.2)
    assert widest_slope(bent) == pytest.approx(turns_back, abs=0.01)
    aside = np.array([[0.98 * turns_back, 0.0, 1.0], [1.5 * turns_back, 0.0, 1.0]])
    near, beyond = project(bent, aside)
    assert near[0] < SIZE[0]
    assert np.abs(beyond).max() > 1e4
    assert widest_slope(replace(bent, coefficients=(-0.28, 0.07, 0.0, 0.0))) > 100
    fisheye = Lens("fisheye", (150.0, 150.0), (159.5, 99.5), (0.0, -0.1, 0.0, 0.0))
    assert widest_slope(fisheye) == pytest.approx(np.tan((1 / 0.5) ** 0.25), rel=0.02)
