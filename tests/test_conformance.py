"""Files of every version of the format are read as the pairs say, bit by bit."""

from __future__ import annotations

import io
import json
import runpy
from pathlib import Path
from typing import Any

import pytest

from mvcodec.decoding.decoder import Decoder

FOLDER = Path(__file__).parent / "conformance"
NAMES = sorted(path.stem for path in FOLDER.glob("*.mcap"))
SCRIPT = runpy.run_path(str(Path(__file__).parents[1] / "tools" / "make_conformance.py"))


@pytest.fixture(params=NAMES)
def pair(request: pytest.FixtureRequest) -> tuple[bytes, dict[str, Any]]:
    path = FOLDER / request.param
    return path.with_suffix(".mcap").read_bytes(), json.loads(path.with_suffix(".json").read_text("utf-8"))


def test_every_case_of_the_script_is_there() -> None:
    assert set(SCRIPT["CASES"]) <= set(NAMES)
    assert all((FOLDER / f"{name}.json").exists() for name in NAMES)


def test_header_times_and_planes_are_as_the_pair_says(pair: tuple[bytes, dict[str, Any]]) -> None:
    content, expected = pair
    assert SCRIPT["describe"](content) == expected


def test_the_decoder_gives_pictures_and_maps_of_every_frame_set(pair: tuple[bytes, dict[str, Any]]) -> None:
    content, expected = pair
    low, high = expected["header"]["disparity_range_px"]
    with Decoder.open(io.BytesIO(content)) as decoder:
        found = list(decoder)
    assert [(f.index, f.time_ns) for f in found] == [
        (f["index"], f["time_ns"]) for f in expected["frame_sets"]
    ]
    for decoded in found:
        shape = (decoded.array.height, decoded.array.width)
        for camera in decoded.array.real:
            assert decoded.pictures[camera].shape == (*shape, 3)
            values_px = decoded.disparities[camera].values_px
            assert values_px.shape == shape
            assert low - 1e-4 <= values_px.min() <= values_px.max() <= high + 1e-4


def test_a_changed_file_is_told_from_its_pair() -> None:
    other, expected = (
        SCRIPT["write_case"]("one_column"),
        json.loads((FOLDER / "square.json").read_text("utf-8")),
    )
    assert SCRIPT["describe"](other) != expected
