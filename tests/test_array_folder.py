"""Array folders in: every legal form, their ground truth, ranges of frames and reading ahead."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from array_files import make_folder, picture_of, rewrite, save, save_planes
from numpy.typing import NDArray
from PIL import Image

from mvcodec.array import Calibration
from mvcodec.capture import open_input, resolve_frames
from mvcodec.capture.bit_depth import BitDepth
from mvcodec.capture.picture_files import picture_size, read_picture
from mvcodec.capture.reading import Reading
from mvcodec.capture.truth import read_map, read_pfm
from mvcodec.errors import InputError, MvCodecWarning, SettingError

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


def test_views_are_read_in_their_places(tmp_path: Path) -> None:
    source = open_input([make_folder(tmp_path / "a")], real="all")
    assert (source.array.rows, source.array.cols, source.array.fps) == (2, 3, 10.0)
    assert (source.array.width, source.array.height, source.frame_count) == (24, 16, 2)
    assert (source.array.name, source.name) == ("small", str(tmp_path / "a"))
    assert (source.first_frame, source.listed_real) == (0, None)
    sets = list(source.frame_sets())
    assert [(item.index, item.time_ns) for item in sets] == [(0, 0), (1, 100_000_000)]
    for item in sets:
        assert set(item.pictures) == set(source.array.positions)
        for position, picture in item.pictures.items():
            np.testing.assert_array_equal(picture, picture_of(position, item.index))


def test_real_cameras_are_read_unless_others_are_asked_for(tmp_path: Path) -> None:
    source = open_input([make_folder(tmp_path)])
    assert set(next(source.frame_sets()).pictures) == {(0, 0), (0, 2), (1, 0), (1, 2)}
    assert set(next(source.frame_sets(views=[(0, 1)])).pictures) == {(0, 1)}
    with pytest.raises(SettingError, match=r"views: found 2,0, expected a view of the 2x3 grid"):
        source.frame_sets(views=[(2, 0)])


def test_a_file_of_ours_is_no_array_of_pictures(tmp_path: Path) -> None:
    (tmp_path / "x.mcap").touch()
    with pytest.raises(InputError, match=r"x\.mcap: found an MCAP file, expected an array folder or video"):
        open_input(tmp_path / "x.mcap")
    (tmp_path / "x.mp4").touch()
    with pytest.raises(SettingError, match=r"grid: found nothing, expected an array folder, or `split` RxC"):
        open_input(tmp_path / "x.mp4")


def test_manifest_may_be_named_itself(tmp_path: Path) -> None:
    folder = make_folder(tmp_path)
    assert open_input([folder / "array.json"]).array == open_input([folder]).array


def test_pictures_may_lie_elsewhere(tmp_path: Path) -> None:
    make_folder(tmp_path / "pool", 1, 1, 1)
    rewrite(tmp_path / "a", {"rows": 1, "cols": 1, "views": [[["../pool/cam/00_0.png"]]]})
    assert open_input([tmp_path / "a"]).frame_count == 1


def test_pattern_of_pictures(tmp_path: Path) -> None:
    for col in range(3):
        for frame in range(2):
            save(tmp_path / f"r00_c{col:02d}" / f"{frame:06d}.png", picture_of((0, col), frame))
    pattern = "r{row:02d}_c{col:02d}/{frame:06d}.png"
    rewrite(tmp_path, {"rows": 1, "cols": 3, "pattern": pattern, "frames": 2})
    source = open_input([tmp_path], real="all")
    assert (source.frame_count, source.array.fps, source.array.name) == (2, 15.0, tmp_path.name)
    last = next(source.frame_sets(slice(1, None)))
    assert last.index == 1
    np.testing.assert_array_equal(last.pictures[0, 2], picture_of((0, 2), 1))


@pytest.mark.parametrize("form", ["pattern", "views"])
def test_video_file_for_each_view(tmp_path: Path, form: str) -> None:
    for col in range(2):
        save_planes(tmp_path / f"v{col}.mkv", [np.full((3, 8, 12), 60 + 90 * col, np.uint8)] * 3, fps=20)
    document: dict[str, Any] = {"rows": 1, "cols": 2, "fps": 99}
    document |= {"pattern": "v{col}.mkv"} if form == "pattern" else {"views": [["v0.mkv", "v1.mkv"]]}
    source = open_input([rewrite(tmp_path, document)])
    assert (source.frame_count, source.array.fps, source.array.width) == (3, 20.0, 12)
    pictures = next(source.frame_sets()).pictures
    assert pictures[0, 0].mean() < pictures[0, 1].mean()


def test_facts_of_the_manifest_reach_the_array(tmp_path: Path) -> None:
    calibration = {"fx_px": 20, "fy_px": 21.0, "cx_px": 12, "cy_px": 8, "baseline_m": 0.2}
    facts = {
        "rho": 1.5,
        "calibration": calibration,
        "disparity_per_step_px": [-1, 2.5],
        "real": [[0, 0], [1, 2]],
        "first_frame": 7,
    }
    source = open_input([make_folder(tmp_path, changes=facts)])
    assert source.array.calibration == Calibration(20, 21, 12, 8, 0.2, 0.0)
    assert (source.array.rho, source.array.disparity_per_step_px) == (1.5, (-1.0, 2.5))
    assert (source.first_frame, source.listed_real) == (7, ((0, 0), (1, 2)))
    assert [(item.index, item.time_ns) for item in source.frame_sets()] == [
        (7, 700_000_000),
        (8, 800_000_000),
    ]


def test_without_calibration_it_is_nominal(tmp_path: Path) -> None:
    calibration = open_input([make_folder(tmp_path)]).array.calibration
    assert calibration == Calibration.nominal(24, 16)
    assert not calibration.given


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".ppm", ".bmp", ".tiff"])
def test_picture_formats(tmp_path: Path, suffix: str) -> None:
    y, x = np.mgrid[:20, :30]
    picture = np.stack([4 * x + 20, 5 * y + 30, 2 * x + 2 * y + 60], axis=-1).astype(np.uint8)
    save(tmp_path / f"p{suffix}", picture)
    assert picture_size(tmp_path / f"p{suffix}") == (30, 20)
    error = np.abs(read_picture(tmp_path / f"p{suffix}").astype(int) - picture)
    assert error.max() <= (12 if suffix == ".jpg" else 0)


@pytest.mark.parametrize("suffix", [".png", ".pgm", ".jpg"])
def test_grey_picture_becomes_three_equal_channels(tmp_path: Path, suffix: str) -> None:
    save(tmp_path / f"g{suffix}", np.full((6, 7), 90, np.uint8))
    picture = read_picture(tmp_path / f"g{suffix}")
    assert picture.shape == (6, 7, 3)
    assert (picture == 90).all()


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("deep.png", (6, 7, 3)),
        ("deep.png", (6, 7)),
        ("deep.ppm", (6, 7, 3)),
        ("deep.pgm", (6, 7)),
        ("deep.tiff", (6, 7, 3)),
        ("deep.tiff", (6, 7)),
    ],
)
def test_pictures_of_sixteen_bits_keep_their_levels(
    tmp_path: Path, name: str, shape: tuple[int, ...]
) -> None:
    values = np.linspace(20000, 65535, 42).astype(np.uint16)
    save(tmp_path / name, np.resize(values, shape))
    expected = np.resize(np.round(values / 257), shape).reshape(6, 7, -1)
    assert np.abs(read_picture(tmp_path / name).astype(int) - expected).max() <= 1


@pytest.mark.parametrize("bits", [10, 12])
def test_pictures_that_use_fewer_bits_than_they_have_are_not_black(tmp_path: Path, bits: int) -> None:
    values = np.linspace(0, (1 << bits) - 1, 42).round().astype(np.uint16).reshape(6, 7)
    save(tmp_path / "deep.png", values)
    with pytest.warns(MvCodecWarning, match=rf"stay below {1 << bits}: taken as {bits} bits; `bits` N"):
        picture = read_picture(tmp_path / "deep.png")
    assert np.abs(picture[..., 0] - values * (255 / ((1 << bits) - 1))).max() <= 0.51
    stated = read_picture(tmp_path / "deep.png", depth=BitDepth("x", 16))
    assert np.abs(stated[..., 0] - values / 257).max() <= 0.51
    with pytest.raises(SettingError, match=r"^bits: found 7, expected 8\.\.16"):
        BitDepth("x", 7)


def test_all_cameras_of_an_array_have_one_depth(tmp_path: Path) -> None:
    for col, brightest in enumerate((900, 4000)):
        save(tmp_path / f"{col}.png", np.full((16, 24), brightest, np.uint16))
    document = '{"rows": 1, "cols": 2, "views": [[["0.png"], ["1.png"]]]}'
    (tmp_path / "array.json").write_text(document)
    with pytest.warns(MvCodecWarning, match="taken as 12 bits"):
        (item,) = open_input([tmp_path]).frame_sets()
    assert [picture.max() for picture in item.pictures.values()] == [56, 249]


def test_a_picture_is_turned_as_its_exif_says(tmp_path: Path) -> None:
    image = Image.fromarray(picture_of((0, 0), 0))
    exif = image.getexif()
    exif[0x112] = 6
    image.save(tmp_path / "turned.png", exif=exif)
    assert picture_size(tmp_path / "turned.png") == (16, 24)
    np.testing.assert_array_equal(read_picture(tmp_path / "turned.png"), np.rot90(np.array(image), 3))


@pytest.mark.parametrize("damage", ["gone", "cut"])
def test_unreadable_pictures_cost_their_frame_set_where_that_is_wanted(tmp_path: Path, damage: str) -> None:
    folder = make_folder(tmp_path, 1, 2, 3)
    path = folder / "cam" / "01_1.png"
    path.unlink() if damage == "gone" else path.write_bytes(path.read_bytes()[:60])
    told: list[InputError] = []
    source = open_input([folder], reading=Reading(on_unreadable=told.append))
    assert [item.index for item in source.frame_sets()] == [0, 2]
    assert [error.source for error in told] == [str(path)]
    with pytest.raises(InputError, match=r"01_1\.png"):
        list(open_input([folder]).frame_sets())


# Ground truth


def _truth_source(folder: Path, truth: dict[str, Any]) -> Any:
    return open_input([make_folder(folder, 1, 3, 2, changes={"truth": truth})])


@pytest.mark.parametrize(("suffix", "dtype"), [(".png", np.uint8), (".png", np.uint16), (".pgm", np.uint16)])
def test_truth_is_for_one_step_and_knows_what_is_unknown(tmp_path: Path, suffix: str, dtype: type) -> None:
    values: NDArray[Any] = np.full((16, 24), 48, dtype)
    values[0, 0] = 0
    save(tmp_path / f"t{suffix}", values)
    entry = {"file": f"t{suffix}", "scale": 4.0, "invalid": 0, "steps": -2}
    source = _truth_source(tmp_path, {"r00_c02": entry})
    for frame in (0, 1):
        truth = source.truth((0, 2), frame)
        assert not truth.valid[0, 0]
        assert truth.values_px[0, 0] == 0
        assert truth.valid.sum() == values.size - 1
        assert (truth.values_px[truth.valid] == 6).all()
    assert source.truth((0, 0), 0) is None


@pytest.mark.parametrize("order", ["<", ">"])
def test_pfm_rows_are_bottom_up_and_infinity_is_unknown(tmp_path: Path, order: str) -> None:
    values = np.arange(16 * 24, dtype=np.float32).reshape(16, 24)
    values[3, 4] = np.inf
    scale = b"-1.0" if order == "<" else b"1.0"
    data = b"Pf\n24 16\n" + scale + b"\n" + values[::-1].astype(f"{order}f4").tobytes()
    (tmp_path / "t.pfm").write_bytes(data)
    np.testing.assert_array_equal(read_pfm(tmp_path / "t.pfm"), values)
    truth = _truth_source(tmp_path, {"r00_c00": {"file": "t.pfm"}}).truth((0, 0), 1)
    assert not truth.valid[3, 4]
    assert truth.values_px[5, 6] == values[5, 6]


@pytest.mark.parametrize("files", ["t{frame}.png", ["t0.png", "t1.png"]])
def test_truth_for_each_frame(tmp_path: Path, files: str | list[str]) -> None:
    for frame in (0, 1):
        save(tmp_path / f"t{frame}.png", np.full((16, 24), 10 + frame, np.uint8))
    source = _truth_source(tmp_path, {"r00_c01": {"file": files, "scale": 1}})
    assert [source.truth((0, 1), frame).values_px[0, 0] for frame in (0, 1)] == [10, 11]


def test_bad_truth_files(tmp_path: Path) -> None:
    save(tmp_path / "small.png", np.zeros((4, 4), np.uint8))
    save(tmp_path / "colour.png", np.zeros((16, 24, 3), np.uint8))
    (tmp_path / "short.pfm").write_bytes(b"Pf\n24 16\n-1.0\n" + bytes(8))
    (tmp_path / "rgb.pfm").write_bytes(b"PF\n1 1\n-1.0\n" + bytes(12))
    (tmp_path / "no.pfm").write_bytes(b"hello")
    for name, reason in (
        ("small.png", "4x4 px"),
        ("colour.png", "3 channels"),
        ("short.pfm", "8 bytes of pixels"),
        ("rgb.pfm", "three channels"),
        ("no.pfm", "no PFM header"),
        ("gone.png", "no such file"),
        ("gone.pfm", "No such file"),
    ):
        source = _truth_source(tmp_path, {"r00_c00": {"file": name}})
        with pytest.raises(InputError, match=rf"{name}: found .*{reason}"):
            source.truth((0, 0), 0)
    with pytest.raises(InputError, match="3 channels"):
        read_map(tmp_path / "colour.png")


# Frame ranges and reading ahead


@pytest.mark.parametrize(
    ("frames", "expected"),
    [
        (None, range(5)),
        (slice(1, 3), range(1, 3)),
        (slice(None, 2), range(2)),
        (slice(-2, None), range(3, 5)),
        (slice(3, 99), range(3, 5)),
    ],
)
def test_frames_are_a_python_slice(frames: slice | None, expected: range) -> None:
    assert resolve_frames(frames, 5, "x") == expected


@pytest.mark.parametrize("frames", [slice(5, None), slice(3, 3), slice(4, 2), slice(0, 5, 2)])
def test_empty_slices_and_steps_are_refused(frames: slice) -> None:
    with pytest.raises(SettingError, match=r"^frames: found"):
        resolve_frames(frames, 5, "x")


def test_reading_is_one_frame_set_ahead_at_most(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = open_input([make_folder(tmp_path, 1, 1, 6)])
    read: list[str] = []

    def counting(path: Path, size: tuple[int, int], depth: BitDepth) -> Any:
        read.append(path.name)
        return read_picture(path, size, depth)

    monkeypatch.setattr("mvcodec.capture.view_array.read_picture", counting)
    sets = source.frame_sets()
    for number in range(3):
        next(sets)
        assert number + 1 <= len(read) <= number + 2
    sets.close()  # type: ignore[attr-defined]
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("mvcodec-read")]


@pytest.mark.shared_data
@pytest.mark.skipif(not SHARED.is_dir(), reason="../shared/data is absent")
@pytest.mark.parametrize(
    ("name", "grid", "frames", "view", "range_px"),
    [
        ("cones", (1, 3), 1, (0, 2), (2, 28)),
        ("tsukuba", (1, 5), 1, (0, 2), (4, 15)),
        ("antinous", (9, 9), 1, (4, 4), (-3.3, 2.9)),
        ("shop_v4", (3, 3), 16, None, None),
    ],
)
def test_real_arrays(
    name: str,
    grid: tuple[int, int],
    frames: int,
    view: tuple[int, int] | None,
    range_px: tuple[float, float] | None,
) -> None:
    source = open_input([SHARED / name])
    assert ((source.array.rows, source.array.cols), source.frame_count) == (grid, frames)
    assert next(source.frame_sets(slice(0, 1))).pictures[0, 0].shape == (
        source.array.height,
        source.array.width,
        3,
    )
    if view is not None and range_px is not None:
        truth = source.truth(view, 0)
        assert truth is not None
        known = truth.values_px[truth.valid]
        assert range_px[0] <= known.min() < known.max() <= range_px[1]
