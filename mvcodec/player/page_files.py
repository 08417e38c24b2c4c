"""The page as this machine serves it: its built files, under one content security policy."""

from __future__ import annotations

import html
from collections.abc import Awaitable, Callable

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from mvcodec.player.access import AccessRules
from mvcodec.web_player.pages import TYPES, content_policy, page_files

CLOSE_REFUSED = 1008

HEADERS = {
    "Content-Security-Policy": content_policy("'self'", "'self'", "'self' blob: data:")
    + "; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}


def page_routes(title: str, attributes: str) -> list[Route]:
    """The page at ``/``, and its files.

    Args:
        title: of the window.
        attributes: of the player's element, as HTML: what it shows.
    """
    return [
        Route("/" if name == "index.html" else f"/{name}", _fixed(name, _shown(content, title, attributes)))
        for name, content in page_files().items()
    ]


class Guard:
    """Refuses what the access rules refuse, before anything else looks at it."""

    def __init__(self, app: ASGIApp, rules: AccessRules) -> None:
        self._app, self._rules = app, rules

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] in ("http", "websocket"):
            headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
            host = headers.get(b"host")
            allowed = self._rules.allows_host(host)
            if scope["type"] == "websocket":
                allowed = allowed and self._rules.allows_origin(headers.get(b"origin"), host)
            if not allowed:
                await _refuse(scope, receive, send)
                return
        await self._app(scope, receive, send)


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": CLOSE_REFUSED})
    else:
        await PlainTextResponse("refused: unknown Host\n", 403)(scope, receive, send)


def _shown(content: bytes, title: str, attributes: str) -> bytes:
    """The page shows the recording, by its name; nothing else has what is replaced."""
    page = content.replace(b"<title>mvcodec</title>", f"<title>{html.escape(title)}</title>".encode())
    return page.replace(b"<mvcodec-player page>", f"<mvcodec-player page {attributes}>".encode())


def _fixed(name: str, content: bytes) -> Callable[[Request], Awaitable[Response]]:
    media_type = TYPES[name[name.rfind(".") :]]

    async def endpoint(_request: Request) -> Response:
        return Response(content, media_type=media_type, headers=HEADERS)

    return endpoint
