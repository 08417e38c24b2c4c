"""The table of video codecs."""

from __future__ import annotations

from mvcodec.errors import SettingError
from mvcodec.video import av1, h264, hevc
from mvcodec.video.codec import Codec
from mvcodec.video.reference_watch import WATCHES

CODECS: dict[str, Codec] = {
    "h264": Codec(
        h264.h264_encoder,
        h264.h264_decoder,
        h264.h264_settings,
        h264.h264_options,
        h264.MAX_QP,
        WATCHES["h264"],
    ),
    "hevc": Codec(
        hevc.hevc_encoder,
        hevc.hevc_decoder,
        hevc.hevc_settings,
        hevc.hevc_options,
        hevc.MAX_QP,
        WATCHES["hevc"],
    ),
    "av1": Codec(
        av1.av1_encoder,
        av1.av1_decoder,
        av1.av1_settings,
        av1.av1_options,
        av1.MAX_QP,
        WATCHES["av1"],
    ),
}


def find_codec(name: str) -> Codec:
    """The codec of a name; SettingError names the choices."""
    if name not in CODECS:
        raise SettingError("codec", name, ", ".join(CODECS))
    return CODECS[name]
