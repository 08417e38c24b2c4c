"""How pictures of an input are read, and what happens to those that cannot be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mvcodec.errors import InputError

OnUnreadable = Callable[[InputError], None]


@dataclass(frozen=True, slots=True)
class Reading:
    """Settings of every kind of input.

    Attributes:
        bits: how many bits of 16-bit pictures are used; None: see `BitDepth`.
        on_unreadable: told of a picture that cannot be read, whose frame set is left out; None: it is
            raised.
    """

    bits: int | None = None
    on_unreadable: OnUnreadable | None = None
