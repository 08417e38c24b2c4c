"""Write the conformance pairs: tests/conformance/NAME.mcap, and NAME.json with what any decoder must find.

Write new ones only, when the writer writes something new: later versions must read the files of earlier ones.

    python tools/make_conformance.py tests/conformance NAME ...
"""

from __future__ import annotations

import argparse
import io
import json
import sys
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.reader import make_reader
from skimage import data

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.container import McapReader, McapWriter
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.enhancement import EnhancementHeader
from mvcodec.frames import DisparityMap, FrameSet, Picture
from mvcodec.stream import Packet, TrackKind
from mvcodec.synthesis.track_decoding import StreamTracks
from mvcodec.video.map_size import small_size

RANGE_PX = (-3.0, 9.5)


class Known:
    """A matcher that returns a made-up map, so that the files don't depend on any matching."""

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """A slope with a step, lower in each camera."""
        low, high = range_px
        y, x = np.mgrid[: array.height, : array.width]
        slope = x / array.width * 0.6 + 0.4 * (y > array.height / 2)
        valid = np.ones(slope.shape, np.bool_)
        return {
            (row, col): DisparityMap((low + slope * (high - low) / (1 + row + col)).astype(np.float32), valid)
            for row, col in pictures
        }


def _nominal(rows: int, cols: int, width: int, height: int, fps: float) -> CameraArray:
    nominal = Calibration.nominal(width, height)
    ends = [tuple(dict.fromkeys((0, count - 1))) for count in (rows, cols)]
    return CameraArray(rows, cols, width, height, fps, ends[0], ends[1], nominal)


def _calibrated() -> CameraArray:
    return CameraArray(
        rows=3,
        cols=5,
        width=48,
        height=32,
        fps=29.97,
        real_rows=(0, 2),
        real_cols=(0, 2, 4),
        calibration=Calibration(50.0, 52.0, 24.5, 15.0, 0.03, d_inf_px_per_step=0.25),
        rho=1.5,
        disparity_per_step_px=(-1.5, 4.75),
        name="three by five",
    )


@dataclass(frozen=True)
class Case:
    """What a file is made of: the array, its frames in the input, and the encoder's settings.

    Attributes:
        live: written as into a pipe, with a frame set left out and told.
    """

    array: CameraArray
    frames: tuple[int, ...]
    settings: dict[str, Any]
    live: bool = False


CASES: dict[str, Case] = {
    "square": Case(_nominal(3, 3, 64, 48, 10.0), tuple(range(6)), {"qp": 30, "gop": 3}),
    "odd_size": Case(_nominal(1, 4, 33, 17, 25.0), (0, 1, 2), {"qp": 24}),
    "one_column": Case(_nominal(4, 1, 32, 32, 2.0), (7, 8, 9, 10), {"qp": 30, "disparity_qp": 40}),
    "calibrated": Case(_calibrated(), (0, 1), {"qp": None, "crf": 30.0}),
    "half_size_maps": Case(_nominal(2, 3, 35, 50, 10.0), (0, 1, 2), {"qp": 30, "disparity_scale": 2}),
    "alternate_maps": Case(_calibrated(), (0, 1, 2), {"qp": 32, "gop": 2, "disparity_cameras": "alternate"}),
    "no_maps": Case(_calibrated(), (0, 1, 2), {"qp": 32, "gop": 2, "disparity_cameras": "none"}),
    "predicted": Case(
        _calibrated(), (0, 1, 2), {"qp": 32, "gop": 2, "disparity_scale": 2, "prediction": "synthesis"}
    ),
    "predicted_no_maps": Case(
        _calibrated(), (0, 1, 2), {"qp": 32, "gop": 2, "disparity_cameras": "none", "prediction": "synthesis"}
    ),
    "enhanced_nearest": Case(
        _calibrated(),
        (0, 1, 2),
        {
            "qp": 36,
            "gop": 2,
            "prediction": "synthesis",
            "enhance": 30,
            "enhance_views": ((0, 1), (1, 1)),
            "second_reference": "nearest",
        },
    ),
    "enhanced": Case(
        _calibrated(),
        (0, 1, 2),
        {"qp": 40, "gop": 2, "disparity_scale": 2, "enhance": 30, "enhance_views": ((0, 1), (1, 2), (2, 3))},
    ),
    "predicted_past": Case(
        _calibrated(), (0, 1, 2, 3), {"qp": 36, "gop": 3, "disparity_scale": 2, "prediction": "synthesis"}
    ),
    "enhanced_past": Case(
        _nominal(3, 3, 96, 80, 10.0),
        (0, 1, 2, 3),
        {"qp": 40, "gop": 3, "enhance": 34, "enhance_views": ((0, 1), (1, 1))},
    ),
    "depth": Case(_calibrated(), (0, 1), {"qp": 34, "depth": True}),
    "hevc": Case(_nominal(1, 2, 64, 48, 10.0), (0, 1, 2, 3), {"qp": 30, "codec": "hevc", "gop": 2}),
    "av1": Case(_nominal(1, 2, 64, 48, 10.0), (0, 1, 2, 3), {"qp": 40, "codec": "av1", "gop": 2}),
    "vp9": Case(_nominal(1, 2, 64, 48, 10.0), (0, 1, 2, 3), {"qp": 40, "codec": "vp9", "gop": 2}),
    "live": Case(_nominal(1, 2, 32, 32, 10.0), (0, 1, 3, 4, 5), {"qp": 34, "gop": 2}, live=True),
    "principal_points": Case(_calibrated(), (0, 1), {"qp": 40}),
}


def _frame_set(array: CameraArray, index: int) -> FrameSet:
    photograph = np.asarray(data.astronaut(), np.uint8)  # type: ignore[no-untyped-call]
    pictures = {}
    for row, col in array.positions:
        top, left = 60 + 3 * row + index, 160 + 3 * col + 2 * index
        pictures[row, col] = photograph[top : top + array.height, left : left + array.width]
    return FrameSet(index, round(index * 1e9 / array.fps), pictures)


def write_case(name: str) -> bytes:
    """The MCAP file of a case."""
    case = CASES[name]
    config = EncoderConfig(matcher=Known(), disparity_range_px=RANGE_PX, **case.settings)
    target = _Pipe() if case.live else io.BytesIO()
    writer = McapWriter(target, 0) if case.live else McapWriter(target)
    with Encoder(case.array, config) as encoder, writer:
        for index in case.frames:
            writer.push(encoder.push(_frame_set(case.array, index)))
        if case.live:
            writer.note({"dropped": str(case.frames[-1] + 1 - len(case.frames))})
    return target.getvalue()


class _Pipe(io.BytesIO):
    """What is read while it is written."""

    def seekable(self) -> bool:
        return False


def describe(content: bytes) -> dict[str, Any]:
    """What a conformant decoder finds: stored headers, and CRC-32 of planes (cropped rows, top to bottom).

    Pictures are described by the planes that the video decoder puts out, which the codec's standard
    fixes bit by bit; maps by their code values; depth, where there is any, by its millimetres.
    """
    layer: EnhancementHeader | None = None
    with McapReader(io.BytesIO(content), layer=True) as reader:
        known, array = reader.header, reader.header.array
        map_width, map_height = small_size(array.width, array.height, known.disparity_scale)
        half = (slice((array.height + 1) // 2), slice((array.width + 1) // 2))
        header: dict[str, Any] = {}
        sets: dict[int, list[Packet]] = {}
        for number, packet in reader.packets():
            if packet.track.kind is TrackKind.HEADER:
                header = json.loads(packet.data)
            elif packet.track.kind is TrackKind.LAYER:
                layer = EnhancementHeader.from_json(packet.data, known, "layer")
            else:
                sets.setdefault(number, []).append(packet)
    tracks = StreamTracks(known, layer)
    frames: list[dict[str, Any]] = []
    for packets in sets.values():
        crcs = {}
        for track, planes in tracks.decode(packets).items():
            if track.kind is TrackKind.DISPARITY:
                found = [planes.y[:map_height, :map_width]]
            else:
                found = [planes.y[: array.height, : array.width], planes.u[half], planes.v[half]]
            crcs[track.topic] = [zlib.crc32(p.tobytes()) for p in found]
        frames.append({"index": packets[0].index, "time_ns": packets[0].time_ns, "crc32": crcs})
    depth = _depth(content)
    enhancement = {} if layer is None else {"enhancement": json.loads(layer.to_json())}
    return {
        "header": header,
        **enhancement,
        "frame_sets": frames,
        **({"depth_crc32": depth} if depth else {}),
    }


def _depth(content: bytes) -> dict[str, list[int]]:
    """Topic -> CRC-32 of each depth image, rows without padding, 16 bits little-endian."""
    found: dict[str, list[int]] = {}
    for _, channel, message in make_reader(io.BytesIO(content)).iter_messages():
        if channel.topic.endswith("/depth"):
            found.setdefault(channel.topic, []).append(zlib.crc32(RawImage.FromString(message.data).data))
    return found


def main() -> int:
    """Write the pairs named on the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("name", nargs="+", choices=CASES)
    arguments = parser.parse_args()
    folder = arguments.folder
    for name in arguments.name:
        content = write_case(name)
        (folder / f"{name}.mcap").write_bytes(content)
        text = json.dumps(describe(content), indent=1)
        (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")
        print(f"{name}: {len(content)} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
