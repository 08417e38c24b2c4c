"""Standard streams that are closed, full, or whose other end goes away; and files that don't come."""

from __future__ import annotations

import shlex
import signal
import subprocess
import time
from pathlib import Path

import pytest
from command_line import COMMAND, fails, succeeds
from small_arrays import write_array

needs_full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
CLOSED_OUTPUT = "mvcodec: error: standard output: cannot be written: it is closed"
FULL_OUTPUT = "mvcodec: error: standard output: cannot be written: No space left on device"
CLOSED_INPUT = "mvcodec: error: standard input: found a closed stream, expected an open one"


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("array") / "a", 1, 2, frames=2)


@pytest.fixture(scope="module")
def coded(array: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("coded") / "x.mcap"
    succeeds("encode", array, path, "--disparity-range", "0,8")
    return path


def shell(line: str) -> tuple[int, list[str]]:
    """Run ``mvcodec LINE`` by a shell; the exit code and the lines on standard error, warnings left out."""
    command = shlex.join(COMMAND)
    done = subprocess.run(
        ["sh", "-c", f"{command} {line}"], stderr=subprocess.PIPE, text=True, check=False, timeout=900
    )
    return done.returncode, [text for text in done.stderr.splitlines() if "mvcodec: warning: " not in text]


def test_closed_output_is_one_line(array: Path, coded: Path) -> None:
    assert shell(f"info {coded} >&-") == (1, [CLOSED_OUTPUT])
    assert shell(f"encode {array} - --disparity-range 0,8 >&-") == (1, [CLOSED_OUTPUT])
    assert shell("--help >&-") == (1, [CLOSED_OUTPUT])


def test_closed_output_is_no_error_where_nothing_is_printed(coded: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert shell(f"decode {coded} {out} --synthesizer linear --frames :1 --quiet >&-") == (0, [])
    assert (out / "array.json").exists()


def test_closed_input_is_one_line(tmp_path: Path) -> None:
    assert shell(f"decode - {tmp_path / 'out'} <&-") == (1, [CLOSED_INPUT])
    assert shell(f"encode - {tmp_path / 'o.mcap'} --topics /a,/b <&-") == (1, [CLOSED_INPUT])


def test_with_standard_error_closed_files_stay_as_they_are(array: Path, tmp_path: Path) -> None:
    assert shell(f"encode {array} {tmp_path / 'x.mcap'} --disparity-range 0,8 --quiet 2>&-") == (0, [])
    assert succeeds("validate", tmp_path / "x.mcap") == f"{tmp_path / 'x.mcap'}: clean\n"
    assert shell(f"info {tmp_path / 'none.mcap'} 2>&-") == (1, [])


@needs_full
def test_a_full_output_is_named(coded: Path) -> None:
    assert shell(f"info {coded} >/dev/full") == (1, [FULL_OUTPUT])
    assert shell("decode --help >/dev/full") == (1, [FULL_OUTPUT])


def test_a_reader_that_has_seen_enough_ends_what_is_printed_without_a_word(coded: Path) -> None:
    code = "{ sleep 0.1; %s; echo $? >&2; } | true"
    for command in (f"info {coded}", "encode --help"):
        line = code % f"{shlex.join(COMMAND)} {command}"
        done = subprocess.run(["sh", "-c", line], stderr=subprocess.PIPE, text=True, check=True)
        assert done.stderr == "1\n"


def test_standard_input_has_one_name(tmp_path: Path) -> None:
    found = "mvcodec: error: standard input: found a file that is not MCAP"
    topics = ("--topics", "/a,/b")
    assert fails(1, "decode", "-", tmp_path / "out", stdin=b"no MCAP" * 9).startswith(found)
    assert fails(1, "encode", "-", tmp_path / "o.mcap", *topics, stdin=b"no MCAP" * 9).startswith(found)


def test_following_a_file_that_is_not_there_is_said_at_once_and_ends_at_ctrl_c(tmp_path: Path) -> None:
    missing = tmp_path / "none.mcap"
    arguments = ["decode", str(missing), str(tmp_path / "out"), "--follow"]
    with subprocess.Popen([*COMMAND, *arguments], stderr=subprocess.PIPE, text=True) as waiting:
        assert waiting.stderr is not None
        try:
            told = waiting.stderr.readline()
            assert told == f"mvcodec: warning: {missing}: not there yet; waiting for it\n"
            time.sleep(0.2)
            assert waiting.poll() is None
            waiting.send_signal(signal.SIGINT)
            (line,) = waiting.stderr.read().splitlines()
            assert line.startswith(f"mvcodec: error: {missing}: found No such file")
        finally:
            waiting.kill()
    assert waiting.returncode == 1


@pytest.mark.parametrize("source", ["http://127.0.0.1:1/a.mcap", "-"])
def test_only_files_can_be_followed(source: str, tmp_path: Path) -> None:
    line = fails(2, "decode", source, tmp_path / "out", "--follow")
    assert line.startswith(f"mvcodec: error: --follow: found IN.mcap {source}, expected the path of a file")
