"""The form of the model that says what maps are coded with; each codec has figures of its own for it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MapModel:
    """What maps are coded with, from the pictures' QP or CRF, all on the codec's own scale.

    Attributes:
        half_from: the QP from which on maps are coded at half size each way, and only every second
            camera of an array sends one.
        full: map QP less picture QP for maps of full size whose range is at most REFERENCE_PX wide.
        half: the same for maps of half size.
        alternate: added where only every second camera sends a map.
        fine_extra: added where all cameras do, at half size, and pictures are fine: all of it up to
            QP FINE_UNTIL less this, nothing from FINE_UNTIL on.
        octave: what doubles the quantiser's step. A range twice as wide makes a code value worth twice
            the pixels, so the map QP falls by this.
    """

    half_from: float
    full: int
    half: int
    alternate: int
    fine_extra: int
    octave: int


H26X = MapModel(half_from=25, full=5, half=0, alternate=-2, fine_extra=5, octave=6)
"""H.264 and HEVC. x265's QPs have the steps of x264's: at QP 32 the model's choice is on the hull of both
sets tried."""
