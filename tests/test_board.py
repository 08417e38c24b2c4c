"""Cameras from calibration boards: what boards there can be, what they tell, what is said of wrong ones."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from boards import held, seen_by
from command_line import mvcodec
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.frames import FrameSet
from mvcodec.output.pictures import write_png
from mvcodec.rigs.board import Board, Sightings, find_board
from mvcodec.rigs.calibration_files import KnownCamera
from mvcodec.rigs.from_board import cameras_from_board
from mvcodec.rigs.remap import project
from mvcodec.rigs.rig import Lens

Vectors = NDArray[np.float64]
CHARUCO = "charuco:7x5:40mm:30mm:4X4_50"
CHESSBOARD = "chessboard:9x6:25mm"
SIZE = (480, 320)
STEP_M = 0.1


def cameras(rows: int = 2, cols: int = 2, model: str = "pinhole") -> list[KnownCamera]:
    """Cameras 10 cm apart, each turned and built a little differently."""
    draw = np.random.default_rng(8)
    found = []
    for row in range(rows):
        for col in range(cols):
            focal = 420 * (1 + draw.uniform(-0.01, 0.01))
            centre = float(239.5 + draw.uniform(-4, 4)), float(159.5 + draw.uniform(-4, 4))
            bent = (-0.1, 0.02, 0.0, 0.0) if model == "pinhole" else (0.08, -0.02, 0.004, 0.0)
            turn = Rotation.from_rotvec(draw.uniform(-2, 2, 3), degrees=True).as_matrix()
            place = np.array([col, row, 0.0]) * STEP_M + draw.uniform(-1, 1, 3) * 1e-3
            focal = focal if model == "pinhole" else 150.0
            found.append(KnownCamera(SIZE, Lens(model, (focal, focal), centre, bent), turn, place))
    return found


def sightings_of(
    known: list[KnownCamera], board: Board, frames: int = 20, noise_px: float = 0.1, near: float = 0.5
) -> Sightings:
    """Where these cameras see the corners, without any pictures."""
    draw = np.random.default_rng(3)
    corners = board.corners_m
    places = np.zeros((frames, len(known), len(corners), 2))
    for frame, (turn, shift) in enumerate(held(frames, 5, (-0.05, -0.03, near))):
        points = corners @ turn.T + shift
        for number, camera in enumerate(known):
            places[frame, number] = project(camera.lens, (points - camera.centre_m) @ camera.turn.T)
    places += draw.normal(0, noise_px, places.shape)
    seen = ((places >= 0) & (places <= np.array(SIZE) - 1)).all(axis=3)
    seen &= seen.sum(axis=2, keepdims=True) >= 8
    at = tuple((number // 2, number % 2) for number in range(len(known)))
    return Sightings(board, at, SIZE, places, seen, frames)


def errors(found: list[KnownCamera], known: list[KnownCamera]) -> tuple[float, float]:
    """(deg, m): how far the cameras' turns and places against the first one's are off, at most."""
    turns, places = [], []
    for one, true in zip(found, known, strict=True):
        expected = true.turn @ known[0].turn.T
        apart = Rotation.from_matrix(one.turn @ found[0].turn.T @ expected.T)
        turns.append(np.degrees(apart.magnitude()))
        there = known[0].turn @ (true.centre_m - known[0].centre_m)
        places.append(np.linalg.norm(found[0].turn @ (one.centre_m - found[0].centre_m) - there))
    return float(max(turns)), float(max(places))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("board", "expected charuco:"),
        ("charuco:7x5:40mm:30mm", "expected charuco:"),
        ("charuco:7x5:40mm:50mm:4X4_50", "smaller than the squares"),
        ("charuco:7x5:40mm:30mm:9X9_50", "4X4_50"),
        ("charuco:17x15:40mm:30mm:4X4_50", "127 or more"),
        ("chessboard:9x6:25", "expected charuco:"),
        ("chessboard:9x6:25km", "25mm"),
        ("chessboard:7x7:25mm", "unequal"),
        ("chessboard:9x2:25mm", "at least 3"),
    ],
)
def test_boards_that_there_cannot_be_are_refused(text: str, words: str) -> None:
    with pytest.raises(SettingError, match="board") as caught:
        Board.from_text(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_board_says_its_corners_in_metres() -> None:
    assert len(Board.from_text(CHARUCO).corners_m) == 6 * 4
    corners = Board.from_text("chessboard:9x6:2.5cm").corners_m
    np.testing.assert_allclose(corners[-1], (8 * 0.025, 5 * 0.025, 0))


@pytest.mark.parametrize("text", [CHARUCO, CHESSBOARD])
def test_corners_are_found_where_they_are(text: str) -> None:
    board, camera = Board.from_text(text), cameras()[0]
    turn, shift = Rotation.from_euler("xyz", (15, -20, 5), degrees=True).as_matrix(), (-0.1, -0.07, 0.5)
    picture = seen_by(camera, board, turn, np.array(shift))
    found = find_board(board, [FrameSet(0, 0, {(0, 0): picture})], ((0, 0),), SIZE)
    true = project(camera.lens, (board.corners_m @ turn.T + shift - camera.centre_m) @ camera.turn.T)
    apart = np.abs(found.xy_px[0, 0] - true)
    if text == CHESSBOARD:
        apart = np.minimum(apart, np.abs(found.xy_px[0, 0, ::-1] - true))
    assert found.seen.sum() > 15
    assert np.median(apart[found.seen[0, 0]]) < 0.15


@pytest.mark.parametrize("model", ["pinhole", "fisheye"])
def test_cameras_are_found_whose_lenses_are_of_either_model(model: str) -> None:
    known = cameras(model=model)
    near = 0.5 if model == "pinhole" else 0.15
    found = cameras_from_board(sightings_of(known, Board.from_text(CHARUCO), near=near), "board")
    turn_deg, place_m = errors(found.cameras, known)
    assert found.cameras[0].lens.model == model
    assert found.rms_px < 0.2
    assert turn_deg < 0.3
    assert place_m < 0.003
    first, true = found.cameras[0].lens, known[0].lens
    assert first.focal_px[0] == pytest.approx(true.focal_px[0], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "model", "near_m"),
    [(CHARUCO, "pinhole", 0.55), (CHESSBOARD, "pinhole", 0.5), (CHARUCO, "fisheye", 0.2)],
)
def test_cameras_are_found_from_rendered_pictures_of_a_board(text: str, model: str, near_m: float) -> None:
    board, known = Board.from_text(text), cameras(1, 2, model)
    at = ((0, 0), (0, 1))
    sets = [
        FrameSet(n, n, {a: seen_by(camera, board, turn, shift) for a, camera in zip(at, known, strict=True)})
        for n, (turn, shift) in enumerate(held(10, 5, (-0.06, -0.06, near_m)))
    ]
    found = cameras_from_board(find_board(board, sets, at, SIZE), "board")
    turn_deg, place_m = errors(found.cameras, known)
    assert found.cameras[0].lens.model == model
    assert turn_deg < 0.3
    assert place_m < 0.003


def test_overlapping_groups_of_cameras_are_enough() -> None:
    known = cameras()
    sightings = sightings_of(known, Board.from_text(CHARUCO), 30)
    seen = sightings.seen.copy()
    for frame in range(len(seen)):
        seen[frame, [n for n in range(4) if n not in (frame % 3, frame % 3 + 1)]] = False
    turn_deg, place_m = errors(cameras_from_board(replace(sightings, seen=seen), "board").cameras, known)
    assert turn_deg < 0.4
    assert place_m < 0.005


def test_corners_that_were_found_wrongly_count_little() -> None:
    known = cameras()
    sightings = sightings_of(known, Board.from_text(CHARUCO), 12)
    draw = np.random.default_rng(0)
    wrong = draw.random(sightings.seen.shape) < 0.03
    places = sightings.xy_px + wrong[..., None] * draw.uniform(-15, 15, sightings.xy_px.shape)
    found = cameras_from_board(replace(sightings, xy_px=places), "board")
    turn_deg, place_m = errors(found.cameras, known)
    assert turn_deg < 0.4
    assert place_m < 0.005
    assert 0.01 < found.left_out < 0.06


def test_what_is_wrong_with_sightings_is_one_line() -> None:
    board, known = Board.from_text(CHARUCO), cameras()
    good = sightings_of(known, board)
    none = replace(good, xy_px=good.xy_px[:0], seen=good.seen[:0])
    with pytest.raises(InputError, match=r"no charuco:7x5.* in any picture of 20 frame sets"):
        cameras_from_board(none, "board")
    blind = good.seen.copy()
    blind[:, 2] = False
    with pytest.raises(InputError, match=r"in 0 pictures of camera 1,0"):
        cameras_from_board(replace(good, seen=blind), "board")
    parted = good.seen.copy()
    parted[::2, :2], parted[1::2, 2:] = False, False
    with pytest.raises(InputError, match=r"different groups .*\(0,0 0,1; 1,0 1,1\)"):
        cameras_from_board(replace(good, seen=parted), "board")


def test_a_board_of_another_shape_is_told() -> None:
    """Its corners are some pixels from where squares would have them; or all are unsure."""
    board, known = Board.from_text(CHARUCO), cameras(1, 2)
    good = sightings_of(known, board, 8)
    bent = good.xy_px + 4 * np.sin(np.arange(24) * 2.4)[:, None]
    with pytest.raises(InputError, match="from where charuco"):
        cameras_from_board(replace(good, xy_px=bent), "board")
    rough = good.xy_px + np.random.default_rng(0).normal(0, 1.5, good.xy_px.shape)
    with pytest.warns(MvCodecWarning, match="held still"):
        cameras_from_board(replace(good, xy_px=rough), "board")


def write_pictures(folder: Path, known: list[KnownCamera], board: Board, frames: int) -> None:
    """An array folder of a board that is held before cameras in one row or a 2 x 2 grid."""
    folder.mkdir()
    for frame, (turn, shift) in enumerate(held(frames, 5, (-0.08, -0.06, 0.5))):
        for number, camera in enumerate(known):
            name = f"r{number // 2:02d}_c{number % 2:02d}_{frame:02d}.png"
            write_png(folder / name, seen_by(camera, board, turn, shift))
    document = {
        "rows": len(known) // 2,
        "cols": 2,
        "pattern": "r{row:02d}_c{col:02d}_{frame:02d}.png",
        "frames": frames,
    }
    (folder / "array.json").write_text(json.dumps(document))


def rectify(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return mvcodec("rectify", *arguments)


def test_the_command_finds_a_metric_rig_from_a_board(tmp_path: Path) -> None:
    known = cameras(1, 2)
    write_pictures(tmp_path / "in", known, Board.from_text(CHARUCO), 7)
    done = rectify(tmp_path / "in", tmp_path / "out", "--board", CHARUCO)
    assert done.returncode == 0, done.stderr
    document = json.loads((tmp_path / "out" / "rig.json").read_text())
    assert document["found_by"] == "board"
    assert document["rectified"]["baseline_m"] == pytest.approx(STEP_M, rel=0.03)
    assert document["figures"]["board"]["rms_px"] < 0.3
    array = json.loads((tmp_path / "out" / "array.json").read_text())
    assert array["calibration"]["baseline_m"] == pytest.approx(STEP_M, rel=0.03)
    wrong = rectify(tmp_path / "in", tmp_path / "rig.json", "--from", "board")
    assert wrong.returncode == 2
    assert "--board: found none with --from board" in wrong.stderr
