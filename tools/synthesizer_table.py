"""How good every synthesizer is on every set, in dB of luma: a Markdown table.

    python tools/synthesizer_table.py [--data DIR] [--sets A,B] [--matcher NAME] [--synthesizer NAME;NAME]
                                      [--json]

Each figure is the mean over the virtual views. DIR is an array folder or a folder of them; without it, the
sample scene. As in benchmark.py the corner cameras go in uncoded and the views of frame 0 are scored; all
synthesizers see the same maps.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

from array_sets import add_options, find_sets, match_corners, run, say, scored_views, with_virtual_views

from mvcodec.array import Viewpoint
from mvcodec.capture import ArraySource
from mvcodec.evaluation.quality import QualityMeter
from mvcodec.output.scene_folder import write_sample
from mvcodec.scenes.scene import SceneSettings
from mvcodec.synthesis.synthesizers import make_synthesizer

SPECIFICATIONS = (
    "layered",
    "quick",
    "dils",
    "dils:split=levels",
    "dils:split=levels,route=lr",
    "dils:split=levels,rematch=sad",
    "dils:rematch=sad",
    "linear",
    "linear:fill=yes",
    "linear:fill=yes,rematch=sad",
)
"""The thesis has matching anew by SAD everywhere, DILS by runs, and linear interpolation with holes."""


def psnr_of(source: ArraySource, matcher: str, specifications: tuple[str, ...]) -> dict[str, float]:
    """Specification -> luma PSNR of the virtual views of frame 0, dB."""
    originals, decoded, _ = match_corners(source, matcher)
    found = {}
    for specification in specifications:
        synthesizer, meter = make_synthesizer(specification), QualityMeter(source.array.real)
        for view in scored_views(source.array):
            rendered = synthesizer.render(decoded, Viewpoint(*view))
            meter.push(view, originals.pictures[view], rendered.pixels)
        psnr = meter.result().psnr_y.all
        assert psnr is not None
        found[specification] = psnr
    return found


def measure(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure every set and print one row for each synthesizer."""
    specifications = tuple(arguments.synthesizer.split(";"))
    for specification in specifications:
        make_synthesizer(specification)  # a wrong one is told before anything is measured
    with tempfile.TemporaryDirectory() as folder:
        if arguments.data is None:
            write_sample(Path(folder) / "sample", settings=SceneSettings(frames=1), with_truth=False)
        sets = with_virtual_views(find_sets(arguments.data or Path(folder), arguments.sets), arguments)
        found = {}
        for name, source in sets.items():
            print(f"measuring {name}", file=sys.stderr)
            found[name] = psnr_of(source, arguments.matcher, specifications)
    say(f"| | {' | '.join(found)} |\n|---|{'---|' * len(found)}", arguments)
    for specification in specifications:
        cells = " | ".join(f"{found[name][specification]:.2f}" for name in found)
        say(f"| `{specification}` | {cells} |", arguments)
    return found


def main() -> int:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description="Every synthesizer on every set, in dB.")
    add_options(parser, data_required=False)
    parser.set_defaults(synthesizer=";".join(SPECIFICATIONS))
    return run(parser, measure)


if __name__ == "__main__":
    sys.exit(main())
