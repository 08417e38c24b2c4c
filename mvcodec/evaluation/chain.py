"""The whole chain measured: encode to a file, decode it, synthesise every view, compare with originals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from mvcodec.array import Position, Viewpoint
from mvcodec.capture import ArraySource
from mvcodec.container import McapWriter, read_info
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.errors import InputError
from mvcodec.evaluation.points import BitsSplit, CurvePoint
from mvcodec.evaluation.quality import Comparison, QualityMeter
from mvcodec.evaluation.remembered import Remembered
from mvcodec.evaluation.stopwatch import Stopwatch
from mvcodec.frames import DecodedSet, FrameSet, Picture
from mvcodec.stereo.matcher import Matcher
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.workers import run_all

BATCH = 16
"""Synthesised pictures held at a time."""


def measure_chain(
    source: ArraySource,
    chosen: range,
    config: EncoderConfig,
    matcher: Remembered,
    synthesizer: Synthesizer,
    file: Path,
    on_picture: Callable[[], object],
) -> CurvePoint:
    """Code the real cameras into `file`, render every view of the grid from it and measure it.

    Args:
        chosen: frame numbers of the input, consecutive.
        config: with a constant qp.
        matcher: new for each call; finds what config's matcher finds.
        file: written complete or not at all; its folder exists.
        on_picture: called after each picture that was measured.

    Raises:
        SettingError, InputError, OutputError: as encoder, source and writer.
    """
    assert config.rate.qp is not None
    encoding, decoding = Stopwatch(), Stopwatch()
    part = file.with_suffix(".part")
    try:
        encode_into(part, source, chosen, config, matcher, encoding)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)
    info = read_info(file)
    bits = info.bits
    return CurvePoint(
        qp=config.rate.qp,
        bits=bits.total,
        kbps=bits.total * source.array.fps / len(chosen) / 1000,
        quality=_measure(source, chosen, file, synthesizer, decoding, on_picture),
        split=BitsSplit(bits.texture, bits.disparity, bits.other, bits.enhancement),
        encode_seconds=encoding.seconds + matcher.spared_seconds,
        decode_seconds=decoding.seconds,
        match_seconds=matcher.seconds,
        file=file.name,
        settings=info.header.settings,
    )


def encode_into(
    path: Path, source: ArraySource, chosen: range, config: EncoderConfig, matcher: Matcher, clock: Stopwatch
) -> None:
    """Code the chosen frames into a file; the clock runs while the encoder works."""
    with McapWriter(path) as writer, Encoder(source.array, config, matcher) as encoder:
        for frame_set in source.frame_sets(slice(chosen.start, chosen.stop), encoder.views):
            with clock:
                packets = encoder.push(frame_set)
            writer.push(packets)


def decode_view(
    source: ArraySource, chosen: range, number: int, file: Path, synthesizer: Synthesizer, view: Position
) -> tuple[Picture, Picture]:
    """The original and the decoded picture of a view in the chosen frame of that number (from 0)."""
    frame = chosen[number]
    (originals,) = source.frame_sets(slice(frame, frame + 1), [view])
    with Decoder.open(file, slice(number, number + 1), enhanced=None) as decoder:
        (decoded,) = decoder
    return originals.pictures[view], synthesizer.render(decoded, Viewpoint(*view)).pixels


def _measure(
    source: ArraySource,
    chosen: range,
    file: Path,
    synthesizer: Synthesizer,
    clock: Stopwatch,
    on_picture: Callable[[], object],
) -> Comparison:
    positions = source.array.positions
    meter = QualityMeter(source.array.real)
    originals = source.frame_sets(slice(chosen.start, chosen.stop), positions)
    with Decoder.open(file, enhanced=None) as decoder:
        decoded_sets = iter(decoder)
        for frame_set in originals:
            with clock:
                decoded = next(decoded_sets, None)
            if decoded is None or decoded.index != frame_set.index:
                raise InputError(file, "a file without that frame", f"frame {frame_set.index}")
            for start in range(0, len(positions), BATCH):
                views = positions[start : start + BATCH]
                with clock:
                    pictures = run_all(partial(_render, synthesizer, decoded), views)
                run_all(partial(_compare, meter, frame_set), views, pictures)
                _repeat(on_picture, views)
    return meter.result()


def _render(synthesizer: Synthesizer, decoded: DecodedSet, view: Position) -> Picture:
    return synthesizer.render(decoded, Viewpoint(*view)).pixels


def _compare(meter: QualityMeter, originals: FrameSet, view: Position, picture: Picture) -> None:
    meter.push(view, originals.pictures[view], picture)


def _repeat(call: Callable[[], object], views: Sequence[Position]) -> None:
    for _ in views:
        call()
