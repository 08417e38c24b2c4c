"""The messages of a file to Foxglove, over its WebSocket, while the file is being written."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, cast

from mvcodec.closing import Closing
from mvcodec.errors import MissingExtra, SettingError

if TYPE_CHECKING:
    from foxglove.websocket import ServerListener

EXTRA = "live"

_STREAMS = frozenset({"foxglove.CompressedVideo", "foxglove.RawImage"})
"""Schemas of what comes with each frame set; all else comes with keyframes, and again to late joiners."""


class LiveView(Closing):
    """Serves what is written into a file to any number of Foxglove clients; see `MessageListener`.

    Who joins late gets the rig with the next frame set, and pictures from the next keyframe on
    (viewers leave out what comes before it). Nobody is waited for: each client has a queue in the
    SDK, which drops its oldest messages where it is full.

    Args:
        host: address or name to listen on.
        port: 0 takes any free one.

    Attributes:
        url: what clients connect to.

    Raises:
        MissingExtra: foxglove-sdk is not installed.
        SettingError: the address cannot be bound.
    """

    def __init__(self, host: str, port: int) -> None:
        try:
            from foxglove import Context, start_server
        except ImportError:
            raise MissingExtra("foxglove-sdk", EXTRA) from None
        # A context of its own: the default one is shared with whoever else uses the SDK in this process.
        self._context = Context()
        self._channels: dict[str, Any] = {}
        self._rig: dict[str, list[tuple[int, bytes]]] = {}
        self._lock = threading.Lock()
        self._joined: set[str] = set()
        listener = cast("ServerListener", self)  # the SDK calls those methods that are there
        try:
            self._server = start_server(
                name="mvcodec", host=host, port=port, context=self._context, server_listener=listener
            )
        except RuntimeError as error:
            reason = str(error).removeprefix("FoxgloveError: ")
            expected = "an address of this machine and a free port"
            raise SettingError("live_view", f"{host}:{port} ({reason})", expected) from None
        self.url = f"ws://{f'[{host}]' if ':' in host else host}:{self._server.port}"

    def add_channel(self, topic: str, encoding: str, name: str, schema_encoding: str, schema: bytes) -> None:
        """Announce a topic to the clients."""
        from foxglove import Channel, Schema

        described = Schema(name=name, encoding=schema_encoding, data=schema)
        self._channels[topic] = Channel(
            topic, schema=described, message_encoding=encoding, context=self._context
        )
        if name not in _STREAMS:
            self._rig[topic] = []

    def begin_set(self, keyframe: bool) -> None:
        """Begin a frame set: to who joined since the last one, the rig as the last keyframe had it."""
        with self._lock:
            joined, self._joined = self._joined, set()
        if keyframe:
            for messages in self._rig.values():
                messages.clear()
            return
        for topic in joined & self._rig.keys():
            for time_ns, data in self._rig[topic]:
                self._channels[topic].log(data, log_time=time_ns)

    def add(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message to the clients."""
        if topic in self._rig:
            self._rig[topic].append((time_ns, data))
        self._channels[topic].log(data, log_time=time_ns)

    def on_subscribe(self, _client: object, channel: Any) -> None:
        """Called by the SDK, in a thread of its own."""
        with self._lock:
            self._joined.add(channel.topic)

    def on_unsubscribe(self, client: object, channel: Any) -> None:
        """Called by the SDK; nothing is kept of clients."""

    def close(self) -> None:
        """Stop the server."""
        self._server.stop()
