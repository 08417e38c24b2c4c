"""Frame sets out of an MCAP recording or stream: pictures of several topics, matched by their time."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import BinaryIO

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.capture.picture_messages import PictureDecoder
from mvcodec.capture.recorded_calibration import NotRectified, array_calibration
from mvcodec.capture.selection import select_real
from mvcodec.container.chunks import OnDamage
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.recorded_pictures import RecordedPicture, RecordingReader
from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.frames import FrameSet, Picture
from mvcodec.workers import run_all

MAX_WAITING = 64
"""Coded pictures of a camera that may wait for the other cameras'."""

MAX_WAITING_BYTES = 1 << 28
"""The same for all cameras together."""

TOLERANCE_SHARE = 0.25
"""Of the time from frame to frame: how far apart pictures of one frame set may be taken by default."""

_FIRST_TOLERANCE_NS = 8_000_000
"""Default tolerance before the frame rate is known."""

_TOLD = 5
"""Dropped frames that are told one by one; the rest are counted."""

TopicGrid = tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class RecordingSettings:
    """How a recording is read.

    Attributes:
        topics: of every view of the grid, row by row.
        real: which cameras are real, as `--real` has it.
        fps: nominal frame rate; None: from the recording's times.
        tolerance_ms: how far apart the pictures of one frame set may be taken; None: a quarter of
            the time from frame to frame.
        calibration: of all cameras; None: the recording's own, or nominal.

    Raises:
        SettingError: the grid is not one, names a topic twice, or a number is out of range.
    """

    topics: TopicGrid
    real: str = "corners"
    fps: float | None = None
    tolerance_ms: float | None = None
    calibration: Calibration | None = None

    def __post_init__(self) -> None:
        widths = {len(row) for row in self.topics}
        names = list(chain.from_iterable(self.topics))
        if len(widths) != 1 or not names or not all(names):
            raise SettingError("--topics", f"rows of {sorted(widths)} topics", "rows of one length")
        if len(set(names)) != len(names):
            raise SettingError("--topics", "a topic twice", "each topic once")
        if self.fps is not None and not 0 < self.fps <= 1000:
            raise SettingError("--fps", self.fps, "more than 0, at most 1000")
        if self.tolerance_ms is not None and not 0 <= self.tolerance_ms <= 10_000:
            raise SettingError("--tolerance-ms", self.tolerance_ms, "0..10000 ms")

    @property
    def grid(self) -> tuple[int, int]:
        """(rows, cols)."""
        return len(self.topics), len(self.topics[0])


class Recording:
    """Reads frame sets once, from front to back; each comes as soon as its last picture is read.

    Args:
        file: binary input, which may be a pipe.
        name: what to call it in messages.
        settings: topics and times.
        limits: what is more than that is refused.
        on_damage: told of damage, behind which reading goes on; None raises it.

    Attributes:
        array: geometry, known from the first frame set and what was recorded of the cameras up to then.
        calibration_note: why the calibration is nominal; empty where it is not.

    Raises:
        InputError: no frame set, or pictures that are damaged or of different sizes.
        StreamError: not MCAP, or damaged.
        SettingError: `real` doesn't fit the grid.
    """

    def __init__(
        self,
        file: BinaryIO,
        name: str,
        settings: RecordingSettings,
        limits: Limits = DEFAULT_LIMITS,
        on_damage: OnDamage | None = None,
    ) -> None:
        self.name = name
        self._settings = settings
        rows, cols = settings.grid
        self._axes = select_real(settings.real, rows, cols)
        self._topics = {
            settings.topics[row][col]: (row, col) for row in self._axes[0] for col in self._axes[1]
        }
        self._reader = RecordingReader(file, name, list(self._topics), limits, on_damage)
        self._queues: dict[Position, deque[RecordedPicture]] = {p: deque() for p in self._topics.values()}
        self._decoders = {position: PictureDecoder(name) for position in self._queues}
        self._fps = settings.fps or self._reader.fps
        self._tolerance_ns = self._find_tolerance()
        self._last_ns: int | None = None
        self._dropped = 0
        self._sets = self._matched()
        self._frames: dict[Position, str] = {}
        self.calibration_note = ""
        self._first = self._read_first()
        self.array = self._make_array(self._first[0])
        self._reader.rig = None

    @property
    def dropped(self) -> int:
        """Pictures left out so far, since a camera's counterpart was missing."""
        return self._dropped

    def frame_sets(self) -> Iterator[FrameSet]:
        """Frame sets in order, numbered from 0; a warning at the end counts what was dropped."""
        size = (self.array.height, self.array.width, 3)
        for index, (time_ns, pictures) in enumerate(chain(self._first, self._sets)):
            for camera, picture in pictures.items():
                if picture.shape != size:
                    found = f"a picture of {picture.shape[1]}x{picture.shape[0]} px"
                    topic = self._settings.topics[camera[0]][camera[1]]
                    label = f"{self.name}: {topic} at {time_ns / 1e9:.3f} s"
                    raise InputError(label, found, f"{size[1]}x{size[0]} px as in the first frame set")
            yield FrameSet(index, time_ns, pictures)
        if self._reader.cut_off and self._last_ns is not None:
            self._warn(f"cut off after {self._last_ns / 1e9:.3f} s")
        if self._dropped > _TOLD:
            self._warn(f"{self._dropped} pictures were dropped in all")

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self.name}: {text}", MvCodecWarning, stacklevel=3)

    def _read_first(self) -> list[tuple[int, dict[Position, Picture]]]:
        """The first frame set, and the second where only that tells the frame rate."""
        first = []
        for found in self._sets:
            first.append(found)
            if self._fps is not None:
                break
            if len(first) == 2:
                self._fps = round(1e9 / (first[1][0] - first[0][0]), 3)
                self._tolerance_ns = self._find_tolerance()
                break
        if not first:
            raise InputError(self.name, "no frame set of all cameras", "one at least")
        return first

    def _find_tolerance(self) -> int:
        if self._settings.tolerance_ms is not None:
            return round(self._settings.tolerance_ms * 1e6)
        return _FIRST_TOLERANCE_NS if self._fps is None else round(TOLERANCE_SHARE * 1e9 / self._fps)

    def _make_array(self, first: tuple[int, dict[Position, Picture]]) -> CameraArray:
        rows, cols = self._settings.grid
        height, width = next(iter(first[1].values())).shape[:2]
        calibration, rho = self._calibration(width, height)
        return CameraArray(
            rows=rows,
            cols=cols,
            width=width,
            height=height,
            fps=self._fps or 1.0,
            real_rows=self._axes[0],
            real_cols=self._axes[1],
            calibration=calibration,
            rho=rho,
            name=self.name,
        )

    def _calibration(self, width: int, height: int) -> tuple[Calibration, float]:
        """The calibration that was asked for, the recording's own, or the nominal one; and rho."""
        if self._settings.calibration is not None:
            return self._settings.calibration, 1.0
        self.calibration_note = "no calibration given"
        try:
            assert self._reader.rig is not None
            found = array_calibration(self._reader.rig, self._frames, (width, height))
        except NotRectified as reason:
            self.calibration_note = f"its calibration is not that of a rectified array ({reason})"
            found = None
        if found is None:
            return Calibration.nominal(width, height), 1.0
        self.calibration_note = ""
        return found

    def _matched(self) -> Iterator[tuple[int, dict[Position, Picture]]]:
        """(time of the first camera, pictures) of every frame set that is whole."""
        latest_ns: dict[Position, int] = {}
        for message in self._reader.pictures():
            camera = self._topics[message.topic]
            if message.time_ns <= latest_ns.get(camera, -1):
                self._drop(camera, message, "its time is not after the one before")
                continue
            latest_ns[camera] = message.time_ns
            self._frames.setdefault(camera, message.frame_id)
            queue = self._queues[camera]
            queue.append(message)
            if len(queue) > MAX_WAITING or (len(queue) > 1 and self._waiting_bytes() > MAX_WAITING_BYTES):
                self._drop(camera, queue.popleft(), "the other cameras have none")
            while all(self._queues.values()):
                if (found := self._match()) is not None:
                    yield found
        for position, queue in self._queues.items():
            while queue:
                self._drop(position, queue.popleft(), "the other cameras have none")

    def _waiting_bytes(self) -> int:
        return sum(len(message.data) for queue in self._queues.values() for message in queue)

    def _match(self) -> tuple[int, dict[Position, Picture]] | None:
        """Take the heads of the queues where they belong together; else drop those that are too old."""
        latest_ns = max(queue[0].time_ns for queue in self._queues.values())
        old = [p for p, queue in self._queues.items() if queue[0].time_ns < latest_ns - self._tolerance_ns]
        if old:
            for position in old:
                self._drop(position, self._queues[position].popleft(), "another camera has none")
            return None
        heads = {position: queue.popleft() for position, queue in self._queues.items()}
        time_ns = next(iter(heads.values())).time_ns
        pictures = dict(zip(heads, run_all(self._decode, heads, heads.values()), strict=True))
        missing = [position for position, picture in pictures.items() if picture is None]
        if missing or (self._last_ns is not None and time_ns <= self._last_ns):
            self._tell(
                heads[missing[0] if missing else next(iter(heads))], "a video before its first keyframe"
            )
            return None
        self._last_ns = time_ns
        return time_ns, {position: picture for position, picture in pictures.items() if picture is not None}

    def _decode(self, position: Position, message: RecordedPicture) -> Picture | None:
        return self._decoders[position].push(message)

    def _drop(self, position: Position, message: RecordedPicture, why: str) -> None:
        if message.schema == "foxglove.CompressedVideo":
            self._decode(position, message)  # later pictures build on it
        self._tell(message, why)

    def _tell(self, message: RecordedPicture, why: str) -> None:
        self._dropped += 1
        if self._dropped <= _TOLD:
            self._warn(f"{message.label}: dropped, {why}")
