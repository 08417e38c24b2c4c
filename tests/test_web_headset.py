"""The page's picture in a headset (WebXR), in a real Chromium with an emulated device."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, SCREENSHOTS, waits_for, watched_page
from player_files import decode_picture
from playwright.sync_api import Browser, Page, expect
from web_fixtures import SIZE, Site, open_player

from mvcodec.frames import Picture

ROOT = Path(__file__).parents[1]
EMULATOR = ROOT / "web" / "node_modules" / "iwer" / "build" / "iwer.min.js"
ROOM = ROOT / "samples" / "room_2x2.mcap"
"""2 x 2 cameras of 640 x 360, disparity of 18 to 59 px."""
SQUARE = Path(__file__).parent / "conformance" / "square.mcap"
"""3 x 3 views of 64 x 48, six frames, ten a second."""

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM),
    pytest.mark.skipif(not EMULATOR.is_file(), reason="the emulator is not installed (make web)"),
]
pytest_plugins = ("web_fixtures",)


@pytest.fixture(scope="module")
def page(chromium: Browser) -> Iterator[Page]:
    """A page with a headset at eye level that it has not begun to use."""
    for page in watched_page(chromium, *SIZE):
        page.add_init_script(path=EMULATOR)
        page.add_init_script("""
            window.device = new IWER.XRDevice(IWER.metaQuest3);
            device.installRuntime({ forceInstall: true }); // Chromium's own finds no device
            device.stereoEnabled = true;
        """)
        yield page


def enter(page: Page, site: Site, recording: Path, view: str) -> None:
    """Show a recording in the headset, the head's first place being a view."""
    site.put("recording.mcap", recording.read_bytes())
    open_player(page, site, "recording.mcap", f'view="{view}"')
    put_headset_on(page)


def put_headset_on(page: Page) -> None:
    page.get_by_label("More").dispatch_event("click")  # the controls may have hidden by now
    page.get_by_role("button", name="Enter the headset").dispatch_event("click")
    waits_for(page, "shown.immersed?.length === 2")


def move_head(page: Page, x: float, y: float) -> None:
    """By some metres to the right and up from where it was first."""
    page.evaluate(f"device.position.set({x}, {y} + 1.6, 0)")


def screens(page: Page) -> tuple[Picture, Picture]:
    """The picture as the left and the right eye see it, cut out of the dark around it."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    shot = decode_picture(np.frombuffer(page.screenshot(), np.uint8))
    cut = []
    for eye in np.split(shot, 2, axis=1):
        is_lit = eye.max(axis=2) > 40
        rows, columns = np.flatnonzero(is_lit.any(axis=1)), np.flatnonzero(is_lit.any(axis=0))
        cut.append(eye[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1])
    return cut[0], cut[1]


def seen_from(page: Page) -> list[dict[str, float]]:
    found: list[dict[str, float]] = page.evaluate("document.querySelector('mvcodec-player').shown.immersed")
    return found


def test_each_eye_sees_from_its_own_viewpoint_and_what_is_far_lies_behind_the_screen(
    page: Page, site: Site
) -> None:
    enter(page, site, ROOM, "0.5,0.5")
    left, right = seen_from(page)
    assert left["row"] == right["row"] == pytest.approx(0.5)
    assert (left["col"] + right["col"]) / 2 == pytest.approx(0.5)
    assert right["col"] - left["col"] == pytest.approx(0.03 * 640 / 41, abs=0.01)
    left_eye, right_eye = screens(page)
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SCREENSHOTS / "headset.png")
    height, width = left_eye.shape[:2]
    assert width > 200
    wall = slice(height // 8, height * 3 // 8)
    poster = left_eye[wall, width * 3 // 8 : width * 5 // 8]
    found = cv2.matchTemplate(right_eye[wall], poster, cv2.TM_CCOEFF_NORMED)[0]
    assert found.max() > 0.8
    parallax = int(found.argmax()) - width * 3 // 8
    assert 2 <= parallax <= 0.03 * width  # farther to the right for the right eye


def test_moving_the_head_moves_the_view_as_far_as_the_array_goes(page: Page, site: Site) -> None:
    enter(page, site, SQUARE, "1,1")
    before = seen_from(page)
    move_head(page, 0.02, 0.02)
    waits_for(page, f"shown.immersed[0].col > {before[0]['col']} + 0.05")
    assert seen_from(page)[0]["row"] < before[0]["row"]
    move_head(page, 50, -50)
    waits_for(page, "shown.immersed[0].row === 2 && shown.immersed[1].col === 2")
    after = seen_from(page)
    assert after[1]["col"] - after[0]["col"] == pytest.approx(before[1]["col"] - before[0]["col"], abs=1e-3)


def test_the_picture_follows_the_head(page: Page, site: Site) -> None:
    enter(page, site, ROOM, "0.5,0")  # the eyes are at the array's left border
    before, _ = screens(page)
    move_head(page, 0.05, 0)
    waits_for(page, "shown.immersed[0].col > 0.1")
    after, _ = screens(page)
    height, width = before.shape[:2]
    wall = slice(height // 8, height * 3 // 8)
    poster = before[wall, width * 3 // 8 : width * 5 // 8]
    found = cv2.matchTemplate(after[wall], poster, cv2.TM_CCOEFF_NORMED)[0]
    assert found.max() > 0.7
    assert int(found.argmax()) - width * 3 // 8 >= 2


def test_the_picture_plays_by_the_headsets_clock(page: Page, site: Site) -> None:
    enter(page, site, SQUARE, "1,1")
    page.evaluate("document.querySelector('mvcodec-player').play()")
    waits_for(page, "shown.immersed && shown.frame > 0")


def test_ending_gives_the_page_back(page: Page, site: Site) -> None:
    enter(page, site, SQUARE, "1,1")
    move_head(page, 0.02, 0.02)
    page.evaluate("device.activeSession.end()")
    waits_for(page, "shown.immersed === null")
    page.evaluate("document.querySelector('mvcodec-player').settled()")
    assert page.evaluate("document.querySelector('mvcodec-player').shown.view") == {"row": 1, "col": 1}
    # The headset's last pictures may be decoded, or drawn by what stands in for one, only now: asked again.
    page.wait_for_function("""async () => {
        const player = document.querySelector("mvcodec-player");
        await player.settled();
        const { width, height } = player.shadowRoot.querySelector("canvas");
        return width === 64 && height === 48;
    }""")
    put_headset_on(page)  # and once more


def test_without_a_headset_none_is_offered(tab: Page, site: Site) -> None:
    site.put("square.mcap", SQUARE.read_bytes())
    open_player(tab, site, "square.mcap")
    tab.get_by_label("More").dispatch_event("click")
    expect(tab.get_by_text("Copy link")).to_be_visible()
    expect(tab.get_by_text("Enter the headset")).to_be_hidden()
