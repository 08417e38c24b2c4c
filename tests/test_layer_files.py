"""Files with an enhancement layer: what `validate` finds, what `recover` keeps, who joins late, `info`."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import succeeds
from test_enhancement import ARRAY, ENHANCED, LEAF, VIRTUAL, coded, decoded, frames, pushed, written

from mvcodec.conformance.recovery import recover
from mvcodec.conformance.validation import validate
from mvcodec.container import McapReader, McapWriter, read_info
from mvcodec.container.joining import join
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.enhancement import LAYER_TRACK
from mvcodec.errors import MvCodecWarning
from mvcodec.stream import Packet, Track, TrackKind

__all__ = ["coded"]

Sets = list[list[Packet]]


def changed(sets: Sets, number: int, change: Callable[[Packet], list[Packet]]) -> Sets:
    """One frame set with each packet put through `change`."""
    new = [list(packets) for packets in sets]
    new[number] = [out for packet in new[number] for out in change(packet)]
    return new


def without(track: Track) -> Callable[[Packet], list[Packet]]:
    return lambda packet: [] if packet.track == track else [packet]


def altered(track: Track, data: Callable[[bytes], bytes]) -> Callable[[Packet], list[Packet]]:
    return lambda packet: [replace(packet, data=data(packet.data)) if packet.track == track else packet]


def other_settings(data: bytes) -> bytes:
    return json.dumps({**json.loads(data), "settings": {"quantizer": 9}}).encode()


@pytest.mark.parametrize(
    ("number", "change", "code", "message"),
    [
        (1, without(ENHANCED), "incomplete", "no unit in this frame set"),
        (2, without(LAYER_TRACK), "layer", "missing, expected right behind the header"),
        (2, altered(LAYER_TRACK, other_settings), "layer", "it differs from the first one"),
        (1, altered(ENHANCED, lambda data: data[:4]), "frame", "it ends too early"),
    ],
)
def test_each_rule_of_the_layer_is_checked(
    coded: Sets,
    tmp_path: Path,
    number: int,
    change: Callable[[Packet], list[Packet]],
    code: str,
    message: str,
) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(written(changed(coded, number, change)))
    found = validate(path)
    assert any(each.code == code and message in each.message for each in found), found
    assert all(each.topic and ("enhance" in each.topic) for each in found), found


def test_views_may_be_left_out_as_a_whole_but_not_what_others_build_on(coded: Sets, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    fewer = [[packet for packet in packets if packet.track != LEAF] for packets in coded]
    path.write_bytes(written(fewer))
    assert validate(path) == []
    result = recover(path, tmp_path / "new.mcap", lambda _: None)
    assert (result.frames, result.incomplete) == (4, 0)
    found = json.loads(coded[0][1].data)
    found["views"] = [{"view": [1, 1], "from": [[0, 0]]}, {"view": [1, 2], "from": [[1, 1]]}]
    data, left = json.dumps(found).encode(), {(0, 1), (1, 0), (1, 1)}
    for number, packets in enumerate(fewer):
        kept = [p for p in packets if p.track.kind is not TrackKind.ENHANCED or p.track.camera not in left]
        fewer[number] = [replace(p, data=data) if p.track == LAYER_TRACK else p for p in kept]
    path.write_bytes(written(fewer))
    (warning,) = validate(path)
    assert (warning.severity, warning.topic) == ("warning", "/view/r01_c02/enhanced")
    assert "builds on /view/r01_c01/enhanced, which the file does not have" in warning.message


def test_recover_leaves_out_what_builds_on_a_lost_unit(coded: Sets, tmp_path: Path) -> None:
    new, told = tmp_path / "new.mcap", []
    damaged = changed(coded, 0, altered(LEAF, lambda data: data[:4]))
    result = recover(io.BytesIO(written(damaged)), new, lambda error: told.append(str(error)))
    assert (result.frames, result.incomplete) == (4, 2)
    (text,) = told
    assert "/view/r02_c01/enhanced" in text
    with McapReader.open(new, layer=True) as reader:
        kept = [packet.index for _, packet in reader.packets() if packet.track == LEAF]
    assert kept == [2, 3]
    assert {each.code for each in validate(new)} == {"incomplete"}


def test_recover_leaves_out_views_whose_cameras_are_lost(coded: Sets, tmp_path: Path) -> None:
    new = tmp_path / "new.mcap"
    lost = Track(TrackKind.TEXTURE, (0, 0))
    result = recover(io.BytesIO(written(changed(coded, 2, without(lost)))), new, lambda _: None)
    assert (result.frames, result.incomplete) == (4, 2)
    with McapReader.open(new, layer=True) as reader:
        kept = [packet.index for _, packet in reader.packets() if packet.track == ENHANCED]
    assert kept == [0, 1]


class Pipe(io.BytesIO):
    """What is read while it is written."""

    def seekable(self) -> bool:
        return False


def test_who_joins_a_stream_late_gets_the_layer_at_its_next_keyframe(coded: Sets) -> None:
    pipe = Pipe()
    with McapWriter(pipe, 0) as writer:
        for packets in coded[:2]:
            writer.push(packets)
        joined = len(pipe.getvalue())
        for packets in coded[2:]:
            writer.push(packets)
    whole = decoded(written(coded))
    rest = b"\x89MCAP0\r\n" + pipe.getvalue()[joined:]
    with (
        pytest.warns(MvCodecWarning, match="checksum"),
        Decoder.open(  # it covers what was missed, too
            io.BytesIO(rest), on_error="skip", enhanced=None
        ) as decoder,
    ):
        late = list(decoder)
    assert [found.index for found in late] == [2, 3]
    for found in late:
        np.testing.assert_array_equal(found.enhanced[1, 1].pixels, whole[found.index].enhanced[1, 1].pixels)


def test_frame_sets_left_out_make_a_keyframe_so_that_the_layer_shows_no_gap() -> None:
    config = EncoderConfig(qp=36, preset="veryfast", enhance=30, matcher="sgbm", disparity_range_px=(0, 12))
    taken = frames(4)
    with Encoder(ARRAY, config) as encoder:
        sets = [encoder.push(taken[number]) for number in (0, 1, 3)]
    assert [packets[0].keyframe for packets in sets] == [True, False, True]
    assert all(sorted(found.enhanced) == VIRTUAL for found in pushed(sets))


def test_info_and_join_know_the_layer(coded: Sets, tmp_path: Path) -> None:
    one, other, both = (tmp_path / f"{name}.mcap" for name in ("one", "other", "both"))
    one.write_bytes(written(coded[:2]))
    other.write_bytes(written(coded[2:]))
    join([one, other], both)
    info = read_info(both)
    assert info.layer is not None
    assert sorted(each.view for each in info.layer.views) == VIRTUAL
    units = (p.data for packets in coded for p in packets if p.track.kind is TrackKind.ENHANCED)
    assert info.bits.enhancement == 8 * sum(map(len, units))
    said = succeeds("info", both)
    assert "5 of 5 virtual views coded from their synthesis" in said
    assert json.loads(succeeds("info", both, "--json"))["enhanced"][0] == [1, 1]
    assert len(decoded(both.read_bytes())[3].enhanced) == 5
