"""The table of video codecs. What is particular to one stands in its own file."""

from __future__ import annotations

from mvcodec.errors import SettingError
from mvcodec.video.av1 import AV1
from mvcodec.video.codec import Codec
from mvcodec.video.h264 import H264
from mvcodec.video.hevc import HEVC
from mvcodec.video.vp9 import VP9

CODECS: dict[str, Codec] = {"h264": H264, "hevc": HEVC, "av1": AV1, "vp9": VP9}
"""By the name that headers and settings have."""


ANCHOR_CODECS = tuple(name for name, codec in CODECS.items() if codec.anchor)


def find_codec(name: str, setting: str = "codec") -> Codec:
    """The codec of a name; SettingError names the setting and the choices."""
    if name not in CODECS:
        raise SettingError(setting, name, f"one of {', '.join(CODECS)}")
    return CODECS[name]


def foxglove_name(name: str) -> str:
    """foxglove.CompressedVideo's name of a codec; of one that is not in the table, its own."""
    return CODECS[name].foxglove if name in CODECS else name
