"""Addresses of live cameras: what FFmpeg opens that is no file."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

_NETWORK = re.compile(r"(rtsps?|udp|rtp|srt|tcp)://.", re.IGNORECASE)
_DEVICE = re.compile(r"(v4l2|avfoundation|dshow):(.+)", re.IGNORECASE)

_LOOKED_AT = {"analyzeduration": "1000000", "probesize": "2000000"}
"""How much of a stream FFmpeg reads before it says what is in it: microseconds, and bytes."""

_OF_PROTOCOL = {
    "udp": {"overrun_nonfatal": "1", "fifo_size": "50000"},
    "rtsp": {"rtsp_transport": "tcp"},
    "rtsps": {"rtsp_transport": "tcp"},
}


@dataclass(frozen=True, slots=True)
class Opened:
    """How FFmpeg opens an address.

    Attributes:
        file, form, options: arguments of `av.open`; a `form` of None is found out.
    """

    file: str
    form: str | None = None
    options: dict[str, str] = field(default_factory=dict)


def is_live_address(text: str) -> bool:
    """Whether a name is a live camera's; a file of that name comes first."""
    return bool(_NETWORK.match(text) or _DEVICE.match(text)) and not Path(text).exists()


def how_to_open(address: str) -> Opened:
    """What FFmpeg is told for an address."""
    device = _DEVICE.match(address)
    if device is not None:
        return Opened(device[2], device[1].lower())
    protocol = address.partition("://")[0].lower()
    return Opened(address, None, _LOOKED_AT | _OF_PROTOCOL.get(protocol, {}))
