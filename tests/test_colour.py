"""Colour conversion: exact against a plain twin, harmless to luma, right for stock players."""

from __future__ import annotations

import numpy as np
import pytest
from av.video.frame import VideoFrame
from coding import luma_psnr
from numpy.typing import NDArray
from small_arrays import photograph

from mvcodec.frames import Picture
from mvcodec.stream import TrackKind
from mvcodec.video.codec import Planes, RateControl, VideoSettings
from mvcodec.video.codecs import find_codec
from mvcodec.video.colour import even_size, forward_matrix, grey_planes, inverse_matrix, to_picture, to_planes

F32 = np.float32


def _stored(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    return (np.clip(values, F32(0), F32(255)) + F32(0.5)).astype(np.uint8)


def _plain_to_planes(rgb: Picture) -> tuple[NDArray[np.uint8], ...]:
    matrix = forward_matrix()

    def mixed(row: int, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        red, green, blue = picture[..., 0], picture[..., 1], picture[..., 2]
        r, g, b, offset = matrix[row]
        return np.asarray(r * red + g * green + b * blue + offset, F32)

    real = rgb.astype(F32)
    planes = [_stored(mixed(0, real))]
    pairs = F32(0.5) * (real[0::2] + real[1::2])
    for row in (1, 2):
        line = np.pad(mixed(row, pairs), ((0, 0), (3, 3)), mode="edge")
        width = rgb.shape[1]
        at = [line[:, shift : shift + width : 2] for shift in range(7)]
        planes.append(
            _stored(F32(0.5) * at[3] + F32(0.28125) * (at[2] + at[4]) - F32(0.03125) * (at[0] + at[6]))
        )
    return tuple(planes)


def _plain_to_picture(planes: Planes, width: int, height: int) -> Picture:
    gain, offset, red_cr, green_cb, green_cr, blue_cb = inverse_matrix()

    def full(plane: NDArray[np.uint8]) -> NDArray[np.float32]:
        rows = np.arange(height)
        near = rows // 2
        far = np.clip(near - 1 + 2 * (rows % 2), 0, plane.shape[0] - 1)
        half = F32(0.75) * plane[near].astype(F32) + F32(0.25) * plane[far].astype(F32) - F32(128)
        half = np.pad(half, ((0, 0), (1, 2)), mode="edge")
        count = plane.shape[1]
        out = np.empty((height, 2 * count), F32)
        out[:, 0::2] = half[:, 1 : count + 1]
        inner = half[:, 1 : count + 1] + half[:, 2 : count + 2]
        outer = half[:, :count] + half[:, 3 : count + 3]
        out[:, 1::2] = F32(0.5625) * inner - F32(0.0625) * outer
        return out[:, :width]

    luma = gain * planes.y[:height, :width].astype(F32) + offset
    cb, cr = full(planes.u), full(planes.v)
    channels = (luma + red_cr * cr, luma + green_cb * cb + green_cr * cr, luma + blue_cb * cb)
    return np.stack([_stored(channel) for channel in channels], axis=-1)


@pytest.mark.parametrize(("width", "height"), [(2, 2), (64, 48), (130, 6)])
def test_kernels_equal_their_plain_twins(width: int, height: int) -> None:
    rgb = np.random.default_rng(width).integers(0, 256, (height, width, 3), np.uint8)
    planes = to_planes(rgb)
    for found, expected in zip((planes.y, planes.u, planes.v), _plain_to_planes(rgb), strict=True):
        np.testing.assert_array_equal(found, expected)
    random = [np.random.default_rng(9).integers(0, 256, plane.shape, np.uint8) for plane in _three(planes)]
    noise = Planes(*random)
    expected_picture = _plain_to_picture(noise, width - 1, height - 1)
    np.testing.assert_array_equal(to_picture(noise, width - 1, height - 1), expected_picture)


def _three(planes: Planes) -> tuple[NDArray[np.uint8], ...]:
    return planes.y, planes.u, planes.v


@pytest.mark.parametrize(
    ("rgb", "yuv"),
    [
        ((0, 0, 0), (16, 128, 128)),
        ((255, 255, 255), (235, 128, 128)),
        ((255, 0, 0), (63, 102, 240)),  # BT.709 colour bars, limited range
        ((0, 255, 0), (173, 42, 26)),
        ((0, 0, 255), (32, 240, 118)),
    ],
)
def test_primaries_have_the_values_of_bt709(rgb: tuple[int, ...], yuv: tuple[int, ...]) -> None:
    planes = to_planes(np.full((4, 4, 3), rgb, np.uint8))
    assert tuple(int(plane[0, 0]) for plane in _three(planes)) == yuv
    assert np.abs(to_picture(planes, 4, 4).astype(int) - rgb).max() <= 2


@pytest.mark.parametrize("name", ["astronaut", "coffee", "chelsea"])
def test_at_qp_1_luma_survives_with_47_db(name: str) -> None:
    picture = photograph(name)[:240, :320]
    settings = VideoSettings(TrackKind.TEXTURE, 320, 240, 25.0, 25, RateControl(qp=1), "medium")
    codec = find_codec("h264")
    (coded,) = codec.encoder(settings).push(to_planes(picture), True)
    (planes,) = codec.decoder().push(coded.data, "test")
    decoded = to_picture(planes, 320, 240)
    assert luma_psnr(picture, decoded) >= 47.0
    assert abs(float(decoded.mean()) - float(picture.mean())) < 0.3


def test_a_stock_converter_shows_the_same_picture() -> None:
    picture = photograph("astronaut")
    planes = to_planes(picture)
    stacked = np.concatenate([plane.reshape(-1, 512) for plane in _three(planes)])
    frame = VideoFrame.from_ndarray(stacked, format="yuv420p")
    # FFmpeg's numbers for BT.709, limited in, full out; bicubic, accurate, full chroma
    shown = np.asarray(
        frame.reformat(
            format="rgb24",
            src_colorspace=1,
            dst_colorspace=1,
            src_color_range=1,
            dst_color_range=2,
            interpolation=0x4 | 0x40000 | 0x4000 | 0x2000,
        ).to_ndarray(),
        np.uint8,
    )
    assert luma_psnr(shown, to_picture(planes, 512, 512)) >= 47.0


def test_odd_sizes_are_padded_by_repetition_and_cropped() -> None:
    picture = np.ascontiguousarray(photograph("chelsea")[:33, :17])
    planes = to_planes(picture)
    assert planes.y.shape == (34, 18)
    assert planes.u.shape == (17, 9)
    np.testing.assert_array_equal(planes.y[33], planes.y[32])
    np.testing.assert_array_equal(planes.y[:, 17], planes.y[:, 16])
    assert to_picture(planes, 17, 33).shape == (33, 17, 3)
    assert even_size(17, 33) == (18, 34)


def test_grey_planes_carry_luma_untouched() -> None:
    luma = np.arange(15, dtype=np.uint8).reshape(3, 5)
    planes = grey_planes(luma)
    np.testing.assert_array_equal(planes.y[:3, :5], luma)
    assert planes.y.shape == (4, 6)
    assert set(np.unique(planes.u)) | set(np.unique(planes.v)) == {128}
