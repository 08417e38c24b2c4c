"""The web server: the page's files and one WebSocket a viewer. Everything else is refused."""

from __future__ import annotations

import asyncio
import json
import logging
import math
import struct
import time
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from mvcodec.array import Viewpoint
from mvcodec.depth import depth_m
from mvcodec.errors import InputError, MvCodecError
from mvcodec.frames import RenderedView
from mvcodec.player.access import AccessRules
from mvcodec.player.looks import COMPARING, LOOKS
from mvcodec.player.messages import Probe, parse_message
from mvcodec.player.page_files import CLOSE_REFUSED, HEADERS, Guard, page_routes
from mvcodec.player.picture_maker import MadePicture, PictureMaker, to_jpeg
from mvcodec.player.session import PictureRequest, Session

MAX_VIEWERS = 32

CLOSE_BUSY = 1013
CLOSE_BROKEN = 1011

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Broadcast:
    """What is served.

    Attributes:
        maker: of the file's pictures.
        title: the file's name.
        synthesizer: its name, for the page to show.
        stop_on_damage: see `Session`.
    """

    maker: PictureMaker
    title: str
    synthesizer: str
    stop_on_damage: bool = False


def make_app(broadcast: Broadcast, rules: AccessRules) -> ASGIApp:
    """The application: the page at ``/``, its files, thumbnails, and the WebSocket at ``/view``."""
    viewers = _Viewers(broadcast)
    routes: list[Route | WebSocketRoute] = [
        *page_routes(broadcast.title, 'server="view"'),
        Route("/thumbnail/{frame:int}", _thumbnail(broadcast)),
        WebSocketRoute("/view", viewers.serve),
    ]
    return Guard(Starlette(routes=routes), rules)


def _thumbnail(broadcast: Broadcast) -> Callable[[Request], Awaitable[Response]]:
    """A small picture of a frame, as seen from about a viewpoint: `thumbnail/FRAME?row=R&col=C`."""

    def make(frame: int, place: Viewpoint) -> Response:
        picture = broadcast.maker.thumbnails.picture(frame, place)
        if picture is None:
            return PlainTextResponse("no such picture\n", 404, HEADERS)
        return Response(to_jpeg(picture), headers=HEADERS, media_type="image/jpeg")

    async def endpoint(request: Request) -> Response:
        try:
            row, col = (float(request.query_params[name]) for name in ("row", "col"))
            return await run_in_threadpool(make, request.path_params["frame"], Viewpoint(row, col))
        except (KeyError, ValueError):
            return PlainTextResponse("expected ?row=R&col=C\n", 400, HEADERS)
        except MvCodecError as error:
            return PlainTextResponse(f"{error}\n", 500, HEADERS)

    return endpoint


class _Viewers:
    """Everyone who watches, and the threads that work for them."""

    def __init__(self, broadcast: Broadcast) -> None:
        self._broadcast = broadcast
        self._count = 0
        self._pool = ThreadPoolExecutor(broadcast.maker.at_once, "picture")

    async def serve(self, socket: WebSocket) -> None:
        """One viewer, from the handshake to the end."""
        await socket.accept()
        if self._count >= MAX_VIEWERS:
            await socket.close(CLOSE_BUSY, f"{MAX_VIEWERS} viewers are watching already")
            return
        self._count += 1
        try:
            await _Viewer(socket, self._broadcast, self._pool).run()
        finally:
            self._count -= 1


class _Viewer:
    """One connection: reads messages into the session and sends the pictures that it asks for."""

    def __init__(self, socket: WebSocket, broadcast: Broadcast, pool: ThreadPoolExecutor) -> None:
        self._socket, self._broadcast, self._pool = socket, broadcast, pool
        table = broadcast.maker.store.table
        self._session = Session(
            table.header.array,
            table.count,
            stop_on_damage=broadcast.stop_on_damage,
            levels=broadcast.maker.levels,
            enhanced=table.enhanced,
        )
        self._news = asyncio.Event()
        self._stated: dict[str, Any] | None = None
        self._overtaken: asyncio.Future[MadePicture] | None = None
        self._last: RenderedView | None = None

    async def run(self) -> None:
        sender = asyncio.create_task(self._send())
        reader = asyncio.create_task(self._read())
        try:
            await asyncio.wait({sender, reader}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (sender, reader):
                task.cancel()
            results = await asyncio.gather(sender, reader, return_exceptions=True)
        for error in results:
            if isinstance(error, Exception) and not isinstance(error, WebSocketDisconnect):
                await self._close_after(error)

    async def _close_after(self, error: Exception) -> None:
        """Close this connection, and nothing else, saying why."""
        code = CLOSE_REFUSED if isinstance(error, InputError) else CLOSE_BROKEN
        if code == CLOSE_BROKEN:
            _log.error("a viewer's connection broke", exc_info=error)
        # The reason of a close frame has 123 bytes at most.
        reason = str(error).encode()[:120].decode(errors="ignore")
        with suppress(RuntimeError, WebSocketDisconnect):  # the viewer has gone already
            await self._socket.close(code, reason)

    async def _read(self) -> None:
        while True:
            event = await self._socket.receive()
            if event["type"] == "websocket.disconnect":
                raise WebSocketDisconnect(event.get("code", 1006))
            text = event.get("text")
            message = parse_message(text if text is not None else b"")
            if isinstance(message, Probe):
                await self._tell_place(message)
                continue
            self._session.apply(message, time.monotonic())
            self._news.set()

    async def _tell_place(self, probe: Probe) -> None:
        """What is seen at a place of the picture that was sent last; null where that shows several views."""
        facts: dict[str, Any] = {"type": "place", "x": probe.x, "y": probe.y}
        await self._socket.send_text(json.dumps(facts | self._seen_at(probe.x, probe.y)))

    def _seen_at(self, x: float, y: float) -> dict[str, float | None]:
        view = self._last
        if view is None:
            return {"disparity_px": None, "depth_m": None}
        height, width = view.disparity_px.shape
        row, col = min(int(y * height), height - 1), min(int(x * width), width - 1)
        found = view.disparity_px[row : row + 1, col : col + 1]
        array = self._broadcast.maker.store.table.header.array
        depth = float(depth_m(array, found)[0, 0]) if array.calibration.given else math.inf
        return {"disparity_px": float(found[0, 0]), "depth_m": depth if math.isfinite(depth) else None}

    async def _send(self) -> None:
        await self._socket.send_text(json.dumps(self._greeting()))
        session = self._session
        while True:
            self._news.clear()
            request = session.next_request(time.monotonic())
            await self._send_state()
            if request is None:
                wait_s = session.seconds_to_next(time.monotonic())
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._news.wait(), wait_s)
                continue
            start_s = time.monotonic()
            try:
                made = await self._make(request)
            except MvCodecError as error:
                trouble = {"type": "trouble", "message": str(error), "frame": request.frame}
                await self._socket.send_text(json.dumps(trouble))
                continue
            if made is None:
                continue
            now_s = time.monotonic()
            session.made(request, now_s - start_s, made.drawing_s, now_s)
            await self._send_picture(made)

    async def _make(self, request: PictureRequest) -> MadePicture | None:
        """Have a picture made; None if it was overtaken, which one at a time may be."""
        maker, loop = self._broadcast.maker, asyncio.get_running_loop()
        job = loop.run_in_executor(self._pool, maker.make, request, self._session.upcoming())
        while not job.done():
            news = asyncio.create_task(self._news.wait())
            try:
                await asyncio.wait((job, news), return_when=asyncio.FIRST_COMPLETED)
            finally:
                news.cancel()
            self._news.clear()
            free = self._overtaken is None or self._overtaken.done()
            if free and not job.done() and self._session.overtaken(request, time.monotonic()):
                job.add_done_callback(asyncio.Future.exception)  # nobody asks any more what became of it
                self._overtaken = job
                return None
        return await job

    async def _send_picture(self, made: MadePicture) -> None:
        """A picture's message: big-endian uint32 length of the facts, the facts as JSON, the JPEG."""
        session = self._session
        facts = made.facts | {
            "picture": session.sent(time.monotonic(), damaged=made.damaged),
            "transfer_ms": session.transfer_ms,
            "dropped": session.dropped,
        }
        head = json.dumps(facts, separators=(",", ":")).encode()
        self._last = made.view
        await self._socket.send_bytes(struct.pack(">I", len(head)) + head + made.jpeg)

    async def _send_state(self) -> None:
        state = self._session.state
        if state != self._stated:
            self._stated = state
            await self._socket.send_text(json.dumps({"type": "state"} | state))

    def _greeting(self) -> dict[str, Any]:
        broadcast = self._broadcast
        table = broadcast.maker.store.table
        array = table.header.array
        return {
            "type": "hello",
            "title": broadcast.title,
            "rows": array.rows,
            "cols": array.cols,
            "real_rows": array.real_rows,
            "real_cols": array.real_cols,
            "enhanced": sorted(map(list, table.enhanced)),
            "width": array.width,
            "height": array.height,
            "fps": array.fps,
            "frames": table.count,
            "times_s": [(time_ns - table.times_ns[0]) / 1e9 for time_ns in table.times_ns],
            "range_px": table.header.disparity_range_px,
            "infinity_px_per_step": array.calibration.d_inf_px_per_step,
            "rho": array.rho,
            "codec": table.header.codec,
            "looks": [look for look in LOOKS if look != COMPARING or broadcast.maker.originals is not None],
            "synthesizer": broadcast.synthesizer,
            "cut_off": table.cut_off,
        }
