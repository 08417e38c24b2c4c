"""What the page's player offers besides looking: files, links, pictures to keep, comparing, focus, touch."""

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
    drop,
    pixels_of,
    set_slider,
    settled,
    shown,
    toggle_menu,
    waits_for,
)
from numpy.typing import NDArray
from player_files import Running, decode_picture
from playwright.sync_api import Browser, Page, expect
from web_fixtures import SAMPLE, Site, open_player

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)

PAIRS = Path(__file__).parent / "conformance"
OTHER = PAIRS / "odd_size.mcap"


def canvas(page: Page) -> NDArray[np.int16]:
    """The upper part of the picture on the screen, which no controls cover, as signed numbers."""
    settled(page)
    shot = decode_picture(np.frombuffer(page.locator("canvas.picture").screenshot(), np.uint8))
    return shot[: shot.shape[0] * 2 // 5].astype(np.int16)


def test_a_file_that_is_dropped_is_shown(sample_page: Page) -> None:
    drop(sample_page, OTHER)
    assert pixels_of(sample_page).shape != (48, 64, 3)


def test_a_file_that_is_chosen_is_shown(sample_page: Page) -> None:
    toggle_menu(sample_page)
    with sample_page.expect_file_chooser() as chooser:
        sample_page.get_by_role("button", name="Open a file").dispatch_event("click")
    chooser.value.set_files(OTHER)
    waits_for(sample_page, "shown && shown.count !== 6")


def test_a_copied_link_leads_back_to_the_view_and_time(sample_page: Page) -> None:
    sample_page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    sample_page.evaluate("document.querySelector('mvcodec-player').look(0.5, 1.75)")
    sample_page.keyboard.press("c")
    expect(sample_page.get_by_role("alert")).to_contain_text("Link copied")
    link = sample_page.evaluate("navigator.clipboard.readText()")
    sample_page.goto("about:blank")
    sample_page.goto(link)
    sample_page.evaluate("document.querySelector('mvcodec-player').ready")
    waits_for(sample_page, "shown.frame === 2 && shown.view.row === 0.5 && shown.view.col === 1.75")


def test_a_saved_picture_is_the_view(sample_page: Page) -> None:
    sample_page.evaluate("document.querySelector('mvcodec-player').look(0.5, 0.5)")
    with sample_page.expect_download() as download:
        sample_page.keyboard.press("p")
    saved = decode_picture(np.frombuffer(Path(download.value.path()).read_bytes(), np.uint8))
    assert download.value.suggested_filename.endswith("-2.png")
    assert np.array_equal(saved, pixels_of(sample_page))


def test_a_saved_clip_is_a_video_of_the_loop(sample_page: Page) -> None:
    sample_page.keyboard.press("a")
    sample_page.keyboard.press("End")
    waits_for(sample_page, "shown.frame === 5")
    sample_page.keyboard.press("b")
    toggle_menu(sample_page)
    with sample_page.expect_download() as download:
        sample_page.get_by_text("Save clip").dispatch_event("click")
    with av.open(io.BytesIO(Path(download.value.path()).read_bytes()), "r") as container:
        pictures = [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]
    assert len(pictures) >= 2
    assert np.mean(pictures[-1]) > 20


def test_the_divider_has_the_picture_on_its_left_and_the_look_on_its_right(sample_page: Page) -> None:
    toggle_menu(sample_page)
    toggle_menu(sample_page)
    picture = canvas(sample_page)
    sample_page.get_by_label("Show").select_option("disparity")
    look = canvas(sample_page)
    toggle_menu(sample_page)
    set_slider(sample_page, "Compare with the picture", "0.5")
    toggle_menu(sample_page)
    both = canvas(sample_page)
    middle, margin = both.shape[1] // 2, 8
    assert abs(both[:, : middle - margin] - picture[:, : middle - margin]).mean() < 1
    assert abs(both[:, middle + margin :] - look[:, middle + margin :]).mean() < 1
    assert abs(picture - look).mean() > 10


def test_a_focus_blurs_what_is_elsewhere_and_goes_off_again(tab: Page, site: Site) -> None:
    site.put("room.mcap", (PAIRS.parents[1] / "samples" / "room_2x2.mcap").read_bytes())
    open_player(tab, site, "room.mcap")

    def sharpness_of_the_wall(picture: NDArray[np.int16]) -> float:
        width = picture.shape[1]
        wall = picture[:, width // 3 : 2 * width // 3].astype(np.float32)
        return float(cv2.Laplacian(wall, cv2.CV_32F).std())

    sharp = canvas(tab)
    toggle_menu(tab)
    set_slider(tab, "Focus", "100")  # on what is nearest
    blurred = canvas(tab)
    set_slider(tab, "Focus", "0")
    toggle_menu(tab)
    assert sharpness_of_the_wall(blurred) < 0.5 * sharpness_of_the_wall(sharp)
    assert abs(canvas(tab) - sharp).mean() < 1


def test_the_bar_shows_a_small_picture_of_the_time_under_the_pointer(sample_page: Page) -> None:
    box = sample_page.get_by_label("Time", exact=True).bounding_box()
    assert box is not None
    for step in range(2):  # the controls may have hidden by now: the first one wakes them
        sample_page.mouse.move(box["x"] + 200 + step, box["y"] + 10)
    expect(sample_page.locator(".peek canvas")).to_be_visible()
    expect(sample_page.locator(".peek")).to_contain_text("0:00.")
    sample_page.mouse.move(480, 100)
    expect(sample_page.locator(".peek")).to_be_hidden()


def test_two_fingers_move_ahead(sample_page: Page) -> None:
    touch = sample_page.context.new_cdp_session(sample_page)

    def fingers(kind: str, *columns: int) -> None:
        points = [{"x": x, "y": 250, "id": i} for i, x in enumerate(columns)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    fingers("touchStart", 440, 520)
    fingers("touchMove", 400, 560)
    fingers("touchMove", 300, 660)
    fingers("touchEnd")
    waits_for(sample_page, "shown.dolly > 0")


def test_a_finger_shows_the_controls_and_hides_them(sample_page: Page) -> None:
    touch = sample_page.context.new_cdp_session(sample_page)

    def tap() -> None:
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": 300, "y": 200}]})
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    sample_page.mouse.move(300, 200)
    tap()
    sample_page.wait_for_selector(".stage.idle")
    assert not shown(sample_page)["isPlaying"], "it does not play, as a click of the mouse would"
    tap()
    sample_page.wait_for_selector(".stage:not(.idle)")


def test_an_element_with_autoplay_plays(tab: Page, site: Site) -> None:
    site.put("square.mcap", SAMPLE.read_bytes())
    open_player(tab, site, "square.mcap", "autoplay")
    waits_for(tab, "shown.isPlaying")
    waits_for(tab, "shown.frame > 0")


def test_the_view_follows_the_pointer_until_a_key_says_no(sample_page: Page) -> None:
    sample_page.mouse.move(300, 250)
    sample_page.mouse.move(700, 250)
    waits_for(sample_page, "shown.view.col > 1")
    sample_page.keyboard.press("h")
    expect(sample_page.get_by_role("status").filter(has_text="does not follow")).to_have_count(1)
    before = sample_page.evaluate("document.querySelector('mvcodec-player').shown.view")
    sample_page.mouse.move(200, 250)
    settled(sample_page)
    assert sample_page.evaluate("document.querySelector('mvcodec-player').shown.view") == before


def test_a_phone_that_is_turned_looks_around(sample_page: Page) -> None:
    sample_page.evaluate("""() => {
        for (const gamma of [0, 20]) {
            dispatchEvent(new DeviceOrientationEvent("deviceorientation", { alpha: 0, beta: 10, gamma }));
        }
    }""")
    waits_for(sample_page, "shown.view.col > 1 && shown.view.row === 1")


def test_a_phone_that_must_be_asked_first_is_asked_by_a_tap(
    chromium: Browser, sample_server: Running
) -> None:
    phone = chromium.new_page(
        viewport={"width": 390, "height": 800}, has_touch=True, is_mobile=True, reduced_motion="reduce"
    )
    phone.add_init_script(
        "DeviceOrientationEvent.requestPermission = async () => { window.isAsked = true; return 'granted'; };"
    )
    phone.goto(f"{sample_server.url}?view=1,1")
    phone.evaluate("document.querySelector('mvcodec-player').ready")
    assert phone.evaluate("window.isAsked") is None
    turn = phone.get_by_text("Turn the phone to look around")
    toggle_menu(phone)
    turn.dispatch_event("click")
    phone.wait_for_function("window.isAsked")
    toggle_menu(phone)
    expect(turn).to_be_hidden()
    expect(phone.get_by_text("Save picture")).to_be_visible()
    phone.close()


def test_a_hovered_look_says_disparity_and_metres(sample_page: Page) -> None:
    sample_page.get_by_label("Show").select_option("disparity")
    settled(sample_page)
    sample_page.mouse.move(480, 250)
    sample_page.mouse.move(482, 252)
    expect(sample_page.locator(".probe")).to_contain_text("px")
