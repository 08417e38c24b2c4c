"""The thesis's own DLR: its edge map, its steps on one layer, and small scenes through the whole of it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from stereo_scene import Planes, linear_or_grid

from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.layers.dlr_thesis import ThesisDlrSettings, refine, refine_layer
from mvcodec.layers.picture_segments import edge_map
from mvcodec.layers.refinement import make_matcher

NEAR = np.s_[20:60, 40:90]
SETTINGS = ThesisDlrSettings()


def all_valid(values: FloatMap) -> DisparityMap:
    return DisparityMap(values.astype(np.float32), np.ones(values.shape, np.bool_))


def square_scene() -> tuple[Picture, FloatMap]:
    """A near blue square before a red wall with a green line down each side, with the exact map."""
    picture = np.full((80, 130, 3), (200, 60, 40), np.uint8)
    picture[:, [4, 5, 124, 125]] = (60, 200, 60)
    picture[NEAR] = (40, 40, 200)
    exact = np.full((80, 130), 4, np.float32)
    exact[NEAR] = 20
    return picture, exact


def rectangle(shape: tuple[int, int], part: tuple[slice, slice]) -> Mask:
    mask = np.zeros(shape, np.bool_)
    mask[part] = True
    return mask


def outline(mask: Mask) -> Mask:
    eroded = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=0)
    return np.asarray(mask & (eroded == 0))


def test_edges_are_those_that_canny_and_segments_agree_on() -> None:
    picture, exact = square_scene()
    edges = edge_map(picture)
    square = rectangle(exact.shape, NEAR)
    beside = cv2.dilate(outline(square).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert (cv2.dilate(edges.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0)[outline(square)].all()
    assert not edges[10:70, 12:118][~beside[10:70, 12:118]].any()


def test_drops_what_lies_beyond_the_edges_of_an_object() -> None:
    square = rectangle((50, 70), np.s_[12:38, 20:50])
    blurred = rectangle((50, 70), np.s_[7:43, 15:55])
    refined = refine_layer(blurred, outline(square), SETTINGS)
    # The smoothing rounds corners.
    assert np.count_nonzero(refined ^ square) <= 12


def test_removes_specks() -> None:
    square, speck = rectangle((50, 70), np.s_[12:38, 20:50]), rectangle((50, 70), np.s_[2:4, 60:66])
    edges = outline(square) | outline(speck)
    for erosion, kept in ((1, True), (3, False)):
        settings = ThesisDlrSettings(erosion=erosion, smoothing=1)
        refined = refine_layer(square | speck, edges, settings)
        assert refined[speck].all() == refined[speck].any() == kept
        assert refined[square].all()


def test_connects_gaps_and_fills_holes() -> None:
    mask = rectangle((50, 70), np.s_[10:40, 15:55])
    edges = outline(rectangle((50, 70), np.s_[12:38, 17:53]))
    edges[12, 30:40] = False
    mask[20:25, 30:35] = False
    refined = refine_layer(mask, edges, SETTINGS)
    assert refined[20:25, 30:35].all()
    assert refined[13, 30:40].all()


def test_grows_to_the_edges_and_no_further() -> None:
    square = rectangle((50, 70), np.s_[10:40, 15:55])
    bitten = square.copy()
    bitten[16:34, 45:53] = False  # inside of the hull, open to the right
    bitten[20:30, 53:55] = False
    edges = outline(square)
    refined = refine_layer(bitten, edges, SETTINGS)
    assert refined[18:32, 46:52].all()
    assert not refined[:, 56:].any()


def test_layers_without_edges_are_dropped() -> None:
    mask = rectangle((30, 40), np.s_[5:25, 5:35])
    assert not refine_layer(mask, np.zeros_like(mask), SETTINGS).any()


def test_takes_back_what_the_window_added_to_the_near_square() -> None:
    picture, exact = square_scene()
    fattened = np.asarray(cv2.dilate(exact, np.ones((11, 11), np.uint8)), np.float32)
    found = refine(picture, all_valid(fattened))
    before, after = (np.mean(np.abs(values - exact) > 1) for values in (fattened, found.values_px))
    assert before > 0.08
    assert after < before / 3


def test_near_layers_lie_on_top_and_cracks_are_filled() -> None:
    picture, exact = square_scene()
    found = refine(picture, all_valid(exact))
    assert set(np.unique(found.values_px)) == {4.0, 20.0}
    assert (found.values_px[25:55, 45:85] == 20).all()
    assert (found.values_px[:, 8:36] == 4).all()


def test_invalid_pixels_are_in_no_layer() -> None:
    picture, exact = square_scene()
    spoilt, valid = exact.copy(), np.ones(exact.shape, np.bool_)
    spoilt[64:74, 20:60], valid[64:74, 20:60] = 12, False
    found = refine(picture, DisparityMap(spoilt, valid))
    assert (found.values_px[64:74, 20:60] == 4).all()
    assert not found.valid[64:74, 20:60].any()


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (30, 1), (2, 2), (7, 5), (3, 80)], ids=str)
@pytest.mark.parametrize("split", ["runs", "levels"])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_survives_tiny_pictures_and_invalid_maps(size: tuple[int, int], split: str, share: float) -> None:
    rng = np.random.default_rng(2)
    picture = rng.integers(0, 256, (*size, 3), np.uint8)
    values, known = rng.uniform(-9, 30, size).astype(np.float32), rng.uniform(size=size) < share
    found = refine(picture, DisparityMap(values, known), settings=ThesisDlrSettings(split, threshold=0))
    assert found.values_px.shape == found.valid.shape == size
    assert found.values_px.dtype == np.float32
    assert found.values_px.min() >= values.min()
    assert found.values_px.max() <= values.max()
    assert not (found.valid & ~known).any()


def test_follows_a_make_matcher() -> None:
    array = linear_or_grid(1, 2, 97, 81)
    pictures = Planes(array, 3, 9).pictures()
    plain, refined, other = (
        make_matcher(name).match(array, pictures, (0.0, 14.0))[0, 0]
        for name in ("sad", "sad+dlr-thesis", "sad+dlr")
    )
    assert (refined.values_px != plain.values_px).any()
    assert (refined.values_px != other.values_px).any()


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"split": "halves"}, "split: found halves, expected runs or levels"),
        ({"threshold": -1}, "threshold: found -1"),
        ({"erosion": 2}, "erosion: found 2"),
        ({"smoothing": 0}, "smoothing: found 0"),
    ],
)
def test_bad_settings_are_named(settings: dict[str, object], text: str) -> None:
    with pytest.raises(SettingError, match=text):
        ThesisDlrSettings(**settings)  # type: ignore[arg-type]
