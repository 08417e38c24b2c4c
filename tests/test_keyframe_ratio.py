"""How much finer keyframes are coded than what follows them: by what stands still."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from array_files import rewrite, save
from command_line import succeeds
from numpy.typing import NDArray

from mvcodec import EncoderConfig, open_input
from mvcodec.cli.coding_options import with_keyframe_ratio
from mvcodec.container import read_info
from mvcodec.encoding.keyframe_ratio import MOVING_RATIO, STILL_RATIO, keyframe_ratio
from mvcodec.errors import SettingError

SIZE = 96, 64


def textured(shift: int = 0) -> NDArray[np.uint8]:
    """A picture of noise in patches of 4 px, moved by some px."""
    patches = np.random.default_rng(1).integers(0, 256, (SIZE[1] // 4, SIZE[0] // 4, 3))
    picture: NDArray[np.uint8] = patches.repeat(4, 0).repeat(4, 1).astype(np.uint8)
    return np.roll(picture, shift, axis=1)


def write(folder: Path, moves_px: int) -> Path:
    """A 1 x 2 array of four frames that moves so much from each to the next."""
    views = [[[f"{col}_{frame}.png" for frame in range(4)] for col in range(2)]]
    for names in views[0]:
        for frame, name in enumerate(names):
            save(folder / name, textured(moves_px * frame))
    return rewrite(folder, {"rows": 1, "cols": 2, "fps": 10.0, "views": views})


def test_pictures_that_stand_still_have_finer_keyframes() -> None:
    """One moved object does not change that, a moved camera does, and plain walls say nothing."""
    still, moved = textured(), textured(3)
    partly = still.copy()
    partly[:16, :32] = moved[:16, :32]
    plain = np.full_like(still, 128)
    assert keyframe_ratio([(still, still)]) == STILL_RATIO
    assert keyframe_ratio([(still, partly)]) == STILL_RATIO
    assert keyframe_ratio([(still, moved)]) == MOVING_RATIO
    assert keyframe_ratio([(still, moved), (still, moved), (still, still)]) == MOVING_RATIO
    assert keyframe_ratio([(plain, plain)]) == MOVING_RATIO
    assert keyframe_ratio([]) == MOVING_RATIO


def test_ratio_is_chosen_where_nothing_else_says_it(tmp_path: Path) -> None:
    """A ratio that is given stays; other codecs, a bit rate and a single frame leave it to the codec."""
    source = open_input([write(tmp_path, 0)], real="all")
    for config, frames, found in (
        (EncoderConfig(), 4, STILL_RATIO),
        (EncoderConfig(keyframe_ratio=1.1), 4, 1.1),
        (EncoderConfig(codec="vp9"), 4, None),
        (EncoderConfig(bitrate_kbps=500), 4, None),
        (EncoderConfig(), 1, None),
    ):
        assert with_keyframe_ratio(source, range(frames), config).keyframe_ratio == found


@pytest.mark.parametrize(("moves_px", "ratio"), [(0, STILL_RATIO), (3, MOVING_RATIO)])
def test_files_and_plans_say_the_ratio(tmp_path: Path, moves_px: int, ratio: float) -> None:
    """Segments of one file are told the ratio of all of it; the header's settings record it."""
    array = write(tmp_path / "array", moves_px)
    options = "--real", "all", "--disparity-range", "0,4", "--matcher", "sad", "--qp", "30"
    plan = json.loads(succeeds("encode", array, tmp_path / "x.mcap", *options, "--dry-run"))
    assert plan["keyframe_ratio"] == ratio
    succeeds("encode", array, tmp_path / "x.mcap", *options, "--quiet")
    assert read_info(tmp_path / "x.mcap").header.settings["keyframe_ratio"] == ratio


def test_codecs_without_the_setting_refuse_it() -> None:
    """Only x264 and x265 can be told."""
    EncoderConfig(codec="hevc", keyframe_ratio=1.8)
    with pytest.raises(SettingError, match="keyframe_ratio"):
        EncoderConfig(codec="vp9", keyframe_ratio=1.8)
