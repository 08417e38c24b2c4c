"""The ways to split a disparity map into layers, by name; the thesis's own one first."""

from __future__ import annotations

from collections.abc import Callable

from mvcodec.frames import DisparityMap, LayerStack
from mvcodec.layers.dils_split import split, split_levels

LAYER_SPLITS: dict[str, Callable[[DisparityMap, int], LayerStack]] = {
    "runs": split,
    "levels": split_levels,
}
