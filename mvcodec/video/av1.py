"""AV1 by SVT-AV1 and dav1d: options."""

from __future__ import annotations

import os

from mvcodec.stream import TrackKind
from mvcodec.video.access_unit import UnitWords
from mvcodec.video.av1_syntax import Av1Units
from mvcodec.video.codec import PRESETS, Codec, VideoDecoder, VideoEncoder, VideoSettings
from mvcodec.video.map_model import MapModel
from mvcodec.video.pyav import PyavDecoder, PyavEncoder
from mvcodec.video.watchdog import WatchedEncoder

MAX_QP = 63

LIBRARY, DECODER = "libsvtav1", "libdav1d"

MAPS = MapModel(half_from=30, full=12, half=0, alternate=-5, fine_extra=0, octave=14)
"""H.264's model on this scale, whose steps are 2.4 times as close. Nobody has measured AV1's best maps."""

QP_LINE = 2.4, -30.0
"""SVT-AV1's QP that gives the luma PSNR of libx264's QP: a line through what was measured on shop_v4
(simulcast, preset slow): 22, 27, 32, 37 have the quality of 23, 38, 49, 58."""

SVT_PRESETS = dict(zip(PRESETS, (12, 11, 10, 9, 8, 6, 4, 3, 2, 1), strict=True))
"""SVT-AV1's numbers for the efforts that x264 and x265 have names for; medium and slow take about
as long as x265's (960 x 640)."""

_AT_ONCE = "pred-struct=1:lookahead=0"
_REORDERED = "pred-struct=2"

# Keyframes come when the encoder asks for them (keyint=-1, scd=0); counting them as well, SVT-AV1
# turns keyint=1 into another mode, with delay. One thread.
_ALWAYS = "keyint=-1:scd=0:lp=1"

SVT_PARAMS = {
    TrackKind.TEXTURE: "tune=1",
    TrackKind.DISPARITY: "tune=1",
}
"""tune=1 is PSNR: the counterpart of x264's psy=0."""


WORDS = UnitWords(
    unit="an AV1 temporal unit",
    part="OBU",
    keyframe="key frame",
    parameters="sequence header",
    profile="Main: 8 bits, 4:2:0",
)


def av1_settings(kind: TrackKind) -> str:
    """SVT-AV1's parameters for a kind of track, beyond preset and rate."""
    return SVT_PARAMS[kind]


def av1_encoder(settings: VideoSettings) -> VideoEncoder:
    """SVT-AV1; closed GOPs, a sequence header with each keyframe, low-overhead format."""
    os.environ.setdefault("SVT_LOG", "0")  # what fails is told as an error; it reads this when it starts
    options = av1_options(settings)

    def fresh() -> VideoEncoder:
        return PyavEncoder(LIBRARY, options, settings)

    # Without delay SVT-AV1 (4.1) has just as many buffers for pictures as are referred to; on a busy machine
    # its threads now and then wait for one that none of them frees.
    return WatchedEncoder(fresh, _patience_s(settings), LIBRARY) if settings.low_delay else fresh()


def _patience_s(settings: VideoSettings) -> float:
    """Seconds that no picture takes, fifteen times what a keyframe of 1280 x 720 took at any effort."""
    efforts = max(SVT_PRESETS.values()) - SVT_PRESETS[settings.preset]
    return 10 + 4e-6 * settings.width * settings.height * 2 ** (efforts / 2)


def av1_decoder(low_delay: bool = True) -> VideoDecoder:
    """dav1d."""
    return PyavDecoder(DECODER, WORDS.unit, low_delay)


def av1_options(settings: VideoSettings) -> dict[str, str]:
    """Options of libsvtav1.

    Raises:
        SettingError: the rate is outside of AV1's scale.
    """
    rate = settings.rate
    rate.check_scale(MAX_QP)
    delay = _AT_ONCE if settings.low_delay else _REORDERED
    params = f"{delay}:{_ALWAYS}:{SVT_PARAMS[settings.kind]}"
    options = {"preset": str(SVT_PRESETS[settings.preset]), **rate.options()}
    if "b" in options:
        # Without delay SVT-AV1 knows constant bit rate only: maximum = average.
        params += ":rc=2"
        options |= {"maxrate": options["b"], "bufsize": str(2 * int(options["b"]))}
    return {**options, "svtav1-params": params}


AV1 = Codec(
    title="AV1",
    foxglove="av1",
    encoder=av1_encoder,
    decoder=av1_decoder,
    library=DECODER,
    settings=av1_settings,
    options=av1_options,
    max_qp=MAX_QP,
    qp_line=QP_LINE,
    maps=MAPS,
    units=Av1Units,
    words=WORDS,
)
