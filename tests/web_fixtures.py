"""Fixtures of the tests of the page that needs no server behind it: a plain web server, and Chromium."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from browser_page import PLAYER, watched_page
from player_files import Running, playing
from playwright.sync_api import Browser, Page

from mvcodec.web_player.pages import page_files

pytest_plugins = ("chromium",)

SIZE = (960, 600)
SAMPLE = Path(__file__).parent / "conformance" / "square.mcap"
"""3 x 3 views of 64 x 48, six frames, ten a second."""


@dataclass
class Site:
    """A folder behind a web server that knows nothing but files and ranges of them.

    Attributes:
        ranges: (name, start, end) of each request for a part, end exclusive.
        cuts: how many of the next answers with parts break off in the middle.
    """

    folder: Path
    url: str = ""
    ranges: list[tuple[str, int, int]] = field(default_factory=list)
    has_ranges: bool = True
    cuts: int = 0

    def put(self, name: str, content: bytes) -> str:
        """Serve a file; returns its address."""
        (self.folder / name).write_bytes(content)
        return f"{self.url}/{name}"


def serve_folder(folder: Path) -> Iterator[Site]:
    """Serve until the generator is closed."""
    site = Site(folder)

    class Handler(SimpleHTTPRequestHandler):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments, directory=str(folder))

        def do_GET(self) -> None:
            path = Path(self.translate_path(self.path))
            wanted = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
            if wanted is None or not site.has_ranges or not path.is_file():
                super().do_GET()
                return
            size = path.stat().st_size
            start, end = int(wanted[1]), min(int(wanted[2]) + 1, size)
            if start >= size:
                self.send_error(416)
                return
            site.ranges.append((path.name, start, end))
            self.send_response(206)
            self.send_header("Content-Range", f"bytes {start}-{end - 1}/{size}")
            self.send_header("Content-Length", str(end - start))
            self.end_headers()
            if site.cuts > 0:
                site.cuts -= 1
                end = start + (end - start) // 2
            with path.open("rb") as file:
                file.seek(start)
                self.wfile.write(file.read(end - start))

        def log_message(self, *_arguments: Any) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    site.url = f"http://127.0.0.1:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield site
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """The built page's files behind a plain web server, with room for recordings."""
    folder = tmp_path_factory.mktemp("site")
    for name, content in page_files().items():
        (folder / name).write_bytes(content)
    (folder / "blank.html").write_text('<!doctype html><meta charset="utf-8"><title>blank</title>')
    yield from serve_folder(folder)


@pytest.fixture(scope="module")
def window(chromium: Browser) -> Iterator[Page]:
    """One page for all tests of a file: to start one costs more than most of them."""
    yield from watched_page(chromium, *SIZE)


@pytest.fixture
def tab(window: Page) -> Page:
    """That page as it was at first, apart from its address."""
    width, height = SIZE
    window.set_viewport_size({"width": width, "height": height})
    window.emulate_media(reduced_motion="reduce", color_scheme="light")
    return window


@pytest.fixture(scope="module")
def sample_server() -> Iterator[Running]:
    """`mvcodec play` of SAMPLE."""
    with playing(SAMPLE, renderer="web") as running:
        yield running


@pytest.fixture
def sample_page(tab: Page, sample_server: Running) -> Page:
    """Its page, on view 1,1; opened again where it is there, which compiles no shaders."""
    address = f"{sample_server.url}?view=1,1&t=0.2"
    if tab.url != address:
        tab.goto(address)
        tab.evaluate(f"{PLAYER}.ready")
        return tab
    tab.evaluate("""() => {
        const player = document.querySelector("mvcodec-player");
        const root = player.shadowRoot;
        root.activeElement?.blur();
        root.querySelector("dialog").close();
        for (const name of [".menu", ".stats"]) root.querySelector(name).hidden = true;
        return player.open("video.mcap", { view: { row: 1, col: 1 }, seconds: 0.2 });
    }""")
    return tab


def open_player(page: Page, site: Site, recording: str, attributes: str = "") -> None:
    """An element for a recording on a page of its own, with its first picture on the screen."""
    page.goto(f"{site.url}/blank.html")
    page.evaluate(
        """async ([recording, attributes]) => {
            await import("./player.js");
            document.body.innerHTML = `<mvcodec-player src="${recording}" ${attributes}></mvcodec-player>`;
            window.troubles = [];
            const player = document.querySelector("mvcodec-player");
            player.addEventListener("error", (event) => window.troubles.push(event.detail.message));
            await player.ready;
        }""",
        [recording, attributes],
    )
