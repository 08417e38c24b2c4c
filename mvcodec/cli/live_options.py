"""Live cameras as the input of ``encode``."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from mvcodec.capture.live_address import is_live_address
from mvcodec.capture.live_cameras import LiveCameras, LiveSettings
from mvcodec.capture.manifest import read_calibration
from mvcodec.cli.paths import local_path
from mvcodec.cli.setting_options import add_setting
from mvcodec.cli.time_options import timing_of
from mvcodec.errors import SettingError
from mvcodec.settings import settings_of


def input_or_camera(text: str) -> Path | str:
    """A path, or the address of a live camera as it stands."""
    return text if is_live_address(text) else local_path(text)


def is_live(arguments: argparse.Namespace) -> bool:
    """Whether the input is live cameras.

    Raises:
        SettingError: some are, and some are not.
    """
    live = [isinstance(name, str) for name in arguments.input]
    if any(live) and not all(live):
        raise SettingError("INPUT", "live cameras and files", "one or the other")
    return all(live)


def add_patience(group: argparse._ArgumentGroup) -> None:
    """``--patience``."""
    usual = settings_of(LiveSettings)["patience_s"].default
    add_setting(group, LiveSettings, "patience_s", metavar="S", left_open=True, note=f" (default: {usual:g})")


@contextmanager
def live_cameras(arguments: argparse.Namespace) -> Iterator[LiveCameras]:
    """The opened cameras.

    Raises:
        SettingError: options that don't fit them.
        InputError: nothing comes.
    """
    for option in ("topics", "depth_topics", "bits", "gaps", "sync"):
        if getattr(arguments, option) is not None:
            raise SettingError(option, "with live cameras", "no such option")
    count = len(arguments.input)
    if arguments.grid is None and count > 1:
        raise SettingError("--grid", "nothing", f"RxC of {count} cameras in row order")
    split = arguments.split or (1, 1)
    timing = timing_of(arguments)
    patience = {} if arguments.patience_s is None else {"patience_s": arguments.patience_s}
    settings = LiveSettings(
        addresses=tuple(arguments.input),
        grid=arguments.grid or split,
        real=arguments.real,
        fps=timing.fps,
        tolerance_ms=timing.tolerance_ms,
        calibration=None if arguments.calibration is None else read_calibration(arguments.calibration),
        clock=arguments.clock,
        offsets_ms=timing.offsets_ms,
        split=split,
        others=() if arguments.enhance is None else arguments.enhance_views,
        **patience,
    )
    with closing(LiveCameras(settings)) as cameras:
        yield cameras
