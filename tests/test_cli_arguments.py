"""What the command line understands and what it refuses, before any work begins."""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from small_arrays import write_array

from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.capture.timing import Timing
from mvcodec.cli.arguments import (
    OPTIONS,
    disparity_range,
    frame_slice,
    in_options,
    join_negative_values,
    pair_of_sizes,
    positive_int,
    view,
)
from mvcodec.cli.main import COMMANDS, command_parser, main
from mvcodec.cli.setting_options import reader
from mvcodec.encoding.config import EncoderConfig
from mvcodec.errors import SettingError
from mvcodec.output.styles import ShotSettings
from mvcodec.scenes.scene import SceneSettings
from mvcodec.settings import settings_of
from mvcodec.video.codec import RateControl

disparity_qp = reader(settings_of(EncoderConfig)["disparity_qp"], open_word="auto")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0:9", slice(0, 9)),
        (":9", slice(None, 9)),
        ("3:", slice(3, None)),
        ("-2:", slice(-2, None)),
        (":", slice(None, None)),
        ("1:-1", slice(1, -1)),
    ],
)
def test_frames_are_python_slices(text: str, expected: slice) -> None:
    assert frame_slice(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [("-25,20", (-25.0, 20.0)), ("0.5,1e2", (0.5, 100.0)), ("auto", "auto"), ("-3,-1.5", (-3.0, -1.5))],
)
def test_disparity_ranges_may_be_negative(text: str, expected: object) -> None:
    assert disparity_range(text) == expected


def test_disparity_qps_may_be_left_to_the_encoder() -> None:
    assert disparity_qp("auto") is None
    assert disparity_qp("31") == 31


def test_sizes_and_views_parse() -> None:
    assert pair_of_sizes("640x360") == (640, 360)
    assert pair_of_sizes("5X3") == (5, 3)
    assert view("0.5,1.25") == (0.5, 1.25)
    assert positive_int("24") == 24


@pytest.mark.parametrize(
    ("parser", "text"),
    [
        (disparity_qp, "low"),
        (disparity_qp, "2.5"),
        (frame_slice, "5"),
        (frame_slice, "0:8:2"),
        (frame_slice, "a:b"),
        (disparity_range, "5,5"),
        (disparity_range, "9,2"),
        (disparity_range, "nan,2"),
        (disparity_range, "1"),
        (disparity_range, "1,2,3"),
        (pair_of_sizes, "5"),
        (pair_of_sizes, "0x5"),
        (pair_of_sizes, "5x-1"),
        (pair_of_sizes, "5x5x5"),
        (view, "1"),
        (view, "inf,0"),
        (view, "a,b"),
        (positive_int, "0"),
        (positive_int, "-3"),
        (positive_int, "2.5"),
    ],
)
def test_what_does_not_parse_is_named_with_what_was_expected(
    parser: Callable[[str], object], text: str
) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=r"found '.*', expected"):
        parser(text)


def test_values_with_a_minus_sign_are_kept_with_their_option() -> None:
    given = ["encode", "in", "--disparity-range", "-25,20", "--frames", "-2:", "out.mcap", "--quiet"]
    joined = ["encode", "in", "--disparity-range=-25,20", "--frames=-2:", "out.mcap", "--quiet"]
    assert join_negative_values(given) == joined
    assert join_negative_values(["--frames", "--quiet"]) == ["--frames", "--quiet"]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main([command, "--help"])
    assert left.value.code == 0
    assert f"usage: mvcodec {command}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "required: COMMAND"),
        (["transmogrify"], "found 'transmogrify', expected one of sample"),
        (["encode", "in"], "required: OUT.mcap"),
        (["encode", "in", "o.mcap", "--qp", "30", "--crf", "20"], "not allowed with"),
        (["encode", "in", "o.mcap", "--qp", "many"], "--qp: found 'many', expected a whole number"),
        (["encode", "in", "o.mcap", "--disparity-range", "20,-25"], "--disparity-range: found '20,-25'"),
        (["decode", "in", "out", "--format", "gif"], "--format: found 'gif', expected one of array"),
        (["decode", "in", "out", "--grid", "3x3", "--view", "0,0"], "not allowed with"),
        (["compare", "a", "b", "--frames", "3"], "--frames: found '3'"),
        (["sample", "out", "--size", "big"], "--size: found 'big'"),
        (["decod", "in", "out"], "did you mean decode?"),
        (["encode", "in", "o.mcap", "--codec", "hvec"], "did you mean hevc?"),
        (["sample", "out", "--size", "1080q"], "480p, 720p, 1080p, 1440p, 4k, 2160p; did you mean 1080p?"),
        (
            ["encode", "in", "o.mcap", "--gird", "2x2"],
            "which the command does not take; did you mean --grid?",
        ),
        (["encode", "in", "o.mcap", "--out"], "found --out, which the command does not take (see"),
        (["encode", "in", "o.mcap", "--bitrate", "fast"], "--bitrate: found 'fast'"),
    ],
)
def test_arguments_that_do_not_fit_leave_with_2_and_one_line(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    message = capsys.readouterr().err
    assert message.startswith("mvcodec: error: ")
    assert complaint in message
    assert message.count("\n") == 1


def test_help_does_not_load_what_only_the_commands_need() -> None:
    heavy = ["numpy", "cv2", "numba", "av", "mcap", "skimage", "tqdm"]
    code = (
        "import sys\nfrom mvcodec.cli.main import main\n"
        "try: main(['--help'])\nexcept SystemExit: pass\n"
        f"print(*sorted(set(sys.modules) & set({heavy})), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == ""


def test_words_that_everyone_uses_are_understood() -> None:
    encode = command_parser("encode")
    parsed = encode.parse_args(["in", "o.mcap", "--codec", "H265", "--bitrate", "2.5M"])
    assert (parsed.codec, parsed.bitrate_kbps) == ("hevc", 2500)
    assert encode.parse_args(["in", "o.mcap", "--bitrate", "800k"]).bitrate_kbps == 800
    assert command_parser("sample").parse_args(["out", "--size", "1080p"]).size == (1920, 1080)


def test_a_misspelt_name_in_the_library_s_lists_gets_a_suggestion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_array(tmp_path / "array", frames=1)
    assert main(["encode", str(folder), str(tmp_path / "x.mcap"), "--matcher", "jiont"]) == 2
    message = capsys.readouterr().err
    assert message.startswith("mvcodec: error: --matcher: found jiont, expected one of joint")
    assert message.endswith("given; did you mean joint?\n")


@pytest.mark.parametrize(
    ("command", "settings", "other"),
    [
        ("encode", EncoderConfig, {"depth"}),
        ("encode", RateControl, set()),
        ("encode", Timing, set()),
        ("encode", RecordingSettings, set()),
        ("evaluate", EncoderConfig, {"depth"}),
        ("sample", SceneSettings, set()),
        ("render", ShotSettings, set()),
    ],
)
def test_options_say_what_the_fields_of_their_settings_say(
    command: str, settings: type, other: set[str]
) -> None:
    """`depth` chooses a form too, so that its option is another one."""
    options = {
        option: action for action in command_parser(command)._actions for option in action.option_strings
    }
    for name, known in settings_of(settings).items():
        if name not in other:
            meaning, _, default = in_options(known.help).partition(" (default: ")
            shown = (options[OPTIONS[name]].help or "").replace("%%", "%")
            assert shown.startswith(meaning), name
            assert default in shown or "default" in shown, name


@pytest.mark.parametrize(
    ("arguments", "settings", "name", "value"),
    [
        (["encode", "in", "o.mcap", "--gop", "0"], EncoderConfig, "gop", 0),
        (["encode", "in", "o.mcap", "--disparity-median", "4"], EncoderConfig, "disparity_median", 4),
        (["encode", "in", "o.mcap", "--tolerance-ms", "-1"], Timing, "tolerance_ms", -1.0),
        (["encode", "in", "o.mcap", "--bitrate", "0.5"], RateControl, "bitrate_kbps", 0.5),
        (["sample", "out", "--frames", "0"], SceneSettings, "frames", 0),
    ],
)
def test_the_command_line_refuses_what_the_library_refuses_in_its_words(
    arguments: list[str], settings: type, name: str, value: object, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SettingError) as refused:
        settings(**{name: value})
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    line = capsys.readouterr().err
    assert line.startswith(f"mvcodec: error: {OPTIONS[name]}: found {arguments[-1]}, expected ")
    assert refused.value.expected in line
