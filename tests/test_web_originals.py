"""The page beside the originals that `mvcodec play --original` hands it."""

from __future__ import annotations

import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, pixels_of, waits_for
from command_line import fails, succeeds
from player_files import Running, decode_picture, encode, playing, write_original
from playwright.sync_api import Page, expect
from web_fixtures import serve_folder

from mvcodec.capture import open_input
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import Picture

PATIENCE_MS = 60_000
"""A picture in full detail without a GPU, beside much else."""

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_original(tmp_path_factory.mktemp("originals") / "original", frames=2)


@pytest.fixture(scope="module")
def server(original: Path) -> Iterator[Running]:
    file = encode(original, original.parent / "room.mcap")
    with playing(file, "--original", original, renderer="web") as running:
        yield running


def test_the_difference_is_to_what_a_camera_saw_from_the_nearest_place(
    tab: Page, server: Running, original: Path
) -> None:
    tab.goto(f"{server.url}?view=0.9,1.2&t=0")
    tab.evaluate("document.querySelector('mvcodec-player').ready")
    tab.get_by_label("Show").select_option("difference")
    expect(tab.get_by_text("dB PSNR")).to_be_visible(timeout=PATIENCE_MS)
    waits_for(tab, "shown.view.row === 1 && shown.view.col === 1")
    difference = pixels_of(tab)
    stated = float(tab.get_by_text("dB PSNR").inner_text().split(" dB")[0].split()[-1])
    tab.keyboard.press("w")
    tab.keyboard.press("e")
    assert np.array_equal(pixels_of(tab), difference), "it is one view, from where the camera stood"
    tab.evaluate("document.querySelector('mvcodec-player').settled()")
    expect(tab.get_by_text("dB PSNR")).to_be_visible(timeout=PATIENCE_MS)
    tab.keyboard.press("s")

    tab.get_by_label("Show").select_option("picture")
    tab.evaluate("document.querySelector('mvcodec-player').look(1, 1)")
    picture, truth = pixels_of(tab), original_of(original, 0, (1, 1))
    assert stated == pytest.approx(psnr(truth, picture), abs=0.02)
    share = np.minimum(np.abs(picture.astype(float) - truth).max(axis=2) * 4 / 255, 1)
    green = np.interp(share, (0, 0.5, 1), (18, 51, 242))  # of the colours from blue by red to yellow
    assert np.mean(np.abs(green - difference[..., 1])) < 1


def test_originals_are_served_where_there_are_some(server: Running, original: Path) -> None:
    with urllib.request.urlopen(f"{server.url}original/1/0/2.png") as answer:
        served = decode_picture(np.frombuffer(answer.read(), np.uint8))
    assert np.array_equal(served, original_of(original, 1, (0, 2)))
    for place in ("original/2/0/0.png", "original/0/3/0.png", "original/0/0/-1.png"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(server.url + place)


@pytest.mark.usefixtures("server")
def test_a_page_for_any_server_has_the_originals_beside_it(tab: Page, original: Path, tmp_path: Path) -> None:
    file = original.parent / "room.mcap"
    refused = fails(2, "export-web", file, tmp_path, "--original", original, "--single-file")
    assert "--original" in refused
    succeeds("export-web", file, tmp_path, "--original", original, "--quiet")
    saved = decode_picture(
        np.frombuffer((tmp_path / "original" / "1" / "0" / "2.png").read_bytes(), np.uint8)
    )
    assert np.array_equal(saved, original_of(original, 1, (0, 2)))
    assert len(list((tmp_path / "original").rglob("*.png"))) == 2 * 9
    for site in serve_folder(tmp_path):
        tab.goto(f"{site.url}/index.html?view=1,1")
        tab.evaluate("document.querySelector('mvcodec-player').ready")
        tab.get_by_label("Show").select_option("difference")
        expect(tab.get_by_text("dB PSNR")).to_be_visible(timeout=PATIENCE_MS)


def test_a_page_without_originals_does_not_offer_the_difference(tab: Page, original: Path) -> None:
    with playing(original.parent / "room.mcap", renderer="web") as running:
        tab.goto(f"{running.url}?view=1,1")
        tab.evaluate("document.querySelector('mvcodec-player').ready")
        shown = (
            tab.get_by_label("Show")
            .locator("option:not([disabled])")
            .evaluate_all("all => all.map(o => o.value)")
        )
        assert "difference" not in shown
        for _ in shown:
            tab.keyboard.press("v")
        waits_for(tab, "shown.look === 'picture'")


def original_of(folder: Path, frame: int, place: tuple[int, int]) -> Picture:
    (frames,) = open_input([folder]).frame_sets(slice(frame, frame + 1), [place])
    return frames.pictures[place]
