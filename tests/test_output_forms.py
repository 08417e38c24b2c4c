"""Array folders and the other forms of output: complete, in their places, with the right facts."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from array_files import Broken, break_off, files_in, picture_of

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.capture import open_input
from mvcodec.capture.picture_files import picture_size, read_picture
from mvcodec.capture.video_input import VideoView
from mvcodec.errors import OutputError, SettingError, StreamClosed
from mvcodec.frames import Picture
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter
from mvcodec.output.forms import FORMS, OutputPlan, grid_facts, open_form
from mvcodec.output.mosaic import mosaic

CALIBRATION = Calibration(20.0, 25.0, 12.0, 8.0, 0.2, 0.5)


def array_of(rows: int, cols: int, rho: float = 1.0) -> CameraArray:
    real_rows, real_cols = tuple(sorted({0, rows - 1})), tuple(sorted({0, cols - 1}))
    return CameraArray(
        rows, cols, 24, 16, 10.0, real_rows, real_cols, CALIBRATION, rho, (1.0, 3.0), name="small"
    )


# Array folders


def write_folder(folder: Path, facts: ArrayFacts, frames: int = 2) -> Path:
    views = [(row, col) for row in range(facts.rows) for col in range(facts.cols)]
    with ArrayFolderWriter(folder, facts) as writer:
        for frame in range(frames):
            writer.push(
                {view: picture_of(view, frame) for view in views},
                {(0, 1): np.full((16, 24), 1.5 + frame, np.float32)},
            )
    return folder


def test_array_folder_comes_back(tmp_path: Path) -> None:
    facts = ArrayFacts(
        *(2, 3, 12.5, "small", 1.25, CALIBRATION, (-1.0, 4.0)),
        real=[(1, 2), (0, 0)],
        first_frame=5,
        licence="free",
    )
    source = open_input([write_folder(tmp_path, facts)], real="all")
    array = source.array
    assert (array.rows, array.cols, array.fps, array.name, array.rho) == (2, 3, 12.5, "small", 1.25)
    assert (array.calibration, array.disparity_per_step_px) == (CALIBRATION, (-1.0, 4.0))
    assert (source.listed_real, source.first_frame) == (((0, 0), (1, 2)), 5)
    for number, item in enumerate(source.frame_sets()):
        assert item.index == number + 5
        for position, picture in item.pictures.items():
            np.testing.assert_array_equal(picture, picture_of(position, number))
        truth = source.truth((0, 1), number)
        assert truth is not None
        assert (truth.values_px == 1.5 + number).all()
    assert source.truth((0, 0), 0) is None
    assert "r01_c02/000001.png" in files_in(tmp_path)


def test_facts_of_an_array_leave_nominal_calibration_out() -> None:
    array = array_of(2, 3)
    assert ArrayFacts.of(array).calibration == CALIBRATION
    nominal = CameraArray(2, 3, 24, 16, 10.0, (0, 1), (0, 2), Calibration.nominal(24, 16))
    assert "calibration" not in ArrayFacts.of(nominal).document()


def test_array_json_is_written_last_and_only_when_complete(tmp_path: Path) -> None:
    write_folder(tmp_path, ArrayFacts(1, 2, 10.0))
    (tmp_path / "mine.txt").write_text("kept")
    views = {(0, 0): picture_of((0, 0), 0), (0, 1): picture_of((0, 1), 0)}
    with pytest.raises(Broken):
        break_off(ArrayFolderWriter(tmp_path, ArrayFacts(1, 2, 10.0)), lambda it: it.push(views))
    assert "array.json" not in files_in(tmp_path)
    with ArrayFolderWriter(tmp_path, ArrayFacts(1, 2, 10.0)) as writer:
        writer.push(views)
        assert "array.json" not in files_in(tmp_path)
    assert json.loads((tmp_path / "array.json").read_text())["frames"] == 1
    assert (tmp_path / "mine.txt").read_text() == "kept"
    with pytest.raises(StreamClosed):
        writer.push(views)


def test_array_folder_wants_every_view_and_a_frame(tmp_path: Path) -> None:
    with (
        pytest.raises(OutputError, match="without a frame set"),
        ArrayFolderWriter(tmp_path, ArrayFacts(1, 2, 9.0)),
    ):
        pass
    writer = ArrayFolderWriter(tmp_path, ArrayFacts(1, 2, 9.0))
    with pytest.raises(SettingError, match="every view of the 1x2 grid"):
        writer.push({(0, 0): picture_of((0, 0), 0)})
    views = {(0, 0): picture_of((0, 0), 0), (0, 1): picture_of((0, 1), 0)}
    truth = {(0, 0): np.zeros((16, 24), np.float32)}
    writer.push(views, truth)
    with pytest.raises(SettingError, match="the same in each frame set"):
        writer.push(views)
    writer.abort()


# The forms


def push_all(name: str, target: Path, plan: OutputPlan, frames: int = 2) -> list[list[Picture]]:
    pushed = [
        [picture_of((number // 3, number % 3), frame) for number in range(len(plan.viewpoints))]
        for frame in range(frames)
    ]
    with open_form(name, target, plan) as writer:
        for pictures in pushed:
            writer.push(pictures)
    return pushed


def test_png_form(tmp_path: Path) -> None:
    array = array_of(3, 3)
    plan = OutputPlan(array, (Viewpoint(0, 0), Viewpoint(0.5, 1.25)), None)
    pushed = push_all("png", tmp_path, plan)
    expected = {f"{view}/00000{frame}.png" for view in ("r00_c00", "r0.500_c1.250") for frame in (0, 1)}
    assert files_in(tmp_path) == expected
    np.testing.assert_array_equal(read_picture(tmp_path / "r0.500_c1.250" / "000001.png"), pushed[1][1])


def test_mp4_form_appears_when_complete(tmp_path: Path) -> None:
    array = array_of(2, 3)
    plan = OutputPlan(array, array.viewpoints(2, 3), (2, 3))
    push_all("mp4", tmp_path / "a", plan)
    assert files_in(tmp_path / "a") == {f"r0{row}_c0{col}.mp4" for row in (0, 1) for col in (0, 1, 2)}
    with pytest.raises(Broken):
        break_off(open_form("mp4", tmp_path / "b", plan), lambda it: it.push([picture_of((0, 0), 0)] * 6))
    assert files_in(tmp_path / "b") == set()


@pytest.mark.parametrize(("name", "size"), [("m.png", (72, 48)), ("m.mp4", (72, 48))])
def test_mosaic_form(tmp_path: Path, name: str, size: tuple[int, int]) -> None:
    array = array_of(3, 3)
    plan = OutputPlan(array, array.viewpoints(3, 3), (3, 3))
    pushed = push_all("mosaic", tmp_path / name, plan)
    assert files_in(tmp_path) == {name}
    if name.endswith("png"):
        assert picture_size(tmp_path / name) == size
        expected = mosaic([pushed[0][row : row + 3] for row in (0, 3, 6)])
        np.testing.assert_array_equal(read_picture(tmp_path / name), expected)
    else:
        view = VideoView(tmp_path / name)
        assert (view.size, view.count) == (size, 2)


def test_mosaic_of_single_views_is_filled_up(tmp_path: Path) -> None:
    viewpoints = tuple(Viewpoint(0, col) for col in (0, 0.5, 1))
    plan = OutputPlan(array_of(3, 3), viewpoints, None)
    assert plan.layout == (2, 2)
    push_all("mosaic", tmp_path / "m.png", plan)
    assert not read_picture(tmp_path / "m.png")[16:, 24:].any()


def test_bad_forms(tmp_path: Path) -> None:
    array = array_of(3, 3)
    plan = OutputPlan(array, (Viewpoint(0, 0),), None)
    with pytest.raises(SettingError, match=r"^format: found gif, expected array \| png \| mp4 \| mosaic"):
        open_form("gif", tmp_path, plan)
    with pytest.raises(SettingError, match=r"a \.mp4 or \.png file"):
        open_form("mosaic", tmp_path / "m.jpg", plan)
    with pytest.raises(SettingError, match=r"^views: found 1 single views, expected a whole grid"):
        open_form("array", tmp_path, plan)
    with pytest.raises(SettingError, match="grid"):
        OutputPlan(array, (Viewpoint(0, 0),), (2, 2))
    with pytest.raises(SettingError, match="viewpoints"):
        OutputPlan(array, (), None)


@pytest.mark.parametrize("name", FORMS)
def test_every_form_leaves_no_temporary_file(tmp_path: Path, name: str) -> None:
    array = array_of(1, 2)
    plan = OutputPlan(array, array.viewpoints(1, 2), (1, 2))
    push_all(name, tmp_path / ("m.png" if name == "mosaic" else "folder"), plan)
    assert not [path for path in files_in(tmp_path) if ".part" in path]


@pytest.mark.parametrize("name", ["array", "mosaic"])
def test_forms_without_a_frame_are_refused(tmp_path: Path, name: str) -> None:
    array = array_of(1, 2)
    target = tmp_path / ("m.mp4" if name == "mosaic" else "folder")
    with (
        pytest.raises(OutputError, match="without a frame"),
        open_form(name, target, OutputPlan(array, array.viewpoints(1, 2), (1, 2))),
    ):
        pass


def test_array_form_of_the_inputs_own_grid(tmp_path: Path) -> None:
    array = array_of(2, 3, rho=1.5)
    push_all("array", tmp_path, OutputPlan(array, array.viewpoints(2, 3), (2, 3), first_frame=4))
    source = open_input([tmp_path])
    assert source.array == array
    assert (source.listed_real, source.first_frame) == (array.real, 4)


@pytest.mark.parametrize("grid", [(3, 5), (5, 9), (9, 3), (1, 5), (3, 1), (1, 1), (2, 2)])
def test_another_grid_keeps_every_point_where_it_was(grid: tuple[int, int]) -> None:
    """A point moves by the same number of pixels between the same two places, whatever the grid."""
    array = array_of(5, 9, rho=1.25)
    plan = OutputPlan(array, array.viewpoints(*grid), grid)
    facts = grid_facts(plan)
    assert facts.disparity_per_step_px is not None
    assert facts.calibration is not None
    (low, _), (rows, cols) = facts.disparity_per_step_px, grid
    if cols > 1:
        assert low * (cols - 1) == pytest.approx(1.0 * (array.cols - 1))
        assert facts.calibration.baseline_m * (cols - 1) == pytest.approx(0.2 * 8)
    if rows > 1:
        rho = facts.rho if cols > 1 else 1.0
        assert facts.rho == pytest.approx(rho)
        assert rho * low * (rows - 1) == pytest.approx(1.25 * 1.0 * (array.rows - 1))
        vertical_m = facts.calibration.baseline_m * (rho * 20 / 25 if cols > 1 else 1.0)
        assert vertical_m * (rows - 1) == pytest.approx(0.2 * 1.25 * 20 / 25 * 4)
    real = {plan.viewpoints[row * cols + col] for row, col in facts.real or ()}
    assert real == {Viewpoint(*camera) for camera in array.real} & set(plan.viewpoints)
