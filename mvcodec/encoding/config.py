"""What an encoder is asked to do: its settings, and what is chosen where they leave it open."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mvcodec.array import CameraArray
from mvcodec.errors import SettingError
from mvcodec.stereo.matcher import Matcher
from mvcodec.stream import DISPARITY_CAMERAS, map_cameras
from mvcodec.video.codec import RateControl, check_preset, check_qp
from mvcodec.video.codecs import find_codec
from mvcodec.video.disparity_rate import (
    best_disparity_cameras,
    default_disparity_cameras,
    default_disparity_qp,
    default_disparity_scale,
)
from mvcodec.video.map_size import MEDIANS, check_median, check_scale

AUTO = "auto"

DISPARITY_SHARE = 0.12
"""The maps' share in bitrate mode where every camera sends one; at the best map QP it is 0.09 to 0.18 on
shop_v3, 0.06 to 0.08 on shop_v4 and 0.10 to 0.16 on the sample, for pictures of QP 27 to 35."""


def default_gop(fps: float) -> int:
    """The frame sets from keyframe to keyframe: as many as one second holds, at least one."""
    return max(math.floor(fps + 1e-6), 1)


@dataclass(frozen=True, slots=True)
class EncoderConfig:
    """Settings of an encoder, checked here.

    Attributes:
        qp: constant quantiser of the pictures, 1..51 (codecs av1 and vp9: 1..63); None where crf or
            bitrate_kbps governs.
        crf: constant quality of the pictures, on the same scale.
        bitrate_kbps: average of all video tracks together, kbit/s.
        disparity_qp: constant quantiser of the maps, as qp; by default `default_disparity_qp`, or
            a DISPARITY_SHARE of the bit rate. Given, bitrate_kbps is that of the pictures alone.
        disparity_scale: 2: maps are coded at half the pictures' size each way, 1: at all of it; by
            default `default_disparity_scale`.
        disparity_cameras: the cameras that send a map: all; alternate: every second one of a row and
            a column, and the decoder derives the others'; none: the decoder estimates all maps; auto:
            what costs fewest bits at equal quality, `best_disparity_cameras`. By default
            `default_disparity_cameras`, which never leaves all maps to the decoder.
        disparity_median: window of the median that maps are smoothed with before coding, odd, px of
            the coded map; 0: off; by default `MEDIANS` has it for the scale.
        gop: frame sets from keyframe to keyframe, at most one second; by default one second.
        matcher: name of a matcher (``sad``), one with its refinement (``sad+dlr``), or one's own.
        preset: effort of the video encoder.
        disparity_range_px: (lo, hi) between neighbouring real cameras; by default estimated from
            the first frame set.
        codec: of the pictures and the maps, a name of `mvcodec.video.codecs.CODECS`.
        depth: write each map as metric depth too, for other people's tools.

    Raises:
        SettingError: a value is outside its range, or not exactly one of qp, crf and
            bitrate_kbps is set.
    """

    qp: int | None = 27
    crf: float | None = None
    bitrate_kbps: float | None = None
    disparity_qp: int | None = None
    gop: int | None = None
    matcher: str | Matcher = "joint"
    preset: str = "slow"
    disparity_range_px: tuple[float, float] | None = None
    codec: str = "h264"
    disparity_scale: int | None = None
    disparity_median: int | None = None
    disparity_cameras: str | None = None
    depth: bool = False

    def __post_init__(self) -> None:
        max_qp = find_codec(self.codec).max_qp
        check_qp("qp", self.qp, max_qp)
        check_qp("disparity_qp", self.disparity_qp, max_qp)
        RateControl(self.qp, self.crf, self.bitrate_kbps).check_scale(max_qp)
        check_preset(self.preset)
        check_scale(self.disparity_scale)
        check_median(self.disparity_median)
        if self.disparity_cameras not in {None, AUTO, *DISPARITY_CAMERAS}:
            choices = " or ".join((*DISPARITY_CAMERAS, AUTO))
            raise SettingError("disparity_cameras", self.disparity_cameras, choices)
        if self.gop is not None and self.gop < 1:
            raise SettingError("gop", self.gop, "at least 1")
        span = self.disparity_range_px
        if span is not None and not (math.isfinite(span[0]) and math.isfinite(span[1]) and span[0] < span[1]):
            raise SettingError("disparity_range_px", list(span), "lo < hi")

    @property
    def quality(self) -> float | None:
        """The pictures' QP or CRF; None where a bit rate governs."""
        return self.qp if self.qp is not None else self.crf

    def scale_for(self, array: CameraArray) -> int:
        """The scale of the maps of an array."""
        if self.disparity_scale is not None:
            return self.disparity_scale
        return default_disparity_scale(self.quality, self.codec, array.width, array.height)

    def median_for(self, array: CameraArray) -> int:
        """The window of the median for the maps of an array, px; 0: none."""
        given = self.disparity_median
        return MEDIANS[self.scale_for(array)] if given is None else given

    def cameras_for(self, array: CameraArray) -> str:
        """Which real cameras of an array send a map, as `StreamHeader.disparity_cameras`."""
        if self.disparity_cameras == AUTO:
            return best_disparity_cameras(self.quality, self.codec, array)
        return self.disparity_cameras or default_disparity_cameras(self.quality, self.codec, array)

    def rate_of_pictures(self, array: CameraArray) -> RateControl:
        """The rate control of one camera's pictures."""
        if self.bitrate_kbps is None:
            return RateControl(qp=self.qp, crf=self.crf)
        senders = map_cameras(array, self.cameras_for(array))
        maps = DISPARITY_SHARE * len(senders) / len(array.real)
        return _share(self.bitrate_kbps, 1.0 if self.disparity_qp is not None else 1 - maps, array)

    def rate_of_maps(self, array: CameraArray, range_px: tuple[float, float]) -> RateControl:
        """The rate control of one camera's maps; `range_px` is the header's."""
        if self.disparity_qp is not None:
            return RateControl(qp=self.disparity_qp)
        if self.bitrate_kbps is not None:
            return _share(self.bitrate_kbps, DISPARITY_SHARE, array)
        assert self.quality is not None
        scale, cameras = self.scale_for(array), self.cameras_for(array)
        return RateControl(qp=default_disparity_qp(self.quality, scale, cameras, range_px, self.codec))


def _share(kbps: float, share: float, array: CameraArray) -> RateControl:
    return RateControl(bitrate_kbps=max(kbps * share / len(array.real), 1.0))


def find_matcher(matcher: str | Matcher) -> Matcher:
    """What `EncoderConfig.matcher` stands for.

    Raises:
        SettingError: there is none of that name.
    """
    if not isinstance(matcher, str):
        return matcher
    from mvcodec.layers.refinement import matcher_by_name

    return matcher_by_name(matcher)
