"""Pictures of the page, read back from Chromium: as good as the library's own synthesizers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, pixels_of
from numpy.typing import NDArray
from player_files import encode, write_original
from playwright.sync_api import Browser, Page
from web_fixtures import Site, open_player

from mvcodec.array import Viewpoint
from mvcodec.capture import open_input
from mvcodec.decoding.decoder import Decoder
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import DecodedSet, FrameSet, Picture
from mvcodec.scenes.scene import SCENES
from mvcodec.synthesis.synthesizers import make_synthesizer

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)

DATA = Path(__file__).parents[2] / "shared" / "data"
BELOW_DB = {("page", "quick"): 0.5, ("page", "layered"): 1.0, ("draft", "quick"): 1.0}
"""How far the page's mean over the views may lie below a synthesizer's; a draft is what moves."""

MESA = ("--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist")
RENDERER = """() => {
    const gl = document.createElement("canvas").getContext("webgl2");
    const names = gl?.getExtension("WEBGL_debug_renderer_info");
    return names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "none";
}"""


def first_of(file: Path) -> DecodedSet:
    with Decoder.open(file, slice(0, 1)) as decoder:
        (decoded,) = decoder
    return decoded


def original_of(folder: Path) -> FrameSet:
    return next(iter(open_input([folder], real="all").frame_sets()))


def view_of(page: Page, row: float, col: float, fine: bool = True) -> Picture:
    page.evaluate("([row, col]) => document.querySelector('mvcodec-player').look(row, col)", [row, col])
    return pixels_of(page, fine=fine)


def check_against_synthesizers(
    page: Page, site: Site, file: Path, original: FrameSet, views: Sequence[tuple[int, int]]
) -> None:
    decoded = first_of(file)
    site.put(file.name, file.read_bytes())
    open_player(page, site, file.name)

    def psnr_of(render: Callable[[int, int], Picture]) -> NDArray[np.float64]:
        return np.array([psnr(original.pictures[view], render(*view)) for view in views])

    found = {
        "draft": psnr_of(lambda row, col: view_of(page, row, col, fine=False)),
        "page": psnr_of(lambda row, col: view_of(page, row, col)),
    }
    for name in ("quick", "layered"):
        synthesizer = make_synthesizer(name)
        found[name] = psnr_of(lambda row, col: synthesizer.render(decoded, Viewpoint(row, col)).pixels)  # noqa: B023
    virtual = np.array([view not in decoded.array.real for view in views])
    for kind, chosen in (("views", np.ones_like(virtual)), ("virtual views", virtual)):
        means = (f"{name} {db[chosen].mean():.2f}" for name, db in found.items() if chosen.any())
        print(file.stem, chosen.sum(), kind, *means)  # noqa: T201
    mean = {name: float(db.mean()) for name, db in found.items()}
    for (mine, other), below_db in BELOW_DB.items():
        assert mean[mine] > mean[other] - below_db, (mine, other)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A small array folder and its coded file."""
    folder = tmp_path_factory.mktemp("room")
    original = write_original(folder / "room", frames=2)
    return original, encode(original, folder / "room.mcap")


def test_virtual_views_are_as_good_as_the_librarys(tab: Page, site: Site, room: tuple[Path, Path]) -> None:
    original, file = room
    check_against_synthesizers(tab, site, file, original_of(original), [(1, 1), (0, 1), (1, 0)])


def test_a_viewpoint_on_a_real_camera_shows_that_camera(
    tab: Page, site: Site, room: tuple[Path, Path]
) -> None:
    decoded = first_of(room[1])
    site.put("room.mcap", room[1].read_bytes())
    open_player(tab, site, "room.mcap")
    for camera, picture in decoded.pictures.items():
        found = view_of(tab, *camera)
        assert psnr(picture, found) > 45  # chroma between its samples is the decoder's business
        difference = picture.astype(int) - found
        assert abs(difference.mean(axis=(0, 1))).max() < 0.3  # no shift of any colour


def test_the_same_view_has_the_same_pixels_every_time(tab: Page, site: Site, room: tuple[Path, Path]) -> None:
    site.put("room.mcap", room[1].read_bytes())
    open_player(tab, site, "room.mcap")
    first = view_of(tab, 0.8, 1.3)
    view_of(tab, 2, 0)
    assert np.array_equal(view_of(tab, 0.8, 1.3), first)


def test_another_gl_draws_the_same(chromium: Browser, tab: Page, site: Site, room: tuple[Path, Path]) -> None:
    # The other pages draw by SwiftShader; Mesa's drivers are what many GPUs are driven by.
    original, file = room
    site.put("room.mcap", file.read_bytes())
    other = chromium.browser_type.launch(executable_path=CHROMIUM, args=list(MESA))
    page = other.new_page()
    if "Mesa" not in page.evaluate(RENDERER):
        other.close()
        pytest.skip("Chromium finds no Mesa (Debian: apt install libegl1 libgl1-mesa-dri)")
    open_player(tab, site, "room.mcap")
    open_player(page, site, "room.mcap")
    pictures = original_of(original).pictures
    for view in ((1, 1), (0, 1), (1, 0), (2, 2)):
        ours, theirs = view_of(tab, *view), view_of(page, *view)
        assert psnr(ours, theirs) > 48
        assert psnr(pictures[view], theirs) == pytest.approx(psnr(pictures[view], ours), abs=0.1)
    other.close()


@pytest.mark.slow
@pytest.mark.shared_data
@pytest.mark.parametrize("name", ["room", "motorcycle", "shop_v3", "shop_v4"])
def test_whole_arrays_are_as_good_as_the_librarys(tab: Page, site: Site, tmp_path: Path, name: str) -> None:
    tab.set_default_timeout(0)
    from mvcodec.cli.main import main

    original = DATA / name
    if name in SCENES:
        original = tmp_path / "original"
        assert main(["sample", str(original), "--scene", name, "--frames", "1", "--quiet"]) == 0
    elif not original.is_dir():
        pytest.skip(f"no {original}")
    file = tmp_path / f"{name}.mcap"
    assert main(["encode", str(original), str(file), "--frames", "0:1", "--quiet"]) == 0
    views = list(open_input([original]).array.positions)
    check_against_synthesizers(tab, site, file, original_of(original), views)
