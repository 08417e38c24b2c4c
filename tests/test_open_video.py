"""`mvcodec.open`: frame sets by number, by time and in order; views of them; what a wrong source says."""

from __future__ import annotations

import io
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np
import pytest
from coding import Pipe, encode, encoded_file, make_array

import mvcodec
from mvcodec.frames import DecodedSet
from mvcodec.synthesis.provenance import Provenance

FRAMES, FPS, GOP = 10, 10.0, 4
ARRAY = make_array()


@pytest.fixture(scope="module")
def content() -> bytes:
    """10 frame sets, keyframes at 0, 4 and 8; the first is number 30 of the encoder's input."""
    return encoded_file(ARRAY, FRAMES, first=30, gop=GOP)


@pytest.fixture(scope="module")
def file(content: bytes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("open") / "ours.mcap"
    path.write_bytes(content)
    return path


@pytest.fixture(scope="module")
def in_order(file: Path) -> list[DecodedSet]:
    with mvcodec.Decoder.open(file) as decoder:
        return list(decoder)


def same(one: DecodedSet, other: DecodedSet) -> bool:
    return one.index == other.index and all(
        np.array_equal(one.pictures[camera], other.pictures[camera])
        and np.array_equal(one.disparities[camera].values_px, other.disparities[camera].values_px)
        for camera in one.array.real
    )


def test_another_policy_at_damage_is_refused_at_once(file: Path) -> None:
    with pytest.raises(mvcodec.SettingError, match="on_error: found ignore, expected skip or stop"):
        mvcodec.open(file, on_error="ignore")  # type: ignore[arg-type]


def test_it_says_what_it_is(file: Path) -> None:
    with mvcodec.open(file) as video:
        assert (len(video), video.fps, video.codec) == (FRAMES, ARRAY.fps, "h264")
        assert (video.array.rows, video.array.cols) == (ARRAY.rows, ARRAY.cols)
        assert video.duration_s == pytest.approx(FRAMES / ARRAY.fps)
        assert video.times_s[:3] == pytest.approx((0, 1 / ARRAY.fps, 2 / ARRAY.fps))
        assert video.header.settings["qp"] == 20


@pytest.mark.parametrize("number", [0, 7, 3, 9, 4, -1, -10, np.int64(5)])
def test_any_frame_set_is_the_one_that_decoding_in_order_gives(
    file: Path, in_order: list[DecodedSet], number: int
) -> None:
    with mvcodec.open(str(file)) as video:
        assert same(video[number], in_order[number])


def test_frame_sets_come_in_order_and_again(file: Path, in_order: list[DecodedSet]) -> None:
    with mvcodec.open(file) as video:
        for _ in range(2):
            found = list(video)
            assert len(found) == FRAMES
            assert all(map(same, found, in_order))


def test_slices_are_gone_through(file: Path, in_order: list[DecodedSet]) -> None:
    with mvcodec.open(file, cache_bytes=0) as video:
        assert [found.index for found in video[-2:1:-3]] == [38, 35, 32]
        assert all(map(same, video[2:5], in_order[2:5]))


def test_a_time_gives_the_frame_set_that_is_shown(file: Path) -> None:
    step = 1 / ARRAY.fps
    with mvcodec.open(file) as video:
        numbers = [video.at(time).index - 30 for time in (0, 0.5 * step, step, 2.99 * step, FRAMES * step)]
        assert numbers == [0, 0, 1, 2, FRAMES - 1]
        for wrong in (-0.01, (FRAMES + 0.1) * step, float("nan")):
            with pytest.raises(mvcodec.NoSuchFrame, match=r"ours\.mcap: found time .* s, expected 0\.\."):
                video.at(wrong)


@pytest.mark.parametrize("number", [FRAMES, -FRAMES - 1, 10**9])
def test_a_frame_set_past_the_end_is_an_index_error_of_one_line(file: Path, number: int) -> None:
    with mvcodec.open(file) as video, pytest.raises(IndexError) as caught:
        video[number]
    assert str(caught.value) == (
        f"{file}: found frame {number}, expected 0..{FRAMES - 1}, or -{FRAMES}..-1 from the end"
    )


def test_a_view_with_its_disparity_and_provenance(file: Path, in_order: list[DecodedSet]) -> None:
    place = mvcodec.Viewpoint(0.5, 0.25)
    expected = mvcodec.make_synthesizer("layered").render(in_order[6], place)
    with mvcodec.open(file) as video:
        picture = video.render(0.5, 0.25, frame=6)
        assert picture.dtype == np.uint8
        np.testing.assert_array_equal(picture, expected.pixels)
        np.testing.assert_array_equal(video.disparity(0.5, 0.25, frame=6), expected.disparity_px)
        found, known = video.provenance(0.5, 0.25, frame=6), Provenance.of(expected)
        np.testing.assert_array_equal(found.picture(), known.picture())


def test_on_a_real_cameras_place_the_picture_is_its_own(file: Path, in_order: list[DecodedSet]) -> None:
    with mvcodec.open(file, synthesizer="layered:filter=0") as video:
        for camera in video.array.real:
            np.testing.assert_array_equal(video.render(*camera, frame=-1), in_order[-1].pictures[camera])


def test_a_view_is_rendered_once(file: Path) -> None:
    class Counting:
        calls = 0

        def render(self, decoded: DecodedSet, viewpoint: mvcodec.Viewpoint) -> mvcodec.RenderedView:
            self.calls += 1
            return mvcodec.make_synthesizer("linear").render(decoded, viewpoint)

    counting = Counting()
    with mvcodec.open(file, synthesizer=counting) as video:
        video.render(0.5, 0.5)
        video.disparity(0.5, 0.5)
        video.provenance(0.5, 0.5)
        assert counting.calls == 1
        video.render(0.5, 0.5, frame=1)
        assert counting.calls == 2


def test_the_synthesizer_can_be_chosen_for_all_views_or_one(file: Path, in_order: list[DecodedSet]) -> None:
    expected = mvcodec.make_synthesizer("linear").render(in_order[0], mvcodec.Viewpoint(0, 0.5)).pixels
    with mvcodec.open(file, synthesizer="linear") as all_linear, mvcodec.open(file) as video:
        np.testing.assert_array_equal(all_linear.render(0, 0.5), expected)
        np.testing.assert_array_equal(video.render(0, 0.5, synthesizer="linear"), expected)
        assert not np.array_equal(video.render(0, 0.5), expected)


def test_outside_of_the_array_is_an_error(file: Path) -> None:
    with (
        mvcodec.open(file) as video,
        pytest.raises(mvcodec.SettingError, match=r"viewpoint: found 0,7, expected row 0\.\.\d, col 0\.\.\d"),
    ):
        video.render(0, 7)


def test_a_binary_file_is_shared_and_stays_open(content: bytes, in_order: list[DecodedSet]) -> None:
    file = io.BytesIO(content)
    with mvcodec.open(file) as video:
        going = iter(video)
        for number in (0, 9, 1, 5, 2):  # two places of the file are decoded from, and a third in order
            assert same(video[number], in_order[number])
            next(going)
    assert not file.closed


def test_threads_may_share_a_video(content: bytes, in_order: list[DecodedSet]) -> None:
    wrong: list[int] = []

    def look(video: mvcodec.Video, numbers: range) -> None:
        wrong.extend(number for number in numbers if not same(video[number], in_order[number]))

    with mvcodec.open(io.BytesIO(content), cache_bytes=0) as video:
        orders = (range(FRAMES), range(FRAMES - 1, -1, -1), range(0, FRAMES, 3))
        threads = [threading.Thread(target=look, args=(video, order)) for order in orders]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert wrong == []


def test_a_pipe_can_be_iterated_over_once(content: bytes, in_order: list[DecodedSet]) -> None:
    with mvcodec.open(cast("BinaryIO", Pipe(content))) as video:
        assert (video.array.cols, video.codec) == (ARRAY.cols, "h264")
        for ask in (lambda: len(video), lambda: video[0], lambda: video.at(0), lambda: video.render(0, 0)):
            with pytest.raises(mvcodec.InputError, match="found a pipe, expected a file"):
                ask()
        assert all(map(same, video, in_order))
        with pytest.raises(mvcodec.InputError, match="gone through before"):
            next(iter(video))


def test_standard_input_is_a_dash(file: Path) -> None:
    program = "import mvcodec\nwith mvcodec.open('-') as video: print(sum(1 for _ in video))"
    with file.open("rb") as given:
        done = subprocess.run([sys.executable, "-c", program], stdin=given, capture_output=True, check=True)
    assert done.stdout.split() == [str(FRAMES).encode()]


def test_a_file_that_is_cut_off_is_read_up_to_there(content: bytes) -> None:
    with pytest.warns(mvcodec.MvCodecWarning, match="cut off"):
        video = mvcodec.open(io.BytesIO(content[: len(content) // 2]))
    with video:
        assert 0 < len(video) < FRAMES
        assert video[-1].index == 30 + len(video) - 1


def test_a_damaged_frame_set_is_told_and_the_others_are_given(tmp_path: Path) -> None:
    sets = encode(ARRAY, 6, gop=2)
    spoiled = sets[2][1]  # the first camera's picture in the second keyframe's frame set
    sets[2][1] = replace(spoiled, data=spoiled.data[: len(spoiled.data) // 2])
    path = tmp_path / "damaged.mcap"
    with mvcodec.McapWriter(path) as writer:
        for packets in sets:
            writer.push(packets)
    with mvcodec.open(path) as video:
        for number in (2, 3):
            with pytest.raises(mvcodec.StreamError, match=r"damaged\.mcap: /camera/r00_c00/video at 0\.2"):
                video[number]
        assert [video[number].index for number in (0, 1, 4, 5)] == [0, 1, 4, 5]
    with mvcodec.open(path, on_error="skip") as video, pytest.warns(mvcodec.MvCodecWarning, match="0.200 s"):
        assert [found.index for found in video] == [0, 1, 4, 5]


def test_what_is_no_file_of_ours_is_named(tmp_path: Path) -> None:
    other = tmp_path / "notes.mcap"
    other.write_text("nothing of that kind " * 10)
    with pytest.raises(mvcodec.InputError, match=r"nowhere\.mcap: found No such file"):
        mvcodec.open(tmp_path / "nowhere.mcap")
    with pytest.raises(mvcodec.StreamError, match=r"notes\.mcap: found .*, expected "):
        mvcodec.open(other)
    with pytest.raises(mvcodec.SettingError, match="synthesizer: found nonsense, expected one of layered"):
        mvcodec.open(other, synthesizer="nonsense")
