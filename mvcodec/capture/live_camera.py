"""One live camera: read in a thread of its own, opened again when it breaks off."""

from __future__ import annotations

import atexit
import threading
import time
import warnings
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast

import av
from av.codec import Codec
from av.container import InputContainer
from av.error import DemuxerNotFoundError, FFmpegError, ProtocolNotFoundError
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from mvcodec.capture.live_address import how_to_open
from mvcodec.capture.live_clock import HELD_BACK, ArrivalClock
from mvcodec.capture.video_messages import LeftOut, VideoDecoder
from mvcodec.container.recorded_pictures import RecordedPicture
from mvcodec.errors import InputError, MvCodecWarning

MAX_WAITING = 96
"""Pictures of a camera that wait for those of the others; older ones are left out."""

_OPEN_S, _READ_S, _RETRY_S = 10.0, 4.0, 0.25
"""The longest that FFmpeg may wait for a camera's first pictures, and for the next; pause between tries."""

_CHECKED = ("h264", "hevc", "vp9", "av1")
"""Codecs whose missing references are noticed. Others must code each picture alone."""

CORRUPT = "a packet of it was lost on the way"


@dataclass(frozen=True, slots=True, eq=False)
class LivePicture:
    """A picture as it came.

    Attributes:
        stamp_ns: when it was taken by the sender's clock, which may begin anywhere.
        connection: counts how often the camera was opened.
    """

    stamp_ns: int
    connection: int
    frame: VideoFrame


class LiveCamera:
    """Takes pictures from an address until it is stopped.

    Args:
        address: what FFmpeg opens.
        changed: notified of each picture.
        patience_s: no single call waits for longer than that.

    Attributes:
        address: of the camera.
        waiting: its pictures, oldest first; used under `changed`.
        clock: when its stamps arrive.
        connection: counts how often it was opened.
        left_out: pictures that were not whole, or waited for too long.
        problem: why it cannot be read now; empty where it can.
        hopeless: FFmpeg has not got what its address needs: no further try will help.
    """

    def __init__(self, address: str, changed: threading.Condition, patience_s: float = _OPEN_S) -> None:
        self.address = address
        self.waiting: deque[LivePicture] = deque()
        self.clock = ArrivalClock(HELD_BACK)
        self.connection = self.left_out = 0
        self.problem = ""
        self.hopeless = False
        self._changed, self._stop = changed, threading.Event()
        self._timeout_s = min(_OPEN_S, patience_s), min(_READ_S, patience_s)
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Begin to read."""
        # FFmpeg asks Python whether to go on waiting: a thread inside it must end before Python does.
        atexit.register(self._finish)
        self._thread.start()

    def stop(self) -> None:
        """End after the picture at hand; what waits inside FFmpeg ends by itself, soon."""
        self._stop.set()

    def _finish(self) -> None:
        self.stop()
        self._thread.join()

    def _run(self) -> None:
        try:
            self._read_on()
        finally:
            atexit.unregister(self._finish)

    def _read_on(self) -> None:
        while not self._stop.is_set():
            try:
                self._read()
                self.problem = "it ended"
            except (ProtocolNotFoundError, DemuxerNotFoundError, ValueError) as error:
                self.problem = getattr(error, "strerror", None) or str(error)
                self.hopeless = True
                return
            except (FFmpegError, OSError) as error:
                self.problem = getattr(error, "strerror", None) or str(error)
            except InputError as error:
                self.problem = f"found {error.found}, expected {error.expected}"
            if self.connection and not self._stop.is_set():
                text = f"{self.address}: broke off ({self.problem}); it is opened again"
                warnings.warn(text, MvCodecWarning, stacklevel=2)
            self._stop.wait(_RETRY_S)

    def _read(self) -> None:
        how = how_to_open(self.address)
        with av.open(how.file, format=how.form, options=how.options, timeout=self._timeout_s) as container:
            stream = next(iter(container.streams.video), None)
            if stream is None:
                raise InputError(self.address, "no video", "a camera")
            with self._changed:
                self.connection += 1
                self.clock = ArrivalClock(HELD_BACK)
            self.problem = ""
            for stamp_ns, frame in self._pictures(container, stream):
                self._add(LivePicture(stamp_ns, self.connection, frame))

    def _add(self, picture: LivePicture) -> None:
        with self._changed:
            self.waiting.append(picture)
            if len(self.waiting) > MAX_WAITING:
                self.waiting.popleft()
                self.left_out += 1
            self._changed.notify_all()

    def _pictures(self, container: InputContainer, stream: VideoStream) -> Iterator[tuple[int, VideoFrame]]:
        codec = stream.codec_context.name
        name = next(
            (known for known in _CHECKED if known in codec or (known, codec) == ("av1", "libdav1d")), ""
        )
        if not name and not Codec(codec, "r").intra_only:
            raise InputError(
                self.address, f"video of codec {codec}, which is not supported", ", ".join(_CHECKED)
            )
        decoder = VideoDecoder(self.address)
        held: RecordedPicture | None = None
        head = stream.codec_context.extradata or b""
        if name and head.startswith(b"\0\0"):  # parameter sets that came beside the stream
            list(self._whole(decoder, self._message(head, 0, name)))
        for packet in container.demux(stream):
            if self._stop.is_set():
                return
            if packet.pts is None or not packet.size:
                continue
            stamp_ns = round(packet.pts * cast("float", packet.time_base) * 1_000_000_000)
            self.clock.push(stamp_ns, time.time_ns())
            if not name:
                for frame in packet.decode():
                    yield stamp_ns, frame
            elif packet.is_corrupt:
                # FFmpeg may find the loss in a picture when it has begun with the next one.
                self.left_out += 1 + (held is not None)
                held = None
                decoder.lose(CORRUPT)
            else:
                if held is not None:
                    yield from self._whole(decoder, held)
                held = self._message(bytes(packet), stamp_ns, name)

    def _whole(self, decoder: VideoDecoder, message: RecordedPicture) -> Iterator[tuple[int, VideoFrame]]:
        try:
            for shown, frame in decoder.push(message):
                yield shown.time_ns, frame
        except (LeftOut, InputError):
            self.left_out += 1

    def _message(self, data: bytes, stamp_ns: int, codec: str) -> RecordedPicture:
        return RecordedPicture(
            self.address, stamp_ns, stamp_ns, stamp_ns, "video", data, codec, "", None, False
        )
