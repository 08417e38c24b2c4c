"""A camera that speaks RTSP (RFC 2326), its RTP packets within the same connection."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from itertools import count

import av
from live_senders import FPS, NUMBERS, free_port
from timed_videos import SIZE, numbered

_SDP = (
    "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=camera\r\nt=0 0\r\n"
    "m=video 0 RTP/AVP 96\r\na=rtpmap:96 H264/90000\r\n"
)


def send_rtp(port: int, col: int, start_s: float, stop: threading.Event, form: str) -> None:
    """Numbered pictures as RTP packets to a port of this machine, until `stop`."""
    with av.open(f"rtp://127.0.0.1:{port}", "w", format=form) as out:
        stream = out.add_stream("libx264", rate=FPS)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        stream.options = {"crf": "16", "preset": "ultrafast", "tune": "zerolatency", "g": "8"}
        stream.options = {**stream.options, "x264-params": "repeat-headers=1"}
        for number in count():
            if stop.wait(max(0.0, start_s + number / FPS - time.monotonic())):
                return
            frame = av.VideoFrame.from_ndarray(numbered(number % NUMBERS, col), format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, FPS)
            out.mux(stream.encode(frame))


class RtspCamera:
    """Serves one client; its pictures begin when that plays.

    Args:
        lost: whether an RTP packet, by its number, is lost on the way.

    Attributes:
        address: of the camera.
    """

    def __init__(self, col: int, start_s: float, lost: Callable[[int], bool] = lambda _number: False) -> None:
        self._col, self._start_s, self._lost = col, start_s, lost
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._socket.settimeout(0.1)
        self.address = f"rtsp://127.0.0.1:{self._socket.getsockname()[1]}/camera"
        self._stop = threading.Event()
        self._threads = [threading.Thread(target=self._run, daemon=True)]

    def __enter__(self) -> RtspCamera:
        self._threads[0].start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        for thread in self._threads:
            thread.join()
        self._socket.close()

    def _run(self) -> None:
        while not self._stop.is_set():
            with suppress(TimeoutError):
                peer, _ = self._socket.accept()
                with peer, suppress(OSError):  # whoever listened is gone
                    self._serve(peer)

    def _serve(self, peer: socket.socket) -> None:
        request = b""
        peer.settimeout(0.1)
        while not self._stop.is_set():
            with suppress(TimeoutError):
                piece = peer.recv(4096)
                if not piece:
                    return
                request += piece
            while b"\r\n\r\n" in request:
                head, _, request = request.partition(b"\r\n\r\n")
                method = head.split()[0].decode()
                number = next(text for text in head.decode().split("\r\n") if text.lower().startswith("cseq"))
                peer.sendall(_answer(method, number))
                if method == "PLAY":
                    self._play(peer)
                    return

    def _play(self, peer: socket.socket) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as relay:
            relay.settimeout(0.1)
            port = free_port() & ~1
            relay.bind(("127.0.0.1", port))
            sender = threading.Thread(
                target=send_rtp, args=(port, self._col, self._start_s, self._stop, "rtp"), daemon=True
            )
            self._threads.append(sender)
            sender.start()
            while not self._stop.is_set():
                with suppress(TimeoutError):
                    packet = relay.recv(65536)
                    if not self._lost(struct.unpack(">H", packet[2:4])[0]):
                        peer.sendall(b"$\0" + struct.pack(">H", len(packet)) + packet)


def _answer(method: str, number: str) -> bytes:
    head = f"RTSP/1.0 200 OK\r\n{number}\r\nSession: 1\r\n"
    if method == "DESCRIBE":
        return f"{head}Content-Type: application/sdp\r\nContent-Length: {len(_SDP)}\r\n\r\n{_SDP}".encode()
    extra = {
        "OPTIONS": "Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN\r\n",
        "SETUP": "Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\n",
    }
    return f"{head}{extra.get(method, '')}\r\n".encode()
