"""What a stream says of the error that coding leaves in pictures, and what decoders make of it."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from coding import RANGE_PX, make_array

from mvcodec.array import Viewpoint
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.coding_error import coding_error
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import DecodedSet, FrameSet
from mvcodec.scenes.scene import RoomScene, SceneSettings
from mvcodec.stream import StreamHeader
from mvcodec.synthesis.layered import Layered, LayeredSettings

FRAMES = 3


def test_coarser_pictures_and_those_behind_a_keyframe_have_larger_errors() -> None:
    found = [coding_error(EncoderConfig(qp=qp, disparity_range_px=RANGE_PX)) for qp in (17, 27, 37)]
    for each in found:
        assert each is not None
        assert 0 < each[0] < each[1]
    assert [each[1] for each in found if each] == sorted(each[1] for each in found if each)


def test_quantisers_of_all_codecs_are_compared_by_their_quality() -> None:
    by_qp = {
        "h264": coding_error(EncoderConfig(codec="h264", qp=32, disparity_range_px=RANGE_PX)),
        "vp9": coding_error(EncoderConfig(codec="vp9", qp=32, disparity_range_px=RANGE_PX)),
    }
    assert by_qp["vp9"] is not None
    assert by_qp["h264"] is not None
    assert by_qp["vp9"][1] > by_qp["h264"][1]
    assert by_qp["vp9"][0] == by_qp["vp9"][1]  # its keyframes have the same quantiser


def test_nothing_is_said_where_it_is_not_known() -> None:
    by_rate = EncoderConfig(bitrate_kbps=500, disparity_range_px=RANGE_PX)
    predicted = EncoderConfig(qp=27, prediction="synthesis", disparity_range_px=RANGE_PX)
    assert coding_error(by_rate) is None
    assert coding_error(predicted) is None


@pytest.mark.parametrize("said", [None, 3, [1], [1, "2"], [1, -2], [1.0, float("nan")], {"0": 1}])
def test_a_header_that_says_something_else_says_nothing(said: object) -> None:
    header = StreamHeader(make_array(), RANGE_PX, settings={"coding_error": said})
    assert header.coding_error is None


@cache
def coded_room(disparity_cameras: str) -> tuple[list[DecodedSet], list[FrameSet]]:
    """The sample room, small, coded at QP 32: what comes out, and what went in."""
    scene = RoomScene(SceneSettings(grid=(3, 3), size=(240, 136), frames=FRAMES))
    array = replace(scene.array, real_rows=(0, 2), real_cols=(0, 2))
    config = EncoderConfig(
        qp=32, disparity_range_px=(0.0, 60.0), disparity_cameras=disparity_cameras, matcher="balanced"
    )
    sets, file = [], io.BytesIO()
    with McapWriter(file) as writer, Encoder(array, config) as encoder:
        for index in range(FRAMES):
            pictures = {place: scene.render(Viewpoint(*place), index)[0] for place in array.positions}
            sets.append(FrameSet(index, index * 66_000_000, pictures))
            writer.push(encoder.push(sets[-1]))
    file.seek(0)
    with Decoder.open(file) as decoder:
        return list(decoder), sets


def test_frame_sets_have_the_error_of_their_kind() -> None:
    decoded, _ = coded_room("all")
    expected = coding_error(EncoderConfig(qp=32, disparity_range_px=RANGE_PX))
    assert expected is not None
    assert [each.coding_error for each in decoded] == [expected[0], expected[1], expected[1]]


@pytest.mark.parametrize("disparity_cameras", ["all", "none"])
def test_real_views_are_better_than_they_were_decoded(disparity_cameras: str) -> None:
    decoded, originals = coded_room(disparity_cameras)
    for each, frames in zip(decoded, originals, strict=True):
        plain, filtered = (
            np.mean(
                [
                    psnr(frames.pictures[camera], synthesizer.render(each, Viewpoint(*camera)).pixels)
                    for camera in each.array.real
                ]
            )
            for synthesizer in (Layered(LayeredSettings(filter=0)), Layered())
        )
        assert filtered > plain + 0.3
