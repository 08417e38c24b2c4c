"""Cameras that send MPEG-TS over UDP to this machine, with delays and losses."""

from __future__ import annotations

import io
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from fractions import Fraction
from itertools import islice

import av
from timed_videos import SIZE, numbered

FPS = 30
NUMBERS = 64
"""Pictures of different numbers; then they begin again."""

_TS_PACKET = 188
_DATAGRAM = 7 * _TS_PACKET


def free_port() -> int:
    """A port that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def transport_stream(col: int, first_s: float = 0.0) -> Iterator[tuple[int, bytes]]:
    """(number, its bytes) of one picture after another, without end.

    Args:
        first_s: the stamp of the first one.
    """
    target = io.BytesIO()
    options = {"flush_packets": "1", "muxdelay": "0", "muxpreload": "0"}
    with av.open(target, "w", format="mpegts", container_options=options) as out:
        stream = out.add_stream("libx264", rate=FPS)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        stream.options = {"crf": "16", "preset": "ultrafast", "tune": "zerolatency", "g": "8"}
        stream.time_base = Fraction(1, FPS)
        count = 0
        while True:
            frame = av.VideoFrame.from_ndarray(numbered(count % NUMBERS, col), format="rgb24")
            frame.pts, frame.time_base = count + round(first_s * FPS), Fraction(1, FPS)
            out.mux(stream.encode(frame))
            data = target.getvalue()
            target.seek(0)
            target.truncate()
            yield count, data
            count += 1


class Sender:
    """Sends one camera's pictures at their times, until it is closed.

    Args:
        port: of this machine.
        col: which camera.
        delay_s: how much later each is sent than it is taken.
        first_s: the stamp of the first one.
        lost: whether a datagram (number of its picture, place in it) is lost on the way.
        away: pictures, by number, during which nothing is sent.
    """

    def __init__(
        self,
        port: int,
        col: int,
        start_s: float,
        delay_s: float = 0.0,
        first_s: float = 0.0,
        lost: Callable[[int, int], bool] = lambda _number, _place: False,
        away: range = range(0),
    ) -> None:
        self._port, self._start_s, self._lost, self._away = port, start_s + delay_s, lost, away
        self._pictures = transport_stream(col, first_s)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Sender:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for number, data in self._pictures:
                if self._stop.wait(max(0.0, self._start_s + number / FPS - time.monotonic())):
                    return
                if number in self._away:
                    continue
                for place, at in enumerate(range(0, len(data), _DATAGRAM)):
                    if not self._lost(number, place):
                        out.sendto(data[at : at + _DATAGRAM], ("127.0.0.1", self._port))


class Server:
    """A camera that others connect to by TCP; it hangs up after some pictures, and time goes on.

    Attributes:
        port: of this machine.
        connections: how many came so far.
    """

    def __init__(self, col: int, start_s: float, each: int) -> None:
        self._start_s, self._each, self.connections = start_s, each, 0
        self._pictures = transport_stream(col)
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._socket.settimeout(0.1)
        self.port = int(self._socket.getsockname()[1])
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Server:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self._socket.close()

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                peer, _ = self._socket.accept()
            except TimeoutError:
                continue
            self.connections += 1
            with peer, suppress(OSError):  # whoever listened is gone
                for number, data in islice(self._due(), self._each):
                    if self._stop.wait(max(0.0, self._start_s + number / FPS - time.monotonic())):
                        return
                    peer.sendall(data)

    def _due(self) -> Iterator[tuple[int, bytes]]:
        """The pictures that are not of the past."""
        for number, data in self._pictures:
            if self._start_s + (number + 1) / FPS > time.monotonic():
                yield number, data
