"""What the page says and shows of a file with an enhancement layer, which it does not decode."""

from __future__ import annotations

from pathlib import Path

import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, SCREENSHOTS, pixels_of
from playwright.sync_api import Page, expect
from web_fixtures import Site, open_player

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)

SAMPLE = Path(__file__).parent / "conformance" / "enhanced.mcap"


def test_the_base_is_shown_and_the_layer_is_told(tab: Page, site: Site) -> None:
    site.put("enhanced.mcap", SAMPLE.read_bytes())
    open_player(tab, site, "enhanced.mcap")
    said = "This file has 3 enhanced views: this page shows them as synthesised"
    expect(tab.locator("mvcodec-player").get_by_role("alert")).to_contain_text(said)
    tab.screenshot(path=SCREENSHOTS / "web_enhanced.png")
    assert pixels_of(tab).std() > 5
