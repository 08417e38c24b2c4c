"""``mvcodec encode`` of recordings and live streams, whose length nobody knows."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import BinaryIO

from mvcodec.array import CameraArray
from mvcodec.capture.live_cameras import LiveCameras
from mvcodec.capture.manifest import read_calibration
from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings, TopicGrid
from mvcodec.capture.sync_topics import with_offsets
from mvcodec.cli.arguments import OPTIONS, in_options
from mvcodec.cli.coding_options import INSIST
from mvcodec.cli.interrupt import deferred_interrupt
from mvcodec.cli.live_options import add_patience, is_live, live_cameras
from mvcodec.cli.live_view_option import live_view
from mvcodec.cli.picture_options import reading_of
from mvcodec.cli.progress import progress
from mvcodec.cli.rig_option import RectifiedStream, rectified_stream
from mvcodec.cli.setting_options import add_setting
from mvcodec.cli.standard_streams import INPUT_NAME, STANDARD, standard_input, standard_output
from mvcodec.cli.tallied_writer import TalliedWriter
from mvcodec.cli.time_options import timing_of
from mvcodec.container import McapWriter
from mvcodec.container.chunk_writing import CHUNK_MS
from mvcodec.container.declared import DROPPED_KEY
from mvcodec.decoding.decoded_source import is_own_file
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.live import BehindSettings, LiveEncoding
from mvcodec.errors import InputError, MvCodecError, MvCodecWarning, SettingError
from mvcodec.frames import FrameSet
from mvcodec.output.live_view import LiveView
from mvcodec.settings import settings_of
from mvcodec.stereo.disparity_range import make_room

SUFFIX = ".mcap"
GIVEN = "given"
"""The matcher that takes what the input has."""

STREAM_SETTINGS = ("topics", "depth_topics", "when_behind", "clock", "patience_s")


class Unfinished(MvCodecError):
    """Encoding ended early; what was written is a proper file."""


def add_stream_arguments(parser: argparse.ArgumentParser) -> None:
    """The options that recordings need."""
    group = parser.add_argument_group("recordings and live streams (an .mcap file, or -)")
    known = settings_of(RecordingSettings)
    for name, note in (
        ("topics", "; rows separated by ; or one list with --grid"),
        ("depth_topics", f"; for --matcher {GIVEN}"),
    ):
        group.add_argument(OPTIONS[name], metavar="T,T;T,T", help=in_options(known[name].help) + note)
    add_setting(
        group,
        BehindSettings,
        "when_behind",
        left_open=True,
        note=f" (default: {BehindSettings().when_behind})",
    )
    usual = known["clock"].default
    add_setting(
        group,
        RecordingSettings,
        "clock",
        left_open=True,
        note=f" (default: {usual}; of live cameras: {usual} where they seem to have one clock)",
    )
    add_patience(group)


def own_file(arguments: argparse.Namespace) -> Path | None:
    """The input, if it is a file of ours that is coded again."""
    inputs: list[Path] = arguments.input
    asked = len(inputs) == 1 and arguments.topics is None and inputs[0].suffix.lower() == SUFFIX
    return inputs[0] if asked and is_own_file(inputs[0]) else None


def is_stream(arguments: argparse.Namespace) -> bool:
    """Whether the input is a recording (in one file or several) or a stream; files of ours are neither."""
    inputs: list[Path] = arguments.input
    if is_live(arguments) or [str(path) for path in inputs] == [STANDARD]:
        return True
    if own_file(arguments) is not None:
        return False
    return all(path.suffix.lower() == SUFFIX for path in inputs)


def refuse_stream_options(arguments: argparse.Namespace) -> None:
    """Raise SettingError for an option that only recordings and streams have, and the input is none."""
    for name in STREAM_SETTINGS:
        found = getattr(arguments, name)
        if found is not None:
            expected = (
                f"no such option: {arguments.input[0]} is no recording, live camera, {SUFFIX} file or -"
            )
            raise SettingError(name, found, expected)


def open_target(arguments: argparse.Namespace, view: LiveView | None) -> McapWriter:
    """The writer of OUT, which the live view listens to; frame sets go to standard output one by one."""
    chunk_ms: int | None = arguments.chunk_ms
    if str(arguments.output) == STANDARD:
        return TalliedWriter(standard_output(), 0 if chunk_ms is None else chunk_ms, view)
    return McapWriter(arguments.output, CHUNK_MS.default if chunk_ms is None else chunk_ms, view)


def encode_stream(
    arguments: argparse.Namespace, make_config: Callable[[CameraArray], EncoderConfig]
) -> McapWriter:
    """Code frame sets as they come; returns the writer, closed."""
    first, stop = _frames(arguments.frames)
    with live_view(arguments) as view, _opened(arguments) as source:
        straight = rectified_stream(source, arguments)
        config = make_config(straight.array)
        frame_sets: Iterator[FrameSet] = islice(straight.frame_sets(), first, stop)
        span = arguments.disparity_range_px
        if isinstance(span, tuple):
            if not arguments.exact_range and str(config.chosen_matcher).split(":")[0] != GIVEN:
                seen = list(islice(frame_sets, 1))
                span = make_room(straight.array, seen, span, INSIST) if seen else span
                frame_sets = chain(seen, frame_sets)
            config = replace(config, disparity_range_px=span)
        if source.calibration_note and not straight.array.calibration.given:
            text = f"{source.name}: {source.calibration_note}; nominal values stand in"
            warnings.warn(text, MvCodecWarning, stacklevel=2)
        return _run(arguments, straight, config, frame_sets, view)


def _run(
    arguments: argparse.Namespace,
    source: RectifiedStream,
    config: EncoderConfig,
    frame_sets: Iterator[FrameSet],
    view: LiveView | None,
) -> McapWriter:
    writer = open_target(arguments, view)
    encoder = Encoder(source.array, config)
    behind = BehindSettings() if arguments.when_behind is None else BehindSettings(arguments.when_behind)
    live = LiveEncoding(encoder, writer, behind)
    try:
        with (
            deferred_interrupt() as interrupted,
            writer,
            encoder,
            progress("encode", None, quiet=arguments.quiet) as bar,
        ):
            live.run(frame_sets, interrupted, bar.update)
            writer.note({DROPPED_KEY: str(live.dropped)})
    except (MvCodecError, OSError) as error:
        if not writer.written_count or str(arguments.output) == STANDARD:
            raise
        raise Unfinished(f"{error}; {arguments.output} holds {writer.written_count} frame sets") from error
    if not writer.frame_count:
        raise InputError(source.name, "no frame set of all cameras", "one at least")
    if live.dropped:
        text = f"{source.name}: {live.dropped} frame sets dropped, since they came faster than they left"
        warnings.warn(text, MvCodecWarning, stacklevel=2)
    return writer


@contextmanager
def _opened(arguments: argparse.Namespace) -> Iterator[Recording | LiveCameras]:
    if is_live(arguments):
        with live_cameras(arguments) as cameras:
            yield cameras
        return
    if arguments.sync == "audio":
        raise SettingError("sync", "audio with a recording", "motion: a recording's topics have no sound")
    timing, split = timing_of(arguments), arguments.split or (1, 1)
    settings = RecordingSettings(
        topics=_topic_grid("topics", arguments.topics, arguments.grid, split),
        real=arguments.real,
        fps=timing.fps,
        tolerance_ms=timing.tolerance_ms,
        calibration=None if arguments.calibration is None else read_calibration(arguments.calibration),
        clock=arguments.clock or settings_of(RecordingSettings)["clock"].default,
        offsets_ms=timing.offsets_ms,
        bits=arguments.bits,
        depth_topics=_depth_grid(arguments),
        split=split,
        gaps=arguments.gaps,
        others=() if arguments.enhance is None else arguments.enhance_views,
    )
    on_damage = reading_of(arguments).on_unreadable
    paths: list[Path] = arguments.input
    if str(paths[0]) == STANDARD:
        if arguments.sync is not None:
            raise SettingError("sync", f"motion with {INPUT_NAME}", "a file, which can be read twice")
        yield Recording(standard_input(), INPUT_NAME, settings, on_damage=on_damage)
        return
    name = str(paths[0]) if len(paths) == 1 else f"{paths[0]} ... {paths[-1]}"
    with ExitStack() as files:

        def opened(asked: RecordingSettings) -> Recording:
            parts = [files.enter_context(_binary(path)) for path in paths]
            return Recording(parts, name, asked, on_damage=on_damage)

        yield opened(settings if arguments.sync is None else with_offsets(settings, opened))


def _binary(path: Path) -> BinaryIO:
    try:
        return path.open("rb")
    except OSError as error:
        raise InputError(path, error.strerror, "a file that can be read") from None


def _depth_grid(arguments: argparse.Namespace) -> TopicGrid | None:
    if arguments.depth_topics is None:
        return None
    if str(arguments.matcher).split(":")[0] != GIVEN:
        raise SettingError("depth_topics", arguments.depth_topics, f"--matcher {GIVEN}, which codes them")
    return _topic_grid("depth_topics", arguments.depth_topics, arguments.grid)


def _topic_grid(
    setting: str, text: str | None, grid: tuple[int, int] | None, split: tuple[int, int] = (1, 1)
) -> TopicGrid:
    if text is None:
        raise SettingError(setting, "nothing", "the topic of every view, such as '/a,/b;/c,/d'")
    rows = tuple(tuple(topic.strip() for topic in row.split(",")) for row in text.strip(";").split(";"))
    if not all(all(row) for row in rows):
        raise SettingError(setting, repr(text), "a topic for every view, such as '/a,/b;/c,/d'")
    if grid is None:
        return rows
    names = [name for row in rows for name in row]
    cols = grid[1] // split[1]
    if len(names) * split[0] * split[1] != grid[0] * grid[1] or grid[0] % split[0] or grid[1] % split[1]:
        each = f" of {split[0]}x{split[1]} views each" * (split != (1, 1))
        raise SettingError(setting, f"{len(names)} topics{each}", f"{grid[0]}x{grid[1]} views as --grid says")
    return tuple(tuple(names[at : at + cols]) for at in range(0, len(names), cols))


def _frames(frames: slice | None) -> tuple[int, int | None]:
    start, stop = (0, None) if frames is None else (frames.start or 0, frames.stop)
    if start < 0 or (stop is not None and stop <= start):
        text = f"{'' if start == 0 else start}:{'' if stop is None else stop}"
        raise SettingError(
            "--frames", text, "A:B counted from the start, since the input's length is unknown"
        )
    return start, stop
