"""Messages in H.264 streams that say where decoding can start besides keyframes (ITU-T H.264, annex D)."""

from __future__ import annotations

from mvcodec.video.bits import payload

RECOVERY_POINT = 6
"""payloadType."""

_MAX_BYTES = 4096
_FIRST_BIT = 0x80


def recovers_at_once(unit: bytes) -> bool:
    """Whether an SEI unit holds a recovery point with no pictures to wait for (7.3.2.3.1, D.1.8)."""
    data = payload(unit, limit=_MAX_BYTES)
    at = 0
    while at < len(data):
        kind, at = _number(data, at)
        size, at = _number(data, at)
        if kind == RECOVERY_POINT:
            # recovery_frame_cnt is ue(v): 0 is a single bit.
            return at < len(data) and bool(data[at] & _FIRST_BIT)
        at += size
    return False


def _number(data: bytes, at: int) -> tuple[int, int]:
    """A number in bytes of 255 and a last one, and where it ends."""
    number = 0
    while at < len(data) and data[at] == 255:
        number, at = number + 255, at + 1
    return number + (data[at] if at < len(data) else 0), at + 1
