"""Pictures, videos and mosaics out: what was written is what was given, or nothing is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from array_files import Broken, break_off, files_in, picture_of
from numpy.typing import NDArray

from mvcodec.array import Viewpoint
from mvcodec.capture.picture_files import read_picture
from mvcodec.capture.truth import read_pfm
from mvcodec.capture.video_input import VideoView
from mvcodec.errors import OutputError, SettingError, StreamClosed
from mvcodec.frames import Picture
from mvcodec.output.atomic import replacing, write_bytes
from mvcodec.output.mosaic import ERROR_GAIN, contact_sheet, error_picture, mosaic
from mvcodec.output.pictures import viewpoint_name, write_pfm, write_png
from mvcodec.output.video_file import Mp4Writer
from mvcodec.scenes.textures import photograph


def luma_psnr(a: NDArray[Any], b: NDArray[Any]) -> float:
    error = (a.astype(np.float64) - b) @ [0.299, 0.587, 0.114]
    return float(10 * np.log10(255**2 / np.mean(error**2)))


# Complete or not at all


def test_an_error_half_way_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a" / "x.png"
    write_bytes(path, b"old")
    with pytest.raises(Broken):
        break_off(replacing(path), lambda part: part.write_bytes(b"half"))
    assert path.read_bytes() == b"old"
    assert files_in(tmp_path) == {"a/x.png"}


def test_the_systems_reason_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(OutputError, match=r"file/x\.png: cannot be written: (Not a directory|File exists)"):
        write_png(tmp_path / "file" / "x.png", picture_of((0, 0), 0))
    (tmp_path / "x.png").mkdir()
    with pytest.raises(OutputError, match=r"x\.png: cannot be written: Is a directory"):
        write_png(tmp_path / "x.png", picture_of((0, 0), 0))
    assert files_in(tmp_path) == {"file"}


@pytest.mark.parametrize("size", [(24, 16), (1, 1), (31, 7)])
def test_png_and_pfm_are_exact(tmp_path: Path, size: tuple[int, int]) -> None:
    chance = np.random.default_rng(5)
    picture = chance.integers(0, 256, (size[1], size[0], 3)).astype(np.uint8)
    write_png(tmp_path / "x.png", picture)
    np.testing.assert_array_equal(read_picture(tmp_path / "x.png"), picture)
    values = chance.normal(size=(size[1], size[0])).astype(np.float32)
    values[0, 0] = np.nan
    write_pfm(tmp_path / "x.pfm", values)
    np.testing.assert_array_equal(read_pfm(tmp_path / "x.pfm"), values)


@pytest.mark.parametrize(
    ("row", "col", "name"),
    [(0, 4, "r00_c04"), (16.0, 3.0, "r16_c03"), (0.5, 1.25, "r0.500_c1.250"), (2, 0.5, "r2.000_c0.500")],
)
def test_names_of_views(row: float, col: float, name: str) -> None:
    assert viewpoint_name(Viewpoint(row, col)) == name


# Video files


@pytest.mark.parametrize("size", [(64, 48), (63, 48), (64, 47), (33, 17)])
def test_mp4_is_tagged_padded_and_close(tmp_path: Path, size: tuple[int, int]) -> None:
    width, height = size
    pictures = [photograph("coffee")[at : at + height, at : at + width] for at in range(100, 112, 3)]
    path = tmp_path / "new" / "v.mp4"
    with Mp4Writer(path, width, height, 23.976, crf=4) as writer:
        for picture in pictures:
            writer.push(picture)
        assert not path.exists()
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        context = stream.codec_context
        assert (context.name, context.pix_fmt, stream.frames) == ("h264", "yuv420p", 4)
        assert (int(context.colorspace), int(context.color_range)) == (1, 1)
        assert (int(context.color_primaries), int(context.color_trc)) == (1, 1)
        assert float(stream.average_rate or 0) == pytest.approx(23.976, rel=1e-4)
    view = VideoView(path)
    assert view.size == (width + width % 2, height + height % 2)
    for found, given in zip(view.pictures(range(4)), pictures, strict=True):
        assert luma_psnr(found[:height, :width], given) > 38
    assert files_in(tmp_path) == {"new/v.mp4"}


def test_broken_off_videos_leave_nothing(tmp_path: Path) -> None:
    with pytest.raises(Broken):
        break_off(Mp4Writer(tmp_path / "v.mp4", 24, 16, 10.0), lambda it: it.push(picture_of((0, 0), 0)))
    with pytest.raises(OutputError, match="without a picture"):
        Mp4Writer(tmp_path / "v.mp4", 24, 16, 10.0).close()
    assert files_in(tmp_path) == set()


def test_mp4_refuses_other_sizes_and_pushes_after_the_end(tmp_path: Path) -> None:
    writer = Mp4Writer(tmp_path / "v.mp4", 24, 16, 10.0)
    with pytest.raises(OutputError, match="a picture of 20x16 px in a video of 24x16"):
        writer.push(picture_of((0, 0), 0, (20, 16)))
    writer.push(picture_of((0, 0), 0))
    writer.close()
    writer.close()
    writer.abort()
    with pytest.raises(StreamClosed):
        writer.push(picture_of((0, 0), 0))
    assert files_in(tmp_path) == {"v.mp4"}
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(OutputError, match=r"v\.mp4: cannot be written"):
        Mp4Writer(tmp_path / "file" / "v.mp4", 24, 16, 10.0)


# Mosaics


def test_mosaic_places_views_and_never_enlarges() -> None:
    pictures = [[picture_of((row, col), 0) for col in range(3)] for row in range(2)]
    whole = mosaic(pictures)
    assert whole.shape == (32, 72, 3)
    for row in range(2):
        for col in range(3):
            tile = whole[16 * row : 16 * row + 16, 24 * col : 24 * col + 24]
            np.testing.assert_array_equal(tile, pictures[row][col])


@pytest.mark.parametrize("max_size", [(40, 400), (400, 20), (30, 30)])
def test_mosaic_fits(max_size: tuple[int, int]) -> None:
    whole = mosaic([[photograph("coffee")] * 3] * 2, max_size)
    assert whole.shape[1] <= max_size[0]
    assert whole.shape[0] <= max_size[1]
    assert abs(whole.mean() - photograph("coffee").mean()) < 2


def test_mosaic_needs_a_grid_of_equal_pictures() -> None:
    one, other = picture_of((0, 0), 0), picture_of((0, 0), 0, (20, 16))
    bads: list[list[list[Picture]]] = [[], [[]], [[one, one], [one]], [[one, other]]]
    for bad in bads:
        with pytest.raises(SettingError, match="pictures"):
            mosaic(bad)


def test_contact_sheet_writes_labels_beside_untouched_pictures() -> None:
    picture = photograph("coffee")[:90, :120]
    plain = contact_sheet([[picture] * 2] * 2, [["", ""]] * 2)
    labelled = contact_sheet([[picture] * 2] * 2, [["0,0", "0,1"], ["1,0", "1,1"]])
    assert plain.shape == labelled.shape
    assert plain.shape[1] >= 240
    changed = (plain != labelled).any(axis=(1, 2))
    top = 4
    assert not changed[: top + 90].any()
    assert changed[top + 90 :].any()
    np.testing.assert_array_equal(labelled[top : top + 90, 4:124], picture)
    with pytest.raises(SettingError, match="labels"):
        contact_sheet([[picture]], [["a", "b"]])


def test_error_picture_shows_both_and_the_difference() -> None:
    original = photograph("coffee")[:60, :80]
    synthesised = original.copy()
    synthesised[10:20, 10:20, 1] ^= 8
    shown = error_picture(original, synthesised)
    tiles = [shown[4:64, 4 + 84 * number : 84 + 84 * number] for number in range(3)]
    np.testing.assert_array_equal(tiles[0], original)
    np.testing.assert_array_equal(tiles[1], synthesised)
    expected = np.zeros_like(original)
    expected[10:20, 10:20] = 8 * ERROR_GAIN
    np.testing.assert_array_equal(tiles[2], expected)
    with pytest.raises(SettingError, match="80x60 px as the original"):
        error_picture(original, original[:50])
