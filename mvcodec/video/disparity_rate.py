"""How many bits the maps get: their scale and their quantiser for a quantiser of the pictures.

A model fitted to what tools/disparity_qp.py measures.
"""

from __future__ import annotations

from dataclasses import dataclass

from mvcodec.video.table import find_codec


@dataclass(frozen=True, slots=True)
class MapModel:
    """What maps are coded with, from the pictures' QP or CRF, all on the codec's own scale.

    Attributes:
        half_from: the QP from which on maps are coded at half size each way.
        full: map QP less picture QP for maps of full size.
        half: the same for maps of half size.
    """

    half_from: float
    full: int
    half: int


MODELS = {
    "h264": MapModel(half_from=29, full=3, half=-3),
    "hevc": MapModel(half_from=29, full=3, half=-3),
    "av1": MapModel(half_from=39, full=7, half=-7),
}

SMALLEST_HALVED = 64
"""px; maps of smaller pictures are not halved: there is little to gain, and libx265 takes none below 16."""


def default_disparity_scale(quality: float | None, codec: str, width: int, height: int) -> int:
    """1 or 2, as `StreamHeader.disparity_scale`; 1 where a bit rate governs (quality is None)."""
    if quality is None or min(width, height) < SMALLEST_HALVED:
        return 1
    return 2 if quality >= MODELS[codec].half_from else 1


def default_disparity_qp(quality: float, scale: int, codec: str = "h264") -> int:
    """The maps' constant QP for a QP (or CRF) of the pictures, within the codec's scale."""
    model = MODELS[codec]
    offset = model.half if scale == 2 else model.full
    return min(max(round(quality) + offset, 1), find_codec(codec).max_qp)
