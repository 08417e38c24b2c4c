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
_FEW_SHARE = 0.2
"""Of the features of a picture: two of a mirrored pair have up to half as many matches by chance."""
_RICH = 150
"""Features that a picture shows some of to other cameras, if these look at the same things."""


def odd_camera(
    pictures: Mapping[Position, Picture],
    features: Mapping[Position, Features],
    links: Links,
    matched: Callable[[Picture, Position], int],
) -> tuple[str, str] | None:
    """(kind, what is wrong) of the camera that fits the others worst; None where all fit.

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
    if len(best) < 3 or usual < 2 * FEWEST_SURE or best[odd] >= max(FEWEST, _ODD_SHARE * usual):
        return _of_few(pictures, features, links, matched) if len(best) <= 3 else None
    unseen = _unseen(odd, pictures[odd], features[odd])
    if unseen is not None:
        return unseen
    beside = [one if other == odd else other for one, other in links if odd in (one, other)]
    friend = max(beside, key=lambda camera: best[camera])
    if matched(_mirrored(pictures[odd]), friend) > max(FEWEST_SURE, _MIRRORED_GAIN * best[odd]):
        return "mirrored", (
            f"camera {camera_name(odd)} is mirrored against {camera_name(friend)}; mirror its picture, left"
            " for right"
        )
    return _alone(odd) if best[odd] < FEWEST else None


def _of_few(
    pictures: Mapping[Position, Picture],
    features: Mapping[Position, Features],
    links: Links,
    matched: Callable[[Picture, Position], int],
) -> tuple[str, str] | None:
    """As `odd_camera` for two or three: one of two may be odd, or one between the others."""
    rich = [camera for camera, found in features.items() if len(found.xy_px) >= _RICH]
    for pair, kept in links.items():
        few = max(FEWEST_SURE, _FEW_SHARE * min(len(features[camera].xy_px) for camera in pair))
        if len(kept) >= few or not set(rich) & set(pair):
            continue
        for camera in pair:
            unseen = None if camera in rich else _unseen(camera, pictures[camera], features[camera])
            if unseen is not None:
                return unseen
        one, other = pair
        names = f"cameras {camera_name(one)} and {camera_name(other)}"
        if matched(_mirrored(pictures[one]), other) > max(FEWEST_SURE, _MIRRORED_GAIN * len(kept)):
            return (
                "mirrored",
                f"{names} are mirrored against each other; mirror one's picture, left for right",
            )
        if len(kept) >= FEWEST or not set(pair) <= set(rich):
            continue
        beyond = [camera for link in links if other in link for camera in link if camera not in pair]
        if any(matched(pictures[one], camera) > FEWEST_SURE for camera in beyond):
            return _alone(other)
        return (
            "alone",
            f"{names} show hardly anything in common; do they look at the same things at one time?",
        )
    return None


def _unseen(camera: Position, picture: Picture, found: Features) -> tuple[str, str] | None:
    """Why a picture shows nothing; None where it shows something."""
    name = camera_name(camera)
    if picture.mean() < _DARK_LEVELS:
        return "dark", f"the picture of camera {name} is dark; is its lens covered, or its light too low?"
    if len(found.xy_px) < FEWEST:
        return "blank", f"the picture of camera {name} shows no texture; is something before its lens?"
    return None


def _alone(camera: Position) -> tuple[str, str]:
    return "alone", (
        f"camera {camera_name(camera)} shows hardly anything that its neighbours show; is it turned away or"
        " on its side, or are the pictures another camera's?"
    )


def _mirrored(picture: Picture) -> Picture:
    return np.ascontiguousarray(picture[:, ::-1])
