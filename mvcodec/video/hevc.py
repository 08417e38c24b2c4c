"""HEVC (H.265) by libx265 and FFmpeg's decoder: options."""

from __future__ import annotations

from mvcodec.stream import TrackKind
from mvcodec.video.access_unit import UnitWords
from mvcodec.video.codec import Codec, VideoDecoder, VideoEncoder, VideoSettings
from mvcodec.video.hevc_syntax import HevcUnits
from mvcodec.video.map_model import H26X
from mvcodec.video.pyav import PyavDecoder, PyavEncoder
from mvcodec.video.x26x import MAX_QP, x26x_options

DECODER = "hevc"

_AT_ONCE = "bframes=0:rc-lookahead=0"

# One thread and no wavefronts (which cost bits), no text about the encoder, no open GOPs, and
# keyframes when the encoder asks for them.
_ALWAYS = (
    "log-level=none:pools=none:frame-threads=1:wpp=0:info=0:scenecut=0:annexb=1:repeat-headers=1:open-gop=0"
)

X265_PARAMS = {
    TrackKind.TEXTURE: "psy-rd=0:psy-rdoq=0",
    TrackKind.DISPARITY: "psy-rd=0:psy-rdoq=0:aq-mode=0",
}


WORDS = UnitWords(
    unit="an HEVC access unit",
    part="NAL unit",
    keyframe="IDR picture",
    parameters="VPS, SPS and PPS",
    profile="Main: 8 bits, 4:2:0, progressive",
)


def hevc_settings(kind: TrackKind) -> str:
    """x265's parameters for a kind of track, beyond preset and rate."""
    return X265_PARAMS[kind]


def hevc_encoder(settings: VideoSettings) -> VideoEncoder:
    """libx265; closed GOPs, VPS, SPS and PPS with each keyframe, Annex B."""
    return PyavEncoder("libx265", hevc_options(settings), settings)


def hevc_decoder(low_delay: bool = True) -> VideoDecoder:
    """FFmpeg's own decoder."""
    return PyavDecoder(DECODER, WORDS.unit, low_delay)


def hevc_options(settings: VideoSettings) -> dict[str, str]:
    """Options of libx265.

    Raises:
        SettingError: the rate is outside of HEVC's scale.
    """
    always = f"{_ALWAYS}:{X265_PARAMS[settings.kind]}"
    return x26x_options("x265", settings, _AT_ONCE, always)


HEVC = Codec(
    title="HEVC",
    foxglove="h265",
    encoder=hevc_encoder,
    decoder=hevc_decoder,
    library=DECODER,
    settings=hevc_settings,
    options=hevc_options,
    max_qp=MAX_QP,
    qp_line=(1.0, 0.0),
    maps=H26X,
    units=HevcUnits,
    words=WORDS,
)
