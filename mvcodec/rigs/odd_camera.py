"""A camera whose picture fits none of its neighbours': it is dark, blank, mirrored, or of something else."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.frames import Picture
from mvcodec.rigs.features import FEWEST, Features
from mvcodec.rigs.order import FEWEST_SURE, camera_name

Links = Mapping[tuple[Position, Position], NDArray[np.int64]]

_ODD_SHARE = 0.35
"""Of the matches that the other cameras have: what has fewer is looked at more closely."""
_MIRRORED_GAIN = 2.0
_DARK_LEVELS = 12.0


def odd_camera(
    pictures: Mapping[Position, Picture],
    features: Mapping[Position, Features],
    links: Links,
    matched: Callable[[Picture, Position], int],
) -> tuple[str, str] | None:
    """(kind, what is wrong) of the camera that fits the others worst; None where all fit, or none does.

    Args:
        pictures: uint8 (H, W, 3) RGB of each camera.
        features: of each camera.
        links: matches of neighbours that agree.
        matched: how many matches a picture has with a camera.
    """
    best = {
        camera: max((len(kept) for pair, kept in links.items() if camera in pair), default=0)
        for camera in features
    }
    usual = float(np.median(list(best.values())))
    odd = min(best, key=lambda camera: best[camera])
    # Two cameras can't tell which of them is odd.
    if len(best) < 3 or usual < 2 * FEWEST_SURE or best[odd] >= max(FEWEST, _ODD_SHARE * usual):
        return None
    name = camera_name(odd)
    if pictures[odd].mean() < _DARK_LEVELS:
        return "dark", f"the picture of camera {name} is dark; is its lens covered, or its light too low?"
    if len(features[odd].xy_px) < FEWEST:
        return "blank", f"the picture of camera {name} shows no texture; is something before its lens?"
    beside = [one if other == odd else other for one, other in links if odd in (one, other)]
    friend = max(beside, key=lambda camera: best[camera])
    mirrored = np.ascontiguousarray(pictures[odd][:, ::-1])
    if matched(mirrored, friend) > max(FEWEST_SURE, _MIRRORED_GAIN * best[odd]):
        return "mirrored", (
            f"camera {name} is mirrored against {camera_name(friend)}; mirror its picture, left for right"
        )
    if best[odd] < FEWEST:
        return "alone", (
            f"camera {name} shows hardly anything that its neighbours show; is it turned away or on its"
            " side, or are the pictures another camera's?"
        )
    return None
