"""Provenance of synthesised views: its pictures, and quality by the number of cameras that saw a pixel."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from array_files import files_in
from command_line import fails, succeeds
from numpy.typing import NDArray
from PIL import Image
from small_arrays import HEIGHT, WIDTH, picture, write_array

from mvcodec.array import Viewpoint
from mvcodec.capture import open_input
from mvcodec.capture.picture_files import read_picture
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import InputError
from mvcodec.evaluation.comparison import compare
from mvcodec.evaluation.metrics import luma, psnr
from mvcodec.evaluation.quality_by_provenance import ProvenanceMeter
from mvcodec.frames import LayerStack, RenderedView
from mvcodec.layers.dils_split import THRESHOLD
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter
from mvcodec.output.pictures import write_png
from mvcodec.output.provenance_pictures import ProvenanceWriter, write_provenance
from mvcodec.synthesis.provenance import LAYERS_TEXT, Provenance, layer_labels, provenance_name, seen_by
from mvcodec.synthesis.synthesizers import make_synthesizer

FRAMES = 2
VIEWS = [(row, col) for row in range(3) for col in range(3)]
REAL = [(0, 0), (0, 2), (2, 0), (2, 2)]


def rendered(seen: NDArray[np.uint8], disparity: NDArray[np.float32]) -> RenderedView:
    return RenderedView(Viewpoint(0, 0), np.zeros((*seen.shape, 3), np.uint8), disparity, seen)


def texts(path: Path) -> Any:
    with Image.open(path) as image:
        return json.loads(image.info[LAYERS_TEXT])


def provenance_of(folder: Path, view: tuple[int, int], frame: int) -> Path:
    return folder / f"r{view[0]:02d}_c{view[1]:02d}" / provenance_name(frame)


# The picture


def test_layers_are_the_frequent_disparities_of_the_seen_pixels() -> None:
    disparity = np.full((20, 30), -2.0, np.float32)
    disparity[:, 10:] = 7.3
    disparity[0, :5] = 3  # too few pixels for a layer
    seen = np.full((20, 30), 4, np.uint8)
    seen[:, 10:12] = 1
    seen[5:8, 20:] = 0
    found = Provenance.of(rendered(seen, disparity))
    assert THRESHOLD > 5
    assert found.layers.bounds_px == ((-2, -2), (7, 7))
    expected = np.where(disparity > 0, 2, 1)
    expected[0, :5] = 0
    expected[5:8, 20:] = 0
    np.testing.assert_array_equal(found.layers.labels, expected)
    np.testing.assert_array_equal(found.seen_by, seen)


def test_picture_holds_more_layers_than_a_channel(tmp_path: Path) -> None:
    labels = np.arange(600, dtype=np.uint16).reshape(20, 30)
    cameras = (labels % 5).astype(np.uint8)
    bounds = tuple((level, level) for level in range(599))
    write_provenance(tmp_path / "x.png", Provenance(cameras, LayerStack(bounds, labels)))
    back = read_picture(tmp_path / "x.png")
    np.testing.assert_array_equal(seen_by(back), cameras)
    np.testing.assert_array_equal(layer_labels(back), labels)
    assert texts(tmp_path / "x.png") == [list(pair) for pair in bounds]
    assert files_in(tmp_path) == {"x.png"}


# decode --provenance


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("input") / "array", frames=FRAMES)


@pytest.fixture(scope="module")
def coded(array: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("coded") / "x.mcap"
    succeeds("encode", array, path, "--qp", "22", "--disparity-range", "0,8", "--quiet")
    return path


@pytest.fixture(scope="module")
def decoded(coded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("decoded") / "array"
    assert succeeds("decode", coded, folder, "--provenance") == ""
    return folder


def test_each_picture_of_the_array_has_its_provenance_beside_it(coded: Path, decoded: Path) -> None:
    pictures = {f"r{row:02d}_c{col:02d}/{n:06d}" for row, col in VIEWS for n in range(FRAMES)}
    expected = {f"{name}{ending}" for name in pictures for ending in (".png", ".provenance.png")}
    assert files_in(decoded) == expected | {"array.json"}
    synthesizer = make_synthesizer("layered")
    with Decoder.open(coded) as decoder:
        for number, frames in enumerate(decoder):
            view = synthesizer.render(frames, Viewpoint(1, 1))
            path = provenance_of(decoded, (1, 1), number)
            found, expected_stack = read_picture(path), Provenance.of(view).layers
            np.testing.assert_array_equal(seen_by(found), view.seen_by)
            np.testing.assert_array_equal(layer_labels(found), expected_stack.labels)
            assert texts(path) == [list(bounds) for bounds in expected_stack.bounds_px]
            assert view.seen_by.max() == 4


def test_the_array_stays_a_legal_one(coded: Path, decoded: Path, tmp_path: Path) -> None:
    source = open_input([decoded])
    assert (source.frame_count, source.listed_real) == (FRAMES, tuple(REAL))
    succeeds("decode", coded, tmp_path / "plain")
    assert (tmp_path / "plain" / "array.json").read_bytes() == (decoded / "array.json").read_bytes()
    succeeds("encode", decoded, tmp_path / "again.mcap", "--disparity-range", "0,8", "--quiet")


def test_single_views_have_it_too(coded: Path, tmp_path: Path) -> None:
    succeeds("decode", coded, tmp_path, "--view", "0.5,1", "--frames", ":1", "--provenance")
    assert files_in(tmp_path) == {"r0.500_c1.000/000000.png", "r0.500_c1.000/000000.provenance.png"}


@pytest.mark.parametrize(
    ("form", "name"), [("mp4", "out"), ("mosaic", "out.png"), ("mosaic", "out.mp4"), ("mcap", "out.mcap")]
)
def test_forms_without_picture_folders_refuse_it(coded: Path, tmp_path: Path, form: str, name: str) -> None:
    line = fails(2, "decode", coded, tmp_path / name, "--format", form, "--provenance")
    assert line.endswith(f"--provenance: found --format {form}, expected --format array or png")
    assert files_in(tmp_path) == set()


# compare --provenance


def test_compare_tells_quality_by_number_of_cameras(array: Path, decoded: Path) -> None:
    arguments = ("compare", array, decoded, "--provenance", decoded)
    document = json.loads(succeeds(*arguments, "--json"))
    pixels, errors = np.zeros(5), np.zeros(5)
    for view in (view for view in VIEWS if view not in REAL):
        for frame in range(FRAMES):
            path = provenance_of(decoded, view, frame)
            cameras = seen_by(read_picture(path))
            other = read_picture(path.with_name(f"{frame:06d}.png"))
            error = (luma(picture(view, frame)).astype(float) - luma(other)) ** 2
            for count in range(5):
                pixels[count] += (cameras == count).sum()
                errors[count] += error[cameras == count].sum()
    occurring = np.flatnonzero(pixels)
    assert list(document["by_provenance"]) == [str(count) for count in occurring]
    assert len(occurring) > 2
    for count in occurring.tolist():
        found = document["by_provenance"][str(count)]
        assert found["share"] == pytest.approx(pixels[count] / pixels.sum())
        assert found["error_share"] == pytest.approx(errors[count] / errors.sum())
        assert found["psnr_y"] == pytest.approx(10 * math.log10(255**2 * pixels[count] / errors[count]))
    text = succeeds(*arguments)
    best = document["by_provenance"]["4"]
    assert f"seen by 4 {best['psnr_y']:19.2f} {best['share']:7.2%}" in text
    without = json.loads(succeeds("compare", array, decoded, "--json"))
    assert without == {key: value for key, value in document.items() if key != "by_provenance"}


def write_decoded(folder: Path, first_frame: int, seen: NDArray[np.uint8]) -> Path:
    """A 1 x 3 array whose middle view is wrong by 10 where one camera saw it, by 20 where it was filled."""
    off = np.where(seen == 0, 20, np.where(seen == 1, 10, 0)).astype(np.uint8)
    facts = ArrayFacts(1, 3, fps=10.0, first_frame=first_frame, real=[(0, 0), (0, 2)])
    with ArrayFolderWriter(folder, facts) as writer:
        views = {(0, col): np.full((HEIGHT, WIDTH, 3), 100, np.uint8) for col in range(3)}
        views[0, 1] += off[..., None]
        writer.push(views)
    levels = np.zeros(seen.shape, np.float32)
    ProvenanceWriter(folder, ["r00_c01"]).push([rendered(seen, levels)])
    return folder


def write_original(folder: Path) -> Path:
    with ArrayFolderWriter(folder, ArrayFacts(1, 3, fps=10.0)) as writer:
        for frame in range(3):
            level = 100 if frame == 2 else 0
            writer.push({(0, col): np.full((HEIGHT, WIDTH, 3), level, np.uint8) for col in range(3)})
    return folder


def test_frames_keep_their_place_and_real_views_need_no_provenance(tmp_path: Path) -> None:
    seen = np.full((HEIGHT, WIDTH), 2, np.uint8)
    seen[: HEIGHT // 4] = 1
    seen[HEIGHT // 4 : HEIGHT // 2] = 0
    original, folder = write_original(tmp_path / "o"), write_decoded(tmp_path / "d", 2, seen)
    result = compare(open_input([original]), open_input([folder]), provenance=folder)
    assert result.by_provenance is not None
    found = {count: (entry.share, entry.error_share) for count, entry in result.by_provenance.items()}
    assert found == {0: (0.25, 0.8), 1: (0.25, 0.2), 2: (0.5, 0.0)}
    assert result.by_provenance[2].psnr_y == 100.0
    assert result.by_provenance[0].psnr_y == pytest.approx(20 * math.log10(255 / 20))


def test_missing_or_wrong_provenance_is_one_line(array: Path, coded: Path, tmp_path: Path) -> None:
    folder = tmp_path / "plain"
    succeeds("decode", coded, folder, "--frames", ":1")
    line = fails(1, "compare", array, folder, "--provenance", folder)
    assert (
        "000000.provenance.png: found no such file, expected one, as decoding with provenance writes it"
        in line
    )
    for view in VIEWS:
        write_png(provenance_of(folder, view, 0), np.zeros((4, 5, 3), np.uint8))
    with pytest.raises(InputError, match=f"found 5x4 px, expected {WIDTH}x{HEIGHT} px"):
        compare(open_input([array]), open_input([folder]), provenance=folder)
    provenance_of(folder, (0, 1), 0).write_bytes(b"no picture")
    assert "r00_c01/000000.provenance.png" in fails(1, "compare", array, folder, "--provenance", folder)


def test_meter_without_error_or_pictures() -> None:
    meter = ProvenanceMeter()
    assert meter.result() == {}
    same = picture((0, 0), 0)
    meter.push(same, same, np.full((HEIGHT, WIDTH), 3, np.uint8))
    (entry,) = meter.result().values()
    assert entry.to_json() == {"share": 1.0, "psnr_y": psnr(same, same), "error_share": None}
