"""Array folders that are not right: one line that names the file, what is there and what was expected."""

from __future__ import annotations

import json
import struct
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from array_files import make_folder, picture_of, rewrite, save

from mvcodec.capture import open_input
from mvcodec.capture.picture_files import picture_size, read_picture
from mvcodec.errors import InputError, MvCodecWarning, SettingError


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rows": None}, r"found no rows, expected a whole number 1\.\.1024"),
        ({"rows": 0}, "rows = 0"),
        ({"rows": True}, "rows = true or false"),
        ({"cols": "3"}, "cols = '3'"),
        ({"cols": 2.0}, "cols = 2"),
        ({"fps": 0}, "fps = 0, expected a positive number"),
        ({"fps": "fast"}, "fps = 'fast'"),
        ({"fps": float("nan")}, "fps = nan"),
        ({"fps": 10**400}, "fps = 1"),
        ({"fps": 1e-9}, r"fps = 1e-09, expected 1e-06\.\.1e\+06"),
        ({"fps": 1e9}, r"fps = 1000000000\.0, expected 1e-06\.\.1e\+06"),
        ({"name": 5}, "name = 5, expected a text"),
        ({"rho": -1}, "rho = -1"),
        ({"views": None}, "neither views nor pattern"),
        ({"pattern": "x"}, "both views and pattern"),
        ({"views": {}}, r"views = dict, expected a list of 2"),
        ({"views": [[]]}, r"views = a list of 1, expected a list of 2, one list for each row"),
        ({"views": [[["a"]] * 3, [["a"]] * 2]}, r"views\[1\] = a list of 2, expected a list of 3"),
        ({"views": [[["a"]] * 3, [["a"], ["a"], 7]]}, r"views\[1\]\[2\] = int, expected a list of picture"),
        ({"views": [[["a"]] * 3, [["a"], ["a"], []]]}, r"views\[1\]\[2\] = an empty list"),
        ({"views": [[["a"]] * 3, [["a"], ["a"], [5]]]}, r"views\[1\]\[2\] = a list with other things"),
        ({"views": None, "pattern": 3}, "pattern = 3, expected a text"),
        ({"views": None, "pattern": "{row}{col}{frame}.png"}, "found no frames"),
        ({"views": None, "pattern": "{row}{col}{frame}.png", "frames": 0}, "frames = 0"),
        ({"views": None, "pattern": "{col}.mp4"}, r"expected \{row\} in it"),
        ({"views": None, "pattern": "{row}{col}{camera}.mp4"}, "no other fields than"),
        ({"views": None, "pattern": "{row}{col:q}.mp4"}, "expected a pattern of"),
        ({"views": None, "pattern": "{row}{col"}, "expected a pattern of"),
        ({"calibration": []}, "calibration = a list, expected an object"),
        ({"calibration": {"fx_px": 3}}, r"found no calibration\.fy_px"),
        (
            {"calibration": {"fx_px": 3, "fy_px": 0, "cx_px": 1, "cy_px": 1, "baseline_m": 1}},
            r"calibration\.fy_px = 0",
        ),
        ({"disparity_per_step_px": [3, 3]}, "expected \\[lo, hi\\] with lo < hi"),
        ({"disparity_per_step_px": [3]}, "disparity_per_step_px"),
        ({"disparity_per_step_px": ["a", 3]}, "disparity_per_step_px = 'a'"),
        ({"truth": []}, "truth = a list"),
        ({"truth": {"left": {"file": "t.png"}}}, "truth of 'left'"),
        ({"truth": {"r05_c00": {"file": "t.png"}}}, "expected a view of the 2x3 grid"),
        ({"truth": {"r00_c00": 5}}, r"truth\.r00_c00 = 5, expected an object"),
        ({"truth": {"r00_c00": {}}}, r"found no truth\.r00_c00\.file"),
        ({"truth": {"r00_c00": {"file": "t", "scale": 0}}}, r"truth\.r00_c00\.scale = 0"),
        ({"truth": {"r00_c00": {"file": "t", "steps": 0}}}, r"truth\.r00_c00\.steps = 0"),
        ({"truth": {"r00_c00": {"file": ["a"] * 3}}}, "3 truth files for view 0,0, expected 1 or 2"),
        ({"real": [[0, 3]]}, r"real = \[0, 3\], expected a list of \[row, col\] of the 2x3 grid"),
        ({"real": "corners"}, "real = str"),
        ({"first_frame": -1}, "first_frame = -1"),
    ],
)
def test_bad_manifests(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    folder = make_folder(tmp_path, changes=changes)
    with pytest.raises(InputError, match=message) as caught:
        open_input([folder])
    assert str(caught.value).startswith(str(folder / "array.json"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"{", "malformed JSON .*line 1"),
        (b"[1]", "found a list, expected a JSON object"),
        (b"\xff\xfe", "malformed JSON"),
        (b"[" * 100_000, "malformed JSON"),
        (b"", "malformed JSON"),
    ],
)
def test_malformed_json(tmp_path: Path, data: bytes, message: str) -> None:
    (tmp_path / "array.json").write_bytes(data)
    with pytest.raises(InputError, match=message):
        open_input([tmp_path])


def test_missing_things(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="gone: found nothing there"):
        open_input([tmp_path / "gone"])
    with pytest.raises(InputError, match=r"found an empty folder, expected a folder with array\.json"):
        open_input([tmp_path])
    (tmp_path / "other.txt").write_text("x")
    with pytest.raises(InputError, match=r"found no array\.json"):
        open_input([tmp_path])
    with pytest.raises(SettingError, match="INPUT"):
        open_input([])


def test_missing_and_damaged_pictures_are_named(tmp_path: Path) -> None:
    folder = make_folder(tmp_path)
    (folder / "cam" / "01_0.png").unlink()
    with pytest.raises(InputError, match=r"01_0\.png: found no such file"):
        open_input([folder])
    (folder / "cam" / "01_0.png").write_bytes(b"no picture")
    with pytest.raises(InputError, match=r"01_0\.png: found an unreadable picture"):
        open_input([folder])


def test_later_pictures_are_checked_when_read(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = make_folder(tmp_path, 1, 2, 3)
    whole = (folder / "cam" / "00_1.png").read_bytes()
    damages: list[tuple[bytes | None, str]] = [
        (None, "no such file"),
        (b"", "an empty file"),
        (whole[:40], "an unreadable picture"),
        (b"text", "an unreadable picture"),
    ]
    for data, message in damages:
        path = folder / "cam" / "00_1.png"
        path.unlink() if data is None else path.write_bytes(data)
        source = open_input([folder])
        sets = source.frame_sets()
        assert next(sets).index == 0
        with pytest.raises(InputError, match=rf"00_1\.png: found {message}"):
            next(sets)
    assert capfd.readouterr().err == ""


def test_views_of_different_size_or_length(tmp_path: Path) -> None:
    folder = make_folder(tmp_path / "size")
    save(folder / "cam" / "11_0.png", picture_of((1, 1), 0, (20, 16)))
    with pytest.raises(InputError, match=r"11_0\.png: found 20x16 px, expected 24x16 px"):
        open_input([folder])
    folder = make_folder(tmp_path / "later")
    save(folder / "cam" / "00_1.png", picture_of((0, 0), 0, (24, 17)))
    with pytest.raises(InputError, match=r"00_1\.png: found 24x17 px, expected 24x16 px"):
        list(open_input([folder]).frame_sets())
    folder = make_folder(tmp_path / "length")
    document = json.loads((folder / "array.json").read_text())
    document["views"][1][2].pop()
    rewrite(folder, document)
    with pytest.warns(MvCodecWarning, match=r"up to 1 pictures .*r00_c00"):
        assert open_input([folder]).frame_count == 1


def test_grid_must_agree_with_the_folder(tmp_path: Path) -> None:
    folder = make_folder(tmp_path)
    assert open_input([folder], grid=(2, 3)).array.rows == 2
    with pytest.raises(SettingError, match=r"^grid: found 3x2, expected 2x3"):
        open_input([folder], grid=(3, 2))


def test_rho_in_one_column_is_refused_by_the_file_name(tmp_path: Path) -> None:
    folder = make_folder(tmp_path, 3, 1, 1, {"rho": 2.0})
    with pytest.raises(InputError, match=r"array\.json: found array\.rho = 2\.0, expected 1"):
        open_input([folder])


def test_any_bytes_as_a_picture_give_an_error_of_ours(tmp_path: Path) -> None:
    path = tmp_path / "x.png"
    save(path, picture_of((0, 0), 0))
    whole = bytearray(path.read_bytes())
    chance = np.random.default_rng(3)
    for _ in range(60):
        damaged = whole.copy()
        damaged[int(chance.integers(len(damaged)))] ^= int(chance.integers(1, 256))
        path.write_bytes(damaged[: int(chance.integers(len(damaged) + 1))])
        for read in (picture_size, read_picture):
            with suppress(InputError):
                read(path)


def test_huge_picture_headers_are_no_trap(tmp_path: Path) -> None:
    header = struct.pack(">IIBBBBB", 2_000_000_000, 2_000_000_000, 8, 2, 0, 0, 0)
    (tmp_path / "x.png").write_bytes(
        b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + b"IHDR" + header + bytes(8)
    )
    with pytest.raises(InputError, match=r"x\.png"):
        read_picture(tmp_path / "x.png")
