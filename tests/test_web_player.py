"""The page's player as people use it, in a real Chromium: `mvcodec play` and the custom element."""

from __future__ import annotations

import base64
import http.client

import numpy as np
import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, PLAYER, pixels_of, screenshot, settled, shown, waits_for
from player_files import Running, decode_picture
from playwright.sync_api import Page, Route, expect
from web_fixtures import SAMPLE, Site, open_player

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)


def ask(sample_server: Running, path: str, **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", sample_server.port, timeout=10)
    connection.request("GET", path, headers=headers)
    return connection.getresponse()


def test_the_server_hands_out_the_page_and_ranges_of_the_file(sample_server: Running) -> None:
    part = ask(sample_server, "/video.mcap", Range="bytes=5-14")
    assert part.status == 206
    assert part.headers["Content-Range"] == f"bytes 5-14/{SAMPLE.stat().st_size}"
    assert part.read() == SAMPLE.read_bytes()[5:15]
    index = ask(sample_server, "/")
    assert "unsafe" not in index.headers["Content-Security-Policy"]
    assert "<title>square.mcap</title>" in index.read().decode()
    assert ask(sample_server, "/../square.json").status == 404
    assert ask(sample_server, "/video.mcap", Host="elsewhere.example").status == 403


def test_the_address_says_which_view_and_time(sample_page: Page) -> None:
    assert shown(sample_page)["frame"] == 2
    assert shown(sample_page)["view"] == {"row": 1, "col": 1}


def test_keys_step_look_and_change_what_is_shown(sample_page: Page) -> None:
    sample_page.keyboard.press(".")
    waits_for(sample_page, "shown.frame === 3")
    sample_page.keyboard.press("End")
    waits_for(sample_page, "shown.frame === 5")
    sample_page.keyboard.press("ArrowRight")
    waits_for(sample_page, "shown.view.col > 1")
    sample_page.keyboard.press("v")
    waits_for(sample_page, "shown.look === 'disparity'")
    sample_page.keyboard.press("w")
    waits_for(sample_page, "shown.dolly > 0")
    sample_page.keyboard.press("i")
    expect(sample_page.locator(".stats")).to_contain_text("h264")
    sample_page.keyboard.press("?")
    expect(sample_page.get_by_role("dialog")).to_contain_text("look around")


def test_keys_skip_and_change_the_speed(sample_page: Page) -> None:
    for key, frame in (("l", 3), ("j", 2), ("Home", 0)):
        sample_page.keyboard.press(key)
        waits_for(sample_page, f"shown.frame === {frame}")  # a tenth of a short file is a frame of this one
    for key, times, speed in (("+", 3, 4), ("-", 9, 0.1)):
        for _ in range(times):
            sample_page.keyboard.press(key)
        assert shown(sample_page)["speed"] == speed
        expect(sample_page.get_by_label("Speed")).to_have_value(str(speed))


def test_a_key_fills_the_screen_and_a_double_click_leaves_it(sample_page: Page) -> None:
    sample_page.keyboard.press("f")
    sample_page.wait_for_function("() => document.fullscreenElement !== null")
    sample_page.mouse.dblclick(480, 250)
    sample_page.wait_for_function("() => document.fullscreenElement === null")
    assert not shown(sample_page)["isPlaying"], "neither of both clicks was one by itself"


def test_it_says_what_it_waits_for(tab: Page, sample_server: Running) -> None:
    def hold(_route: Route) -> None:
        pass

    tab.route("**/video.mcap", hold)
    tab.goto(f"{sample_server.url}?view=1,1")
    expect(tab.locator(".wait")).to_have_text("Opening the file")
    expect(tab.locator(".wait")).to_be_visible()
    expect(tab.locator(".controls").get_by_label("Play")).to_be_disabled()
    tab.unroute("**/video.mcap")  # what was held goes on
    tab.evaluate(f"{PLAYER}.ready")
    expect(tab.locator(".wait")).to_be_hidden()
    expect(tab.locator(".controls").get_by_label("Play")).to_be_enabled()


def test_it_has_the_colours_of_the_system(sample_page: Page) -> None:
    def ground() -> str:
        found: str = sample_page.evaluate(f"getComputedStyle({PLAYER}).backgroundColor")
        return found

    light = ground()
    sample_page.emulate_media(color_scheme="dark")
    assert ground() != light


def test_space_plays_and_the_time_runs_and_loops(sample_page: Page) -> None:
    expect(sample_page.locator(".time")).to_have_text("0:00.2 / 0:00.6")
    sample_page.keyboard.press(" ")
    waits_for(sample_page, "shown.isPlaying")
    waits_for(sample_page, "shown.frame === 5")
    waits_for(sample_page, "shown.frame < 2")  # it begins again
    sample_page.keyboard.press(" ")
    waits_for(sample_page, "!shown.isPlaying")


def test_a_section_is_played_over_and_over(sample_page: Page) -> None:
    sample_page.keyboard.press("a")
    sample_page.keyboard.press("End")
    waits_for(sample_page, "shown.frame === 5")
    sample_page.keyboard.press("b")
    assert shown(sample_page)["section"] == {"from": pytest.approx(0.2), "to": pytest.approx(0.5)}
    sample_page.keyboard.press("b")
    assert shown(sample_page)["section"] is None


def test_dragging_looks_around_and_a_click_plays(sample_page: Page) -> None:
    sample_page.mouse.move(480, 250)
    sample_page.mouse.down()
    sample_page.mouse.move(400, 250, steps=4)
    sample_page.mouse.up()
    waits_for(sample_page, "shown.view.col > 1.05")
    assert not shown(sample_page)["isPlaying"]
    sample_page.mouse.click(480, 250)
    waits_for(sample_page, "shown.isPlaying")
    sample_page.mouse.click(480, 250)
    waits_for(sample_page, "!shown.isPlaying")


def test_a_picture_that_is_held_gets_all_detail_when_it_is_let_go(sample_page: Page) -> None:
    settled(sample_page)
    sample_page.mouse.move(480, 250)
    sample_page.mouse.down()
    sample_page.mouse.move(400, 250, steps=4)
    waits_for(sample_page, "shown.view.col > 1.05")
    sample_page.evaluate("""() => {
        window.heldUntil = performance.now() + 500;
        document.querySelector("mvcodec-player").settled().then(() => (window.stoodAt = performance.now()));
    }""")
    sample_page.wait_for_function("() => performance.now() > window.heldUntil")
    sample_page.mouse.up()
    sample_page.wait_for_function("() => window.stoodAt > window.heldUntil")


def test_a_picture_that_moves_is_a_draft_on_a_small_canvas_and_one_that_stands_is_not(
    sample_page: Page,
) -> None:
    sample_page.mouse.move(480, 250)
    sample_page.mouse.down()
    sample_page.mouse.move(400, 250, steps=4)
    draft = sample_page.locator("canvas.draft")
    expect(draft).to_be_visible()
    coded = draft.evaluate("(canvas) => canvas.toDataURL('image/png').split(',')[1]")
    shown_there = decode_picture(np.frombuffer(base64.b64decode(coded), np.uint8))
    assert shown_there.shape == (48, 64, 3)
    assert np.array_equal(shown_there, pixels_of(sample_page, fine=False))
    sample_page.mouse.up()
    settled(sample_page)
    expect(draft).to_be_hidden()


def test_the_wheel_moves_ahead_and_holes_stay_few(sample_page: Page) -> None:
    sample_page.mouse.move(480, 250)
    for _ in range(20):
        sample_page.mouse.wheel(0, -600)
    waits_for(sample_page, "shown.dolly > 0")
    sample_page.evaluate("document.querySelector('mvcodec-player').look(0.6, 1.3)")
    sample_page.get_by_label("Show").select_option("provenance")
    waits_for(sample_page, "shown.look === 'provenance'")
    red = pixels_of(sample_page).astype(int)
    unseen = (red[..., 0] > red[..., 1] + 60) & (red[..., 0] > red[..., 2] + 60) & (red[..., 1] < 110)
    assert unseen.mean() < 0.03


def test_the_controls_hide_when_left_alone_and_come_back(sample_page: Page) -> None:
    sample_page.mouse.move(480, 200)
    sample_page.wait_for_selector(".stage.idle")
    sample_page.mouse.move(490, 210)
    expect(sample_page.locator(".stage.idle")).to_have_count(0)


def test_it_sways_until_somebody_touches_it(tab: Page, sample_server: Running) -> None:
    tab.emulate_media(reduced_motion="no-preference")
    tab.goto(sample_server.url)
    tab.evaluate("document.querySelector('mvcodec-player').ready")
    waits_for(tab, "shown.view.col !== 1")
    tab.keyboard.press("ArrowLeft")
    expect(tab.get_by_text("Drag to look around")).to_be_hidden()
    before = shown(tab)["view"]
    tab.evaluate("new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)))")
    assert shown(tab)["view"] == before


def test_reduced_motion_does_not_sway(tab: Page, sample_server: Running) -> None:
    tab.goto(sample_server.url)
    tab.evaluate("document.querySelector('mvcodec-player').ready")
    tab.evaluate("new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)))")
    assert shown(tab)["view"] == {"row": 1, "col": 1}


def test_a_picture_that_stands_is_not_drawn_again(sample_page: Page) -> None:
    sample_page.evaluate("""() => {
        window.drawn = 0;
        document.querySelector("mvcodec-player").addEventListener("frame", () => window.drawn++);
    }""")
    sample_page.keyboard.press(",")
    waits_for(sample_page, "shown.frame === 1")
    # The picture that stands is drawn once more, with all detail; then nobody asks for another one.
    settled(sample_page)
    drawn = sample_page.evaluate("window.drawn")
    sample_page.evaluate("new Promise((resolve) => setTimeout(resolve, 600))")
    assert sample_page.evaluate("window.drawn") == drawn


def test_a_picture_takes_two_draws_a_camera_and_one_a_view_at_most(sample_page: Page) -> None:
    settled(sample_page)
    draws = sample_page.evaluate("""async () => {
        const { prototype } = WebGL2RenderingContext;
        const { drawArrays } = prototype;
        let count = 0;
        prototype.drawArrays = function (...about) {
            count++;
            drawArrays.apply(this, about);
        };
        const player = document.querySelector("mvcodec-player");
        await player.look(0.6, 1.3); // four cameras
        await player.seek(4);
        await player.settled();
        prototype.drawArrays = drawArrays;
        return count;
    }""")
    assert 1 <= draws <= 2 * 4 + 1


def test_the_element_in_another_page(tab: Page, site: Site) -> None:
    site.put("square.mcap", SAMPLE.read_bytes())
    open_player(tab, site, "square.mcap", 'view="0.5,1.25"')
    assert shown(tab)["view"] == {"row": 0.5, "col": 1.25}
    detail = tab.evaluate("""async () => {
        const player = document.querySelector("mvcodec-player");
        const drawn = new Promise((resolve) => {
            player.addEventListener("frame", (event) => resolve(event.detail));
        });
        await player.seek(4);
        await player.look(2, 0);
        return drawn;
    }""")
    assert detail["frame"] == 4
    assert shown(tab)["view"] == {"row": 2, "col": 0}
    assert pixels_of(tab).shape == (48, 64, 3)


def test_what_is_no_recording_is_said(tab: Page, site: Site) -> None:
    site.put("text.mcap", b"This is no recording.")
    tab.goto(f"{site.url}/blank.html")
    message = tab.evaluate("""async () => {
        await import("./player.js");
        document.body.innerHTML = '<mvcodec-player src="text.mcap"></mvcodec-player>';
        const player = document.querySelector("mvcodec-player");
        const told = new Promise((resolve) => {
            player.addEventListener("error", (event) => resolve(event.detail));
        });
        return [await told, await player.ready.catch((error) => error.message)];
    }""")
    assert message[0]["isFatal"]
    assert "not MCAP" in message[1]
    expect(tab.get_by_role("alert")).to_contain_text("not MCAP")
    expect(tab.get_by_role("alert").get_by_role("button", name="Open a file")).to_be_visible()
    expect(tab.locator(".controls").get_by_label("Play")).to_be_disabled()


def test_both_eyes_get_views_of_their_own(sample_page: Page) -> None:
    sample_page.keyboard.press("e")
    waits_for(sample_page, "shown.eyes === 'side by side'")
    sample_page.wait_for_function(
        "document.querySelector('mvcodec-player').shadowRoot.querySelector('canvas').width === 128"
    )
    sample_page.keyboard.press("e")
    waits_for(sample_page, "shown.eyes === 'anaglyph'")


@pytest.mark.parametrize(
    ("width", "height", "scheme"), [(390, 800, "light"), (1280, 720, "dark"), (2560, 1440, "dark")]
)
def test_the_controls_fit_the_screen(sample_page: Page, width: int, height: int, scheme: str) -> None:
    sample_page.set_viewport_size({"width": width, "height": height})
    sample_page.emulate_media(color_scheme="light" if scheme == "light" else "dark", reduced_motion="reduce")
    for label in ("Play", "Show", "Speed", "More", "Full screen", "Time"):
        box = sample_page.locator(".controls").get_by_label(label, exact=True).bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
        assert box["y"] + box["height"] <= height
    settled(sample_page)
    screenshot(sample_page, f"web_{width}")
    assert np.asarray(pixels_of(sample_page)).std() > 10
