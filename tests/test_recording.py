"""Recordings of several video or image topics -> frame sets."""

from __future__ import annotations

import io
import warnings
from typing import BinaryIO, cast

import numpy as np
import pytest
from coding import Pipe, frame_set, luma_psnr
from recordings import ARRAY, FORMS, START_NS, TOPICS, recording, shots

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.errors import InputError, MvCodecWarning, SettingError, StreamError
from mvcodec.frames import FrameSet

GRID = (("/cam00", "/cam01"), ("/cam10", "/cam11"))


def _read(content: bytes, *, pipe: bool = False, **changes: object) -> tuple[list[FrameSet], list[str]]:
    settings = RecordingSettings(**{"topics": GRID, **changes})  # type: ignore[arg-type]
    source = cast("BinaryIO", Pipe(content, 1 << 16)) if pipe else io.BytesIO(content)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = list(Recording(source, "rec.mcap", settings).frame_sets())
    return found, [str(warning.message) for warning in caught]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("pipe", [False, True])
def test_every_form_of_picture_comes_in_as_it_was_taken(form: str, pipe: bool) -> None:
    found, told = _read(recording(form, shots(5, jitter_ns=2_000_000)), pipe=pipe)
    told_alpha = [f"rec.mcap: {TOPICS[c]}: how opaque its pixels are is left out" for c in ARRAY.real]
    assert sorted(told) == (told_alpha if form == "rgba8" else [])
    assert [(f.index, f.time_ns) for f in found] == [(i, START_NS + i * 100_000_000) for i in range(5)]
    for frames in found:
        for camera, original in frame_set(ARRAY, frames.index).pictures.items():
            picture = frames.pictures[camera]
            if form in ("png", "rgb8", "bgr8", "rgba8"):
                np.testing.assert_array_equal(picture, original)
            elif form == "mono8":
                np.testing.assert_array_equal(picture, np.repeat(original[..., 1:2], 3, axis=2))
            else:
                assert luma_psnr(picture, original) > 38


@pytest.mark.parametrize("pipe", [False, True])
def test_the_frame_rate_is_that_of_the_times(pipe: bool) -> None:
    content = recording("rgb8", shots(6))
    source = cast("BinaryIO", Pipe(content)) if pipe else io.BytesIO(content)
    recorded = Recording(source, "rec", RecordingSettings(GRID))
    assert recorded.array.fps == pytest.approx(10.0)
    assert (recorded.array.width, recorded.array.height) == (96, 64)
    assert not recorded.array.calibration.given
    given = Recording(io.BytesIO(content), "rec", RecordingSettings(GRID, fps=25.0))
    assert given.array.fps == 25.0


def test_only_the_real_cameras_are_read() -> None:
    taken = [shot for shot in shots(3) if shot[1] != (0, 1)]
    settings = RecordingSettings((("/cam00", "/never", "/cam10"),))
    found = list(Recording(io.BytesIO(recording("rgb8", taken)), "rec", settings).frame_sets())
    assert [set(frames.pictures) for frames in found] == [{(0, 0), (0, 2)}] * 3


@pytest.mark.parametrize("form", ["rgb8", "video"])
def test_a_camera_missing_for_some_frames_costs_those_frames_and_is_told(form: str) -> None:
    taken = [shot for shot in shots(10) if not (shot[1] == (1, 0) and shot[0] in (3, 4))]
    found, told = _read(recording(form, taken))
    times = [round((frames.time_ns - START_NS) / 1e8) for frames in found]
    assert times == [0, 1, 2, 5, 6, 7, 8, 9]
    assert [frames.index for frames in found] == list(range(8))
    assert f"/cam00 at {(START_NS + 3e8) / 1e9:.3f} s: dropped, another camera has none" in told[0]
    assert told[-1] == "rec.mcap: 6 pictures were dropped in all"
    for frames in found:
        if form == "video":  # what was dropped was decoded all the same, since later pictures build on it
            number = round((frames.time_ns - START_NS) / 1e8)
            assert luma_psnr(frames.pictures[0, 0], frame_set(ARRAY, number).pictures[0, 0]) > 38


def test_a_camera_that_starts_late_begins_the_recording() -> None:
    taken = [shot for shot in shots(6) if not (shot[1] == (1, 1) and shot[0] < 2)]
    found, told = _read(recording("rgb8", taken))
    assert len(found) == 4
    assert len(told) == 6, "five one by one, and their sum"


def test_tolerance_says_what_belongs_together() -> None:
    content = recording("rgb8", shots(4, jitter_ns=12_000_000))
    found, _ = _read(content, tolerance_ms=40)
    assert len(found) == 4
    with (
        pytest.warns(MvCodecWarning, match="dropped"),
        pytest.raises(InputError, match="no frame set of all"),
    ):
        Recording(io.BytesIO(content), "rec", RecordingSettings(GRID, tolerance_ms=10))


def test_times_that_repeat_or_go_back_are_dropped_and_told() -> None:
    taken = list(shots(4))
    back = [*taken[:12], (2, (1, 1), START_NS + 100_000_000), *taken[12:]]
    found, told = _read(recording("rgb8", back))
    assert len(found) == 4
    assert "/cam11" in told[0]
    assert "its time is not after the one before" in told[0]


def test_a_cut_recording_gives_what_is_there() -> None:
    content = recording("rgb8", shots(20))
    found, told = _read(content[: len(content) // 2])
    assert 2 <= len(found) < 20
    assert any("cut off after" in text for text in told)


def test_bad_recordings_and_settings_are_named() -> None:
    content = recording("rgb8", shots(3))
    with pytest.raises(StreamError, match=r"no topic /other, expected a topic with pictures: /cam00, /cam01"):
        _read(content, topics=(("/cam00", "/other"),))
    with pytest.raises(SettingError, match="a topic twice"):
        RecordingSettings((("/a", "/a"),))
    with pytest.raises(SettingError, match="rows of one length"):
        RecordingSettings((("/a", "/b"), ("/c",)))
    with pytest.raises(SettingError, match=r"^fps: found 0"):
        RecordingSettings(GRID, fps=0)
    with pytest.raises(StreamError, match="a file that is not MCAP"):
        _read(b"something else entirely")
    assert set(TOPICS.values()) == {"/cam00", "/cam01", "/cam10", "/cam11"}
