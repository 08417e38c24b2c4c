"""Live cameras over RTP and RTSP on this machine, with several views in a picture, and clocks that drift."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Sequence
from contextlib import ExitStack, closing
from itertools import islice

import numpy as np
import pytest
from live_senders import Sender, free_port
from rtsp_camera import RtspCamera, send_rtp
from timed_videos import SIZE, number_of, numbered

from mvcodec.capture.live_cameras import LiveCameras, LiveSettings
from mvcodec.capture.live_clock import ArrivalClock, SharedShifts
from mvcodec.errors import SettingError
from mvcodec.frames import FrameSet


def taken(addresses: Sequence[str], count: int) -> list[FrameSet]:
    """Frame sets of two cameras; checks that their pictures are whole and were taken together."""
    settings = LiveSettings(tuple(addresses), (1, 2))
    with closing(LiveCameras(settings)) as cameras, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sets = list(islice(cameras.frame_sets(), count))
    for item in sets:
        number, *others = {number_of(picture) for picture in item.pictures.values()}
        assert not others, "of one time"
        for (_, col), picture in item.pictures.items():
            away = np.abs(picture.astype(int) - numbered(number, col)).mean()
            assert away < 6, "a whole picture"
    return sets


@pytest.mark.slow
def test_transport_streams_over_rtp() -> None:
    stop, start_s = threading.Event(), time.monotonic()
    ports = [free_port() & ~1 for _ in range(2)]
    arguments = [(port, col, start_s, stop, "rtp_mpegts") for col, port in enumerate(ports)]
    senders = [threading.Thread(target=send_rtp, args=each, daemon=True) for each in arguments]
    for sender in senders:
        sender.start()
    try:
        assert len(taken([f"rtp://127.0.0.1:{port}" for port in ports], 15)) == 15
    finally:
        stop.set()
        for sender in senders:
            sender.join()


@pytest.mark.slow
def test_cameras_that_speak_rtsp() -> None:
    start_s = time.monotonic()
    with RtspCamera(0, start_s) as left, RtspCamera(1, start_s) as right:
        sets = taken([left.address, right.address], 20)
    times = [item.time_ns for item in sets]
    assert np.diff(times) == pytest.approx(1e9 / 30, rel=0.01)


@pytest.mark.slow
def test_lost_packets_of_rtsp_cost_what_builds_on_them() -> None:
    start_s = time.monotonic()
    with (
        RtspCamera(0, start_s) as left,
        RtspCamera(1, start_s, lost=lambda number: number % 13 == 5) as right,
    ):
        sets = taken([left.address, right.address], 30)
    assert len({number_of(item.pictures[0, 0]) for item in sets}) >= 15, "keyframes heal what was lost"


@pytest.mark.slow
def test_a_live_camera_may_send_several_views_in_each_picture() -> None:
    port = free_port()
    with ExitStack() as stack:
        stack.enter_context(Sender(port, 0, time.monotonic()))
        settings = LiveSettings((f"udp://127.0.0.1:{port}",), (1, 2), split=(1, 2))
        cameras = stack.enter_context(closing(LiveCameras(settings)))
        assert (cameras.array.cols, cameras.array.width, cameras.array.height) == (2, SIZE[0] // 2, SIZE[1])
        for item in islice(cameras.frame_sets(), 5):
            both = np.hstack([item.pictures[0, 0], item.pictures[0, 1]])
            assert np.abs(both.astype(int) - numbered(number_of(both))).mean() < 6


def test_a_grid_that_the_views_do_not_fill_is_refused() -> None:
    with pytest.raises(SettingError, match=r"a grid of 2 cameras of 1x2 views each"):
        LiveSettings(("udp://a", "udp://b"), (1, 2), split=(1, 2))


STEP_NS = 33_333_333


def drifted(shifts: SharedShifts, speeds: Sequence[float], count: int) -> tuple[int, int]:
    """The largest error of pairing (ns) of pictures that are taken together, and the drift that is known.

    Args:
        speeds: of the senders' clocks, and each begins elsewhere; pictures come late by up to 20 ms.
    """
    random = np.random.default_rng(1)
    clocks = [ArrivalClock() for _ in speeds]
    begins = [7_000_000_000 * number for number in range(len(speeds))]
    worst = 0
    for number in range(count):
        taken_ns = number * STEP_NS
        stamps = [begin + round(taken_ns * speed) for begin, speed in zip(begins, speeds, strict=True)]
        for clock, stamp in zip(clocks, stamps, strict=True):
            clock.push(stamp, taken_ns + int(random.integers(0, 20_000_000)))
        found = [clock.shift_ns or 0 for clock in clocks]
        if number == 30:
            shifts.begin(found)
        if number > 30:
            shifts.follow(found)
            times = [stamp + shifts.of(sender) for sender, stamp in enumerate(stamps)]
            worst = max(worst, max(times) - min(times))
    return worst, shifts.drift_ns()


def test_clocks_that_run_at_different_speeds_are_followed() -> None:
    worst, drift = drifted(SharedShifts(None), [1.0, 1 + 2e-4], 9000)
    assert worst < STEP_NS / 2, "300 s, in which the clocks went 60 ms apart"
    assert 40e6 < drift < 70e6


def test_stamps_that_count_are_not_shifted_but_their_drift_is_known() -> None:
    shifts = SharedShifts("stamp")
    _, drift = drifted(shifts, [1.0, 1 + 2e-4], 9000)
    assert shifts.of(0) == shifts.of(1)
    assert drift > STEP_NS, "which is told"
