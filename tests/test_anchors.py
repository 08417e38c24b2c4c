"""The anchors: every view coded by a stock encoder in some order, bits counted, pictures measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import av
import numpy as np
import pytest
from av.video.frame import PictureType
from numpy.typing import NDArray
from small_arrays import write_array

from mvcodec.capture import ArraySource, open_input
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.errors import SettingError
from mvcodec.evaluation.anchors import ANCHORS, SIMULCAST, Anchor, CodedArray, code_array
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter
from mvcodec.stream import TrackKind
from mvcodec.video.codec import CodedPicture, Planes, RateControl, VideoEncoder, VideoSettings
from mvcodec.video.codecs import CODECS
from mvcodec.video.colour import grey_planes


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> ArraySource:
    folder: Path = tmp_path_factory.mktemp("array")
    return open_input([write_array(folder, 2, 3, 4)])


def test_every_view_of_the_grid_is_coded_and_measured(source: ArraySource) -> None:
    pictures: list[None] = []
    result = code_array(source, rate=RateControl(qp=27), gop=10, on_picture=lambda: pictures.append(None))
    assert [view.position for view in result.quality.views] == list(source.array.positions)
    assert [view.pictures for view in result.quality.views] == [4] * 6
    assert len(pictures) == 2 * 24, "each is coded, then measured"
    assert result.frames == 4
    assert result.quality.psnr_y.worst is not None
    assert result.quality.psnr_y.worst > 33


def test_finer_quantisation_costs_bits_and_brings_quality(source: ArraySource) -> None:
    fine, coarse = (code_array(source, rate=RateControl(qp=qp), gop=10) for qp in (20, 36))
    assert fine.bits > 2 * coarse.bits
    assert fine.quality.psnr_y.all is not None
    assert coarse.quality.psnr_y.all is not None
    assert fine.quality.psnr_y.all > coarse.quality.psnr_y.all + 6


def test_keyframes_come_as_often_as_asked(source: ArraySource) -> None:
    rare, always = (code_array(source, rate=RateControl(qp=27), gop=gop) for gop in (10, 1))
    assert always.bits > 1.3 * rare.bits


def test_real_views_cost_what_the_encoder_spends_on_them(tmp_path: Path) -> None:
    source = open_input([write_array(tmp_path, 2, 2, 4)])
    config = EncoderConfig(qp=27, disparity_range_px=(0.0, 8.0))
    with Encoder(source.array, config) as encoder:
        packets = [packet for frame_set in source.frame_sets() for packet in encoder.push(frame_set)]
    texture = sum(8 * len(packet.data) for packet in packets if packet.track.kind is TrackKind.TEXTURE)
    anchor = code_array(source, rate=RateControl(qp=27), gop=10, preset=config.chosen_preset)
    assert anchor.bits == texture


@pytest.fixture(params=[anchor for family in ANCHORS.values() for anchor in family], ids=lambda a: a.name)
def anchor(request: pytest.FixtureRequest) -> Anchor:
    found: Anchor = request.param
    return found


@pytest.mark.parametrize("codec", list(CODECS))
def test_every_order_and_codec_gives_back_every_picture_in_its_place(
    source: ArraySource, anchor: Anchor, codec: str
) -> None:
    result = coded(source, anchor, codec)
    assert [view.pictures for view in result.quality.views] == [4] * 6
    assert result.quality.psnr_y.worst is not None
    assert result.quality.psnr_y.worst > 30, "pictures of another view or time"
    assert result.encode_seconds > 0
    assert result.decode_seconds > 0


def test_threads_change_nothing_but_time(source: ArraySource, anchor: Anchor) -> None:
    one, two = (coded(source, anchor, threads=threads) for threads in (1, 2))
    assert (one.bits, one.quality) == (two.bits, two.quality)


def test_neighbouring_views_predict_each_other(source: ArraySource) -> None:
    simulcast, rows, whole = (coded(source, order).bits for order in (SIMULCAST, *ANCHORS["pvs"][::-1]))
    assert whole < rows < 0.8 * simulcast


class NotingEncoder:
    """Stands in for an encoder: its access units are the pictures' levels."""

    noted: ClassVar[list[tuple[int, bool]]] = []

    def __init__(self, settings: VideoSettings) -> None:
        self.settings = settings

    def push(self, planes: Planes, keyframe: bool = False) -> list[CodedPicture]:
        self.noted.append((int(planes.y[0, 0]), keyframe))
        return [CodedPicture(bytes([planes.y[0, 0]]), keyframe)]

    def flush(self) -> list[CodedPicture]:
        return []


class LevelDecoder:
    """Gives back what NotingEncoder took."""

    def __init__(self, low_delay: bool = True) -> None:
        assert not low_delay

    def push(self, data: bytes, label: str) -> list[Planes]:
        assert label
        return [grey_planes(np.full((16, 16), data[0], np.uint8))]

    def flush(self) -> list[Planes]:
        return []


def test_a_sequence_goes_through_the_matrix_to_and_fro_with_keyframes_at_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    views = [(row, col) for row in range(3) for col in range(2)]
    with ArrayFolderWriter(tmp_path, ArrayFacts(3, 2, fps=10.0)) as writer:
        for time in range(3):
            level = {view: 40 * (time + 1) + 5 * number for number, view in enumerate(views)}
            writer.push({view: np.full((16, 16, 3), level[view], np.uint8) for view in views})
    monkeypatch.setitem(
        CODECS, "noting", replace(CODECS["h264"], encoder=NotingEncoder, decoder=LevelDecoder)
    )
    NotingEncoder.noted.clear()
    source, pvs = open_input([tmp_path]), ANCHORS["pvs"][0]
    result = code_array(source, anchor=pvs, codec="noting", rate=RateControl(qp=30), gop=2)
    there = [(0, 0), (0, 1), (1, 1), (1, 0), (2, 0), (2, 1)]
    order = [(time, view) for time in range(3) for view in (there[::-1] if time == 1 else there)]
    rank = {level: number for number, level in enumerate(sorted({level for level, _ in NotingEncoder.noted}))}
    found = [divmod(rank[level], 6) for level, _ in NotingEncoder.noted]
    assert [(time, views[number]) for time, number in found] == order
    assert [number for number, (_, key) in enumerate(NotingEncoder.noted) if key] == [0, 12]
    assert result.bits == 8 * 18
    assert result.quality.psnr_y.worst is not None
    assert result.quality.psnr_y.worst > 45


class RecordingEncoder:
    """Passes on to a real encoder, and keeps its access units."""

    units: ClassVar[list[CodedPicture]] = []

    def __init__(self, encoder: VideoEncoder) -> None:
        self.encoder = encoder

    def push(self, planes: Planes, keyframe: bool = False) -> list[CodedPicture]:
        return self._kept(self.encoder.push(planes, keyframe))

    def flush(self) -> list[CodedPicture]:
        return self._kept(self.encoder.flush())

    def _kept(self, units: list[CodedPicture]) -> list[CodedPicture]:
        self.units.extend(units)
        return units


def decoded_lumas(codec: str, units: list[CodedPicture]) -> list[NDArray[np.uint8]]:
    decoder = CODECS[codec].decoder(low_delay=False)
    shown = [planes for unit in units for planes in decoder.push(unit.data, "unit")]
    return [planes.y for planes in [*shown, *decoder.flush()]]


def has_b_pictures(codec: str, units: list[CodedPicture]) -> bool:
    context = av.CodecContext.create(codec, "r")
    assert isinstance(context, av.VideoCodecContext)
    frames = [frame for unit in units for frame in context.decode(av.Packet(unit.data))]
    return any(frame.pict_type == PictureType.B for frame in [*frames, *context.decode(None)])


@pytest.mark.parametrize("codec", list(CODECS))
def test_real_streams_start_anew_at_our_keyframe_times(
    source: ArraySource, monkeypatch: pytest.MonkeyPatch, codec: str
) -> None:
    real = CODECS[codec]
    recording = replace(real, encoder=lambda settings: RecordingEncoder(real.encoder(settings)))
    RecordingEncoder.units.clear()
    with monkeypatch.context() as patch:
        patch.setitem(CODECS, codec, recording)
        rate = RateControl(qp=27)
        code_array(source, anchor=ANCHORS["pvs"][0], codec=codec, rate=rate, gop=2, preset="medium")
    units = RecordingEncoder.units
    assert codec in ("av1", "vp9") or has_b_pictures(codec, units), "AV1 and VP9 have none by name"
    keys = [number for number, unit in enumerate(units) if unit.keyframe]
    assert len(keys) == 2
    whole = decoded_lumas(codec, units)
    parts = [decoded_lumas(codec, part) for part in (units[: keys[1]], units[keys[1] :])]
    assert [len(part) for part in parts] == [12, 12], "6 views at 2 times"
    np.testing.assert_array_equal(np.stack(whole), np.stack(parts[0] + parts[1]))


def coded(source: ArraySource, anchor: Anchor, codec: str = "h264", threads: int = 2) -> CodedArray:
    rate = RateControl(qp=27)
    return code_array(source, anchor=anchor, codec=codec, rate=rate, gop=10, preset="fast", threads=threads)


def test_an_empty_range_of_frames_is_refused(source: ArraySource) -> None:
    with pytest.raises(SettingError, match=r"^frames: found"):
        code_array(source, slice(9, 9), rate=RateControl(qp=27), gop=10)
