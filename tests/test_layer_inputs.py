"""Where the originals of enhanced views come from: recordings of all cameras."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from command_line import succeeds
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from mcap_protobuf.writer import Writer
from PIL import Image
from test_enhancement import ARRAY, VIRTUAL, frames

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.conformance.validation import validate
from mvcodec.decoding.decoder import Decoder
from mvcodec.evaluation.metrics import psnr
from mvcodec.rigs.rig import Lens, Rectified, Rig, RigCamera, rig_text

GRID = tuple(tuple(f"/cam{row}{col}" for col in range(ARRAY.cols)) for row in range(ARRAY.rows))
TOPICS = ";".join(",".join(row) for row in GRID)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All nine cameras of two frame sets."""
    path = tmp_path_factory.mktemp("recorded") / "recorded.mcap"
    with path.open("wb") as file, Writer(file) as writer:
        for taken in frames(2):
            for (row, col), picture in taken.pictures.items():
                coded = io.BytesIO()
                Image.fromarray(picture).save(coded, "png")
                message = CompressedImage(data=coded.getvalue(), format="png", frame_id=f"{row}{col}")
                message.timestamp.FromNanoseconds(taken.time_ns + 1)
                writer.write_message(GRID[row][col], message, taken.time_ns + 1, taken.time_ns + 1)
    return path


def test_of_other_cameras_only_those_that_are_asked_for_are_read(recorded: Path) -> None:
    for others, expected in (((), ARRAY.real), (((1, 2),), (*ARRAY.real, (1, 2))), (None, ARRAY.positions)):
        with recorded.open("rb") as file:
            (first, _) = Recording(file, "rec", RecordingSettings(GRID, others=others)).frame_sets()
        assert sorted(first.pictures) == sorted(expected)


def test_a_recording_is_coded_with_a_layer(recorded: Path, tmp_path: Path) -> None:
    options = ["--topics", TOPICS, "--qp", "36", "--matcher", "sgbm", "--preset", "veryfast", "--quiet"]
    options += ["--disparity-range", "0,12"]
    coded = tmp_path / "x.mcap"
    succeeds("encode", recorded, coded, "--enhance", "24", *options)
    assert validate(coded) == []
    with Decoder.open(coded, enhanced=None) as decoder:
        for decoded, taken in zip(decoder, frames(2), strict=True):
            assert sorted(decoded.enhanced) == VIRTUAL
            for view in VIRTUAL:
                assert psnr(decoded.enhanced[view].pixels, taken.pictures[view]) > 30
    some = tmp_path / "some.mcap"
    succeeds("encode", recorded, some, "--enhance", "24", "--enhance-views", "1,2", *options)
    with Decoder.open(some, enhanced=None) as decoder:
        assert [list(decoded.enhanced) for decoded in decoder] == [[(1, 2)]] * 2


def test_a_recording_is_rectified_originals_and_all(recorded: Path, tmp_path: Path) -> None:
    size = ARRAY.width, ARRAY.height
    middle = (size[0] - 1) / 2, (size[1] - 1) / 2
    lens = Lens("pinhole", (100.0, 100.0), middle, (0.0,) * 4)
    half, added = np.full(3, 0.5), np.full(3, 20.0)
    cameras = {
        at: RigCamera(lens, np.eye(3), np.array([at[1], at[0], 0.0]), half, added) for at in ARRAY.positions
    }
    rig = tmp_path / "rig.json"
    rig.write_text(rig_text(Rig(3, 3, size, cameras, Rectified(*size, 100.0, middle), "file", {})))
    options = ["--topics", TOPICS, "--qp", "36", "--matcher", "sgbm", "--preset", "veryfast", "--quiet"]
    coded = tmp_path / "x.mcap"
    succeeds(
        "encode", recorded, coded, "--enhance", "24", "--rig", rig, "--disparity-range", "0,12", *options
    )
    with Decoder.open(coded, enhanced=None) as decoder:
        for decoded, taken in zip(decoder, frames(2), strict=True):
            for view in VIRTUAL:
                straight = np.rint(taken.pictures[view] / 2 + 20).astype(np.uint8)
                assert psnr(decoded.enhanced[view].pixels, straight) > 30


def test_pictures_of_a_recording_are_the_originals(recorded: Path) -> None:
    with recorded.open("rb") as file:
        found = list(Recording(file, "rec", RecordingSettings(GRID, others=None)).frame_sets())
    for frame_set, taken in zip(found, frames(2), strict=True):
        for view, picture in taken.pictures.items():
            np.testing.assert_array_equal(frame_set.pictures[view], picture)
