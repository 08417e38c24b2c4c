"""What the user says about time, and frame rates from the times of pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from typing import Any

from mvcodec.array import MAX_FPS, MIN_FPS
from mvcodec.capture.pairing import typical_step_ns
from mvcodec.errors import SettingError
from mvcodec.settings import check_settings, setting

SYNCS = ("motion", "audio")

_STANDARD_RATES = tuple(
    Fraction(rate * 1000, divisor)
    for rate in (12, 15, 24, 25, 30, 48, 50, 60, 90, 100, 120, 240)
    for divisor in (1000, 1001)
)
_MEDIAN_SHARE = 1e-3
_USUAL_SHARE = 0.25


def nominal_fps() -> Any:
    """The field of every settings class that has a frame rate."""
    return setting(
        None,
        "nominal frame rate, and that of files without times (default: from the times)",
        low=MIN_FPS,
        high=MAX_FPS,
    )


def tolerance() -> Any:
    """The field of every settings class that says which pictures belong to one time."""
    return setting(
        None,
        "how far apart pictures of one frame set may be taken, ms (default: half of a frame's time)",
        low=0,
        high=10_000,
    )


@dataclass(frozen=True, slots=True)
class Timing:
    """When pictures were taken, as far as the user knows better than the files. Fields explain themselves.

    Raises:
        SettingError: a number is out of range.
    """

    fps: float | None = nominal_fps()
    offsets_ms: Mapping[str, float] = field(default_factory=dict)
    """What is added to the times of a camera's pictures, by its file's name or place, ms."""
    tolerance_ms: float | None = tolerance()
    sync: str | None = setting(
        None,
        "estimate the other offsets from what moves in the pictures, or from the sound tracks of files",
        choices=SYNCS,
    )

    def __post_init__(self) -> None:
        check_settings(self)
        for camera, offset in self.offsets_ms.items():
            if not math.isfinite(offset):
                raise SettingError("offsets_ms", f"{camera}={offset}", "CAMERA=MS, a number of milliseconds")


def steady_rate(times_ns: Sequence[int], unit_ns: float, stated: Sequence[Fraction]) -> Fraction | None:
    """The rate whose grid all times lie on, no finer than they need it; None where there is none.

    Args:
        times_ns: ascending.
        unit_ns: what the container counts time in: its times are that coarse.
        stated: rates to try before the usual ones.
    """
    for rate in (*stated, *_STANDARD_RATES):
        if rate <= 0:
            continue
        step = 1e9 / rate
        if abs(typical_step_ns(times_ns) - step) > unit_ns + 1:
            continue
        if all(
            abs((t - times_ns[0]) - round((t - times_ns[0]) / step) * step) <= unit_ns + 1 for t in times_ns
        ):
            return rate
    return None


def on_grid(times_ns: Sequence[int], rate: Fraction, unit_ns: float) -> tuple[int, ...]:
    """Times that a container rounded to its unit, put back on the grid of their rate."""
    # The first time is rounded too: a grid through zero is the likelier one where it fits.
    begin = round(times_ns[0] * rate / 10**9) / rate * 10**9
    if abs(begin - times_ns[0]) > unit_ns / 2 + 1:
        begin = Fraction(times_ns[0])
    counts = (round((t - begin) * rate / 10**9) for t in times_ns)
    return tuple(round(begin + count * 10**9 / rate) for count in counts)


def rate_of_times(times_ns: Sequence[int]) -> float | None:
    """Pictures a second by the usual steps, a usual rate where one is near; None for fewer than two.

    Pauses and what is missing don't count; rounded steps do all together.
    """
    typical = typical_step_ns(times_ns)
    if not typical:
        return None
    near = [b - a for a, b in pairwise(times_ns) if abs(b - a - typical) <= _USUAL_SHARE * typical]
    fps = 1e9 * len(near) / sum(near)
    nearest = min(_STANDARD_RATES, key=lambda rate: abs(float(rate) - fps))
    return float(nearest) if abs(float(nearest) - fps) <= _MEDIAN_SHARE * fps else round(fps, 3)
