"""``mvcodec info``: what a file holds."""

from __future__ import annotations

import argparse
import json
import warnings
from dataclasses import asdict
from typing import Any

from mvcodec.container import StreamInfo, read_info
from mvcodec.decoding.estimated_maps import DEFAULT_MATCHER
from mvcodec.errors import MvCodecWarning, StreamError
from mvcodec.stream import StreamHeader, TrackKind


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``info``."""
    parser.add_argument("input", metavar="IN.mcap", help="or its URL on a web server")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(arguments: argparse.Namespace) -> None:
    """Print what the file holds."""
    info = read_info(arguments.input, _warn)
    if arguments.json:
        print(json.dumps(document(info)))
        return
    array, (low, high) = info.header.array, info.header.disparity_range_px
    rows, cols = (",".join(map(str, axis)) for axis in (array.real_rows, array.real_cols))
    print(f"{arguments.input}: {summary(info)}")
    print(f"  grid         {array.rows} x {array.cols}, {array.width} x {array.height} px, {array.fps:g} fps")
    print(f"  real         {len(array.real)} cameras: rows {rows}, cols {cols}")
    print(f"  disparity    {low:g}..{high:g} px between neighbouring real cameras, {_maps(info.header)}")
    if info.header.predicted:
        tracks = [info.header.picture_track(camera) for camera in array.real]
        alone = [track.topic for track in tracks if track.kind is TrackKind.TEXTURE]
        others = count(len(info.header.predicted), "camera")
        print(f"  prediction   {others} coded from others; {', '.join(alone)} plays alone")
    print(f"  calibration  {'given' if array.calibration.given else 'nominal (the input stated none)'}")
    if info.dropped is not None:
        print(f"  dropped      {count(info.dropped, 'frame set')}, left out while encoding live")
    if info.damages:
        print(f"  damage       in {count(info.damages, 'place')}; what is there is not counted above")
    for name, bits in asdict(info.bits).items():
        print(f"  {name:11}  {bits / 1000:.1f} kbit")


def _warn(error: StreamError) -> None:
    warnings.warn(str(error), MvCodecWarning, stacklevel=3)


def _maps(header: StreamHeader) -> str:
    if not header.map_cameras:
        matcher = header.settings.get("matcher", DEFAULT_MATCHER)
        return f"no maps: decoders estimate {len(header.array.real)} a frame set, by matcher {matcher}"
    size = "half" if header.disparity_scale == 2 else "full"
    return f"maps of {size} size from {count(len(header.map_cameras), 'camera')}"


def document(info: StreamInfo) -> dict[str, Any]:
    """What ``info --json`` prints."""
    array = info.header.array
    return {
        "grid": [array.rows, array.cols],
        "real": [list(position) for position in array.real],
        "frames": info.frames,
        "dropped": info.dropped,
        "damages": info.damages,
        "fps": array.fps,
        "size": [array.width, array.height],
        "bits": asdict(info.bits),
        "disparity_range_px": list(info.header.disparity_range_px),
        "disparity_scale": info.header.disparity_scale,
        "disparity_cameras": info.header.disparity_cameras,
        "predicted": [
            {"camera": list(each.camera), "from": [list(other) for other in each.references]}
            for each in info.header.predicted
        ],
        "version": info.header.version,
        "calibration": "given" if array.calibration.given else "nominal",
    }


def summary(info: StreamInfo) -> str:
    """One line: frame sets, bits, rate."""
    array, bits = info.header.array, info.bits.total
    rate = bits * array.fps / max(info.frames, 1)
    return (
        f"{count(info.frames, 'frame set')} of {count(len(array.real), 'camera')}, {bits / 1000:.1f} kbit"
        f" ({rate / 1000:.1f} kbit/s; maps {info.bits.disparity / bits:.0%})"
    )


def count(number: int, what: str) -> str:
    """``1 camera``, ``4 cameras``."""
    return f"{number} {what}{'s' * (number != 1)}"
