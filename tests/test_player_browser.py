"""Watching what a server renders, in a real Chromium: what a viewer does, and what is then on the screen.

The page is the one that also decodes by itself (`test_web_player.py`, `test_web_menu.py`): here is what
depends on who draws. Skips where there is no Chromium (Debian: apt install chromium). Screenshots of the main
states are left in build/screenshots, to be looked at.
"""

from __future__ import annotations

import io
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from browser_page import (
    CHROMIUM,
    NO_CHROMIUM,
    SAME_DB,
    comes_to,
    drop,
    pixels_of,
    rendered,
    screenshot,
    set_slider,
    settled,
    show,
    shown,
    toggle_menu,
    waits_for,
)
from player_files import FRAMES, Running
from playwright.sync_api import Page, expect

from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import Picture
from mvcodec.player.looks import EYES, LOOKS

pytest_plugins = ("browser_fixtures",)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)

MIDDLE = "?view=1,1"
OTHER = Path(__file__).parent / "conformance" / "odd_size.mcap"


def test_it_shows_the_view_of_its_address_and_says_what_it_does(
    page: Page, server: Running, file: Path
) -> None:
    show(page, server)
    assert (shown(page)["frame"], shown(page)["view"]) == (0, {"row": 1, "col": 1})
    assert psnr(rendered(file, 0, 1, 1), pixels_of(page)) > SAME_DB
    expect(page.locator(".time")).to_have_text("0:00.0 / 0:00.5")
    show(page, server, "?view=0.5,1.25&t=0.3")
    assert (shown(page)["frame"], shown(page)["view"]) == (7, {"row": 0.5, "col": 1.25})
    assert psnr(rendered(file, 7, 0.5, 1.25), pixels_of(page)) > SAME_DB
    page.keyboard.press("i")
    for part in ("frame    7", "0.5,1.25", "layered", "/s", "synthesis", "dropped"):
        expect(page.locator(".stats")).to_contain_text(part)
    page.keyboard.press("i")


def test_steps_exactly_one_frame(page: Page, server: Running, file: Path) -> None:
    show(page, server, MIDDLE)
    for key, frame in ((".", 1), (".", 2), (",", 1), ("End", FRAMES - 1), (",", FRAMES - 2), ("Home", 0)):
        page.keyboard.press(key)
        comes_to(page, frame, 1, 1)
        own, next_one = (rendered(file, number, 1, 1) for number in (frame, (frame + 1) % FRAMES))
        assert psnr(own, pixels_of(page)) > max(SAME_DB, psnr(next_one, pixels_of(page)))
    page.get_by_label("Time", exact=True).fill("291")  # ms: the last frame at or before it
    waits_for(page, "shown.frame === 6")


def test_it_plays_loops_and_pauses_and_what_lies_between_two_marks_over_and_over(
    page: Page, server: Running
) -> None:
    show(page, server, f"{MIDDLE}&t=0.125")
    page.keyboard.press("-")  # slow enough for the waits below to see frames of each half
    page.keyboard.press(" ")
    waits_for(page, "shown.isPlaying && shown.speed === 0.5")
    waits_for(page, f"shown.frame >= {FRAMES // 2}")
    waits_for(page, f"shown.frame < {FRAMES // 2}")  # it began again
    page.keyboard.press(" ")
    waits_for(page, "!shown.isPlaying")
    page.evaluate("document.querySelector('mvcodec-player').seek(3)")
    page.keyboard.press("a")
    page.evaluate("document.querySelector('mvcodec-player').seek(5)")
    page.keyboard.press("b")
    expect(page.locator(".section")).to_be_visible()
    page.evaluate("""() => {
        window.seen = [];
        document.querySelector("mvcodec-player").addEventListener("frame", (event) => {
            window.seen.push(event.detail.frame);
        });
    }""")
    page.keyboard.press(" ")
    page.wait_for_function("() => window.seen.length > 5")
    page.keyboard.press(" ")
    assert set(page.evaluate("window.seen")) <= {3, 4, 5}


def test_dragging_and_keys_show_what_the_library_renders_there(
    page: Page, server: Running, file: Path
) -> None:
    show(page, server, MIDDLE)
    page.mouse.move(640, 300)
    page.mouse.down()
    page.mouse.move(500, 360, steps=6)
    page.mouse.up()
    # What is under the pointer goes with it, so that the viewpoint goes the other way.
    row, col = 1 - 60 / 720 * 2.4, 1 + 140 / 1280 * 2.4
    comes_to(page, 0, row, col)
    there = psnr(rendered(file, 0, row, col), pixels_of(page))
    assert there > max(SAME_DB, psnr(rendered(file, 0, 1, 1), pixels_of(page)))
    page.keyboard.press("g")
    comes_to(page, 0, 1, 1)
    page.keyboard.press("ArrowRight")
    comes_to(page, 0, 1, 1.25)
    page.keyboard.press("Shift+ArrowUp")
    comes_to(page, 0, 0, 1.25)
    box = page.locator(".map svg").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] - 2, box["y"] + box["height"] - 2)
    comes_to(page, 0, 2, 2)
    assert page.locator(".map svg").get_attribute("aria-valuetext") == "row 2.00, column 2.00"


def test_the_wheel_moves_ahead_and_back(page: Page, server: Running) -> None:
    show(page, server, MIDDLE)
    before = pixels_of(page)
    page.mouse.move(640, 300)
    page.mouse.wheel(0, -600)
    waits_for(page, "shown.dolly > 0")
    settled(page)
    screenshot(page, "ahead")
    assert psnr(before, pixels_of(page)) < 30
    page.mouse.wheel(0, 2000)
    waits_for(page, "shown.dolly === 0")
    settled(page)
    assert psnr(before, pixels_of(page)) > SAME_DB


def test_the_view_follows_the_pointer_where_that_is_wanted_and_tells_what_is_under_it(
    page: Page, server: Running
) -> None:
    show(page, server, MIDDLE)
    page.keyboard.press("v")
    settled(page)
    page.mouse.move(500, 300)
    expect(page.locator(".probe")).to_contain_text("px, ")
    assert shown(page)["view"] == {"row": 1, "col": 1}, "each view costs the server a picture"
    page.keyboard.press("h")
    page.mouse.move(370, 360)
    comes_to(page, 0, 1, 1 + (370 / 1280 - 0.5) * 0.6)
    screenshot(page, "probe")
    page.keyboard.press("h")


def sharpness(picture: Picture) -> float:
    return float(cv2.Laplacian(picture.astype(np.float32), cv2.CV_32F).std())


def test_the_divider_and_the_focus(page: Page, server: Running) -> None:
    show(page, server, MIDDLE)
    picture = pixels_of(page)
    half = picture.shape[1] // 2
    page.keyboard.press("v")
    settled(page)
    look = pixels_of(page)
    toggle_menu(page)
    set_slider(page, "Compare with the picture", "0.5")
    settled(page)
    both = pixels_of(page)
    assert psnr(picture[:, : half - 8], both[:, : half - 8]) > SAME_DB
    assert psnr(look[:, half + 8 :], both[:, half + 8 :]) > SAME_DB
    page.get_by_label("Show").select_option("picture")
    set_slider(page, "Focus", "100")  # on what is nearest: the wall behind blurs
    settled(page)
    screenshot(page, "focus")
    assert sharpness(pixels_of(page)) < 0.7 * sharpness(picture)
    set_slider(page, "Focus", "0")
    toggle_menu(page)
    settled(page)
    assert psnr(picture, pixels_of(page)) > SAME_DB


def test_a_key_shows_one_look_after_the_other_each_with_its_legend(page: Page, server: Running) -> None:
    show(page, server, MIDDLE)
    for look in (*list(LOOKS)[1:], "picture"):
        before = pixels_of(page)
        page.keyboard.press("v")
        waits_for(page, f"shown.look === '{look}'")
        settled(page)
        assert psnr(before, pixels_of(page)) < 30
        legend = page.locator(".legend")
        assert legend.is_visible() == (look != "picture")
        screenshot(page, f"look-{look}")
        if look == "disparity":
            assert "px" in legend.inner_text()
        if look == "provenance":
            assert "filled" in legend.inner_text()
            assert "%" in legend.inner_text()
        if look == "difference":
            assert "dB PSNR" in legend.inner_text()
            assert "SSIM" in legend.inner_text()


def test_a_key_shows_several_views_in_the_look_that_there_is(page: Page, server: Running) -> None:
    show(page, server, MIDDLE)
    page.keyboard.press("v")
    settled(page)
    one = pixels_of(page)
    for eyes, size in (("side by side", (1, 2)), ("anaglyph", (1, 1)), ("nine", (3, 3))):
        page.keyboard.press("e")
        waits_for(page, f"shown.eyes === '{eyes}'")
        settled(page)
        several = pixels_of(page)
        assert several.shape[:2] == (one.shape[0] * size[0], one.shape[1] * size[1])
        screenshot(page, f"eyes-{eyes}")
        if eyes == "side by side":
            page.keyboard.press("]")
            settled(page)
            assert psnr(several, pixels_of(page)) < 40
    assert eyes == list(EYES)[-1]
    page.keyboard.press("e")
    waits_for(page, "shown.eyes === 'one'")
    settled(page)
    assert psnr(one, pixels_of(page)) > SAME_DB


def test_the_difference_is_to_the_original_of_the_nearest_place(page: Page, server: Running) -> None:
    show(page, server, "?view=0.6,1.4")
    page.get_by_label("Show").select_option("difference")
    settled(page)
    assert shown(page)["view"] == {"row": 1, "col": 1}
    difference = pixels_of(page)
    page.keyboard.press("g")
    settled(page)
    assert np.array_equal(pixels_of(page), difference)


def test_the_bar_shows_a_small_picture_and_a_clip_and_the_picture_are_saved(
    page: Page, server: Running
) -> None:
    show(page, server, MIDDLE)
    bar = page.get_by_label("Time", exact=True).bounding_box()
    assert bar is not None
    for step in range(2):  # the controls may have hidden by now: the first one wakes them
        page.mouse.move(bar["x"] + 600 + step, bar["y"] + 10)
    expect(page.locator(".peek canvas")).to_be_visible()
    screenshot(page, "thumbnail")
    width, mean = page.locator(".peek canvas").evaluate("""(canvas) => {
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        return [canvas.width, data.reduce((sum, value) => sum + value, 0) / data.length];
    }""")
    assert width == 160
    assert mean > 80  # alpha alone makes 64
    with page.expect_download() as download:
        page.keyboard.press("p")
    assert download.value.suggested_filename == "room-0.png"
    toggle_menu(page)
    with page.expect_download() as download:
        page.get_by_text("Save clip").dispatch_event("click")
    with av.open(io.BytesIO(Path(download.value.path()).read_bytes()), "r") as container:
        pictures = [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]
    assert len(pictures) >= 2
    assert np.mean(pictures[-1]) > 20


def test_a_clip_of_which_nothing_was_recorded_is_not_saved(page: Page, server: Running) -> None:
    show(page, server, MIDDLE)
    page.evaluate("""() => {
        window.MediaRecorder = class {
            static isTypeSupported() { return true; }
            start() {}
            stop() { this.onstop(); }
        };
    }""")
    toggle_menu(page)
    page.get_by_text("Save clip").dispatch_event("click")
    expect(page.get_by_text("The browser recorded nothing")).to_be_visible(timeout=20_000)


def test_another_file_is_decoded_by_the_page(page: Page, server: Running) -> None:
    show(page, server, MIDDLE)
    before = pixels_of(page).shape
    drop(page, OTHER)
    assert pixels_of(page).shape != before
    assert shown(page)["count"] != FRAMES
    page.keyboard.press("v")
    waits_for(page, "shown.look === 'disparity'")
