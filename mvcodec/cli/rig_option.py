"""``--rig`` and ``--strict``: pictures rectified while they are coded, and what a look at them finds."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from mvcodec.array import CameraArray, Position
from mvcodec.capture import ArraySource
from mvcodec.capture.live_cameras import LiveCameras
from mvcodec.capture.recording import Recording
from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.frames import FrameSet, Picture
from mvcodec.rigs.delay import find_delays
from mvcodec.rigs.look import look_at
from mvcodec.rigs.remap import RectifiedSource, Rectifier
from mvcodec.rigs.remap import rectified as rectified_set
from mvcodec.rigs.rig import Rig, read_rig
from mvcodec.stream import view_name

AUTO, RECORDED = "auto", "recorded"


def add_rig(parser: argparse.ArgumentParser) -> None:
    """The options."""
    parser.add_argument(
        "--rig",
        metavar="RIG.json|auto|recorded",
        help="rectify the pictures: as `mvcodec rectify` found out, as the scene tells now, or as a"
        " recording's own calibrations say",
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help="stop where the first pictures are misaligned, or the cameras in another order",
    )


def rectified_source(
    source: ArraySource, chosen: range, arguments: argparse.Namespace
) -> tuple[ArraySource, FrameSet]:
    """The input itself, or rectified as ``--rig`` says; and its first frame set, which was looked at."""
    if arguments.rig is not None:
        tell_delays(source, chosen, arguments, strict=arguments.strict)
        if arguments.rig == AUTO:
            tell_order(source, chosen, strict=arguments.strict)
        source = RectifiedSource(source, Rectifier(_rig_of(source, chosen, arguments)))
    first = next(iter(source.frame_sets(slice(chosen.start, chosen.start + 1))))
    look(source.array, first.pictures, source.name, strict=arguments.strict)
    return source, first


def tell_order(source: ArraySource, chosen: range, *, strict: bool = False) -> None:
    """Warn of cameras in another order, upside down, mirrored or equal, which no calibration mends.

    Raises:
        InputError: there are, and `strict` is set.
    """
    array = source.array
    every = replace(array, real_rows=tuple(range(array.rows)), real_cols=tuple(range(array.cols)))
    first = next(iter(source.frame_sets(slice(chosen.start, chosen.start + 1), array.positions)))
    look(every, first.pictures, source.name, strict=strict, rectified=False)


def tell_delays(
    source: ArraySource, chosen: range, arguments: argparse.Namespace, *, strict: bool = False
) -> None:
    """Warn of cameras that are late, where nothing was asked about their time.

    Raises:
        InputError: one is, and `strict` is set.
    """
    if arguments.sync is not None or arguments.offset:
        return
    for delay in find_delays(source, chosen):
        size = "one frame" if abs(delay.frames) == 1 else f"{abs(delay.frames)} frames"
        word = "late" if delay.frames > 0 else "early"
        name = view_name(delay.camera)
        text = f"camera {name} is {size} {word} against the others"
        mends = f"--sync motion, or --offset {name}={delay.offset_ms:.1f}"
        if strict:
            raise InputError(source.name, text, f"cameras in step: {mends}")
        warnings.warn(f"{source.name}: {text}; what mends that: {mends}", MvCodecWarning, stacklevel=2)


def _rig_of(source: ArraySource, chosen: range, arguments: argparse.Namespace) -> Rig:
    if arguments.rig == RECORDED:
        raise SettingError("rig", RECORDED, f"{AUTO} or a RIG.json: {source.name} is no recording")
    if arguments.rig != AUTO:
        return read_rig(Path(arguments.rig))
    from mvcodec.rigs.calibration import calibrate_from_scene  # SciPy's optimisation takes long to load

    found = calibrate_from_scene(source, chosen)
    if not arguments.quiet and not arguments.json:
        print(f"{source.name}: {found.summary()}", file=sys.stderr)
    return found.rig


def look(
    array: CameraArray,
    pictures: Mapping[Position, Picture],
    name: str,
    *,
    strict: bool,
    rectified: bool = True,
) -> None:
    """Warn of what the pictures show to be wrong; see `look_at`.

    Raises:
        InputError: something is, and `strict` is set.
    """
    for concern in look_at(array, pictures, rectified=rectified):
        if strict:
            raise InputError(name, concern.text, "a rectified array in the order of its cameras")
        warnings.warn(f"{name}: {concern.text}", MvCodecWarning, stacklevel=2)


class RectifiedStream:
    """A recording whose frame sets are rectified as they come, if that is asked for; the first is looked at.

    Args:
        source: the recording.
        rectifier: of its rig; None leaves the pictures as they are.
        strict: as in `look`.
    """

    def __init__(self, source: Recording | LiveCameras, rectifier: Rectifier | None, *, strict: bool) -> None:
        self.name = source.name
        self.array = source.array if rectifier is None else rectifier.rig.array(source.array)
        self._source, self._rectifier, self._strict = source, rectifier, strict

    def frame_sets(self) -> Iterator[FrameSet]:
        """The frame sets.

        Raises:
            InputError: of the recording; or the first is wrong and that is an error.
        """
        for number, frame_set in enumerate(self._source.frame_sets()):
            straight = frame_set if self._rectifier is None else rectified_set(frame_set, self._rectifier)
            if not number:
                look(self.array, straight.pictures, self.name, strict=self._strict)
            yield straight


def rectified_stream(source: Recording | LiveCameras, arguments: argparse.Namespace) -> RectifiedStream:
    """A recording, rectified as ``--rig`` says.

    Raises:
        SettingError: ``auto``, which would have to look ahead.
    """
    rig = None
    if arguments.rig == AUTO:
        raise SettingError(
            "rig", AUTO, f"{RECORDED} or a RIG.json: a recording is read once, from front to back"
        )
    if arguments.rig == RECORDED:
        from mvcodec.rigs.recorded import recorded_rig

        rig = recorded_rig(source.array, source.cameras, source.name)
    elif arguments.rig is not None:
        rig = read_rig(Path(arguments.rig))
    elif any(not camera.is_straight for camera in source.cameras.values()):
        bent = next(camera.frame for camera in source.cameras.values() if not camera.is_straight)
        text = (
            f"{source.name}: the calibration of frame {bent!r} has lens distortion (D) or is turned (R); its"
            f" pictures are taken as rectified already. If they are not: --rig {RECORDED}"
        )
        warnings.warn(text, MvCodecWarning, stacklevel=2)
    return RectifiedStream(source, None if rig is None else Rectifier(rig), strict=arguments.strict)
