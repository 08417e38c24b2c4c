"""Headers from outside: every field has one type, a wrong one is refused in one line that names it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from broken_files import coded_sets, written
from coding import RANGE_PX, make_array

from mvcodec.conformance.validation import validate
from mvcodec.errors import StreamError
from mvcodec.stream import StreamHeader

HEADER = StreamHeader(make_array(), RANGE_PX, first_frame=3, settings={"qp": 27})

WRONG: list[tuple[str, object, str]] = [
    ("array.real_cols", [0.9, 1.2], "array.real_cols = a list with 0.9 in it"),
    ("array.real_cols", "01", "array.real_cols = '01'"),
    ("array.real_rows", [0, True], "array.real_rows = a list with true or false in it"),
    ("array.real_rows", None, "array.real_rows = null"),
    ("array.rows", 2.0, "array.rows = 2"),
    ("array.width", "96", "array.width = '96'"),
    ("array.width", 16385, "array.width = 16385"),
    ("array.fps", "10", "array.fps = '10'"),
    ("array.fps", 0, "array.fps"),
    ("array.rho", True, "array.rho = true or false"),
    ("array.name", 7, "array.name = 7"),
    ("array.disparity_per_step_px", [1], "array.disparity_per_step_px = a list"),
    ("array.disparity_per_step_px", [1, "2"], "array.disparity_per_step_px = '2'"),
    ("array.calibration", [], "array.calibration = a list"),
    ("array.calibration.fx_px", "50", "array.calibration.fx_px = '50'"),
    ("array.calibration.given", 1, "array.calibration.given = 1"),
    ("disparity_range_px", [1, 2, 3], "disparity_range_px = a list"),
    ("disparity_range_px", [5, 1], "disparity_range_px: found [5.0, 1.0]"),
    ("disparity_scale", "2", "disparity_scale = '2'"),
    ("disparity_scale", 2.0, "disparity_scale = 2"),
    ("disparity_cameras", 1, "disparity_cameras = 1"),
    ("codec", None, "codec = null"),
    ("first_frame", 3.7, "first_frame = 3.7"),
    ("first_frame", "7", "first_frame = '7'"),
    ("first_frame", -1, "first_frame = -1"),
    ("first_frame", 1 << 32, "first_frame = 4294967296"),
    ("settings", [], "settings = a list"),
]


def _changed(path: str, change: Callable[[dict[str, Any], str], None], data: bytes) -> bytes:
    document = json.loads(data)
    *outer, last = path.split(".")
    inner = document
    for name in outer:
        inner = inner[name]
    change(inner, last)
    return json.dumps(document).encode()


def test_what_is_written_is_read_and_written_alike() -> None:
    assert StreamHeader.from_json(HEADER.to_json()) == HEADER
    assert StreamHeader.from_json(HEADER.to_json()).to_json() == HEADER.to_json()


@pytest.mark.parametrize(("path", "value", "found"), WRONG)
def test_a_wrong_value_is_refused_by_its_name(path: str, value: object, found: str) -> None:
    data = _changed(path, lambda inner, name: inner.__setitem__(name, value), HEADER.to_json())
    with pytest.raises(StreamError, match=re.escape(found)) as error:
        StreamHeader.from_json(data, "x.mcap")
    assert str(error.value).startswith("x.mcap: found ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "path", ["array", "array.cols", "array.calibration", "array.calibration.cx_px", "codec", "settings"]
)
def test_a_field_that_is_not_there_is_named(path: str) -> None:
    data = _changed(path, lambda inner, name: inner.pop(name), HEADER.to_json())
    with pytest.raises(StreamError, match=f"x.mcap: found no {path}, expected "):
        StreamHeader.from_json(data, "x.mcap")


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("array.real_cols", [0.0, 1.0], "array.real_cols"),
        ("colour", "blue", "field colour, which the format does not have"),
        ("array.depth", 3, "field array.depth, which"),
        ("array.calibration.k1", 0.1, "field array.calibration.k1, which"),
    ],
)
def test_validate_tells_wrong_and_unknown_fields(
    path: str, value: object, message: str, tmp_path: Path
) -> None:
    sets = coded_sets(5)
    header = sets[4][0]
    sets[4][0] = replace(
        header, data=_changed(path, lambda inner, last: inner.__setitem__(last, value), header.data)
    )
    file = tmp_path / "x.mcap"
    file.write_bytes(written(sets))
    found = [f for f in validate(file) if f.code == "header"]
    assert [f.time_ns for f in found] == [header.time_ns]
    assert message in found[0].message
