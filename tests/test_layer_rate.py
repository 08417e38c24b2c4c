"""How many bits the enhancement layer gets: beside a quality, and within a bit rate of base and layer."""

from __future__ import annotations

import pytest
from coding import RANGE_PX, RampMatcher
from test_enhancement import ARRAY, frames

from mvcodec.encoding.config import EncoderConfig
from mvcodec.encoding.encoder import Encoder
from mvcodec.encoding.layer_rate import LAYER_OFFSET, LayerRate
from mvcodec.errors import SettingError
from mvcodec.stream import TrackKind


def test_auto_follows_the_quality_of_the_pictures() -> None:
    assert EncoderConfig(qp=27, enhance="auto").layer_quality == 27 + LAYER_OFFSET
    assert EncoderConfig(qp=50, enhance="auto").layer_quality == 51
    assert EncoderConfig(qp=27, enhance=30).layer_quality == 30
    assert EncoderConfig(bitrate_kbps=100, enhance="auto").layer_quality is None
    assert EncoderConfig(qp=27).layer_quality is None
    with pytest.raises(SettingError, match="enhance: found best, expected a QP, or auto"):
        EncoderConfig(enhance="best")


@pytest.mark.parametrize("kbps", [600.0, 900.0])
def test_base_and_layer_hold_a_bit_rate_together(kbps: float) -> None:
    count, gop = 30, 5
    config = EncoderConfig(
        bitrate_kbps=kbps,
        enhance="auto",
        gop=gop,
        preset="veryfast",
        matcher=RampMatcher(),
        disparity_range_px=RANGE_PX,
    )
    total = layer = 0
    with Encoder(ARRAY, config) as encoder:
        for taken in frames(count):
            for packet in encoder.push(taken):
                if packet.track.kind not in (TrackKind.HEADER, TrackKind.LAYER):
                    total += 8 * len(packet.data)
                    layer += 8 * len(packet.data) * (packet.track.kind is TrackKind.ENHANCED)
    found_kbps = total / count * ARRAY.fps / 1000
    assert 0.8 * kbps < found_kbps < 1.2 * kbps
    assert layer > 0.03 * total


def test_the_quantizer_goes_where_the_bits_were_meant_to() -> None:
    rate = LayerRate(100, 10)
    before = rate.quantizer
    rate.begin()
    assert rate.try_again(40_000)
    assert rate.quantizer > before
    assert not rate.try_again(1_500)
    rate.spend(8_500, 300)
    coarse = rate.quantizer
    rate.begin()
    assert rate.quantizer < coarse
    assert not rate.try_again(40_000)  # only the first frame set can be coded again
