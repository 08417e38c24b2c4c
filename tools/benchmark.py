"""How good and how fast: synthesis quality on real arrays, and speed against stock code in the same run.

    python tools/benchmark.py --data DIR [--sets A,B] [--what quality|speed] [--matcher NAME]
                              [--maps NAME] [--synthesizer NAME] [--json]

DIR is an array folder or a folder of them. Quality: the corner cameras go in uncoded, the disparity range is
estimated, every virtual view of frame 0 is rendered and its luma compared with the original's (of a 17 x 17
grid every 4th row and column, of a 9 x 9 one the views whose row + col is divisible by 5). With --maps they
are rendered once more from that matcher's maps, to judge renderer and maps apart (sgbm-h: plain SGBM,
horizontal partner only). Speed: see speed_ratios.py beside this file; it needs no --data (then: the sample
scene). Without --what, both.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from array_sets import add_options, find_sets, match_corners, run, say, scored_views, with_virtual_views

from mvcodec.array import Viewpoint
from mvcodec.capture import ArraySource, open_input
from mvcodec.errors import InputError, SettingError
from mvcodec.evaluation.quality import QualityMeter
from mvcodec.layers.refinement import make_matcher
from mvcodec.output.scene_folder import write_sample
from mvcodec.scenes.scene import SceneSettings
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.synthesizers import make_synthesizer

FRAMES = 8
"""As many as speed is measured on."""


@dataclass(frozen=True, slots=True)
class SetFigures:
    """What one set gave; seconds are of one view, rendered alone."""

    psnr_y: float
    ssim: float
    worst_psnr_y: float
    seconds_per_view: float
    matching_seconds: float
    range_px: tuple[float, float]
    views: int

    def to_json(self) -> dict[str, float]:
        """The form of ``--json``."""
        names = ("psnr_y", "ssim", "worst_psnr_y", "seconds_per_view")
        return {name: getattr(self, name) for name in names}


def measure_quality(source: ArraySource, matcher: str, synthesizer: Synthesizer) -> SetFigures:
    """Match the uncoded corners of frame 0, render the scored views, compare them."""
    array, views = source.array, scored_views(source.array)
    originals, decoded, matching_seconds = match_corners(source, matcher)
    # The first view pays for compilation and for what the synthesizer keeps of a decoded set.
    synthesizer.render(decoded, Viewpoint(*views[0]))
    meter, render_seconds = QualityMeter(array.real), 0.0
    for view in views:
        started = time.perf_counter()
        rendered = synthesizer.render(decoded, Viewpoint(*view))
        render_seconds += time.perf_counter() - started
        meter.push(view, originals.pictures[view], rendered.pixels)
    result = meter.result()
    psnr, ssim, worst = result.psnr_y.all, result.ssim.all, result.psnr_y.worst
    if psnr is None or ssim is None or worst is None:
        raise InputError(source.name, "no virtual view", "at least one")
    seconds_per_view, range_px = render_seconds / len(views), decoded.disparity_range_px
    return SetFigures(psnr, ssim, worst, seconds_per_view, matching_seconds, range_px, len(views))


def quality_table(sets: dict[str, ArraySource], arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure every set; a line for each as it is done."""
    synthesizer = make_synthesizer(arguments.synthesizer)
    figures: dict[str, Any] = {}
    header = f"{'set':12} {'Y-PSNR dB':>9} {'worst':>6} {'SSIM':>6}"
    if arguments.maps:
        header += f" | {arguments.maps + ' maps':>12} {'worst':>6} {'SSIM':>6} |"
    say(f"{header}  s/view s match views  range px", arguments)
    for name, source in sets.items():
        result = measure_quality(source, arguments.matcher, synthesizer)
        figures[name] = result.to_json()
        line = f"{name:12} {result.psnr_y:9.2f} {result.worst_psnr_y:6.2f} {result.ssim:6.4f}"
        if arguments.maps:
            other = measure_quality(source, arguments.maps, synthesizer)
            figures[name]["maps"] = {arguments.maps: other.to_json()}
            line += f" | {other.psnr_y:12.2f} {other.worst_psnr_y:6.2f} {other.ssim:6.4f} |"
        low, high = result.range_px
        line += f" {result.seconds_per_view:7.3f} {result.matching_seconds:7.3f} {result.views:5}"
        say(f"{line}  {low:g}..{high:g}", arguments)
    return figures


def speed_table(source: ArraySource, arguments: argparse.Namespace) -> dict[str, float]:
    """Measure the ratios on one array."""
    from speed_ratios import RATIOS, measure_ratios

    say(f"speed on {source.name}, {source.array.width} x {source.array.height}", arguments)
    ratios = {}
    for what, (ours, theirs) in measure_ratios(source, arguments.matcher, arguments.synthesizer).items():
        ratios[what] = ours / theirs
        figures = f"{ratios[what]:6.2f}  {ours * 1e3:9.2f} ms / {theirs * 1e3:9.2f} ms"
        say(f"{what:8} {figures}  {RATIOS[what]}", arguments)
    return ratios


def most_telling(sets: dict[str, ArraySource]) -> ArraySource:
    """The set to measure speed on: four corner cameras if any has them, then the most frames."""
    return max(sets.values(), key=lambda source: (len(source.array.real), min(source.frame_count, FRAMES)))


def rendered(folder: Path) -> ArraySource:
    """Four cameras of the sample scene, 960 x 640."""
    write_sample(folder, settings=SceneSettings(grid=(2, 2), frames=FRAMES, size=(960, 640)))
    return open_input([folder])


def measure(arguments: argparse.Namespace) -> dict[str, Any]:
    """What was asked for, in the form of ``--json``."""
    for name in (arguments.matcher, arguments.maps):
        if name is not None:
            make_matcher(name)  # a misspelt one is told before anything is measured
    if arguments.data is None:
        if arguments.what != "speed":
            raise SettingError(
                "--data", "nothing", "an array folder or a folder of them; --what speed needs none"
            )
        with tempfile.TemporaryDirectory() as folder:
            return {"ratios": speed_table(rendered(Path(folder)), arguments)}
    document: dict[str, Any] = {}
    sets = with_virtual_views(find_sets(arguments.data, arguments.sets), arguments)
    if arguments.what != "speed":
        document["sets"] = quality_table(sets, arguments)
    if arguments.what != "quality":
        document["ratios"] = speed_table(most_telling(sets), arguments)
    return document


def main() -> int:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description="Synthesis quality and speed of mvcodec.")
    add_options(parser, data_required=False)
    parser.add_argument("--what", choices=("quality", "speed"))
    parser.add_argument(
        "--maps", metavar="NAME", help="quality from another matcher's maps too, e.g. sgbm-h or sad+dlr"
    )
    return run(parser, measure)


if __name__ == "__main__":
    sys.exit(main())
