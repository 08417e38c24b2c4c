"""Frame sets in, packets out: matches, and has every track coded; see FORMAT.md."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from types import TracebackType
from typing import Any, Self

import numpy as np

import mvcodec
from mvcodec.array import CameraArray, Position
from mvcodec.depth import depth_mm, warn_behind_infinity
from mvcodec.encoding.coders import Coders
from mvcodec.encoding.coding_error import coding_error
from mvcodec.encoding.config import EncoderConfig, default_gop, find_matcher, matcher_name
from mvcodec.encoding.enhancer import enhanced_views
from mvcodec.encoding.predicted_cameras import prediction_order
from mvcodec.encoding.stream_rate import StreamRate
from mvcodec.errors import InputError, SettingError, StreamClosed
from mvcodec.frames import DisparityMap, FrameSet
from mvcodec.stereo.matcher import FrameMatcher, HalvingMatcher, Matcher, SelectiveMatcher
from mvcodec.stream import (
    Packet,
    StreamHeader,
    Track,
    TrackKind,
    view_name,
)
from mvcodec.video.codec import (
    RateControl,
)
from mvcodec.video.codecs import find_codec
from mvcodec.video.map_size import small_size

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
        several = self.config.prediction == "synthesis" and len(array.real) > 1
        self._order = prediction_order(array) if several else ()
        asked = self.config.enhance_views
        self._layer_views = () if self.config.enhance is None else enhanced_views(array, asked)
        self._rate: StreamRate | None = None
        if self.config.shared_kbps is not None:
            scale = self._codec.qp_line[0]
            self._rate = StreamRate(self.config.shared_kbps, array.fps, self._gop, scale, self._codec.max_qp)
        self._coders: Coders | None = None
        self._coders_qp: int | None = None
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
        # Should something fail below, the next frame set starts afresh with a keyframe.
        position, self._position = self._position, 0
        if self._last is not None and frames.time_ns - self._key_ns >= KEYFRAME_NS:
            position = 0  # frame sets came more slowly than their nominal rate
        numbered = self._codec.numbered and not (self._order or self._layer_views)
        if self._last is not None and frames.index != self._last.index + 1 and not numbered:
            position = 0  # else what was left out would look like what was lost
        packets = self._code(frames, position == 0)
        if position == 0:
            self._key_ns = frames.time_ns
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

    def _code(self, frames: FrameSet, keyframe: bool) -> list[Packet]:
        """The packets of a frame set, at the quality that the bit rate allows."""
        rate = self._rate
        if keyframe and rate is not None:
            rate.begin()
        packets = self._coders_at_hand(keyframe).push(frames, keyframe, lambda: self._match(frames, keyframe))
        if rate is not None:
            while rate.try_again(self._bits(packets)):
                packets = self._coders_at_hand(keyframe).push(frames, keyframe, lambda: self._maps)
            rate.spend(self._bits(packets))
        return packets

    def _bits(self, packets: Iterable[Packet]) -> int:
        """What counts of them for the bit rate: a layer whose quality is given comes on top."""
        uncounted = () if isinstance(self.config.enhance, str) else (TrackKind.LAYER, TrackKind.ENHANCED)
        return 8 * sum(len(packet.data) for packet in packets if packet.track.kind not in uncounted)

    def _coders_at_hand(self, keyframe: bool) -> Coders:
        """Those of the frame set before; at a keyframe others, where the quality changes."""
        assert self._header is not None
        qp = None if self._rate is None else self._rate.qp
        if self._coders is None or (keyframe and qp != self._coders_qp):
            config = self.config if qp is None else self.config.with_quality(qp, self._header)
            if self._coders is not None:
                self._coders.flush()
            self._coders = Coders(self._header, config, self._gop, self._layer_views, self._coded_before)
            self._coders_qp = qp
        return self._coders

    def _match(self, frames: FrameSet, keyframe: bool) -> Mapping[Position, DisparityMap]:
        """The maps that are sent, of half size where the matcher has those; with depth, every camera's."""
        assert self._header is not None
        if not (self._header.map_cameras or self.config.depth):
            return {}
        pictures = {camera: frames.pictures[camera] for camera in self.array.real}
        range_px = self._header.disparity_range_px
        if isinstance(self._matcher, FrameMatcher):
            cameras = self.array.real
            maps = self._matcher.match_frames(self.array, frames, range_px)
        elif isinstance(self._matcher, SelectiveMatcher) and not self.config.depth:
            cameras = self._header.map_cameras
            wanted = self.array, pictures, range_px, cameras, keyframe
            if self._scale == 2 and isinstance(self._matcher, HalvingMatcher):
                small = self._matcher.match_halved(*wanted)
                if small is not None:
                    self._maps = {camera: self._checked_map(small, camera, self._scale) for camera in cameras}
                    return self._maps
            maps = self._matcher.match_cameras(*wanted)
        else:
            cameras = self.array.real
            maps = self._matcher.match(self.array, pictures, range_px)
        self._maps = {camera: self._checked_map(maps, camera) for camera in cameras}
        return self._maps

    def flush(self) -> list[Packet]:
        """End the stream. Returns nothing, since no packet waits; `push` is an error from now on."""
        if self._open:
            self._open = False
            if self._coders is not None:
                self._coders.flush()
        return []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.flush()

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
            self.array,
            span,
            codec,
            frames.index,
            settings,
            self._scale,
            cameras,
            self._order,
            use,
            self.config.chosen_second_reference if self._order else "none",
        )

    def _settings_record(self, maps: RateControl | None) -> dict[str, Any]:
        config, codec = self.config, self._codec
        record = {
            **asdict(config.rate),
            "disparity_qp": None if maps is None else maps.qp,
            "disparity_median": None if maps is None else self._median,
            "prediction": config.prediction if self._order else None,
            "gop": self._gop,
            "keyframe_ratio": config.keyframe_ratio,
            "coding_error": coding_error(config),
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

    def _checked_map(
        self, maps: Mapping[Position, DisparityMap], camera: Position, scale: int = 1
    ) -> DisparityMap:
        name = f"{type(self._matcher).__name__}.match, view {view_name(camera)}"
        found = maps.get(camera)
        if found is None:
            raise InputError(name, "no map", "one of every real camera")
        shape = small_size(self.array.width, self.array.height, scale)[::-1]
        if found.values_px.shape != shape:
            raise InputError(name, f"a map of shape {found.values_px.shape}", f"{shape}")
        if not np.isfinite(found.values_px).all():
            raise InputError(name, "values that are not finite", "a finite disparity at every pixel")
        return found


def _depth_packet(array: CameraArray, camera: Position, frames: FrameSet, disparity: DisparityMap) -> Packet:
    """Depth as little-endian 16-bit millimetres, row by row."""
    data = depth_mm(array, disparity.values_px).astype("<u2").tobytes()
    return Packet(Track(TrackKind.DEPTH, camera), frames.index, frames.time_ns, True, data)
