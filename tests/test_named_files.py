"""Files by their names: several views in one, pictures, patterns, and names that look like something else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from array_files import save
from command_line import fails, succeeds
from PIL import Image
from timed_videos import SIZE, number_of, numbered, write_frames

from mvcodec.capture import open_input
from mvcodec.capture.reading import Reading
from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.frames import Picture


def mosaic(number: int, rows: int, cols: int) -> Picture:
    """Views of one time, each with its own number: 8 * time + place."""
    tiles = [[numbered(8 * number + row * cols + col) for col in range(cols)] for row in range(rows)]
    return np.vstack([np.hstack(row) for row in tiles])


@pytest.mark.parametrize(("rows", "cols"), [(1, 2), (2, 1), (2, 3)])
def test_views_side_by_side_are_taken_apart(tmp_path: Path, rows: int, cols: int) -> None:
    path = write_frames(tmp_path / "v.mp4", [mosaic(n, rows, cols) for n in range(4)])
    source = open_input([path], real="all", reading=Reading(split=(rows, cols)))
    assert (source.array.rows, source.array.cols) == (rows, cols)
    assert (source.array.width, source.array.height) == SIZE
    for item in source.frame_sets():
        for (row, col), picture in item.pictures.items():
            assert number_of(picture) == 8 * item.index + row * cols + col
    (third,) = source.frame_sets(slice(2, 3), [(rows - 1, cols - 1)])
    assert number_of(third.pictures[rows - 1, cols - 1]) == 16 + rows * cols - 1


def test_a_view_that_is_read_alone_does_not_wait_for_the_others(tmp_path: Path) -> None:
    path = write_frames(tmp_path / "v.mp4", [mosaic(n, 1, 2) for n in range(6)])
    source = open_input([path], real="all", reading=Reading(split=(1, 2)))
    both = source.frame_sets()
    first = [number_of(next(both).pictures[0, 1]) for _ in range(4)]
    alone = [number_of(item.pictures[0, 0]) for item in source.frame_sets(None, [(0, 0)])]
    assert (first, alone) == ([1, 9, 17, 25], [0, 8, 16, 24, 32, 40])
    assert number_of(next(both).pictures[0, 1]) == 33


def test_several_files_of_several_views_are_one_grid(tmp_path: Path) -> None:
    paths = [write_frames(tmp_path / f"{n}.mp4", [mosaic(n, 1, 2)] * 2) for n in range(2)]
    source = open_input(paths, grid=(2, 2), real="all", reading=Reading(split=(1, 2)))
    (item, _) = source.frame_sets()
    found = {view: number_of(picture) for view, picture in item.pictures.items()}
    assert found == {(0, 0): 0, (0, 1): 1, (1, 0): 8, (1, 1): 9}
    with pytest.raises(SettingError, match=r"R\*C = 4, 2 files of 1x2 views"):
        open_input(paths, grid=(1, 2), reading=Reading(split=(1, 2)))
    with pytest.raises(SettingError, match="columns that 2 divide"):
        open_input(paths, grid=(4, 1), reading=Reading(split=(1, 2)))


def test_a_quilt_is_known_by_its_name(tmp_path: Path) -> None:
    save(tmp_path / "room_qs3x2a1.33.png", mosaic(0, 2, 3))
    (item,) = open_input([tmp_path / "room_qs3x2a1.33.png"], real="all").frame_sets()
    assert [number_of(picture) for picture in item.pictures.values()] == [3, 4, 5, 0, 1, 2]
    save(tmp_path / "room.png", mosaic(0, 2, 3))
    with pytest.raises(SettingError, match="grid: found nothing"):
        open_input([tmp_path / "room.png"])


def test_pictures_that_cannot_be_divided_are_refused(tmp_path: Path) -> None:
    save(tmp_path / "a.png", np.zeros((48, 65, 3), np.uint8))
    with pytest.raises(InputError, match=r"a\.png: found 65x48 px, expected a width that 2"):
        open_input([tmp_path / "a.png"], reading=Reading(split=(1, 2)))


def test_single_pictures_are_views_of_one_frame_set(tmp_path: Path) -> None:
    for col in (0, 1):
        save(tmp_path / f"50% {col}.png", numbered(col))
    (item,) = open_input([tmp_path / f"50% {col}.png" for col in (0, 1)], grid=(1, 2)).frame_sets()
    assert [number_of(picture) for picture in item.pictures.values()] == [0, 1]


@pytest.mark.parametrize("form", ["webp", "png", "tiff"])
def test_of_an_animation_in_a_picture_file_the_first_picture_is_taken_and_that_is_told(
    tmp_path: Path, form: str
) -> None:
    pictures = [Image.fromarray(numbered(number)) for number in (3, 4, 5)]
    paths = [tmp_path / f"{name}.{form}" for name in "ab"]
    for path in paths:
        pictures[0].save(path, save_all=True, append_images=pictures[1:])
    with pytest.warns(MvCodecWarning, match=r"a\.\w+: it holds 3 pictures: the first one is taken"):
        (item,) = open_input(paths, grid=(1, 2)).frame_sets()
    assert number_of(item.pictures[0, 0]) == 3


@pytest.mark.parametrize(
    ("begin", "ones"), [((0, 0), ""), ((1, 0), "col"), ((0, 1), "frame"), ((1, 1), "col and frame")]
)
def test_patterns_may_count_from_one(tmp_path: Path, begin: tuple[int, int], ones: str) -> None:
    for col in (0, 1):
        for frame in range(3):
            save(tmp_path / f"c{col + begin[0]}_{frame + begin[1]:03d}.png", numbered(4 * frame + col))
    text = '{"rows": 1, "cols": 2, "pattern": "c{col}_{frame:03d}.png", "frames": 3}'
    (tmp_path / "array.json").write_text(text)
    if ones:
        with pytest.warns(MvCodecWarning, match=f"the numbers of {ones} begin at 1, as the files do"):
            source = open_input([tmp_path])
    else:
        source = open_input([tmp_path])
    found = [[number_of(picture) for picture in item.pictures.values()] for item in source.frame_sets()]
    assert found == [[0, 1], [4, 5], [8, 9]]


def test_the_command_takes_files_apart_and_names_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_frames(tmp_path / "v.mp4", [mosaic(n, 1, 2) for n in range(2)]).rename(tmp_path / "-a:b 5%d ü.mp4")
    monkeypatch.chdir(tmp_path)
    options = ["--split", "1x2", "--qp", "40", "--preset", "ultrafast", "--json"]
    assert '"frames": 2' in succeeds("encode", "-a:b 5%d ü.mp4", "o.mcap", *options)
    live = ("udp://127.0.0.1:9", "udp://127.0.0.1:10", "x.mcap", "--grid", "1x2", "--split", "1x2")
    assert "a grid of 2 cameras of 1x2 views each" in fails(2, "encode", *live)
