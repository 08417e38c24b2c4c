"""Bad input and output: one line that names the thing, exit code 1 or 2, nothing left behind."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path

import pytest
from command_line import COMMAND, fails, mvcodec, succeeds
from mcap.writer import Writer
from small_arrays import picture, write_array

from mvcodec.output.pictures import write_png

FIXED_RANGE = ("--disparity-range", "0,8")


@pytest.fixture
def array(tmp_path: Path) -> Path:
    return write_array(tmp_path / "array")


@pytest.fixture(scope="module")
def coded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("coded")
    succeeds("encode", write_array(folder / "array", frames=2), folder / "x.mcap", *FIXED_RANGE)
    return folder / "x.mcap"


def change_manifest(folder: Path, **changes: object) -> None:
    path = folder / "array.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def spoil(picture: Path) -> None:
    """Cut a picture short, behind its header."""
    picture.write_bytes(picture.read_bytes()[:200])


def test_missing_picture(array: Path, tmp_path: Path) -> None:
    (array / "r00_c00" / "000000.png").unlink()
    assert "r00_c00/000000.png" in fails(1, "encode", array, tmp_path / "o.mcap")
    assert not (tmp_path / "o.mcap").exists()


def test_unreadable_picture_leaves_the_old_output_as_it_was(array: Path, tmp_path: Path) -> None:
    (array / "r00_c02" / "000000.png").write_bytes(b"no picture")
    (tmp_path / "o.mcap").write_bytes(b"old")
    assert "r00_c02/000000.png" in fails(1, "encode", array, tmp_path / "o.mcap", "-y")
    assert (tmp_path / "o.mcap").read_bytes() == b"old"


def test_views_of_different_length_give_what_all_have(array: Path, tmp_path: Path) -> None:
    views = [[[f"r{r:02d}_c{c:02d}/{f:06d}.png" for f in range(4)] for c in range(3)] for r in range(3)]
    views[2][1].pop()
    change_manifest(array, views=views)
    document = json.loads((array / "array.json").read_text())
    del document["pattern"], document["frames"]
    (array / "array.json").write_text(json.dumps(document))
    done = mvcodec("encode", array, tmp_path / "o.mcap", "--real", "all")
    assert done.returncode == 0, done.stderr
    assert "what lies outside is left out" in done.stderr
    assert "3 frame sets" in done.stdout


def test_views_of_different_size(array: Path, tmp_path: Path) -> None:
    write_png(array / "r02_c02" / "000000.png", picture((2, 2), 0, 80, 64))
    message = fails(1, "encode", array, tmp_path / "o.mcap")
    assert "80x64" in message
    assert "96x64" in message


def test_grid_that_is_not_rectangular(array: Path, tmp_path: Path) -> None:
    document = json.loads((array / "array.json").read_text())
    del document["pattern"], document["frames"]
    document["views"] = [
        [["r00_c00/000000.png"]] * 3,
        [["r00_c00/000000.png"]] * 2,
        [["r00_c00/000000.png"]] * 3,
    ]
    (array / "array.json").write_text(json.dumps(document))
    assert "array.json" in fails(1, "encode", array, tmp_path / "o.mcap")


def test_empty_folder(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert "empty folder" in fails(1, "encode", tmp_path / "empty", tmp_path / "o.mcap")


def test_input_that_is_not_there(tmp_path: Path) -> None:
    assert "nowhere" in fails(1, "encode", tmp_path / "nowhere", tmp_path / "o.mcap")
    assert "nowhere" in fails(1, "decode", tmp_path / "nowhere", tmp_path / "out")
    assert "nowhere" in fails(1, "info", tmp_path / "nowhere")


@pytest.mark.parametrize("real", ["0,7x0,2", "every:3", "0,1x0,2", "some"])
def test_real_cameras_that_do_not_exist_or_are_unevenly_spaced(
    array: Path, tmp_path: Path, real: str
) -> None:
    message = fails(2, "encode", array, tmp_path / "o.mcap", "--real", real)
    assert message.startswith(f"mvcodec: error: --real: found {real}, expected ")
    assert "every:K with K one of 1, 2" in message


def test_unknown_names_are_answered_with_the_choices(array: Path, coded: Path, tmp_path: Path) -> None:
    out = tmp_path / "o.mcap"
    assert "sgbm, " in fails(2, "encode", array, out, "--matcher", "eyes")
    assert "medium, " in fails(2, "encode", array, out, "--preset", "warp")
    assert "dils, " in fails(2, "decode", coded, tmp_path / "out", "--synthesizer", "brush")


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--qp", "0"),
        ("--qp", "52"),
        ("--disparity-qp", "0"),
        ("--disparity-scale", "3"),
        ("--disparity-median", "4"),
        ("--gop", "11"),
        ("--gop", "0"),
        ("--crf", "99"),
    ],
)
def test_settings_outside_their_range_name_option_value_and_range(
    array: Path, tmp_path: Path, option: str, value: str
) -> None:
    message = fails(2, "encode", array, tmp_path / "o.mcap", option, value)
    assert (
        f"{option}: found {value}, expected" in message or f"{option}: found {value}.0, expected" in message
    )
    assert not (tmp_path / "o.mcap").exists()


@pytest.mark.parametrize(
    "option",
    ["--topics /a", "--when-behind block", "--clock log", "--nominal"],
)
def test_options_without_effect_are_refused(array: Path, tmp_path: Path, option: str) -> None:
    name, *value = option.split()
    line = fails(2, "encode", array, tmp_path / "o.mcap", name, *value)
    assert line.startswith(f"mvcodec: error: {name}: found ")
    assert ("--depth raw16" if name == "--nominal" else f"{array} is no recording") in line
    assert not (tmp_path / "o.mcap").exists()


def test_a_second_reference_of_nothing_that_is_predicted_is_refused(array: Path, tmp_path: Path) -> None:
    line = fails(2, "encode", array, tmp_path / "o.mcap", "--second-reference", "nearest")
    assert line.startswith("mvcodec: error: --second-reference: found nearest, expected prediction synthesis")
    assert not (tmp_path / "o.mcap").exists()


def test_json_and_the_stream_cannot_both_be_standard_output(array: Path, coded: Path) -> None:
    assert "--json: found with OUT -" in fails(2, "encode", array, "-", "--json")
    assert "--json: found with OUT -" in fails(2, "decode", coded, "-", "--format", "mcap", "--json")


def test_settings_are_called_as_their_options_are(coded: Path, tmp_path: Path) -> None:
    out, row = tmp_path / "out", write_array(tmp_path / "row", 1, 3, frames=1)
    line = fails(2, "decode", coded, out, "--view", "5,5")
    assert line == "mvcodec: error: --view: found 5,5, expected row 0..2, col 0..2"
    line = fails(2, "decode", coded, out, "--frames", "5:")
    assert line.startswith("mvcodec: error: --frames: found 5:, expected at least one frame set of the 2 in")
    line = fails(2, "decode", coded, out, "--synthesizer", "brush")
    assert line.startswith("mvcodec: error: --synthesizer: found brush, expected one of layered, ")
    succeeds("encode", row, tmp_path / "row.mcap", *FIXED_RANGE)
    line = fails(2, "decode", tmp_path / "row.mcap", out, "--grid", "3x3")
    assert line == "mvcodec: error: --grid: found 3x3, expected 1xC with C >= 1"
    line = fails(2, "encode", row, tmp_path / "o.mcap", "--depth", "raw16")
    assert line.startswith("mvcodec: error: --calibration: found none given, expected one in the input")


@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        (
            "export-points {} o.ply --nominal --max-depth -1",
            "--max-depth: found '-1', expected a number above 0",
        ),
        ("export-points {} o.ply --nominal --max-depth nan", "found 'nan', expected a number above 0"),
        ("render {} o.png --refocus 1e30", "--refocus: found 1e+30, expected at most 96 px"),
        ("encode x.mcap o.mcap --topics=", "--topics: found '', expected a topic for every view"),
        ("encode x.mcap o.mcap --topics /a,,/b", "--topics: found '/a,,/b', expected a topic for every view"),
    ],
)
def test_values_that_make_no_sense_are_refused(
    coded: Path, tmp_path: Path, command: str, complaint: str
) -> None:
    line = fails(2, *command.replace(" o.", f" {tmp_path}/o.").replace("x.mcap", "{}").format(coded).split())
    assert complaint in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "command",
    [
        "render {} {}/x.png",
        "render {} {}/x.mp4",
        "recover {} {}/x.mcap",
        "decode {} {}/x.mp4 --format mosaic",
        "decode {} {}/x.mcap --format mcap",
        "export-points {} {}/x.ply --nominal",
        "export-points {} {}/x.mcap --nominal",
    ],
)
def test_the_folder_of_a_file_must_be_there(coded: Path, tmp_path: Path, command: str) -> None:
    folder = tmp_path / "missing" / "deeper"
    line = fails(1, *command.format(coded, folder).split())
    assert line.endswith(f"cannot be written: there is no folder {folder}")
    assert not folder.parent.exists()


def test_a_file_that_is_no_mcap(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    for data in (b"", b"no MCAP at all" * 100):
        path.write_bytes(data)
        assert str(path) in fails(1, "info", path)
        assert str(path) in fails(1, "decode", path, tmp_path / "out")
        assert not (tmp_path / "out").exists()


def test_an_mcap_without_our_header(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/else", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()  # type: ignore[no-untyped-call]
    assert "written by mvcodec" in fails(1, "info", path)
    assert "written by mvcodec" in fails(1, "decode", path, tmp_path / "out")


def test_output_equal_to_input_is_refused(array: Path, coded: Path, tmp_path: Path) -> None:
    video = tmp_path / "video.mcap"
    video.write_bytes(b"not to be touched")
    assert "INPUT" in fails(2, "encode", video, tmp_path / "." / "video.mcap", "--grid", "1x1")
    assert video.read_bytes() == b"not to be touched"
    assert "another file" in fails(2, "decode", coded, coded, "--format", "mosaic")
    # With OUT forgotten, the last INPUT would be taken for it.
    assert ".mcap" in fails(2, "encode", array, tmp_path / "last.mp4")


def test_outputs_that_cannot_be_written(array: Path, coded: Path, tmp_path: Path) -> None:
    assert "no folder" in fails(1, "encode", array, tmp_path / "missing" / "o.mcap")
    (tmp_path / "folder.mcap").mkdir()
    assert "folder" in fails(1, "encode", array, tmp_path / "folder.mcap")
    (tmp_path / "file").write_bytes(b"")
    assert "it is a file" in fails(1, "decode", coded, tmp_path / "file")
    assert ".mp4 or .png" in fails(2, "decode", coded, tmp_path / "x.gif", "--format", "mosaic")


def test_views_and_frames_outside_the_stream(coded: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert "row 0..2" in fails(2, "decode", coded, out, "--view", "0,2.5")
    assert "row 0..2" in fails(2, "decode", coded, out, "--view", "-1,0")
    assert "--grid" in fails(2, "decode", coded, out, "--view", "0,1", "--format", "array")
    assert "frames" in fails(2, "decode", coded, out, "--frames", "5:")
    assert not out.exists()


def test_frames_that_the_input_does_not_have(array: Path, tmp_path: Path) -> None:
    assert "--frames" in fails(2, "encode", array, tmp_path / "o.mcap", "--frames", "9:12")
    assert not (tmp_path / "o.mcap").exists()


def test_comparing_unequal_grids(array: Path, tmp_path: Path) -> None:
    other = write_array(tmp_path / "other", 2, 3)
    assert "grid 2x3, expected grid 3x3" in fails(1, "compare", array, other)


def test_an_error_on_the_way_closes_the_file_and_says_what_it_holds(array: Path, tmp_path: Path) -> None:
    spoil(array / "r02_c00" / "000002.png")
    message = fails(1, "encode", array, tmp_path / "o.mcap", *FIXED_RANGE)
    assert "r02_c00/000002.png" in message
    assert message.endswith("o.mcap holds 2 of 4 frame sets")
    assert json.loads(succeeds("info", tmp_path / "o.mcap", "--json"))["frames"] == 2


def test_ctrl_c_closes_the_file_and_says_what_it_holds(tmp_path: Path) -> None:
    array = write_array(tmp_path / "long", 2, 2, frames=150)
    out = tmp_path / "o.mcap"
    with subprocess.Popen([*COMMAND, "encode", array, out, *FIXED_RANGE], stderr=subprocess.PIPE) as process:
        deadline = time.monotonic() + 60
        while not out.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        assert process.stderr is not None
        message = process.stderr.read().decode()
    assert process.returncode == 1
    assert "interrupted" in message
    assert "Traceback" not in message
    frames = json.loads(succeeds("info", out, "--json"))["frames"]
    assert 1 <= frames < 150
    assert f"holds {frames} of 150 frame sets" in message


def test_a_reader_that_has_seen_enough_is_no_traceback(array: Path) -> None:
    done = subprocess.run(
        f"{' '.join(COMMAND)} compare {array} {array} | true", shell=True, capture_output=True, check=False
    )
    assert b"Traceback" not in done.stderr
    assert b"Exception ignored" not in done.stderr


def test_nominal_calibration_is_said_once(array: Path, tmp_path: Path) -> None:
    done = mvcodec("encode", array, tmp_path / "o.mcap")
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stderr.splitlines() if "calibration" in line]
    assert len(lines) == 1
    assert lines[0].startswith("mvcodec: warning: ")
