"""One clock for the views of an array: when each picture was taken, and which belong together."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mvcodec.array import Position
from mvcodec.capture.pairing import Pairing, pair_pictures
from mvcodec.capture.sync_views import synchronised
from mvcodec.capture.timing import Timing, rate_of_times
from mvcodec.capture.view_array import ViewReader
from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.stream import view_name

_FPS_SHARE = 1e-3
"""How far a stated rate may be from that of the files before it is told."""


@dataclass(frozen=True, slots=True)
class StatedTimes:
    """What a manifest says of time.

    Attributes:
        source: the manifest, for messages; None where there is none.
        fps: pictures a second; None where it says nothing.
        times_ns: of the pictures of single views, ascending.
        first_frame: index in the original of picture 0, where its files have no times.
    """

    source: Path | None = None
    fps: float | None = None
    times_ns: Mapping[Position, tuple[int, ...]] | None = None
    first_frame: int = 0


def common_times(
    name: str,
    views: Mapping[Position, ViewReader],
    stated: StatedTimes,
    timing: Timing,
    default_fps: float | None,
    deciding: Collection[Position],
) -> tuple[float, Pairing]:
    """Frame rate, and the pictures that belong together; what is left out or guessed is a warning.

    Times of single pictures in the manifest come first, then those of the files, then the frame rate:
    the user's, the manifest's, what a video without times says of itself, the default.

    Args:
        name: the input, for messages.
        default_fps: of picture files whose rate nobody states; None: that is an error.
        deciding: the views whose times count; the others have no place in the pairing.

    Raises:
        SettingError: an offset for a camera that is not there.
        InputError: no frame rate, or no picture of all cameras at one time.
    """
    offsets = _offsets_ns(views, timing, deciding)
    given = _checked(stated, views)
    views = {view: reader for view, reader in views.items() if view in deciding}
    given = {view: times for view, times in given.items() if view in deciding}
    known = {view: stamps for view, reader in views.items() if (stamps := given.get(view) or reader.times_ns)}
    fps = timing.fps or _rate(name, views, known, given, stated, default_fps)
    times: dict[Position, Sequence[int]] = {}
    for view, reader in views.items():
        own = known.get(view)
        if own is None:
            begin = stated.first_frame + reader.early
            own = tuple(round((begin + n) * 1e9 / fps) for n in range(reader.count))
        shift = offsets.get(view, 0)
        times[view] = tuple(time + shift for time in own) if shift else own
    if timing.sync is not None and len(views) > 1:
        for view, shift in synchronised(views, times, _labels(views), timing.sync).items():
            if view not in offsets:
                times[view] = tuple(time + shift for time in times[view])
    pairing = pair_pictures(times, _labels(views), timing.tolerance_ms)
    if not pairing.times_ns:
        raise InputError(name, f"no pictures of all cameras at one time ({'; '.join(pairing.notes)})", "some")
    for note in pairing.notes:
        _warn(f"{name}: {note}")
    begin = pairing.times_ns[0]
    if begin < 0:
        pairing = replace(pairing, times_ns=tuple(time - begin for time in pairing.times_ns))
    return fps, pairing


def _checked(stated: StatedTimes, views: Mapping[Position, ViewReader]) -> dict[Position, tuple[int, ...]]:
    given = dict(stated.times_ns or {})
    for view, times in given.items():
        if len(times) != views[view].count:
            found = f"{len(times)} times_ns of view {view_name(view)}"
            raise InputError(str(stated.source), found, f"{views[view].count}, one for each of its pictures")
    return given


def _rate(
    name: str,
    views: Mapping[Position, ViewReader],
    known: Mapping[Position, Sequence[int]],
    given: Mapping[Position, Sequence[int]],
    stated: StatedTimes,
    default_fps: float | None,
) -> float:
    videos = {view: reader for view, reader in views.items() if reader.fps > 0}
    timed = [reader.fps for view, reader in videos.items() if view in known and view not in given]
    if timed:
        # The slowest camera decides how many frame sets there are.
        fps = min(timed)
        if stated.fps is not None and abs(stated.fps - fps) > _FPS_SHARE * fps:
            _warn(
                f"{stated.source}: fps = {stated.fps:g}, but its video files have {fps:g}: their times count"
            )
        return fps
    if stated.fps is not None:
        return stated.fps
    if given and (rate := min(filter(None, map(rate_of_times, given.values())), default=None)):
        return rate
    guessed = [reader for view, reader in videos.items() if view not in known]
    if guessed:
        fps = guessed[0].fps
        _warn(f"{name}: its video files have no times; {fps:g} fps are guessed. `fps` N says what is right")
        return fps
    if default_fps is None:
        raise InputError(name, "no frame rate", "`fps` N")
    return default_fps


def _offsets_ns(
    views: Mapping[Position, ViewReader], timing: Timing, deciding: Collection[Position]
) -> dict[Position, int]:
    found: dict[Position, int] = {}
    for camera, offset_ms in timing.offsets_ms.items():
        named = [view for view, reader in views.items() if camera in _names(view, reader)]
        if len(named) != 1:
            choices = ", ".join(list(_labels(views).values())[:4])
            what = "no such camera" if not named else f"{len(named)} cameras of that name"
            raise SettingError("offsets_ms", f"{camera} ({what})", f"CAMERA=MS, CAMERA one of {choices} ...")
        if named[0] not in deciding:
            real = ", ".join(view_name(view) for view in sorted(deciding)[:4])
            raise SettingError(
                "offsets_ms", f"{camera} (a virtual view, not read)", f"a real one: {real} ..."
            )
        found[named[0]] = round(offset_ms * 1e6)
    return found


def _names(view: Position, reader: ViewReader) -> set[str]:
    return {view_name(view), str(reader.path), reader.path.name, reader.path.stem}


def _labels(views: Mapping[Position, ViewReader]) -> dict[Position, str]:
    """What to call the views: their files' names where these differ, else their places."""
    names = {view: reader.path.name for view, reader in views.items() if reader.fps > 0}
    if len(set(names.values())) == len(views):
        return names
    return {view: view_name(view) for view in views}


def _warn(text: str) -> None:
    warnings.warn(text, MvCodecWarning, stacklevel=4)
