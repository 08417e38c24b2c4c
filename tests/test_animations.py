"""Take-away pictures in files: animations that keep their time, videos and stills."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mvcodec.capture.picture_files import read_picture
from mvcodec.capture.video_input import VideoView
from mvcodec.errors import MvCodecWarning, OutputError, SettingError
from mvcodec.frames import Picture
from mvcodec.output import picture_file


def flat(level: int, width: int = 16, height: int = 12) -> Picture:
    return np.full((height, width, 3), level, np.uint8)


def levels(count: int, start: int = 0) -> Iterator[Picture]:
    return (flat(start + 10 * number) for number in range(count))


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_animations_keep_their_time_and_their_pictures(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    picture_file.find_writer(path)(path, picture_file.at_rate(levels(24), 24.0), 24.0)
    durations, shown = [], []
    with Image.open(path) as animation:
        assert animation.info["loop"] == 0
        for number in range(animation.n_frames):  # type: ignore[attr-defined]
            animation.seek(number)
            animation.load()
            durations.append(animation.info["duration"])
            shown.append(np.asarray(animation.convert("RGB")).mean())
    assert sum(durations) == 1000
    assert set(durations) == ({40, 50} if suffix == ".gif" else {41, 42})
    np.testing.assert_allclose(shown, np.arange(24) * 10, atol=3)


def test_a_gif_leaves_out_what_browsers_would_slow_down(tmp_path: Path) -> None:
    picture_file.find_writer(Path("a.GIF"))(
        tmp_path / "a.gif", picture_file.at_rate(levels(20), 100.0), 100.0
    )
    with Image.open(tmp_path / "a.gif") as animation:
        assert animation.n_frames == 10  # type: ignore[attr-defined]
        assert animation.info["duration"] == 20


def test_videos_and_stills(tmp_path: Path) -> None:
    picture_file.find_writer(Path("a.mp4"))(tmp_path / "a.mp4", picture_file.at_rate(levels(5), 12.5), 12.5)
    video = VideoView(tmp_path / "a.mp4")
    assert (video.size, video.count, Fraction(video.fps)) == ((16, 12), 5, Fraction(25, 2))
    taken = levels(5, start=7)
    picture_file.find_writer(Path("a.png"))(tmp_path / "a.png", picture_file.at_rate(taken, 12.5), 12.5)
    np.testing.assert_array_equal(read_picture(tmp_path / "a.png"), flat(7))
    assert next(taken)[0, 0, 0] == 17


TIMES_MS = [0, 40, 80, 1600, 1640]
"""A pause between pictures at 25 a second."""


@pytest.mark.parametrize("suffix", [".mp4", ".gif", ".webp"])
def test_pauses_reach_the_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    timed = zip(levels(5), (5_000_000_000 + time * 1_000_000 for time in TIMES_MS), strict=True)
    picture_file.find_writer(path)(path, timed, 25.0)
    if suffix == ".mp4":
        assert [time / 1e6 for time in VideoView(path).times_ns or ()] == pytest.approx(TIMES_MS, abs=0.1)
        return
    with Image.open(path) as animation:
        found = []
        for number in range(animation.n_frames):  # type: ignore[attr-defined]
            animation.seek(number)
            animation.load()
            found.append(animation.info["duration"])
    assert found == [40, 40, 1520, 40, 40]


@pytest.mark.parametrize(("suffix", "longest_s"), [(".gif", 655.35), (".webp", 16777.215)])
def test_a_picture_an_hour_is_shown_as_long_as_the_format_can(
    tmp_path: Path, suffix: str, longest_s: float
) -> None:
    path = tmp_path / f"a{suffix}"
    with pytest.warns(MvCodecWarning, match=f"shown for {longest_s:g} s at most, the longest"):
        picture_file.find_writer(path)(path, picture_file.at_rate(levels(2), 1 / 86400), 1 / 86400)
    with Image.open(path) as animation:
        animation.load()
        assert animation.info["duration"] == pytest.approx(longest_s * 1000, abs=10)


def test_a_picture_an_hour_is_a_video_too(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    picture_file.find_writer(path)(path, picture_file.at_rate(levels(3), 1 / 3600), 1 / 3600)
    assert [time / 1e9 for time in VideoView(path).times_ns or ()] == pytest.approx([0, 3600, 7200])


def test_unknown_endings_are_answered_with_the_known_ones() -> None:
    with pytest.raises(SettingError, match=r"\.mp4, \.png, \.gif, \.webp"):
        picture_file.find_writer(Path("a.avi"))


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_animations_too_large_for_memory_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    monkeypatch.setattr(picture_file, "MAX_ANIMATION_PX", 3 * 16 * 12)
    path = tmp_path / f"a{suffix}"
    picture_file.find_writer(path)(path, picture_file.at_rate(levels(3), 10.0), 10.0)
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"more than 3 such pictures don't fit; \.mp4"):
        picture_file.find_writer(path)(path, picture_file.at_rate(levels(4), 10.0), 10.0)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
