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
        dropped: frame sets that a live encoder left out; None where the file says nothing of it.
    """

    header: StreamHeader
    frames: int
    bits: Bits
    dropped: int | None = None


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
        dropped = reader.dropped
        total = 8 * reader.size
    texture, disparity = sizes[TrackKind.TEXTURE], sizes[TrackKind.DISPARITY]
    bits = Bits(total, texture, disparity, total - texture - disparity)
    return StreamInfo(reader.header, frames, bits, dropped)
