"""`mvcodec export-web`: a page that shows a file from any web server, or from disk."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, pixels_of
from command_line import fails, succeeds
from playwright.sync_api import Page
from web_fixtures import Site, serve_folder

import mvcodec

SAMPLE = Path(__file__).parents[1] / "samples" / "room_2x2.mcap"
OTHER = Path(__file__).parent / "conformance" / "odd_size.mcap"
pytest_plugins = ("web_fixtures",)
in_browser = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)


def tree(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


def shows_a_picture(page: Page) -> None:
    page.evaluate("""async () => {
        await customElements.whenDefined("mvcodec-player");
        await document.querySelector("mvcodec-player").ready;
    }""")
    assert pixels_of(page).std() > 20


def test_a_site_is_a_page_its_script_and_the_file(tmp_path: Path) -> None:
    succeeds("export-web", SAMPLE, tmp_path / "out", "--title", 'A <room> & "more"', "--poster")
    assert tree(tmp_path) == {
        "out",
        *(
            f"out/{name}"
            for name in ("index.html", "page.css", "player.js", "licences.txt", "video.mcap", "poster.jpg")
        ),
    }
    assert (tmp_path / "out" / "video.mcap").read_bytes() == SAMPLE.read_bytes()
    page = (tmp_path / "out" / "index.html").read_text("utf-8")
    assert "<title>A &lt;room&gt; &amp; &quot;more&quot;</title>" in page
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', page)
    assert policy is not None
    assert "unsafe" not in policy[1]


def test_a_file_that_is_none_of_ours_leaves_nothing(tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    other.write_bytes(b"no MCAP")
    assert "other.mcap" in fails(1, "export-web", other, tmp_path / "out")
    assert tree(tmp_path) == {"other.mcap"}


def test_the_folder_of_the_file_itself_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "video.mcap"
    file.write_bytes(SAMPLE.read_bytes())
    assert "holds video.mcap already" in fails(1, "export-web", file, tmp_path)
    fails(2, "export-web", file, tmp_path, "-y")
    assert file.read_bytes() == SAMPLE.read_bytes()


def test_a_folder_of_other_things_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    assert "notes.txt" in fails(1, "export-web", SAMPLE, tmp_path, "-y")
    assert tree(tmp_path) == {"notes.txt"}


@in_browser
def test_the_site_plays_from_a_plain_web_server(tab: Page, tmp_path: Path) -> None:
    succeeds("export-web", SAMPLE, tmp_path, "--quiet")
    for site in serve_folder(tmp_path):
        tab.goto(f"{site.url}/index.html")
        shows_a_picture(tab)
        site.put("other.mcap", OTHER.read_bytes())
        tab.goto(f"{site.url}/index.html?src=other.mcap&view=0,1&t=0.1")
        shows_a_picture(tab)
        assert tab.evaluate("document.querySelector('mvcodec-player').shown.view") == {"row": 0, "col": 1}
        size = tab.evaluate(
            "(({ width, height }) => [width, height])(document.querySelector('mvcodec-player').pixels())"
        )
        assert size != [64, 48]


@in_browser
def test_a_single_file_opens_from_disk(tab: Page, tmp_path: Path) -> None:
    succeeds("export-web", SAMPLE, tmp_path, "--single-file", "--quiet", "--poster")
    assert tree(tmp_path) == {"index.html"}
    tab.goto((tmp_path / "index.html").as_uri())
    shows_a_picture(tab)


@in_browser
def test_a_server_without_ranges_will_do(tab: Page, site: Site) -> None:
    site.put("room.mcap", SAMPLE.read_bytes())
    site.has_ranges = False
    tab.goto(f"{site.url}/blank.html")
    count = tab.evaluate("""async () => {
        const { FileDecoder } = await import("./player.js");
        return (await FileDecoder.open("room.mcap")).count;
    }""")
    site.has_ranges = True
    assert count > 1


@in_browser
def test_a_notebook_shows_the_player(tab: Page, site: Site) -> None:
    with mvcodec.open(SAMPLE) as video:
        shown = video._repr_html_()
    site.put("notebook.html", f"<!doctype html><meta charset='utf-8'>{shown}".encode())
    tab.goto(f"{site.url}/notebook.html")
    player = tab.frame_locator("iframe").locator("mvcodec-player")
    width = player.evaluate("""async (player) => {
        await customElements.whenDefined("mvcodec-player");
        await player.ready;
        return player.pixels().width;
    }""")
    assert width == video.array.width


def test_a_notebook_that_cannot_hold_it_says_so() -> None:
    with SAMPLE.open("rb") as file, mvcodec.open(file) as video:
        assert "mvcodec.open(path)" in video._repr_html_()
