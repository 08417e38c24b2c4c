"""The extension point of video coding: what a stock codec must do for one track."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.settings import check_settings, setting
from mvcodec.stream import TrackKind
from mvcodec.video.access_unit import UnitReader, UnitWords
from mvcodec.video.map_model import MapModel

Plane = NDArray[np.uint8]

PRESETS = (
    "ultrafast",
    "superfast",
    "veryfast",
    "faster",
    "fast",
    "medium",
    "slow",
    "slower",
    "veryslow",
    "placebo",
)

WIDEST_SCALE = 63
"""The highest QP of any codec (AV1's and VP9's)."""


@dataclass(frozen=True, slots=True, eq=False)
class Planes:
    """A picture as the codec takes it: planar 4:2:0.

    Attributes:
        y: uint8 (H, W), H and W even.
        u, v: uint8 (H/2, W/2).
    """

    y: Plane
    u: Plane
    v: Plane

    @property
    def size(self) -> tuple[int, int]:
        """(W, H)."""
        height, width = self.y.shape
        return width, height


def _bit_rate(text: str) -> float:
    """kbit/s: ``2000``, ``2000k`` or ``2M``."""
    match = re.fullmatch(r"(-?\d+(?:\.\d+)?)([kM]?)(?:bit/s|bps)?", text)
    if match is None:
        raise SettingError("bitrate_kbps", text, "kbit/s such as 2000, or 2M")
    return float(match[1]) * (1000 if match[2] == "M" else 1)


@dataclass(frozen=True, slots=True)
class RateControl:
    """How a track's bits are governed; exactly one of the three is set. Each is explained by its field.

    Raises:
        SettingError: none or several are set, or one is outside the range of every codec.
    """

    qp: int | None = setting(None, "constant quantiser, 1..51; of av1 and vp9 1..63")
    crf: float | None = setting(None, "constant quality (constant rate factor), on the scale of qp")
    bitrate_kbps: float | None = setting(
        None,
        "average bit rate of all that is coded, kbit/s",
        low=1,
        high=10_000_000,
        expected="1..10000000 kbit/s",
        parse=_bit_rate,
    )

    def __post_init__(self) -> None:
        given = [name for name in ("qp", "crf", "bitrate_kbps") if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none of them"
            raise SettingError("qp, crf, bitrate_kbps", found, "exactly one of the three")
        self.check_scale(WIDEST_SCALE)
        check_settings(self)

    def check_scale(self, max_qp: int) -> None:
        """Raise SettingError where qp or crf is outside a codec's scale."""
        check_qp("qp", self.qp, max_qp)
        if self.crf is not None and not 1 <= self.crf <= max_qp:
            raise SettingError("crf", self.crf, f"1..{max_qp}")

    @property
    def quality(self) -> float | None:
        """The QP or CRF; None where a bit rate governs."""
        return self.qp if self.qp is not None else self.crf

    def options(self) -> dict[str, str]:
        """As libavcodec's encoders call it."""
        if self.qp is not None:
            return {"qp": str(self.qp)}
        if self.crf is not None:
            return {"crf": f"{self.crf:g}"}
        assert self.bitrate_kbps is not None
        return {"b": str(round(self.bitrate_kbps * 1000))}


def check_qp(setting: str, qp: int | None, max_qp: int) -> None:
    """Raise SettingError where a quantiser is given and is outside 1..max_qp."""
    if qp == 0:
        expected = f"1..{max_qp} (0 is lossless coding, a profile that players don't decode)"
        raise SettingError(setting, 0, expected)
    if qp is not None and not (isinstance(qp, int) and 1 <= qp <= max_qp):
        raise SettingError(setting, qp, f"a whole number, 1..{max_qp}")


def check_preset(preset: str) -> None:
    """Raise SettingError where an effort is none of PRESETS."""
    if preset not in PRESETS:
        raise SettingError("preset", preset, ", ".join(PRESETS))


@dataclass(frozen=True, slots=True)
class VideoSettings:
    """What the encoder of one track needs.

    Attributes:
        kind: what the track carries; codecs keep settings of their own for each kind.
        width, height: of the pictures, px; both even.
        fps: pictures a second.
        gop: pictures from keyframe to keyframe, at most.
        rate: bits or quality.
        preset: effort, one of PRESETS.
        low_delay: each picture comes out at once; else the preset's own B-pictures and look-ahead.
        keyframe_ratio: how many times coarser other pictures' quantiser steps are than keyframes'; None: as
            the codec has it. Codecs without such a setting leave it be.
        coded_before: pictures of the same track that another encoder codes before: where the codec can,
            at a constant quantiser, this one's access units are those that one encoder for all would give.
    """

    kind: TrackKind
    width: int
    height: int
    fps: float
    gop: int
    rate: RateControl
    preset: str
    low_delay: bool = True
    coded_before: int = 0
    keyframe_ratio: float | None = None

    def __post_init__(self) -> None:
        check_preset(self.preset)


@dataclass(frozen=True, slots=True)
class CodedPicture:
    """One access unit as the container stores it; a keyframe stands on its own."""

    data: bytes
    keyframe: bool


class VideoEncoder(Protocol):
    """Codes one track. One picture in, its access unit out, at once."""

    def push(self, planes: Planes, keyframe: bool = False) -> list[CodedPicture]:
        """Code a picture; `keyframe` forces decoding to be able to start at it."""
        ...

    def flush(self) -> list[CodedPicture]:
        """What is left inside (nothing, for a codec without delay); ends the encoder."""
        ...


class VideoDecoder(Protocol):
    """Decodes one track. One access unit in, its picture out, at once."""

    def push(self, data: bytes, label: str) -> list[Planes]:
        """Decode an access unit; the planes belong to the caller.

        Args:
            label: what to call this access unit in an error (topic and time).

        Raises:
            StreamError: the data are damaged, or lack the keyframe they depend on.
        """
        ...

    def flush(self) -> list[Planes]:
        """What is left inside; ends the decoder."""
        ...


class DecoderFactory(Protocol):
    """Makes the decoder of one track."""

    def __call__(self, low_delay: bool = True) -> VideoDecoder:
        """`low_delay`: as in the settings that the track was coded with."""
        ...


@dataclass(frozen=True, slots=True)
class Codec:
    """A stock video codec: all in which it differs from the others.

    Attributes:
        title: for people.
        foxglove: foxglove.CompressedVideo's name of it.
        encoder: makes the encoder of one track.
        decoder: makes the decoder of one track.
        library: libavcodec's name of that decoder.
        settings: the codec's own settings for a kind of track, for the record in the header.
        options: all options that its encoder is given, by name.
        max_qp: the coarsest of its quantisers; the finest is 1.
        qp_line: (slope, offset): ``slope * qp + offset`` has the luma PSNR of libx264's qp.
        maps: what maps are coded with.
        units: makes the reader of one track's access units.
        words: for messages.
        numbered: its pictures tell whether one before them is missing. Where they don't, frame sets
            count up by one between keyframes.
        anchor: simulcast and PVS are measured with it unless others are asked for.
    """

    title: str
    foxglove: str
    encoder: Callable[[VideoSettings], VideoEncoder]
    decoder: DecoderFactory
    library: str
    settings: Callable[[TrackKind], str]
    options: Callable[[VideoSettings], dict[str, str]]
    max_qp: int
    qp_line: tuple[float, float]
    maps: MapModel
    units: Callable[[], UnitReader]
    words: UnitWords
    numbered: bool = True
    anchor: bool = True
