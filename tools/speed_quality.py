"""What a speed costs in quality: each speed's coded arrays against those of `best`, at the same bits.

    python tools/speed_quality.py --data DIR [--sets A,B] [--speeds A,B] [--qp 22,27,32,37] [--json]

The first frame sets of each array are coded at each QP, with each speed's own matcher and preset, and
decoded; luma PSNR is the mean over the real cameras and the virtual views that `tools/benchmark.py` scores
(at most 8).
Printed: Bjontegaard's difference in PSNR against `best`, dB.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from array_sets import find_sets, run, say, scored_views, with_virtual_views

from mvcodec.array import Viewpoint
from mvcodec.capture import ArraySource
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.evaluation.bd import compare_curves
from mvcodec.evaluation.quality import QualityMeter
from mvcodec.stereo.disparity_range import estimate_range
from mvcodec.synthesis.synthesizers import make_synthesizer

MOST_VIEWS = 8
REFERENCE = "best"


def curve(source: ArraySource, speed: str, qps: list[int], frames: int) -> list[tuple[float, float]]:
    """(kbit for each frame set, dB) at each QP."""
    array = source.array
    views = scored_views(array)
    views = views[:: -(-len(views) // MOST_VIEWS)]
    originals = list(source.frame_sets(slice(0, frames), [*array.real, *views]))
    range_px = estimate_range(array, originals, None)
    synthesizer = make_synthesizer("layered")
    points = []
    for qp in qps:
        meter, bits = QualityMeter(array.real), 0
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "coded.mcap"
            config = EncoderConfig(qp=qp, speed=speed, disparity_range_px=range_px)
            with McapWriter(path) as writer, Encoder(array, config) as encoder:
                for frame_set in originals:
                    packets = encoder.push(frame_set)
                    bits += 8 * sum(len(packet.data) for packet in packets)
                    writer.push(packets)
            with Decoder.open(path) as decoder:
                for frame_set, decoded in zip(originals, decoder, strict=True):
                    for view in [*array.real, *views]:
                        made = synthesizer.render(decoded, Viewpoint(*view)).pixels
                        meter.push(view, frame_set.pictures[view], made)
        psnr = meter.result().psnr_y.all
        assert psnr is not None
        points.append((bits / 1000 / len(originals), psnr))
    return points


def measure(arguments: argparse.Namespace) -> dict[str, Any]:
    """Each set against `best`, and the mean over the sets."""
    sets = with_virtual_views(find_sets(arguments.data, arguments.sets), arguments)
    losses: dict[str, dict[str, float]] = {speed: {} for speed in arguments.speeds}
    for name, source in sets.items():
        frames = min(arguments.frames, source.frame_count)
        reference = curve(source, REFERENCE, arguments.qp, frames)
        for speed in arguments.speeds:
            delta = compare_curves(reference, curve(source, speed, arguments.qp, frames)).psnr_db
            if delta is not None:
                losses[speed][name] = delta
        found = " ".join(f"{speed} {losses[speed].get(name, np.nan):+.2f}" for speed in arguments.speeds)
        say(f"{name:12} {found} dB", arguments)
    means = {speed: float(np.mean(list(found.values()))) for speed, found in losses.items() if found}
    say("mean         " + " ".join(f"{speed} {value:+.2f}" for speed, value in means.items()), arguments)
    return {"psnr_db_against_best": losses, "mean": means}


def main() -> int:
    """Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--data", type=Path, metavar="DIR", required=True)
    parser.add_argument("--sets", type=lambda text: text.split(","), metavar="A,B")
    parser.add_argument("--speeds", type=lambda text: text.split(","), default=["realtime", "balanced"])
    parser.add_argument(
        "--qp", type=lambda text: [int(qp) for qp in text.split(",")], default=[22, 27, 32, 37]
    )
    parser.add_argument("--frames", type=int, default=2, metavar="N", help="of each set (default: 2)")
    parser.add_argument("--json", action="store_true")
    return run(parser, measure)


if __name__ == "__main__":
    sys.exit(main())
