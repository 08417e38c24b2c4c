"""H.264 by libx264 and FFmpeg's decoder: options, and what is taken out of its streams."""

from __future__ import annotations

import numpy as np

from mvcodec.stream import TrackKind
from mvcodec.video.access_unit import UnitWords
from mvcodec.video.annexb import without_user_data
from mvcodec.video.codec import Codec, Planes, VideoDecoder, VideoEncoder, VideoSettings
from mvcodec.video.h264_syntax import H264Units
from mvcodec.video.map_model import H26X
from mvcodec.video.pyav import PyavDecoder, PyavEncoder
from mvcodec.video.x26x import MAX_QP, x26x_options

DECODER = "h264"

SLICE_END_PERIOD = 32
"""After so many pictures x264 ends its slices with the same bits again."""

# No packet may wait for a later picture: no B-frames, no look-ahead, and no variable frame rate
# (force-cfr), which alone holds one picture back.
_AT_ONCE = "bframes=0:rc-lookahead=0:sync-lookahead=0:force-cfr=1:sliced-threads=0"

# Keyframes come when the encoder asks for them (scenecut off), since all tracks must have theirs
# together.
_ALWAYS = "scenecut=0:annexb=1:repeat-headers=1:open-gop=0"

X264_PARAMS = {
    # Psycho-visual decisions keep grain that differs from view to view and blurs in synthesis;
    # without them luma PSNR costs 5 % fewer bits (BD-rate, shop_v3, QP 27-37).
    TrackKind.TEXTURE: "psy=0",
    TrackKind.DISPARITY: "psy=0:aq-mode=0",
}


WORDS = UnitWords(
    unit="an H.264 access unit",
    part="NAL unit",
    keyframe="IDR picture",
    parameters="SPS and PPS",
    profile="High or lower, 8 bits, 4:2:0, progressive",
)


def h264_settings(kind: TrackKind) -> str:
    """x264's parameters for a kind of track, beyond preset and rate."""
    return X264_PARAMS[kind]


def h264_encoder(settings: VideoSettings) -> VideoEncoder:
    """libx264; closed GOPs, SPS and PPS with each keyframe, Annex B."""
    # x264 puts its options, 600 bytes of text, into each track's first picture: 1 % of a short
    # file with eight tracks. The header's settings say the same once.
    encoder = PyavEncoder("libx264", h264_options(settings), settings, without_user_data)
    if settings.low_delay:
        _count_up(encoder, settings)
    return encoder


def _count_up(encoder: PyavEncoder, settings: VideoSettings) -> None:
    """Have x264 count the pictures that were coded before: its numbers show in the bits of those that follow.

    The last bit of each slice is taken from a pattern of 32 pictures, and IDR pictures are numbered 0 and 1
    by turns. What comes after a keyframe depends on nothing else before it.
    """
    grey = np.full((settings.height, settings.width), 128, np.uint8)
    chroma = grey[::2, ::2].copy()
    for keyframe in keyframes_like(settings.coded_before, settings.gop):
        encoder.push(Planes(grey, chroma, chroma), keyframe)


def keyframes_like(pictures: int, gop: int) -> list[bool]:
    """Which of a few pictures are keyframes, that they leave x264 counting as so many pictures do."""
    if not pictures:
        return []
    count = (pictures - 1) % SLICE_END_PERIOD + 1
    even = -(-pictures // gop) % 2 == 0
    while True:
        keyframes = [number % gop == 0 for number in range(count)]
        if (sum(keyframes) % 2 == 0) == even:
            return keyframes
        if not keyframes[-1]:
            return [*keyframes[:-1], True]
        count += SLICE_END_PERIOD


def h264_decoder(low_delay: bool = True) -> VideoDecoder:
    """FFmpeg's own decoder."""
    return PyavDecoder(DECODER, WORDS.unit, low_delay)


def h264_options(settings: VideoSettings) -> dict[str, str]:
    """Options of libx264.

    Raises:
        SettingError: the rate is outside of H.264's scale.
    """
    always = f"{_ALWAYS}:{X264_PARAMS[settings.kind]}"
    return x26x_options("x264", settings, _AT_ONCE, always)


H264 = Codec(
    title="H.264",
    foxglove="h264",
    encoder=h264_encoder,
    decoder=h264_decoder,
    library=DECODER,
    settings=h264_settings,
    options=h264_options,
    max_qp=MAX_QP,
    qp_line=(1.0, 0.0),
    maps=H26X,
    units=H264Units,
    words=WORDS,
)
