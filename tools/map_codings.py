"""Codings of one input that differ in how its maps are coded: what such experiments share.

Matching depends on none of it and is done once.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.capture import open_input, resolve_frames
from mvcodec.cli.arguments import DEFAULT_SYNTHESIZER, add_frames, disparity_range, join_negative_values
from mvcodec.cli.coding_options import find_range
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig, find_matcher
from mvcodec.errors import MvCodecError
from mvcodec.evaluation.metrics import luma, psnr
from mvcodec.evaluation.remembered import MapSpool, Remembered
from mvcodec.frames import DecodedSet, FrameSet
from mvcodec.stereo.matcher import Matcher
from mvcodec.stream import DISPARITY_CAMERAS, TrackKind
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.video.codecs import CODECS


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """What every coding starts from: frame sets of all views, and what matches the real ones."""

    array: CameraArray
    frame_sets: Sequence[FrameSet]
    range_px: tuple[float, float]
    matcher: Matcher

    @property
    def scored(self) -> tuple[list[Position], set[int]]:
        """Every second view, and the numbers of the first, the middle and the last frame."""
        views = [view for view in self.array.positions if sum(view) % 2 == 0]
        last = len(self.frame_sets) - 1
        return views, {self.frame_sets[number].index for number in (0, (last + 1) // 2, last)}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a coding costs and brings.

    Attributes:
        kbit: of all tracks, for each time instant, without the container.
        maps_kbit: of the maps' tracks alone.
        psnr_y: dB, mean over the views looked at (`Material.scored`).
    """

    kbit: float
    maps_kbit: float
    psnr_y: float


def code(material: Material, config: EncoderConfig) -> Outcome:
    """Code the material, decode it and look at some views."""
    views, frames = material.scored
    synthesizer = make_synthesizer(DEFAULT_SYNTHESIZER)
    bits = dict.fromkeys(TrackKind, 0)
    found: list[float] = []
    originals = {taken.index: taken.pictures for taken in material.frame_sets}

    def score(decoded: DecodedSet) -> None:
        for view in views:
            rendered = synthesizer.render(decoded, Viewpoint(*view)).pixels
            found.append(psnr(luma(originals[decoded.index][view]), luma(rendered)))

    with Encoder(material.array, config, material.matcher) as encoder, Decoder() as decoder:
        for taken in material.frame_sets:
            for packet in encoder.push(taken):
                bits[packet.track.kind] += 8 * len(packet.data)
                for decoded in decoder.push(packet):
                    if decoded.index in frames:
                        score(decoded)
    instants = 1e3 * len(material.frame_sets)
    maps = bits[TrackKind.DISPARITY] / instants
    return Outcome(bits[TrackKind.TEXTURE] / instants + maps, maps, float(np.mean(found)))


def arguments_of(parser: argparse.ArgumentParser, qps: str) -> argparse.Namespace:
    """Add the options that the experiments share, and parse; `qps` is the default of ``--qp``."""
    parser.add_argument("input", type=Path, metavar="INPUT", help="an array folder")
    parser.add_argument("--real", default="corners", help="as for encode (default: %(default)s)")
    parser.add_argument(
        "--qp",
        default=qps,
        type=whole_numbers,
        metavar="N,N..",
        help="of the pictures (default: %(default)s)",
    )
    parser.add_argument("--codec", choices=CODECS, default="h264")
    parser.add_argument("--disparity-range", type=disparity_range, metavar="LO,HI|auto", help="as for encode")
    parser.add_argument("--disparity-cameras", choices=DISPARITY_CAMERAS, help="as for encode")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    add_frames(parser, "frames of the input to code")
    return parser.parse_args(join_negative_values(sys.argv[1:]))


def whole_numbers(text: str) -> list[int]:
    """``27,32`` as numbers."""
    try:
        return [int(number) for number in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected whole numbers such as 27,32 (write --offsets=-3,3)"
        ) from None


@contextmanager
def prepared(arguments: argparse.Namespace) -> Iterator[Material]:
    """Read the input that was asked for; maps are matched with the first coding."""
    source = open_input([arguments.input], real=arguments.real)
    chosen = resolve_frames(arguments.frames, source.frame_count, source.name)
    range_px = find_range(source, chosen, arguments.disparity_range)
    frame_sets = list(source.frame_sets(slice(chosen.start, chosen.stop), source.array.positions))
    with tempfile.TemporaryDirectory() as folder, MapSpool(Path(folder)) as spool:
        matcher = Remembered(find_matcher(EncoderConfig().chosen_matcher), spool)
        yield Material(source.array, frame_sets, range_px, matcher)


def run(arguments: argparse.Namespace, experiment: Callable[[Material, argparse.Namespace], None]) -> int:
    """The exit code of an experiment on the input; an error is one line on standard error."""
    try:
        with prepared(arguments) as material:
            experiment(material, arguments)
    except MvCodecError as error:
        print(f"{Path(sys.argv[0]).stem}: error: {error}", file=sys.stderr)
        return 2
    return 0
