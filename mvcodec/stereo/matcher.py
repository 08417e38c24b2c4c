"""The extension points of matching: pairs of pictures, and whole arrays of real cameras."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

from mvcodec.array import CameraArray, Position
from mvcodec.frames import DisparityMap, FrameSet, Picture


class PairMatcher(Protocol):
    """Matches a rectified pair. What a plug-in of one's own usually is; see `Pairwise`."""

    def match_pair(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[DisparityMap, DisparityMap]:
        """Disparity of both pictures of a horizontal pair.

        Args:
            left, right: uint8 (H, W, 3) RGB.
            range_px: (lo, hi), px; may be negative.

        Returns:
            The maps of left and right, both in the sign of ALGORITHMS section 0: a pixel x of
            the left one is at ``x - d`` in the right one, a pixel x of the right one at
            ``x + d`` in the left one. `valid` is False where the two contradict each other;
            every value is finite all the same (filled).
        """
        ...


@runtime_checkable
class SelectiveMatcher(Protocol):
    """A Matcher that saves time where only some cameras' maps are wanted."""

    def match_cameras(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
    ) -> dict[Position, DisparityMap]:
        """Disparity of some real cameras; the other arguments are those of `Matcher.match`.

        Args:
            cameras: the ones wanted.
            fresh: nothing may depend on earlier frame sets, as it may otherwise. So it is at keyframes, for
                segments that are coded apart.
        """
        ...


@runtime_checkable
class HalvingMatcher(Protocol):
    """A Matcher that has maps of half size before it has those of full size."""

    def match_halved(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
    ) -> dict[Position, DisparityMap] | None:
        """Disparity of some real cameras, for maps that are coded at half size.

        The arguments are those of `SelectiveMatcher.match_cameras`.

        Returns:
            Maps of half the size, rounded up; sample (v, u) is that of the pixels 2v, 2v + 1 and 2u, 2u + 1,
            in px of the whole pictures. None where this matcher has none of pictures of this size.
        """
        ...


@runtime_checkable
class FrameMatcher(Protocol):
    """A Matcher that looks at more of a frame set than its pictures."""

    def match_frames(
        self, array: CameraArray, frames: FrameSet, range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """Disparity of every real camera, as `Matcher.match` has it."""
        ...


class Matcher(Protocol):
    """Estimates one map for each real camera of an array. What the encoder calls."""

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """Disparity of every real camera, for the baseline of one cell.

        Args:
            array: the geometry.
            pictures: uint8 (H, W, 3) RGB by real camera.
            range_px: (lo, hi) between neighbouring real cameras, px.
        """
        ...
