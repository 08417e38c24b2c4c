"""Topics of a recording that hold depth: how far away the pixels of a camera's pictures are."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from mvcodec.capture.picture_messages import MAX_PIXELS
from mvcodec.capture.still_pictures import GREY_MODES, UnreadablePicture, opened_still
from mvcodec.container.recorded_pictures import RecordedPicture
from mvcodec.errors import InputError

Depths = NDArray[np.float32]
"""float32 (H, W), metres along the cameras' axis; NaN where unknown."""

_RAW = {"16uc1": ("u2", 1000.0), "mono16": ("u2", 1000.0), "32fc1": ("f4", 1.0)}
"""Encoding -> type of a value, and values a metre."""

_PACKED = "compressedDepth"
"""ROS's own: a header of 12 bytes before a PNG (compressed_depth_image_transport)."""

_EXPECTED = "16UC1 in mm, 32FC1 in m, compressedDepth as PNG, or a 16-bit grey PNG in mm"


class DepthDecoder:
    """Decodes the depth of one topic.

    Args:
        name: of the recording, for messages.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def look(self, message: RecordedPicture) -> None:
        """Nothing of depth is settled by its first pictures."""

    def decode(self, message: RecordedPicture) -> Depths:
        """See `Depths`; values of 0 are unknown.

        Raises:
            InputError: damaged, or of a format that is no depth.
        """
        values = self._raw(message) if message.kind == "raw" else self._coded(message)
        return np.where(np.isfinite(values) & (values > 0), values, np.float32(np.nan))

    def _raw(self, message: RecordedPicture) -> Depths:
        assert message.layout is not None
        width, height, step = message.layout
        known = _RAW.get(message.format.strip().casefold())
        if known is None:
            raise self._error(message, f"depth of encoding {message.format!r}", _EXPECTED)
        kind, scale = known
        used = width * int(kind[1])
        if not (width and height and width * height <= MAX_PIXELS and step >= used):
            raise self._error(message, f"{width}x{height} px in rows of {step} bytes", "a map's layout")
        if len(message.data) < step * (height - 1) + used:
            raise self._error(message, f"{len(message.data)} bytes", f"{step * height}")
        data = message.data[: step * height].ljust(step * height, b"\0")
        rows = np.frombuffer(data, np.uint8).reshape(height, step)[:, :used]
        order = ">" if message.big_endian else "<"
        return (np.ascontiguousarray(rows).view(order + kind) / np.float32(scale)).astype(np.float32)

    def _coded(self, message: RecordedPicture) -> Depths:
        data, quantised = message.data, None
        if message.kind != "image":
            raise self._error(message, "a video", _EXPECTED)
        if _PACKED in message.format:
            if len(data) < 12:
                raise self._error(message, f"{len(data)} bytes", _EXPECTED)
            if message.format.strip().casefold().startswith("32fc1"):
                quantised = struct.unpack_from("<ff", data, 4)
            data = data[12:]
        try:
            with opened_still(data) as picture:
                if picture.mode not in GREY_MODES or picture.width * picture.height > MAX_PIXELS:
                    raise UnreadablePicture(f"a picture of {picture.width}x{picture.height} ({picture.mode})")
                values = np.array(picture).astype(np.float32)
        except UnreadablePicture as error:
            raise self._error(message, f"{error} in format {message.format!r}", _EXPECTED) from None
        if quantised is None:
            return values / np.float32(1000)
        # Inverse depth, in steps: a / (value - b).
        with np.errstate(divide="ignore"):
            return np.where(values > 0, quantised[0] / (values - quantised[1]), 0).astype(np.float32)

    def _error(self, message: RecordedPicture, found: str, expected: str) -> InputError:
        return InputError(f"{self._name}: {message.label}", found, expected)
