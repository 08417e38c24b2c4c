"""``mvcodec encode``: pictures or videos of a camera array in, one MCAP file out."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from mvcodec.array import CameraArray
from mvcodec.capture import ArraySource, open_input, resolve_frames
from mvcodec.capture.manifest import read_calibration
from mvcodec.capture.recording_files import recording_files
from mvcodec.capture.selection import CORNERS
from mvcodec.cli.arguments import add_frames, add_output_options
from mvcodec.cli.coding_options import (
    add_coding,
    add_input,
    check_exact_range,
    checked_config,
    find_range,
    with_keyframe_ratio,
)
from mvcodec.cli.encode_stream import (
    GIVEN,
    Unfinished,
    add_stream_arguments,
    encode_stream,
    is_stream,
    open_target,
    own_file,
    refuse_stream_options,
)
from mvcodec.cli.info import document, simulcast_bits, summary
from mvcodec.cli.interrupt import deferred_interrupt
from mvcodec.cli.kernel_loading import load_kernels_beside
from mvcodec.cli.layer_options import add_layer, layer_settings
from mvcodec.cli.live_options import input_or_camera, is_live
from mvcodec.cli.live_view_option import add_live_view, live_view
from mvcodec.cli.paths import add_overwrite, check_file_target, local_path
from mvcodec.cli.picture_options import add_picture_options, reading_of
from mvcodec.cli.progress import CodingProgress, stage
from mvcodec.cli.quality_target import config_for_quality, config_for_rate
from mvcodec.cli.rig_option import add_rig, rectified_source
from mvcodec.cli.safety import add_chunk_ms
from mvcodec.cli.segment_options import add_segment, check_continues, plan
from mvcodec.cli.setting_options import add_setting
from mvcodec.cli.standard_streams import OUTPUT_NAME, STANDARD
from mvcodec.cli.tallied_writer import TalliedWriter
from mvcodec.cli.time_options import add_time_options, timing_of
from mvcodec.container import McapWriter, StreamInfo, read_info
from mvcodec.decoding.decoded_source import DecodedSource
from mvcodec.depth import require_calibration
from mvcodec.encoding.config import AUTO
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.speed_choice import FOR_LIVE
from mvcodec.errors import MvCodecError, MvCodecWarning, SettingError
from mvcodec.evaluation.target_setting import QualityTarget
from mvcodec.output.live_view import LiveView
from mvcodec.settings import settings_of
from mvcodec.video.codec import RateControl

SUFFIX = ".mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``encode``."""
    add_input(
        parser,
        "an array folder, R*C videos in row order with --grid, a recording with --topics (an .mcap"
        " file or - for standard input), or R*C live cameras with --grid: udp://, rtsp://, srt://, tcp://,"
        " v4l2:DEVICE, avfoundation:DEVICE",
        input_or_camera,
    )
    parser.add_argument("output", type=local_path, metavar="OUT.mcap", help="or - for standard output")
    rate = parser.add_mutually_exclusive_group()
    add_setting(rate, RateControl, "qp", note=f" (default: {EncoderConfig().rate.qp})")
    add_setting(rate, RateControl, "crf")
    add_setting(
        rate,
        RateControl,
        "bitrate_kbps",
        metavar="KBPS",
        note=", with --enhance auto of the layer too; 2M is 2000",
    )
    add_setting(rate, QualityTarget, "target_psnr", metavar="DB")
    add_coding(parser)
    add_layer(parser)
    parser.add_argument(
        "--calibration", type=Path, metavar="FILE", help="JSON with the calibration as in array.json"
    )
    parser.add_argument(
        "--depth", choices=("raw16",), help="add metric depth, foxglove.RawImage of 16 bits, millimetres"
    )
    parser.add_argument("--nominal", action="store_true", help="accept nominal calibration for --depth")
    add_rig(parser)
    add_chunk_ms(parser)
    add_live_view(parser)
    add_time_options(parser)
    add_picture_options(parser)
    add_stream_arguments(parser)
    add_segment(parser)
    add_frames(parser, "frames of the input to code")
    add_overwrite(parser)
    add_output_options(parser, "print what the file holds as JSON")


def run(arguments: argparse.Namespace) -> None:
    """Encode; leaves no output where nothing was encoded, a proper one where something was."""
    if not is_live(arguments):
        arguments.input = [file for path in arguments.input for file in recording_files(path)]
    _check_output(arguments.output, arguments.input, overwrite=arguments.overwrite or arguments.dry_run)
    _check_effect(arguments)
    chosen: dict[str, Any] = {}
    if is_stream(arguments):
        writer: McapWriter | None = encode_stream(arguments, lambda array: _config(array, arguments))
    else:
        writer, chosen = _encode_files(arguments)
    if writer is None:
        return
    if isinstance(writer, TalliedWriter):
        if not arguments.quiet:
            print(f"mvcodec: {OUTPUT_NAME}: {summary(writer.info())}", file=sys.stderr)
        return
    info = read_info(arguments.output)
    if arguments.json:
        more = {"simulcast_bits_estimated": simulcast_bits(info)} | ({"chosen": chosen} if chosen else {})
        print(json.dumps(document(info, arguments.output) | more))
    elif not arguments.quiet:
        print(f"{arguments.output}: {summary(info)}{_beside_simulcast(info)}")


def _beside_simulcast(info: StreamInfo) -> str:
    """How the file compares with all views coded by themselves, where there are more than it codes."""
    array = info.header.array
    if len(array.real) == len(array.positions):
        return ""
    share = info.bits.total / max(simulcast_bits(info), 1)
    return f"; about {share:.0%} of all {len(array.positions)} views as simulcast, going by the real ones"


def _check_effect(arguments: argparse.Namespace) -> None:
    """Refuse options that would have no effect."""
    if arguments.json and str(arguments.output) == STANDARD:
        raise SettingError("--json", "with OUT -", "another OUT: both would be standard output")
    check_exact_range(arguments)
    if arguments.nominal and not arguments.depth:
        raise SettingError("--nominal", "no --depth", "--depth raw16, for which it accepts the calibration")
    if not is_stream(arguments):
        refuse_stream_options(arguments)
    elif arguments.target_psnr is not None:
        raise SettingError("--target-psnr", "with a recording or a stream", "an array folder or videos")
    elif arguments.dry_run or arguments.continues:
        option = "--dry-run" if arguments.dry_run else "--continues"
        raise SettingError(option, "with a recording or a stream", "an array folder or videos")


def _encode_files(arguments: argparse.Namespace) -> tuple[McapWriter | None, dict[str, Any]]:
    """Code an array folder or videos; returns the writer, and what was chosen for a quality asked for."""
    source: ArraySource = _open(arguments)
    chosen = resolve_frames(arguments.frames, source.frame_count, source.name)
    load_kernels_beside()
    source, first = rectified_source(source, chosen, arguments)
    array = source.array
    if arguments.calibration is not None:
        array = replace(array, calibration=read_calibration(arguments.calibration))
    config = _config(array, arguments)
    check_continues(array, config, arguments.continues)
    if not array.calibration.given:
        stand_in = (
            "no calibration given; nominal values stand in (f = picture width, 0.1 m a step)"
            if arguments.rig is None
            else "the rig does not say how far its cameras stand apart; 0.1 m a step stands in"
        )
        warnings.warn(f"{source.name}: {stand_in}", MvCodecWarning, stacklevel=2)
    given = str(config.chosen_matcher).split(":")[0] == GIVEN
    if source.has_given and not given:
        text = f"{source.name}: it has disparity or depth of its own, which --matcher {GIVEN} codes"
        warnings.warn(text, MvCodecWarning, stacklevel=2)
    if isinstance(source, DecodedSource) and arguments.disparity_range_px is None:
        range_px = source.disparity_range_px
    else:
        with stage("find the range of disparities", quiet=arguments.quiet):
            range_px = find_range(
                source,
                chosen,
                arguments.disparity_range_px,
                given=given,
                exact=arguments.exact_range,
                first=first,
            )
    config = with_keyframe_ratio(source, chosen, config)
    del first  # its memory is as large as what is coded next
    if arguments.dry_run:
        print(plan(array, config, chosen, range_px))
        return None, {}
    config = replace(config, disparity_range_px=range_px)
    found: dict[str, Any] = {}
    if arguments.target_psnr is not None:
        config, found = config_for_quality(source, chosen, config, arguments)
    elif config.enhance == AUTO and config.rate.bitrate_kbps is not None:
        config, found = config_for_rate(source, chosen, config, arguments)
    with live_view(arguments) as view:
        return _encode(source, array, chosen, config, arguments, view), found


def _open(arguments: argparse.Namespace) -> ArraySource:
    path = own_file(arguments)
    if path is None:
        return open_input(
            arguments.input,
            grid=arguments.grid,
            real=arguments.real,
            timing=timing_of(arguments),
            reading=reading_of(arguments),
            originals=any(
                option is not None for option in (arguments.enhance, arguments.target_psnr, arguments.rig)
            ),
        )
    for option, found, default in (("--grid", arguments.grid, None), ("--real", arguments.real, CORNERS)):
        if found != default:
            raise SettingError(option, found, f"no such option: {path} has its own")
    return DecodedSource(path)


def _encode(
    source: ArraySource,
    array: CameraArray,
    chosen: range,
    config: EncoderConfig,
    arguments: argparse.Namespace,
    view: LiveView | None,
) -> McapWriter:
    writer = open_target(arguments, view)
    try:
        with (
            deferred_interrupt() as interrupted,
            writer,
            Encoder(array, config, coded_before=arguments.continues) as encoder,
            CodingProgress(len(chosen), quiet=arguments.quiet) as bar,
        ):
            for frame_set in source.frame_sets(slice(chosen.start, chosen.stop), encoder.views):
                packets = encoder.push(frame_set)
                if interrupted():
                    raise KeyboardInterrupt
                writer.push(packets)
                bar.update()
    except (MvCodecError, OSError, KeyboardInterrupt) as error:
        held = writer.written_count
        if not held:
            raise
        reason = str(error) or "interrupted"
        raise Unfinished(f"{reason}; {arguments.output} holds {held} of {len(chosen)} frame sets") from error
    return writer


def _check_output(output: Path, inputs: Sequence[Path], *, overwrite: bool) -> None:
    if str(output) == STANDARD:
        return
    if output.resolve() in [Path(path).resolve() for path in inputs]:
        raise SettingError("OUT", output, "another file than INPUT")
    if output.suffix.lower() != SUFFIX:
        # It would most likely be the last INPUT, with OUT forgotten.
        raise SettingError("OUT", output, f"a file name that ends in {SUFFIX}")
    check_file_target(output, overwrite=overwrite)


def _config(array: CameraArray, arguments: argparse.Namespace) -> EncoderConfig:
    """The settings, checked against the array before the time-consuming part begins."""
    if arguments.speed is None and (is_live(arguments) or str(arguments.input[0]) == STANDARD):
        arguments.speed = FOR_LIVE
    if arguments.depth:
        require_calibration(array, arguments.nominal)
    rates = {name: getattr(arguments, name) for name in settings_of(RateControl)}
    layer = layer_settings(arguments)
    return checked_config(array, arguments, **rates, **layer, depth=arguments.depth is not None)
