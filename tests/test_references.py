"""Which pictures build on one that is missing: found for every codec, and in no stream that is whole."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from coding import config, encode, frame_set, make_array

from mvcodec.conformance.unit_rules import UnitRules
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder
from mvcodec.errors import MissingReference, StreamError
from mvcodec.stream import Packet, TrackKind
from mvcodec.video.bits import NalError
from mvcodec.video.codec import RateControl, VideoSettings
from mvcodec.video.codecs import CODECS, find_codec
from mvcodec.video.colour import to_planes
from mvcodec.video.reference_watch import ReferenceWatch

ARRAY = make_array(64, 48, rows=1, cols=2, fps=20.0)
COUNT, GOP = 16, 8
SIZE = (64, 48)


@pytest.fixture(scope="module", params=CODECS)
def coded(request: pytest.FixtureRequest) -> tuple[str, list[list[Packet]]]:
    """A codec's name, and frame sets with keyframes at 0 and 8."""
    return request.param, encode(ARRAY, COUNT, gop=GOP, codec=request.param)


def _findings(codec: str, units: list[bytes], keys: list[bool]) -> list[set[str]]:
    rules = UnitRules(CODECS[codec], TrackKind.TEXTURE, SIZE)
    return [
        {code for code, _ in rules.push(unit, key, index)}
        for index, (unit, key) in enumerate(zip(units, keys, strict=True))
    ]


def test_a_removed_access_unit_is_found_at_the_next_one(coded: tuple[str, list[list[Packet]]]) -> None:
    codec, sets = coded
    for track in sets[1]:
        units = [next(p.data for p in packets if p.track == track.track) for packets in sets]
        keys = [index % GOP == 0 for index in range(COUNT)]
        if track.track.kind is TrackKind.TEXTURE:
            assert _findings(codec, units, keys) == [set()] * COUNT
        for gone in range(1, COUNT - 1):
            watch = ReferenceWatch(find_codec(codec), SIZE)
            found = []
            for index, unit in enumerate(units):
                try:
                    if index != gone:
                        watch.push(unit, "unit", index)
                except MissingReference:
                    found.append(index)
            # Nothing builds on the last picture before a keyframe.
            assert found[:1] == ([] if gone == GOP - 1 else [gone + 1]), (track.track, gone)


def test_the_decoder_leaves_out_what_builds_on_a_missing_frame_set(
    coded: tuple[str, list[list[Packet]]],
) -> None:
    _, sets = coded
    with Decoder() as decoder:
        whole = [decoded for packets in sets for packet in packets for decoded in decoder.push(packet)]
        whole += decoder.flush()
    with warnings.catch_warnings(record=True) as caught, Decoder() as decoder:
        warnings.simplefilter("always")
        found = [
            decoded
            for packets in sets[:3] + sets[4:]
            for packet in packets
            for decoded in decoder.push(packet)
        ]
        found += decoder.flush()
    assert any("builds on one that is missing" in str(warning.message) for warning in caught)
    assert [decoded.index for decoded in found] == [0, 1, 2, *range(GOP, COUNT)]
    for decoded in found:
        for camera, picture in decoded.pictures.items():
            np.testing.assert_array_equal(picture, whole[decoded.index].pictures[camera])


def test_hevc_with_pictures_out_of_order_builds_on_what_is_there() -> None:
    """References to the future, and sets of them that are sent as differences."""
    settings = VideoSettings(
        TrackKind.TEXTURE, *SIZE, 20.0, 60, RateControl(qp=25), "medium", low_delay=False
    )
    encoder = find_codec("hevc").encoder(settings)
    units = []
    for index in range(60):
        picture = frame_set(ARRAY, index).pictures[0, 0]
        units += encoder.push(to_planes(picture), keyframe=index == 0)
    units += encoder.flush()
    references = find_codec("hevc").units()
    assert [references.push(unit.data).missing for unit in units] == [None] * 60
    references = find_codec("hevc").units()
    found = [references.push(unit.data).missing for unit in units[:1] + units[2:]]
    assert found[1] is not None
    assert "builds on" in found[1]


@pytest.mark.parametrize("codec", ["hevc", "av1", "vp9"])
def test_a_stream_that_begins_in_the_middle_and_one_that_breaks_off(codec: str) -> None:
    sets = encode(replace(ARRAY, fps=10.0), 2, gop=2, codec=codec)
    track = sets[1][0].track
    key, later = (next(p.data for p in packets if p.track == track) for packets in sets)
    with pytest.raises(MissingReference):
        ReferenceWatch(find_codec(codec), SIZE).push(later, "unit")
    references = find_codec(codec).units()
    cut = key[: key.index(b"\x00\x00\x01\x42") + 8] if codec == "hevc" else key[:8]
    with pytest.raises(NalError, match="ends too early"):
        references.push(cut)
    with pytest.raises(StreamError, match="a damaged picture"):
        ReferenceWatch(find_codec(codec), SIZE).push(cut, "unit")


def test_a_keyframe_and_a_header_belong_together(coded: tuple[str, list[list[Packet]]]) -> None:
    codec, sets = coded
    units = [packets[-1].data for packets in sets]
    assert "keyframe" in _findings(codec, [units[0], units[GOP]], [True, False])[1], "no header"
    assert _findings(codec, [units[0], units[1]], [True, True])[1] & {"keyframe", "parameter-sets"}


def test_left_out_frame_sets_are_no_missing_ones_in_any_codec(coded: tuple[str, list[list[Packet]]]) -> None:
    """VP9's frames have no numbers: there the frame set behind a gap is a keyframe."""
    codec, _ = coded
    with Encoder(ARRAY, config(gop=GOP, codec=codec)) as encoder:
        sets = [encoder.push(frame_set(ARRAY, index)) for index in (0, 1, 4, 5)]
    keys = [packets[0].track.kind is TrackKind.HEADER for packets in sets]
    assert keys == [True, False, not find_codec(codec).numbered, False]
    with warnings.catch_warnings(), Decoder() as decoder:
        warnings.simplefilter("error")
        found = [decoded for packets in sets for packet in packets for decoded in decoder.push(packet)]
    assert [decoded.index for decoded in found] == [0, 1, 4, 5]
