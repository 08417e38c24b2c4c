"""Frame sets out of an MCAP recording or stream: pictures of several topics, matched by their time."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, product
from typing import BinaryIO

import numpy as np

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.capture.bit_depth import BitDepth
from mvcodec.capture.given_maps import check_map_size, disparity_of_depth
from mvcodec.capture.message_clock import MessageClock
from mvcodec.capture.pairing import NEAREST_SHARE, TOLD_SHARE, typical_step_ns
from mvcodec.capture.picture_messages import StillDecoder
from mvcodec.capture.recorded_calibration import NotRectified, array_calibration, recorded_cameras
from mvcodec.capture.recorded_maps import DepthDecoder, Depths
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.capture.selection import select_real
from mvcodec.capture.split import cut_out, view_size
from mvcodec.capture.timing import rate_of_times
from mvcodec.capture.topic_pictures import NOT_AFTER, TopicPictures, WaitingPicture
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.recorded_pictures import RecordedPicture, RecordingReader
from mvcodec.container.recorded_rig import RecordedRig
from mvcodec.errors import InputError, MvCodecWarning
from mvcodec.frames import DisparityMap, FrameSet, Picture
from mvcodec.workers import run_all

MAX_WAITING = 512
"""Pictures of a camera that may wait for the other cameras'."""

MAX_WAITING_BYTES = 1 << 28
"""The same for all cameras together."""

_FIRST_TOLERANCE_NS = 8_000_000
"""Default tolerance before the frame rate is known."""

_TOLD = 5
"""Dropped frames that are told one by one; the rest are counted."""

_Found = tuple[int, dict[Position, Picture | Depths]]
"""Time, pictures by grid place; depth stands below the grid, as if that had as many rows more."""


class Recording:
    """Reads frame sets once, from front to back; each comes as soon as its last picture is read.

    Args:
        files: binary inputs, which may be pipes; several are parts of one recording.
        name: what to call them in messages.
        settings: topics and times.
        limits: what is more than that is refused.
        on_damage: told of damage and of unreadable pictures, behind which reading goes on; None raises it.

    Attributes:
        array: geometry, known from the first frame set and what was recorded of the cameras up to then.
        calibration_note: why the calibration is nominal; empty where it is not.
        cameras: what was recorded of the cameras' lenses; empty where that is not all of them.

    Raises:
        InputError: no frame set, or pictures that are damaged or of different sizes.
        StreamError: not MCAP, or damaged.
        SettingError: `real` or an offset doesn't fit the grid.
    """

    def __init__(
        self,
        files: BinaryIO | Sequence[BinaryIO],
        name: str,
        settings: RecordingSettings,
        limits: Limits = DEFAULT_LIMITS,
        on_damage: Callable[[InputError], None] | None = None,
    ) -> None:
        self.name = name
        self._settings, self._on_damage = settings, on_damage
        self._topics = settings.read_topics()
        rows, real = len(settings.topics), set(product(*select_real(settings.real, *settings.grid)))
        for row, names in enumerate(settings.depth_topics or ()):
            self._topics |= {name: (rows + row, col) for col, name in enumerate(names) if (row, col) in real}
        self._names = {position: topic for topic, position in self._topics.items()}
        parts = files if isinstance(files, Sequence) else [files]
        self._reader = RecordingReader(parts, name, list(self._topics), settings.clock, limits, on_damage)
        for note in self._reader.notes:
            self._warn(note)
        self._clock = MessageClock(name, settings.clock)
        self._depth = BitDepth(name, settings.bits)
        offsets = settings.offsets_ns(list(self._topics))
        self._pictures = {
            position: TopicPictures(
                name,
                self._clock,
                offsets.get(topic, 0),
                StillDecoder(name, self._depth) if position[0] < rows else DepthDecoder(name),
                self._reader.indexed,
                self._tell,
                settings.gaps,
            )
            for topic, position in self._topics.items()
        }
        self._queues: dict[Position, deque[WaitingPicture]] = {p: deque() for p in self._topics.values()}
        self._known_step_ns = min(
            filter(None, map(typical_step_ns, self._reader.log_times.values())), default=None
        )
        self._last_ns: int | None = None
        self._dropped = self._told = self._repeated = self._count = 0
        self._apart = dict.fromkeys(self._queues, (0, 0))
        self._checked_apart = False
        self._frames: dict[Position, str] = {}
        self._sets = self._matched()
        self.calibration_note = ""
        self._first = self._read_first()
        self.array = self._make_array(self._first[0])
        rig = self._reader.rig if settings.split == (1, 1) else None
        self.cameras = recorded_cameras(rig or RecordedRig(), self._frames)
        self._reader.rig = None
        if settings.depth_topics is not None and not self.array.calibration.given:
            raise InputError(
                name, "depth without calibration", "`calibration` FILE, which makes it disparity"
            )

    @property
    def dropped(self) -> int:
        """Pictures left out so far, since they were not whole or a counterpart was missing."""
        return self._dropped

    def frame_sets(self) -> Iterator[FrameSet]:
        """Frame sets in order, numbered from 0; warnings at the end count what was dropped."""
        for found in chain(self._first, self._sets):
            try:
                yield self._frame_set(*found)
            except InputError as error:
                self._tell_unreadable(error)
        self._tell_end()

    def _frame_set(self, time_ns: int, found: dict[Position, Picture | Depths]) -> FrameSet:
        array, rows, views = self.array, len(self._settings.topics), self._settings.views
        size, (down, across) = (array.width, array.height), self._settings.split
        pictures, given = dict[Position, Picture](), dict[Position, DisparityMap]()
        for (row, col), values in found.items():
            label = f"{self.name}: {self._names[row, col]} at {time_ns / 1e9:.3f} s"
            if row >= rows:
                depths = np.asarray(values, np.float32)
                check_map_size(depths, array, label)
                given[row - rows, col] = disparity_of_depth(depths, array)
                continue
            if values.shape != (array.height * down, array.width * across, 3):
                found_size = f"a picture of {values.shape[1]}x{values.shape[0]} px"
                expected = f"{array.width * across}x{array.height * down} px as in the first frame set"
                raise InputError(label, found_size, expected)
            for inner_row, inner_col in product(range(down), range(across)):
                if (place := (row * down + inner_row, col * across + inner_col)) in views:
                    pictures[place] = cut_out(np.asarray(values, np.uint8), inner_row, inner_col, size)
        self._count += 1
        return FrameSet(self._count - 1, time_ns, dict(sorted(pictures.items())), given)

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self.name}: {text}", MvCodecWarning, stacklevel=3)

    def _tell_end(self) -> None:
        if self._reader.cut_off and self._last_ns is not None:
            self._warn(f"cut off after {self._last_ns / 1e9:.3f} s")
        if self._dropped > _TOLD:
            self._warn(f"{self._dropped} pictures were dropped in all")
        if self._repeated > _TOLD * self._count and self._settings.clock == "stamp":
            self._warn("most of them have stamps that stand still; `clock` log takes when they were written")
        step = self._step_ns()
        for position, (low, high) in self._apart.items():
            if step and high - low <= TOLD_SHARE * step < max(-low, high):
                topic, first = self._names[position], next(iter(self._topics))
                middle = (low + high) / 2
                self._warn(
                    f"{topic} takes its pictures {abs(middle) / 1e6:.4g} ms"
                    f" {'after' if middle > 0 else 'before'} {first} all the time,"
                    f" {abs(middle) / step:.2f} of a frame: what moves is seen at two places"
                )

    def _read_first(self) -> list[_Found]:
        """The first frame set, and the second where only that tells the frame rate."""
        first = []
        for found in self._sets:
            first.append(found)
            known = self._reader.indexed and not self._reader.written_at_once
            if self._settings.fps is not None or known or len(first) == 2:
                break
        if not first:
            apart = self._clock.check_apart(list(self._topics), self._step_ns())
            why = " before it is cut off" * self._reader.cut_off + f": {apart}" * bool(apart)
            raise InputError(self.name, f"no frame set of all cameras{why}", "one at least")
        return first

    def _step_ns(self) -> int | None:
        """The shortest usual time from picture to picture of a camera."""
        return self._known_step_ns or self._clock.step_ns()

    def _tolerance_ns(self) -> int:
        if self._settings.tolerance_ms is not None:
            return round(self._settings.tolerance_ms * 1e6)
        step = self._step_ns()
        return _FIRST_TOLERANCE_NS if step is None else round(NEAREST_SHARE * step)

    def _fps(self) -> float:
        """The nominal rate: that of the topic with the fewest pictures, which pauses don't change."""
        rates = [rate for times in self._reader.log_times.values() if (rate := rate_of_times(times))]
        stated = self._settings.fps or min(rates, default=None)
        if stated is not None:
            return stated
        found = self._clock.slowest_fps()
        if self._reader.written_at_once:
            guess = f"{found:g} fps, by the first stamps, are" if found else "1 fps is"
            self._warn(
                f"its messages were all written down at one time: {guess} taken for its nominal rate;"
                " `fps` N says what is right"
            )
        return found or 1.0

    def _make_array(self, first: _Found) -> CameraArray:
        rows, cols = self._settings.grid
        height, width = next(iter(first[1].values())).shape[:2]
        width, height = view_size((width, height), *self._settings.split, self.name)
        axes = select_real(self._settings.real, rows, cols)
        calibration, rho = self._calibration(width, height)
        return CameraArray(
            rows=rows,
            cols=cols,
            width=width,
            height=height,
            fps=self._fps(),
            real_rows=axes[0],
            real_cols=axes[1],
            calibration=calibration,
            rho=rho,
            name=self.name,
        )

    def _calibration(self, width: int, height: int) -> tuple[Calibration, float]:
        """The calibration that was asked for, the recording's own, or the nominal one; and rho."""
        if self._settings.calibration is not None:
            return self._settings.calibration, 1.0
        self.calibration_note = "no calibration given"
        if self._settings.split != (1, 1):  # what is recorded of cameras does not say of which view
            return Calibration.nominal(width, height), 1.0
        try:
            assert self._reader.rig is not None
            frames = self._reader.rig.tell_apart(
                self._frames, {position: self._names[position] for position in self._frames}
            )
            found = array_calibration(self._reader.rig, frames, (width, height))
        except NotRectified as reason:
            self.calibration_note = f"its calibration is not that of a rectified array ({reason})"
            found = None
        if found is None:
            return Calibration.nominal(width, height), 1.0
        self.calibration_note = ""
        return found

    def _matched(self) -> Iterator[_Found]:
        """(time of the first camera, pictures) of every frame set that is whole."""
        for message in self._reader.pictures():
            camera = self._topics[message.topic]
            if camera[0] < len(self._settings.topics):
                self._frames.setdefault(camera, message.frame_id)
            try:
                self._wait(camera, self._pictures[camera].push(message))
            except InputError as error:
                self._tell_unreadable(error)
            yield from self._together()
        for camera, pictures in self._pictures.items():
            try:
                self._wait(camera, pictures.flush())
            except InputError as error:
                self._tell_unreadable(error)
        yield from self._together()
        for queue in self._queues.values():
            while queue:
                self._tell(queue.popleft().message, "the other cameras have none")

    def _wait(self, camera: Position, found: list[WaitingPicture]) -> None:
        queue = self._queues[camera]
        queue.extend(found)
        while len(queue) > MAX_WAITING or (len(queue) > 1 and self._waiting_bytes() > MAX_WAITING_BYTES):
            self._tell(queue.popleft().message, "the other cameras have none")

    def _waiting_bytes(self) -> int:
        return sum(picture.size for queue in self._queues.values() for picture in queue)

    def _together(self) -> Iterator[_Found]:
        while all(self._queues.values()):
            if (found := self._match()) is not None:
                yield found

    def _match(self) -> _Found | None:
        """Take the heads of the queues where they belong together; else drop those that are too old."""
        self._check_apart()
        latest_ns = max(queue[0].time_ns for queue in self._queues.values())
        tolerance_ns = self._tolerance_ns()
        old = [p for p, queue in self._queues.items() if queue[0].time_ns < latest_ns - tolerance_ns]
        for position in old:
            self._tell(self._queues[position].popleft().message, "another camera has none")
        if old:
            return None
        heads = {position: queue.popleft() for position, queue in self._queues.items()}
        time_ns = next(iter(heads.values())).time_ns
        if self._last_ns is None:
            for position, head in heads.items():
                self._pictures[position].stills.look(head.message)
        pictures = dict(zip(heads, run_all(self._decode, heads.values()), strict=True))
        whole = {position: picture for position, picture in pictures.items() if picture is not None}
        if len(whole) < len(heads):
            return None
        if self._last_ns is not None and time_ns <= self._last_ns:
            self._tell(next(iter(heads.values())).message, "its time is not after the one before")
            return None
        for position, head in heads.items():
            low, high = self._apart[position]
            apart = head.time_ns - time_ns
            self._apart[position] = (
                (apart, apart) if self._last_ns is None else (min(low, apart), max(high, apart))
            )
        self._last_ns = time_ns
        return time_ns, whole

    def _check_apart(self) -> None:
        if not self._checked_apart and self._step_ns() is not None:
            self._checked_apart = True
            if (apart := self._clock.check_apart(list(self._topics), self._step_ns())) is not None:
                self._warn(apart)

    def _decode(self, picture: WaitingPicture) -> Picture | Depths | None:
        try:
            return picture.decode()
        except InputError as error:
            self._tell_unreadable(error)
            return None

    def _tell_unreadable(self, error: InputError) -> None:
        if self._on_damage is None:
            raise error
        self._dropped += 1
        self._on_damage(error)

    def _tell(self, message: RecordedPicture, why: str) -> None:
        self._dropped += 1
        self._told += 1
        self._repeated += why == NOT_AFTER
        if self._told <= _TOLD:
            self._warn(f"{message.label}: dropped, {why}")
