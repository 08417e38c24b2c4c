"""Refinement of maps after any matcher, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, Picture
from mvcodec.layers.dlr import DlrSettings, refine
from mvcodec.stereo.matcher import Matcher
from mvcodec.stereo.pairwise import transposed
from mvcodec.stereo.table import make_matcher

_Pixel = TypeVar("_Pixel", bound=np.generic)


@dataclass(frozen=True, slots=True)
class Dlr:
    """Matcher that refines what another one finds, map by map, by Depth Layer Refinement."""

    matcher: Matcher
    settings: DlrSettings = field(default_factory=DlrSettings)

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
            return refine(
                picture, disparity, partner_is_right=camera[1] < array.cols - 1, settings=self.settings
            )
        turned = refine(
            transposed(picture),
            DisparityMap(_turned(disparity.values_px), _turned(disparity.valid)),
            partner_is_right=camera[0] < array.rows - 1,
            settings=self.settings,
        )
        return DisparityMap(_turned(turned.values_px), _turned(turned.valid))


def _turned(plane: NDArray[_Pixel]) -> NDArray[_Pixel]:
    return np.ascontiguousarray(plane.T)


REFINEMENTS: dict[str, Callable[[Matcher], Matcher]] = {"dlr": Dlr}

SEPARATOR = "+"
"""Between the name of a matcher and that of the refinement that follows it: ``sad+dlr``."""


def matcher_by_name(name: str) -> Matcher:
    """The matcher of this name, one of MATCHERS, refined where that of a refinement follows: ``sad+dlr``.

    Raises:
        SettingError: there is none; the message names the choices.
    """
    base, separator, refinement = name.partition(SEPARATOR)
    matcher = make_matcher(base)
    if not separator:
        return matcher
    if refinement not in REFINEMENTS:
        choices = " or ".join(f"{base}{SEPARATOR}{known}" for known in REFINEMENTS)
        raise SettingError("matcher", name, f"{base} or {choices}")
    return REFINEMENTS[refinement](matcher)
