"""What libx264 and libx265 are given alike."""

from __future__ import annotations

from mvcodec.video.codec import VideoSettings

MAX_QP = 51


def x26x_options(library: str, settings: VideoSettings, at_once: str, always: str) -> dict[str, str]:
    """Options of libx264 or libx265.

    Args:
        library: ``x264`` or ``x265``.
        at_once: its parameters that let no picture wait for a later one; taken where delay shall be low.
        always: all others.

    Raises:
        SettingError: the rate is outside of the codec's scale.
    """
    settings.rate.check_scale(MAX_QP)
    delay = f"{at_once}:" if settings.low_delay else ""
    ratio = "" if settings.keyframe_ratio is None else f":ipratio={settings.keyframe_ratio:g}"
    return {
        "preset": settings.preset,
        "forced-idr": "1",
        f"{library}-params": f"{delay}keyint={settings.gop}:{always}{ratio}",
        **settings.rate.options(),
    }
