"""Trials: a few frame sets coded by some settings and measured, as all of the input would come out."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from statistics import fmean

from mvcodec.array import Position, Viewpoint
from mvcodec.capture import ArraySource
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.coders import enhancer
from mvcodec.encoding.config import EncoderConfig, default_gop, find_matcher
from mvcodec.encoding.encoder import Encoder
from mvcodec.encoding.enhancer import enhanced_views
from mvcodec.evaluation.metrics import psnr
from mvcodec.evaluation.remembered import MapSpool, Remembered
from mvcodec.evaluation.target_setting import PROBED_SETS
from mvcodec.frames import DecodedSet, FrameSet
from mvcodec.stream import Packet, StreamHeader, TrackKind
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.workers import run_all

UNIT_BYTES = 37
"""What the container adds to each unit; as measured on files of several sizes."""

LAYER_KINDS = frozenset({TrackKind.LAYER, TrackKind.ENHANCED})
BASE_KINDS = frozenset(TrackKind) - LAYER_KINDS

CHECKED_SETS, CHECKED_PARTS = 12, 4
"""Frame sets by which the result is checked: all of an input that has no more, else so many parts of it."""


def probed(chosen: range) -> list[range]:
    """What each trial codes: PROBED_SETS frame sets from the middle, a keyframe and what follows it."""
    middle = max((len(chosen) - PROBED_SETS) // 2, 0)
    return [chosen[middle : middle + PROBED_SETS]]


def checked(chosen: range) -> list[range]:
    """What the result is checked by: all, or parts from the beginning to the end."""
    if len(chosen) <= CHECKED_SETS:
        return [chosen]
    length = CHECKED_SETS // CHECKED_PARTS
    starts = (part * (len(chosen) - length) // (CHECKED_PARTS - 1) for part in range(CHECKED_PARTS))
    return [chosen[start : start + length] for start in starts]


@dataclass(frozen=True, slots=True)
class Trial:
    """How some settings do.

    Attributes:
        bits: of a frame set, container included, the mean over the file.
        base_bits: those that are not the layer's.
        psnr_y: dB, mean luma PSNR over all views of the grid.

    All weigh keyframes as often as they come in the file.
    """

    config: EncoderConfig
    bits: float
    base_bits: float
    psnr_y: float


@dataclass(frozen=True, slots=True)
class _Base:
    header: StreamHeader
    packets: Sequence[Sequence[Packet]]


class Trials:
    """Codes parts of an input; finds maps and codes each base only once.

    Args:
        chosen: frame numbers of the input, consecutive.
        parts: of them; each is coded by itself, from a keyframe on.
        spool: keeps maps.
        on_coding: called after each trial.
    """

    def __init__(
        self,
        source: ArraySource,
        chosen: range,
        parts: Sequence[range],
        synthesizer: Synthesizer,
        spool: MapSpool,
        on_coding: Callable[[], object] = lambda: None,
    ) -> None:
        self._source, self._synthesizer, self._spool = source, synthesizer, spool
        self._on_coding = on_coding
        self._file_sets, self._parts = len(chosen), parts
        self._bases: dict[tuple[range, EncoderConfig, bool], _Base] = {}
        self.count = 0

    def __call__(self, config: EncoderConfig) -> Trial:
        """Code and measure.

        Args:
            config: with a constant QP.

        Raises:
            SettingError, InputError: as the encoder and the source raise them.
        """
        coded = [self._coded(part, config) for part in self._parts]
        qualities = [self._qualities(part, sets) for part, sets in zip(self._parts, coded, strict=True)]
        gop = config.gop or default_gop(self._source.array.fps)
        keyframes = math.ceil(self._file_sets / gop) / self._file_sets
        psnr_y = _mean(coded, qualities, keyframes)
        bits, base_bits = (
            _mean(coded, [[_bits(packets, kinds) for packets in sets] for sets in coded], keyframes)
            for kinds in (LAYER_KINDS | BASE_KINDS, BASE_KINDS)
        )
        self.count += 1
        self._on_coding()
        return Trial(config, bits, base_bits, psnr_y)

    def _coded(self, part: range, config: EncoderConfig) -> list[list[Packet]]:
        base = self._bases.get(_key(part, config))
        if base is None:
            return self._code_all(part, config)
        if config.enhance is None:
            return [list(packets) for packets in base.packets]
        views = enhanced_views(self._source.array, config.enhance_views)
        layer = enhancer(base.header, config, views)
        pairs = zip(base.packets, self._sets(part, views), strict=True)
        return [layer.push(packets, frames.pictures) for packets, frames in pairs]

    def _code_all(self, part: range, config: EncoderConfig) -> list[list[Packet]]:
        matcher = Remembered(find_matcher(config.chosen_matcher), self._spool)
        with Encoder(self._source.array, config, matcher) as encoder:
            coded = [encoder.push(frames) for frames in self._sets(part, encoder.views)]
            assert encoder.header is not None
            base = [[each for each in packets if each.track.kind in BASE_KINDS] for packets in coded]
            self._bases[_key(part, config)] = _Base(encoder.header, base)
        return coded

    def _qualities(self, part: range, coded: Sequence[Sequence[Packet]]) -> list[float]:
        with Decoder(enhanced=None) as decoder:
            found = [each for packets in coded for packet in packets for each in decoder.push(packet)]
            originals = self._sets(part, self._source.array.positions)
            pairs = zip(originals, [*found, *decoder.flush()], strict=True)
            return [self._quality(frames, decoded) for frames, decoded in pairs]

    def _sets(self, part: range, views: Sequence[Position]) -> Iterable[FrameSet]:
        return self._source.frame_sets(slice(part.start, part.stop), views)

    def _quality(self, originals: FrameSet, decoded: DecodedSet) -> float:
        return fmean(run_all(partial(self._psnr, originals, decoded), self._source.array.positions))

    def _psnr(self, originals: FrameSet, decoded: DecodedSet, view: Position) -> float:
        return psnr(originals.pictures[view], self._synthesizer.render(decoded, Viewpoint(*view)).pixels)


def _key(part: range, config: EncoderConfig) -> tuple[range, EncoderConfig, bool]:
    """The base of some settings. Which maps it sends may depend on whether there is a layer."""
    alone = replace(config, enhance=None, enhance_views=None, enhance_chain=None)
    return part, alone, config.enhance is not None


def _bits(packets: Iterable[Packet], kinds: Collection[TrackKind]) -> float:
    return 8.0 * sum(len(packet.data) + UNIT_BYTES for packet in packets if packet.track.kind in kinds)


def _mean(
    coded: Sequence[Sequence[Sequence[Packet]]], values: Sequence[Sequence[float]], keyframes: float
) -> float:
    """The mean over a file of whose frame sets such a share are keyframes, of values for what was coded."""
    first: list[float] = []
    others: list[float] = []
    for sets, of_sets in zip(coded, values, strict=True):
        for packets, value in zip(sets, of_sets, strict=True):
            (first if packets[0].keyframe else others).append(value)
    return keyframes * fmean(first) + (1 - keyframes) * fmean(others) if others else fmean(first)
