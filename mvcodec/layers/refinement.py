"""Refinement of maps after any matcher, and the matchers by name, refined or not."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import DisparityMap, Picture
from mvcodec.layers import dlr, dlr_thesis
from mvcodec.plugin_tables import Chosen, Plugin, PluginTable
from mvcodec.stereo.matcher import Matcher
from mvcodec.stereo.matchers import MATCHER_PLUGINS, MATCHERS, make_base_matcher
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


def _dlr(settings: dlr.DlrSettings) -> Refinement:
    return partial(dlr.refine, settings=settings)


def _thesis_dlr(settings: dlr_thesis.ThesisDlrSettings) -> Refinement:
    def refine(picture: Picture, disparity: DisparityMap, *, partner_is_right: bool) -> DisparityMap:
        del partner_is_right  # the thesis's steps look at one picture and its map alone
        return dlr_thesis.refine(picture, disparity, settings=settings)

    return refine


REFINEMENTS: dict[str, Plugin] = {
    "dlr": Plugin(_dlr, dlr.DlrSettings, "depth layer refinement of our own, for maps of fixed windows"),
    "dlr-thesis": Plugin(
        _thesis_dlr, dlr_thesis.ThesisDlrSettings, "depth layer refinement as chapter 5 of the thesis has it"
    ),
}

REFINEMENT_PLUGINS = PluginTable("refinement", REFINEMENTS)

SEPARATOR = "+"
"""Between a matcher and the refinement that follows it: ``sad+dlr``."""

_PARTS = re.compile(r"\+(?=[A-Za-z])")  # not the sign of an exponent


def matcher_choices() -> str:
    """What `make_matcher` takes, for messages and help."""
    refinements = " or ".join(SEPARATOR + known for known in REFINEMENTS)
    return f"one of {', '.join(MATCHERS)}, with {refinements} behind it if wanted"


def make_matcher(specification: str) -> Matcher:
    """The matcher of this name and settings, refined where a refinement follows.

    Args:
        specification: ``joint``, ``sad:window=9``, ``sad:window=9+dlr`` ...

    Raises:
        SettingError: there is none, or a setting is unknown or outside its range; names the choices.
        InputError: another package's matcher does not load; names the package.
    """
    base, refinement = _parts(specification)
    matcher = make_base_matcher(base)
    return Refined(matcher, _refinement(refinement).make()) if refinement else matcher


def matcher_specification(specification: str) -> str:
    """The shortest one that says the same: without settings that have their defaults. Raises as above."""
    base, refinement = _parts(specification)
    words = [MATCHER_PLUGINS.choose(base)] + ([_refinement(refinement)] if refinement else [])
    return SEPARATOR.join(word.specification() for word in words)


def matcher_settings(specification: str) -> dict[str, dict[str, Any]]:
    """Every setting of a matcher and its refinement, by name, as plain JSON. Raises as above."""
    base, refinement = _parts(specification)
    words = [MATCHER_PLUGINS.choose(base)] + ([_refinement(refinement)] if refinement else [])
    return {word.name: word.all_settings() for word in words}


def _parts(specification: str) -> tuple[str, str]:
    base, *refinements = _PARTS.split(specification, maxsplit=1)
    return base, "".join(refinements)


def _refinement(specification: str) -> Chosen:
    return REFINEMENT_PLUGINS.choose(specification, "matcher refinement")
