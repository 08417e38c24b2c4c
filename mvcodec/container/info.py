"""What a file holds, and where its bits go."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mvcodec.container.reader import McapReader
from mvcodec.stream import StreamHeader, TrackKind


@dataclass(frozen=True, slots=True)
class Bits:
    """Sizes in bits.

    Attributes:
        total: the whole file.
        texture: access units of the pictures.
        disparity: access units of the maps.
        other: the rest: container, headers, calibration.
    """

    total: int
    texture: int
    disparity: int
    other: int


@dataclass(frozen=True, slots=True)
class StreamInfo:
    """What `read_info` finds.

    Attributes:
        frames: frame sets.
    """

    header: StreamHeader
    frames: int
    bits: Bits


def read_info(source: str | Path | BinaryIO) -> StreamInfo:
    """Read a whole file without decoding its video.

    Raises:
        InputError, StreamError: as `McapReader`.
    """
    sizes = dict.fromkeys(TrackKind, 0)
    frames = 0
    with McapReader.open(source) as reader:
        for number, packet in reader.packets():
            sizes[packet.track.kind] += 8 * len(packet.data)
            frames = number + 1
        total = 8 * reader.size
    texture, disparity = sizes[TrackKind.TEXTURE], sizes[TrackKind.DISPARITY]
    return StreamInfo(reader.header, frames, Bits(total, texture, disparity, total - texture - disparity))
