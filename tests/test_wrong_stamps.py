"""Stamps of recordings that are far off, stand still, or come from a clock that was set."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from typing import cast

import pytest
from coding import Pipe
from odd_recordings import START_NS, TOPICS, Timed, at, raw, raws, videos, written
from timed_videos import number_of

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.errors import MvCodecWarning

YEARS_NS = 10 * 365 * 86_400 * 10**9


def read(messages: list[Timed], pipe: bool = False) -> tuple[list[int], list[int], str]:
    """Numbers (equal in both cameras) and times of the frame sets, and what was told."""
    data = written(messages)
    file = Pipe(data) if pipe else io.BytesIO(data)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        recording = Recording(cast("io.BytesIO", file), "rec", RecordingSettings((TOPICS,)))
        sets = list(recording.frame_sets())
    shown = [[number_of(picture) for picture in item.pictures.values()] for item in sets]
    assert all(first == second for first, second in shown), shown
    told = "\n".join(str(warning.message) for warning in caught)
    return [first for first, _ in shown], [item.time_ns for item in sets], told


def stamped(messages: list[Timed], change: Callable[[str, int], int]) -> list[Timed]:
    """With `change(topic, log time)` added to each stamp."""
    return [(topic, message, log, stamp + change(topic, log)) for topic, message, log, stamp in messages]


@pytest.mark.parametrize("off_ns", [YEARS_NS, 5 * 10**9, -3 * 10**9, -YEARS_NS])
@pytest.mark.parametrize("make", [raws, videos])
@pytest.mark.parametrize("pipe", [False, True])
def test_one_wrong_stamp_costs_its_frame_set_alone(
    off_ns: int, make: Callable[..., list[Timed]], pipe: bool
) -> None:
    taken = make(range(16)) if make is raws else make(16)
    numbers, times, told = read(
        stamped(taken, lambda topic, log: off_ns * (topic == TOPICS[1] and log == at(6))), pipe
    )
    assert numbers == [number for number in range(16) if number != 6]
    assert times == [at(number) for number in numbers]
    assert "/cam1" in told
    assert "its time is far from those before and after it" in told


def test_a_wrong_stamp_of_all_cameras_is_left_out() -> None:
    numbers, _, told = read(stamped(raws(range(16)), lambda _, log: 5 * 10**9 * (log == at(6))))
    assert numbers == [number for number in range(16) if number != 6]
    assert told.count("its time is far from") == 2


def test_a_wrong_first_stamp_costs_itself() -> None:
    numbers, _, _ = read(
        stamped(raws(range(8)), lambda topic, log: YEARS_NS * (topic == TOPICS[1] and log == at(0)))
    )
    assert numbers == list(range(1, 8))


@pytest.mark.parametrize("topics", [TOPICS, TOPICS[1:]])
@pytest.mark.parametrize("make", [raws, videos])
def test_a_clock_that_jumps_ahead_is_told_and_survived(
    topics: tuple[str, ...], make: Callable[..., list[Timed]]
) -> None:
    taken = make(range(16)) if make is raws else make(16)
    numbers, times, told = read(
        stamped(taken, lambda topic, log: 3600 * 10**9 * (topic in topics and log >= at(8)))
    )
    assert numbers == list(range(16))
    assert times == [pytest.approx(at(number), abs=10**6) for number in range(16)]
    assert f"the clock of {topics[0]} jumped ahead by 3600.000 s" in told


def test_log_times_that_mean_nothing_change_nothing() -> None:
    """Converted recordings may have been written down all at once."""
    taken = [(TOPICS[c], raw(n, c), START_NS, at(n * 300)) for n in range(8) for c in (0, 1)]
    numbers, times, _ = read(taken)
    assert numbers == list(range(8))
    assert times == [at(n * 300) for n in range(8)]


@pytest.mark.parametrize("pipe", [False, True])
@pytest.mark.parametrize(("fps", "rate"), [(None, 20.0), (25.0, 25.0)])
def test_recordings_that_were_written_at_once_have_the_rate_of_their_stamps(
    fps: float | None, rate: float, pipe: bool
) -> None:
    taken = [(TOPICS[c], raw(n, c), START_NS, START_NS + n * 50_000_000) for n in range(4) for c in (0, 1)]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        file = Pipe(written(taken)) if pipe else io.BytesIO(written(taken))
        settings = RecordingSettings((TOPICS,), fps=fps)
        recording = Recording(cast("io.BytesIO", file), "rec", settings)
    assert recording.array.fps == rate
    told = "\n".join(str(warning.message) for warning in caught)
    assert ("written down at one time: 20 fps, by the first stamps" in told) == (fps is None)
    assert [item.time_ns for item in recording.frame_sets()] == [START_NS + n * 50_000_000 for n in range(4)]


def test_recordings_without_any_times_say_what_is_guessed() -> None:
    taken = [(TOPICS[c], raw(n, c), START_NS, 0) for n in range(3) for c in (0, 1)]
    with pytest.warns(MvCodecWarning, match="at one time: 1 fps is taken"):
        Recording(io.BytesIO(written(taken)), "rec", RecordingSettings((TOPICS,)))


def test_stamps_that_stand_still_are_told() -> None:
    messages = [(t, m, log, START_NS) for t, m, log, _ in raws(range(12))]
    numbers, _, told = read(messages)
    assert numbers == [0]
    assert "stamps that stand still; `clock` log" in told
