"""VP9 by libvpx and FFmpeg's decoder: options."""

from __future__ import annotations

from mvcodec.stream import TrackKind
from mvcodec.video.access_unit import UnitWords
from mvcodec.video.codec import PRESETS, Codec, VideoDecoder, VideoEncoder, VideoSettings
from mvcodec.video.map_model import MapModel
from mvcodec.video.pyav import PyavDecoder, PyavEncoder
from mvcodec.video.vp9_syntax import Vp9Units

MAX_QP = 63
"""libvpx's own scale: 64 of VP9's 256 quantisers (base_q_idx), about four apart; 0 is lossless."""

DECODER = "vp9"

QP_LINE = 1.75, -24.5
"""libvpx's QP that gives the luma PSNR of libx264's QP: a line through what was measured on shop_v4
(simulcast, preset slow, 2 frame sets): 27, 32, 37 have the quality of 23, 32, 40."""

MAPS = MapModel(half_from=19, full=9, half=0, alternate=-4, fine_extra=0, octave=11)
"""H.264's model on this scale, whose steps are 1.75 times as close. Nobody has measured VP9's best maps."""

_EFFORTS = (
    *(("realtime", 8), ("realtime", 7), ("realtime", 6), ("realtime", 5)),
    *(("good", 5), ("good", 4), ("good", 3), ("good", 2), ("good", 1), ("good", 0)),
)
VPX_PRESETS = dict(zip(PRESETS, _EFFORTS, strict=True))
"""(deadline, cpu-used): libvpx's numbers for the efforts that x264 and x265 have names for."""

# No look-ahead, and no hidden picture made of later ones (alternate reference), which libvpx packs with
# a shown one into a superframe. In one pass it makes none with look-ahead either.
_AT_ONCE = {"lag-in-frames": "0", "auto-alt-ref": "0"}
_REORDERED = {"lag-in-frames": "25", "auto-alt-ref": "1"}

# All pictures of one quantiser, and one tile and one thread, which code to the same bits everywhere.
_ALWAYS = {"aq-mode": "0", "row-mt": "0", "tile-columns": "0", "frame-parallel": "0", "error-resilient": "0"}

WORDS = UnitWords(
    unit="a VP9 frame",
    part="frame",
    keyframe="key frame",
    parameters="size and colour",
    profile="profile 0: 8 bits, 4:2:0",
)


def vp9_settings(kind: TrackKind) -> str:
    """libvpx's parameters for a kind of track, beyond preset and rate: the same for all."""
    del kind
    return ":".join(f"{name}={value}" for name, value in _ALWAYS.items())


def vp9_encoder(settings: VideoSettings) -> VideoEncoder:
    """libvpx; each keyframe says size and colour itself."""
    return PyavEncoder("libvpx-vp9", vp9_options(settings), settings)


def vp9_decoder(low_delay: bool = True) -> VideoDecoder:
    """FFmpeg's own decoder."""
    return PyavDecoder(DECODER, WORDS.unit, low_delay)


def vp9_options(settings: VideoSettings) -> dict[str, str]:
    """Options of libvpx-vp9. Its constant quality knows whole numbers only.

    Raises:
        SettingError: the rate is outside of libvpx's scale.
    """
    rate = settings.rate
    rate.check_scale(MAX_QP)
    if rate.qp is not None:
        quality = dict.fromkeys(("crf", "qmin", "qmax"), str(rate.qp)) | {"b": "0"}
    elif rate.crf is not None:
        quality = {"crf": str(round(rate.crf)), "b": "0"}
    else:
        bits = rate.options()["b"]
        # Without delay libvpx holds a constant bit rate best: minimum = maximum = average.
        quality = dict.fromkeys(("b", "minrate", "maxrate"), bits) | {"bufsize": str(2 * int(bits))}
    deadline, speed = VPX_PRESETS[settings.preset]
    delay = _AT_ONCE if settings.low_delay else _REORDERED
    effort = {"deadline": deadline, "cpu-used": str(speed), "g": str(settings.gop)}
    return {**effort, **delay, **_ALWAYS, **quality}


VP9 = Codec(
    title="VP9",
    foxglove="vp9",
    encoder=vp9_encoder,
    decoder=vp9_decoder,
    library=DECODER,
    settings=vp9_settings,
    options=vp9_options,
    max_qp=MAX_QP,
    qp_line=QP_LINE,
    maps=MAPS,
    units=Vp9Units,
    words=WORDS,
    numbered=False,
    anchor=False,  # HEVC and AV1 stand on both sides of it
)
