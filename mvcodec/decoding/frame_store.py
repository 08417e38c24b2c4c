"""Any frame set of a file, by number: a bounded cache before decoders that start at keyframes."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from mvcodec.array import Position
from mvcodec.container import McapReader
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.shared_file import SharedFile
from mvcodec.decoding.decoder import Decoder
from mvcodec.decoding.frame_table import FrameTable, read_frame_table
from mvcodec.errors import StreamError
from mvcodec.frames import DecodedSet
from mvcodec.stereo.matcher import Matcher

CACHE_BYTES = 256 << 20
MIN_CACHED = 3
MAX_CURSORS = 2
"""Places of the file that are decoded from at once; clients share them where they watch the same part."""


@dataclass(frozen=True, slots=True)
class Damage:
    """Frames that cannot be decoded.

    Attributes:
        first, end: frame numbers, the first damaged one and the next keyframe (or the file's end).
        message: what is wrong, with topic and time.
        error: the same, as it was raised.
    """

    first: int
    end: int
    message: str
    error: StreamError


@dataclass(frozen=True, slots=True, eq=False)
class StoredFrame:
    """What `FrameStore.fetch` found.

    Attributes:
        number: asked for.
        decoded: the frame set; the nearest good one where that is damaged; None if none is good.
        damage: why `decoded` is not the one asked for, or None.
        decode_ms: time spent on decoding it; 0 where it was at hand.
    """

    number: int
    decoded: DecodedSet | None
    damage: Damage | None
    decode_ms: float


class FrameStore:
    """Frame sets by number. Safe to use from several threads.

    Args:
        source: an MCAP file, complete or cut off: its path or URL, or an open one.
        cache_bytes: decoded frame sets are kept up to this size (and at least three of them).
        limits: what is more than that is refused.
        matcher: as `Decoder`'s.

    Raises:
        InputError, StreamError: as `read_frame_table`.
    """

    def __init__(
        self,
        source: str | Path | SharedFile,
        cache_bytes: int = CACHE_BYTES,
        limits: Limits = DEFAULT_LIMITS,
        matcher: str | Matcher | None = None,
    ) -> None:
        self._source = source
        self.name = source.name if isinstance(source, SharedFile) else str(source)
        self._limits, self._matcher = limits, matcher
        table = read_frame_table(_opened(source), limits)
        self.table: FrameTable = replace(table, cut_off=table.cut_off and self._told(table.cut_off))
        self._cache = _Cache(cache_bytes)
        self._cursors: list[_Cursor] = []
        self._damage: dict[int, Damage] = {}
        self._decoding = threading.Lock()
        self._finisher: _Cursor | None = None
        self._finishing = threading.Lock()

    @property
    def damages(self) -> tuple[Damage, ...]:
        """The damage that was met so far, in order."""
        return tuple(sorted(self._damage.copy().values(), key=lambda damage: damage.first))

    def fetch(self, number: int, enhanced: Collection[Position] = ()) -> StoredFrame:
        """Frame set `number` (0..count-1); decoding starts at its keyframe, unless it is at hand.

        Args:
            enhanced: views that are worth decoding. They join at a keyframe, so that they hold nothing up;
                see `finish`.
        """
        wanted = self.table.enhanced.intersection(enhanced)
        cached = self._cache.get(number)
        if cached is not None and self._cache.tried(number) >= wanted:
            return StoredFrame(number, cached, None, 0.0)
        start = time.perf_counter()
        with self._decoding:
            decoded = self._decode(number, wanted)
            damage = None
            if decoded is None:
                damage = self._damage[self.table.keyframe_before(number)]
                decoded = self._stand_in(damage)
        return StoredFrame(number, decoded, damage, 1000 * (time.perf_counter() - start))

    def finish(self, number: int, enhanced: Collection[Position]) -> StoredFrame:
        """As `fetch`, but with these enhanced views, if the file has them; others can fetch meanwhile.

        Where they were not decoded so far, decoding begins at the keyframe again.
        """
        wanted = self.table.enhanced.intersection(enhanced)
        if not wanted:
            return self.fetch(number)
        start = time.perf_counter()
        with self._finishing:
            if self._cache.tried(number) >= wanted:
                return self.fetch(number, wanted)
            keyframe = self.table.keyframe_before(number)
            cursor, self._finisher = self._finisher, None
            if cursor is None or not (keyframe <= cursor.next <= number and cursor.views >= wanted):
                if cursor is not None:
                    cursor.close()
                cursor = self._open_cursor(keyframe, wanted)
            try:
                while cursor.next <= number:
                    decoded = self._advance(cursor)
            except StreamError:
                cursor.close()
                return self.fetch(number)
            self._finisher = cursor
        return StoredFrame(number, decoded, None, 1000 * (time.perf_counter() - start))

    def close(self) -> None:
        """Let go of the file."""
        with self._finishing, self._decoding:
            if self._finisher is not None:
                self._finisher.close()
            while self._cursors:
                self._cursors.pop().close()

    def _decode(self, number: int, wanted: frozenset[Position] = frozenset()) -> DecodedSet | None:
        """Decode up to a frame, or return None where it is damaged."""
        keyframe = self.table.keyframe_before(number)
        cached = self._cache.get(number)
        if cached is not None and (self._cache.tried(number) >= wanted or not self._joins(number, wanted)):
            return cached
        known = self._damage.get(keyframe)
        if known is not None and number >= known.first:
            return None
        cursor = self._cursor(number, keyframe, wanted)
        decoded = None
        try:
            while cursor.next <= number:
                decoded = self._advance(cursor)
        except StreamError as error:
            self._cursors.remove(cursor)
            cursor.close()
            self._note_damage(cursor.next, error)
            return None
        return decoded

    def _joins(self, number: int, wanted: frozenset[Position]) -> bool:
        """Whether decoding a frame set again can bring these enhanced views."""
        keyframe = self.table.keyframe_before(number)
        going_on = (keyframe < cursor.next <= number and cursor.views >= wanted for cursor in self._cursors)
        return number == keyframe or any(going_on)

    def _advance(self, cursor: _Cursor) -> DecodedSet:
        at = cursor.next
        decoded = cursor.advance()
        return self._cache.put(at, decoded, cursor.views)

    def _open_cursor(self, keyframe: int, wanted: frozenset[Position]) -> _Cursor:
        return _Cursor(_opened(self._source), keyframe, self._limits, self._matcher, wanted)

    def _cursor(self, number: int, keyframe: int, wanted: frozenset[Position]) -> _Cursor:
        """The cursor that is nearest before a frame, at its keyframe at the earliest; the last used last."""
        usable = [cursor for cursor in self._cursors if keyframe <= cursor.next <= number]
        if usable:
            cursor = max(usable, key=lambda cursor: (cursor.views >= wanted, cursor.next))
            self._cursors.remove(cursor)
        else:
            if len(self._cursors) == MAX_CURSORS:
                self._cursors.pop(0).close()
            cursor = self._open_cursor(keyframe, wanted)
        cursor.want(wanted)
        self._cursors.append(cursor)
        return cursor

    def _note_damage(self, frame: int, error: StreamError) -> None:
        table = self.table
        damage = Damage(frame, table.keyframe_after(frame), self._told(str(error)), error)
        self._damage[table.keyframe_before(frame)] = damage

    def _told(self, message: str) -> str:
        """A message for viewers, whose business the server's folders are not."""
        return message.replace(self.name, Path(self.name).name)

    def _stand_in(self, damage: Damage) -> DecodedSet | None:
        """The last good frame before damage, else the first good one behind it."""
        for number in (*range(damage.first - 1, -1, -1), *range(damage.end, self.table.count)):
            known = self._damage.get(self.table.keyframe_before(number))
            if known is not None and number >= known.first:
                continue
            decoded = self._decode(number)
            if decoded is not None:
                return decoded
        return None


class _Cache:
    """The frame sets used last, bounded in bytes."""

    def __init__(self, limit_bytes: int) -> None:
        self._limit = limit_bytes
        self._held: OrderedDict[int, tuple[DecodedSet, frozenset[Position]]] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, number: int) -> DecodedSet | None:
        with self._lock:
            found = self._held.get(number)
            if found is None:
                return None
            self._held.move_to_end(number)
            return found[0]

    def tried(self, number: int) -> frozenset[Position]:
        """The enhanced views that a frame set was decoded with, whether they could be or not."""
        with self._lock:
            found = self._held.get(number)
            return frozenset() if found is None else found[1]

    def put(self, number: int, decoded: DecodedSet, tried: frozenset[Position]) -> DecodedSet:
        """Keep a frame set, or that which is held with more enhanced views; returns what is kept."""
        room = max(MIN_CACHED, self._limit // _bytes_of(decoded))
        with self._lock:
            held = self._held.get(number)
            if held is not None and held[1] >= tried:
                decoded, tried = held
            elif held is not None:
                # What was made of the base by now, such as maps that took seconds, is not made again.
                decoded = replace(held[0], enhanced=decoded.enhanced)
            self._held[number] = decoded, tried
            self._held.move_to_end(number)
            while len(self._held) > room:
                self._held.popitem(last=False)
        return decoded


def _opened(source: str | Path | SharedFile) -> str | Path | BinaryIO:
    return source.reader() if isinstance(source, SharedFile) else source


def _bytes_of(decoded: DecodedSet) -> int:
    # Pictures and maps that are made when somebody looks at them count as if they were there.
    pixels = decoded.array.height * decoded.array.width
    of_a_map = np.float32().nbytes + np.bool_().nbytes
    of_a_view = 3 + np.float32().nbytes
    held = 3 * len(decoded.pictures) + of_a_map * len(decoded.disparities)
    return pixels * (held + of_a_view * len(decoded.enhanced))


class _Cursor:
    """A decoder at a place in the file.

    Attributes:
        next: the frame that `advance` returns.
    """

    def __init__(
        self,
        source: str | Path | BinaryIO,
        keyframe: int,
        limits: Limits,
        matcher: str | Matcher | None,
        wanted: frozenset[Position],
    ) -> None:
        self.next = keyframe
        self._reader = McapReader.open(source, limits, layer=True)
        self._packets = self._reader.packets(keyframe)
        self._decoder = Decoder(limits=limits, matcher=matcher, name=self._reader.name, enhanced=wanted)

    @property
    def views(self) -> frozenset[Position]:
        """The enhanced views that it decodes."""
        return self._decoder.enhancing

    def want(self, views: frozenset[Position]) -> None:
        """Decode these enhanced views from the next keyframe on."""
        self._decoder.enhanced = views

    def advance(self) -> DecodedSet:
        """Decode one frame set.

        Raises:
            StreamError: it is damaged or missing.
        """
        done: list[DecodedSet] = []
        wanted = None
        for number, packet in self._packets:
            # A file without an index is read from its front; what lies before the keyframe is skipped.
            if number < self.next:
                continue
            if number == self.next:
                wanted = packet.index
            # A frame set that lacks a camera comes out with the first packet of the next.
            done = self._decoder.push(packet)
            if done:
                break
        else:
            done = self._decoder.flush()
        if done and done[0].index == wanted:
            self.next += 1
            return done[0]
        raise StreamError(self._reader.name, f"no frame set {self.next}", "one, as the index says")

    def close(self) -> None:
        self._decoder.flush()
        self._reader.close()
