"""The page in a real Chromium: what a viewer does, and what is then on the screen.

Skips where there is no Chromium (Debian: apt install chromium). Screenshots of the main states are left in
build/screenshots, to be looked at.
"""

from __future__ import annotations

import base64
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from player_files import (
    FRAMES,
    GOP,
    SYNTHESIZER,
    Running,
    damage,
    decode_picture,
    encode,
    playing,
    write_original,
)
from playwright.sync_api import Browser, FloatRect, Page, sync_playwright

from mvcodec.array import Viewpoint
from mvcodec.decoder import Decoder
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import Picture
from mvcodec.player.looks import LOOKS
from mvcodec.synthesis.table import make_synthesizer

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium (Debian: apt install chromium)")

ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
SCREENSHOTS = Path(__file__).parents[1] / "build" / "screenshots"
SAME_DB = 33
"""A picture that came as JPEG has more than this against its own source."""

LOOK_KEYS = {
    "d": "disparity",
    "l": "layers",
    "p": "provenance",
    "x": "difference",
    "a": "anaglyph",
    "s": "side-by-side",
    "n": "mosaic",
    "v": "picture",
}


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_original(tmp_path_factory.mktemp("browser") / "original")


@pytest.fixture(scope="module")
def file(original: Path) -> Path:
    return encode(original, original.parent / "room.mcap")


@pytest.fixture(scope="module")
def server(file: Path, original: Path) -> Iterator[Running]:
    with playing(file, "--original", original) as running:
        yield running


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        yield found
        found.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page whose errors fail the test, and whose requests must stay on this machine."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    troubles: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: troubles.append(request.url) if is_foreign(request.url) else None)
    yield page
    page.close()
    assert troubles == []


def is_foreign(url: str) -> bool:
    return not url.startswith(("http://127.0.0.1:", "ws://127.0.0.1:", "blob:http://127.0.0.1:"))


def show(page: Page, server: Running, link: str = "") -> None:
    page.goto(server.url + link)
    page.wait_for_selector("body[data-frame]")


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


def test_loads_and_shows_the_middle(page: Page, server: Running, file: Path) -> None:
    show(page, server)
    assert on_screen(page) == (0, 1.0, 1.0)
    assert psnr(rendered(file, 0, 1, 1), pixels(page)) > SAME_DB
    assert page.inner_text("#frame") == f"frame 0 of {FRAMES - 1}"
    assert page.inner_text("#time") == "0.000 s"
    assert page.inner_text("#viewpoint") == "view 1.00, 1.00"
    assert page.locator("#map .real").count() == 4
    for part in ("fps", "decode", "synthesis", "transfer", "dropped"):
        assert part in page.inner_text("#stats")
    box = box_of(page, "canvas")
    assert (box["width"], box["height"]) == (1280, 720)
    screenshot(page, "picture")


def test_steps_exactly_one_frame(page: Page, server: Running, file: Path) -> None:
    show(page, server)
    for key, frame in ((".", 1), (".", 2), (",", 1), ("End", FRAMES - 1), (",", FRAMES - 2), ("Home", 0)):
        page.keyboard.press(key)
        shows(page, frame=frame)
        own, next_one = (rendered(file, number, 1, 1) for number in (frame, (frame + 1) % FRAMES))
        assert psnr(own, pixels(page)) > max(SAME_DB, psnr(next_one, pixels(page)))
    page.mouse.move(640, 300)
    page.mouse.wheel(0, 120)
    shows(page, frame=2)
    page.click("#back")
    shows(page, frame=1)
    page.locator("#timeline").fill("7")
    shows(page, frame=7)


def test_plays_loops_and_pauses(page: Page, server: Running) -> None:
    show(page, server)
    page.keyboard.press("o")
    page.keyboard.press("-")  # slow enough for the waits below to see each frame
    page.keyboard.press(" ")
    page.wait_for_selector("#play[aria-pressed=true]")
    page.wait_for_selector("#loop[aria-pressed=true]")
    assert page.input_value("#speed") == "0.5"
    for frame in (FRAMES - 3, 2):  # the second one is behind the first only after a loop
        page.wait_for_selector(f"body[data-frame='{frame}'], body[data-frame='{frame + 1}']")
    page.keyboard.press(" ")
    page.wait_for_selector("#play[aria-pressed=false]")
    page.wait_for_timeout(150)
    before = on_screen(page)
    page.wait_for_timeout(300)
    assert on_screen(page) == before


def test_dragging_shows_what_the_library_renders_there(page: Page, server: Running, file: Path) -> None:
    show(page, server)
    page.mouse.move(640, 300)
    page.mouse.down()
    page.mouse.move(500, 360, steps=6)
    page.wait_for_timeout(100)
    page.mouse.up()
    # The scene follows the pointer, so that the viewpoint goes the other way; the picture is 1080 x 720.
    row, col = 1 - 60 / 720 * 2, 1 + 140 / 1080 * 2
    frame, shown_row, shown_col = settle(page)
    assert (shown_row, shown_col) == pytest.approx((row, col), abs=1e-6)
    assert frame == 0
    there = psnr(rendered(file, 0, shown_row, shown_col), pixels(page))
    assert there > max(SAME_DB, psnr(rendered(file, 0, 1, 1), pixels(page)))


def settle(page: Page) -> tuple[int, float, float]:
    """What is on the screen once it has stopped changing."""
    last = None
    while last != (last := on_screen(page)):
        page.wait_for_timeout(300)
    shows(page, scale=1)
    return last


def test_moves_by_keys_and_on_the_map(page: Page, server: Running) -> None:
    show(page, server)
    page.keyboard.press("ArrowRight")
    shows(page, col=1.25)
    page.keyboard.press("Shift+ArrowUp")
    shows(page, row=0, col=1.25)
    page.keyboard.press("g")
    shows(page, row=0, col=1)
    box = box_of(page, "#map")
    page.mouse.click(box["x"] + box["width"] - 2, box["y"] + box["height"] - 2)
    shows(page, row=2, col=2)
    assert page.get_attribute("#map", "aria-valuetext") == "row 2.00, column 2.00"


@pytest.mark.parametrize(("key", "look"), LOOK_KEYS.items())
def test_every_look_has_a_key(page: Page, server: Running, key: str, look: str) -> None:
    assert set(LOOK_KEYS.values()) == set(LOOKS)
    show(page, server, "#look=disparity" if look == "picture" else "")
    before = pixels(page)
    page.keyboard.press(key)
    shows(page, look=look)
    after = pixels(page)
    assert after.shape != before.shape or psnr(before, after) < 30
    assert page.is_visible("#legend") == (look != "picture")
    assert page.is_visible("#eyes") == (look in ("anaglyph", "side-by-side", "mosaic"))
    assert page.input_value("#look") == look
    screenshot(page, f"look-{look}")
    if look == "disparity":
        assert "px" in page.inner_text("#legend")
    if look == "provenance":
        assert "filled" in page.inner_text("#legend")
    if look == "side-by-side":
        page.keyboard.press("]")
        page.wait_for_selector("#legend :text('0.55 apart')")


def test_measures_against_the_original(page: Page, server: Running) -> None:
    show(page, server)
    page.keyboard.press("m")
    page.wait_for_selector("#quality :text('dB'), #quality:has-text('dB')")
    assert "SSIM" in page.inner_text("#quality")
    page.keyboard.press("ArrowLeft")
    page.wait_for_selector("#quality:has-text('no original')")


def test_help_and_hidden_controls(page: Page, server: Running) -> None:
    show(page, server)
    page.keyboard.press("?")
    page.wait_for_selector("#help[open]")
    for text in ("one frame on", "disparity", "full screen", "nine views"):
        assert text in page.inner_text("#help")
    screenshot(page, "help")
    page.keyboard.press("Escape")
    page.wait_for_selector("#help:not([open])", state="attached")
    page.keyboard.press("h")
    assert not page.is_visible("#controls")
    assert page.is_visible("#readout")
    page.keyboard.press("h")
    page.keyboard.press("f")
    page.wait_for_selector("#fullscreen[aria-pressed=true]")


def test_a_link_shows_the_same_picture(page: Page, browser: Browser, server: Running) -> None:
    show(page, server, "#frame=7&view=0.5,1.25&look=anaglyph&eyes=0.3")
    assert on_screen(page) == (7, 0.5, 1.25)
    page.keyboard.press(".")
    page.keyboard.press("ArrowRight")
    shows(page, frame=8, col=1.5)
    page.wait_for_timeout(500)
    assert page.url.endswith("#frame=8&view=0.5,1.5&look=anaglyph&eyes=0.3")
    other = browser.new_page(viewport={"width": 1280, "height": 720})
    other.goto(page.url)
    shows(other, frame=8, row=0.5, col=1.5, look="anaglyph")
    np.testing.assert_array_equal(pixels(other), pixels(page))
    other.close()
    page.goto(server.url + "#frame=2&view=2,0")
    shows(page, frame=2, row=2, col=0, look="picture")


def test_damage_is_told_and_playback_goes_on(page: Page, file: Path, tmp_path: Path) -> None:
    with playing(damage(file, tmp_path / "damaged.mcap", gop=1)) as running:
        show(page, running, f"#frame={GOP}")
        page.wait_for_selector("#notice:has-text('cannot be decoded')")
        assert "until" in page.inner_text("#notice")
        screenshot(page, "damage")
        page.click("#notice-close")
        page.keyboard.press(" ")
        shows(page, frame=FRAMES - 1)


def test_the_server_goes_and_comes_back(page: Page, file: Path) -> None:
    with playing(file) as running:
        show(page, running, "#frame=3&view=0,0.5")
        port = running.port
    page.wait_for_selector("#connection:has-text('gone')")
    screenshot(page, "server-gone")
    page.keyboard.press("Shift+ArrowDown")
    with playing(file, port=port):
        page.wait_for_selector("#connection", state="hidden")
        shows(page, frame=3, row=1, col=0.5)


def test_two_viewers_watch_their_own_pictures(
    page: Page, browser: Browser, server: Running, file: Path
) -> None:
    show(page, server, "#frame=2&view=0,0")
    other = browser.new_page(viewport={"width": 1280, "height": 720})
    show(other, server, "#frame=9&view=2,1.5")
    other.keyboard.press(",")
    shows(other, frame=8)
    page.keyboard.press(".")
    shows(page, frame=3)
    assert on_screen(other) == (8, 2.0, 1.5)
    assert psnr(rendered(file, 8, 2, 1.5), pixels(other)) > SAME_DB
    assert psnr(rendered(file, 3, 0, 0), pixels(page)) > SAME_DB
    other.close()


@pytest.mark.parametrize(("width", "height"), [(320, 568), (390, 844), (844, 390)])
def test_fits_a_phone(page: Page, server: Running, width: int, height: int) -> None:
    page.set_viewport_size({"width": width, "height": height})
    show(page, server, "#look=anaglyph")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for name in ("#readout", "#play", "#timeline", "#look", "#eyes", "#map", "#open-help"):
        box = box_of(page, name)
        assert box["x"] >= 0, name
        assert box["x"] + box["width"] <= width, name
        assert box["y"] + box["height"] <= height, name
    screenshot(page, f"phone-{width}x{height}")


def test_controls_are_labelled_and_show_the_focus(page: Page, server: Running) -> None:
    show(page, server)
    controls = page.locator("button:visible, select:visible, input:visible, #map, #stage")
    for number in range(controls.count()):
        control = controls.nth(number)
        name = control.evaluate("e => e.ariaLabel || e.innerText || (e.labels && e.labels[0]?.innerText)")
        assert name, control.evaluate("e => e.outerHTML")
    for _ in range(4):
        page.keyboard.press("Tab")
        outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
        assert outline == "solid"
