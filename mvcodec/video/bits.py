"""Reads the fields of a NAL unit bit by bit (ITU-T H.264 clauses 7.2, 7.3.1 and 9.1; H.265 has the same)."""

from __future__ import annotations

from mvcodec.errors import MvCodecError

MAX_GOLOMB_ZEROS = 32
"""An Exp-Golomb code of ue(v) has at most this many leading zeros; more is damage, not a number."""


class NalError(MvCodecError):
    """A NAL unit that breaks off or holds what the standard does not allow."""


def payload(unit: bytes, head: int = 1, limit: int | None = None) -> bytes:
    """The RBSP of a NAL unit: without its head and its emulation prevention bytes.

    Args:
        unit: a NAL unit without start code.
        head: bytes of the NAL unit's header.
        limit: look at this many bytes of it only.
    """
    return unit[head : None if limit is None else head + limit].replace(b"\x00\x00\x03", b"\x00\x00")


class BitReader:
    """Reads from the most significant bit on.

    Raises (from every method):
        NalError: the data end before the field does.
    """

    def __init__(self, data: bytes) -> None:
        self._value = int.from_bytes(data)
        self._left = 8 * len(data)

    def u(self, count: int) -> int:
        """An unsigned number of `count` bits: u(n)."""
        if count > self._left:
            raise NalError("it ends too early")
        self._left -= count
        return (self._value >> self._left) & ((1 << count) - 1)

    def flag(self) -> bool:
        """One bit."""
        return self.u(1) == 1

    def ue(self) -> int:
        """An unsigned Exp-Golomb number: ue(v)."""
        ahead = self._value & ((1 << self._left) - 1)
        zeros = self._left - ahead.bit_length()
        if zeros > MAX_GOLOMB_ZEROS:
            raise NalError("a number of more than 32 bits")
        return self.u(2 * zeros + 1) - 1

    def se(self) -> int:
        """A signed Exp-Golomb number: se(v)."""
        code = self.ue()
        return (code + 1) // 2 if code % 2 else -(code // 2)
