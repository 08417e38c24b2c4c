"""The anchor: every view of the full array as an H.264 stream of its own (ALGORITHMS section 6)."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

from mvcodec.array import CameraArray, Position
from mvcodec.capture import ArraySource, resolve_frames
from mvcodec.evaluation.quality import Comparison, QualityMeter
from mvcodec.frames import Picture
from mvcodec.stream import TrackKind, view_name
from mvcodec.video.codec import RateControl, VideoSettings
from mvcodec.video.colour import even_size, to_picture, to_planes
from mvcodec.video.table import find_codec

THREADS = 2

OnDecoded = Callable[[Position, Picture, Picture], None]
"""Called with a view, its original and its decoded picture."""


@dataclass(frozen=True, slots=True)
class Simulcast:
    """What the anchor costs and how good it is.

    Attributes:
        bits: of all elementary streams; no container, in the anchor's favour.
        frames: frame sets coded.
        quality: with the compared array's real and virtual views apart, though all are coded here.
    """

    bits: int
    frames: int
    quality: Comparison


def simulcast(
    source: ArraySource,
    frames: slice | None = None,
    *,
    rate: RateControl,
    gop: int,
    preset: str = "medium",
    on_picture: Callable[[], object] | None = None,
) -> Simulcast:
    """Code every view of the grid by itself and measure the decoded pictures.

    It is the codec that mvcodec uses for its real views, with the same settings: no B-frames, and
    no zero-latency tune, whose slices and reduced references would cost the anchor bits.

    Args:
        rate, gop, preset: as the compared encoding uses them for pictures.
        on_picture: called, from any thread, after each picture.

    Raises:
        SettingError: a setting is outside its range, or `frames` selects none.
        InputError: a picture cannot be read.
    """
    chosen = resolve_frames(frames, source.frame_count, source.name)
    settings = _settings(source.array, rate, gop, preset)
    meter = QualityMeter(source.array.real)

    def measure(view: Position, original: Picture, decoded: Picture) -> None:
        meter.push(view, original, decoded)
        if on_picture is not None:
            on_picture()

    code = partial(_code_view, source, chosen, settings, measure)
    with ThreadPoolExecutor(THREADS) as pool:
        bits = sum(pool.map(code, source.array.positions))
    return Simulcast(bits, len(chosen), meter.result())


def _settings(array: CameraArray, rate: RateControl, gop: int, preset: str) -> VideoSettings:
    width, height = even_size(array.width, array.height)
    return VideoSettings(TrackKind.TEXTURE, width, height, array.fps, gop, rate, preset)


def _code_view(
    source: ArraySource, chosen: range, settings: VideoSettings, on_decoded: OnDecoded, view: Position
) -> int:
    """Code one view and measure it; one at a time, so that memory does not grow with the grid."""
    codec = find_codec("h264")
    encoder, decoder = codec.encoder(settings), codec.decoder()
    bits = 0
    for number, frame_set in enumerate(source.frame_sets(slice(chosen.start, chosen.stop), [view])):
        original = frame_set.pictures[view]
        for unit in encoder.push(to_planes(original), keyframe=number % settings.gop == 0):
            bits += 8 * len(unit.data)
            for planes in decoder.push(unit.data, f"{view_name(view)}, frame {frame_set.index}"):
                on_decoded(view, original, to_picture(planes, source.array.width, source.array.height))
    encoder.flush()
    return bits
