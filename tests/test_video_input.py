"""Video files in: exact colours by the stream's own tags, grids of files, and bad files."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from array_files import picture_of, save_planes
from numpy.typing import NDArray
from timed_videos import write_video

from mvcodec.capture import open_input
from mvcodec.capture.video_input import VideoView
from mvcodec.errors import InputError, SettingError
from mvcodec.output.video_file import Mp4Writer
from mvcodec.scenes.textures import photograph as photograph_of

# ITU-R BT.709 and BT.601: shares of red and blue in luma.
LUMA_SHARES = {1: (0.2126, 0.0722), 5: (0.299, 0.114), 6: (0.299, 0.114)}


def colours() -> NDArray[np.uint8]:
    """uint8 (3, H, W): Y'CbCr patches of 8 x 8 px, well inside every range."""
    chance = np.random.default_rng(1)
    patches = chance.integers((70, 108, 108), (180, 148, 148), (4, 6, 3))
    return np.ascontiguousarray(np.kron(patches, np.ones((8, 8, 1))).transpose(2, 0, 1), np.uint8)


def to_rgb(yuv: NDArray[np.uint8], matrix: int, full: bool) -> NDArray[np.float64]:
    """The definition: R'G'B' of 8-bit Y'CbCr, BT.709 or BT.601, full or limited range."""
    red, blue = LUMA_SHARES[matrix]
    y, cb, cr = (plane.astype(np.float64) for plane in yuv)
    y = y if full else (y - 16) * 255 / 219
    cb, cr = ((c - 128) * (1 if full else 255 / 224) for c in (cb, cr))
    r, b = y + 2 * (1 - red) * cr, y + 2 * (1 - blue) * cb
    return np.stack([r, (y - red * r - blue * b) / (1 - red - blue), b], axis=-1)


@pytest.mark.parametrize("matrix", [1, 5, 6])
@pytest.mark.parametrize("full", [False, True])
def test_colours_follow_the_tags(tmp_path: Path, matrix: int, full: bool) -> None:
    save_planes(tmp_path / "v.mkv", [colours()], matrix=matrix, full=full)
    (picture,) = VideoView(tmp_path / "v.mkv").pictures(range(1))
    assert np.abs(picture - to_rgb(colours(), matrix, full)).max() <= 1.5


def test_the_tags_matter() -> None:
    """The check above can fail: the definitions differ by much more than it allows."""
    by_709, by_601 = to_rgb(colours(), 1, False), to_rgb(colours(), 6, False)
    assert np.abs(by_709 - by_601).max() > 5
    assert np.abs(by_601 - to_rgb(colours(), 6, True)).max() > 5


@pytest.mark.parametrize(("height", "matrix"), [(64, 6), (720, 1)])
def test_untagged_files_go_by_their_height(tmp_path: Path, height: int, matrix: int) -> None:
    yuv = np.ascontiguousarray(np.resize(colours()[:, :16], (3, height, 48)))
    yuv[:] = np.array([120, 110, 145], np.uint8)[:, None, None]
    save_planes(tmp_path / "v.mkv", [yuv])
    (picture,) = VideoView(tmp_path / "v.mkv").pictures(range(1))
    assert np.abs(picture - to_rgb(yuv, matrix, False)).max() <= 1.5


def test_h264_round_trip_keeps_luma(tmp_path: Path) -> None:
    """No systematic error of luma between what is written and what is read."""
    photograph = photograph_of("chelsea")[:240, :320]
    with Mp4Writer(tmp_path / "v.mp4", 320, 240, 25.0, crf=1) as writer:
        writer.push(photograph)
    (picture,) = VideoView(tmp_path / "v.mp4").pictures(range(1))
    luma = (picture.astype(np.float64) - photograph) @ [0.299, 0.587, 0.114]
    assert abs(luma.mean()) < 0.15
    assert 10 * np.log10(255**2 / np.mean(luma**2)) > 47


def write_grid(folder: Path, count: int, frames: int = 3, fps: float = 12.5) -> list[Path]:
    folder.mkdir(exist_ok=True)
    paths = [folder / f"cam{number}.mp4" for number in range(count)]
    for number, path in enumerate(paths):
        with Mp4Writer(path, 24, 16, fps, crf=4) as writer:
            for frame in range(frames):
                writer.push(picture_of(divmod(number, 3), frame))
    return paths


def test_files_are_taken_in_row_order(tmp_path: Path) -> None:
    paths = write_grid(tmp_path, 6)
    source = open_input(paths, grid=(2, 3), real="all")
    assert (source.array.rows, source.array.cols, source.frame_count) == (2, 3, 3)
    assert (source.array.fps, source.array.width, source.array.height) == (12.5, 24, 16)
    assert not source.array.calibration.given
    for item in source.frame_sets():
        for position, picture in item.pictures.items():
            expected = picture_of(position, item.index)[8, 12].astype(int)
            assert np.abs(picture[8, 12] - expected).max() <= 6
    assert [item.time_ns for item in source.frame_sets()] == [0, 80_000_000, 160_000_000]


def test_a_range_of_frames_is_the_same_as_in_the_whole(tmp_path: Path) -> None:
    source = open_input(write_grid(tmp_path, 1, 8), grid=(1, 1))
    whole = [item.pictures[0, 0] for item in source.frame_sets()]
    assert len(whole) == 8
    part = list(source.frame_sets(slice(3, 6)))
    assert [item.index for item in part] == [3, 4, 5]
    for item in part:
        np.testing.assert_array_equal(item.pictures[0, 0], whole[item.index])


def test_frames_are_counted_where_the_container_does_not_say(tmp_path: Path) -> None:
    (path,) = write_grid(tmp_path, 1, 5)
    raw = tmp_path / "v.h264"
    with av.open(str(path)) as source, av.open(str(raw), "w", format="h264") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                target.mux(packet)
    view = VideoView(raw)
    assert view.count == 5
    assert len(list(view.pictures(range(5)))) == 5


def test_grid_setting(tmp_path: Path) -> None:
    paths = write_grid(tmp_path, 4, 1)
    with pytest.raises(SettingError, match=r"^grid: found nothing, expected RxC for 4 files in row order"):
        open_input(paths)
    with pytest.raises(SettingError, match=r"^grid: found 2x3, expected RxC with R\*C = 4"):
        open_input(paths, grid=(2, 3))
    with pytest.raises(InputError, match="found a folder among several inputs"):
        open_input([*paths[:3], tmp_path], grid=(2, 2))


def test_views_must_agree(tmp_path: Path) -> None:
    paths = write_grid(tmp_path / "a", 2)
    with Mp4Writer(tmp_path / "wide.mp4", 26, 16, 12.5) as writer:
        for _ in range(3):
            writer.push(picture_of((0, 0), 0, (26, 16)))
    with pytest.raises(InputError, match=r"wide\.mp4: found 26x16 px, expected 24x16 px"):
        open_input([paths[0], tmp_path / "wide.mp4"], grid=(1, 2))


def test_bad_files(tmp_path: Path) -> None:
    (path,) = write_grid(tmp_path, 1)
    (tmp_path / "text.mp4").write_text("no video at all")
    (tmp_path / "empty.mp4").write_bytes(b"")
    (tmp_path / "cut.mp4").write_bytes(path.read_bytes()[:300])
    with av.open(str(tmp_path / "sound.wav"), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), "s16", "mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
    for name, reason in (
        ("text.mp4", "an unreadable video"),
        ("empty.mp4", "an empty file"),
        ("cut.mp4", "(an unreadable video|no video stream)"),
        ("sound.wav", "no video stream"),
        ("gone.mp4", "nothing there"),
    ):
        with pytest.raises(InputError, match=rf"{name}: found {reason}"):
            open_input([tmp_path / name], grid=(1, 1))


def test_a_file_that_ends_early_says_so(tmp_path: Path) -> None:
    (path,) = write_grid(tmp_path, 1, 4)
    view = VideoView(path)
    view.count = 9
    with pytest.raises(InputError, match=r"cam0\.mp4: found no whole picture 4, .*, expected 9 pictures"):
        list(view.pictures(range(9)))


def test_what_a_file_says_and_is_left_aside_is_told(tmp_path: Path) -> None:
    with av.open(str(tmp_path / "a.mkv"), "w") as out:
        streams = [out.add_stream("libx264", rate=30) for _ in range(2)]
        for stream in streams:
            stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
            stream.codec_context.sample_aspect_ratio = Fraction(4, 3)
        for stream in streams:
            for number in range(3):
                frame = av.VideoFrame(64, 48, "yuv420p")
                frame.pts = number
                out.mux(stream.encode(frame))
            out.mux(stream.encode())
    notes = VideoView(tmp_path / "a.mkv").notes
    assert any("its pixels are 4:3, not square" in note for note in notes)
    assert any("it has 2 videos: the first one is taken" in note for note in notes)


def encrypted(source: Path, target: Path) -> Path:
    """The same MP4 file with Common Encryption."""
    key = "00112233445566778899aabbccddeeff"
    options = {"encryption_scheme": "cenc-aes-ctr", "encryption_key": key, "encryption_kid": key}
    with av.open(str(source)) as plain, av.open(str(target), "w", format="mp4", options=options) as out:
        stream = out.add_stream_from_template(plain.streams.video[0])
        for packet in plain.demux(plain.streams.video[0]):
            if packet.size:
                packet.stream = stream
                out.mux(packet)
    return target


def test_encrypted_files_are_called_so(tmp_path: Path) -> None:
    plain = write_video(tmp_path / "v.mp4", range(3))
    with pytest.raises(InputError, match=r"no frames \(3 are left out: they are encrypted\)"):
        VideoView(encrypted(plain, tmp_path / "e.mp4"))
