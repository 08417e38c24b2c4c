"""Rendered views as H.264 topics of an MCAP file, which may be a pipe."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from mvcodec.closing import Closing
from mvcodec.container.video_topics import VideoTopicsWriter
from mvcodec.frames import Picture
from mvcodec.output.forms import OutputPlan
from mvcodec.stream import TrackKind
from mvcodec.video.codec import CodedPicture, RateControl, VideoEncoder, VideoSettings
from mvcodec.video.codecs import find_codec
from mvcodec.video.colour import even_size, to_planes
from mvcodec.workers import run_all

CODEC = "h264"
CRF = 18.0
PRESET = "veryfast"
"""As good as the eye asks for, and fast enough to keep up with the decoder."""

_KEYFRAME_NS = 1_000_000_000


class McapViews(Closing):
    """Codes and writes the pictures of a plan's viewpoints, frame by frame, each at once.

    Args:
        target: path, or an open binary file, which may be a pipe and stays open.
        plan: which views will come.
        chunk_ms: as `VideoTopicsWriter`'s.
    """

    def __init__(self, target: Path | BinaryIO, plan: OutputPlan, chunk_ms: int) -> None:
        array = plan.array
        views = dict(zip(plan.names, plan.viewpoints, strict=True))
        self._writer = VideoTopicsWriter(target, array, views, CODEC, chunk_ms)
        width, height = even_size(array.width, array.height)
        self._gop = max(int(array.fps + 1e-6), 1)
        settings = VideoSettings(
            TrackKind.TEXTURE, width, height, array.fps, self._gop, RateControl(crf=CRF), PRESET
        )
        self._encoders = [find_codec(CODEC).encoder(settings) for _ in views]
        self._since, self._key_ns = 0, 0

    def push(self, pictures: Sequence[Picture], index: int, time_ns: int) -> None:
        """Write uint8 (H, W, 3) RGB of each viewpoint, taken at a time.

        Raises:
            OutputError: the system refuses.
        """
        keyframe = self._since % self._gop == 0 or time_ns - self._key_ns >= _KEYFRAME_NS
        if keyframe:
            self._since, self._key_ns = 0, time_ns
        self._since += 1

        def code(encoder: VideoEncoder, picture: Picture) -> CodedPicture:
            (coded,) = encoder.push(to_planes(picture), keyframe)
            return coded

        units = [coded.data for coded in run_all(code, self._encoders, pictures)]
        self._writer.push(index, time_ns, keyframe, units)

    def close(self) -> None:
        """Complete the file."""
        self._writer.close()
