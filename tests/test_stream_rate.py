"""A bit rate of several tracks that build on each other, and the quality of a layer beside its base."""

from __future__ import annotations

from typing import Any

import pytest
from coding import RANGE_PX, RampMatcher
from test_enhancement import ARRAY, encode, frames, pushed

from mvcodec.encoding.config import LAYER_SLOPE, MOST_LAYER_OFFSET, EncoderConfig
from mvcodec.encoding.encoder import Encoder
from mvcodec.encoding.stream_rate import StreamRate
from mvcodec.errors import SettingError
from mvcodec.stream import TrackKind


def test_auto_follows_the_quality_of_the_pictures_and_how_many_views_build_on_each() -> None:
    auto = EncoderConfig(qp=27, enhance="auto")
    assert auto.layer_quality(8, 4) == 27 + LAYER_SLOPE
    assert auto.layer_quality(16, 4) == 27 + 2 * LAYER_SLOPE
    assert auto.layer_quality(285, 4) == 27 + MOST_LAYER_OFFSET
    assert auto.layer_quality(1, 4) == 27
    assert EncoderConfig(qp=50, enhance="auto").layer_quality(21, 4) == 51
    assert EncoderConfig(qp=27, enhance=30).layer_quality(21, 4) == 30
    assert EncoderConfig(bitrate_kbps=100, enhance="auto").layer_quality(21, 4) is None
    assert EncoderConfig(qp=27).layer_quality(21, 4) is None
    with pytest.raises(SettingError, match="enhance: found best, expected a QP, \\+QPS or auto"):
        EncoderConfig(enhance="best")


@pytest.mark.parametrize(
    ("kbps", "settings"),
    [
        (900.0, {"enhance": "auto"}),
        (400.0, {"prediction": "synthesis"}),
        (600.0, {"prediction": "synthesis", "enhance": "auto", "codec": "hevc"}),
    ],
)
def test_all_tracks_hold_a_bit_rate_together(kbps: float, settings: dict[str, Any]) -> None:
    count, gop = 25, 5
    config = EncoderConfig(
        bitrate_kbps=kbps,
        gop=gop,
        preset="veryfast",
        matcher=RampMatcher(),
        disparity_range_px=RANGE_PX,
        **settings,
    )
    with Encoder(ARRAY, config) as encoder:
        sets = [encoder.push(taken) for taken in frames(count)]
    total = sum(8 * len(packet.data) for packets in sets for packet in packets)
    found_kbps = total / count * ARRAY.fps / 1000
    assert 0.85 * kbps < found_kbps < 1.15 * kbps
    assert {packets[0].data for packets in sets[::gop]} == {sets[0][0].data}
    assert [found.index for found in pushed(sets)] == list(range(count))


def test_the_quality_goes_where_the_bits_were_meant_to() -> None:
    rate = StreamRate(100, 10, 5, 1.0, 51)
    before = rate.qp
    rate.begin()
    assert rate.try_again(80_000)
    assert rate.qp == before + 10  # 25 kbit were meant: the half of five sets'
    assert not rate.try_again(26_000)
    for bits in (26_000, 4_000, 4_000, 4_000, 4_000):
        rate.spend(bits)
    coarse = rate.qp
    rate.begin()
    assert rate.qp < coarse
    assert not rate.try_again(400_000)  # only the first frame set can be coded again


def test_a_layer_of_its_own_quality_comes_on_top() -> None:
    settings: dict[str, Any] = {"qp": None, "bitrate_kbps": 300.0, "prediction": "synthesis"}
    base, both = encode(4, enhance=None, **settings), encode(4, enhance=26, **settings)
    layer = (TrackKind.LAYER, TrackKind.ENHANCED)
    for with_layer, without in zip(both, base, strict=True):
        assert [packet for packet in with_layer if packet.track.kind not in layer] == without
