"""The enhancement layer: the base stays as it is, views get nearer to their originals, damage is told."""

from __future__ import annotations

import io
import json
import warnings
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coding import RANGE_PX, RampMatcher, luma_psnr, make_array
from command_line import fails, succeeds
from plane_scene import Plane, PlaneScene
from small_arrays import write_array

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.conformance.recovery import recover
from mvcodec.conformance.validation import validate
from mvcodec.container import McapReader, McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.enhancer import FINER_FOR_OTHERS, enhanced_views, layer_order, view_quantizers
from mvcodec.enhancement import LAYER_TRACK, EnhancedView, EnhancementHeader
from mvcodec.errors import InputError, MvCodecWarning, SettingError, StreamError
from mvcodec.frames import DecodedSet, FrameSet
from mvcodec.stream import Packet, StreamHeader, Track, TrackKind
from mvcodec.synthesis.synthesizers import make_synthesizer

ARRAY = CameraArray(3, 3, 96, 64, 10.0, (0, 2), (0, 2), make_array(96, 64).calibration)
VIRTUAL = [view for view in ARRAY.positions if view not in ARRAY.real]
ENHANCED = Track(TrackKind.ENHANCED, (1, 1))
"""All other views build on this one."""

LEAF = Track(TrackKind.ENHANCED, (2, 1))
"""Nothing builds on this one."""


def frames(count: int, step: int = 4) -> list[FrameSet]:
    """A scene in which a near thing moves, by `step` px from frame to frame."""
    found = []
    for index in range(count):
        left = 30 + step * index
        scene = PlaneScene(ARRAY, 2, (Plane(8, (20, left, 44, left + 24)),))
        pictures = {view: scene.render(Viewpoint(*view))[0] // 2 + 40 for view in ARRAY.positions}
        found.append(FrameSet(index, index * 100_000_000, pictures))
    return found


def encode(count: int, step: int = 4, **changes: Any) -> list[list[Packet]]:
    settings = {
        "qp": 36,
        "preset": "veryfast",
        "matcher": RampMatcher(),
        "disparity_range_px": RANGE_PX,
        "gop": 2,
        "enhance": 26,
    }
    with Encoder(ARRAY, EncoderConfig(**{**settings, **changes})) as encoder:
        return [encoder.push(taken) for taken in frames(count, step)]


def written(sets: list[list[Packet]]) -> bytes:
    file = io.BytesIO()
    with McapWriter(file) as writer:
        for packets in sets:
            writer.push(packets)
    return file.getvalue()


def decoded(
    file: bytes, wanted: Collection[Position] | None = None, part: slice | None = None
) -> list[DecodedSet]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with Decoder.open(io.BytesIO(file), part, enhanced=wanted) as decoder:
            return list(decoder)


def pushed(sets: list[list[Packet]]) -> list[DecodedSet]:
    with Decoder(enhanced=None) as decoder:
        found = [out for packets in sets for packet in packets for out in decoder.push(packet)]
        return found + decoder.flush()


@pytest.fixture(scope="module")
def coded() -> list[list[Packet]]:
    return encode(4)


def test_the_base_is_byte_for_byte_what_it_is_without(coded: list[list[Packet]]) -> None:
    layer = (TrackKind.LAYER, TrackKind.ENHANCED)
    for with_layer, without in zip(coded, encode(4, enhance=None), strict=True):
        assert [packet for packet in with_layer if packet.track.kind not in layer] == without


def test_enhanced_views_are_nearer_to_their_originals(coded: list[list[Packet]]) -> None:
    file, synthesizer = written(coded), make_synthesizer("layered")
    base, better = decoded(file, ()), decoded(file)
    for number, taken in enumerate(frames(4)):
        assert base[number].enhanced == {}
        assert sorted(better[number].enhanced) == VIRTUAL
        for view in VIRTUAL:
            original, place = taken.pictures[view], Viewpoint(*view)
            shown = synthesizer.render(better[number], place)
            np.testing.assert_array_equal(shown.pixels, better[number].enhanced[view].pixels)
            assert shown.disparity_px.shape == (64, 96)
            gain = luma_psnr(shown.pixels, original) - luma_psnr(
                synthesizer.render(base[number], place).pixels, original
            )
            assert gain > 1, (view, gain)


def test_a_client_decodes_only_what_it_wants_from_any_keyframe(coded: list[list[Packet]]) -> None:
    file = written(coded)
    whole, late = decoded(file), decoded(file, [(1, 1)], slice(3, 4))
    assert list(late[0].enhanced) == [(1, 1)]
    np.testing.assert_array_equal(late[0].enhanced[1, 1].pixels, whole[3].enhanced[1, 1].pixels)


def test_views_that_do_not_change_cost_next_to_nothing() -> None:
    """A unit says that nothing changed: checksum, a frame header, blocks left as they were."""

    def units(step: int) -> list[int]:
        sets = encode(4, step, gop=4)
        return [len(packet.data) for packet in sets[3] if packet.track.kind is TrackKind.ENHANCED]

    still, moving = units(0), units(4)
    assert len(still) == len(moving) == len(VIRTUAL)
    assert max(still) < 40
    assert min(moving) > 80


def test_some_views_can_be_asked_for() -> None:
    assert enhanced_views(ARRAY, None) == tuple(VIRTUAL)
    assert enhanced_views(ARRAY, [(1, 2), (0, 1)]) == ((0, 1), (1, 2))
    packets = encode(1, enhance_views=((1, 1),))[0]
    assert [packet.track for packet in packets if packet.track.kind is TrackKind.ENHANCED] == [ENHANCED]
    with pytest.raises(SettingError, match="enhance_views: found 0,0, expected views of the 3 x 3 grid"):
        enhanced_views(ARRAY, [(0, 0)])
    with pytest.raises(SettingError, match="enhance_views: found given, expected enhance beside it"):
        EncoderConfig(enhance_views=((1, 1),))


@pytest.mark.parametrize("second", ["none", "nearest"])
def test_the_layer_stands_on_predicted_cameras_too(second: str) -> None:
    found = decoded(written(encode(2, prediction="synthesis", second_reference=second)))
    assert all(sorted(each.enhanced) == VIRTUAL for each in found)


def test_a_layer_may_have_a_second_reference_that_its_base_has_not(coded: list[list[Packet]]) -> None:
    sets = encode(4, second_reference="nearest")
    assert sets[0][0] == coded[0][0]
    header = StreamHeader.from_json(sets[0][0].data)
    layer = EnhancementHeader.from_json(sets[0][1].data, header, "x")
    assert (header.second_reference, layer.second_reference) == ("none", "nearest")
    assert all(sorted(each.enhanced) == VIRTUAL for each in decoded(written(sets)))
    other = json.loads(sets[0][1].data) | {"codec": "vp9+else"}
    with pytest.raises(StreamError, match=r"vp9\+else'\), expected .*vp9 or vp9\+nearest"):
        EnhancementHeader.from_json(json.dumps(other).encode(), header, "x")


def test_a_missing_or_damaged_unit_is_told_once_and_healed_by_the_next_keyframe(
    coded: list[list[Packet]],
) -> None:
    sets = [list(packets) for packets in coded]
    sets[0] = [packet for packet in sets[0] if packet.track != LEAF]
    with pytest.warns(MvCodecWarning, match="view r02_c01 is shown from the base meanwhile") as told:
        found = pushed(sets)
    assert len(told) == 1
    assert [(2, 1) in each.enhanced for each in found] == [False, False, True, True]
    assert all((0, 1) in each.enhanced for each in found)
    sets = [list(packets) for packets in coded]
    sets[1] = [replace(p, data=p.data[:9]) if p.track == LEAF else p for p in sets[1]]
    with pytest.warns(MvCodecWarning, match="view r02_c01 is shown from the base"):
        found = pushed(sets)
    assert [(2, 1) in each.enhanced for each in found] == [True, False, True, True]


def test_without_a_view_those_that_build_on_it_are_shown_from_the_base_too(coded: list[list[Packet]]) -> None:
    sets = [list(packets) for packets in coded]
    sets[1] = [packet for packet in sets[1] if packet.track != ENHANCED]
    with pytest.warns(MvCodecWarning, match="is shown from the base meanwhile") as told:
        found = pushed(sets)
    assert len(told) == len(VIRTUAL)
    assert [len(each.enhanced) for each in found] == [5, 0, 5, 5]


def test_each_view_is_predicted_from_what_is_nearest_and_decoded_before() -> None:
    order = layer_order(ARRAY, VIRTUAL)
    assert order[0] == EnhancedView((1, 1), ARRAY.real)
    assert {each.view for each in order[1:] if (1, 1) in each.references} == {(0, 1), (1, 0), (1, 2), (2, 1)}
    assert next(each.references for each in order if each.view == (0, 1)) == ((0, 0), (0, 2), (1, 1))
    line = CameraArray(1, 5, 96, 64, 10.0, (0,), (0, 4), make_array(96, 64).calibration)
    views = [each.view for each in layer_order(line, [(0, 1), (0, 2), (0, 3)])]
    assert views == [(0, 2), (0, 1), (0, 3)]


@pytest.mark.parametrize("most", [0, 1, 2, None])
def test_what_a_view_builds_on_can_be_kept_few(most: int | None) -> None:
    array = CameraArray(5, 5, 96, 64, 10.0, (0, 4), (0, 4), make_array(96, 64).calibration)
    virtual = [view for view in array.positions if view not in array.real]
    header = EnhancementHeader(layer_order(array, virtual, most))
    others = [len(header.needed([view])) - 1 for view in virtual]
    assert len(header.views) == len(virtual)
    assert max(others) == (4 if most is None else most)


def test_views_that_others_build_on_are_coded_finer() -> None:
    header = EnhancementHeader(layer_order(ARRAY, VIRTUAL))
    found = view_quantizers(header, 30)
    assert found[1, 1] == min(found.values())  # all others build on it
    assert found[2, 1] == max(found.values())  # none does
    assert found[2, 1] - found[1, 1] == FINER_FOR_OTHERS
    assert abs(sum(found.values()) / len(found) - 30) <= 0.5
    assert set(view_quantizers(header, 1).values()) >= {1}
    assert max(view_quantizers(header, 63).values()) == 63


def test_a_layer_of_one_view_or_of_views_apart_has_one_quantizer() -> None:
    assert view_quantizers(EnhancementHeader(layer_order(ARRAY, [(1, 1)])), 30) == {(1, 1): 30}
    apart = EnhancementHeader(layer_order(ARRAY, VIRTUAL, most=0))
    assert view_quantizers(apart, 30) == dict.fromkeys(VIRTUAL, 30)


def test_another_base_is_told_by_the_checksum(coded: list[list[Packet]]) -> None:
    other = encode(1, enhance=None, qp=20)
    mixed = [packet for packet in coded[0] if packet.track.kind in (TrackKind.LAYER, TrackKind.ENHANCED)]
    with pytest.warns(MvCodecWarning, match="a prediction that is not the encoder's"):
        (found,) = pushed([[other[0][0], mixed[0], *other[0][1:], *mixed[1:]]])
    assert found.enhanced == {}


def test_without_a_camera_the_views_that_need_it_come_from_the_base(coded: list[list[Packet]]) -> None:
    lost = Track(TrackKind.TEXTURE, (0, 0))
    sets = [[packet for packet in coded[0] if packet.track != lost], *coded[1:]]
    with pytest.warns(MvCodecWarning):
        found = pushed(sets)
    assert found[0].absent == ((0, 0),)
    assert (1, 1) not in found[0].enhanced
    assert (1, 1) in found[2].enhanced


def test_files_with_a_layer_are_clean_for_who_does_not_know_it(
    coded: list[list[Packet]], tmp_path: Path
) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(written(coded))
    assert validate(path) == []
    with McapReader.open(path) as reader:
        kinds = {packet.track.kind for _, packet in reader.packets()}
    assert kinds == {TrackKind.HEADER, TrackKind.TEXTURE, TrackKind.DISPARITY}
    assert json.loads(coded[0][0].data)["version"] == 1


def test_recover_keeps_the_layer(coded: list[list[Packet]], tmp_path: Path) -> None:
    file, new = written(coded), tmp_path / "new.mcap"
    result = recover(io.BytesIO(file), new, lambda _: None)
    assert (result.frames, result.incomplete) == (4, 0)
    for one, other in zip(decoded(file), decoded(new.read_bytes()), strict=True):
        np.testing.assert_array_equal(one.enhanced[1, 1].pixels, other.enhanced[1, 1].pixels)
    with pytest.warns(MvCodecWarning, match="cut off"):
        result = recover(io.BytesIO(file[: len(file) * 3 // 4]), new, lambda _: None)
    assert all((1, 1) in each.enhanced for each in decoded(new.read_bytes()))


def test_layer_headers_that_cannot_be_are_refused(coded: list[list[Packet]]) -> None:
    header = StreamHeader.from_json(coded[0][0].data)
    assert coded[0][1].track == LAYER_TRACK
    good = json.loads(coded[0][1].data)
    found = EnhancementHeader.from_json(coded[0][1].data, header, "x")
    assert found.views[0] == EnhancedView((1, 1), ARRAY.real)
    assert found.to_json() == coded[0][1].data
    for change, message in (
        ({"version": 2}, "an enhancement layer of"),
        ({"predictor": "warp-9"}, "an enhancement layer of"),
        ({"views": [{"view": [0, 0], "from": [[2, 2]]}]}, "virtual views, each once"),
        ({"views": [{"view": [1, 1], "from": [[1, 2]]}]}, "pictures that are decoded before"),
        ({"views": [{"view": [1, 1], "from": []}]}, "pictures that are decoded before"),
        ({"views": [{"view": "a"}]}, "a damaged enhancement header"),
        ({"views": 3}, "a damaged enhancement header"),
    ):
        with pytest.raises(StreamError) as caught:
            EnhancementHeader.from_json(json.dumps({**good, **change}).encode(), header, "x")
        assert message in str(caught.value)


def test_the_encoder_asks_for_the_originals() -> None:
    config = EncoderConfig(enhance=30, matcher=RampMatcher(), disparity_range_px=RANGE_PX)
    with Encoder(ARRAY, config) as encoder:
        assert encoder.views == ARRAY.positions
        taken = frames(1)[0]
        real = {camera: taken.pictures[camera] for camera in ARRAY.real}
        with pytest.raises(InputError, match="view r00_c01: found no picture"):
            encoder.push(replace(taken, pictures=real))


def test_the_commands_code_and_decode_a_layer(tmp_path: Path) -> None:
    coded, plain = tmp_path / "coded.mcap", tmp_path / "plain.mcap"
    array = write_array(tmp_path / "array", 3, 3, 1)
    options = (
        "--disparity-range",
        "0,12",
        "--preset",
        "veryfast",
        "--matcher",
        "sgbm",
        "--quiet",
        "--qp",
        "38",
    )
    succeeds("encode", array, coded, "--enhance", "26", *options)
    succeeds("encode", array, plain, *options)
    for name, file, more in (("a", coded, ()), ("b", coded, ("--no-enhancement",)), ("c", plain, ())):
        succeeds("decode", file, tmp_path / name, "--quiet", *more)
    names = [f"{number:06d}.png" for number in (0,)]
    for view in ("r01_c01", "r00_c00"):
        a, b, c = ([(tmp_path / x / view / n).read_bytes() for n in names] for x in "abc")
        assert b == c
        assert (a == b) == (view == "r00_c00")
    line = fails(
        2, "encode", array, tmp_path / "no.mcap", "--enhance", "26", "--enhance-views", "0,0", *options
    )
    assert "--enhance-views: found 0,0" in line
