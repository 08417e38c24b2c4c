"""The maps of a frame set's cameras out of the planes that were sent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mvcodec.array import Position
from mvcodec.decoding.derived_maps import derive_map
from mvcodec.decoding.on_demand import OnDemand
from mvcodec.frames import DisparityMap, Picture
from mvcodec.stream import StreamHeader
from mvcodec.video.codec import Planes
from mvcodec.video.disparity_code import dequantise
from mvcodec.video.map_size import enlarged, small_size


def sent_maps(
    header: StreamHeader,
    coded: Mapping[Position, Planes],
    pictures: Mapping[Position, Picture],
    cameras: Sequence[Position],
) -> Mapping[Position, DisparityMap]:
    """Maps at the size of the pictures, each made when it is looked at: as sent, or derived from those.

    Args:
        coded: planes of the cameras that sent a map, at least one.
        pictures: uint8 (H, W, 3) RGB of `cameras`.
        cameras: all that a map is wanted of.
    """
    array, scale, range_px = header.array, header.disparity_scale, header.disparity_range_px
    width, height = small_size(array.width, array.height, scale)

    def as_sent(camera: Position, planes: Planes) -> DisparityMap:
        found = dequantise(planes.y[:height, :width], range_px)
        return found if scale == 1 else enlarged(found.values_px, pictures[camera])

    sent = OnDemand(coded, as_sent)

    def known(camera: Position, _: None) -> DisparityMap:
        return sent[camera] if camera in coded else derive_map(array, sent, range_px, camera)

    return OnDemand(dict.fromkeys(cameras), known)
