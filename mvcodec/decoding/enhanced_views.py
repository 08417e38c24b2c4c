"""Decodes the enhancement layer: views that were coded from the synthesis of the base."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mvcodec.array import Position
from mvcodec.decoding.on_demand import OnDemand
from mvcodec.enhancement import EnhancedView, EnhancementHeader
from mvcodec.errors import MissingReference, StreamError
from mvcodec.frames import DecodedSet, FinishedView
from mvcodec.stream import Packet, StreamHeader, Track, view_name
from mvcodec.synthesis.frame_prediction import FramePrediction
from mvcodec.synthesis.prediction import FINE, IntMap
from mvcodec.video.codec import Planes
from mvcodec.video.colour import even_size, to_picture
from mvcodec.video.track import PredictedTrackDecoder


@dataclass(frozen=True, slots=True, eq=False)
class WaitingSet:
    """A frame set whose base is decoded, and what has come of its enhancement layer.

    Attributes:
        decoded: without enhanced views.
        planes: of the base's tracks, as far as they are there.
        first: one of its packets.
        packets: of the layer's tracks.
    """

    decoded: DecodedSet
    planes: Mapping[Track, Planes]
    first: Packet
    packets: dict[Track, Packet]


class EnhancedViews:
    """Decodes the views of a layer that are wanted, and those that they build on.

    Args:
        base: the stream's header.
        layer: the layer's.
        wanted: views; None: all.
        tell: told of each view that is shown from the base from now on, and why.
    """

    def __init__(
        self,
        base: StreamHeader,
        layer: EnhancementHeader,
        wanted: Collection[Position] | None,
        tell: Callable[[StreamError, str], None],
    ) -> None:
        self.layer, self.wanted, self._base, self._tell = layer, wanted, base, tell
        self._views = layer.needed(wanted)
        size = even_size(base.array.width, base.array.height)
        self._decoders = {each.view: PredictedTrackDecoder(size) for each in self._views}
        self._absent: set[Position] = set()

    @property
    def views(self) -> frozenset[Position]:
        """What is decoded: the views that are wanted, and those that they build on."""
        return frozenset(each.view for each in self._views)

    @property
    def tracks(self) -> set[Track]:
        """The tracks whose packets `finish` wants."""
        return {each.track for each in self._views}

    def finish(self, waiting: WaitingSet, label: Callable[[Packet], str]) -> DecodedSet:
        """The frame set with its views; those that cannot be decoded are left out and told once.

        Args:
            label: what to call a packet in an error.
        """
        planes = waiting.planes
        frame = FramePrediction(self._base, planes)
        there = {camera for camera in self._base.array.real if self._base.picture_track(camera) in planes}
        found: dict[Position, tuple[Planes, IntMap]] = {}
        for each in self._views:
            try:
                name = label(replace(waiting.first, track=each.track))
                picture = self._decode(each, frame, there, waiting, name)
            except StreamError as error:
                if each.view not in self._absent:
                    name = view_name(each.view)
                    self._tell(error, f"; view {name} is shown from the base meanwhile")
                self._absent.add(each.view)
                continue
            self._absent.discard(each.view)
            there.add(each.view)
            frame.add(each.view, picture)
            found[each.view] = picture, frame.disparity(each.view)
        # Of views that others build on nobody may want to see a picture.
        return replace(waiting.decoded, enhanced=OnDemand(found, self._finished))

    def _finished(self, _: Position, coded: tuple[Planes, IntMap]) -> FinishedView:
        planes, fine = coded
        width, height = self._base.array.width, self._base.array.height
        values = fine[:height, :width].astype(np.float32) / np.float32(FINE)
        return FinishedView(to_picture(planes, width, height), values)

    def _decode(
        self,
        each: EnhancedView,
        frame: FramePrediction,
        there: set[Position],
        waiting: WaitingSet,
        label: str,
    ) -> Planes:
        decoder = self._decoders[each.view]
        packet = waiting.packets.get(each.track)
        if packet is None:
            decoder.lost = True
            raise MissingReference(label, "no packet", "one for each view of a frame set")
        maps = self._base.needed_maps(each.view, each.references)
        whole = there.issuperset(each.references) and maps <= waiting.planes.keys()

        def predictions() -> list[Planes]:
            return frame.predict(each.view, each.references, self.layer.second_reference)

        return decoder.push(packet, label, predictions if whole else None)
