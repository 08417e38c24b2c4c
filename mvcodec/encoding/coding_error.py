"""How far coded pictures are from what the cameras saw, as the quantiser lets one expect."""

from __future__ import annotations

import math

from mvcodec.encoding.config import RATIO_CODECS, EncoderConfig
from mvcodec.encoding.keyframe_ratio import MOVING_RATIO
from mvcodec.video.codecs import find_codec

FACTOR, POWER = 0.12, 1.6
"""Mean squared error of luma, grey levels squared, is about FACTOR * step^POWER at H.264's quantiser step
(docs/measurements.md: from half to twice that of most pictures). Less costs little, more a decibel."""


def coding_error(config: EncoderConfig) -> list[float] | None:
    """[keyframes, others]: mean squared error of luma of real cameras' pictures, grey levels squared.

    None where a bit rate governs, and where cameras are predicted from each other: their errors are no longer
    each their own.
    """
    if config.quality is None or config.prediction != "none":
        return None
    slope, offset = find_codec(config.codec).qp_line
    qp = (config.quality - offset) / slope
    ratio = (config.keyframe_ratio or MOVING_RATIO) if config.codec in RATIO_CODECS else 1.0
    return [_expected(qp - 6 * math.log2(ratio)), _expected(qp)]


def _expected(qp: float) -> float:
    step: float = 2.0 ** ((qp - 4) / 6)
    return float(round(FACTOR * step**POWER, 2))
