"""The command line on damaged, cut and unfinished files: exit codes, lines, and what stays on disk."""

from __future__ import annotations

import io
import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import COMMAND, fails, mvcodec, succeeds
from damage import COUNT, GOP, chunk_ends, outcome, small_file
from PIL import Image

from mvcodec.container import McapReader
from mvcodec.decoding.decoder import Decoder

QUICK = ("--synthesizer", "linear")


@pytest.fixture(scope="module")
def file() -> bytes:
    return small_file()


@pytest.fixture
def flipped(file: bytes, tmp_path: Path) -> Path:
    """A file with a damaged third chunk: frame sets 10 to 14."""
    broken = bytearray(file)
    broken[chunk_ends(file)[2] - 100] ^= 16
    path = tmp_path / "flipped.mcap"
    path.write_bytes(broken)
    return path


@pytest.fixture
def cut(file: bytes, tmp_path: Path) -> Path:
    """A file that breaks off in its third chunk."""
    path = tmp_path / "cut.mcap"
    path.write_bytes(file[: chunk_ends(file)[2] - 100])
    return path


def _frames(folder: Path) -> tuple[int, int]:
    """Frames that array.json names, and those that are there."""
    document = json.loads((folder / "array.json").read_text())
    return document["frames"], len(list((folder / "r00_c00").glob("*.png")))


def test_damage_stops_decoding_by_default_and_what_was_decoded_stays(flipped: Path, tmp_path: Path) -> None:
    line = fails(1, "decode", flipped, tmp_path / "out")
    assert "at 1.000..1.400 s: found damage" in line
    assert _frames(tmp_path / "out") == (2 * GOP, 2 * GOP)
    fails(1, "decode", flipped, tmp_path / "mp4", "--format", "mp4", "--view", "0,0.5")
    assert [path.suffix for path in (tmp_path / "mp4").iterdir()] == [".mp4"]


def test_a_file_cut_before_its_first_whole_frame_set_has_nothing_to_decode(
    file: bytes, tmp_path: Path
) -> None:
    path, out = tmp_path / "cut.mcap", tmp_path / "out"
    for size in (8, 100, 3000):
        path.write_bytes(file[:size])
        for command in (("decode", path, out), ("recover", path, tmp_path / "clean.mcap")):
            line = fails(1, *command)
            assert "found a file cut off before its first frame set ended" in line
        assert not out.exists()
        assert not (tmp_path / "clean.mcap").exists()


@pytest.mark.parametrize(("form", "name"), [("array", "out"), ("mcap", "out.mcap"), ("mosaic", "out.mp4")])
def test_json_says_how_much_of_a_file_was_read(file: bytes, tmp_path: Path, form: str, name: str) -> None:
    whole = tmp_path / "whole.mcap"
    whole.write_bytes(file)
    arguments = ("decode", whole, tmp_path / name, "--format", form, *QUICK, "--json")
    report = json.loads(succeeds(*arguments))
    assert (report["frames"], report["bytes"]) == (COUNT, len(file))
    assert len(file) / 2 < report["bytes_read"] <= 2 * len(file)
    part = json.loads(succeeds(*arguments, "--frames", ":2", "-y"))
    assert part["frames"] == 2
    assert part["bytes_read"] < report["bytes_read"]


def test_json_comes_before_the_line_about_damage(flipped: Path, cut: Path, tmp_path: Path) -> None:
    done = mvcodec("decode", flipped, tmp_path / "out", *QUICK, "--json")
    assert done.returncode == 1
    assert "at 1.000..1.400 s: found damage" in done.stderr
    assert json.loads(done.stdout)["frames"] == 2 * GOP
    done = mvcodec("decode", cut, tmp_path / "out", *QUICK, "--json", "-y")
    assert done.returncode == 0
    assert "cut off after" in done.stderr
    assert json.loads(done.stdout)["bytes"] == cut.stat().st_size


def test_damage_is_skipped_where_that_is_asked_for(flipped: Path, tmp_path: Path) -> None:
    done = mvcodec("decode", flipped, tmp_path / "out", "--on-error", "skip", "--quiet")
    assert done.returncode == 0
    (line,) = done.stderr.splitlines()
    assert line.startswith("mvcodec: warning: ")
    assert "/camera/r00_c00/calibration and 7 more topics at 1.000..1.400 s" in line
    assert _frames(tmp_path / "out") == (COUNT - GOP, COUNT - GOP)


def test_a_cut_file_decodes_with_one_warning(cut: Path, tmp_path: Path) -> None:
    done = mvcodec("decode", cut, tmp_path / "out", "--quiet")
    assert done.returncode == 0
    (line,) = done.stderr.splitlines()
    assert "cut off after" in line
    assert _frames(tmp_path / "out")[0] >= 2 * GOP


def test_recover_writes_a_clean_file(flipped: Path, cut: Path, tmp_path: Path) -> None:
    for source, least in ((flipped, COUNT - GOP), (cut, 2 * GOP)):
        target = tmp_path / f"clean_{source.name}"
        done = mvcodec("recover", source, target)
        assert done.returncode == 0
        assert "frame sets recovered" in done.stdout
        assert len(done.stderr.splitlines()) == 1
        found = outcome(target.read_bytes())
        assert (found.told, found.error) == ([], None)
        assert found.frames == outcome(source.read_bytes(), "skip").frames
        assert len(found.frames) >= least
        assert done.stdout.startswith(f"{target}: {len(found.frames)} frame sets")


def test_recover_without_its_first_frame_sets_says_where_the_file_begins(file: bytes, tmp_path: Path) -> None:
    broken = bytearray(file)
    broken[chunk_ends(file)[0] - 100] ^= 16
    (tmp_path / "in.mcap").write_bytes(broken)
    succeeds("recover", tmp_path / "in.mcap", tmp_path / "out.mcap")
    with McapReader.open(tmp_path / "out.mcap") as reader:
        assert reader.header.first_frame == GOP
        assert reader.frame_count == COUNT - GOP


def test_recover_refuses_what_it_cannot_do(file: bytes, tmp_path: Path) -> None:
    source = tmp_path / "in.mcap"
    source.write_bytes(file[:100])
    assert "cut off before its first frame set" in fails(1, "recover", source, tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()
    assert "another file than IN" in fails(2, "recover", source, source)
    assert "No such file" in fails(1, "recover", tmp_path / "none.mcap", tmp_path / "out.mcap")


def test_limits_are_settings(file: bytes, tmp_path: Path) -> None:
    source = tmp_path / "in.mcap"
    source.write_bytes(file)
    line = fails(1, "decode", source, tmp_path / "out", "--limit", "max_cameras=1")
    assert "real cameras: found 2, expected at most max_cameras = 1" in line
    assert "NAME one of max_record_bytes" in fails(2, "decode", source, tmp_path / "out", "--limit", "size=1")
    assert "expected max_cameras=a whole number of at least 1" in fails(
        2, "decode", source, tmp_path / "out", "--limit", "max_cameras=0"
    )


@pytest.mark.parametrize("command", ["render {} x.png", "play {} --no-browser", "export-points {} x.ply"])
def test_limits_are_settings_wherever_a_file_is_opened(file: bytes, tmp_path: Path, command: str) -> None:
    source = tmp_path / "in.mcap"
    source.write_bytes(file)
    line = fails(1, *command.format(source).split(), "--limit", "max_views=1")
    assert "views: found 2, expected at most max_views = 1" in line


def test_render_stops_at_damage_or_goes_on_behind_it(flipped: Path, tmp_path: Path) -> None:
    arguments = ("render", flipped, tmp_path / "x.gif", *QUICK)
    assert "at 1.000..1.400 s: found damage" in fails(1, *arguments)
    assert not (tmp_path / "x.gif").exists()
    done = mvcodec(*arguments, "--on-error", "skip", "--quiet")
    assert done.returncode == 0
    (line,) = done.stderr.splitlines()
    assert line.startswith("mvcodec: warning: ")
    with Image.open(tmp_path / "x.gif") as animation:
        assert getattr(animation, "n_frames", 1) == COUNT - GOP


def test_follow_reads_a_file_while_it_grows(file: bytes, tmp_path: Path) -> None:
    growing = tmp_path / "growing.mcap"
    arguments = ["decode", str(growing), str(tmp_path / "out"), "--follow", "--quiet"]
    reader = subprocess.Popen([*COMMAND, *arguments], stderr=subprocess.PIPE)
    try:
        with growing.open("wb", buffering=0) as target:
            ends = chunk_ends(file)
            target.write(file[: ends[1] + 7])
            deadline = time.monotonic() + 60
            last = tmp_path / "out" / "r00_c00" / f"{2 * GOP - 1:06d}.png"
            while not last.exists() and time.monotonic() < deadline:
                time.sleep(0.05)
            assert last.exists(), "what is written is decoded before the rest comes"
            assert reader.poll() is None
            target.write(file[ends[1] + 7 :])
        _, told = reader.communicate(timeout=60)
    finally:
        reader.kill()
    assert (reader.returncode, told) == (0, b"")
    assert _frames(tmp_path / "out") == (COUNT, COUNT)


def test_follow_ends_with_what_is_there_at_ctrl_c(cut: Path, tmp_path: Path) -> None:
    arguments = ["decode", str(cut), str(tmp_path / "out"), "--follow", "--quiet"]
    reader = subprocess.Popen([*COMMAND, *arguments], stderr=subprocess.PIPE, text=True)
    try:
        last = tmp_path / "out" / "r00_c00" / f"{2 * GOP - 1:06d}.png"
        deadline = time.monotonic() + 60
        while not last.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        reader.send_signal(signal.SIGINT)
        _, told = reader.communicate(timeout=60)
    finally:
        reader.kill()
    assert reader.returncode == 0, told
    assert "cut off after" in told
    assert _frames(tmp_path / "out")[0] >= 2 * GOP


_ENCODE_FOR_EVER = """
import sys
from pathlib import Path
from coding import config, frame_set, make_array
from mvcodec.container import McapWriter
from mvcodec.encoding.encoder import Encoder
array = make_array(48, 32, fps=10.0, rows=1, cols=2)
with Encoder(array, config(gop=7)) as encoder, McapWriter(Path(sys.argv[1]), 300) as writer:
    for index in range(250):
        writer.push(encoder.push(frame_set(array, index)))
        print(index, flush=True)
"""


def _kill_while_encoding(path: Path, at: int, delay_s: float) -> None:
    """Kill an encoder without warning some time after it has pushed a frame set, and look what is left."""
    tests = str(Path(__file__).parent)
    encoder = subprocess.Popen(
        [sys.executable, "-c", _ENCODE_FOR_EVER, str(path)],
        stdout=subprocess.PIPE,
        env={"PYTHONPATH": tests, "PATH": ""},
    )
    assert encoder.stdout is not None
    try:
        while int(encoder.stdout.readline()) < at:
            pass
        time.sleep(delay_s)
    finally:
        encoder.kill()
        rest = encoder.stdout.read().split()
        encoder.wait()
    pushed = int(rest[-1]) if rest else at
    clean = path.with_suffix(".clean.mcap")
    done = mvcodec("recover", path, clean)
    assert done.returncode == 0, done.stderr
    with Decoder.open(io.BytesIO(clean.read_bytes())) as decoder:
        frames = [decoded.index for decoded in decoder]
    assert frames == list(range(len(frames)))
    assert pushed - frames[-1] <= 3, "0.3 s of 10 frames/s"


def test_a_killed_encoder_loses_one_chunk_at_most(tmp_path: Path) -> None:
    for number, at in enumerate((8, 30)):
        _kill_while_encoding(tmp_path / f"{number}.mcap", at, 0.003 * number)


@pytest.mark.slow
def test_an_encoder_killed_at_50_random_moments_loses_one_chunk_at_most(tmp_path: Path) -> None:
    moments = random.Random(6)
    for number in range(50):
        _kill_while_encoding(tmp_path / f"{number}.mcap", moments.randrange(4, 200), moments.uniform(0, 0.02))


def test_chunk_ms_bounds_what_waits(tmp_path: Path) -> None:
    assert "expected a whole number of ms, 0..60000" in fails(
        2, "encode", tmp_path, tmp_path / "x.mcap", "--chunk-ms", "60001"
    )
