"""What the tracks of a frame set gave, made into pictures and maps of every camera."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from mvcodec.array import Position
from mvcodec.decoding.estimated_maps import MapsOnDemand, can_be_estimated, estimate_maps
from mvcodec.decoding.on_demand import OnDemand
from mvcodec.decoding.pipeline import DecodedTracks
from mvcodec.decoding.sent_maps import sent_maps
from mvcodec.decoding.stand_in import fill_absent
from mvcodec.frames import DecodedSet, DisparityMap, Picture
from mvcodec.stereo.matcher import Matcher
from mvcodec.stream import StreamHeader, Track, TrackKind
from mvcodec.video.colour import to_picture


def decoded_set(header: StreamHeader, tracks: DecodedTracks, matcher: Matcher | None) -> DecodedSet | None:
    """The decoded set; pictures and maps are made when somebody looks at them.

    Args:
        matcher: estimates the maps of a stream whose decoder does so; else None.

    Returns:
        None where no map can be had of any camera that is there.
    """
    array, span, reasons = header.array, header.disparity_range_px, tracks.reasons
    there = [camera for camera in array.real if camera not in reasons]
    senders = [camera for camera in header.map_cameras if camera not in reasons]
    if matcher is not None and not can_be_estimated(array, there):
        matcher = None
    if not (senders or matcher):
        return None
    textures = [tracks.planes[header.picture_track(camera)] for camera in there]
    pictures: Mapping[Position, Picture] = OnDemand(
        dict(zip(there, textures, strict=True)),
        lambda _, found: to_picture(found, array.width, array.height),
    )
    disparities: Mapping[Position, DisparityMap]
    if matcher is None:
        coded = {camera: tracks.planes[Track(TrackKind.DISPARITY, camera)] for camera in senders}
        disparities = sent_maps(header, coded, pictures, there)
    else:
        disparities = MapsOnDemand(there, partial(estimate_maps, array, pictures, span, matcher))
    if reasons:
        pictures, disparities = fill_absent(array, pictures, disparities)
    absent = tuple(camera for camera in array.real if camera in reasons)
    return DecodedSet(array, tracks.first.index, tracks.first.time_ns, pictures, disparities, span, absent)
