"""``mvcodec info``: what a file holds."""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mvcodec.container import StreamInfo, read_info
from mvcodec.container.remote import is_url
from mvcodec.decoding.estimated_maps import DEFAULT_MATCHER
from mvcodec.errors import MvCodecWarning, StreamError
from mvcodec.stream import StreamHeader, TrackKind

RATES = {"qp": "QP {:g}", "crf": "CRF {:g}", "bitrate_kbps": "{:g} kbit/s asked for"}
"""What governs the bits, in the header's settings."""

FIRST_DATED_S = 315_532_800.0
"""1980: times before it count from the beginning of something else than 1970."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``info``."""
    parser.add_argument("input", metavar="IN.mcap", help="or its URL on a web server")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(arguments: argparse.Namespace) -> None:
    """Print what the file holds."""
    info = read_info(arguments.input, _warn)
    if arguments.json:
        print(json.dumps(document(info, arguments.input)))
        return
    array, (low, high) = info.header.array, info.header.disparity_range_px
    rows, cols = (",".join(map(str, axis)) for axis in (array.real_rows, array.real_cols))
    print(f"{arguments.input}: {summary(info)}")
    print(f"  grid         {array.rows} x {array.cols}, {array.width} x {array.height} px, {array.fps:g} fps")
    print(f"  real         {len(array.real)} cameras: rows {rows}, cols {cols}")
    print(f"  disparity    {low:g}..{high:g} px between neighbouring real cameras, {_maps(info.header)}")
    print(f"  codec        {info.header.codec}, {_rate(info.header.settings)}")
    print(f"  matcher      {info.header.settings.get('matcher', 'not stated')}")
    print(f"  made by      {info.header.settings.get('encoder', 'not stated')}{_recorded(info)}")
    print(f"  created      {_creation(arguments.input)}")
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
    if info.layer is not None:
        print(f"  enhancement  {_layer(info)}")
    for name, bits in asdict(info.bits).items():
        if name == "enhancement" and info.layer is None:
            continue
        print(f"  {name:11}  {bits / 1000:.1f} kbit")


def _warn(error: StreamError) -> None:
    warnings.warn(str(error), MvCodecWarning, stacklevel=3)


def _rate(settings: Mapping[str, Any]) -> str:
    """What governed the bits, as the options say it."""
    for name, text in RATES.items():
        if name in settings:
            return text.format(settings[name])
    return "rate not stated"


def _dated(source: str | Path) -> datetime | None:
    """When a file was written, as the system dates it; None of one behind a URL.

    It holds no date of its own, so that the same input gives the same file.
    """
    text = str(source)
    return None if is_url(text) else datetime.fromtimestamp(Path(text).stat().st_mtime, UTC)


def _creation(source: str) -> str:
    date = _dated(source)
    if date is None:
        return "not known of a file behind a URL"
    return f"{date:%Y-%m-%d %H:%M:%S} UTC, as the system dates the file"


def _recorded(info: StreamInfo) -> str:
    """When the pictures were taken, where their times are of a clock and don't count from 0."""
    first_s = info.span_ns[0] / 1e9
    if first_s < FIRST_DATED_S:
        return ", times without a date"
    moment = datetime.fromtimestamp(first_s, UTC)
    return f", pictures from {moment:%Y-%m-%d %H:%M:%S} UTC on"


def _maps(header: StreamHeader) -> str:
    matcher = header.settings.get("matcher", DEFAULT_MATCHER)
    estimating = f"decoders estimate {len(header.array.real)} a frame set, by matcher {matcher}"
    if not header.map_cameras:
        return f"no maps: {estimating}"
    if header.estimates_maps:
        return f"maps of {count(len(header.map_cameras), 'camera')} for prediction alone: {estimating}"
    size = "half" if header.disparity_scale == 2 else "full"
    return f"maps of {size} size from {count(len(header.map_cameras), 'camera')}"


def _layer(info: StreamInfo) -> str:
    """What the enhancement layer is, in words."""
    assert info.layer is not None
    virtual = len(info.header.array.positions) - len(info.header.array.real)
    views = f"{len(info.layer.views)} of {count(virtual, 'virtual view')}"
    asked = info.layer.settings.get("enhance")
    quality = "" if asked is None else f", --enhance {asked}"
    return f"{views} coded from their synthesis{quality}; the base plays without"


def document(info: StreamInfo, source: str | Path) -> dict[str, Any]:
    """What ``info --json`` prints of a file."""
    array, date = info.header.array, _dated(source)
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
        "disparity_use": info.header.disparity_use,
        "predicted": [
            {"camera": list(each.camera), "from": [list(other) for other in each.references]}
            for each in info.header.predicted
        ],
        "enhanced": [] if info.layer is None else [list(each.view) for each in info.layer.views],
        "version": info.header.version,
        "calibration": "given" if array.calibration.given else "nominal",
        "codec": info.header.codec,
        "rate": {name: info.header.settings[name] for name in RATES if name in info.header.settings},
        "matcher": info.header.settings.get("matcher"),
        "encoder": info.header.settings.get("encoder"),
        "created": None if date is None else f"{date:%Y-%m-%dT%H:%M:%SZ}",
        "first_s": info.span_ns[0] / 1e9,
        "duration_s": info.duration_s,
        "megabytes": info.bits.total / 8e6,
        "mbit_per_s": _mbit_per_s(info),
    }


def summary(info: StreamInfo) -> str:
    """One line: frame sets, bits, rate."""
    array, bits = info.header.array, info.bits
    tracks = max(bits.total, bits.texture + bits.disparity, 1)
    return (
        f"{count(info.frames, 'frame set')} of {count(len(array.real), 'camera')}, {info.duration_s:.2f} s,"
        f" {bits.total / 8e6:.3f} MB ({_mbit_per_s(info):.3f} Mbit/s; maps {bits.disparity / tracks:.0%})"
    )


def _mbit_per_s(info: StreamInfo) -> float:
    return info.bits.total / 1e6 / info.duration_s if info.frames else 0.0


def simulcast_bits(info: StreamInfo) -> int:
    """About what all views of the grid take, each coded by itself: as much a view as the real ones."""
    array = info.header.array
    return round(info.bits.texture * len(array.positions) / len(array.real))


def count(number: int, what: str) -> str:
    """``1 camera``, ``4 cameras``."""
    return f"{number} {what}{'s' * (number != 1)}"
