"""How pictures of an input are read, and what happens to those that cannot be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mvcodec.errors import InputError, SettingError

OnUnreadable = Callable[[InputError], None]


@dataclass(frozen=True, slots=True)
class Reading:
    """Settings of every kind of input.

    Attributes:
        bits: how many bits of 16-bit pictures are used; None: see `BitDepth`.
        on_unreadable: told of a picture that cannot be read, whose frame set is left out; None: it is
            raised.
        split: (rows, cols) of views in each picture of a file; None: one, or those of a quilt by its name.

    Raises:
        SettingError: `split` has no view.
    """

    bits: int | None = None
    on_unreadable: OnUnreadable | None = None
    split: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if self.split is not None and min(self.split) < 1:
            raise SettingError("split", f"{self.split[0]}x{self.split[1]}", "RxC, at least 1x1")
