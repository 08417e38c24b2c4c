"""Live: recordings and streams in, pipes between, MCAP out; each command in a process of its own."""

from __future__ import annotations

import io
import json
import os
import subprocess
import threading
import time
from pathlib import Path
from typing import IO, BinaryIO, cast

import numpy as np
import pytest
from coding import Pipe, config, frame_set, luma_psnr, make_array
from command_line import COMMAND, fails, mvcodec, succeeds
from recordings import ARRAY, GRID, START_NS, recording, shots
from small_arrays import write_array

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.conformance.validation import validate
from mvcodec.container import McapReader, McapWriter, read_info
from mvcodec.container.declared import DROPPED_KEY
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder
from mvcodec.encoding.live import WAITING_INPUT, WAITING_OUTPUT, BehindSettings, LiveEncoding
from mvcodec.errors import OutputError, SettingError

FAST = ("--preset", "ultrafast", "--disparity-range", "0,16", "--topics", GRID)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / "rec.mcap"
    path.write_bytes(recording("png", shots(12, jitter_ns=1_000_000)))
    return path


def _indexes(content: bytes) -> list[int]:
    with Decoder.open(io.BytesIO(content)) as decoder:
        return [decoded.index for decoded in decoder]


def test_a_recording_is_encoded(recorded: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    done = mvcodec("encode", recorded, out, *FAST, "--qp", "14")
    assert done.returncode == 0, done.stderr
    assert "12 frame sets of 4 cameras" in done.stdout
    assert done.stderr.count("\n") == 1
    assert "no calibration given" in done.stderr
    assert validate(out) == []
    with Decoder.open(out) as decoder:
        for decoded in decoder:
            assert decoded.time_ns == START_NS + decoded.index * 100_000_000
            original = frame_set(ARRAY, decoded.index).pictures
            assert luma_psnr(decoded.pictures[1, 0], original[1, 0]) > 36


def test_a_range_of_a_recording_and_what_is_missing_from_the_command(recorded: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    succeeds("encode", recorded, out, *FAST, "--frames", "3:7")
    assert _indexes(out.read_bytes()) == [3, 4, 5, 6]
    assert "--topics: found nothing" in fails(2, "encode", recorded, out, "-y")
    assert "counted from the start" in fails(2, "encode", recorded, out, "-y", *FAST, "--frames", "-2:")
    assert "no topic /x, expected" in fails(1, "encode", recorded, out, "-y", "--topics", "/x,/y")
    with_grid = ("--topics", GRID.replace(";", ","), "--grid", "2x2", *FAST[:4])
    succeeds("encode", recorded, out, "-y", *with_grid, "--frames", ":2")
    assert "4 topics, expected 3x2" in fails(2, "encode", recorded, out, "-y", *with_grid[:3], "3x2")


def test_the_first_frame_set_of_a_recording_widens_a_range_that_is_too_narrow(
    recorded: Path, tmp_path: Path
) -> None:
    out, narrow = tmp_path / "out.mcap", ("--frames", ":2", *FAST, "--disparity-range", "0,2")
    assert "beyond the stated 0..2 px; widened to 0..7 px" in mvcodec("encode", recorded, out, *narrow).stderr
    assert _indexes(out.read_bytes()) == [0, 1]
    assert read_info(out).header.disparity_range_px == (0, 7)
    assert mvcodec("encode", recorded, out, "-y", *narrow, "--exact-range").stderr.count("\n") == 1
    assert read_info(out).header.disparity_range_px == (0, 2)


def test_bytes_go_through_pipes_from_producer_to_viewer(recorded: Path) -> None:
    encoder = subprocess.Popen(
        [*COMMAND, "encode", "-", "-", *FAST, "--qp", "14"],
        stdin=recorded.open("rb"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    decoder = subprocess.Popen(
        [
            *COMMAND,
            "decode",
            "-",
            "-",
            "--format",
            "mcap",
            "--grid",
            "2x3",
            "--synthesizer",
            "linear",
            "--quiet",
        ],
        stdin=encoder.stdout,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert encoder.stdout is not None
    encoder.stdout.close()
    dense, told = decoder.communicate(timeout=120)
    assert (decoder.returncode, told) == (0, b"")
    assert encoder.wait(timeout=60) == 0
    topics = tuple(tuple(f"/view/r0{row}_c0{col}/video" for col in range(3)) for row in range(2))
    views = Recording(io.BytesIO(dense), "dense", RecordingSettings(topics, real="all"))
    found = list(views.frame_sets())
    assert [frames.time_ns for frames in found] == [START_NS + i * 100_000_000 for i in range(12)]
    for frames in found:
        original = frame_set(ARRAY, frames.index).pictures
        assert luma_psnr(frames.pictures[1, 2], original[1, 1]) > 30, "the real camera at the right"
        assert frames.pictures[0, 1].std() > 20, "a virtual one in the middle"


def test_views_are_written_into_an_mcap_file(recorded: Path, tmp_path: Path) -> None:
    coded, dense = tmp_path / "x.mcap", tmp_path / "dense.mcap"
    succeeds("encode", recorded, coded, *FAST, "--frames", ":3")
    succeeds("decode", coded, dense, "--format", "mcap", "--view", "0,0.5", "--synthesizer", "linear")
    reading = Recording(
        dense.open("rb"), "dense", RecordingSettings((("/view/r0.000_c0.500/video",),), real="all")
    )
    assert len(list(reading.frame_sets())) == 3
    assert "--format mcap for standard output" in fails(2, "decode", coded, "-")
    assert "ends in .mcap" in fails(2, "decode", coded, tmp_path / "dense.mp4", "--format", "mcap")


def test_an_array_folder_goes_out_through_a_pipe(tmp_path: Path) -> None:
    array = write_array(tmp_path / "array", frames=3)
    done = subprocess.run(
        [*COMMAND, "encode", str(array), "-", "--preset", "ultrafast"], capture_output=True, check=True
    )
    assert _indexes(done.stdout) == [0, 1, 2]


def test_what_goes_out_through_a_pipe_is_summed_up_on_standard_error(recorded: Path, tmp_path: Path) -> None:
    folder, piped = write_array(tmp_path / "array", 1, 2, frames=2), tmp_path / "piped.mcap"
    for source, options in ((recorded, FAST), (folder, FAST[:4])):
        told = _through_a_pipe(piped, source, *options)
        stated = succeeds("info", piped).splitlines()[0].removeprefix(f"{piped}: ")
        assert told[-1] == f"mvcodec: standard output: {stated}"
        assert told[:-1] == _through_a_pipe(piped, source, *options, "--quiet")


def _through_a_pipe(target: Path, source: Path, *options: str) -> list[str]:
    """Encode to standard output, that is `target`; returns the lines on standard error."""
    done = subprocess.run([*COMMAND, "encode", source, "-", *options], capture_output=True, check=True)
    target.write_bytes(done.stdout)
    return done.stderr.decode().splitlines()


def test_a_reader_that_goes_away_is_one_line(recorded: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as closed:
        done = subprocess.run(
            [*COMMAND, "encode", str(recorded), "-", *FAST],
            stdout=closed,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 1
    lines = [line for line in done.stderr.splitlines() if "warning" not in line]
    assert lines == ["mvcodec: error: standard output: cannot be written: Broken pipe"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_is_one_line(recorded: Path, tmp_path: Path) -> None:
    full = tmp_path / "full.mcap"
    full.symlink_to("/dev/full")
    line = fails(1, "encode", recorded, full, *FAST, "--chunk-ms", "0")
    assert "full.mcap: cannot be written: No space left on device" in line


def test_each_frame_set_is_on_the_wire_before_the_next_one_comes() -> None:
    array = make_array(48, 32, rows=1, cols=2)
    reading, writing = os.pipe()
    arrived: list[int] = []
    go_on = threading.Semaphore(0)

    def watch() -> None:
        with os.fdopen(reading, "rb", buffering=0) as pipe, Decoder.open(pipe) as decoder:
            for decoded in decoder:
                arrived.append(decoded.index)
                go_on.release()

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()

    def come() -> object:
        for index in range(6):
            yield frame_set(array, index)
            assert go_on.acquire(timeout=30), "a frame set must arrive before the next one is given"

    with (
        os.fdopen(writing, "wb", buffering=0) as pipe,
        Encoder(array, config()) as encoder,
        McapWriter(pipe, chunk_ms=0) as writer,
    ):
        LiveEncoding(encoder, writer).run(come())  # type: ignore[arg-type]
    watcher.join(30)
    assert arrived == list(range(6))


class _SlowPipe(io.RawIOBase):
    """An output whose reader takes its time."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.content = bytearray()

    def writable(self) -> bool:
        return True

    def write(self, data: object, /) -> int:
        time.sleep(self.seconds)
        self.content += bytes(cast("bytes", data))
        return len(cast("bytes", data))


def _live(count: int, when_behind: str, seconds: float) -> tuple[LiveEncoding, bytes]:
    array = make_array(48, 32, rows=1, cols=2)
    target = _SlowPipe(seconds)
    with (
        Encoder(array, config()) as encoder,
        McapWriter(cast("BinaryIO", target), chunk_ms=0) as writer,
    ):
        live = LiveEncoding(encoder, writer, BehindSettings(when_behind))  # type: ignore[arg-type]
        live.run(frame_set(array, index) for index in range(count))
        writer.note({DROPPED_KEY: str(live.dropped)})
        target.seconds = 0
    return live, bytes(target.content)


def test_a_slow_reader_costs_frame_sets_that_are_counted() -> None:
    live, content = _live(60, "drop", 0.05)
    found = _indexes(content)
    assert live.dropped > 0
    assert len(found) + live.dropped == 60
    assert found == sorted(set(found))
    assert len(found) <= 60 - live.dropped <= 60
    assert read_info(io.BytesIO(content)).dropped == live.dropped, "the count is in the file"
    assert read_info(cast("BinaryIO", Pipe(content))).dropped == live.dropped


@pytest.mark.parametrize("policy", ["drop", "block"])
def test_a_reader_that_waits_costs_the_command_frame_sets_only_if_they_may_be_dropped(
    policy: str, tmp_path: Path
) -> None:
    count = 90
    content = recording("rgb8", shots(count))
    options = ("--topics", "/cam00,/cam01", "--qp", "1", "--fps", "10", "--when-behind", policy)
    process = subprocess.Popen(
        [*COMMAND, "encode", "-", "-", *FAST, *options],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdin is not None

    def feed(stdin: IO[bytes]) -> None:
        with stdin:
            stdin.write(content)

    feeder = threading.Thread(target=feed, args=(process.stdin,), daemon=True)
    feeder.start()
    # Nobody reads the output: a pipe's worth of it, and the queues, are full before the input ends.
    feeder.join(60 if policy == "drop" else 4)
    assert feeder.is_alive() == (policy == "block")
    process.stdin = None
    coded, told = process.communicate(timeout=120)
    assert process.returncode == 0, told
    out = tmp_path / "out.mcap"
    out.write_bytes(coded)
    info = json.loads(succeeds("info", out, "--json"))
    assert info["frames"] + info["dropped"] == count
    assert (info["dropped"] > 0) == (policy == "drop")
    line = f"{info['dropped']} frame sets, left out while encoding live"
    assert line in succeeds("info", out)
    assert (f"{info['dropped']} frame sets dropped" in told.decode()) == (policy == "drop")
    assert validate(out) == []


def test_a_slow_reader_lets_the_input_wait_where_nothing_may_be_lost() -> None:
    live, content = _live(20, "block", 0.02)
    assert (live.dropped, _indexes(content)) == (0, list(range(20)))


def test_queues_are_bounded() -> None:
    array = make_array(48, 32, rows=1, cols=2)
    given = 0
    gate = threading.Event()

    class Stuck(_SlowPipe):
        def write(self, data: object, /) -> int:
            gate.wait(30)
            return super().write(data)

    def come() -> object:
        nonlocal given
        for index in range(100):
            given = index + 1
            yield frame_set(array, index)

    with (
        Encoder(array, config()) as encoder,
        McapWriter(cast("BinaryIO", Stuck(0)), chunk_ms=0) as writer,
    ):
        live = LiveEncoding(encoder, writer)
        running = threading.Thread(target=live.run, args=(come(),), daemon=True)
        running.start()
        time.sleep(1.5)
        held = given
        gate.set()
        running.join(60)
    assert held <= WAITING_INPUT + WAITING_OUTPUT + 4
    assert given == 100


def test_errors_of_reading_and_writing_come_out() -> None:
    array = make_array(48, 32, rows=1, cols=2)

    def failing() -> object:
        yield frame_set(array, 0)
        raise OutputError("camera", "gone")

    for policy in ("drop", "block"):
        target = io.BytesIO()
        with Encoder(array, config()) as encoder, McapWriter(target) as writer:
            live = LiveEncoding(encoder, writer, BehindSettings(policy))
            with pytest.raises(OutputError, match="gone"):
                live.run(failing())  # type: ignore[arg-type]
        assert _indexes(target.getvalue()) == [0]
    with pytest.raises(SettingError, match="when_behind: found maybe"):
        BehindSettings("maybe")  # type: ignore[arg-type]


def test_a_keyframe_comes_each_second_however_slowly_frame_sets_come() -> None:
    array = make_array(48, 32, rows=1, cols=2, fps=10.0)
    target = io.BytesIO()
    with Encoder(array, config()) as encoder, McapWriter(target) as writer:
        for index in range(8):
            frames = frame_set(array, index)
            slow = type(frames)(index, index * 400_000_000, frames.pictures)
            writer.push(encoder.push(slow))
    with McapReader(io.BytesIO(target.getvalue())) as reader:
        times = reader.frame_times()
    assert times is not None
    assert np.diff(times[1]).max() <= 1_200_000_000
