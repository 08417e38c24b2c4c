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


class SetMaker:
    """Makes the decoded sets of a stream.

    Args:
        matcher: estimates the maps of a stream whose decoder does so; else None.
    """

    def __init__(self, header: StreamHeader, matcher: Matcher | None) -> None:
        self._header, self._matcher = header, matcher
        keyframes, others = header.coding_error or (None, None)
        self._coding_error = {True: keyframes, False: others}
        self._pictures = {camera: header.picture_track(camera) for camera in header.array.real}
        self._maps = {camera: Track(TrackKind.DISPARITY, camera) for camera in header.map_cameras}

    def make(self, tracks: DecodedTracks) -> DecodedSet | None:
        """A decoded set, whose pictures and maps are made when somebody looks at them.

        Returns:
            None where no map can be had of any camera that is there.
        """
        header, first, planes, reasons = self._header, tracks.first, tracks.planes, tracks.reasons
        array, span, error = header.array, header.disparity_range_px, self._coding_error[first.keyframe]
        coded = {camera: planes[track] for camera, track in self._pictures.items() if camera not in reasons}
        maps = {camera: planes[track] for camera, track in self._maps.items() if camera not in reasons}
        matcher = self._matcher
        if matcher is not None and not can_be_estimated(array, [*coded]):
            matcher = None
        if not (maps or matcher):
            return None
        pictures: Mapping[Position, Picture] = OnDemand(
            coded, lambda _, found: to_picture(found, array.width, array.height)
        )
        disparities: Mapping[Position, DisparityMap]
        if matcher is None:
            disparities = sent_maps(header, maps, pictures, [*coded])
        else:
            find = partial(estimate_maps, array, pictures, span, matcher, error)
            disparities = MapsOnDemand([*coded], find)
        if reasons:
            pictures, disparities = fill_absent(array, pictures, disparities)
        absent = tuple(camera for camera in self._pictures if camera in reasons)
        return DecodedSet(
            array, first.index, first.time_ns, pictures, disparities, span, absent, coding_error=error
        )
