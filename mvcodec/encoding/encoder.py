"""Frame sets in, packets out: matches, quantises the maps, codes every track; see FORMAT.md."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from types import TracebackType
from typing import Any, Self

import numpy as np

import mvcodec
from mvcodec.array import CameraArray, Position
from mvcodec.depth import depth_mm, warn_behind_infinity
from mvcodec.encoding.config import EncoderConfig, default_gop, find_matcher, matcher_name
from mvcodec.encoding.enhancer import Enhancer, enhanced_views
from mvcodec.encoding.layer_rate import LayerRate
from mvcodec.encoding.predicted_cameras import PredictedCameras, predicted_quantizer, prediction_order
from mvcodec.errors import InputError, SettingError, StreamClosed
from mvcodec.frames import DisparityMap, FrameSet, Picture
from mvcodec.stereo.matcher import FrameMatcher, Matcher, SelectiveMatcher
from mvcodec.stream import (
    HEADER_TRACK,
    Packet,
    StreamHeader,
    Track,
    TrackKind,
    view_name,
)
from mvcodec.video.codec import (
    CodedPicture,
    Planes,
    RateControl,
    VideoEncoder,
    VideoSettings,
)
from mvcodec.video.codecs import find_codec
from mvcodec.video.colour import even_size, grey_planes, to_planes
from mvcodec.video.disparity_code import quantise
from mvcodec.video.map_size import coded_size, to_coded
from mvcodec.workers import Job, settle, submit, threads

__all__ = ["Encoder", "EncoderConfig", "default_gop", "find_matcher"]

KEYFRAME_NS = 1_000_000_000
"""A keyframe comes after this time at the latest, whatever the nominal frame rate says."""


class Encoder:
    """Codes an array's real cameras. One frame set in, its packets out, at once.

    Args:
        array: the geometry; only its real cameras are coded.
        config: settings; EncoderConfig() by default.
        matcher: asked in place of config's own (such as one that remembers what that one found); the
            header names config's.
        coded_before: frame sets of the same stream that another encoder codes, up to a keyframe. At a
            constant quantiser H.264 and AV1 then give the packets that one encoder for all would give, but
            for the header's `first_frame`; see `mvcodec.container.joining`.

    Raises:
        SettingError: a setting does not fit the array, or names an unknown matcher or preset.
    """

    def __init__(
        self,
        array: CameraArray,
        config: EncoderConfig | None = None,
        matcher: Matcher | None = None,
        *,
        coded_before: int = 0,
    ) -> None:
        self.array, self._coded_before = array, coded_before
        self.config = config or EncoderConfig()
        self._codec = find_codec(self.config.codec)
        longest = default_gop(array.fps)
        self._gop = self.config.gop or longest
        if self._gop > longest:
            raise SettingError(
                "gop", self._gop, f"1..{longest} (a keyframe each second at {array.fps:g} fps)"
            )
        self._matcher = matcher or find_matcher(self.config.chosen_matcher)
        self._scale = self.config.scale_for(array)
        self._median = self.config.median_for(array)
        size = even_size(array.width, array.height)
        rate = self.config.rate_of_pictures(array)
        several = self.config.prediction == "synthesis" and len(array.real) > 1
        self._order = prediction_order(array) if several else ()
        alone = tuple(camera for camera in array.real if camera not in {each.camera for each in self._order})
        self._encoders = self._make_encoders(TrackKind.TEXTURE, alone, size, rate)
        self._predicted: PredictedCameras | None = None
        self._enhancer: Enhancer | None = None
        asked = self.config.enhance_views
        self._layer_views = () if self.config.enhance is None else enhanced_views(array, asked)
        self._header: StreamHeader | None = None
        self._position = 0  # frame sets since the last keyframe, modulo the GOP
        self._key_ns = 0
        self._last: FrameSet | None = None
        self._maps: Mapping[Position, DisparityMap] = {}
        self._open = True

    @property
    def views(self) -> tuple[Position, ...]:
        """The views whose pictures `push` wants: real cameras, and those of the enhancement layer."""
        return tuple(sorted({*self.array.real, *self._layer_views}))

    @property
    def header(self) -> StreamHeader | None:
        """The stream's header; None before the first frame set."""
        return self._header

    def push(self, frames: FrameSet) -> list[Packet]:
        """Code one frame set.

        Returns:
            The header's packet where a GOP starts, then one packet for each track, pictures first.

        Raises:
            InputError: a real camera's picture is missing or of the wrong shape, or time goes back.
            StreamClosed: after `flush`.
        """
        if not self._open:
            raise StreamClosed("the encoder was flushed; it takes no more frame sets")
        self._check(frames)
        if self._header is None:
            self._header = self._make_header(frames)
            self._encoders |= self._make_map_encoders(self._header)
            self._predicted = self._make_predicted(self._header)
            self._enhancer = self._make_enhancer(self._header)
        # Should something fail below, the next frame set starts afresh with a keyframe.
        position, self._position = self._position, 0
        if self._last is not None and frames.time_ns - self._key_ns >= KEYFRAME_NS:
            position = 0  # frame sets came more slowly than their nominal rate
        numbered = self._codec.numbered and not (self._order or self._layer_views)
        if self._last is not None and frames.index != self._last.index + 1 and not numbered:
            position = 0  # else what was left out would look like what was lost
        jobs: dict[Track, Job[list[CodedPicture]]] = {}
        try:
            with threads(self.config.threads):
                self._submit(frames, position == 0, jobs)
        finally:
            settle(jobs.values())
        coded = {track: job.result()[0] for track, job in jobs.items()}
        if self._predicted is not None:
            with threads(self.config.threads):
                pictures = {each.camera: to_planes(frames.pictures[each.camera]) for each in self._order}
                coded |= self._predicted.push(coded, pictures, position == 0)
        packets = [_packet(track, frames, coded[track]) for track in self._header.tracks]
        if position == 0:
            self._key_ns = frames.time_ns
            head = Packet(HEADER_TRACK, frames.index, frames.time_ns, True, self._header.to_json())
            packets.insert(0, head)
        if self._enhancer is not None:
            with threads(self.config.threads):
                packets = self._enhancer.push(packets, frames.pictures)
        if self.config.depth:
            if self._last is None:
                maps = (found.values_px for found in self._maps.values())
                warn_behind_infinity(self.array, maps, self.array.name or "the array")
            packets += [
                _depth_packet(self.array, camera, frames, self._maps[camera]) for camera in self._maps
            ]
        self._position = (position + 1) % self._gop
        self._last = frames
        return packets

    def _submit(
        self,
        frames: FrameSet,
        keyframe: bool,
        jobs: dict[Track, Job[list[CodedPicture]]],
    ) -> None:
        """Start coding all tracks; the pictures are coded while the matcher runs."""
        pictures = {camera: frames.pictures[camera] for camera in self.array.real}
        assert self._header is not None
        for camera, picture in pictures.items():
            track = self._header.picture_track(camera)
            if track in self._encoders:
                jobs[track] = submit(self._code_picture, track, picture, keyframe)
        if not (self._header.map_cameras or self.config.depth):
            return
        range_px = self._header.disparity_range_px
        if isinstance(self._matcher, FrameMatcher):
            cameras = self.array.real
            maps = self._matcher.match_frames(self.array, frames, range_px)
        elif isinstance(self._matcher, SelectiveMatcher) and not self.config.depth:
            cameras = self._header.map_cameras
            maps = self._matcher.match_cameras(self.array, pictures, range_px, cameras, keyframe)
        else:
            cameras = self.array.real
            maps = self._matcher.match(self.array, pictures, range_px)
        values = {camera: self._checked_map(maps, camera) for camera in cameras}
        self._maps = values
        for camera in self._header.map_cameras:
            track = Track(TrackKind.DISPARITY, camera)
            jobs[track] = submit(self._code_map, track, values[camera], keyframe)

    def flush(self) -> list[Packet]:
        """End the stream. Returns nothing, since no packet waits; `push` is an error from now on."""
        if self._open:
            self._open = False
            for encoder in self._encoders.values():
                encoder.flush()
        return []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.flush()

    def _make_encoders(
        self, kind: TrackKind, cameras: tuple[Position, ...], size: tuple[int, int], rate: RateControl
    ) -> dict[Track, VideoEncoder]:
        settings = VideoSettings(
            kind,
            *size,
            self.array.fps,
            self._gop,
            rate,
            self.config.chosen_preset,
            coded_before=self._coded_before,
        )
        return {Track(kind, camera): self._codec.encoder(settings) for camera in cameras}

    def _make_map_encoders(self, header: StreamHeader) -> dict[Track, VideoEncoder]:
        if not header.map_cameras:
            return {}
        size = coded_size(self.array.width, self.array.height, self._scale)
        rate = self.config.rate_of_maps(self.array, header.disparity_range_px)
        return self._make_encoders(TrackKind.DISPARITY, header.map_cameras, size, rate)

    def _make_predicted(self, header: StreamHeader) -> PredictedCameras | None:
        if not header.predicted:
            return None
        assert self.config.quality is not None
        quantizer = predicted_quantizer(self.config.quality, self._codec)
        return PredictedCameras(header, self._codec, quantizer, self.config.chosen_preset)

    def _make_enhancer(self, header: StreamHeader) -> Enhancer | None:
        if self.config.enhance is None:
            return None
        quantizer: int | LayerRate
        if self.config.layer_quality is None:
            assert self.config.rate.bitrate_kbps is not None
            quantizer = LayerRate(self.config.rate.bitrate_kbps, self.array.fps)
        else:
            quantizer = predicted_quantizer(self.config.layer_quality, self._codec)
        return Enhancer(header, self._layer_views, quantizer, self.config.chosen_preset)

    def _make_header(self, frames: FrameSet) -> StreamHeader:
        span = self.config.disparity_range_px
        if span is None:
            from mvcodec.stereo.disparity_range import estimate_range
            from mvcodec.stereo.given import Given, given_range

            if isinstance(self._matcher, Given) and frames.given:
                span = given_range([frames])
            else:
                span = estimate_range(self.array, [frames], self.array.disparity_hint_px)
        codec, cameras = self.config.codec, self.config.cameras_for(self.array)
        maps = None if cameras == "none" else self.config.rate_of_maps(self.array, span)
        settings, use = self._settings_record(maps), self.config.use_for(self.array)
        return StreamHeader(
            self.array, span, codec, frames.index, settings, self._scale, cameras, self._order, use
        )

    def _settings_record(self, maps: RateControl | None) -> dict[str, Any]:
        config, codec = self.config, self._codec
        record = {
            **asdict(config.rate),
            "disparity_qp": None if maps is None else maps.qp,
            "disparity_median": None if maps is None else self._median,
            "prediction": config.prediction if self._order else None,
            "gop": self._gop,
            "speed": config.speed,
            "preset": config.chosen_preset,
            "matcher": matcher_name(config.chosen_matcher),
            "video": codec.settings(TrackKind.TEXTURE),
            "disparity": None if maps is None else codec.settings(TrackKind.DISPARITY),
            "encoder": f"mvcodec {mvcodec.__version__}",
        }
        return {name: value for name, value in record.items() if value is not None}

    def _check(self, frames: FrameSet) -> None:
        array = self.array
        where = f"frame {frames.index}"
        for camera in self.views:
            name = f"{where}, view {view_name(camera)}"
            picture = frames.pictures.get(camera)
            if picture is None:
                raise InputError(name, "no picture", "one of every real camera, and of every view to enhance")
            if picture.shape != (array.height, array.width, 3) or picture.dtype != np.uint8:
                expected = f"uint8 RGB, {array.width}x{array.height}"
                raise InputError(name, f"a picture of shape {picture.shape}, {picture.dtype}", expected)
        if frames.index < 0 or frames.time_ns < 0:
            raise InputError(where, f"time {frames.time_ns} ns", "index and time of 0 or more")
        if self._last is not None and not (
            frames.index > self._last.index and frames.time_ns > self._last.time_ns
        ):
            before = f"after frame {self._last.index} at {self._last.time_ns} ns"
            raise InputError(where, f"time {frames.time_ns} ns {before}", "frame sets in order of time")

    def _checked_map(self, maps: Mapping[Position, DisparityMap], camera: Position) -> DisparityMap:
        name = f"{type(self._matcher).__name__}.match, view {view_name(camera)}"
        found = maps.get(camera)
        if found is None:
            raise InputError(name, "no map", "one of every real camera")
        shape = (self.array.height, self.array.width)
        if found.values_px.shape != shape:
            raise InputError(name, f"a map of shape {found.values_px.shape}", f"{shape}")
        if not np.isfinite(found.values_px).all():
            raise InputError(name, "values that are not finite", "a finite disparity at every pixel")
        return found

    def _code_picture(self, track: Track, picture: Picture, keyframe: bool) -> list[CodedPicture]:
        return self._code(track, to_planes(picture), keyframe)

    def _code_map(self, track: Track, disparity: DisparityMap, keyframe: bool) -> list[CodedPicture]:
        assert self._header is not None
        codes = quantise(disparity.values_px, self._header.disparity_range_px)
        return self._code(track, grey_planes(to_coded(codes, self._scale, self._median)), keyframe)

    def _code(self, track: Track, planes: Planes, keyframe: bool) -> list[CodedPicture]:
        return self._encoders[track].push(planes, keyframe)


def _depth_packet(array: CameraArray, camera: Position, frames: FrameSet, disparity: DisparityMap) -> Packet:
    """Depth as little-endian 16-bit millimetres, row by row."""
    data = depth_mm(array, disparity.values_px).astype("<u2").tobytes()
    return Packet(Track(TrackKind.DEPTH, camera), frames.index, frames.time_ns, True, data)


def _packet(track: Track, frames: FrameSet, picture: CodedPicture) -> Packet:
    return Packet(track, frames.index, frames.time_ns, picture.keyframe, picture.data)
