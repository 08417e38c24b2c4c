"""Codes virtual views from their synthesis: the enhancement layer."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

from mvcodec.array import CameraArray, Position
from mvcodec.encoding.predicted_cameras import SPEEDS, reference_count
from mvcodec.enhancement import LAYER_TRACK, EnhancedView, EnhancementHeader
from mvcodec.errors import SettingError
from mvcodec.frames import Picture
from mvcodec.stream import Packet, StreamHeader
from mvcodec.synthesis.frame_prediction import FramePrediction
from mvcodec.synthesis.track_decoding import StreamTracks
from mvcodec.video.codec import Planes
from mvcodec.video.colour import even_size, to_planes
from mvcodec.video.vp9_reference import (
    MAX_QUANTIZER,
    ReferenceSettings,
    Vp9ReferenceEncoder,
)
from mvcodec.workers import run_all

REFERENCES = 4
"""Decoded pictures that a view is predicted from: of 3, 4 and 6 the cheapest (`docs/measurements.md`)."""

NO_FARTHER = 1.5
"""A reference's squared distance beside the nearest one's, at most: what is farther away adds nothing that
those nearer to the view don't have, and makes predictions worse (`docs/measurements.md`)."""

FINER_FOR_OTHERS = 6.0
"""Steps of the quantizer between a view that all others build on and one that none does: it saves 2 to 3 %
of the bits at equal quality, 10 less than that (`docs/measurements.md`)."""


def enhanced_views(array: CameraArray, asked: Collection[Position] | None) -> tuple[Position, ...]:
    """The views of a layer, in row order: those asked for, by default every virtual one.

    Raises:
        SettingError: a view is real, is not of the grid, or there is none.
    """
    virtual = [view for view in array.positions if view not in array.real]
    if asked is None:
        asked = virtual
    for view in asked:
        if view not in virtual:
            expected = f"views of the {array.rows} x {array.cols} grid that no real camera has"
            raise SettingError("enhance_views", f"{view[0]},{view[1]}", expected)
    if not asked:
        raise SettingError("enhance_views", "none", "one virtual view at least")
    return tuple(view for view in virtual if view in set(asked))


def layer_order(
    array: CameraArray, views: Sequence[Position], most: int | None = None
) -> tuple[EnhancedView, ...]:
    """The view that is farthest from all that is decoded comes next, from what is nearest to it.

    A last reference that would have others decoded for its sake alone is left out: who looks at a single
    view decodes up to a quarter less then, for some 0.1 % of a file's bits (`docs/measurements.md`).

    Args:
        most: other views of the layer that one may build on, by way of others too; None: any number.
    """

    def away(one: Position, other: Position) -> float:
        down = (one[0] - other[0]) / max(array.row_step, 1)
        across = (one[1] - other[1]) / max(array.col_step, 1)
        return down * down + across * across

    left, decoded, order = list(views), list(array.real), []
    needs: dict[Position, frozenset[Position]] = dict.fromkeys(array.real, frozenset())
    while left:
        view = max(left, key=lambda view: min(away(view, other) for other in decoded))
        references: list[Position] = []
        needed: frozenset[Position] = frozenset()
        nearest = math.inf
        for other in sorted(decoded, key=lambda other: (away(view, other), len(needs[other]), other)):
            with_other = needed | needs[other] | ({other} - set(array.real))
            dear = len(references) == REFERENCES - 1 and len(with_other) > len(needed) + 1
            if dear or (most is not None and len(with_other) > most):
                continue
            nearest = min(nearest, away(view, other))
            if len(references) < REFERENCES and away(view, other) <= NO_FARTHER * nearest:
                references.append(other)
                needed = with_other
        needs[view] = needed
        order.append(EnhancedView(view, tuple(sorted(references))))
        left.remove(view)
        decoded.append(view)
    return tuple(order)


def view_quantizers(header: EnhancementHeader, quantizer: float) -> dict[Position, int]:
    """The quantizer, 1..63, of each view of a layer: the more others build on it, the finer.

    What such a view has that synthesis missed is in the predictions of all those: its bits serve them too.

    Args:
        quantizer: the mean over the views, but for rounding each and the ends of the scale.
    """
    views = [each.view for each in header.views]
    needed = [each.view for view in views for each in header.needed([view]) if each.view != view]
    shares = {view: needed.count(view) / max(len(views) - 1, 1) for view in views}
    mean = sum(shares.values()) / len(views)
    found = {view: round(quantizer - FINER_FOR_OTHERS * (share - mean)) for view, share in shares.items()}
    return {view: min(max(value, 1), MAX_QUANTIZER) for view, value in found.items()}


class Enhancer:
    """Codes the layer of a stream. The base is decoded here, as decoders do.

    Args:
        header: the base's.
        views: virtual ones.
        quantizer: 1..63, the mean of all views'; see `view_quantizers`.
        preset: effort, one of PRESETS.
        asked: what the quantizer was chosen for, for the record.
        most: as in `layer_order`.
        second_reference: one of REFERENCE_CODECS.

    Raises:
        LibvpxMissing: there is no libvpx.
    """

    def __init__(
        self,
        header: StreamHeader,
        views: Sequence[Position],
        quantizer: float,
        preset: str,
        asked: float | str,
        most: int | None = None,
        second_reference: str = "none",
    ) -> None:
        size = even_size(header.array.width, header.array.height)
        self._order = layer_order(header.array, views, most)
        speed, references = SPEEDS[preset], reference_count(second_reference)
        self.header = EnhancementHeader(self._order, {"enhance": asked, "speed": speed}, second_reference)
        self._base_header, self._base = header, StreamTracks(header)
        self._encoders = {
            view: Vp9ReferenceEncoder(ReferenceSettings(*size, each, references, speed))
            for view, each in view_quantizers(self.header, quantizer).items()
        }

    def push(self, base: Sequence[Packet], pictures: Mapping[Position, Picture]) -> list[Packet]:
        """Code the layer of one frame set.

        Args:
            base: its packets, the header's first at a keyframe.
            pictures: uint8 (H, W, 3) RGB of the layer's views, at least.

        Returns:
            The base's packets, at a keyframe the layer's header behind the base's, and behind all one packet
            for each view.
        """
        keyframe = base[0].keyframe
        frame = FramePrediction(self._base_header, self._base.decode(base))
        index, time_ns = base[0].index, base[0].time_ns
        units = self._code_views(frame, pictures, keyframe)
        packets = list(base)
        if keyframe:
            packets.insert(1, Packet(LAYER_TRACK, index, time_ns, True, self.header.to_json()))
        layer = (Packet(each.track, index, time_ns, keyframe, units[each.view]) for each in self._order)
        return [*packets, *layer]

    def _code_views(
        self, frame: FramePrediction, pictures: Mapping[Position, Picture], keyframe: bool
    ) -> dict[Position, bytes]:
        found: dict[Position, bytes] = {}
        waiting = list(self._order)
        while waiting:
            # Views whose references are there are coded side by side.
            ready = [each for each in waiting if not {w.view for w in waiting} & set(each.references)]
            second = self.header.second_reference
            predictions = [frame.predict(each.view, each.references, second) for each in ready]
            originals = [to_planes(pictures[each.view]) for each in ready]
            units = run_all(
                self._code, [each.view for each in ready], originals, predictions, [keyframe] * len(ready)
            )
            for each, unit in zip(ready, units, strict=True):
                found[each.view] = unit
                frame.add(each.view, self._encoders[each.view].decoded)
            waiting = [each for each in waiting if each not in ready]
        return found

    def _code(self, view: Position, original: Planes, prediction: list[Planes], keyframe: bool) -> bytes:
        return self._encoders[view].push(original, prediction, keyframe)
