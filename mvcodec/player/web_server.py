"""The web server of the page that decodes by itself: its files, and the recording by ranges of bytes."""

from __future__ import annotations

import io
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
from mvcodec.player.page_files import HEADERS, Guard, page_routes

RECORDING, ORIGINALS = "video.mcap", "original"


def make_web_app(recording: Path, originals: Originals | None, rules: AccessRules) -> ASGIApp:
    """The application: the page at ``/``, its files, and the recording. Everything else is refused.

    Args:
        recording: an MCAP file; one that another program is writing may grow.
        originals: served as ``original/FRAME/ROW/COL.png``, for the page to compare with.
    """
    attributes = f'src="{RECORDING}"' + ("" if originals is None else f' originals="{ORIGINALS}"')
    routes = page_routes(recording.name, attributes)

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
