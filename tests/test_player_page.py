"""The page around the picture in a real Chromium: help, damage, a lost server, phones, labels, two viewers.

Skips where there is no Chromium (Debian: apt install chromium).
"""

from __future__ import annotations

from pathlib import Path

import pytest
from browser_page import (
    CHROMIUM,
    NO_CHROMIUM,
    SAME_DB,
    box_of,
    on_screen,
    pixels,
    rendered,
    screenshot,
    show,
    shows,
)
from player_files import FRAMES, GOP, Running, damage, encode, playing, write_original
from playwright.sync_api import Browser, Page

from mvcodec.evaluation.metrics import psnr

pytest_plugins = ("browser_fixtures",)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)


def test_help_and_full_screen(page: Page, server: Running) -> None:
    show(page, server)
    page.keyboard.press("?")
    page.wait_for_selector("#help[open]")
    for text in ("one frame back, on", "what is shown", "full screen", "nine views"):
        assert text in page.inner_text("#help")
    screenshot(page, "help")
    page.keyboard.press("Escape")
    page.wait_for_selector("#help:not([open])", state="attached")
    page.keyboard.press("f")
    page.wait_for_selector("#fullscreen[aria-pressed=true]")


def test_keys_before_the_server_has_spoken_do_nothing(page: Page, server: Running) -> None:
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.route_web_socket("**/view", lambda _: None)  # accepted, and silent
    page.goto(server.url)
    for key in ("ArrowLeft", "g", "]", "+", "a", "e", "v", "p", "Home", " ", "m"):
        page.keyboard.press(key)
    assert page.is_hidden("#notice")
    page.keyboard.press("?")
    page.wait_for_selector("#help[open]")
    assert errors == []


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
    page: Page, chromium: Browser, server: Running, file: Path
) -> None:
    show(page, server, "#frame=2&view=0,0")
    other = chromium.new_page(viewport={"width": 1280, "height": 720}, reduced_motion="reduce")
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
    page.click("#open-help")
    assert page.evaluate("document.getElementById('help').scrollTop") == 0
    assert box_of(page, "#help button")["y"] + box_of(page, "#help button")["height"] <= height


@pytest.mark.parametrize("grid", [(3, 1), (1, 4)])
def test_the_map_of_one_line_of_cameras_stays_small(
    page: Page, tmp_path: Path, grid: tuple[int, int]
) -> None:
    file = encode(write_original(tmp_path / "original", grid, frames=1), tmp_path / "line.mcap")
    with playing(file) as running:
        show(page, running)
        box = box_of(page, "#map")
        assert 20 < min(box["width"], box["height"]) < max(box["width"], box["height"]) < 130
        rows, cols = grid
        page.mouse.click(box["x"] + box["width"] - 2, box["y"] + box["height"] - 2)
        shows(page, row=rows - 1, col=cols - 1)
        screenshot(page, f"map-{rows}x{cols}")


def test_a_picture_that_cannot_be_drawn_is_told_and_the_next_one_is_drawn(
    page: Page, server: Running
) -> None:
    show(page, server)
    page.evaluate("""() => {
        const whole = window.createImageBitmap;
        window.createImageBitmap = () => {
            window.createImageBitmap = whole;
            return Promise.reject(new Error("a broken picture"));
        };
    }""")
    page.keyboard.press(".")
    page.wait_for_selector("#notice:has-text('a broken picture')")
    page.keyboard.press(".")
    shows(page, frame=2)


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
