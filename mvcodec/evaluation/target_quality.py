"""The QP that reaches a quality: found by coding a few frame sets and measuring what comes out of them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from mvcodec.capture import ArraySource
from mvcodec.encoding.config import EncoderConfig, find_matcher
from mvcodec.errors import SettingError
from mvcodec.evaluation.chain import measure_chain
from mvcodec.evaluation.remembered import MapSpool, Remembered
from mvcodec.evaluation.target_setting import PROBED_SETS
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.video.codecs import find_codec

_START_QP = 32
_DB_PER_QP = 0.4
"""On libx264's scale; a first guess, which measured points replace."""


@dataclass(frozen=True, slots=True)
class FoundQp:
    """What `qp_for_quality` found.

    Attributes:
        qp: the largest that reaches the target, on the codec's scale.
        psnr_y: what it reaches, dB: mean luma PSNR over all views of the grid.
        codings: how many QPs were tried.
    """

    qp: int
    psnr_y: float
    codings: int


def qp_for_quality(
    source: ArraySource,
    chosen: range,
    config: EncoderConfig,
    target_db: float,
    synthesizer: Synthesizer,
    on_coding: Callable[[], object] = lambda: None,
) -> FoundQp:
    """The largest QP whose mean luma PSNR over all views of the grid is a target or more.

    Args:
        chosen: frame numbers of the input, consecutive.
        config: its rate is replaced; an enhancement layer whose QP is ``auto`` follows it.
        on_coding: called after each QP that was tried.

    Raises:
        SettingError: no QP reaches it.
        InputError: the input lacks a view's originals.
    """
    codec = find_codec(config.codec)
    middle = chosen[max((len(chosen) - PROBED_SETS) // 2, 0)]
    probe = range(middle, min(middle + PROBED_SETS, chosen[-1] + 1))
    found: dict[int, float] = {}
    low, high = 1, codec.max_qp
    qp = round(codec.qp_line[0] * _START_QP + codec.qp_line[1])
    with tempfile.TemporaryDirectory() as folder, MapSpool(Path(folder)) as spool:
        while low <= high:
            matcher = Remembered(find_matcher(config.chosen_matcher), spool)
            file = Path(folder) / "coded.mcap"
            tried = replace(config, qp=qp)
            point = measure_chain(source, probe, tried, matcher, synthesizer, file, lambda: None)
            assert point.quality.psnr_y.all is not None
            found[qp] = point.quality.psnr_y.all
            on_coding()
            low, high = (qp + 1, high) if found[qp] >= target_db else (low, qp - 1)
            qp = min(max(guessed_qp(found, target_db, codec.qp_line[0]), low), high)
    reached = [qp for qp, decibel in found.items() if decibel >= target_db]
    if not reached:
        best = max(found.values())
        raise SettingError("target_psnr", f"{target_db:g} dB", f"at most {best:.2f} dB, which QP 1 reaches")
    return FoundQp(max(reached), found[max(reached)], len(found))


def guessed_qp(found: dict[int, float], target_db: float, scale: float) -> int:
    """Where the line through the two points nearest to the target has the target's quality.

    Args:
        found: dB by QP.
        scale: QPs of the codec for one of libx264's.
    """
    nearest = sorted(found, key=lambda qp: abs(found[qp] - target_db))[:2]
    slope = -_DB_PER_QP / scale
    if len(nearest) == 2 and found[nearest[0]] != found[nearest[1]]:
        slope = min((found[nearest[0]] - found[nearest[1]]) / (nearest[0] - nearest[1]), -0.05)
    return round(nearest[0] + (target_db - found[nearest[0]]) / slope)
