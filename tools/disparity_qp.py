"""Measures what the maps' quantiser and scale cost and bring on an input, beside what the model chooses.

    python tools/disparity_qp.py INPUT [--real ...] [--qp N,N..] [--offsets N,N..] [--codec NAME]
                                 [--disparity-cameras all|alternate] [--disparity-range LO,HI|auto]
                                 [--frames A:B] [--json]

Each line is one coding of the input: the pictures' QP, the maps' scale and QP, bits for each time instant
(of all tracks, without the container), the maps' share of them, luma PSNR over every second view of the
first, the middle and the last frame, and how many bits more that is than the lower hull of all codings has at
this PSNR.
Lines on the hull are marked with `=`, the model's choices with `<`.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from map_codings import Material, arguments_of, code, run, whole_numbers

from mvcodec.encoding.encoder import EncoderConfig
from mvcodec.stream import DISPARITY_SCALES
from mvcodec.video.codecs import find_codec

QPS, OFFSETS = "22,27,32,37", "-6,-3,0,3,6"


@dataclass(frozen=True, slots=True)
class Coding:
    """One coding of the input.

    Attributes:
        kbit: for each time instant, all tracks.
        maps: the maps' share of that.
        psnr_y: dB, mean over the views looked at.
        chosen: the model would take this scale and map QP.
    """

    qp: int
    scale: int
    disparity_qp: int
    kbit: float
    maps: float
    psnr_y: float
    chosen: bool


def measure(
    material: Material, qps: Sequence[int], offsets: Sequence[int], codec: str, cameras: str | None
) -> Iterator[Coding]:
    """Code with each QP of the pictures, each scale, and map QPs around the model's."""
    for qp in qps:
        best = EncoderConfig(qp=qp, codec=codec).scale_for(material.array)
        for scale in DISPARITY_SCALES:
            model = EncoderConfig(qp=qp, codec=codec, disparity_scale=scale)
            centre = model.rate_of_maps(material.array, material.range_px).qp
            assert centre is not None
            tried = {min(max(centre + offset, 1), find_codec(codec).max_qp) for offset in (0, *offsets)}
            for disparity_qp in sorted(tried):
                config = EncoderConfig(
                    qp=qp,
                    codec=codec,
                    disparity_scale=scale,
                    disparity_cameras=cameras,
                    disparity_qp=disparity_qp,
                    disparity_range_px=material.range_px,
                )
                found = code(material, config)
                chosen = (scale, disparity_qp) == (best, centre)
                share = found.maps_kbit / found.kbit
                yield Coding(qp, scale, disparity_qp, found.kbit, share, found.psnr_y, chosen)


def lower_hull(codings: Sequence[Coding]) -> list[Coding]:
    """Those that no mixture of two others beats, by log of the bits over PSNR; cheapest first."""
    hull: list[Coding] = []
    for coding in sorted(codings, key=lambda each: (each.kbit, -each.psnr_y)):
        if hull and coding.psnr_y <= hull[-1].psnr_y:
            continue
        while len(hull) > 1 and _slope(hull[-2], hull[-1]) <= _slope(hull[-1], coding):
            hull.pop()
        hull.append(coding)
    return hull


def excess(coding: Coding, hull: Sequence[Coding]) -> float:
    """Bits more than the hull has at the same PSNR, as a share; below the hull, than its cheapest."""
    logs = np.interp(coding.psnr_y, [each.psnr_y for each in hull], [math.log(each.kbit) for each in hull])
    return coding.kbit / math.exp(float(logs)) - 1


def _slope(one: Coding, other: Coding) -> float:
    return (other.psnr_y - one.psnr_y) / math.log(other.kbit / one.kbit)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--offsets",
        default=OFFSETS,
        type=whole_numbers,
        metavar="N,N..",
        help="map QPs to try, less the model's (default: %(default)s)",
    )
    return run(arguments_of(parser, QPS), report)


def report(material: Material, arguments: argparse.Namespace) -> None:
    """All codings, cheapest first within a QP of the pictures."""
    cameras = arguments.disparity_cameras
    codings = list(measure(material, arguments.qp, arguments.offsets, arguments.codec, cameras))
    hull = lower_hull(codings)
    rows = [{**asdict(each), "on_hull": each in hull, "excess": excess(each, hull)} for each in codings]
    if arguments.json:
        print(json.dumps({"disparity_range_px": list(material.range_px), "codings": rows}, indent=1))
        return
    print(f"{'QP':>3} {'scale':>5} {'map QP':>6} {'kbit':>8} {'maps':>5} {'Y-PSNR dB':>9} {'over hull':>9}")
    for each, row in zip(codings, rows, strict=True):
        marks = "=" * (each in hull) + "<" * each.chosen
        print(
            f"{each.qp:3} {each.scale:5} {each.disparity_qp:6} {each.kbit:8.1f} {each.maps:5.0%}"
            f" {each.psnr_y:9.3f} {row['excess']:+9.1%} {marks}"
        )


if __name__ == "__main__":
    sys.exit(main())
