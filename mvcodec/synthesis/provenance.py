"""Where the pixels of a view come from: how many real cameras, and which depth layer, as a picture.

It lies beside the view's own picture, ``r00_c00/000000.provenance.png`` beside ``r00_c00/000000.png``:
8-bit RGB whose values are plain numbers.

- Red: how many real cameras saw the pixel; 0 = none did, it is filled.
- Green + 256 * blue: its layer, counted from 1 = the farthest; 0 = in no layer, as filled pixels are. In
  nearly every scene blue is 0, and to the eye the picture is the greener the nearer, black where filled.

The PNG text ``layers_px`` says what each layer is: JSON, [lowest, highest] disparity of each, farthest
first, px between neighbouring real cameras.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import DisparityMap, LayerStack, Picture, RenderedView
from mvcodec.layers.dils_split import split_levels

PROVENANCE_SUFFIX = ".provenance.png"
LAYERS_TEXT = "layers_px"
"""Key of the PNG text that holds the layers' disparities."""


@dataclass(frozen=True, slots=True, eq=False)
class Provenance:
    """Where the pixels of one view come from.

    Attributes:
        seen_by: uint8 (H, W), how many real cameras saw each pixel; 0 = filled.
        layers: of the view's own disparity; filled pixels are in none (label 0).
    """

    seen_by: NDArray[np.uint8]
    layers: LayerStack

    @classmethod
    def of(cls, view: RenderedView) -> Provenance:
        """A layer for each whole disparity that more than 20 seen pixels have (`split_levels`)."""
        # The thesis's own split joins real scenes into one or two layers, which tells nothing.
        return cls(view.seen_by, split_levels(DisparityMap(view.disparity_px, view.seen_by > 0)))

    def picture(self) -> Picture:
        """uint8 (H, W, 3): red, green and blue as above."""
        low, high = self.layers.labels & 0xFF, self.layers.labels >> 8
        return np.dstack([self.seen_by, low.astype(np.uint8), high.astype(np.uint8)])


def provenance_name(frame: int) -> str:
    """``000000.provenance.png``: the name beside the picture of that number."""
    return f"{frame:06d}{PROVENANCE_SUFFIX}"


def seen_by(picture: Picture) -> NDArray[np.uint8]:
    """uint8 (H, W), how many real cameras saw each pixel, from `Provenance.picture`."""
    return np.ascontiguousarray(picture[..., 0])


def layer_labels(picture: Picture) -> NDArray[np.uint16]:
    """uint16 (H, W), the layer of each pixel, from `Provenance.picture`; 0 = in none."""
    return picture[..., 1] + (picture[..., 2].astype(np.uint16) << 8)
