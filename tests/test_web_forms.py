"""What the page says and shows of files that it does not decode as a whole."""

from __future__ import annotations

from pathlib import Path

import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, SCREENSHOTS
from playwright.sync_api import Page, expect
from web_fixtures import Site, open_player, pixels_of

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)

FOLDER = Path(__file__).parent / "conformance"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("predicted", "5 of this file's cameras are coded from others: this page shows what plays alone"),
        ("enhanced", "This file has 3 enhanced views: this page shows them as synthesised"),
    ],
)
def test_the_page_says_what_it_leaves_out_and_shows_the_rest(
    tab: Page, site: Site, name: str, text: str
) -> None:
    site.put(f"{name}.mcap", (FOLDER / f"{name}.mcap").read_bytes())
    open_player(tab, site, f"{name}.mcap")
    expect(tab.locator("mvcodec-player").get_by_role("alert")).to_contain_text(text)
    tab.screenshot(path=SCREENSHOTS / f"web_{name}.png")
    assert pixels_of(tab).std() > 5
