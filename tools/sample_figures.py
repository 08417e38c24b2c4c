"""Figures that everyone can make: the rendered room and scikit-image's stereo pair, both installed already.

    python tools/sample_figures.py [docs/quality.md]

Synthesis: the corners of the room's 5 x 5 views, uncoded, and every synthesizer by name. Matching: bad pixels
of every matcher on the pair. Prints two tables; with a document they go between its two marks.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
from pathlib import Path

from array_sets import match_corners, scored_views
from readme_figures import replaced

from mvcodec import MvCodecWarning, Viewpoint, make_matcher, make_synthesizer, open_input
from mvcodec.evaluation.quality import QualityMeter
from mvcodec.evaluation.regions import bad_pixels, regions
from mvcodec.frames import DisparityMap
from mvcodec.output.atomic import write_bytes
from mvcodec.output.scene_folder import write_sample
from mvcodec.scenes.scene import SceneSettings
from mvcodec.stereo.matchers import MATCHERS
from mvcodec.synthesis.synthesizers import SYNTHESIZERS

MARKS = "<!-- sample figures -->", "<!-- end of sample figures -->"


def synthesis_table(folder: Path, grid: tuple[int, int], size: tuple[int, int]) -> str:
    """Every synthesizer on the room's first frame, from the default matcher's maps."""
    write_sample(folder, settings=SceneSettings(grid, 1, size), with_truth=False)
    source = open_input([folder])
    originals, decoded, _ = match_corners(source, "joint")
    lines = ["| synthesizer | Y-PSNR, dB | worst view, dB | SSIM |", "|---|---|---|---|"]
    for name in SYNTHESIZERS:
        synthesizer, meter = make_synthesizer(name), QualityMeter(source.array.real)
        for view in scored_views(source.array):
            meter.push(view, originals.pictures[view], synthesizer.render(decoded, Viewpoint(*view)).pixels)
        quality = meter.result()
        figures = quality.psnr_y.all, quality.psnr_y.worst, quality.ssim.all
        lines.append("| {} | {:.2f} | {:.2f} | {:.4f} |".format(name, *figures))
    return "\n".join(lines)


def matching_table(folder: Path) -> str:
    """Every estimating matcher on the pair: per cent of pixels that its map misses by more than 1 or 2 px."""
    write_sample(folder, "motorcycle")
    source = open_input([folder])
    array = source.array
    (frames,) = source.frame_sets()
    truth = source.truth((0, 0), 0)
    range_px = array.disparity_hint_px
    assert truth is not None
    assert range_px is not None
    scored = regions(DisparityMap(truth.values_px, truth.valid))
    lines = ["| matcher | > 1 px, seen by both | > 1 px, all | > 2 px, all |", "|---|---|---|---|"]
    for name in MATCHERS:
        if name == "given":  # it estimates nothing
            continue
        found = make_matcher(name).match(array, frames.pictures, range_px)[0, 0].values_px
        one, two = bad_pixels(scored, found, 1.0), bad_pixels(scored, found, 2.0)
        lines.append(f"| {name} | {one.non_occluded:.1%} | {one.all:.1%} | {two.all:.1%} |")
    return "\n".join(lines)


def main() -> int:
    """Measure; print, or write into the document."""
    parser = argparse.ArgumentParser(description="Figures that everyone can make.")
    parser.add_argument("document", type=Path, nargs="?", metavar="DOCUMENT")
    document: Path | None = parser.parse_args().document
    warnings.simplefilter("ignore", MvCodecWarning)
    with tempfile.TemporaryDirectory() as folder:
        tables = [
            synthesis_table(Path(folder) / "room", (5, 5), (640, 360)),
            matching_table(Path(folder) / "pair"),
        ]
    print("\n\n".join(tables))
    if document is not None:
        text = replaced(document.read_text(encoding="utf-8"), tables, document, MARKS)
        write_bytes(document, text.encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
