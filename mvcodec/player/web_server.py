"""The web server of the page that decodes by itself: its files, and the recording by ranges of bytes."""

from __future__ import annotations

import html
from collections.abc import Awaitable, Callable
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from mvcodec.player.access import AccessRules
from mvcodec.player.server import Guard
from mvcodec.web_player.pages import TYPES, content_policy, page_files

RECORDING = "video.mcap"

HEADERS = {
    "Content-Security-Policy": content_policy("'self'", "'self'", "'self' blob: data:")
    + "; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}


def make_web_app(recording: Path, rules: AccessRules) -> ASGIApp:
    """The application: the page at ``/``, its files, and the recording. Everything else is refused.

    Args:
        recording: an MCAP file; one that another program is writing may grow.
    """
    routes = [
        Route("/" if name == "index.html" else f"/{name}", _fixed(name, _shown(content, recording.name)))
        for name, content in page_files().items()
    ]

    async def file(_request: Request) -> Response:
        return FileResponse(recording, media_type="application/octet-stream", headers=HEADERS)

    routes.append(Route(f"/{RECORDING}", file))
    return Guard(Starlette(routes=routes), rules)


def _shown(content: bytes, name: str) -> bytes:
    """The page shows the recording, by its name; nothing else has what is replaced."""
    page = content.replace(b"<title>mvcodec</title>", f"<title>{html.escape(name)}</title>".encode())
    return page.replace(b"<mvcodec-player page>", f'<mvcodec-player page src="{RECORDING}">'.encode())


def _fixed(name: str, content: bytes) -> Callable[[Request], Awaitable[Response]]:
    media_type = TYPES[name[name.rfind(".") :]]

    async def endpoint(_request: Request) -> Response:
        return Response(content, media_type=media_type, headers=HEADERS)

    return endpoint
