"""The extension point: anything that renders a view of a decoded set is a Synthesizer."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from mvcodec.array import Viewpoint
from mvcodec.frames import DecodedSet, RenderedView


class Synthesizer(Protocol):
    """Renders views. Implementations may keep what they prepared for the last decoded set."""

    def render(self, decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView:
        """The view from `viewpoint` (in steps of the dense grid, within the real cameras' span).

        On a real camera's place it is that camera's decoded picture: exactly, where `decoded.coding_error` is
        None; else perhaps with less coding noise.

        Raises:
            SettingError: the viewpoint lies outside the span of the real cameras.
        """
        ...


@runtime_checkable
class Preparing(Protocol):
    """A synthesizer that can be told which decoded set comes next."""

    def prepare(self, decoded: DecodedSet, viewpoint: Viewpoint) -> None:
        """Do beforehand what the first `render` of this set from about this viewpoint would begin with.

        Raises:
            SettingError: as `Synthesizer.render`.
        """
        ...
