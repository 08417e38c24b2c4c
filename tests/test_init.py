"""`mvcodec init`: names with numbers become views and frames; what cannot be told is asked for."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from command_line import fails, succeeds
from small_arrays import write_array

from mvcodec.capture import open_input
from mvcodec.capture.numbered_files import find_views
from mvcodec.errors import InputError, MvCodecWarning, SettingError


def folder_of(tmp_path: Path, names: Sequence[str]) -> Path:
    for name in names:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return tmp_path


@pytest.mark.parametrize(
    ("names", "grid", "expected"),
    [
        (["c1.mp4", "c2.mp4", "c10.mp4", "c9.mp4"], (2, 2), ["c1.mp4", "c2.mp4", "c9.mp4", "c10.mp4"]),
        (["r0_c0.mp4", "r0_c1.mp4"], None, ["r0_c0.mp4", "r0_c1.mp4"]),
        (["1_1.mov", "1_2.mov", "2_1.mov", "2_2.mov"], None, ["1_1.mov", "1_2.mov", "2_1.mov", "2_2.mov"]),
        (["1.png", "2.png"], (1, 2), ["1.png", "2.png"]),
        (["s7_row1_col01.jpg", "s7_row2_col01.jpg"], None, ["s7_row1_col01.jpg", "s7_row2_col01.jpg"]),
    ],
)  # fmt: skip
def test_one_file_a_view(
    tmp_path: Path, names: list[str], grid: tuple[int, int] | None, expected: list[str]
) -> None:
    found = find_views(folder_of(tmp_path, [*names, "notes1.txt"]), grid)
    assert [found.files[view] for view in sorted(found.files)] == [(name,) for name in expected]
    assert grid in (None, (found.rows, found.cols))


@pytest.mark.parametrize(
    "pattern", ["cam{view}/{frame:04d}.png", "cam{view}_{frame}.png", "{view:03d}/a{frame}.jpg"]
)
def test_pictures_of_cameras_in_row_order(tmp_path: Path, pattern: str) -> None:
    names = [pattern.format(view=view, frame=frame) for view in range(1, 7) for frame in range(8, 12)]
    found = find_views(folder_of(tmp_path, names), (2, 3))
    assert (found.rows, found.cols, found.videos) == (2, 3, False)
    assert found.files[1, 0] == tuple(pattern.format(view=4, frame=frame) for frame in range(8, 12))


def test_pictures_by_row_column_and_frame(tmp_path: Path) -> None:
    names = [f"r{row}/c{col}_{frame}.png" for row in (1, 2) for col in (1, 2, 3) for frame in (1, 2)]
    found = find_views(folder_of(tmp_path, names))
    assert (found.rows, found.cols) == (2, 3)
    assert found.files[0, 2] == ("r1/c3_1.png", "r1/c3_2.png")


@pytest.mark.parametrize(
    ("names", "grid", "kind", "words"),
    [
        (["a1.mp4", "a2.mp4"], None, SettingError, "RxC for the 2 cameras"),
        (["a1.mp4", "a2.mp4", "a3.mp4"], (2, 2), SettingError, r"R\*C = 3"),
        (["r0_c0.mp4", "r0_c1.mp4"], (2, 1), SettingError, "1x2 as the names say"),
        (["a1.mp4", "b2.mp4"], (1, 2), InputError, "differ in their numbers only"),
        (["r0_c0.mp4", "r0_c1.mp4", "r1_c0.mp4"], None, InputError, "3 of the 2 x 2 views"),
        (["c1/1.png", "c1/2.png", "c2/1.png"], (1, 2), InputError, "1 files for view 0,1"),
        (["c1/1.png", "c1/01.png", "c2/1.png"], (1, 2), InputError, "a number for each"),
        (["x.txt"], None, InputError, "no picture and no video"),
    ],
)  # fmt: skip
def test_what_cannot_be_told(
    tmp_path: Path, names: list[str], grid: tuple[int, int] | None, kind: type[Exception], words: str
) -> None:
    with pytest.raises(kind, match=words):
        find_views(folder_of(tmp_path, names), grid)


def test_the_command_writes_what_encode_reads(tmp_path: Path) -> None:
    folder = write_array(tmp_path / "array", rows=2, cols=2, frames=3)
    before = open_input([folder]).array
    (folder / "array.json").unlink()
    example = fails(1, "encode", folder, tmp_path / "x.mcap")
    assert "mvcodec init" in example
    shown: dict[str, Any] = json.loads(example[example.index("{") : example.rindex("}") + 1])
    assert set(shown) == {"rows", "cols", "pattern"}
    assert "2 x 2 views, 3 pictures each" in succeeds("init", folder, "--fps", "30")
    after = open_input([folder])
    assert (after.array.rows, after.array.cols, after.frame_count) == (before.rows, before.cols, 3)
    assert after.array.fps == 30
    assert "-y overwrites it" in fails(1, "init", folder)
    succeeds("init", folder, "-y", "--quiet")


def test_a_folder_that_is_not_there_is_told_from_an_empty_one(tmp_path: Path) -> None:
    missing = tmp_path / "missing"
    assert "missing: found nothing there, expected a folder of pictures or videos" in fails(
        1, "init", missing
    )


def test_a_frame_that_one_view_alone_lacks_is_named(tmp_path: Path) -> None:
    names = [f"r0_c{col}_{frame:03d}.png" for col in (0, 1) for frame in range(7, 13) if frame != 9 + col]
    with pytest.raises(InputError, match=r"found frames that view 0,0 or view 0,1 lacks"):
        find_views(folder_of(tmp_path, names))


def test_frames_that_all_views_lack_are_told(tmp_path: Path) -> None:
    names = [f"r0_c{col}_{frame:03d}.png" for col in (0, 1) for frame in (7, 8, 10, 11)]
    with pytest.warns(MvCodecWarning, match="1 frames are missing between the first and the last"):
        assert len(find_views(folder_of(tmp_path, names)).files[0, 0]) == 4


def test_numbers_that_are_times_may_differ(tmp_path: Path) -> None:
    names = [f"r0_c{col}_{10**15 + 33_000 * frame + 7 * col}.png" for col in (0, 1) for frame in range(5)]
    assert len(find_views(folder_of(tmp_path, names)).files[0, 1]) == 5
