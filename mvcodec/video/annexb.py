"""H.264 access units in Annex B form: NAL units behind start codes (ITU-T H.264, annex B)."""

from __future__ import annotations

from itertools import pairwise

SEI, SPS, PPS, IDR_SLICE, SLICE = 6, 7, 8, 5, 1
"""nal_unit_type (table 7-1)."""

_USER_DATA_UNREGISTERED = 5
"""payloadType of an SEI message (annex D)."""

_START = b"\x00\x00\x01"


def begins_with_start_code(data: bytes) -> bool:
    """Whether an access unit is in Annex B form."""
    return data.startswith((_START, b"\x00" + _START))


def nal_units(data: bytes) -> list[bytes]:
    """The NAL units of an access unit, without start codes and trailing zeros."""
    starts = []
    at = data.find(_START)
    while at >= 0:
        starts.append(at)
        at = data.find(_START, at + len(_START))
    units = (data[a + len(_START) : b] for a, b in pairwise([*starts, len(data)]))
    return [stripped for unit in units if (stripped := unit.rstrip(b"\x00"))]


def nal_type(unit: bytes) -> int:
    """nal_unit_type of a NAL unit."""
    return unit[0] & 0x1F


def without_user_data(data: bytes) -> bytes:
    """An access unit without SEI of user data, in which encoders write about themselves."""
    units = nal_units(data)
    kept = [
        unit
        for unit in units
        if not (nal_type(unit) == SEI and unit[1:2] == bytes([_USER_DATA_UNREGISTERED]))
    ]
    return data if len(kept) == len(units) else b"".join(b"\x00" + _START + unit for unit in kept)
