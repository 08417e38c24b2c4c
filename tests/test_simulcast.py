"""The anchor: every view coded by itself, its bits counted, its pictures measured."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_arrays import write_array

from mvcodec.capture import ArraySource, open_input
from mvcodec.encoder import Encoder, EncoderConfig
from mvcodec.errors import SettingError
from mvcodec.evaluation.simulcast import simulcast
from mvcodec.stream import TrackKind
from mvcodec.video.codec import RateControl


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> ArraySource:
    folder: Path = tmp_path_factory.mktemp("array")
    return open_input([write_array(folder, 2, 3, 4)])


def test_every_view_of_the_grid_is_coded_and_measured(source: ArraySource) -> None:
    pictures: list[None] = []
    result = simulcast(source, rate=RateControl(qp=27), gop=10, on_picture=lambda: pictures.append(None))
    assert [view.position for view in result.quality.views] == list(source.array.positions)
    assert [view.pictures for view in result.quality.views] == [4] * 6
    assert len(pictures) == 24
    assert result.frames == 4
    assert result.quality.psnr_y.worst is not None
    assert result.quality.psnr_y.worst > 33


def test_finer_quantisation_costs_bits_and_brings_quality(source: ArraySource) -> None:
    fine, coarse = (simulcast(source, rate=RateControl(qp=qp), gop=10) for qp in (20, 36))
    assert fine.bits > 2 * coarse.bits
    assert fine.quality.psnr_y.all is not None
    assert coarse.quality.psnr_y.all is not None
    assert fine.quality.psnr_y.all > coarse.quality.psnr_y.all + 6


def test_keyframes_come_as_often_as_asked(source: ArraySource) -> None:
    rare, always = (simulcast(source, rate=RateControl(qp=27), gop=gop) for gop in (10, 1))
    assert always.bits > 1.3 * rare.bits


def test_real_views_cost_what_the_encoder_spends_on_them(tmp_path: Path) -> None:
    source = open_input([write_array(tmp_path, 2, 2, 4)])
    config = EncoderConfig(qp=27, disparity_range_px=(0.0, 8.0))
    with Encoder(source.array, config) as encoder:
        packets = [packet for frame_set in source.frame_sets() for packet in encoder.push(frame_set)]
    texture = sum(8 * len(packet.data) for packet in packets if packet.track.kind is TrackKind.TEXTURE)
    anchor = simulcast(source, rate=RateControl(qp=27), gop=10, preset=config.preset)
    assert anchor.bits == texture


def test_an_empty_range_of_frames_is_refused(source: ArraySource) -> None:
    with pytest.raises(SettingError, match="--frames"):
        simulcast(source, slice(9, 9), rate=RateControl(qp=27), gop=10)
