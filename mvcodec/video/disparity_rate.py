"""How many bits the maps get: their scale and their quantiser for a quantiser of the pictures.

A model fitted to shop_v3, shop_v4 and the sample scene (H.264, preset slow, pictures of QP 22 to 35). The
best map QP is the one where PSNR - s * ln(bits) of all views peaks, s the slope of the curve over picture
QPs: coarser maps would then cost more PSNR than coarser pictures that save as much. Less the picture QP, it
was

    | set     | range, px | full size, at QP 27, 30, 33 | half size, at QP 27, 30, 33 |
    | shop_v3 | 110       | 0, +1, 0 (QP 35)            | -4, -4, -5 (QP 35)          |
    | shop_v4 | 61        | >= +7, +9, +9               | >= 0, +4, +5                |
    | sample  | 42        | >= +7, +7, +9               | >= 0, +4, +4                |

so the wider the range (the more pixels a code value is worth), the finer the maps: 6 QPs an octave. Of
narrow ranges the model takes less than it could, 0 at half size: coarser maps save another 1 to 2 % of the
bits at equal PSNR of all views, but in the middle view of the sample (QP 33) the edges of thin and of round
things break, for 0.36 dB less than with the pictures' own QP. Half size then costs fewer bits at equal PSNR
at QP 27 (3 to 4 %; shop_v4: 0.6 %), 30 and 33; at QP 22 full size wins on the sample (2 %), and neither on
shop_v3. `tools/disparity_qp.py` measures the same on any input.

All that is of maps from every camera. Maps from every second camera, the others derived, cost fewer bits at
equal PSNR on all three sets and shop_v2: 3 to 4 % at QP 27, 4 to 9 at 32 and 37; on shop_v3 0.5 % at QP 25.

Those are worth finer maps, since each serves two views: 3 QPs less gain 0.09, 0.08 and 0.07 dB at equal
bits on shop_v4, shop_v3 and shop_v2 at QP 28, and 0.06, 0.07 and -0.05 at QP 35 (sample: -0.04, -0.03).
Hence 2 less.

Where every camera sends a map, fine pictures bear coarser ones of half size: against maps of the pictures'
QP, 5 QPs more save 1.9, 1.2, 1.7 and 0.5 % of the bits at equal PSNR at QP 27 on tsukuba, art, cones and
moebius; 3 QPs more at QP 32 and 37 cost up to 3.6 %. Hence 5 more at QP 28 and below, less up to QP 33.
"""

from __future__ import annotations

import math

from mvcodec.array import CameraArray
from mvcodec.video.codecs import find_codec

REFERENCE_PX = 64.0
"""Range of disparities, between neighbouring real cameras, up to which the models' offsets hold."""

FINE_UNTIL = 33
"""The QP from which on pictures are too coarse for `fine_extra`."""

MOST_OCTAVES = 2.0
"""Ranges wider than REFERENCE_PX by more octaves count as these: the fit has nothing beyond."""

SMALLEST_HALVED = 64
"""px; maps of smaller pictures are not halved: there is little to gain, and libx265 takes none below 16."""


FEWEST_EACH_WAY = 2
"""Real rows and columns of arrays in which maps are left out: one derived from two sides has few holes."""


def default_disparity_scale(quality: float | None, codec: str, width: int, height: int) -> int:
    """1 or 2, as `StreamHeader.disparity_scale`; quality is None where a bit rate governs."""
    if min(width, height) < SMALLEST_HALVED:
        return 1
    return 2 if quality is None or quality >= find_codec(codec).maps.half_from else 1


def default_disparity_cameras(quality: float | None, codec: str, array: CameraArray) -> str:
    """One of DISPARITY_CAMERAS; quality is None where a bit rate governs."""
    if min(len(array.real_rows), len(array.real_cols)) < FEWEST_EACH_WAY:
        return "all"
    return "alternate" if quality is None or quality >= find_codec(codec).maps.half_from else "all"


def best_disparity_cameras(quality: float | None, codec: str, array: CameraArray) -> str:
    """One of DISPARITY_CAMERAS: what costs fewest bits at equal quality, whatever it takes to decode."""
    if len(array.real) > 1:
        return "none"
    return default_disparity_cameras(quality, codec, array)


def default_disparity_qp(
    quality: float, scale: int, cameras: str, range_px: tuple[float, float], codec: str = "h264"
) -> int:
    """The maps' constant QP for a QP (or CRF) of the pictures, within the codec's scale.

    Args:
        scale: 1 or 2, as `StreamHeader.disparity_scale`.
        cameras: as `StreamHeader.disparity_cameras`.
        range_px: (lo, hi), as `StreamHeader.disparity_range_px`.
    """
    model = find_codec(codec).maps
    octaves = math.log2((range_px[1] - range_px[0]) / REFERENCE_PX)
    offset = (model.half if scale == 2 else model.full) - model.octave * min(max(octaves, 0), MOST_OCTAVES)
    if cameras == "alternate":
        offset += model.alternate
    elif scale == 2:
        offset += min(max(FINE_UNTIL - quality, 0), model.fine_extra)
    return min(max(round(quality + offset), 1), find_codec(codec).max_qp)
