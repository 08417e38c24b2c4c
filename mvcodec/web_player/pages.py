"""The page that needs no server behind it: its built files, and copies that show one recording."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from importlib.resources import files

TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
}
"""Of the built files that are served."""

_ELEMENT = "<mvcodec-player page></mvcodec-player>"
_TITLE = "<title>mvcodec</title>"
_STYLE = '<link rel="stylesheet" href="page.css">'
_SCRIPT = '<script type="module" src="player.js"></script>'
_HEAD = '<meta charset="utf-8">'


def page_files() -> dict[str, bytes]:
    """Name -> content of the built page's files, `index.html` among them."""
    folder = files("mvcodec.web_player").joinpath("dist")
    names = sorted(item.name for item in folder.iterdir() if item.name[item.name.rfind(".") :] in TYPES)
    return {name: folder.joinpath(name).read_bytes() for name in names}


def content_policy(scripts: str, styles: str, connections: str) -> str:
    """A content security policy under which nothing runs but the given scripts."""
    return (
        f"default-src 'none'; script-src {scripts}; style-src {styles}; img-src 'self' blob: data:; "
        f"media-src blob:; connect-src {connections}; base-uri 'none'; form-action 'none'"
    )


def linked_page(title: str, source: str, poster: str | None, originals: str | None = None) -> str:
    """`index.html` beside its script, its style and the recording.

    Args:
        source, poster: names of the files beside it; without a poster the first picture is waited for.
        originals: name of the folder beside it that holds what views are compared with.
    """
    policy = content_policy("'self'", "'self'", "* ws: wss: blob: data:")
    return _filled(title, policy, _element(src=source, poster=poster, originals=originals))


def single_page(title: str, recording: bytes | str, poster: str | None = None) -> str:
    """One HTML file with everything in it, which opens from disk.

    Args:
        recording: the MCAP file's bytes, or its address.
        poster: a data URL.
    """
    page = page_files()
    script, style = page["player.js"].decode(), page["page.css"].decode()
    policy = content_policy(f"'{_digest(script)}'", f"'{_digest(style)}'", "* ws: wss: blob: data:")
    source = recording if isinstance(recording, str) else None
    text = _filled(title, policy, _element(src=source, poster=poster))
    embedded = ""
    if isinstance(recording, bytes):
        data = base64.b64encode(recording).decode()
        embedded = f'<script type="text/plain" id="recording">{data}</script>\n'
    # The script stands last, so that what it looks for is there.
    text = text.replace(_SCRIPT, "").replace(_STYLE, f"<style>{style}</style>")
    tail = f'{embedded}<script type="module">{script}</script>\n'
    return text.replace("</body>", f"{tail}</body>")


def shown_in_frame(page: str, height_px: int = 480) -> str:
    """HTML that shows a page inside another one, as notebooks do."""
    return (
        f'<iframe srcdoc="{html.escape(page)}" allow="fullscreen" '
        f'style="width: 100%; height: {height_px}px; border: 0" title="mvcodec"></iframe>'
    )


def _filled(title: str, policy: str, element: str) -> str:
    text = page_files()["index.html"].decode()
    meta = f'{_HEAD}\n  <meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}">'
    for old, new in (
        (_HEAD, meta),
        (_TITLE, f"<title>{html.escape(title)}</title>"),
        (_ELEMENT, element),
    ):
        if old not in text:
            raise AssertionError(f"the built page lacks {json.dumps(old)}")
        text = text.replace(old, new)
    return text


def _element(**attributes: str | None) -> str:
    written = "".join(
        f' {name}="{html.escape(value)}"' for name, value in attributes.items() if value is not None
    )
    return f"<mvcodec-player page{written}></mvcodec-player>"


def _digest(text: str) -> str:
    """What a content security policy calls an inline script or style."""
    if re.search(r"</(script|style)", text, re.IGNORECASE):
        raise AssertionError("the built page has an end tag within a script or a style")
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
