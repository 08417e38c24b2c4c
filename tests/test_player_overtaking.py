"""A whole picture that is being made when the viewpoint moves again is not waited for."""

from __future__ import annotations

import asyncio
import json
import struct
import threading
import time
from collections.abc import Iterator, MutableMapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from player_files import encode, write_original

from mvcodec.player.access import AccessRules
from mvcodec.player.draft import BUDGET_S, WHOLE
from mvcodec.player.picture_maker import MadePicture, PictureMaker
from mvcodec.player.server import Broadcast, make_app
from mvcodec.player.session import PictureRequest
from mvcodec.synthesis.linear import Linear

PATIENCE_S = 10


class SlowMaker(PictureMaker):
    """Draws nothing, and not in time; its whole pictures wait until they are let once `held` is set."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, Linear)
        self.held, self.let, self.begun = threading.Event(), threading.Event(), threading.Event()

    def make(self, request: PictureRequest, upcoming: Sequence[int] = ()) -> MadePicture:
        assert not upcoming
        time.sleep(2 * BUDGET_S)
        if self.held.is_set() and request.level == WHOLE:
            self.begun.set()
            self.let.wait(PATIENCE_S)
        facts = {"col": request.viewpoint.col, "whole": request.level == WHOLE}
        return MadePicture(b"", facts, 2 * BUDGET_S, damaged=False)


@pytest.fixture
def maker(tmp_path: Path) -> Iterator[SlowMaker]:
    maker = SlowMaker(encode(write_original(tmp_path / "original", (2, 2), frames=1), tmp_path / "room.mcap"))
    yield maker
    maker.let.set()
    maker.close()


class Wire:
    """One viewer's WebSocket as the application sees it."""

    def __init__(self) -> None:
        self.inbox: asyncio.Queue[MutableMapping[str, Any]] = asyncio.Queue()
        self.outbox: asyncio.Queue[MutableMapping[str, Any]] = asyncio.Queue()
        self.inbox.put_nowait({"type": "websocket.connect"})

    def say(self, kind: str, **fields: object) -> None:
        self.inbox.put_nowait({"type": "websocket.receive", "text": json.dumps({"type": kind, **fields})})

    async def picture(self) -> dict[str, Any]:
        """Facts of the next picture, acknowledged."""
        while True:
            event = await asyncio.wait_for(self.outbox.get(), PATIENCE_S)
            if event.get("bytes"):
                (length,) = struct.unpack(">I", event["bytes"][:4])
                facts: dict[str, Any] = json.loads(event["bytes"][4 : 4 + length])
                self.say("shown", picture=facts["picture"])
                return facts


async def watch(maker: SlowMaker) -> None:
    wire = Wire()
    scope = {"type": "websocket", "path": "/view", "headers": [(b"host", b"127.0.0.1")], "subprotocols": []}
    app = make_app(Broadcast(maker, "room.mcap", "linear"), AccessRules("127.0.0.1"))
    serving = asyncio.ensure_future(app(scope, wire.inbox.get, wire.outbox.put))
    wire.say("ready")
    col, shown = 0.0, await wire.picture()
    while shown["whole"]:  # dragging goes on until drafts are used
        col = (col + 0.01) % 1
        wire.say("move", row=0.5, col=col)
        shown = await wire.picture()
    maker.held.set()
    assert await asyncio.to_thread(maker.begun.wait, PATIENCE_S), "a picture that stands is made whole"
    wire.say("move", row=0.5, col=0.75)
    while (shown := await wire.picture())["col"] != 0.75:
        assert not shown["whole"]  # a draft that was under way when the viewpoint rested
    assert not shown["whole"]
    assert not maker.let.is_set()
    maker.let.set()
    shown = await wire.picture()
    assert (shown["col"], shown["whole"]) == (0.75, True)
    wire.inbox.put_nowait({"type": "websocket.disconnect", "code": 1000})
    await asyncio.wait_for(serving, PATIENCE_S)


def test_a_draft_overtakes_the_whole_picture_before_it(maker: SlowMaker) -> None:
    with ThreadPoolExecutor(1) as pool:  # the thread of a browser's tests has a loop of its own
        pool.submit(asyncio.run, watch(maker)).result()
