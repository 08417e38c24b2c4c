"""One word for how much time coding may take: what it sets, what overrides it, and what is matched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from command_line import fails, succeeds
from stereo_scene import Planes, linear_or_grid

from mvcodec.array import CameraArray, Position
from mvcodec.container import read_info
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.speed_choice import SPEEDS
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FrameSet, Picture
from mvcodec.stereo.matchers import MATCHERS

ROOM = Path(__file__).parents[1] / "samples" / "room_2x2"


@pytest.mark.parametrize("name", SPEEDS)
def test_a_speed_sets_matcher_and_preset(name: str) -> None:
    config = EncoderConfig(speed=name)
    assert (config.chosen_matcher, config.chosen_preset) == (SPEEDS[name].matcher, SPEEDS[name].preset)
    assert config.chosen_matcher in MATCHERS


def test_files_are_made_as_well_as_can_be() -> None:
    config = EncoderConfig()
    assert (config.speed, config.chosen_matcher, config.chosen_preset) == ("best", "joint", "slow")


def test_matcher_and_preset_override_the_speed() -> None:
    config = EncoderConfig(speed="realtime", matcher="sgbm", preset="fast")
    assert (config.chosen_matcher, config.chosen_preset) == ("sgbm", "fast")
    with pytest.raises(SettingError, match="speed: found fastest, expected one of realtime, balanced, best"):
        EncoderConfig(speed="fastest")


class Asked:
    """A SelectiveMatcher that remembers which cameras' maps were wanted."""

    def __init__(self) -> None:
        self.cameras: list[Position] = []
        self.fresh: list[bool] = []

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        return self.match_cameras(array, pictures, range_px, array.real, fresh=True)

    def match_cameras(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
    ) -> dict[Position, DisparityMap]:
        del pictures
        self.cameras = list(cameras)
        self.fresh.append(fresh)
        shape = array.height, array.width
        flat = DisparityMap(np.full(shape, range_px[0], np.float32), np.ones(shape, np.bool_))
        return dict.fromkeys(cameras, flat)


@pytest.mark.parametrize(
    ("maps", "depth", "expected"),
    [
        ("alternate", False, [(0, 0), (1, 1)]),
        ("all", False, [(0, 0), (0, 1), (1, 0), (1, 1)]),
        ("alternate", True, [(0, 0), (0, 1), (1, 0), (1, 1)]),
    ],
)
def test_only_cameras_that_send_something_are_matched(
    maps: str, depth: bool, expected: list[Position]
) -> None:
    array, matcher = linear_or_grid(2, 2, 64, 64), Asked()
    frames = FrameSet(0, 0, Planes(array, 2, 8).pictures())
    config = EncoderConfig(
        matcher=matcher,
        disparity_range_px=(0.0, 10.0),
        disparity_cameras=maps,
        depth=depth,
        preset="veryfast",
    )
    with Encoder(array, config) as encoder:
        encoder.push(frames)
    assert matcher.cameras == expected


class Halving(Asked):
    """A HalvingMatcher: its maps of half size and of full size differ."""

    def match_halved(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
    ) -> dict[Position, DisparityMap] | None:
        del pictures, fresh
        shape = -(-array.height // 2), -(-array.width // 2)
        flat = DisparityMap(np.full(shape, range_px[1], np.float32), np.ones(shape, np.bool_))
        return dict.fromkeys(cameras, flat)


@pytest.mark.parametrize(("scale", "depth", "expected_px"), [(2, False, 10), (1, False, 0), (2, True, 0)])
def test_maps_that_are_coded_at_half_size_are_asked_for_so(
    scale: int, depth: bool, expected_px: float
) -> None:
    array, matcher = linear_or_grid(1, 2, 65, 51), Halving()
    config = EncoderConfig(
        matcher=matcher, disparity_range_px=(0.0, 10.0), disparity_scale=scale, depth=depth, preset="veryfast"
    )
    with Encoder(array, config) as encoder, Decoder() as decoder:
        packets = encoder.push(FrameSet(0, 0, Planes(array, 2, 8).pictures()))
        (decoded,) = [found for packet in packets for found in decoder.push(packet)]
    for camera in array.real:
        np.testing.assert_allclose(decoded.disparities[camera].values_px, expected_px, atol=0.1)


def test_at_keyframes_a_matcher_forgets() -> None:
    array, matcher = linear_or_grid(1, 2, 64, 64), Asked()
    pictures = Planes(array, 2, 8).pictures()
    config = EncoderConfig(matcher=matcher, disparity_range_px=(0.0, 10.0), gop=2, preset="veryfast")
    with Encoder(array, config) as encoder:
        for number in range(4):
            encoder.push(FrameSet(number, number * 40_000_000, pictures))
    assert matcher.fresh == [True, False, True, False]


def test_the_file_says_how_it_was_made(tmp_path: Path) -> None:
    out = tmp_path / "x.mcap"
    succeeds("encode", ROOM, out, "--frames", ":1", "--speed", "realtime")
    settings = read_info(out).header.settings
    assert (settings["speed"], settings["matcher"], settings["preset"]) == (
        "realtime",
        "realtime",
        "veryfast",
    )


def test_an_unknown_speed_is_a_usage_error(tmp_path: Path) -> None:
    assert "--speed" in fails(2, "encode", ROOM, tmp_path / "x.mcap", "--speed", "warp")
