"""Coded views -> an MCAP file of plain video topics, for everyone's viewers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.closing import Closing
from mvcodec.container import schemas
from mvcodec.container.chunk_writing import CHUNK_MS, ChunkedFile
from mvcodec.video.codecs import foxglove_name


class VideoTopicsWriter(Closing):
    """Writes videos of viewpoints: `/view/NAME/video`, with calibration and place of each.

    Args:
        target: path, or an open binary file, which may be a pipe and stays open.
        array: the geometry.
        views: name -> viewpoint, in the order in which their access units are pushed.
        codec: as `StreamHeader.codec`.
        chunk_ms: as `McapWriter`'s.

    Raises (from `push` and `close`):
        OutputError: the system refuses to open or write.
    """

    def __init__(
        self,
        target: BinaryIO | Path,
        array: CameraArray,
        views: dict[str, Viewpoint],
        codec: str,
        chunk_ms: int = CHUNK_MS.default,
    ) -> None:
        self._file = ChunkedFile(target, chunk_ms)
        self._format = foxglove_name(codec)
        self._topics = [(f"/view/{name}/video", _frame(name)) for name in views]
        self._rig = [
            message
            for name, place in views.items()
            for message in schemas.place_messages(array, place, f"/view/{name}/calibration", _frame(name))
        ]
        self._closed = False

    def push(self, index: int, time_ns: int, keyframe: bool, units: Sequence[bytes]) -> None:
        """Write one access unit of each view, all of one time."""
        file = self._file
        if not file.is_open:
            self._start()
        file.begin_set(time_ns, keyframe)
        if keyframe:
            for message in self._rig:
                file.add(message.topic, index, time_ns, message.at(time_ns))
        for (topic, frame), data in zip(self._topics, units, strict=True):
            file.add(topic, index, time_ns, schemas.compressed_video(frame, time_ns, data, self._format))
        file.end_set()

    def close(self) -> None:
        """Complete the file. No file appears where nothing was pushed."""
        if not self._closed:
            self._closed = True
            self._file.close()

    def _start(self) -> None:
        self._file.open()
        videos = dict.fromkeys((topic for topic, _ in self._topics), "video")
        for channel in schemas.channels(self._rig, videos):
            self._file.add_channel(*channel)


def _frame(name: str) -> str:
    return f"view_{name}"
