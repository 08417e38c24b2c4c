"""The page beside its server in a real Chromium: damage, a lost server, phones, labels, two viewers.

Skips where there is no Chromium (Debian: apt install chromium).
"""

from __future__ import annotations

from pathlib import Path

import pytest
from browser_page import (
    CHROMIUM,
    NO_CHROMIUM,
    SAME_DB,
    comes_to,
    pixels_of,
    rendered,
    screenshot,
    show,
    shown,
    toggle_menu,
    waits_for,
)
from player_files import FRAMES, GOP, Running, damage, encode, playing, write_original
from playwright.sync_api import Browser, FloatRect, Page, expect

from mvcodec.evaluation.metrics import psnr

pytest_plugins = ("browser_fixtures",)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)


def box_of(page: Page, selector: str) -> FloatRect:
    box = page.locator(selector).bounding_box()
    assert box is not None, f"{selector} is not visible"
    return box


def test_damage_is_told_once_and_playback_goes_on(page: Page, file: Path, tmp_path: Path) -> None:
    with playing(damage(file, tmp_path / "damaged.mcap", gop=1)) as running:
        show(page, running, f"?t={GOP / 24 + 0.001}")
        notice = page.get_by_role("alert")
        expect(notice).to_contain_text("cannot be decoded")
        expect(notice).to_contain_text("until")
        screenshot(page, "damage")
        notice.get_by_label("Dismiss").click()
        page.keyboard.press(".")
        waits_for(page, f"shown.frame === {GOP + 1}")
        expect(notice).to_be_hidden()
        page.keyboard.press(" ")
        waits_for(page, f"shown.frame === {FRAMES - 1}")


def test_the_server_goes_and_comes_back(page: Page, file: Path) -> None:
    with playing(file) as running:
        show(page, running, "?view=0,0.5&t=0.126")
        port = running.port
    wait = page.locator(".wait")
    expect(wait).to_contain_text("gone")
    screenshot(page, "server-gone")
    page.keyboard.press("Shift+ArrowDown")
    with playing(file, port=port):
        expect(wait).to_be_hidden(timeout=60_000)
        comes_to(page, 3, 2, 0.5)


def test_keys_before_the_server_has_spoken_do_nothing(chromium: Browser, server: Running) -> None:
    page = chromium.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.route_web_socket("**/view", lambda _: None)  # accepted, and silent
    page.goto(server.url)
    for key in ("ArrowLeft", "g", "]", "+", "a", "e", "v", "p", "c", "Home", " ", ".", "w", "h", "i"):
        page.keyboard.press(key)
    expect(page.get_by_role("alert")).to_be_hidden()
    expect(page.locator(".wait")).to_be_visible()
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_contain_text("nine views")
    assert errors == []
    page.close()


def test_two_viewers_watch_their_own_pictures(
    page: Page, chromium: Browser, server: Running, file: Path
) -> None:
    show(page, server, "?view=0,0&t=0.084")
    other = chromium.new_page(viewport={"width": 1280, "height": 720}, reduced_motion="reduce")
    show(other, server, "?view=2,1.5&t=0.376")
    other.keyboard.press(",")
    comes_to(other, 8, 2, 1.5)
    page.keyboard.press(".")
    comes_to(page, 3, 0, 0)
    assert shown(other)["frame"] == 8
    assert psnr(rendered(file, 8, 2, 1.5), pixels_of(other)) > SAME_DB
    assert psnr(rendered(file, 3, 0, 0), pixels_of(page)) > SAME_DB
    other.close()


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
    expect(page.get_by_role("alert")).to_contain_text("a broken picture")
    page.keyboard.press(".")
    waits_for(page, "shown.frame === 2")


@pytest.mark.parametrize(("width", "height"), [(320, 568), (390, 800), (844, 390), (2560, 1440)])
def test_everything_fits_any_screen(page: Page, server: Running, width: int, height: int) -> None:
    size = page.viewport_size
    page.set_viewport_size({"width": width, "height": height})
    show(page, server)
    page.keyboard.press("e")
    toggle_menu(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for name in (".controls", ".track", ".menu", ".map svg", ".time"):
        box = box_of(page, name)
        assert box["x"] >= 0, name
        assert box["y"] >= 0, name
        assert box["x"] + box["width"] <= width, name
        assert box["y"] + box["height"] <= height, name
    map_box, bar = box_of(page, ".map"), box_of(page, ".controls .row")
    assert map_box["y"] + map_box["height"] <= bar["y"], "the map covers no control"
    screenshot(page, f"screen-{width}x{height}")
    page.keyboard.press("?")
    help_box = box_of(page, "dialog")
    assert help_box["y"] >= 0
    assert help_box["y"] + help_box["height"] <= height
    assert size is not None
    page.set_viewport_size(size)


@pytest.mark.parametrize("grid", [(3, 1), (1, 4)])
def test_the_map_of_one_line_of_cameras_stays_small(
    page: Page, tmp_path: Path, grid: tuple[int, int]
) -> None:
    file = encode(write_original(tmp_path / "original", grid, frames=1), tmp_path / "line.mcap")
    with playing(file) as running:
        show(page, running)
        box = box_of(page, ".map svg")
        assert 15 < min(box["width"], box["height"]) < max(box["width"], box["height"]) < 130
        rows, cols = grid
        page.mouse.click(box["x"] + box["width"] - 2, box["y"] + box["height"] - 2)
        comes_to(page, 0, rows - 1, cols - 1)
        screenshot(page, f"map-{rows}x{cols}")


def test_controls_are_labelled_and_show_the_focus(page: Page, server: Running) -> None:
    show(page, server)
    toggle_menu(page)
    controls = page.locator("button:visible, select:visible, input:visible, .map svg, .stage")
    assert controls.count() > 10
    for number in range(controls.count()):
        control = controls.nth(number)
        name = control.evaluate("e => e.ariaLabel || e.innerText || (e.labels && e.labels[0]?.innerText)")
        assert name, control.evaluate("e => e.outerHTML")
    focused = "document.querySelector('mvcodec-player').shadowRoot.activeElement"
    for _ in range(4):
        page.keyboard.press("Tab")
        assert page.evaluate(f"getComputedStyle({focused}).outlineStyle") == "solid"
    screenshot(page, "focus-of-the-keyboard")
