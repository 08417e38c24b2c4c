"""Views from ahead of the cameras' plane, made of a view from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.decoding.decoder import Decoder
from mvcodec.frames import RenderedView
from mvcodec.player.ahead import move_ahead
from mvcodec.synthesis.synthesizers import make_synthesizer

SAMPLE = Path(__file__).parents[1] / "samples" / "room_2x2.mcap"
WIDTH, HEIGHT = 101, 61
RANGE = (0.0, 20.0)
ARRAY = CameraArray(3, 3, WIDTH, HEIGHT, 24.0, (0, 2), (0, 2), Calibration.nominal(WIDTH, HEIGHT))


def view(disparity_px: float) -> RenderedView:
    """A smooth picture at one disparity."""
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    pixels = np.stack([2 * columns, 4 * rows, columns + rows], axis=2).astype(np.uint8)
    shape = (HEIGHT, WIDTH)
    return RenderedView(
        Viewpoint(1, 1), pixels, np.full(shape, disparity_px, np.float32), np.ones(shape, np.uint8)
    )


@pytest.mark.parametrize(("disparity_px", "larger"), [(20.0, 1 / 0.9), (10.0, 1 / 0.95), (0.0, 1.0)])
def test_what_is_near_grows_and_infinity_stays(disparity_px: float, larger: float) -> None:
    before = view(disparity_px)
    ahead = move_ahead(before, ARRAY, RANGE, 1.0)
    middle = ((WIDTH - 1) / 2, (HEIGHT - 1) / 2)
    enlarge = np.array([[larger, 0, (1 - larger) * middle[0]], [0, larger, (1 - larger) * middle[1]]])
    expected = cv2.warpAffine(before.pixels, enlarge, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REPLICATE)
    assert np.abs(ahead.pixels.astype(int) - expected).max() <= 3
    assert np.all(ahead.seen_by == 1)


def test_something_near_hides_what_is_behind_it_and_a_hole_shows_the_background() -> None:
    before = view(0.0)
    disparity, pixels = before.disparity_px.copy(), before.pixels.copy()
    near = (slice(20, 41), slice(10, 30))
    disparity[near], pixels[near] = 20.0, 255
    ahead = move_ahead(replace(before, disparity_px=disparity, pixels=pixels), ARRAY, RANGE, 1.0)
    is_near = ahead.disparity_px == 20
    columns = np.flatnonzero(is_near[30])
    # 40 and 21 px left of the middle become 44.4 and 23.3.
    assert (columns[0], columns[-1]) == pytest.approx((5.6, 26.7), abs=1)
    holes = ahead.seen_by == 0
    assert 0 < holes.mean() < 0.03
    assert np.all(ahead.disparity_px[holes] == 0)
    assert ahead.pixels[holes][:, 0].max() < 120, "of the background, not of what is near"


def test_holes_stay_few_in_the_sample() -> None:
    with Decoder.open(SAMPLE, slice(0, 1)) as decoder:
        (decoded,) = decoder
    seen = make_synthesizer("quick").render(decoded, Viewpoint(0.5, 0.5))
    ahead = move_ahead(seen, decoded.array, decoded.disparity_range_px, 1.0)
    assert np.mean(ahead.seen_by == 0) < 0.03
    assert ahead.pixels.std() > 20
