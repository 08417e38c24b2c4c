"""What a file holds, and where its bits go."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mvcodec.container.chunk_reading import OnDamage
from mvcodec.container.reader import McapReader
from mvcodec.enhancement import LAYER_TRACK, EnhancementHeader
from mvcodec.errors import StreamError
from mvcodec.stream import StreamHeader, TrackKind


@dataclass(frozen=True, slots=True)
class Bits:
    """Sizes in bits.

    Attributes:
        total: the whole file.
        texture: access units of the pictures.
        disparity: access units of the maps.
        enhancement: access units of the enhancement layer's views.
        other: the rest: container, headers, calibration, depth. 0 where the container's compression
            saves more than that takes.
    """

    total: int
    texture: int
    disparity: int
    enhancement: int
    other: int

    @classmethod
    def of(cls, total: int, payload: Mapping[TrackKind, int]) -> Bits:
        """The sizes out of those of the tracks' access units, by kind; the rest worked out."""
        texture = payload[TrackKind.TEXTURE] + payload[TrackKind.PREDICTED]
        disparity, enhancement = payload[TrackKind.DISPARITY], payload[TrackKind.ENHANCED]
        other = max(0, total - texture - disparity - enhancement)
        return cls(total, texture, disparity, enhancement, other)


@dataclass(frozen=True, slots=True)
class StreamInfo:
    """What `read_info` finds.

    Attributes:
        frames: frame sets, those that can be read.
        dropped: frame sets that a live encoder left out; None where the file says nothing of it.
        damages: in how many places the file is damaged; what is there was not counted.
        span_ns: times of the first and the last frame set; (0, 0) where there is none.
        layer: the header of the enhancement layer; None where there is none.
    """

    header: StreamHeader
    frames: int
    bits: Bits
    dropped: int | None = None
    damages: int = 0
    span_ns: tuple[int, int] = (0, 0)
    layer: EnhancementHeader | None = None

    @property
    def duration_s(self) -> float:
        """How long it plays: to the last frame set's end."""
        first, last = self.span_ns
        return (last - first) / 1e9 + 1 / self.header.array.fps if self.frames else 0.0


def read_info(source: str | Path | BinaryIO, on_damage: OnDamage | None = None) -> StreamInfo:
    """Read a whole file without decoding its video.

    Args:
        on_damage: told of damage, behind which reading goes on; None raises it.

    Raises:
        InputError, StreamError: as `McapReader`.
    """
    damages: list[StreamError] = []

    def note(error: StreamError) -> None:
        assert on_damage is not None
        damages.append(error)
        on_damage(error)

    sizes = dict.fromkeys(TrackKind, 0)
    frames, last = 0, -1
    times: list[int] = []
    layer: EnhancementHeader | None = None
    with McapReader.open(source, on_damage=None if on_damage is None else note, layer=True) as reader:
        for number, packet in reader.packets():
            if packet.track == LAYER_TRACK and layer is None:
                label = f"{reader.name}: {packet.track.topic}"
                layer = EnhancementHeader.from_json(packet.data, reader.header, label)
            sizes[packet.track.kind] += 8 * len(packet.data)
            if number != last:
                frames, last = frames + 1, number
                times = [*times[:1], packet.time_ns]
        dropped = reader.dropped
        total = 8 * reader.size
    bits = Bits.of(total, sizes)
    span = (times[0], times[-1]) if times else (0, 0)
    return StreamInfo(reader.header, frames, bits, dropped, len(damages), span, layer)
