"""Comparing arrays: pairing by frame number, classes of views, means, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from statistics import fmean

import numpy as np
import pytest
from command_line import fails, succeeds
from small_arrays import HEIGHT, WIDTH, picture, write_array

from mvcodec.array import Position
from mvcodec.capture import open_input
from mvcodec.capture.picture_files import read_picture
from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.evaluation.comparison import common_frame_count, compare
from mvcodec.evaluation.flicker import temporal_psnr
from mvcodec.evaluation.immersive import iv_psnr
from mvcodec.evaluation.metrics import psnr, ssim, ssim_picture
from mvcodec.evaluation.quality import Comparison, QualityMeter
from mvcodec.frames import Picture
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter

REAL = ((0, 0), (0, 2))


def spoilt(view: Position, frame: int) -> Picture:
    """Worse with each column and frame; nothing wrong in column 0."""
    noise = np.random.default_rng(frame).normal(0, view[1] * (2 + frame), (HEIGHT, WIDTH, 3))
    return np.clip(picture(view, frame) + noise, 0, 255).astype(np.uint8)


def write_decoded(folder: Path, frames: range, **facts: object) -> Path:
    stated = ArrayFacts(1, 3, fps=10.0, first_frame=frames.start, **facts)  # type: ignore[arg-type]
    with ArrayFolderWriter(folder, stated) as writer:
        for frame in frames:
            writer.push({(0, col): spoilt((0, col), frame) for col in range(3)})
    return folder


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("original"), 1, 3, 5)


def run(original: Path, decoded: Path, frames: slice | None = None) -> Comparison:
    return compare(open_input([original]), open_input([decoded]), frames)


def test_figures_are_means_of_the_pictures_of_each_class(original: Path, tmp_path: Path) -> None:
    result = run(original, write_decoded(tmp_path, range(5), real=REAL))
    figures = {
        col: [(picture((0, col), frame), spoilt((0, col), frame)) for frame in range(5)] for col in range(3)
    }
    means = {col: fmean(psnr(a, b) for a, b in pairs) for col, pairs in figures.items()}
    similarities = {col: fmean(ssim(a, b) for a, b in pairs) for col, pairs in figures.items()}
    assert means[0] == 100.0
    assert result.psnr_y.real == pytest.approx((means[0] + means[2]) / 2)
    assert result.psnr_y.virtual == pytest.approx(means[1])
    assert result.psnr_y.all == pytest.approx(fmean(means.values()))
    assert result.psnr_y.worst == pytest.approx(means[2])
    assert result.ssim.real == pytest.approx((similarities[0] + similarities[2]) / 2)
    assert result.ssim.worst == pytest.approx(similarities[2])


def test_frames_are_paired_by_their_number_in_the_original(original: Path, tmp_path: Path) -> None:
    decoded = write_decoded(tmp_path, range(2, 4), real=REAL)
    assert run(original, decoded).views[0].psnr_y == 100.0
    assert common_frame_count(open_input([original]), open_input([decoded])) == 2


def test_frames_option_chooses_among_the_common_ones(original: Path, tmp_path: Path) -> None:
    decoded = write_decoded(tmp_path, range(1, 4), real=REAL)
    result = run(original, decoded, slice(-1, None))
    assert [view.pictures for view in result.views] == [1, 1, 1]
    assert result.views[1].psnr_y == pytest.approx(psnr(picture((0, 1), 3), spoilt((0, 1), 3)))
    with pytest.raises(SettingError, match=r"^frames: found"):
        run(original, decoded, slice(3, 5))


def test_every_view_is_virtual_where_the_folder_lists_no_real_ones(original: Path) -> None:
    result = run(original, original)
    assert result.psnr_y.to_json() == {"all": 100.0, "real": None, "virtual": 100.0, "worst": 100.0}
    assert [view.real for view in result.views] == [False] * 3


def test_json_has_the_documented_form(original: Path, tmp_path: Path) -> None:
    document = run(original, write_decoded(tmp_path, range(5), real=REAL)).to_json()
    metrics = ["psnr_y", "psnr_yuv", "ssim", "temporal_psnr_y"]
    assert list(document) == [*metrics, "views"]
    for metric in metrics:
        assert list(document[metric]) == ["all", "real", "virtual", "worst"]
    assert [(view["row"], view["col"], view["real"]) for view in document["views"]] == [
        (0, 0, True),
        (0, 1, False),
        (0, 2, True),
    ]
    assert list(document["views"][0]) == ["row", "col", "real", *metrics]


def test_flicker_is_that_of_each_view_and_needs_two_frames(original: Path, tmp_path: Path) -> None:
    decoded = write_decoded(tmp_path, range(5), real=REAL)
    result = run(original, decoded, slice(1, 4))
    expected = [
        temporal_psnr(
            [picture((0, col), frame) for frame in (1, 2, 3)],
            [spoilt((0, col), frame) for frame in (1, 2, 3)],
        )
        for col in range(3)
    ]
    assert [view.temporal_psnr_y for view in result.views] == pytest.approx(expected)
    assert result.summary("temporal_psnr_y").virtual == pytest.approx(expected[1])
    single = run(original, decoded, slice(1, 2)).to_json()
    assert "temporal_psnr_y" not in single
    assert "temporal_psnr_y" not in single["views"][0]


def test_options_add_iv_psnr_and_maps_of_the_first_frame(original: Path, tmp_path: Path) -> None:
    decoded = write_decoded(tmp_path / "d", range(5), real=REAL)
    options = (
        "compare",
        original,
        decoded,
        "--frames",
        "3:5",
        "--iv-psnr",
        "--ssim-maps",
        tmp_path / "m" / "n",
    )
    document = json.loads(succeeds(*options, "--json"))
    pairs = [(picture((0, 2), frame), spoilt((0, 2), frame)) for frame in (3, 4)]
    expected = fmean(iv_psnr(*pair) for pair in pairs)
    assert document["views"][2]["iv_psnr"] == pytest.approx(expected)
    assert document["iv_psnr"]["worst"] == pytest.approx(expected)
    maps = sorted(path.name for path in (tmp_path / "m" / "n").iterdir())
    assert maps == ["r00_c00.png", "r00_c01.png", "r00_c02.png"]
    np.testing.assert_array_equal(read_picture(tmp_path / "m" / "n" / maps[2]), ssim_picture(*pairs[0]))
    text = succeeds(*options, "-y").splitlines()
    assert text[0].split() == [
        "view",
        "kind",
        "Y-PSNR",
        "dB",
        "YUV",
        "dB",
        "SSIM",
        "temporal",
        "dB",
        "IV-PSNR",
        "dB",
    ]
    metrics = ("psnr_y", "psnr_yuv", "ssim", "temporal_psnr_y", "iv_psnr")
    figures = [document[metric]["worst"] for metric in metrics]
    assert text[-1].split() == ["worst", "view", *map("{:.{}f}".format, figures, (2, 2, 4, 2, 2))]
    assert len({len(line) for line in text}) == 1, "columns stand below their titles"


def test_maps_that_cannot_be_written_are_named(original: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    line = fails(1, "compare", original, original, "--ssim-maps", tmp_path / "file")
    assert "file: cannot be written: it is a file" in line


def test_unequal_grids_are_refused(original: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"grid 1x2, expected grid 1x3"):
        run(original, write_array(tmp_path, 1, 2, 5))


def test_folders_without_a_common_frame_are_refused(original: Path, tmp_path: Path) -> None:
    decoded = write_array(tmp_path, 1, 3, 2, first_frame=5)
    with pytest.raises(InputError, match=r"frames 5\.\.6, expected some of the frames 0\.\.4"):
        run(original, decoded)


def test_frames_that_the_original_lacks_are_left_out_with_a_warning(original: Path, tmp_path: Path) -> None:
    decoded = write_array(tmp_path, 1, 3, 2, first_frame=4)
    with pytest.warns(MvCodecWarning, match="1 frames are not in"):
        result = run(original, decoded)
    assert [view.pictures for view in result.views] == [1, 1, 1]


def test_meter_has_no_figures_before_the_first_picture() -> None:
    result = QualityMeter(()).result()
    assert result.views == ()
    assert result.psnr_y.to_json() == dict.fromkeys(("all", "real", "virtual", "worst"))


def test_means_do_not_depend_on_the_order_of_the_pictures() -> None:
    pairs = [(picture((0, 0), frame), spoilt((0, 2), frame)) for frame in range(4)]
    results = []
    for ordered in (pairs, pairs[::-1]):
        meter = QualityMeter(())
        for first, second in ordered:
            meter.push((0, 0), first, second)
        results.append(meter.result())
    assert results[0] == results[1]
