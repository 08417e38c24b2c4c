"""A small moving array, a matcher that knows the answer, and figures for tests of coding."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping

import cv2
import numpy as np
from small_arrays import photograph

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.frames import DecodedSet, DisparityMap, FrameSet, Picture
from mvcodec.stream import Packet

RANGE_PX = (-4.0, 12.0)


def make_array(
    width: int = 96, height: int = 64, fps: float = 10.0, rows: int = 2, cols: int = 2
) -> CameraArray:
    """An array whose cameras are all real."""
    calibration = Calibration.nominal(width, height)
    real_rows, real_cols = tuple(range(rows)), tuple(range(cols))
    return CameraArray(rows, cols, width, height, fps, real_rows, real_cols, calibration)


def frame_set(array: CameraArray, index: int) -> FrameSet:
    """A photograph that moves with time and camera."""
    pictures = {}
    for row, col in array.real:
        top, left = 40 + 5 * row + index, 60 + 5 * col + 2 * index
        pictures[row, col] = photograph("coffee")[top : top + array.height, left : left + array.width]
    return FrameSet(index, round(index * 1e9 / array.fps), pictures)


def ramp(array: CameraArray, camera: Position) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """A map from far on the left to near on the right, different for each camera."""
    low, high = RANGE_PX
    row = np.linspace(low, high - camera[0] - 2 * camera[1], array.width, dtype=np.float32)
    return np.repeat(row[None], array.height, axis=0)


class RampMatcher:
    """Stands in for a matcher: returns `ramp`."""

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher`."""
        assert range_px == RANGE_PX
        shape = (array.height, array.width)
        return {camera: DisparityMap(ramp(array, camera), np.ones(shape, np.bool_)) for camera in pictures}


def config(**changes: object) -> EncoderConfig:
    """A configuration with the stand-in matcher, fast."""
    settings: dict[str, object] = {
        "qp": 20,
        "preset": "veryfast",
        "matcher": RampMatcher(),
        "disparity_range_px": RANGE_PX,
    }
    return EncoderConfig(**{**settings, **changes})  # type: ignore[arg-type]


def encode(array: CameraArray, frames: int, first: int = 0, **changes: object) -> list[list[Packet]]:
    """The packets of each frame set."""
    with Encoder(array, config(**changes)) as encoder:
        return [encoder.push(frame_set(array, first + number)) for number in range(frames)]


def encoded_file(array: CameraArray, frames: int, first: int = 0, **changes: object) -> bytes:
    """A whole file."""
    file = io.BytesIO()
    with McapWriter(file) as writer:
        for packets in encode(array, frames, first, **changes):
            writer.push(packets)
    return file.getvalue()


def pushed(packets: Iterable[Packet]) -> list[DecodedSet]:
    """What a new decoder makes of these packets."""
    with Decoder() as decoder:
        return [found for packet in packets for found in decoder.push(packet)]


class Pipe(io.RawIOBase):
    """Bytes that can be read once, a few at a time, and not sought in."""

    def __init__(self, content: bytes, at_most: int = 1000) -> None:
        self._content = io.BytesIO(content)
        self._at_most = at_most

    def readable(self) -> bool:
        return True

    def read(self, size: int | None = -1, /) -> bytes:
        return self._content.read(min(self._at_most, self._at_most if size is None or size < 0 else size))


def luma_psnr(a: Picture, b: Picture) -> float:
    """PSNR of luma, dB, as ALGORITHMS section 7 has it."""
    grey = [cv2.cvtColor(np.ascontiguousarray(x), cv2.COLOR_RGB2GRAY).astype(np.float64) for x in (a, b)]
    return float(10 * np.log10(255**2 / np.mean((grey[0] - grey[1]) ** 2)))
