"""The anchors: every view of the full array coded by a stock encoder, in several orders (ALGORITHMS 6)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from mvcodec import workers
from mvcodec.array import CameraArray, Position
from mvcodec.capture import ArraySource, resolve_frames
from mvcodec.evaluation.quality import Comparison, QualityMeter
from mvcodec.evaluation.stopwatch import Stopwatch
from mvcodec.frames import Picture
from mvcodec.stream import TrackKind
from mvcodec.video.codec import Codec, Planes, RateControl, VideoSettings
from mvcodec.video.codecs import find_codec
from mvcodec.video.colour import even_size, to_picture, to_planes

Tour = tuple[Position, ...]
"""Views in the order in which one video sequence goes through them; backwards at every other time."""


def single_views(array: CameraArray) -> tuple[Tour, ...]:
    """Simulcast: each view is a sequence of its own."""
    return tuple((view,) for view in array.positions)


def serpentine(array: CameraArray) -> tuple[Tour, ...]:
    """The whole matrix as one sequence: rows from left to right and from right to left by turns."""
    return (tuple(view for row in rows_of(array) for view in (row if row[0][0] % 2 == 0 else row[::-1])),)


def rows_of(array: CameraArray) -> tuple[Tour, ...]:
    """One sequence for each row of the array."""
    return tuple(tuple((row, col) for col in range(array.cols)) for row in range(array.rows))


@dataclass(frozen=True, slots=True)
class Anchor:
    """A way to code the full array with a stock encoder.

    Attributes:
        name: short, as the report has it.
        title: for people.
        tours: the views of each video sequence, in order.
        b_pictures: the preset's own B-pictures and look-ahead; else none, as in mvcodec's streams.
    """

    name: str
    title: str
    tours: Callable[[CameraArray], tuple[Tour, ...]]
    b_pictures: bool


ANCHORS: dict[str, tuple[Anchor, ...]] = {
    "simulcast": (
        Anchor("simulcast", "simulcast, no B-frames", single_views, False),
        Anchor("simulcast-b", "simulcast, B-frames", single_views, True),
    ),
    "pvs": (
        Anchor("pvs", "PVS, all views", serpentine, True),
        Anchor("pvs-rows", "PVS, each row", rows_of, True),
    ),
}
"""The anchors by the name under which they are asked for. The first is stated in every report."""

SIMULCAST = ANCHORS["simulcast"][0]


@dataclass(frozen=True, slots=True)
class CodedArray:
    """What coding an array cost and how good it is.

    Attributes:
        bits: of all elementary streams; no container, in the anchor's favour.
        frames: frame sets coded.
        quality: with the compared array's real and virtual views apart, though all are coded here.
        encode_seconds, decode_seconds: inside encoder and decoder, summed over the sequences, one
            thread each.
    """

    bits: int
    frames: int
    quality: Comparison
    encode_seconds: float
    decode_seconds: float


def code_array(
    source: ArraySource,
    frames: slice | None = None,
    *,
    anchor: Anchor = SIMULCAST,
    codec: str = "h264",
    rate: RateControl,
    gop: int,
    preset: str = "medium",
    keyframe_ratio: float | None = None,
    threads: int | None = None,
    on_picture: Callable[[], object] | None = None,
) -> CodedArray:
    """Code every view of the grid in an anchor's order and measure the decoded pictures.

    The encoder has the settings that mvcodec gives it for pictures, and keyframes at the same
    times. So psycho-visual decisions are off, in the anchor's favour: with them its BD-rate is 8 and
    12 % worse (x264, simulcast and pvs), 2 and 7 % (x265; shop_v4, 4 frame sets, QP 22..37, slow).
    There is no zero-latency tune, whose slices and reduced references would cost the anchor bits.

    Args:
        codec: a name of `CODECS`; rate is on its scale.
        rate, gop, preset, keyframe_ratio: as the compared encoding uses them for pictures; gop in frame
            sets.
        threads: sequences coded side by side; by default as set for the process.
        on_picture: called, from any thread, after each picture that was coded or measured: twice
            for each picture.

    Raises:
        SettingError: a setting is outside its range, or `frames` selects none.
        InputError: a picture cannot be read.
    """
    chosen = resolve_frames(frames, source.frame_count, source.name)
    meter = QualityMeter(source.array.real)
    job = _Job(source, chosen, find_codec(codec), meter, on_picture or (lambda: None))
    settings = partial(
        sequence_settings,
        source.array,
        anchor,
        rate=rate,
        gop=gop,
        preset=preset,
        keyframe_ratio=keyframe_ratio,
    )
    with workers.threads(threads):
        costs = workers.run_all(lambda tour: job.code(tour, settings(tour)), anchor.tours(source.array))
    return CodedArray(
        bits=sum(cost.bits for cost in costs),
        frames=len(chosen),
        quality=meter.result(),
        encode_seconds=sum(cost.encode_seconds for cost in costs),
        decode_seconds=sum(cost.decode_seconds for cost in costs),
    )


def sequence_settings(
    array: CameraArray,
    anchor: Anchor,
    tour: Tour,
    *,
    rate: RateControl,
    gop: int,
    preset: str,
    keyframe_ratio: float | None = None,
) -> VideoSettings:
    """The settings of one sequence's encoder; one keyframe at each time that mvcodec has them."""
    width, height = even_size(array.width, array.height)
    pictures = gop * len(tour)
    low_delay = not anchor.b_pictures
    return VideoSettings(
        TrackKind.TEXTURE,
        width,
        height,
        array.fps,
        pictures,
        rate,
        preset,
        low_delay=low_delay,
        keyframe_ratio=keyframe_ratio,
    )


@dataclass(frozen=True, slots=True)
class _Cost:
    """What one sequence cost."""

    bits: int
    encode_seconds: float
    decode_seconds: float


@dataclass(frozen=True, slots=True)
class _Job:
    """One coding of an array, shared by its sequences."""

    source: ArraySource
    chosen: range
    codec: Codec
    meter: QualityMeter
    on_picture: Callable[[], object]

    def code(self, tour: Tour, settings: VideoSettings) -> _Cost:
        """Code one sequence, then decode and measure it."""
        encoding, decoding = Stopwatch(), Stopwatch()
        units = self._encode(tour, settings, encoding)
        shown = self._decode(units, settings.low_delay, decoding)
        width, height = self.source.array.width, self.source.array.height
        for (view, original), planes in zip(self._pictures(tour), shown, strict=True):
            self.meter.push(view, original, to_picture(planes, width, height))
            self.on_picture()
        return _Cost(8 * sum(map(len, units)), encoding.seconds, decoding.seconds)

    def _encode(self, tour: Tour, settings: VideoSettings, clock: Stopwatch) -> list[bytes]:
        encoder = self.codec.encoder(settings)
        coded = []
        for number, (_, picture) in enumerate(self._pictures(tour)):
            planes = to_planes(picture)
            with clock:
                coded += encoder.push(planes, keyframe=number % settings.gop == 0)
            self.on_picture()
        with clock:
            coded += encoder.flush()
        return [unit.data for unit in coded]

    def _decode(self, units: list[bytes], low_delay: bool, clock: Stopwatch) -> Iterator[Planes]:
        decoder = self.codec.decoder(low_delay=low_delay)
        for number, data in enumerate(units):
            with clock:
                shown = decoder.push(data, f"anchor, unit {number}")
            yield from shown
        with clock:
            shown = decoder.flush()
        yield from shown

    def _pictures(self, tour: Tour) -> Iterator[tuple[Position, Picture]]:
        """The originals in the order of coding."""
        frame_sets = self.source.frame_sets(slice(self.chosen.start, self.chosen.stop), tour)
        for number, frame_set in enumerate(frame_sets):
            for view in tour if number % 2 == 0 else tour[::-1]:
                yield view, frame_set.pictures[view]
