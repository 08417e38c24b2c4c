"""How pictures of an input are read, and what happens to those that cannot be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mvcodec.array import MAX_GRID_SIDE
from mvcodec.capture.bit_depth import LEAST_BITS, MOST_BITS
from mvcodec.capture.time_gaps import Gaps, gaps_field
from mvcodec.errors import InputError
from mvcodec.settings import check_settings, setting

OnUnreadable = Callable[[InputError], None]


def used_bits() -> Any:
    """The field of every settings class that has a depth of pictures."""
    return setting(
        None,
        "bits that pictures of 16 bits really use (default: as their files say, or as their values need)",
        low=LEAST_BITS,
        high=MOST_BITS,
    )


def views_in_pictures(default: tuple[int, int] | None = None) -> Any:
    """The field of every settings class of an input whose pictures may hold several views."""
    return setting(
        default,
        "views in each picture of the files or topics: 1x2 side by side, 2x1 top and bottom, or"
        " a mosaic (default: 1x1, and what a quilt's name says)",
        low=1,
        high=MAX_GRID_SIDE,
        expected=f"RxC, each 1..{MAX_GRID_SIDE}",
    )


@dataclass(frozen=True, slots=True)
class Reading:
    """Settings of every kind of input.

    Attributes:
        bits, split, gaps: explained by their fields; see `BitDepth`, `behind_gaps`. No `split`: one view,
            or those of a quilt.
        on_unreadable: told of a picture that cannot be read, whose frame set is left out; None: it is
            raised.

    Raises:
        SettingError: `bits` or `split` is out of range.
    """

    bits: int | None = used_bits()
    on_unreadable: OnUnreadable | None = None
    split: tuple[int, int] | None = views_in_pictures()
    gaps: Gaps | None = gaps_field()

    def __post_init__(self) -> None:
        check_settings(self)
