"""The page follows an encoder while it encodes, over the live view's WebSocket."""

from __future__ import annotations

import io

import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, pixels_of
from coding import config, frame_set, luma_psnr, make_array
from playwright.sync_api import Page, expect
from web_fixtures import Site

from mvcodec.container import McapWriter
from mvcodec.encoding.encoder import Encoder
from mvcodec.output.live_view import LiveView
from mvcodec.web_player.pages import single_page

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)

ARRAY = make_array(rows=1)
GOP = 3


def test_it_joins_at_the_next_keyframe_and_stays_at_the_newest_picture(tab: Page, site: Site) -> None:
    shown = "document.querySelector('mvcodec-player').shown"
    with (
        LiveView("127.0.0.1", 0) as view,
        McapWriter(io.BytesIO(), chunk_ms=0, listener=view) as writer,
        Encoder(ARRAY, config(gop=GOP)) as encoder,
    ):
        given = iter(range(100))

        def give(count: int) -> None:
            for _ in range(count):
                writer.push(encoder.push(frame_set(ARRAY, next(given))))

        give(2)
        # The page's own content security policy must let it.
        tab.goto(site.put("live.html", single_page("live", view.url).encode()) + "?view=0,0")
        # It has subscribed when pictures come; until then frame sets go nowhere.
        while not tab.evaluate(f"{shown} !== undefined"):
            give(1)
            tab.evaluate("new Promise(requestAnimationFrame)")
        expect(tab.locator(".time")).to_contain_text("live")
        give(2 * GOP)
        count = tab.evaluate(f"{shown}.count")
        tab.wait_for_function(f"() => {shown}.count >= {GOP} && {shown}.frame === {shown}.count - 1")
        assert count > 0
        newest = next(given) - 1
        tab.wait_for_function(
            "() => document.querySelector('mvcodec-player').settled().then(() => true)",
        )
        assert luma_psnr(pixels_of(tab), frame_set(ARRAY, newest).pictures[0, 0]) > 30
        tab.evaluate("document.querySelector('mvcodec-player').seek(0)")
        give(GOP)
        tab.wait_for_function(f"() => {shown}.count > {count} && {shown}.frame === 0")
    expect(tab.locator(".time")).not_to_contain_text("live")


def test_an_address_where_nobody_sends_is_told(tab: Page, site: Site) -> None:
    with LiveView("127.0.0.1", 0) as view:
        gone = view.url
    tab.goto(f"{site.url}/blank.html")
    tab.evaluate(
        """async (address) => {
            await import("./player.js");
            document.body.innerHTML = `<mvcodec-player src="${address}"></mvcodec-player>`;
        }""",
        gone,
    )
    expect(tab.get_by_role("alert")).to_contain_text("a live view that ended")
