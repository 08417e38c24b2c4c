"""Maps made to be coded: smoothed, halved, and brought back along the edges of their pictures."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from mvcodec.encoding.config import EncoderConfig
from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap, Picture
from mvcodec.kernels.enlargement import enlarge
from mvcodec.stream import DISPARITY_CAMERAS
from mvcodec.video.disparity_rate import default_disparity_qp, default_disparity_scale
from mvcodec.video.map_size import coded_size, enlarged, small_size, to_coded

FAR_PX, NEAR_PX = 2.0, 20.0


def plain_enlarge(
    small: FloatMap, picture: Picture, small_picture: Picture, tolerance: float, step: float
) -> FloatMap:
    """The twin of `enlarge`, pixel by pixel, in float64."""
    rows, columns = small.shape
    out = np.empty(picture.shape[:2], np.float32)
    for y, x in np.ndindex(out.shape):
        fy, fx = (y - 0.5) / 2, (x - 0.5) / 2
        v, u = int(np.floor(fy)), int(np.floor(fx))
        py, px = fy - v, fx - u
        corners = [
            ((py if j else 1 - py) * (px if i else 1 - px), _at(small, v + j, u + i))
            for j in (0, 1)
            for i in (0, 1)
        ]
        values = [value for _, value in corners]
        if max(values) - min(values) <= tolerance:
            out[y, x] = sum(weight * value for weight, value in corners)
            continue
        candidates = []
        for j in range(max(y // 2 - 1, 0), min(y // 2 + 2, rows)):
            for i in range(max(x // 2 - 1, 0), min(x // 2 + 2, columns)):
                difference = np.abs(picture[y, x].astype(int) - small_picture[j, i].astype(int)).sum()
                candidates.append((difference / step + (j - fy) ** 2 + (i - fx) ** 2, float(small[j, i])))
        winner = min(candidates, key=lambda candidate: candidate[0])[1]
        agreeing = [
            (1 / (1 + cost) ** 2, value) for cost, value in candidates if abs(value - winner) <= tolerance
        ]
        out[y, x] = sum(w * value for w, value in agreeing) / sum(w for w, _ in agreeing)
    return out


def _at(small: FloatMap, row: int, column: int) -> float:
    return float(small[min(max(row, 0), small.shape[0] - 1), min(max(column, 0), small.shape[1] - 1)])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 15), st.integers(1, 15), st.sampled_from([1.0, 3.0]))
def test_the_kernel_is_its_twin(seed: int, height: int, width: int, tolerance: float) -> None:
    rng = np.random.default_rng(seed)
    size = ((height + 1) // 2, (width + 1) // 2)
    # Sixteenths of a pixel, and a step that is a power of two: the choices are free of rounding.
    small = (rng.integers(-40, 41, size) / 16 * rng.choice([0.25, 4.0])).astype(np.float32)
    picture = rng.integers(0, 256, (height, width, 3), np.uint8)
    small_picture = rng.integers(0, 256, (*size, 3), np.uint8)
    found = np.full((height, width), np.nan, np.float32)
    enlarge(small, picture, small_picture, tolerance, 32.0, found)
    expected = plain_enlarge(small, picture, small_picture, tolerance, 32.0)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)


def two_surfaces(edge: int, height: int = 24, width: int = 41) -> tuple[Picture, FloatMap]:
    """A dark near surface left of column `edge`, a bright far one right of it; picture and true map, px."""
    picture = np.full((height, width, 3), 200, np.uint8)
    picture[:, :edge] = 40
    disparity = np.full((height, width), FAR_PX, np.float32)
    disparity[:, :edge] = NEAR_PX
    return picture, disparity


@pytest.mark.parametrize("edge", [16, 17, 18, 19])
def test_edges_come_back_where_the_picture_has_them(edge: int) -> None:
    picture, disparity = two_surfaces(edge)
    codes = np.rint(disparity * 10).astype(np.uint8)
    found = enlarged(np.float32(0.1) * to_coded(codes, 2, 0).astype(np.float32), picture)
    assert found.valid.all()
    np.testing.assert_allclose(found.values_px, disparity, atol=0.01)


def test_slanted_surfaces_come_back_without_stairs() -> None:
    height, width = 20, 30
    rows, columns = np.mgrid[:height, :width]
    plane = (0.3 * columns + 0.2 * rows + 1).astype(np.float32)
    middles = plane.reshape(height // 2, 2, width // 2, 2).mean((1, 3)).astype(np.float32)
    picture = np.random.default_rng(1).integers(0, 256, (height, width, 3), np.uint8)
    inside = (slice(1, -1), slice(1, -1))
    np.testing.assert_allclose(enlarged(middles, picture).values_px[inside], plane[inside], atol=1e-4)


@pytest.mark.parametrize(("height", "width"), [(1, 1), (1, 8), (17, 33), (12, 10)])
def test_halving_takes_the_second_nearest_of_four(height: int, width: int) -> None:
    codes = np.random.default_rng(7).integers(0, 256, (height, width), np.uint8)
    padded = np.pad(codes, ((0, height % 2), (0, width % 2)), mode="edge")
    found = to_coded(codes, 2, 0)
    assert found.shape == small_size(width, height, 2)[::-1]
    for row, column in np.ndindex(found.shape):
        block = padded[2 * row : 2 * row + 2, 2 * column : 2 * column + 2]
        assert found[row, column] == sorted(block.ravel())[2]


def test_smoothing_drops_specks_and_keeps_surfaces() -> None:
    codes = np.full((30, 30), 50, np.uint8)
    codes[:, 15:] = 150
    expected = codes.copy()
    codes[8, 7] = codes[20, 22] = 255
    np.testing.assert_array_equal(to_coded(codes, 1, 7), expected)
    np.testing.assert_array_equal(to_coded(codes, 1, 0), codes)


def test_maps_are_coded_at_even_sizes() -> None:
    assert coded_size(33, 17, 1) == (34, 18)
    assert coded_size(33, 17, 2) == (18, 10)
    assert coded_size(960, 640, 2) == (480, 320)


@pytest.mark.parametrize("window", [-1, 1, 2, 4, 17])
def test_windows_that_no_median_has_are_refused(window: int) -> None:
    with pytest.raises(
        SettingError, match=rf"disparity_median: found {window}, expected 0 \(off\) or an odd"
    ):
        EncoderConfig(disparity_median=window)


def test_scales_that_the_format_lacks_are_refused() -> None:
    with pytest.raises(SettingError, match="disparity_scale: found 3, expected 1 or 2"):
        EncoderConfig(disparity_scale=3)


def test_model_halves_maps_of_coarse_pictures_only() -> None:
    scales = [default_disparity_scale(qp, "h264", 960, 640) for qp in range(1, 52)]
    assert scales == sorted(scales)
    assert set(scales) == {1, 2}
    assert default_disparity_scale(40, "h264", 960, 62) == 1
    assert default_disparity_scale(None, "h264", 960, 640) == 2


@pytest.mark.parametrize(("codec", "top"), [("h264", 51), ("hevc", 51), ("av1", 63)])
def test_model_quantises_small_maps_finer_and_stays_within_the_scale(codec: str, top: int) -> None:
    for scale, cameras in itertools.product((1, 2), DISPARITY_CAMERAS):
        qps = [default_disparity_qp(qp, scale, cameras, (0.0, 64.0), codec) for qp in range(1, top + 1)]
        assert qps == sorted(qps)
        assert min(qps) >= 1
        assert max(qps) <= top
    small, whole = (default_disparity_qp(30, scale, "all", (0.0, 64.0), codec) for scale in (2, 1))
    assert default_disparity_qp(30, 2, "alternate", (0.0, 64.0), codec) < small < whole


def test_model_keeps_the_error_in_pixels_where_the_range_is_wider() -> None:
    """Six QPs are a quantiser's step twice as wide."""

    def model(width_px: float) -> int:
        return default_disparity_qp(40, 2, "all", (-10.0, width_px - 10))

    assert model(160.0) == model(80.0) - 6
    assert model(8.0) == model(64.0) == 40


def mean_error_px(picture: NDArray[np.uint8], small: FloatMap, truth: FloatMap) -> float:
    """Mean absolute error of the enlarged map, px."""
    return float(np.abs(enlarged(small, picture).values_px - truth).mean())


def test_the_picture_helps_at_curved_edges() -> None:
    """Without a picture the edge of a disc is known to two pixels only."""
    rows, columns = np.mgrid[:60, :60]
    disc = (rows - 29.3) ** 2 + (columns - 30.8) ** 2 < 19**2
    truth = np.where(disc, NEAR_PX, FAR_PX).astype(np.float32)
    small = np.float32(0.1) * to_coded(np.rint(truth * 10).astype(np.uint8), 2, 0).astype(np.float32)
    coloured = np.repeat(np.where(disc, 40, 200).astype(np.uint8)[..., None], 3, axis=2)
    plain = np.full_like(coloured, 100)
    assert mean_error_px(coloured, small, truth) < 0.1 * mean_error_px(plain, small, truth)
