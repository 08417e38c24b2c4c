"""Offsets of cameras are found from what moves in their pictures, and from their sound."""

from __future__ import annotations

import warnings
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from timed_videos import numbered, write_video

from mvcodec.capture import open_input
from mvcodec.capture.sync import Sound, motion_of, motion_offset_ns, sound_of, sound_offset_ns
from mvcodec.capture.timing import Timing
from mvcodec.capture.video_input import VideoView
from mvcodec.errors import InputError
from mvcodec.frames import Picture

SAMPLE = Path(__file__).parents[1] / "samples" / "room_2x2"
EUROC = Path(__file__).resolve().parents[2] / "shared" / "data" / "euroc_raw"


@pytest.fixture(scope="module")
def room() -> dict[str, tuple[list[Picture], tuple[int, ...]]]:
    views = {name: VideoView(SAMPLE / f"{name}.mp4") for name in ("r00_c00", "r00_c01", "r01_c00")}
    return {
        name: (list(view.pictures(range(view.count))), view.times_ns or ()) for name, view in views.items()
    }


@pytest.mark.parametrize("other", ["r00_c01", "r01_c00"])
@pytest.mark.parametrize("late", [-3, -1, 0, 2, 3])
def test_motion_finds_a_made_delay_of_the_sample_to_half_a_frame(
    room: dict[str, tuple[list[Picture], tuple[int, ...]]], other: str, late: int
) -> None:
    (ours, times), (theirs, _) = room["r00_c00"], room[other]
    first = motion_of(ours[max(-late, 0) :], times)
    offset, likeness = motion_offset_ns(first, motion_of(theirs[max(late, 0) :], times))
    step = times[1] - times[0]
    assert abs(offset / step - late) < 0.5
    assert likeness > 0.4


@pytest.mark.shared_data
@pytest.mark.parametrize("late", [-5, 0, 3])
def test_motion_finds_a_made_delay_of_moving_cameras_to_a_frame(late: int) -> None:
    if not EUROC.is_dir():
        pytest.skip(f"{EUROC} is not there")
    times = [50_000_000 * number for number in range(24)]
    motions = []
    for name, cut in (("cam0", max(-late, 0)), ("cam1", max(late, 0))):
        files = sorted((EUROC / name).iterdir())[cut:]
        pictures = (np.asarray(cv2.imread(str(file), cv2.IMREAD_COLOR), np.uint8) for file in files)
        motions.append(motion_of(pictures, times))
    offset, _ = motion_offset_ns(*motions)
    assert abs(offset / 50e6 - late) < 1


def test_files_are_put_together_by_their_motion(tmp_path: Path) -> None:
    """The numbers that the pictures show are what moves; the second camera began five pictures late."""
    order = [int(n) for n in np.random.default_rng(5).permutation(64)[:30]]
    paths = [
        write_video(tmp_path / "a.mp4", order),
        write_video(tmp_path / "b.mp4", order[5:], col=1),
    ]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        source = open_input(paths, grid=(1, 2), timing=Timing(sync="motion"))
    assert "by motion, b.mp4 is -166" in str(caught[0].message).replace("behind", "")
    for item in source.frame_sets():
        left, right = (picture[:8].astype(int) for picture in item.pictures.values())
        assert np.abs(left - right).mean() < 20, "the same number"


def test_pictures_that_tell_nothing_are_no_guess(tmp_path: Path) -> None:
    paths = [write_video(tmp_path / f"{c}.mp4", [7] * 12, col=c) for c in (0, 1)]
    with pytest.raises(InputError, match=r"0\.mp4: found pictures in which nothing moves"):
        open_input(paths, grid=(1, 2), timing=Timing(sync="motion"))
    short = [write_video(tmp_path / f"s{c}.mp4", range(4), col=c) for c in (0, 1)]
    with pytest.raises(InputError, match="4 pictures, expected 7 or more"):
        open_input(short, grid=(1, 2), timing=Timing(sync="motion"))


def with_sound(path: Path, samples: np.ndarray[tuple[int, ...], np.dtype[np.float32]] | None) -> Path:
    """A video of 30 pictures with a sound track of 16 kHz."""
    with av.open(str(path), "w") as out:
        video = out.add_stream("libx264", rate=30, options={"preset": "ultrafast"})
        video.width, video.height, video.pix_fmt = 64, 48, "yuv420p"
        audio = None if samples is None else out.add_stream("aac", rate=16000, layout="mono")
        for number in range(30):
            out.mux(video.encode(av.VideoFrame.from_ndarray(numbered(number), format="rgb24")))
        out.mux(video.encode())
        if audio is not None and samples is not None:
            frame = av.AudioFrame.from_ndarray(samples[None], format="fltp", layout="mono")
            frame.sample_rate, frame.pts, frame.time_base = 16000, 0, Fraction(1, 16000)
            out.mux(audio.encode(frame))
            out.mux(audio.encode())
    return path


def test_sound_finds_a_made_delay(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(0, 0.2, 20000).astype(np.float32)
    late = 1234  # samples of 16 kHz: 77.125 ms
    sounds = [sound_of(with_sound(tmp_path / f"{cut}.mp4", noise[cut : cut + 16000])) for cut in (0, late)]
    offset, likeness = sound_offset_ns(*sounds)
    assert offset == pytest.approx(late / 16000 * 1e9, abs=1e6)
    assert likeness > 0.5
    shifted = Sound(sounds[1].start_ns + 5e9, sounds[1].samples)
    assert sound_offset_ns(sounds[0], shifted)[0] == pytest.approx(offset - 5e9)


def test_files_without_sound_are_named(tmp_path: Path) -> None:
    for samples, complaint in (
        (None, "no sound track"),
        (np.zeros(16000, np.float32), "a silent sound track"),
    ):
        with pytest.raises(InputError, match=rf"v\.mp4: found {complaint}"):
            sound_of(with_sound(tmp_path / "v.mp4", samples))
