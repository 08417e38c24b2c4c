"""Refinement of maps after any matcher, and the matchers by name, refined or not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, Picture
from mvcodec.layers import dlr, dlr_thesis
from mvcodec.stereo.matcher import Matcher
from mvcodec.stereo.matchers import MATCHERS, make_base_matcher
from mvcodec.stereo.pairwise import transposed

_Pixel = TypeVar("_Pixel", bound=np.generic)


class Refinement(Protocol):
    """Refines the map of one camera of a horizontal pair."""

    def __call__(self, picture: Picture, disparity: DisparityMap, *, partner_is_right: bool) -> DisparityMap:
        """The refined map, within the values of the given one.

        Args:
            picture: uint8 (H, W, 3) RGB, the camera's.
            disparity: of the camera.
            partner_is_right: whether the partner sees this camera's pixel x at ``x - d``, else at ``x + d``.
        """
        ...


@dataclass(frozen=True, slots=True)
class Refined:
    """Matcher that refines what another one finds, map by map."""

    matcher: Matcher
    refinement: Refinement

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher.match`."""
        maps = self.matcher.match(array, pictures, range_px)
        return {camera: self._refined(array, camera, pictures[camera], maps[camera]) for camera in maps}

    def _refined(
        self, array: CameraArray, camera: Position, picture: Picture, disparity: DisparityMap
    ) -> DisparityMap:
        if array.cols > 1:
            return self.refinement(picture, disparity, partner_is_right=camera[1] < array.cols - 1)
        turned = self.refinement(
            transposed(picture),
            DisparityMap(_turned(disparity.values_px), _turned(disparity.valid)),
            partner_is_right=camera[0] < array.rows - 1,
        )
        return DisparityMap(_turned(turned.values_px), _turned(turned.valid))


def _turned(plane: NDArray[_Pixel]) -> NDArray[_Pixel]:
    return np.ascontiguousarray(plane.T)


def _by_the_thesis(picture: Picture, disparity: DisparityMap, *, partner_is_right: bool) -> DisparityMap:
    del partner_is_right  # the thesis's steps look at one picture and its map alone
    return dlr_thesis.refine(picture, disparity)


REFINEMENTS: dict[str, Refinement] = {"dlr": dlr.refine, "dlr-thesis": _by_the_thesis}

SEPARATOR = "+"
"""Between the name of a matcher and that of the refinement that follows it: ``sad+dlr``."""


def matcher_choices() -> str:
    """What `make_matcher` takes, for messages and help."""
    refinements = " or ".join(SEPARATOR + known for known in REFINEMENTS)
    return f"one of {', '.join(MATCHERS)}, with {refinements} behind it if wanted"


def make_matcher(name: str) -> Matcher:
    """The matcher of this name, one of MATCHERS, refined where that of a refinement follows: ``sad+dlr``.

    Raises:
        SettingError: there is none; the message names the choices.
    """
    base, separator, refinement = name.partition(SEPARATOR)
    if base not in MATCHERS or (separator and refinement not in REFINEMENTS):
        raise SettingError("matcher", name, matcher_choices())
    matcher = make_base_matcher(base)
    return Refined(matcher, REFINEMENTS[refinement]) if separator else matcher
