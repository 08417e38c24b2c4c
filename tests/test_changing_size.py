"""Pictures whose size changes on the way: an error, or left out where that is wanted."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from odd_recordings import TOPICS, raws, written
from timed_videos import numbered, write_frames, write_video

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.capture.video_input import VideoView
from mvcodec.errors import InputError


def test_in_a_recording_they_cost_their_frame_sets() -> None:
    messages = raws(range(6))
    wide = np.repeat(numbered(3), 2, axis=1)
    height, width = wide.shape[:2]
    other = RawImage(width=width, height=height, encoding="rgb8", step=3 * width, data=wide.tobytes())
    topic, _, log_ns, stamp_ns = messages[6]
    messages[6] = topic, other, log_ns, stamp_ns
    settings, told = RecordingSettings((TOPICS,)), list[InputError]()
    recording = Recording(io.BytesIO(written(messages)), "rec", settings, on_damage=told.append)
    assert [item.index for item in recording.frame_sets()] == [0, 1, 2, 3, 4]
    (error,) = told
    assert "/cam0 at 1700000000.100 s: found a picture of 128x48 px, expected 64x48 px" in str(error)
    recording = Recording(io.BytesIO(written(messages)), "rec", settings)
    with pytest.raises(InputError, match="a picture of 128x48 px"):
        list(recording.frame_sets())


def test_in_a_video_file_they_are_left_out(tmp_path: Path) -> None:
    small = write_video(tmp_path / "small.ts", range(12), g="4")
    large = write_frames(tmp_path / "large.ts", [np.tile(numbered(n), (2, 2, 1)) for n in range(12)], g="4")
    path = tmp_path / "both.ts"
    path.write_bytes(small.read_bytes() + large.read_bytes())
    view, told = VideoView(path), list[InputError]()
    with pytest.raises(InputError, match="found 128x96 px, expected 64x48 px"):
        list(view.pictures(range(view.count)))
    found = list(view.readable(range(view.count), told.append))
    whole = len(found) - len(told)
    assert [picture is not None for picture in found] == [number < whole for number in range(len(found))]
    assert 8 <= whole <= 12
