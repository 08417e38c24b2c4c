"""Frame sets from live cameras: pictures that were taken at one time, as they come."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, pairwise, product
from statistics import median

from av.video.reformatter import VideoReformatter

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.capture.live_camera import LiveCamera, LivePicture
from mvcodec.capture.live_clock import SharedShifts
from mvcodec.capture.pairing import NEAREST_SHARE
from mvcodec.capture.reading import views_in_pictures
from mvcodec.capture.recorded_calibration import RecordedCamera
from mvcodec.capture.selection import read_views, real_cameras, select_real
from mvcodec.capture.split import cut_out, view_size
from mvcodec.capture.timing import nominal_fps, tolerance
from mvcodec.capture.video_input import frame_to_rgb
from mvcodec.container.recorded_pictures import Clock
from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.frames import FrameSet, Picture
from mvcodec.settings import check_settings, setting

SETTLE_S = 0.7
"""How long every camera is listened to before its clock is believed."""

_POLL_S = 0.1

_Found = tuple[int, dict[Position, Picture]]


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """How live cameras are read.

    Attributes:
        addresses: of all cameras of the grid, or of every `split` views, row by row.
        grid: (rows, cols).
        real, fps, tolerance_ms, patience_s: explained by their fields.
        calibration: of all cameras; None: nominal.
        clock: the senders' stamps, or arrival; None: stamps where they seem to be of one clock.
        offsets_ms: what is added to the times of an address.
        others: views beside the real cameras whose pictures are read too, in every frame set; None: all.

    Raises:
        SettingError: the grid doesn't fit, or a number is out of range.
    """

    addresses: Sequence[str]
    grid: tuple[int, int]
    real: str = real_cameras()
    fps: float | None = nominal_fps()
    tolerance_ms: float | None = tolerance()
    calibration: Calibration | None = None
    clock: Clock | None = None
    offsets_ms: Mapping[str, float] = field(default_factory=dict)
    patience_s: float = setting(
        10.0,
        "how long nothing may come from live cameras before the input counts as ended, seconds; until then"
        " they are opened again",
        low=0.001,
        high=86_400,
    )
    split: tuple[int, int] = views_in_pictures((1, 1))
    others: Collection[Position] | None = ()

    def __post_init__(self) -> None:
        (rows, cols), (down, across) = self.grid, self.split
        if len(self.addresses) * down * across != rows * cols or rows % down or cols % across:
            each = f" of {down}x{across} views each" * (self.split != (1, 1))
            raise SettingError("grid", f"{rows}x{cols}", f"a grid of {len(self.addresses)} cameras{each}")
        if len(set(self.addresses)) != len(self.addresses):
            raise SettingError("INPUT", "an address twice", "each camera once")
        check_settings(self)
        for address in self.offsets_ms:
            if address not in self.addresses:
                raise SettingError(
                    "offsets_ms", f"{address} (no such camera)", f"one of {self.addresses[0]}, ..."
                )


class LiveCameras:
    """Opens the cameras and puts their pictures together. Close it, or the cameras go on.

    Attributes:
        name: for messages.
        array: geometry, known from the first frame set.
        calibration_note: why the calibration is nominal; empty where it is not.
        cameras: what the input itself says of their lenses, as `Recording` has it: nothing.

    Raises:
        InputError: nothing comes from a camera, or pictures differ in size.
        SettingError: `real` doesn't fit the grid.
    """

    def __init__(self, settings: LiveSettings) -> None:
        self._settings = settings
        addresses = settings.addresses
        self.name = addresses[0] if len(addresses) == 1 else f"{addresses[0]} ... {addresses[-1]}"
        self._views = read_views(settings.real, settings.grid, settings.others)
        (down, across), cols = settings.split, settings.grid[1] // settings.split[1]
        self._changed = threading.Condition()
        self._cameras = {
            (row, col): LiveCamera(addresses[row * cols + col], self._changed, settings.patience_s)
            for row, col in sorted({(row // down, col // across) for row, col in self._views})
        }
        self._shifts = SharedShifts(settings.clock)
        self._senders = {position: number for number, position in enumerate(self._cameras)}
        self._connections: dict[Position, int] = {}
        self._step_ns = 0
        self._told = self._told_drift = False
        self._dropped = 0
        self._last_ns: int | None = None
        self._reformatter = VideoReformatter()
        self._sets = self._matched()
        self.cameras: dict[Position, RecordedCamera] = {}
        self.calibration_note = "" if settings.calibration else "no calibration given"
        for camera in self._cameras.values():
            camera.start()
        try:
            self._first = next(self._sets, None)
            if self._first is None:
                raise self._silent()
            self.array = self._make_array(self._first[1])
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let go of the cameras."""
        for camera in self._cameras.values():
            camera.stop()

    def frame_sets(self) -> Iterator[FrameSet]:
        """Frame sets as they come, numbered from 0, until nothing comes any more."""
        assert self._first is not None
        down, across = self._settings.split
        width, height = self.array.width, self.array.height
        size = (down * height, across * width, 3)
        for index, (time_ns, pictures) in enumerate(chain([self._first], self._sets)):
            for position, picture in pictures.items():
                if picture.shape != size:
                    found = f"a picture of {picture.shape[1]}x{picture.shape[0]} px"
                    raise InputError(self._cameras[position].address, found, f"{size[1]}x{size[0]} px")
            views = {
                (row * down + inner_row, col * across + inner_col): cut_out(
                    picture, inner_row, inner_col, (width, height)
                )
                for (row, col), picture in pictures.items()
                for inner_row, inner_col in product(range(down), range(across))
            }
            yield FrameSet(index, time_ns, {place: views[place] for place in sorted(self._views)})
        left_out = sum(camera.left_out for camera in self._cameras.values())
        self._warn(f"nothing came for {self._settings.patience_s:g} s: taken as the end")
        if left_out or self._dropped:
            self._warn(
                f"{left_out} pictures were not whole or came too late, {self._dropped} had no counterpart"
            )

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self.name}: {text}", MvCodecWarning, stacklevel=3)

    def _hopeless(self) -> bool:
        return any(camera.hopeless for camera in self._cameras.values())

    def _silent(self) -> InputError:
        for camera in self._cameras.values():
            if camera.hopeless:
                found = f"an address that this FFmpeg cannot open ({camera.problem})"
                return InputError(camera.address, found, "another one, or a PyAV that is built with it")
        for camera in self._cameras.values():
            if not camera.waiting:
                why = f" ({camera.problem})" if camera.problem else ""
                found = f"no whole picture for {self._settings.patience_s:g} s{why}"
                return InputError(camera.address, found, "a camera that sends")
        return InputError(self.name, "no pictures that were taken at one time", "one frame set at least")

    def _make_array(self, pictures: Mapping[Position, Picture]) -> CameraArray:
        rows, cols = self._settings.grid
        real_rows, real_cols = select_real(self._settings.real, rows, cols)
        height, width = next(iter(pictures.values())).shape[:2]
        width, height = view_size((width, height), *self._settings.split, self.name)
        return CameraArray(
            rows=rows,
            cols=cols,
            width=width,
            height=height,
            fps=self._settings.fps or round(1e9 / self._step_ns, 3),
            real_rows=real_rows,
            real_cols=real_cols,
            calibration=self._settings.calibration or Calibration.nominal(width, height),
            name=self.name,
        )

    def _matched(self) -> Iterator[_Found]:
        """(time, pictures) of whole frame sets, until nothing comes for too long."""
        last_s = time.monotonic()
        while time.monotonic() - last_s < self._settings.patience_s and not self._hopeless():
            with self._changed:
                heads = self._heads()
                if heads is None:
                    self._changed.wait(_POLL_S)
                    continue
            time_ns = self._time(next(iter(heads)), next(iter(heads.values())))
            if self._last_ns is not None and time_ns <= self._last_ns:
                self._dropped += len(heads)
                continue
            self._last_ns = time_ns
            yield time_ns, {p: frame_to_rgb(head.frame, self._reformatter) for p, head in heads.items()}
            last_s = time.monotonic()

    def _heads(self) -> dict[Position, LivePicture] | None:
        """The oldest pictures that belong together, taken out; None where there are none yet."""
        if not self._settled():
            return None
        tolerance_ns = NEAREST_SHARE * self._step_ns
        if self._settings.tolerance_ms is not None:
            tolerance_ns = self._settings.tolerance_ms * 1e6
        queues = {position: camera.waiting for position, camera in self._cameras.items()}
        while all(queues.values()):
            times = {position: self._time(position, queue[0]) for position, queue in queues.items()}
            old = [p for p, time_ns in times.items() if time_ns < max(times.values()) - tolerance_ns]
            if not old:
                return {position: queue.popleft() for position, queue in queues.items()}
            for position in old:
                queues[position].popleft()
                self._dropped += 1
        return None

    def _settled(self) -> bool:
        """Whether the clocks of all connections are known."""
        now = {position: camera.connection for position, camera in self._cameras.items()}
        if now == self._connections:
            self._follow_clocks()
            return True
        for camera in self._cameras.values():
            if camera.clock.shift_ns is None or time.monotonic() - camera.clock.began_s < SETTLE_S:
                return False
            while camera.waiting and camera.waiting[0].connection != camera.connection:
                camera.waiting.popleft()
        steps = [
            int(median(b.stamp_ns - a.stamp_ns for a, b in pairwise(camera.waiting)))
            for camera in self._cameras.values()
            if len(camera.waiting) > 1
        ]
        if len(steps) < len(self._cameras) or min(steps) <= 0:
            return False
        self._step_ns = min(steps)
        self._connections = now
        self._set_shifts()
        return True

    def _set_shifts(self) -> None:
        found = [camera.clock.shift_ns or 0 for camera in self._cameras.values()]
        self._shifts.begin(found)
        gap = max(found) - min(found)
        if self._settings.clock is None and gap > 2 * self._step_ns and not self._told:
            self._told = True
            how = (
                "their stamps; `clock` log takes" if self._shifts.by_stamp else "arrival; `clock` stamp takes"
            )
            self._warn(
                f"the clocks of its cameras are {gap / 1e9:.3f} s apart, by when pictures arrive: paired by"
                f" {how} the other"
            )

    def _follow_clocks(self) -> None:
        self._shifts.follow([camera.clock.shift_ns or 0 for camera in self._cameras.values()])
        drift = self._shifts.drift_ns()
        if self._shifts.by_stamp and drift > self._step_ns and not self._told_drift:
            self._told_drift = True
            self._warn(
                f"the clocks of its cameras went {drift / 1e6:.4g} ms apart since the start, by when pictures"
                " arrive; `clock` log follows that"
            )

    def _time(self, position: Position, picture: LivePicture) -> int:
        offset_ms = self._settings.offsets_ms.get(self._cameras[position].address, 0.0)
        shift = self._shifts.of(self._senders[position])
        return picture.stamp_ns + shift + round(offset_ms * 1e6)
