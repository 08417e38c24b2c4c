"""Live cameras over UDP on this machine: paired by when pictures were taken, with delays and losses."""

from __future__ import annotations

import io
import signal
import subprocess
import threading
import time
import warnings
from collections.abc import Callable
from contextlib import ExitStack, closing
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from command_line import COMMAND, fails, succeeds
from live_senders import FPS, NUMBERS, Sender, Server, free_port, transport_stream
from timed_videos import number_of, numbered

from mvcodec.capture.live_address import Opened, how_to_open, is_live_address
from mvcodec.capture.live_camera import LiveCamera
from mvcodec.capture.live_cameras import LiveCameras, LiveSettings
from mvcodec.capture.live_clock import HELD_BACK, ArrivalClock, common_clock
from mvcodec.conformance.validation import validate
from mvcodec.container import read_info
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import InputError, SettingError

in_real_time = pytest.mark.slow

Taken = tuple[list[list[int]], list[int], list[str]]


def taken(count: int, *senders: dict[str, Any], **settings: Any) -> Taken:
    """Numbers of the pictures of frame sets, their times, what is told; checks that pictures are whole."""
    ports = [free_port() for _ in senders]
    addresses = tuple(f"udp://127.0.0.1:{port}" for port in ports)
    start_s = time.monotonic()
    numbers, times = [], []
    with ExitStack() as stack, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for col, (port, options) in enumerate(zip(ports, senders, strict=True)):
            stack.enter_context(Sender(port, col, start_s, **options))
        cameras = stack.enter_context(
            closing(LiveCameras(LiveSettings(addresses, (1, len(ports)), **settings)))
        )
        for item in islice(cameras.frame_sets(), count):
            shown = [number_of(picture) for picture in item.pictures.values()]
            for number, ((_, col), picture) in zip(shown, item.pictures.items(), strict=True):
                assert np.abs(picture.astype(int) - numbered(number, col)).mean() < 6, "a whole picture"
            numbers.append(shown)
            times.append(item.time_ns)
    return numbers, times, [str(warning.message) for warning in caught]


def together(numbers: list[list[int]]) -> bool:
    return all(len(set(found)) == 1 for found in numbers)


@in_real_time
def test_a_delay_on_the_way_does_not_matter() -> None:
    numbers, times, told = taken(30, {}, {"delay_s": 0.25})
    assert together(numbers)
    assert all((b[0] - a[0]) % NUMBERS == 1 for a, b in pairwise(numbers))
    assert np.diff(times) == pytest.approx(1e9 / FPS, rel=0.01)
    assert abs(times[-1] - time.time_ns()) < 20e9, "times of day"
    assert any("paired by their stamps" in text for text in told)


@in_real_time
def test_clocks_that_begin_anywhere_are_paired_by_arrival() -> None:
    numbers, _, told = taken(30, {}, {"first_s": 500.0})
    assert together(numbers)
    assert any("paired by arrival" in text for text in told)


@in_real_time
def test_only_whole_pictures_come_through_losses() -> None:
    def lost(number: int, place: int) -> bool:
        return number % 11 == 5 and place == 0

    numbers, _, _ = taken(40, {}, {"lost": lost})
    assert together(numbers)
    found = {shown[0] for shown in numbers}
    assert len(found) >= 20, "keyframes heal what was lost"


@in_real_time
def test_a_camera_that_was_away_comes_back() -> None:
    numbers, times, _ = taken(110, {}, {"away": range(70, 100)})
    assert together(numbers)
    assert max(np.diff(times)) > 0.9e9, "the gap is one in the times too"


@in_real_time
def test_a_camera_that_breaks_off_is_opened_again() -> None:
    with ExitStack() as stack, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        start_s = time.monotonic()
        server = stack.enter_context(Server(1, start_s, each=45))
        port = free_port()
        stack.enter_context(Sender(port, 0, start_s))
        addresses = (f"udp://127.0.0.1:{port}", f"tcp://127.0.0.1:{server.port}")
        cameras = stack.enter_context(closing(LiveCameras(LiveSettings(addresses, (1, 2)))))
        shown = []
        for item in islice(cameras.frame_sets(), 80):
            shown.append([number_of(picture) for picture in item.pictures.values()])
    assert together(shown)
    assert server.connections >= 2
    assert any("broke off" in str(warning.message) for warning in caught)


@pytest.mark.parametrize(("others", "cameras"), [((), 2), (None, 3), ([(0, 1)], 3)])
def test_of_other_cameras_only_those_that_are_asked_for_are_read(others: Any, cameras: int) -> None:
    """The one that is not read never sends, so that waiting for it would fail."""
    middle = {"away": range(10**6 if cameras == 2 else 0)}
    numbers, _, _ = taken(1, {}, middle, {}, others=others)
    assert len(numbers[0]) == cameras
    assert together(numbers)


def test_live_cameras_are_coded_with_a_layer(tmp_path: Path) -> None:
    ports, out = [free_port() for _ in range(3)], tmp_path / "out.mcap"
    addresses = [f"udp://127.0.0.1:{port}" for port in ports]
    options = ["--grid", "1x3", "--disparity-range", "0,8", "--frames", "0:2", "--enhance", "24", "--quiet"]
    start_s = time.monotonic()
    with ExitStack() as stack:
        for col, port in enumerate(ports):
            stack.enter_context(Sender(port, col, start_s))
        succeeds("encode", *addresses, out, *options, "--patience", "60")
    assert validate(out) == []
    with Decoder.open(out, enhanced=None) as decoder:
        for decoded in decoder:
            shown = decoded.enhanced[0, 1].pixels
            number = number_of(shown)
            assert np.abs(shown.astype(int) - numbered(number, 1)).mean() < 12
            assert number_of(decoded.pictures[0, 0]) == number


def test_a_silent_camera_is_named_after_a_while() -> None:
    with pytest.raises(InputError, match=r"udp://127.0.0.1:\d+: found no whole picture for 1.5 s"):
        taken(1, {}, {"away": range(10**6)}, patience_s=1.5)


@in_real_time
def test_the_command_ends_with_ctrl_c_and_its_file_is_whole(tmp_path: Path) -> None:
    ports, out = [free_port(), free_port()], tmp_path / "out.mcap"
    addresses = [f"udp://127.0.0.1:{port}" for port in ports]
    options = ["--grid", "1x2", "--disparity-range", "0,8", "--chunk-ms", "0"]
    start_s = time.monotonic()
    with Sender(ports[0], 0, start_s), Sender(ports[1], 1, start_s, delay_s=0.1):
        with subprocess.Popen(
            [*COMMAND, "encode", *addresses, str(out), *options], stderr=subprocess.PIPE
        ) as run:
            wait_for(lambda: run.poll() is not None or size_of(tmp_path) > 8_000)
            run.send_signal(signal.SIGINT)
            assert run.stderr is not None
            told = run.stderr.read().decode()
        assert run.returncode == 0, told
    assert "Traceback" not in told
    assert read_info(out).frames > 5


def size_of(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def wait_for(happened: Callable[[], bool], at_most_s: float = 90.0) -> None:
    """Wait for something, looking again and again."""
    end_s = time.monotonic() + at_most_s
    while not happened():
        assert time.monotonic() < end_s, "it never happened"
        time.sleep(0.05)


def test_the_command_waits_for_what_reads_before_it_ends(tmp_path: Path) -> None:
    """A thread inside FFmpeg asks Python whether to go on; it crashed where Python had ended."""
    addresses = [f"udp://127.0.0.1:{free_port()}" for _ in range(4)]
    for _ in range(2):
        line = fails(
            1,
            "encode",
            *addresses,
            tmp_path / "out.mcap",
            "--grid",
            "2x2",
            "--real",
            "all",
            "--patience",
            "0.1",
        )
        assert "found no whole picture for 0.1 s" in line


def test_what_ffmpeg_lacks_is_said_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "mvcodec.capture.live_camera.how_to_open", lambda _address: Opened("nonsense://127.0.0.1:1")
    )
    with pytest.raises(
        InputError, match=r"udp://a: found an address that this FFmpeg cannot open \(Protocol"
    ):
        LiveCameras(LiveSettings(("udp://a",), (1, 1), patience_s=600))


def test_addresses_are_told_from_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for address in ("udp://@:5000", "rtsp://cam/1", "srt://h:1?mode=caller", "tcp://h:1", "v4l2:/dev/video0"):
        assert is_live_address(address)
    assert is_live_address("avfoundation:0")
    for name in ("cam:1.mp4", "http://x/y.mcap", "udp:x", "a/v4l2", "room"):
        assert not is_live_address(name)
    Path("v4l2:x").touch()
    assert not is_live_address("v4l2:x"), "a file of that name comes first"
    assert (how_to_open("v4l2:/dev/video0").file, how_to_open("v4l2:/dev/video0").form) == (
        "/dev/video0",
        "v4l2",
    )
    assert how_to_open("RTSP://cam/1").options["rtsp_transport"] == "tcp"


def test_the_least_delay_counts_and_is_forgotten_after_a_while() -> None:
    clock = ArrivalClock()
    assert clock.shift_ns is None
    for number, late in enumerate([30, 10, 50]):
        clock.push(number * 1000, number * 1000 + 700 + late)
    assert clock.shift_ns == 710
    for number in range(3, 2100):
        clock.push(number * 1000, number * 1000 + 900)
    assert clock.shift_ns == 900
    assert common_clock([0, 10**9])
    assert not common_clock([0, 3 * 10**9])


class Noting(ArrivalClock):
    """A clock that notes how much later than their stamps pictures arrive."""

    def __init__(self, held_back: int) -> None:
        super().__init__(held_back)
        self.delays_ns: list[int] = []

    def push(self, stamp_ns: int, arrival_ns: int) -> None:
        self.delays_ns.append(arrival_ns - stamp_ns)
        super().push(stamp_ns, arrival_ns)


class Pieces(io.RawIOBase):
    """A connection that brings one picture after another, and ends."""

    def __init__(self, count: int) -> None:
        self._pieces = (data for _, data in islice(transport_stream(0), count))
        self._rest = b""
        self.come = 0

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1) -> bytes:
        if not self._rest:
            self._rest = next(self._pieces, b"")
            self.come += bool(self._rest)
        piece, self._rest = self._rest[:size], self._rest[size:]
        return piece


def test_what_ffmpeg_lets_go_of_when_a_connection_ends_tells_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its last pictures come a frame and two sooner than all before them."""
    pieces = Pieces(40)
    step_ns = 10**9 // FPS
    monkeypatch.setattr("mvcodec.capture.live_camera.time.time_ns", lambda: (pieces.come - 1) * step_ns)
    camera = LiveCamera("a", threading.Condition())
    clock = camera.clock = Noting(HELD_BACK)
    options = {"analyzeduration": "0", "probesize": "4096"}
    with av.open(pieces, "r", format="mpegts", options=options, buffer_size=1880) as container:
        assert list(camera._pictures(container, container.streams.video[0]))
    usual, *last = clock.delays_ns[-4:]
    assert [round((delay - usual) / step_ns) for delay in last] == [0, -1, -2]
    assert clock.shift_ns == min(clock.delays_ns[:-2])


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"grid": (2, 2)}, "grid: found 2x2, expected a grid of 2 cameras"),
        ({"addresses": ("udp://a", "udp://a")}, "INPUT: found an address twice"),
        ({"patience_s": 0}, "patience_s: found 0"),
        ({"offsets_ms": {"udp://z": 1.0}}, "offsets_ms: found udp://z"),
    ],
)
def test_settings_that_do_not_fit(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(SettingError, match=told):
        LiveSettings(**{"addresses": ("udp://a", "udp://b"), "grid": (1, 2), **changes})


def test_options_that_do_not_fit_live_cameras(tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    address = "udp://127.0.0.1:9"
    assert "--topics" in fails(2, "encode", address, out, "--topics", "/a")
    assert "--grid" in fails(2, "encode", address, "udp://127.0.0.1:10", out)
    assert "live cameras and files" in fails(2, "encode", address, "x.mp4", out, "--grid", "1x2")
    line = fails(1, "encode", address, out, "--patience", "0.5")
    assert "found no whole picture for 0.5 s" in line
    assert not out.exists()
