"""Measures what the video encoder's own settings for maps cost and bring on an input.

    python tools/map_settings.py INPUT [--real ...] [--qp N,N..] [--codec h264|hevc] [--set PARAMETERS ..]
                                 [--disparity-cameras all|alternate] [--disparity-range LO,HI|auto]
                                 [--frames A:B] [--json]

Each line is one coding of the input, the first one of each QP with the settings that mvcodec uses: the maps'
kbit for each time instant, luma PSNR over every second view of the first, the middle and the last frame, and
how many bits more that is, pictures and maps together, at the PSNR of the first one. Where PSNR differs, that
goes by the slope of the curve that the first ones make over the QPs of the pictures; so name at least two.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace

from map_codings import Material, Outcome, arguments_of, code, run

from mvcodec.encoding.encoder import EncoderConfig
from mvcodec.errors import SettingError
from mvcodec.stream import TrackKind
from mvcodec.video.h264 import X264_PARAMS
from mvcodec.video.hevc import X265_PARAMS

QPS = "27,35"

PARAMETERS = {"h264": X264_PARAMS, "hevc": X265_PARAMS}
"""Codec -> what its encoder is told for each kind of track."""

ALTERNATIVES: Mapping[str, Sequence[str]] = {
    "h264": (
        "psy=1",
        "psy=0",
        "psy=0:aq-mode=0:no-deblock=1",
        "psy=0:aq-mode=0:deblock=2,2",
        "psy=0:aq-mode=0:trellis=0",
        "psy=0:aq-mode=0:ipratio=1.0",
    ),
    "hevc": (
        "psy-rd=2",
        "psy-rd=0:psy-rdoq=0",
        "psy-rd=0:psy-rdoq=0:aq-mode=0:deblock=false",
        "psy-rd=0:psy-rdoq=0:aq-mode=0:sao=0",
        "psy-rd=0:psy-rdoq=0:aq-mode=0:rdoq-level=0",
        "psy-rd=0:psy-rdoq=0:aq-mode=0:ipratio=1.0",
    ),
}
"""Tried where none are given: the encoder's own psycho-visual optimisation and adaptive quantisation; the
latter alone; then mvcodec's settings and one thing more."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One coding of the input.

    Attributes:
        parameters: what the encoder of the maps was told, as it writes them.
        maps_kbit: for each time instant.
        psnr_y: dB, mean over the views looked at.
        excess: bits of pictures and maps more than with mvcodec's settings at the same PSNR, a share.
    """

    qp: int
    parameters: str
    maps_kbit: float
    psnr_y: float
    excess: float


@contextmanager
def told(codec: str, parameters: str) -> Iterator[None]:
    """Encoders of maps made inside of this are told something else."""
    table = PARAMETERS[codec]
    before, table[TrackKind.DISPARITY] = table[TrackKind.DISPARITY], parameters
    try:
        yield
    finally:
        table[TrackKind.DISPARITY] = before


def measure(
    material: Material, qps: Sequence[int], codec: str, cameras: str | None, others: Sequence[str]
) -> Iterator[Trial]:
    """Code with mvcodec's settings at each QP of the pictures, then with the others."""
    usual_config = EncoderConfig(codec=codec, disparity_cameras=cameras, disparity_range_px=material.range_px)
    configs = [replace(usual_config, qp=qp) for qp in qps]
    usual = [code(material, config) for config in configs]
    slope = db_for_each_log_bit(usual)
    for qp, config, first in zip(qps, configs, usual, strict=True):
        yield Trial(qp, PARAMETERS[codec][TrackKind.DISPARITY], first.maps_kbit, first.psnr_y, 0.0)
        for parameters in others:
            with told(codec, parameters):
                found = code(material, config)
            equal_psnr = math.log(found.kbit / first.kbit) - (found.psnr_y - first.psnr_y) / slope
            yield Trial(qp, parameters, found.maps_kbit, found.psnr_y, math.expm1(equal_psnr))


def db_for_each_log_bit(usual: Sequence[Outcome]) -> float:
    """The slope of PSNR over the natural logarithm of bits, from the first to the last coding."""
    return (usual[0].psnr_y - usual[-1].psnr_y) / math.log(usual[0].kbit / usual[-1].kbit)


def report(material: Material, arguments: argparse.Namespace) -> None:
    """All trials, QP by QP."""
    codec, qps = arguments.codec, arguments.qp
    if codec not in PARAMETERS:
        raise SettingError("--codec", codec, f"one of {', '.join(PARAMETERS)}")
    if len(set(qps)) < 2:
        raise SettingError("--qp", ",".join(map(str, qps)), "at least two, which give the curve's slope")
    others = arguments.set or ALTERNATIVES[codec]
    trials = list(measure(material, qps, codec, arguments.disparity_cameras, others))
    if arguments.json:
        rows = [asdict(trial) for trial in trials]
        print(json.dumps({"disparity_range_px": list(material.range_px), "trials": rows}, indent=1))
        return
    print(f"{'QP':>3} {'maps kbit':>9} {'Y-PSNR dB':>9} {'bits':>7}  settings")
    for trial in trials:
        figures = f"{trial.qp:3} {trial.maps_kbit:9.2f} {trial.psnr_y:9.3f} {trial.excess:+7.2%}"
        print(f"{figures}  {trial.parameters}")


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--set",
        action="append",
        metavar="PARAMETERS",
        help="settings to try, in the encoder's own words (default: some of each kind)",
    )
    return run(arguments_of(parser, QPS), report)


if __name__ == "__main__":
    sys.exit(main())
