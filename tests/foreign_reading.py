"""What comes of recordings that were made byte by byte."""

from __future__ import annotations

import io
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from odd_recordings import TOPICS, at
from timed_videos import numbered

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.frames import FrameSet

IMAGE = ("sensor_msgs/msg/Image", "cdr")
COMPRESSED = ("sensor_msgs/msg/CompressedImage", "cdr")


class Read:
    """What comes of a recording."""

    def __init__(self, content: bytes, **settings: Any) -> None:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            asked = RecordingSettings((TOPICS,), **settings)
            self.recording = Recording(io.BytesIO(content), "rec", asked)
            self.sets: list[FrameSet] = list(self.recording.frame_sets())
        self.told = "\n".join(str(warning.message) for warning in caught)

    def check(self, count: int = 4, worst: float = 0.0) -> None:
        """The pictures are those that were taken, at their times."""
        assert [item.time_ns for item in self.sets] == [at(n) for n in range(count)]
        for number, item in enumerate(self.sets):
            for (_, camera), picture in item.pictures.items():
                away = np.abs(picture.astype(int) - colourful(number, camera)).mean()
                assert away <= worst, (number, camera, away)


def colourful(number: int, camera: int) -> NDArray[np.uint8]:
    """A numbered picture whose channels differ."""
    picture = numbered(number, camera).copy()
    picture[8:, :, 1] //= 2
    picture[8:, :, 2] //= 4
    return picture


def padded(pixels: NDArray[Any], padding: int) -> tuple[bytes, tuple[int, int, int]]:
    """Bytes of pixels whose rows have padding, and (width, height, step)."""
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(height, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=99)
    return rows.tobytes(), (width, height, rows.shape[1])
