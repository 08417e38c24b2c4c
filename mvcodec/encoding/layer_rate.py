"""The bits of an enhancement layer: beside a base of constant quality, and within a bit rate of both."""

from __future__ import annotations

import math

from mvcodec.video.vp9_reference import MAX_QUANTIZER

LAYER_OFFSET = 6
"""What the layer's QP is more than the pictures', on libx264's scale: fitted in `docs/prediction.md`."""

LAYER_SHARE = 0.15
"""The layer's part of a bit rate for base and layer together."""

HALVING = 5.6
"""Quantizers up that halve a layer's bits."""

START_QUANTIZER = 42
MOST_TRIES = 3
_CLOSE = 1.5
_FURTHEST = 12
_LEAST = 0.25


class LayerRate:
    """Chooses a quantizer for each keyframe's span, so that base and layer together hold a bit rate.

    Args:
        kbps: of base and layer.
        fps: frame sets a second.
    """

    def __init__(self, kbps: float, fps: float) -> None:
        self._per_set = 1000 * kbps / fps
        self._quantizer = float(START_QUANTIZER)
        self._spent = self._layer = 0.0
        self._sets = self._span = 0

    @property
    def quantizer(self) -> int:
        """For the units from the keyframe at hand on."""
        return round(self._quantizer)

    def begin(self) -> None:
        """A keyframe comes: aim again, by what the span before it took."""
        if self._span:
            debt = self._spent - self._sets * self._per_set
            aim = LAYER_SHARE * self._per_set - debt / self._span
            self._turn(self._layer / self._span, max(aim, _LEAST * LAYER_SHARE * self._per_set))
        self._layer, self._span = 0.0, 0

    def try_again(self, bits: int) -> bool:
        """Whether the layer's very first frame set is to be coded again with another quantizer.

        Args:
            bits: that it took.
        """
        aim = LAYER_SHARE * self._per_set
        if self._sets or aim / _CLOSE < bits < aim * _CLOSE:
            return False
        before = self.quantizer
        self._turn(bits, aim)
        return self.quantizer != before

    def spend(self, base: int, layer: int) -> None:
        """Count the bits of a frame set."""
        self._spent += base + layer
        self._layer += layer
        self._sets += 1
        self._span += 1

    def _turn(self, bits: float, aim: float) -> None:
        change = HALVING * math.log2(max(bits, 1.0) / aim)
        change = min(max(change, -_FURTHEST), _FURTHEST)
        self._quantizer = min(max(self._quantizer + change, 1.0), float(MAX_QUANTIZER))
