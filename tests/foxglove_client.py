"""A client of Foxglove's WebSocket protocol: https://github.com/foxglove/ws-protocol (its specification)."""

from __future__ import annotations

import json
import struct
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

_MESSAGE_DATA = 1


class FoxgloveClient:
    """One viewer. Subscriptions have the numbers of their channels."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._data: deque[bytes] = deque()
        self._topics: dict[int, str] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        assert self._said()["op"] == "serverInfo"

    def wait_for_channels(self, count: int) -> None:
        """Read on until so many channels are announced."""
        while len(self.channels) < count:
            self._said()

    def subscribe(self, topics: Iterable[str]) -> None:
        """Ask for topics; comes back when the server has them."""
        wanted = [self.channels[topic]["id"] for topic in topics]
        subscriptions = [{"id": number, "channelId": number} for number in wanted]
        self._connection.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        # Subscribing is not answered, but a request that the server cannot fulfil is, and after it.
        self._connection.send(json.dumps({"op": "getParameters", "parameterNames": [], "id": "done"}))
        while self._said()["op"] != "status":
            pass

    def messages(self, timeout_s: float = 30) -> Iterator[tuple[str, int, bytes]]:
        """(topic, log time in ns, data) as they come; ends where none comes, or the server goes."""
        while True:
            if not self._data:
                try:
                    found = self._connection.recv(timeout=timeout_s)
                except (TimeoutError, ConnectionClosed):
                    return
                assert isinstance(found, bytes)
                self._data.append(found)
            found = self._data.popleft()
            opcode, number, time_ns = struct.unpack_from("<BIQ", found)
            assert opcode == _MESSAGE_DATA
            yield self._topics[number], time_ns, found[13:]

    def _said(self) -> dict[str, Any]:
        """The next text message, which is JSON; keeps the channels that it announces, and data before it."""
        while isinstance(found := self._connection.recv(timeout=30), bytes):
            self._data.append(found)
        said: dict[str, Any] = json.loads(found)
        for channel in said.get("channels", ()):
            self.channels[channel["topic"]] = channel
            self._topics[channel["id"]] = channel["topic"]
        return said


@contextmanager
def foxglove(url: str) -> Iterator[FoxgloveClient]:
    """A connected client."""
    # It takes little in advance, so that a test can let the server's queue run full. What then was not read
    # hides that the server has gone, which is waited for at the end.
    protocols: Any = ["foxglove.sdk.v1"]
    with connect(url, subprotocols=protocols, max_queue=1, close_timeout=0.2) as connection:
        yield FoxgloveClient(connection)
