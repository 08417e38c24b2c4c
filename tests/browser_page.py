"""The player's page in a real Chromium: where it is, how to wait for it, and what is on its screen."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from player_files import SYNTHESIZER, Running, decode_picture
from playwright.sync_api import Browser, FloatRect, Page

from mvcodec.array import Viewpoint
from mvcodec.decoding.decoder import Decoder
from mvcodec.frames import Picture
from mvcodec.synthesis.synthesizers import make_synthesizer

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NO_CHROMIUM = "no Chromium (Debian: apt install chromium)"
ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
HERE = ("http://127.0.0.1:", "ws://127.0.0.1:", "blob:", "data:", "file:///", "about:")
SCREENSHOTS = Path(__file__).parents[1] / "build" / "screenshots"
FIRST_PICTURE_MS = 240_000
"""Kernels may have to be compiled first, on a machine that does much else."""
SAME_DB = 33
"""A picture that came as JPEG has more than this against its own source."""


def watched_page(browser: Browser, width: int, height: int) -> Iterator[Page]:
    """A page whose errors fail the test, and whose requests must stay on this machine. Nothing sways."""
    page = browser.new_page(viewport={"width": width, "height": height}, reduced_motion="reduce")
    troubles: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: None if is_here(request.url) else troubles.append(request.url))
    yield page
    page.close()
    assert troubles == []


def is_here(url: str) -> bool:
    return url.startswith(HERE)


def show(page: Page, server: Running, link: str = "") -> None:
    page.goto(server.url + link)
    page.wait_for_selector("body[data-frame]", timeout=FIRST_PICTURE_MS)


def shows(page: Page, **facts: object) -> None:
    """Wait until the picture on the screen is one with these facts (frame, row, col, look)."""
    page.wait_for_selector("body" + "".join(f"[data-{name}='{value}']" for name, value in facts.items()))


def pixels(page: Page) -> Picture:
    """What is on the canvas, in the file's own pixels."""
    url = page.evaluate("document.querySelector('canvas').toDataURL('image/png')")
    return decode_picture(np.frombuffer(base64.b64decode(url.split(",")[1]), np.uint8))


def rendered(file: Path, frame: int, row: float, col: float) -> Picture:
    """The same by the library."""
    with Decoder.open(file, slice(frame, frame + 1)) as decoder:
        (decoded,) = decoder
    return make_synthesizer(SYNTHESIZER).render(decoded, Viewpoint(row, col)).pixels


def box_of(page: Page, selector: str) -> FloatRect:
    box = page.locator(selector).bounding_box()
    assert box is not None, f"{selector} is not visible"
    return box


def on_screen(page: Page) -> tuple[int, float, float]:
    facts = page.evaluate("({...document.body.dataset})")
    return int(facts["frame"]), float(facts["row"]), float(facts["col"])


def screenshot(page: Page, name: str) -> None:
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SCREENSHOTS / f"{name}.png")


def comes_to(page: Page, frame: int, row: float, col: float) -> None:
    """Wait until the whole picture of a viewpoint is on the screen; rows and columns to 1e-6 of a step."""
    page.wait_for_function(
        """([frame, row, col]) => {
            const shown = document.body.dataset;
            const near = (text, value) => Math.abs(Number(text) - value) < 1e-6;
            return Number(shown.frame) === frame && near(shown.row, row) && near(shown.col, col)
                && Number(shown.scale) === 1 && shown.quick === 'false';
        }""",
        arg=[frame, row, col],
    )


def stands_still(page: Page, for_ms: float) -> None:
    """Wait until the picture on the screen has not changed for so long (a picture may still be under way)."""
    page.evaluate("document.body.dataset.stillSince = performance.now()")
    page.wait_for_function(
        """(forMs) => {
            const body = document.body.dataset;
            const shown = [body.frame, body.row, body.col].join();
            if (shown !== body.stillShows) [body.stillShows, body.stillSince] = [shown, performance.now()];
            return performance.now() - body.stillSince > forMs;
        }""",
        arg=for_ms,
    )
