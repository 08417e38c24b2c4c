"""The table of video codecs."""

from __future__ import annotations

from mvcodec.errors import SettingError
from mvcodec.video.codec import Codec
from mvcodec.video.h264 import H264Decoder, H264Encoder, h264_settings

CODECS: dict[str, Codec] = {
    "h264": Codec(encoder=H264Encoder, decoder=H264Decoder, settings=h264_settings),
}


def find_codec(name: str) -> Codec:
    """The codec of a name; SettingError names the choices."""
    if name not in CODECS:
        raise SettingError("codec", name, ", ".join(CODECS))
    return CODECS[name]
