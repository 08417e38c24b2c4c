"""How pictures of an input are read, and what happens to those that cannot be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mvcodec.capture.bit_depth import LEAST_BITS, MOST_BITS
from mvcodec.errors import InputError, SettingError
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


@dataclass(frozen=True, slots=True)
class Reading:
    """Settings of every kind of input.

    Attributes:
        bits: explained by its field; see `BitDepth`.
        on_unreadable: told of a picture that cannot be read, whose frame set is left out; None: it is
            raised.
        split: (rows, cols) of views in each picture of a file; None: one, or those of a quilt by its name.

    Raises:
        SettingError: `bits` is out of range, or `split` has no view.
    """

    bits: int | None = used_bits()
    on_unreadable: OnUnreadable | None = None
    split: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        check_settings(self)
        if self.split is not None and min(self.split) < 1:
            raise SettingError("split", f"{self.split[0]}x{self.split[1]}", "RxC, at least 1x1")
