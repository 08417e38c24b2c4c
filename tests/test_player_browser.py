"""Watching in a real Chromium: what a viewer does, and what is then on the screen.

Skips where there is no Chromium (Debian: apt install chromium). Screenshots of the main states are left in
build/screenshots, to be looked at.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from browser_page import (
    CHROMIUM,
    FIRST_PICTURE_MS,
    NO_CHROMIUM,
    SAME_DB,
    box_of,
    comes_to,
    on_screen,
    pixels,
    rendered,
    screenshot,
    show,
    shows,
    stands_still,
)
from player_files import FRAMES, Running
from playwright.sync_api import Browser, Page

from mvcodec.evaluation.metrics import psnr
from mvcodec.player.looks import LOOKS

pytest_plugins = ("browser_fixtures",)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)

STILL_MS = 1000  # several frames at half speed
LOOKS_BY_KEY = {
    "v": ("disparity", "layers", "provenance", "difference", "picture"),
    "e": ("anaglyph", "side-by-side", "mosaic", "picture"),
}
"""What each press of a key shows."""


def test_loads_and_shows_the_middle(page: Page, server: Running, file: Path) -> None:
    show(page, server)
    assert on_screen(page) == (0, 1.0, 1.0)
    assert psnr(rendered(file, 0, 1, 1), pixels(page)) > SAME_DB
    assert page.inner_text("#time") == "0:00.0 / 0:00.5"
    assert page.locator("#map .real").count() == 4
    assert page.is_hidden("#stats")
    page.keyboard.press("i")
    for part in (
        "frame 0",
        "0.000 s",
        "view 1.00, 1.00",
        "fps",
        "decode",
        "synthesis",
        "transfer",
        "dropped",
    ):
        assert part in page.inner_text("#stats")
    page.keyboard.press("i")
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
    page.keyboard.press("l")
    shows(page, frame=2)
    page.click("#back")
    shows(page, frame=1)
    page.locator("#timeline").fill("7")
    shows(page, frame=7)


def test_plays_loops_and_pauses(page: Page, server: Running) -> None:
    show(page, server)
    page.keyboard.press("r")
    page.keyboard.press("-")  # slow enough for the waits below to see frames of each half
    page.keyboard.press(" ")
    page.wait_for_selector("#play[aria-pressed=true]", state="attached")
    page.wait_for_selector("#loop[aria-pressed=true]")
    assert page.input_value("#speed") == "0.5"
    half = FRAMES // 2
    for frames in (
        range(half, FRAMES),
        range(half),
    ):  # the second ones are behind the first only after a loop
        page.wait_for_selector(", ".join(f"body[data-frame='{frame}']" for frame in frames))
    page.keyboard.press(" ")
    page.wait_for_selector("#play[aria-pressed=false]", state="attached")
    stands_still(page, STILL_MS)


def test_what_lies_between_two_marks_is_played_over_and_over(page: Page, server: Running) -> None:
    show(page, server, "#frame=3&view=1,1")
    page.keyboard.press("a")
    page.locator("#timeline").fill("5")
    shows(page, frame=5)
    page.keyboard.press("b")
    page.wait_for_selector("#section", state="visible")
    page.evaluate("""() => {
        window.seen = [];
        const note = () => window.seen.push(Number(document.body.dataset.frame));
        new MutationObserver(note).observe(document.body, { attributeFilter: ["data-frame"] });
    }""")
    page.keyboard.press(" ")
    page.wait_for_function("() => window.seen.length > 5")
    page.keyboard.press(" ")
    assert set(page.evaluate("window.seen")) <= {3, 4, 5}


def test_it_sways_until_somebody_touches_it_and_has_the_colours_of_the_system(
    chromium: Browser, server: Running
) -> None:
    page = chromium.new_page(viewport={"width": 1280, "height": 720}, color_scheme="light")
    show(page, server)
    page.wait_for_function("() => Number(document.body.dataset.col) > 1.05")
    dark = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.emulate_media(color_scheme="dark")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != dark
    page.keyboard.press(".")
    stands_still(page, STILL_MS)
    page.close()


def test_it_says_how_to_look_around_and_a_click_plays(page: Page, server: Running) -> None:
    page.goto(server.url)
    page.wait_for_selector("#hint:has-text('Drag to look around')", timeout=FIRST_PICTURE_MS)
    page.wait_for_selector("#big")
    assert page.is_hidden("#wait")
    # The file is short: on a busy machine it may have ended before anybody looks again.
    page.evaluate("""() => {
        const note = (changes) => (document.body.dataset.played = changes[0].target.ariaPressed);
        const play = document.getElementById("play");
        new MutationObserver(note).observe(play, { attributeFilter: ["aria-pressed"] });
    }""")
    page.mouse.click(640, 200)
    page.wait_for_selector("body[data-played]", state="attached")
    assert page.is_hidden("#hint")
    assert page.is_hidden("#big")
    page.keyboard.press("k")
    page.wait_for_selector("#play[aria-pressed=false]", state="attached")
    page.wait_for_selector("body.idle")
    page.mouse.move(600, 210)
    page.wait_for_selector("body:not(.idle)")


def test_dragging_shows_what_the_library_renders_there(page: Page, server: Running, file: Path) -> None:
    show(page, server)
    page.mouse.move(640, 300)
    page.mouse.down()
    page.mouse.move(500, 360, steps=6)
    page.mouse.up()
    # The scene follows the pointer, so that the viewpoint goes the other way; the picture is 1080 x 720.
    row, col = 1 - 60 / 720 * 2, 1 + 140 / 1080 * 2
    comes_to(page, 0, row, col)
    there = psnr(rendered(file, 0, row, col), pixels(page))
    assert there > max(SAME_DB, psnr(rendered(file, 0, 1, 1), pixels(page)))


def test_a_finger_drags_as_the_mouse_does(page: Page, server: Running) -> None:
    show(page, server)
    finger = page.context.new_cdp_session(page)
    for kind, x in (("touchStart", 640), ("touchMove", 600), ("touchMove", 500)):
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": 300}]})
    finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    comes_to(page, 0, 1, 1 + 140 / 1080 * 2)


def test_the_wheel_moves_ahead_and_back(page: Page, server: Running) -> None:
    show(page, server)
    before = pixels(page)
    page.mouse.move(640, 300)
    page.mouse.wheel(0, -600)
    page.wait_for_selector("body[data-dolly='0.5'][data-scale='1'][data-quick='false']")
    screenshot(page, "ahead")
    assert psnr(before, pixels(page)) < 30
    page.keyboard.press("s")
    page.wait_for_selector("body[data-dolly='0.3']")
    page.mouse.wheel(0, 2000)
    page.wait_for_selector("body[data-dolly='0'][data-scale='1'][data-quick='false']")
    assert psnr(before, pixels(page)) > SAME_DB


def test_the_divider_has_the_picture_on_its_left_and_the_look_on_its_right(
    page: Page, server: Running
) -> None:
    show(page, server)
    picture = pixels(page)
    assert page.is_hidden("#wipe")
    page.locator("#look").select_option("disparity")
    shows(page, look="disparity")
    look = pixels(page)
    page.locator("#wipe").fill("0.5")
    half = picture.shape[1] // 2
    page.wait_for_selector("body[data-wipe='0.5']")
    both = pixels(page)
    assert psnr(picture[:, : half - 8], both[:, : half - 8]) > SAME_DB
    assert psnr(look[:, half + 8 :], both[:, half + 8 :]) > SAME_DB


def test_the_view_follows_the_pointer_where_that_is_wanted_and_tells_what_is_under_it(
    page: Page, server: Running
) -> None:
    show(page, server, "#frame=0&view=1,1&look=disparity")
    page.mouse.move(500, 300)
    page.wait_for_selector("#probe:has-text('px, ')")
    assert on_screen(page) == (0, 1, 1)
    page.keyboard.press("h")
    page.mouse.move(370, 300)
    # The picture is 1080 x 720.
    comes_to(page, 0, 1 + (300 / 720 - 0.5) * 0.6, 1 + (370 - 640) / 1080 * 0.6)
    screenshot(page, "probe")
    page.keyboard.press("h")
    page.keyboard.press("g")
    comes_to(page, 0, 1, 1)
    page.mouse.move(0, 0)
    assert page.is_hidden("#probe")


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


@pytest.mark.parametrize("key", LOOKS_BY_KEY)
def test_a_key_shows_one_look_after_the_other(page: Page, server: Running, key: str) -> None:
    assert {look for looks in LOOKS_BY_KEY.values() for look in looks} == set(LOOKS)
    show(page, server)
    for look in LOOKS_BY_KEY[key]:
        shows_another_look(page, key, look)


def shows_another_look(page: Page, key: str, look: str) -> None:
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


def test_a_link_shows_the_same_picture(page: Page, chromium: Browser, server: Running) -> None:
    show(page, server, "#frame=7&view=0.5,1.25&look=anaglyph&eyes=0.3")
    assert on_screen(page) == (7, 0.5, 1.25)
    page.keyboard.press(".")
    page.keyboard.press("ArrowRight")
    shows(page, frame=8, col=1.5)
    page.wait_for_url("**#frame=8&view=0.5,1.5&look=anaglyph&eyes=0.3")
    other = chromium.new_page(viewport={"width": 1280, "height": 720}, reduced_motion="reduce")
    other.goto(page.url)
    shows(other, frame=8, row=0.5, col=1.5, look="anaglyph")
    np.testing.assert_array_equal(pixels(other), pixels(page))
    other.close()
    page.goto(server.url + "#frame=2&view=2,0")
    shows(page, frame=2, row=2, col=0, look="picture")
