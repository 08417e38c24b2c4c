"""Pictures of video files are put together by when they were taken, whatever the files are like."""

from __future__ import annotations

import struct
import warnings
from fractions import Fraction
from pathlib import Path

import av
import pytest
from command_line import mvcodec
from orientation_tags import turn_upside_down
from timed_videos import SIZE, number_of, numbered, write_video

from mvcodec.capture import open_input
from mvcodec.capture.source import ArraySource
from mvcodec.capture.timing import Timing
from mvcodec.capture.video_input import VideoView
from mvcodec.container import read_info
from mvcodec.errors import InputError, MvCodecWarning, SettingError


def at_30(numbers: list[int]) -> list[int]:
    return [round(number * 1000 / 30) for number in numbers]


def opened(*paths: Path, **timing: object) -> tuple[ArraySource, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        source = open_input(list(paths), grid=(1, len(paths)), timing=Timing(**timing))  # type: ignore[arg-type]
    return source, [str(warning.message) for warning in caught]


def numbers(source: ArraySource, frames: slice | None = None) -> list[list[int]]:
    """The numbers that the pictures of each frame set show."""
    return [[number_of(picture) for picture in item.pictures.values()] for item in source.frame_sets(frames)]


def test_dropped_frames_cost_their_frame_sets_alone(tmp_path: Path) -> None:
    kept = [n for n in range(20) if n not in (6, 7, 13)]
    source, told = opened(
        write_video(tmp_path / "a.mkv", range(20), at_30(list(range(20)))),
        write_video(tmp_path / "b.mkv", kept, at_30(kept)),
    )
    assert numbers(source) == [[n, n] for n in kept]
    assert source.array.fps == 30.0
    assert [item.time_ns for item in source.frame_sets()] == [round(n * 1e9 / 30) for n in kept]
    assert len(told) == 1
    assert "left out: 3 of a.mkv" in told[0]


@pytest.mark.parametrize(
    ("form", "bf"), [("mkv", "0"), ("mkv", "2"), ("mp4", "0"), ("mp4", "2"), ("ts", "0")]
)
def test_a_late_start_is_no_shift(tmp_path: Path, form: str, bf: str) -> None:
    late = list(range(5, 16))
    source, told = opened(
        write_video(tmp_path / f"a.{form}", range(12), at_30(list(range(12))), bf=bf),
        write_video(tmp_path / f"b.{form}", late, at_30(late), bf=bf),
    )
    assert numbers(source) == [[n, n] for n in range(5, 12)]
    assert len(told) == 1
    assert "where b." in told[0]
    assert "up to 5 pictures" in told[0]


def test_variable_rates_keep_their_times(tmp_path: Path) -> None:
    times = [0, 33, 67, 100, 1500, 1533, 1580, 3000]
    source, told = opened(*(write_video(tmp_path / f"{c}.mkv", range(8), times, col=c) for c in (0, 1)))
    assert not told
    assert [round(item.time_ns / 1e6) for item in source.frame_sets()] == times
    assert source.array.fps == pytest.approx(30, abs=1)


@pytest.mark.parametrize(("rates", "step"), [((60, 30), 2), ((30, 10), 3)])
def test_the_slower_camera_decides(tmp_path: Path, rates: tuple[int, int], step: int) -> None:
    source, told = opened(
        write_video(tmp_path / "fast.mp4", range(24), fps=rates[0]),
        write_video(tmp_path / "slow.mp4", range(0, 24, step), fps=rates[1]),
    )
    assert numbers(source) == [[n, n] for n in range(0, 24, step)]
    assert source.array.fps == rates[1]
    assert any("of fast.mp4" in text for text in told)


def test_rates_that_do_not_fit_are_paired_by_the_nearest_and_told(tmp_path: Path) -> None:
    source, told = opened(
        write_video(tmp_path / "a.mkv", range(30), at_30(list(range(30)))),
        write_video(tmp_path / "b.mkv", range(25), [n * 40 for n in range(25)]),
    )
    pairs = numbers(source)
    assert all(abs(a / 30 - b / 25) <= 1 / 60 + 1e-3 for a, b in pairs)
    assert any("ms apart; `tolerance_ms`" in text for text in told)
    strict, _ = opened(tmp_path / "a.mkv", tmp_path / "b.mkv", tolerance_ms=1)
    assert numbers(strict) == [[6 * n, 5 * n] for n in range(5)]


def test_a_constant_offset_within_a_frame_is_told_and_can_be_taken_back(tmp_path: Path) -> None:
    times = at_30(list(range(8)))
    paths = [
        write_video(tmp_path / "a.mkv", range(8), times),
        write_video(tmp_path / "b.mkv", range(8), [time + 12 for time in times]),
    ]
    source, told = opened(*paths)
    assert numbers(source) == [[n, n] for n in range(8)]
    assert "b.mkv takes its pictures 12 ms after a.mkv all the time, 0.36 of a frame" in told[0]
    assert opened(*paths, offsets_ms={"b.mkv": -12.0})[1] == []


def test_offsets_shift_a_camera_by_any_of_its_names(tmp_path: Path) -> None:
    paths = [write_video(tmp_path / f"{name}.mp4", range(10)) for name in "ab"]
    for name in ("b", "b.mp4", "r00_c01", str(paths[1])):
        source, _ = opened(*paths, offsets_ms={name: 100.0})
        assert numbers(source) == [[n + 3, n] for n in range(7)]
    source, _ = opened(*paths, offsets_ms={"b": -100.0, "a": -100.0})
    assert next(iter(source.frame_sets())).time_ns == 0, "no time before zero"
    with pytest.raises(SettingError, match=r"^offsets_ms: found c \(no such camera\).*one of a.mp4, b.mp4"):
        opened(*paths, offsets_ms={"c": 1.0})


def test_an_offset_of_a_virtual_view_is_refused_where_that_is_not_read(tmp_path: Path) -> None:
    paths = [write_video(tmp_path / f"{name}.mp4", range(10)) for name in "abc"]
    timing = Timing(offsets_ms={"b": 100.0})
    assert open_input(paths, grid=(1, 3), timing=timing).frame_count == 7
    with pytest.raises(
        SettingError, match=r"found b \(a virtual view, not read\), expected a real one: r00_c00"
    ):
        open_input(paths, grid=(1, 3), timing=timing, originals=False)


def test_cameras_without_a_common_time_are_refused(tmp_path: Path) -> None:
    paths = [
        write_video(tmp_path / "a.mkv", range(4), at_30([0, 1, 2, 3])),
        write_video(tmp_path / "b.mkv", range(4), at_30([40, 41, 42, 43])),
    ]
    with pytest.raises(InputError, match=r"a.mkv ends at 0.100 s, before b.mkv begins at 1.333 s"):
        opened(*paths)


def test_frames_are_chosen_out_of_those_that_all_cameras_have(tmp_path: Path) -> None:
    source, told = opened(*(write_video(tmp_path / f"{n}.mp4", range(n)) for n in (12, 9)))
    assert source.frame_count == 9
    assert numbers(source, slice(-2, None)) == [[7, 7], [8, 8]]
    assert "up to 3 pictures (of 12.mp4)" in told[0]


@pytest.mark.parametrize("cut", [4, 9])
def test_pictures_before_the_first_keyframe_are_not_there(tmp_path: Path, cut: int) -> None:
    """A recorder that joins a stream copies what it gets; frames before the keyframe cannot be decoded."""
    full = write_video(tmp_path / "full.mp4", range(20), g="10", keyint_min="10", sc_threshold="0")
    with av.open(str(full)) as source, av.open(str(tmp_path / "late.mkv"), "w") as out:
        stream = source.streams.video[0]
        copy = out.add_stream_from_template(stream)
        for index, packet in enumerate(p for p in source.demux(stream) if p.size):
            if index >= cut:
                packet.stream = copy
                out.mux(packet)
    array, told = opened(full, tmp_path / "late.mkv")
    assert numbers(array) == [[n, n] for n in range(10, 20)]
    assert f"late.mkv: {10 - cut} pictures are left out: a video before its first keyframe" in told[0]


def test_edit_lists_count(tmp_path: Path) -> None:
    """An MP4 whose edit list begins three frames in shows the fourth picture first."""
    path = write_video(tmp_path / "cut.mp4", range(12), bf="2")
    data = bytearray(path.read_bytes())
    at = data.find(b"elst")
    assert at > 0
    (entries,) = struct.unpack_from(">I", data, at + 8)
    assert entries == 1
    duration, media_time = struct.unpack_from(">Ii", data, at + 12)
    struct.pack_into(">Ii", data, at + 12, duration - 100, media_time + 3 * 512)
    path.write_bytes(data)
    view = VideoView(path)
    assert view.count == 9
    assert [number_of(picture) for picture in view.pictures(range(9))] == list(range(3, 12))
    assert view.times_ns is not None
    assert view.times_ns[0] == 0


def test_drop_frame_rates_are_exact(tmp_path: Path) -> None:
    rate = Fraction(30000, 1001)
    for form in ("mp4", "mkv"):
        (source, told) = opened(write_video(tmp_path / f"v.{form}", range(40), fps=rate))
        assert not told
        assert Fraction(source.array.fps).limit_denominator(10**6) == rate
        assert [item.time_ns for item in source.frame_sets(slice(30, 33))] == [
            round(n * 10**9 / rate) for n in (30, 31, 32)
        ]


def test_streams_without_times_take_the_rate_that_is_stated(tmp_path: Path) -> None:
    paths = [write_video(tmp_path / f"{c}.h264", range(6), form="h264", col=c) for c in (0, 1)]
    _, told = opened(*paths)
    assert "have no times; 30 fps are guessed. `fps` N" in told[0]
    source, told = opened(*paths, fps=12.0)
    assert not told
    assert source.array.fps == 12.0
    assert [item.time_ns for item in source.frame_sets()] == [round(n * 1e9 / 12) for n in range(6)]
    (tmp_path / "array.json").write_text('{"rows": 1, "cols": 2, "fps": 8, "pattern": "{col}.h264"}')
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert open_input([tmp_path]).array.fps == 8.0
    with pytest.raises(SettingError, match=r"^fps: found 0"):
        Timing(fps=0.0)


def test_fps_is_the_nominal_rate_of_files_that_have_times(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.mkv", range(4), [0, 40, 95, 120])
    source, _ = opened(path, fps=25.0)
    assert source.array.fps == 25.0
    assert [item.time_ns // 1_000_000 for item in source.frame_sets()] == [0, 40, 95, 120]


def test_array_json_may_state_the_times(tmp_path: Path) -> None:
    for c in (0, 1):
        write_video(tmp_path / f"{c}.h264", range(3), form="h264", col=c)
    head = '{"rows": 1, "cols": 2, "pattern": "{col}.h264", "times_ns": '
    (tmp_path / "array.json").write_text(head + "[5, 40000005, 90000005]}")
    source = open_input([tmp_path])
    assert [item.time_ns for item in source.frame_sets()] == [5, 40000005, 90000005]
    (tmp_path / "array.json").write_text(
        head + '{"r00_c00": [0, 40000000, 80000000], "r00_c01": [40000000, 80000000, 120000000]}}'
    )
    with pytest.warns(MvCodecWarning, match="common time"):
        source = open_input([tmp_path])
    assert numbers(source) == [[1, 0], [2, 1]]
    for value, complaint in (
        ("[0, 0, 1]", r"times_ns\[1\] = 0, expected more than 0"),
        ("[0, 1]", "found 2 times_ns of view r00_c00, expected 3"),
        ("[0, 1, 2.5]", r"times_ns\[2\] = 2.5"),
        ('{"r01_c00": [0]}', "times of 'r01_c00'"),
        ("7", "times_ns = no list"),
    ):
        (tmp_path / "array.json").write_text(head + value + "}")
        with pytest.raises(InputError, match=complaint):
            open_input([tmp_path])


def test_an_upside_down_camera_is_turned(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.mp4", range(2))
    turn_upside_down(path, SIZE)
    (first, _) = VideoView(path).pictures(range(2))
    assert abs(first[::-1, ::-1].astype(int) - numbered(0)).mean() < 6


@pytest.mark.parametrize(
    "name", ["cam:1.mp4", "http:cam.mp4", "50% cam %d.mp4", "-cam.mp4", "ümläut 相机.mp4"]
)
def test_names_are_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    write_video(tmp_path / "plain.mp4", range(2)).rename(tmp_path / name)
    monkeypatch.chdir(tmp_path)
    for path in (Path(name), tmp_path / name):
        assert numbers(opened(path)[0]) == [[0], [1]]


def test_a_short_virtual_view_costs_nothing_where_it_is_not_wanted(tmp_path: Path) -> None:
    """The middle one of three views is no real camera: it begins late, ends early and has gaps."""
    for col, shown in enumerate((range(12), (3, 4, 6, 7), range(12))):
        write_video(tmp_path / f"{col}.mkv", shown, at_30(list(shown)), col=col)
    paths = [tmp_path / f"{col}.mkv" for col in range(3)]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        source = open_input(paths, grid=(1, 3), originals=False)
    assert numbers(source) == [[n, n] for n in range(12)]
    assert not caught
    with pytest.raises(SettingError, match="expected a real camera"):
        source.frame_sets(views=[(0, 1)])
    with pytest.warns(MvCodecWarning, match="common time"):
        source = open_input(paths, grid=(1, 3))
    assert [item.time_ns for item in source.frame_sets(views=[(0, 1)])] == [
        round(n * 1e9 / 30) for n in (3, 4, 6, 7)
    ]


def test_the_command_codes_the_span_of_the_real_cameras(tmp_path: Path) -> None:
    for col, count in enumerate((5, 2, 5)):
        write_video(tmp_path / f"{col}.mp4", range(count), col=col)
    (tmp_path / "array.json").write_text('{"rows": 1, "cols": 3, "pattern": "{col}.mp4"}')
    choices: tuple[tuple[tuple[str, ...], int], ...] = (((), 5), (("--enhance", "40"), 2))
    for options, count in choices:
        out = tmp_path / f"{count}.mcap"
        ran = mvcodec("encode", tmp_path, out, "--matcher", "sgbm", "--json", *options)
        assert ran.returncode == 0, ran.stderr
        assert read_info(out).frames == count
        assert ("common time" in ran.stderr) == (count == 2)
