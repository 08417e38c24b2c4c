"""The live view: a client of Foxglove's protocol gets what goes into the file, while it is being encoded."""

from __future__ import annotations

import re
import socket
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, cast

import av
import numpy as np
import pytest
from coding import config, frame_set, luma_psnr, make_array
from command_line import COMMAND, fails, mvcodec
from foxglove_client import FoxgloveClient, foxglove
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from mcap.reader import make_reader
from small_arrays import write_array

from mvcodec.cli.live_view_option import address
from mvcodec.container import McapWriter
from mvcodec.encoding.encoder import Encoder
from mvcodec.errors import SettingError
from mvcodec.output.live_view import LiveView

ARRAY = make_array(fps=10.0, rows=1)
GOP = 10
CHANNELS = 8
"""Header, transforms, and calibration, pictures and maps of two cameras."""
VIDEO = [f"/camera/r00_c0{col}/video" for col in range(2)]
HEADER = "/mvcodec/header"


class Encoding:
    """`mvcodec encode - OUT --live-view 0`, given one frame set at a time."""

    def __init__(self, out: Path) -> None:
        options = ("--topics", ",".join(VIDEO), "--preset", "ultrafast", "--disparity-range", "0,16")
        self.process = subprocess.Popen(
            [*COMMAND, "encode", "-", str(out), *options, "--qp", "14", "--fps", "10", "--live-view", "0"],
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
        )
        assert self.process.stdin is not None
        assert self.process.stderr is not None
        found = re.search(rb"ws://127\.0\.0\.1:\d+", self.process.stderr.readline())
        assert found is not None
        self.url = found[0].decode()
        self._encoder = Encoder(ARRAY, config(qp=10))
        self._writer = McapWriter(cast("BinaryIO", self.process.stdin), chunk_ms=0)
        self._next = 0

    def give(self, count: int) -> None:
        """The next frame sets."""
        for _ in range(count):
            self._writer.push(self._encoder.push(frame_set(ARRAY, self._next)))
            self._next += 1

    def end(self) -> None:
        """Nothing comes any more; the command must end well."""
        self._encoder.flush()
        self._writer.close()
        _, told = self.process.communicate(timeout=60)
        assert self.process.returncode == 0, told


@contextmanager
def encoding(out: Path) -> Iterator[Encoding]:
    running = Encoding(out)
    try:
        yield running
    finally:
        running.process.kill()
        running.process.wait()


def _decoded(units: list[bytes]) -> list[av.VideoFrame]:
    decoder = av.CodecContext.create("h264", "r")
    frames = [
        frame for unit in units for frame in decoder.decode(av.Packet(CompressedVideo.FromString(unit).data))
    ]
    return [*frames, *decoder.decode(None)]


def _take(client: FoxgloveClient, topic: str, time_ns: int) -> list[tuple[str, int, bytes]]:
    """Everything up to a topic's message of a time."""
    taken = []
    for message in client.messages():
        taken.append(message)
        if message[:2] == (topic, time_ns):
            return taken
    raise AssertionError(f"{topic} at {time_ns} never came")


def test_a_client_gets_what_goes_into_the_file(tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    with encoding(out) as running, foxglove(running.url) as client:
        running.give(2)
        client.wait_for_channels(CHANNELS)
        client.subscribe(client.channels)
        running.give(2 * GOP)
        end_ns = frame_set(ARRAY, 2 * GOP).time_ns  # the last one may wait for what follows it
        got = _take(client, "/camera/r00_c01/disparity", end_ns)
        running.end()
    with out.open("rb") as file:
        held = list(make_reader(file).iter_messages())
    named = {channel.topic: (schema.name, channel.message_encoding) for schema, channel, _ in held if schema}
    assert {
        topic: (found["schemaName"], found["encoding"]) for topic, found in client.channels.items()
    } == named
    written = {(channel.topic, message.log_time, message.data) for _, channel, message in held}
    assert set(got) <= written
    key_ns = frame_set(ARRAY, GOP).time_ns
    units: dict[str, list[bytes]] = defaultdict(list)
    for topic, time_ns, data in got:
        if time_ns >= key_ns:
            units[topic].append(data)
    for col, topic in enumerate(VIDEO):
        frames = _decoded(units[topic])
        assert len(frames) == GOP + 1
        for index, frame in enumerate(frames, GOP):
            original = frame_set(ARRAY, index).pictures[0, col]
            assert luma_psnr(np.asarray(frame.to_ndarray(format="rgb24"), np.uint8), original) > 33


def test_a_late_joiner_gets_the_rig_at_once_and_pictures_from_the_next_keyframe(tmp_path: Path) -> None:
    with encoding(tmp_path / "out.mcap") as running:
        with foxglove(running.url) as first:
            running.give(3)
            first.wait_for_channels(CHANNELS)
        with foxglove(running.url) as late:
            late.wait_for_channels(CHANNELS)
            late.subscribe([*VIDEO, "/tf", "/camera/r00_c01/calibration", HEADER])
            running.give(2)
            early = _take(late, VIDEO[0], frame_set(ARRAY, 3).time_ns)
            running.give(GOP)
            later = _take(late, VIDEO[0], frame_set(ARRAY, GOP + 3).time_ns)
        running.end()
    rig = {(topic, time_ns) for topic, time_ns, _ in early}
    assert rig >= {("/tf", 0), ("/camera/r00_c01/calibration", 0), (HEADER, 0)}
    placed = {FrameTransform.FromString(data).child_frame_id for topic, _, data in early if topic == "/tf"}
    assert placed == {"camera_r00_c00", "camera_r00_c01"}
    key_ns = next(time_ns for topic, time_ns, _ in later if topic == HEADER)
    assert key_ns == frame_set(ARRAY, GOP).time_ns
    units = [data for topic, time_ns, data in later if topic == VIDEO[0] and time_ns >= key_ns]
    assert len(_decoded(units)) == 4


def test_a_client_that_does_not_read_stalls_nobody() -> None:
    data = bytes(50_000)
    with LiveView("127.0.0.1", 0) as view:
        view.add_channel("/camera/r00_c00/video", "protobuf", "foxglove.CompressedVideo", "protobuf", b"")
        with foxglove(view.url) as stuck:
            stuck.wait_for_channels(1)
            stuck.subscribe(stuck.channels)
            started = time.monotonic()
            for index in range(4000):
                view.begin_set(keyframe=False)
                view.add("/camera/r00_c00/video", index, data)
            assert time.monotonic() - started < 20
            times = [time_ns for _, time_ns, _ in stuck.messages(timeout_s=2)]
    assert len(times) < 4000, "the oldest were dropped"
    assert times == sorted(times)
    assert times[-1] == 3999


def test_beyond_this_machine_it_is_told(tmp_path: Path) -> None:
    array = write_array(tmp_path / "array", frames=1)
    fast = ("--preset", "ultrafast", "--matcher", "sgbm", "--disparity-range", "0,16")
    done = mvcodec("encode", array, tmp_path / "x.mcap", *fast, "--live-view", "0.0.0.0:0")
    assert done.returncode == 0, done.stderr
    assert "--live-view 0.0.0.0: everyone who reaches this machine" in done.stderr
    done = mvcodec("encode", array, tmp_path / "y.mcap", *fast, "--live-view", "0")
    assert "everyone" not in done.stderr


def test_addresses() -> None:
    assert address("8765") == ("127.0.0.1", 8765)
    assert address("localhost:1") == ("localhost", 1)
    assert address("[::1]:0") == ("::1", 0)


def test_what_cannot_be_is_one_line(tmp_path: Path) -> None:
    array = write_array(tmp_path / "array", frames=1)
    out = tmp_path / "x.mcap"
    for text in ("70000", "a:b", "::1:80", ""):
        assert "[HOST:]PORT" in fails(2, "encode", array, out, "--live-view", text)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        line = fails(2, "encode", array, out, "--live-view", str(port))
        assert f"--live-view: found 127.0.0.1:{port} (Failed to bind port: Address already in use" in line
        with pytest.raises(SettingError, match="free port"):
            LiveView("127.0.0.1", port)
    assert not out.exists()


def test_without_the_sdk_one_line_says_how_to_install_it(tmp_path: Path) -> None:
    array = write_array(tmp_path / "array", frames=1)
    hidden = "import sys; sys.modules['foxglove'] = None; from mvcodec.cli.main import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", hidden, "encode", array, tmp_path / "x.mcap", "--live-view", "0"],
        capture_output=True,
        text=True,
        check=False,
    )
    lines = [line for line in done.stderr.splitlines() if "warning" not in line]
    assert (done.returncode, len(lines)) == (1, 1)
    assert "foxglove-sdk is not installed; install it with: pip install 'foxglove-sdk>=" in lines[0]
