"""Where the remaining error of synthesised views sits, set by set.

    python tools/error_shares.py --data DIR [--sets A,B] [--matcher NAME] [--synthesizer NAME] [--json]

Sets and views are those of benchmark.py: uncoded corners in, virtual views of frame 0 out.
A pixel belongs to the first of these regions that fits:

    filled   no real camera saw it
    edges    within 4 px of a jump of the view's own disparity by more than 2 px
    flat     the squared luma gradient of the original is below 4 in the mean of 3 x 3 pixels
    texture  every other pixel

For each: its share of the pixels, its share of the total squared luma error, and the PSNR inside it. Then the
share of the error that lies in the worst 2 % of each view's pixels, the share that would vanish if each
view had the mean brightness of its original, and the share, at most, that the originals' own noise makes.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from array_sets import add_options, find_sets, match_corners, run, say, scored_views, with_virtual_views

from mvcodec.array import Viewpoint
from mvcodec.capture import ArraySource
from mvcodec.evaluation.error_regions import REGIONS, ErrorMeter, ErrorShares
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.synthesizers import make_synthesizer


def measure_errors(source: ArraySource, matcher: str, synthesizer: Synthesizer) -> ErrorShares:
    """Match the uncoded corners of frame 0, render the scored views, find their error."""
    originals, decoded, _ = match_corners(source, matcher)
    meter = ErrorMeter()
    for view in scored_views(source.array):
        meter.push(originals.pictures[view], synthesizer.render(decoded, Viewpoint(*view)))
    return meter.result()


def line(name: str, shares: ErrorShares) -> str:
    """One set's figures."""
    cells = []
    for region in shares.regions.values():
        decibel = f"{region.psnr_y:.1f}" if region.psnr_y is not None else "-"
        cells.append(f"{region.share:6.1%} {_percent(region.error_share)} {decibel:>5}")
    worst, brightness = _percent(shares.worst_share), _percent(shares.brightness_share)
    rest = f"{worst} {brightness:>10} {_percent(shares.noise_share)}"
    return f"{name:12} | " + " | ".join(cells) + f" | {rest}"


def _percent(share: float | None) -> str:
    return "     -" if share is None else f"{share:6.1%}"


def measure(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure every set; a line for each as it is done."""
    synthesizer, document = make_synthesizer(arguments.synthesizer), {}
    sets = with_virtual_views(find_sets(arguments.data, arguments.sets), arguments)
    say(f"{'':12} | " + " | ".join(f"{name:19}" for name in REGIONS) + " |", arguments)
    columns = [f"{'pixels':>6} {'error':>6} {'dB':>5}"] * len(REGIONS)
    say(f"{'set':12} | " + " | ".join(columns) + " | worst 2% brightness  noise", arguments)
    for name, source in sets.items():
        shares = measure_errors(source, arguments.matcher, synthesizer)
        document[name] = shares.to_json()
        say(line(name, shares), arguments)
    return {"sets": document}


def main() -> int:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description="Where the remaining error of synthesised views sits.")
    add_options(parser, data_required=True)
    return run(parser, measure)


if __name__ == "__main__":
    sys.exit(main())
