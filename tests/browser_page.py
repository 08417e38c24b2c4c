"""The player's page in a real Chromium: where it is, how to wait for it, and what is on its screen."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from player_files import SYNTHESIZER, Running
from playwright.sync_api import Browser, Page

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
PLAYER = "document.querySelector('mvcodec-player')"


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
    """Go to a player's page; its first picture is on the screen then."""
    page.goto(server.url + link)
    page.wait_for_function(f"() => {PLAYER}.shown !== undefined", timeout=FIRST_PICTURE_MS)


def shown(page: Page) -> dict[str, Any]:
    found: dict[str, Any] = page.evaluate(f"{PLAYER}.shown")
    return found


def waits_for(page: Page, condition: str) -> None:
    """Wait until something holds of what is `shown`."""
    page.wait_for_function(f"() => {{ const shown = {PLAYER}.shown; return {condition}; }}")


def settled(page: Page) -> None:
    """Wait until what is asked for is on the screen with all detail."""
    page.evaluate(f"{PLAYER}.settled()")


def comes_to(page: Page, frame: int, row: float, col: float) -> None:
    """Wait until the whole picture of a viewpoint is on the screen; rows and columns to 1e-6 of a step."""
    near = " && ".join(
        f"Math.abs(shown.view.{name} - {at}) < 1e-6" for name, at in (("row", row), ("col", col))
    )
    waits_for(page, f"shown.frame === {frame} && {near}")
    settled(page)


def pixels_of(page: Page, selector: str = "mvcodec-player", fine: bool = True) -> Picture:
    """What the player's `pixels()` gives, as RGB: as the picture stands or, not `fine`, as it moves."""
    width, height, data = page.evaluate(
        """([selector, fine]) => {
            const { width, height, data } = document.querySelector(selector).pixels(fine);
            let text = "";
            for (let i = 0; i < data.length; i += 32768) {
                text += String.fromCharCode(...data.subarray(i, i + 32768));
            }
            return [width, height, btoa(text)];
        }""",
        [selector, fine],
    )
    return np.frombuffer(base64.b64decode(data), np.uint8).reshape(height, width, 4)[..., :3]


def toggle_menu(page: Page) -> None:
    page.get_by_label("More").dispatch_event("click")  # the controls may have hidden by now


def set_slider(page: Page, label: str, value: str) -> None:
    page.get_by_label(label, exact=True).fill(value)


def drop(page: Page, file: Path) -> None:
    """Drop a file on the player; it is shown then."""
    page.evaluate(
        """(bytes) => {
            const transfer = new DataTransfer();
            transfer.items.add(new File([new Uint8Array(bytes)], "other.mcap"));
            const player = document.querySelector("mvcodec-player");
            const about = { dataTransfer: transfer, bubbles: true, cancelable: true };
            player.dispatchEvent(new DragEvent("drop", about));
            return player.ready;
        }""",
        list(file.read_bytes()),
    )


def rendered(file: Path, frame: int, row: float, col: float) -> Picture:
    """The same by the library."""
    with Decoder.open(file, slice(frame, frame + 1)) as decoder:
        (decoded,) = decoder
    return make_synthesizer(SYNTHESIZER).render(decoded, Viewpoint(row, col)).pixels


def screenshot(page: Page, name: str) -> None:
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SCREENSHOTS / f"{name}.png")
