"""Overlays and stereo pictures show what they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Viewpoint
from mvcodec.frames import DecodedSet, Picture, RenderedView
from mvcodec.output import stereoscopic
from mvcodec.player import overlays
from mvcodec.player.looks import EYES
from mvcodec.synthesis.linear import Linear

ARRAY = grid(3, 5, 96, 64, step=2)
SCENE = PlaneScene(ARRAY, 4, (Plane(12, (20, 40, 50, 80)),))
PLACE = Viewpoint(1.0, 1.0)


def seen_by(eyes: str, viewpoint: Viewpoint, steps: float) -> Picture:
    decoded = SCENE.decoded()
    views = [Linear().render(decoded, place) for place in EYES[eyes].place(ARRAY, viewpoint, steps)]
    return EYES[eyes].combine([view.pixels for view in views])


def rendered(viewpoint: Viewpoint = PLACE) -> tuple[DecodedSet, RenderedView]:
    decoded = SCENE.decoded()
    return decoded, Linear().render(decoded, viewpoint)


def test_disparity_colours_are_those_of_the_scale() -> None:
    decoded, view = rendered()
    low, high = decoded.disparity_range_px
    flat = RenderedView(
        PLACE,
        view.pixels,
        np.linspace(low, high, view.pixels.shape[1], dtype=np.float32)[None].repeat(4, 0),
        view.seen_by,
    )
    picture, legend = overlays.disparity(decoded, flat)
    colours = ["#{:02x}{:02x}{:02x}".format(*picture[0, x]) for x in (0, -1)]
    assert colours == [legend["colours"][0], legend["colours"][-1]]
    assert (legend["low"], legend["high"]) == (low, high)
    assert "px" in legend["text"]


def test_layers_have_a_colour_each_and_shares_of_the_picture() -> None:
    decoded, view = rendered(Viewpoint(0, 0))
    view = RenderedView(view.viewpoint, np.full_like(view.pixels, 90), view.disparity_px, view.seen_by)
    picture, legend = overlays.layers(decoded, view)
    near = view.disparity_px == 12
    assert len(np.unique(picture[near], axis=0)) == 1
    assert len(np.unique(picture[~near], axis=0)) == 1
    shares = {item["text"]: item["share"] for item in legend["items"] if item["share"]}
    assert shares == {
        "4 px": pytest.approx(1 - near.mean(), abs=1e-4),
        "12 px": pytest.approx(near.mean(), abs=1e-4),
    }
    assert len({item["colour"] for item in legend["items"]}) == len(legend["items"])


def test_provenance_counts_cameras() -> None:
    decoded, view = rendered()
    seen: NDArray[np.uint8] = np.zeros_like(view.seen_by)
    for count in range(5):
        seen[:, count::5] = count
    _, legend = overlays.provenance(
        decoded, RenderedView(view.viewpoint, view.pixels, view.disparity_px, seen)
    )
    texts = [item["text"] for item in legend["items"]]
    assert texts == ["filled, no camera", "1 camera", "2 cameras", "3 cameras", "4 cameras"]
    assert [item["share"] for item in legend["items"]] == pytest.approx([0.2] * 5, abs=0.01)


def test_difference_is_to_the_original_in_levels() -> None:
    _, view = rendered(Viewpoint(0, 2))
    assert not overlays.difference(view, view.pixels)[0].any()
    original = np.bitwise_xor(view.pixels, np.uint8(4))
    assert (overlays.difference(view, original)[0] == 4 * overlays.DIFFERENCE_GAIN).all()


def test_disagreement_is_how_much_the_warped_cameras_differ() -> None:
    decoded, view = rendered()
    same, legend = overlays.disagreement(decoded, view)
    assert "Disagreement" in legend["text"]
    camera = decoded.array.real[0]
    brighter = np.minimum(decoded.pictures[camera].astype(int) + 20, 255).astype(np.uint8)
    pictures = {**decoded.pictures, camera: brighter}
    spoiled, _ = overlays.disagreement(replace(decoded, pictures=pictures), view)
    assert np.median(same) < 20
    assert np.median(spoiled) > 50


@given(st.floats(0, 2), st.floats(0, 4), st.floats(0, 9))
def test_eyes_keep_their_distance_inside_the_array(row: float, col: float, eyes: float) -> None:
    for place in (stereoscopic.two_eyes, stereoscopic.nine_places):
        viewpoints = place(ARRAY, Viewpoint(row, col), eyes)
        for viewpoint in viewpoints:
            ARRAY.check_viewpoint(viewpoint)
        cols = np.array([viewpoint.col for viewpoint in viewpoints])
        step = min(eyes, (ARRAY.cols - 1) / (len(cols) - 1))
        np.testing.assert_allclose(np.diff(cols), step, atol=1e-9)


def test_one_column_has_no_stereo() -> None:
    column = grid(3, 1, 96, 64, step=2)
    left, right = stereoscopic.two_eyes(column, Viewpoint(1, 0), 0.5)
    assert left == right == Viewpoint(1, 0)


def test_each_eye_sees_its_own_picture_through_the_glasses() -> None:
    black, white = np.zeros((8, 8, 3), np.uint8), np.full((8, 8, 3), 255, np.uint8)
    left_only, right_only = (
        stereoscopic.anaglyph(white, black)[0, 0],
        stereoscopic.anaglyph(black, white)[0, 0],
    )
    np.testing.assert_allclose(left_only, [255, 0, 0], atol=12)
    np.testing.assert_allclose(right_only, [0, 255, 255], atol=12)
    np.testing.assert_allclose(stereoscopic.anaglyph(white, white)[0, 0], 255, atol=2)


def test_side_by_side_and_nine_views_lie_in_order() -> None:
    decoded = SCENE.decoded()
    pair = seen_by("side by side", Viewpoint(0, 2), 4.0)
    np.testing.assert_array_equal(pair, np.hstack([decoded.pictures[0, 0], decoded.pictures[0, 4]]))
    sheet = seen_by("nine", Viewpoint(0, 2), 0.5)
    height, width = ARRAY.height, ARRAY.width
    np.testing.assert_array_equal(sheet[:height, :width], decoded.pictures[0, 0])
    np.testing.assert_array_equal(sheet[height : 2 * height, width : 2 * width], decoded.pictures[0, 2])
    np.testing.assert_array_equal(sheet[2 * height :, 2 * width :], decoded.pictures[0, 4])
