"""What an encoder is asked to do: its settings, and what is chosen where they leave it open."""

from __future__ import annotations

import math
import re
from dataclasses import InitVar, dataclass, fields, replace

from mvcodec.array import CameraArray, Position
from mvcodec.encoding.speed_choice import FOR_FILES, SPEEDS
from mvcodec.errors import SettingError
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.matcher import Matcher
from mvcodec.stream import (
    DISPARITY_CAMERAS,
    DISPARITY_SCALES,
    PREDICTIONS,
    REFERENCE_CODECS,
    StreamHeader,
    map_cameras,
)
from mvcodec.video.codec import PRESETS, RateControl, check_qp
from mvcodec.video.codecs import CODECS, find_codec
from mvcodec.video.disparity_rate import (
    best_disparity_cameras,
    default_disparity_cameras,
    default_disparity_qp,
    default_disparity_scale,
)
from mvcodec.video.map_size import MEDIANS, WIDEST_MEDIAN
from mvcodec.workers import thread_setting

AUTO = "auto"

DISPARITY_SHARE = 0.12
"""The maps' share in bitrate mode where every camera sends one; at the best map QP it is 0.09 to 0.18 on
shop_v3, 0.06 to 0.08 on shop_v4 and 0.10 to 0.16 on the sample, for pictures of QP 27 to 35."""

PREDICTING_CAMERAS = "alternate"
"""Which cameras send a map where others are predicted by it: the cheapest, see `docs/prediction.md`."""

PREDICTING_EXTRA = 0
"""QPs, on libx264's scale, that such maps are coarser by."""

LAYER_SLOPE, MOST_LAYER_OFFSET = 2.5, 6.0
"""What the layer's QP is more than the pictures', on libx264's scale: LAYER_SLOPE for each doubling of the
views that build on a real camera, within what was measured; fitted in `docs/prediction.md`."""

MOST_GIVEN_OFFSET = 24
"""How far a user may ask for the layer's QP to be from the pictures': more is a slip of the hand."""

RATIO_CODECS = ("h264", "hevc")
"""Codecs that can be told how much finer keyframes shall be."""

DEFAULT_RATE = RateControl(qp=27)


def default_gop(fps: float) -> int:
    """The frame sets from keyframe to keyframe: as many as one second holds, at least one."""
    return max(math.floor(fps + 1e-6), 1)


@dataclass(frozen=True, slots=True)
class EncoderConfig:
    """Settings of an encoder, checked here. What each means stands in its field's help.

    ``EncoderConfig(qp=22)``, ``EncoderConfig(crf=23)`` and ``EncoderConfig(bitrate_kbps=800)`` are short for
    ``rate=RateControl(...)``, and take its place where both are given. Read `rate`.

    Raises:
        SettingError: a value is outside its range, or more than one of qp, crf and bitrate_kbps is given.
    """

    rate: RateControl = DEFAULT_RATE
    codec: str = setting(
        "h264",
        "codec of the pictures and the maps; h264 is the one that viewers are sure to play",
        choices=tuple(CODECS),
    )
    gop: int | None = setting(
        None, "frame sets from keyframe to keyframe, at most one second's (default: one second)", low=1
    )
    speed: str = setting(
        FOR_FILES,
        "how much time coding may take: sets `matcher` and `preset` together",
        choices=tuple(SPEEDS),
    )
    matcher: str | Matcher | None = setting(
        None,
        f"what estimates the disparity maps (default: what `speed` has; {FOR_FILES}:"
        f" {SPEEDS[FOR_FILES].matcher})",
    )
    preset: str | None = setting(
        None,
        f"effort of the video encoder (default: what `speed` has; {FOR_FILES}: {SPEEDS[FOR_FILES].preset})",
        choices=PRESETS,
    )
    keyframe_ratio: float | None = setting(
        None,
        "how many times coarser other pictures are quantised than keyframes (h264, hevc; default: as the"
        " codec has it, about 1.4)",
        low=1,
        high=4,
    )
    disparity_range_px: tuple[float, float] | None = setting(
        None,
        "the least and the greatest disparity between neighbouring real cameras, px (default: estimated from"
        " the pictures, within what the input states)",
        expected="(low, high), two numbers",
    )
    disparity_qp: int | None = setting(
        None, "constant quantiser of the maps (default: chosen for that of the pictures)"
    )
    disparity_scale: int | None = setting(
        None,
        "2: maps at half the pictures' size each way (default: chosen for the pictures' quantiser)",
        choices=DISPARITY_SCALES,
    )
    disparity_cameras: str | None = setting(
        None,
        "the real cameras that send a map; alternate: every second one, and decoders derive the others';"
        " none: decoders estimate all maps, which takes them as long as it takes encoders (beside predicted"
        " pictures some are sent, for prediction alone), and readers of format version 1 refuse the file;"
        " auto: what costs fewest bits at equal quality (default: all or alternate, chosen for the pictures'"
        " quantiser; beside predicted pictures alternate)",
        choices=(*DISPARITY_CAMERAS, AUTO),
    )
    prediction: str = setting(
        "none",
        "synthesis: real cameras are coded from each other, for fewer bits; the first one alone plays in any"
        " viewer, and readers of format version 1 refuse the file",
        choices=PREDICTIONS,
    )
    enhance: float | str | None = setting(
        None,
        "add an enhancement layer: virtual views whose originals are in the input, coded from their synthesis"
        " with about the quality of this QP, which may have a fraction; the base stays as it is without."
        " +QPS: so many, on libx264's scale, more than the pictures'. auto: what goes best with the pictures'"
        " quantiser, or with the quality or bit rate asked for. With +QPS and auto both hold a bit rate",
    )
    enhance_views: tuple[Position, ...] | None = setting(
        None,
        "the views of the layer (default: every one that no real camera has)",
        expected="(row, col) of each, whole numbers",
    )
    enhance_chain: int | None = setting(
        None,
        "the most other views of the layer that one may build on: fewer make single views quicker to decode,"
        " and cost bits (default: any number)",
        low=0,
    )
    second_reference: str | None = setting(
        None,
        "nearest: pictures that are predicted, cameras' and the layer's, may also build on the nearest"
        " decoded one as it is, which saves bits where maps are bad; older readers refuse such files"
        " (default: none; beside `prediction`, `enhance` auto and a quality or bit rate: what is cheapest)",
        choices=tuple(REFERENCE_CODECS),
    )
    disparity_median: int | None = setting(
        None,
        "smooth maps over N x N before coding (default: 5, at half size 3)",
        choices=(0, *range(3, WIDEST_MEDIAN + 1, 2)),
        expected=f"0 (off) or an odd number, 3..{WIDEST_MEDIAN}",
    )
    depth: bool = setting(False, "write each map as metric depth too, for other people's tools")
    threads: int | None = thread_setting()
    qp: InitVar[int | None] = None
    crf: InitVar[float | None] = None
    bitrate_kbps: InitVar[float | None] = None

    def __post_init__(self, qp: int | None, crf: float | None, bitrate_kbps: float | None) -> None:
        max_qp = find_codec(self.codec).max_qp
        check_qp("qp", qp, max_qp)
        if any(value is not None for value in (qp, crf, bitrate_kbps)):
            object.__setattr__(self, "rate", RateControl(qp, crf, bitrate_kbps))
        check_qp("disparity_qp", self.disparity_qp, max_qp)
        self._check_enhance(max_qp)
        self.rate.check_scale(max_qp)
        check_settings(self)
        if self.keyframe_ratio is not None and self.codec not in RATIO_CODECS:
            raise SettingError("keyframe_ratio", self.keyframe_ratio, f"none beside codec {self.codec}")
        for name in ("enhance_views", "enhance_chain"):
            if getattr(self, name) is not None and self.enhance is None:
                raise SettingError(name, "given", "enhance beside it")
        span = self.disparity_range_px
        if span is not None and not (math.isfinite(span[0]) and math.isfinite(span[1]) and span[0] < span[1]):
            raise SettingError("disparity_range_px", list(span), "lo < hi")

    def _check_enhance(self, max_qp: int) -> None:
        asked = self.enhance
        if isinstance(asked, str) and asked != AUTO and not re.fullmatch(r"[+-]\d{1,2}(\.\d+)?", asked):
            raise SettingError("enhance", asked, f"a QP, +QPS or {AUTO}")
        if isinstance(asked, str) and asked != AUTO and abs(float(asked)) > MOST_GIVEN_OFFSET:
            expected = f"a QP, {AUTO}, or -{MOST_GIVEN_OFFSET}..+{MOST_GIVEN_OFFSET}"
            raise SettingError("enhance", asked, expected)
        if isinstance(asked, float) and not 1 <= asked <= max_qp:
            raise SettingError("enhance", asked, f"1..{max_qp}, +QPS or {AUTO}")
        check_qp("enhance", asked if isinstance(asked, int) else None, max_qp)

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """What the constructor takes."""
        return "qp", "crf", "bitrate_kbps", *(item.name for item in fields(cls))

    @property
    def chosen_matcher(self) -> str | Matcher:
        """The matcher given, or the speed's."""
        return self.matcher or SPEEDS[self.speed].matcher

    @property
    def chosen_preset(self) -> str:
        """The preset given, or the speed's."""
        return self.preset or SPEEDS[self.speed].preset

    @property
    def chosen_second_reference(self) -> str:
        """The second reference given, or none."""
        return self.second_reference or "none"

    @property
    def quality(self) -> float | None:
        """The pictures' QP or CRF; None where a bit rate governs."""
        return self.rate.quality

    def layer_quality(self, views: int, cameras: int) -> float | None:
        """The enhancement layer's QP on the codec's scale; None where none is, or a bit rate governs it.

        Args:
            views: of the layer; cameras: real ones.
        """
        if not isinstance(self.enhance, str):
            return self.enhance
        if self.quality is None:
            return None
        codec = find_codec(self.codec)
        if self.enhance == AUTO:
            offset = min(max(LAYER_SLOPE * math.log2(views / cameras), 0.0), MOST_LAYER_OFFSET)
        else:
            offset = float(self.enhance)
        return min(max(self.quality + offset * codec.qp_line[0], 1.0), codec.max_qp)

    @property
    def shared_kbps(self) -> float | None:
        """A bit rate that one quality of several tracks has to hold, since they build on each other."""
        several = self.prediction != "none" or isinstance(self.enhance, str)
        return self.rate.bitrate_kbps if several else None

    def with_quality(self, qp: int, header: StreamHeader) -> EncoderConfig:
        """These settings with a constant quantiser, and with what a stream's header has settled."""
        given = self.disparity_cameras
        cameras = header.disparity_cameras if given in (None, AUTO) else given
        scale = header.disparity_scale
        return replace(self, rate=RateControl(qp=qp), disparity_scale=scale, disparity_cameras=cameras)

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
        if self.disparity_cameras == AUTO and self.prediction == "none" and self.enhance is None:
            return best_disparity_cameras(self.quality, self.codec, array)
        if self.use_for(array) == "prediction":
            return PREDICTING_CAMERAS
        given = self.disparity_cameras
        if given is not None and given != AUTO:
            return given
        if self.prediction != "none" and len(array.real) > 1:
            return PREDICTING_CAMERAS
        return default_disparity_cameras(self.quality, self.codec, array)

    def use_for(self, array: CameraArray) -> str:
        """What the maps are for, as `StreamHeader.disparity_use`."""
        cameras = self.prediction != "none" and len(array.real) > 1
        if self.disparity_cameras == AUTO and cameras and self.enhance is None:
            estimated = best_disparity_cameras(self.quality, self.codec, array) == "none"
        else:
            estimated = self.disparity_cameras == "none"
        return "prediction" if estimated and (cameras or self.enhance is not None) else "all"

    def rate_of_pictures(self, array: CameraArray) -> RateControl:
        """The rate control of one camera's pictures."""
        kbps = self.rate.bitrate_kbps
        if kbps is None:
            return self.rate
        senders = map_cameras(array, self.cameras_for(array))
        maps = DISPARITY_SHARE * len(senders) / len(array.real)
        return _share(kbps, 1.0 if self.disparity_qp is not None else 1 - maps, array)

    def rate_of_maps(self, array: CameraArray, range_px: tuple[float, float]) -> RateControl:
        """The rate control of one camera's maps; `range_px` is the header's."""
        if self.disparity_qp is not None:
            return RateControl(qp=self.disparity_qp)
        if self.rate.bitrate_kbps is not None:
            return _share(self.rate.bitrate_kbps, DISPARITY_SHARE, array)
        assert self.quality is not None
        scale, cameras = self.scale_for(array), self.cameras_for(array)
        qp = default_disparity_qp(self.quality, scale, cameras, range_px, self.codec)
        if self.use_for(array) == "prediction":
            codec = find_codec(self.codec)
            qp = min(round(qp + PREDICTING_EXTRA * codec.qp_line[0]), codec.max_qp)
        return RateControl(qp=qp)


def _share(kbps: float, share: float, array: CameraArray) -> RateControl:
    return RateControl(bitrate_kbps=max(kbps * share / len(array.real), 1.0))


def matcher_name(matcher: str | Matcher) -> str:
    """What a header says of `EncoderConfig.matcher`: its shortest specification, or the name of its class.

    Raises:
        SettingError: there is none of that name.
    """
    if not isinstance(matcher, str):
        return type(matcher).__name__
    from mvcodec.layers.refinement import matcher_specification

    return matcher_specification(matcher)


def find_matcher(matcher: str | Matcher) -> Matcher:
    """What `EncoderConfig.matcher` stands for.

    Raises:
        SettingError: there is none of that name.
    """
    if not isinstance(matcher, str):
        return matcher
    from mvcodec.layers.refinement import make_matcher

    return make_matcher(matcher)
