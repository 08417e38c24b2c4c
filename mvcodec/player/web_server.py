"""The web server of the page that decodes by itself: its files, and the recording by ranges of bytes."""

from __future__ import annotations

import html
import io
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path

from PIL import Image
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from mvcodec.array import Position
from mvcodec.errors import MvCodecError
from mvcodec.player.access import AccessRules
from mvcodec.player.originals import Originals
from mvcodec.player.server import Guard
from mvcodec.web_player.pages import TYPES, content_policy, page_files

RECORDING, ORIGINALS = "video.mcap", "original"

HEADERS = {
    "Content-Security-Policy": content_policy("'self'", "'self'", "'self' blob: data:")
    + "; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}


def make_web_app(recording: Path, originals: Originals | None, rules: AccessRules) -> ASGIApp:
    """The application: the page at ``/``, its files, and the recording. Everything else is refused.

    Args:
        recording: an MCAP file; one that another program is writing may grow.
        originals: served as ``original/FRAME/ROW/COL.png``, for the page to compare with.
    """
    attributes = f'src="{RECORDING}"' + ("" if originals is None else f' originals="{ORIGINALS}"')
    routes = [
        Route(
            "/" if name == "index.html" else f"/{name}",
            _fixed(name, _shown(content, recording.name, attributes)),
        )
        for name, content in page_files().items()
    ]

    async def file(_request: Request) -> Response:
        return FileResponse(recording, media_type="application/octet-stream", headers=HEADERS)

    routes.append(Route(f"/{RECORDING}", file))
    if originals is not None:
        path = f"/{ORIGINALS}/{{frame:int}}/{{row:int}}/{{col:int}}.png"
        routes.append(Route(path, partial(_original, originals)))
    return Guard(Starlette(routes=routes), rules)


async def _original(originals: Originals, request: Request) -> Response:
    """One picture of the original array."""
    frame, row, col = (request.path_params[name] for name in ("frame", "row", "col"))
    try:
        png = await run_in_threadpool(_png, originals, frame, (row, col))
    except MvCodecError as error:
        return PlainTextResponse(f"{error}\n", 500, HEADERS)
    return Response(png, 404 if png is None else 200, HEADERS, "image/png")


def _png(originals: Originals, frame: int, place: Position) -> bytes | None:
    picture = originals.picture(frame, place)
    if picture is None:
        return None
    room = io.BytesIO()
    Image.fromarray(picture).save(room, "PNG", compress_level=1)
    return room.getvalue()


def _shown(content: bytes, name: str, attributes: str) -> bytes:
    """The page shows the recording, by its name; nothing else has what is replaced."""
    page = content.replace(b"<title>mvcodec</title>", f"<title>{html.escape(name)}</title>".encode())
    return page.replace(b"<mvcodec-player page>", f"<mvcodec-player page {attributes}>".encode())


def _fixed(name: str, content: bytes) -> Callable[[Request], Awaitable[Response]]:
    media_type = TYPES[name[name.rfind(".") :]]

    async def endpoint(_request: Request) -> Response:
        return Response(content, media_type=media_type, headers=HEADERS)

    return endpoint
