"""The photographs that ship inside scikit-image, as filtered textures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import MissingExtra
from mvcodec.frames import Picture

PHOTOGRAPHS = (
    "astronaut",
    "brick",
    "camera",
    "chelsea",
    "clock",
    "coffee",
    "coins",
    "grass",
    "gravel",
    "hubble_deep_field",
    "moon",
    "rocket",
)
"""Names in `skimage.data` whose files lie in the wheel: no download."""

_LONGEST_PX = 640


def photographs() -> Any:
    """The module ``skimage.data``.

    Raises:
        MissingExtra: scikit-image is not installed.
    """
    try:
        import skimage.data
    except ModuleNotFoundError:
        raise MissingExtra("scikit-image", "scenes") from None
    return skimage.data


@cache
def photograph(name: str) -> Picture:
    """A photograph as uint8 (H, W, 3) RGB, shrunk to 640 px at most; grey ones as three channels.

    Args:
        name: one of PHOTOGRAPHS.

    Raises:
        MissingExtra: scikit-image is not installed.
    """
    picture: NDArray[np.uint8] = getattr(photographs(), name)()
    if picture.ndim == 2:
        picture = np.repeat(picture[..., None], 3, axis=2)
    scale = _LONGEST_PX / max(picture.shape[:2])
    if scale < 1:
        size = round(picture.shape[1] * scale), round(picture.shape[0] * scale)
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    picture.flags.writeable = False
    return picture


def pyramids(pictures: Sequence[Picture]) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """(texels, levels) of all pictures as `kernels.texture.Paint` wants them."""
    chains = [_halvings(picture) for picture in pictures]
    depth = max(len(chain) for chain in chains)
    levels = np.empty((len(chains), depth, 3), np.int64)
    parts: list[NDArray[Any]] = []
    offset = 0
    for number, chain in enumerate(chains):
        for level, picture in enumerate(chain):
            levels[number, level] = offset, picture.shape[1], picture.shape[0]
            parts.append(picture.reshape(-1, 3))
            offset += len(parts[-1])
        levels[number, len(chain) :] = levels[number, len(chain) - 1]
    return np.concatenate(parts), levels


def _halvings(picture: Picture) -> list[Picture]:
    """The picture and its halvings down to a single pixel."""
    chain = [picture]
    while max(chain[-1].shape[:2]) > 1:
        height, width = chain[-1].shape[:2]
        size = max(width // 2, 1), max(height // 2, 1)
        chain.append(np.asarray(cv2.resize(chain[-1], size, interpolation=cv2.INTER_AREA), np.uint8))
    return chain
