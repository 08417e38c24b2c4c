"""Measures what the maps' quantiser and scale cost and bring on an input, beside what the model chooses.

    python tools/disparity_qp.py INPUT [--real ...] [--qp N,N..] [--offsets N,N..] [--frames A:B] [--json]

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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.capture import ArraySource, open_input, resolve_frames
from mvcodec.cli.arguments import add_frames
from mvcodec.cli.decode import DEFAULT_SYNTHESIZER
from mvcodec.cli.encode import find_range
from mvcodec.decoder import Decoder
from mvcodec.encoder import Encoder, EncoderConfig
from mvcodec.errors import MvCodecError
from mvcodec.evaluation.metrics import luma, psnr
from mvcodec.frames import DecodedSet, DisparityMap, FrameSet, Picture
from mvcodec.layers.refinement import matcher_by_name
from mvcodec.stream import DISPARITY_SCALES, TrackKind
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.table import make_synthesizer
from mvcodec.video.table import CODECS, find_codec

QPS, OFFSETS = "22,27,32,37", "-6,-3,0,3,6"
MATCHER = "joint"


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


class Readymade:
    """A matcher that gives out maps made before, time after time."""

    def __init__(self, maps: Sequence[dict[Position, DisparityMap]]) -> None:
        self._maps: Iterator[dict[Position, DisparityMap]] = iter(maps)

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher`."""
        del array, pictures, range_px
        return next(self._maps)


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """What every coding starts from: frame sets of all views, and the maps of the real ones."""

    array: CameraArray
    frame_sets: Sequence[FrameSet]
    maps: Sequence[dict[Position, DisparityMap]]
    range_px: tuple[float, float]

    @property
    def scored(self) -> tuple[list[Position], set[int]]:
        """Views and frame numbers that are rendered."""
        views = [view for view in self.array.positions if sum(view) % 2 == 0]
        last = len(self.frame_sets) - 1
        return views, {self.frame_sets[number].index for number in (0, (last + 1) // 2, last)}


def prepare(source: ArraySource, chosen: range) -> Material:
    """Read and match."""
    array, range_px = source.array, find_range(source, chosen, None)
    frame_sets = list(source.frame_sets(slice(chosen.start, chosen.stop), array.positions))
    matcher = matcher_by_name(MATCHER)
    maps = [
        matcher.match(array, {camera: taken.pictures[camera] for camera in array.real}, range_px)
        for taken in frame_sets
    ]
    return Material(array, frame_sets, maps, range_px)


def code(material: Material, config: EncoderConfig, synthesizer: Synthesizer) -> tuple[float, float, float]:
    """Bits of all tracks, bits of the maps, and mean luma PSNR of the views looked at, dB."""
    views, frames = material.scored
    bits = dict.fromkeys(TrackKind, 0)
    found: list[float] = []
    originals = {taken.index: taken.pictures for taken in material.frame_sets}

    def score(decoded: DecodedSet) -> None:
        for view in views:
            rendered = synthesizer.render(decoded, Viewpoint(*view)).pixels
            found.append(psnr(luma(originals[decoded.index][view]), luma(rendered)))

    with Encoder(material.array, config) as encoder, Decoder() as decoder:
        for taken in material.frame_sets:
            for packet in encoder.push(taken):
                bits[packet.track.kind] += 8 * len(packet.data)
                for decoded in decoder.push(packet):
                    if decoded.index in frames:
                        score(decoded)
    return sum(bits.values()), bits[TrackKind.DISPARITY], float(np.mean(found))


def measure(material: Material, qps: Sequence[int], offsets: Sequence[int], codec: str) -> Iterator[Coding]:
    """Code with each QP of the pictures, each scale, and map QPs around the model's."""
    synthesizer, count = make_synthesizer(DEFAULT_SYNTHESIZER), len(material.frame_sets)
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
                    disparity_qp=disparity_qp,
                    disparity_range_px=material.range_px,
                    matcher=Readymade(material.maps),
                )
                total, maps, quality = code(material, config, synthesizer)
                chosen = (scale, disparity_qp) == (best, centre)
                yield Coding(qp, scale, disparity_qp, total / count / 1e3, maps / total, quality, chosen)


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
    parser.add_argument("input", type=Path, metavar="INPUT", help="an array folder")
    parser.add_argument("--real", default="corners", help="as for encode (default: %(default)s)")
    parser.add_argument("--qp", default=QPS, metavar="N,N..", help="of the pictures (default: %(default)s)")
    parser.add_argument(
        "--offsets",
        default=OFFSETS,
        metavar="N,N..",
        help="map QPs to try, less the model's (default: %(default)s)",
    )
    parser.add_argument("--codec", choices=CODECS, default="h264")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    add_frames(parser, "frames of the input to code")
    arguments = parser.parse_args()
    try:
        qps, offsets = (
            [int(text) for text in given.split(",")] for given in (arguments.qp, arguments.offsets)
        )
    except ValueError:
        parser.error("--qp and --offsets take whole numbers such as 27,32 (write --offsets=-3,3)")
    try:
        source = open_input([arguments.input], real=arguments.real)
        material = prepare(source, resolve_frames(arguments.frames, source.frame_count, source.name))
        codings = list(measure(material, qps, offsets, arguments.codec))
    except MvCodecError as error:
        print(f"disparity_qp: error: {error}", file=sys.stderr)
        return 2
    report(material, codings, as_json=arguments.json)
    return 0


def report(material: Material, codings: Sequence[Coding], *, as_json: bool) -> None:
    """All codings, cheapest first within a QP of the pictures."""
    hull = lower_hull(codings)
    rows = [{**asdict(each), "on_hull": each in hull, "excess": excess(each, hull)} for each in codings]
    if as_json:
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
