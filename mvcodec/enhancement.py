"""What a stream says of its enhancement layer: views that were coded from the synthesis of the base."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from mvcodec.array import Position
from mvcodec.errors import StreamError
from mvcodec.fields import Fields
from mvcodec.stream import (
    PREDICTORS,
    REFERENCE_CODECS,
    StreamHeader,
    Track,
    TrackKind,
    second_reference_of,
)

LAYER_VERSION = 1
LAYER_TRACK = Track(TrackKind.LAYER)


@dataclass(frozen=True, slots=True)
class EnhancedView:
    """A view of the layer.

    Attributes:
        references: real cameras, and views of the layer that stand before it.
    """

    view: Position
    references: tuple[Position, ...]

    @property
    def track(self) -> Track:
        """The track of its pictures."""
        return Track(TrackKind.ENHANCED, self.view)


@dataclass(frozen=True, slots=True)
class EnhancementHeader:
    """Sent behind the stream's header with each keyframe.

    Attributes:
        views: in the order of decoding.
        settings: the encoder's, for the record.
        second_reference: one of REFERENCE_CODECS.
        predictor: one of PREDICTORS.
    """

    views: tuple[EnhancedView, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)
    second_reference: str = "none"
    predictor: str = PREDICTORS[-1]

    def to_json(self) -> bytes:
        """UTF-8 JSON as FORMAT.md specifies it."""
        views = [{"view": each.view, "from": each.references} for each in self.views]
        document = {
            "format": "mvcodec-enhancement",
            "version": LAYER_VERSION,
            "predictor": self.predictor,
            "codec": REFERENCE_CODECS[self.second_reference],
            "views": views,
            "settings": dict(self.settings),
        }
        return json.dumps(document, separators=(",", ":")).encode()

    @classmethod
    def from_json(cls, data: bytes, header: StreamHeader, source: str) -> EnhancementHeader:
        """Parse what `to_json` wrote.

        Args:
            header: of the base.

        Raises:
            StreamError: not that, a newer version, or views that cannot be predicted from the base.
        """
        try:
            document = json.loads(data)
            fields = Fields(source, document, error=StreamError)
            said = (
                fields.text("format"),
                fields.get("version", "1"),
                fields.text("predictor"),
            )
            codec = fields.text("codec")
            views = tuple(
                EnhancedView(_position(each["view"]), tuple(map(_position, each["from"])))
                for each in document["views"]
            )
            settings = dict(document["settings"])
        except StreamError:
            raise
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            found_text = f"a damaged enhancement header ({error})"
            raise StreamError(source, found_text, "the fields of FORMAT.md") from None
        expected = ("mvcodec-enhancement", LAYER_VERSION)
        second, predictor = second_reference_of(codec), said[2]
        if said[:2] != expected or predictor not in PREDICTORS or second is None:
            known = " or ".join(PREDICTORS), " or ".join(REFERENCE_CODECS.values())
            raise StreamError(source, f"an enhancement layer of {(*said, codec)}", f"{(*expected, *known)}")
        found = cls(views, settings, second, predictor)
        found._check(header, source)
        return found

    def _check(self, header: StreamHeader, source: str) -> None:
        decoded = set(header.array.real)
        if not header.map_cameras:
            raise StreamError(source, "an enhancement layer of a file without maps", "maps to predict from")
        for each in self.views:
            inside = 0 <= each.view[0] < header.array.rows and 0 <= each.view[1] < header.array.cols
            if each.view in decoded or not inside:
                raise StreamError(source, f"an enhanced view {list(each.view)}", "virtual views, each once")
            if not each.references or not decoded.issuperset(each.references):
                found = f"view {list(each.view)} from {[list(other) for other in each.references]}"
                raise StreamError(source, found, "pictures that are decoded before")
            decoded.add(each.view)

    def needed(self, wanted: Collection[Position] | None) -> tuple[EnhancedView, ...]:
        """The views that must be decoded for some (None: all), in order."""
        due = {each.view for each in self.views} if wanted is None else set(wanted)
        for each in reversed(self.views):
            if each.view in due:
                due.update(each.references)
        return tuple(each for each in self.views if each.view in due)


def _position(value: Any) -> Position:
    row, col = value
    if type(row) is not int or type(col) is not int:
        raise TypeError(f"no position: {value}")
    return row, col
