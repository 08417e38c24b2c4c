"""Pictures of more than 8 bits -> 8 bits, by the depth that they really have."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import MvCodecWarning, SettingError

DeepPixels = NDArray[np.uint16]
"""uint16 (H, W) or (H, W, channels)."""

_DEPTHS = (8, 10, 12, 14, 16)


LEAST_BITS, MOST_BITS = 8, 16


class BitDepth:
    """How many bits of 16 the pictures of an input use; one for all its cameras.

    Many cameras write 10, 12 or 14 bits into pictures of 16. What the user or the file says counts; else
    the brightest pixel of the first pictures, which is told.

    Args:
        name: of the input, for messages.
        bits: what the user says; None: nothing.

    Raises:
        SettingError: `bits` outside of 8..16.
    """

    def __init__(self, name: str, bits: int | None = None) -> None:
        if bits is not None and not LEAST_BITS <= bits <= MOST_BITS:
            raise SettingError("bits", bits, f"{LEAST_BITS}..{MOST_BITS}")
        self._name, self._given, self._bits, self._told = name, bits, bits, False

    def look(self, pixels: DeepPixels) -> None:
        """Take a picture into account before the first one is scaled."""
        needed = next(bits for bits in _DEPTHS if int(pixels.max(initial=0)) < 1 << bits)
        if self._given is None and not self._told:
            self._bits = max(self._bits or 0, needed)

    def scale(self, pixels: DeepPixels, stated_bits: int | None = None) -> NDArray[np.uint8]:
        """uint8 of the same shape: the largest value of the depth becomes 255.

        Args:
            stated_bits: the depth that the file itself states; None: nothing.
        """
        bits = self._given or stated_bits
        if bits is None:
            if self._bits is None:
                self.look(pixels)
            bits = self._settled(int(pixels.max(initial=0)))
        top = (1 << bits) - 1
        scaled = (pixels.astype(np.uint32) * 255 + top // 2) // top
        return np.asarray(np.minimum(scaled, 255), np.uint8)

    def _settled(self, brightest: int) -> int:
        assert self._bits is not None
        if not self._told:
            self._told = True
            if self._bits < 16:
                self._warn(
                    f"values of its 16-bit pictures stay below {1 << self._bits}: taken as {self._bits} bits"
                )
        elif brightest >= 1 << self._bits:
            self._warn(f"a value of {brightest} where {self._bits} bits were found so far: it is cut off")
        return self._bits

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self._name}: {text}; `bits` N says what is right", MvCodecWarning, stacklevel=4)
