"""Measures what forms of a file cost at equal quality: maps or none, plain cameras or predicted ones.

    python tools/form_rates.py INPUT [--forms NAME,..] [--qp N,N..] [--matcher NAME] [--real ...]
                               [--frames A:B] [--json]

Forms: `plain` (what encode writes by default), `none` (no maps in the file), `synthesis` (real cameras
coded from each other), `synthesis-alternate` (and maps from every second one, whatever the array),
`synthesis-none` (maps for prediction alone, decoders estimate their own); each of them with `+N` behind it
has an enhancement layer whose QP is N more than the pictures'. All views of the input's grid are rendered and
compared, the container counts. The last lines are BD-rates against the first form, of each other form and of
the hull of all but the first.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from map_codings import whole_numbers

from mvcodec.capture import ArraySource, open_input, resolve_frames
from mvcodec.cli.arguments import DEFAULT_SYNTHESIZER, add_frames, join_negative_values
from mvcodec.cli.coding_options import find_range, with_keyframe_ratio
from mvcodec.encoding.encoder import EncoderConfig, find_matcher
from mvcodec.errors import MvCodecError
from mvcodec.evaluation.bd import compare_curves, hull
from mvcodec.evaluation.chain import measure_chain
from mvcodec.evaluation.points import CurvePoint
from mvcodec.evaluation.remembered import MapSpool, Remembered
from mvcodec.synthesis.synthesizers import make_synthesizer

FORMS: Mapping[str, Mapping[str, str]] = {
    "plain": {},
    "none": {"disparity_cameras": "none"},
    "synthesis": {"prediction": "synthesis"},
    "synthesis-none": {"prediction": "synthesis", "disparity_cameras": "none"},
    "synthesis-alternate": {"prediction": "synthesis", "disparity_cameras": "alternate"},
}
QPS = "22,27,32,37,42"
MAX_QP = 51


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("input", type=Path, metavar="INPUT", help="an array folder")
    parser.add_argument("--real", default="corners", help="as for encode (default: %(default)s)")
    parser.add_argument("--forms", default=",".join(FORMS), help="some of %(default)s, each also with +N")
    parser.add_argument("--qp", default=QPS, type=whole_numbers, metavar="N,N..", help="default: %(default)s")
    parser.add_argument("--matcher", default="joint", metavar="NAME")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    add_frames(parser, "frames of the input to code")
    arguments = parser.parse_args(join_negative_values(sys.argv[1:]))
    try:
        curves = measure(arguments)
    except MvCodecError as error:
        print(f"{Path(sys.argv[0]).stem}: error: {error}", file=sys.stderr)
        return 2
    if arguments.json:
        print(json.dumps({form: [point.to_json() for point in curve] for form, curve in curves.items()}))
    else:
        report(curves)
    return 0


def measure(arguments: argparse.Namespace) -> dict[str, list[CurvePoint]]:
    """The points of every form that was asked for; matching by the encoder is done once."""
    source = open_input([arguments.input], real=arguments.real)
    chosen = resolve_frames(arguments.frames, source.frame_count, source.name)
    base = EncoderConfig(
        matcher=arguments.matcher, disparity_range_px=find_range(source, chosen, None), qp=arguments.qp[0]
    )
    base = with_keyframe_ratio(source, chosen, base)
    with tempfile.TemporaryDirectory() as folder, MapSpool(Path(folder)) as spool:
        return {
            form: [
                _point(source, chosen, _config(base, form, qp), spool, Path(folder)) for qp in arguments.qp
            ]
            for form in arguments.forms.split(",")
        }


def _config(base: EncoderConfig, form: str, qp: int) -> EncoderConfig:
    """The settings of a form at a QP."""
    name, plus, offset = form.partition("+")
    enhance = min(qp + int(offset), MAX_QP) if plus else None
    return replace(base, qp=qp, enhance=enhance, **FORMS[name])  # type: ignore[arg-type]


def _point(
    source: ArraySource, chosen: range, config: EncoderConfig, spool: MapSpool, folder: Path
) -> CurvePoint:
    matcher = Remembered(find_matcher(config.chosen_matcher), spool)
    synthesizer = make_synthesizer(DEFAULT_SYNTHESIZER)
    return measure_chain(source, chosen, config, matcher, synthesizer, folder / "coded.mcap", lambda: None)


def _rate_and_quality(point: CurvePoint) -> tuple[float, float]:
    assert point.quality.psnr_y.all is not None
    return point.kbps, point.quality.psnr_y.all


def report(curves: Mapping[str, list[CurvePoint]]) -> None:
    """The points of each form, then the distances from the first one."""
    print(
        f"{'form':10} {'QP':>3} {'kbit/s':>9} {'Y-PSNR dB':>9} {'virtual':>8} {'maps':>5}"
        f" {'encode s':>8} {'decode s':>8}"
    )
    for form, curve in curves.items():
        for point in curve:
            psnr = point.quality.psnr_y
            virtual = "-" if psnr.virtual is None else f"{psnr.virtual:.2f}"
            print(
                f"{form:10} {point.qp:3} {point.kbps:9.1f} {psnr.all:9.3f} {virtual:>8}"
                f" {point.split.disparity / point.bits:5.0%} {point.encode_seconds:8.1f}"
                f" {point.decode_seconds:8.1f}"
            )
    first, *others = curves
    pairs = {form: [_rate_and_quality(point) for point in curve] for form, curve in curves.items()}
    if len(others) > 1:
        pairs["hull"] = hull([pair for form in others for pair in pairs[form]])
    for form in [*others, "hull"][: len(pairs) - 1]:
        delta = compare_curves(pairs[first], pairs[form])
        percent = "-" if delta.rate_percent is None else f"{delta.rate_percent:+.1f} %"
        print(f"BD-rate of {form} over {first}: {percent}")


if __name__ == "__main__":
    sys.exit(main())
