"""Who may talk to the server: the Host and Origin rules.

A page of another site must not reach the player through the viewer's browser, not even by a name that it
points at this machine (DNS rebinding). So Host must be an address or a name that is known to be this machine,
and a WebSocket's Origin, which browsers always send, must be the player's own page.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Collection
from urllib.parse import urlsplit

LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})


def is_loopback(host: str) -> bool:
    """Whether an address or name to bind to is this machine alone."""
    if host == "localhost":
        return True
    address = _address(host)
    return address is not None and address.is_loopback


class AccessRules:
    """The rules for one bound host.

    Args:
        bound: the host that the server was told to listen on.
    """

    def __init__(self, bound: str) -> None:
        self._any_address = not is_loopback(bound)
        names = {bound.lower(), *LOOPBACK_NAMES}
        if self._any_address:
            names |= {socket.gethostname().lower(), socket.getfqdn().lower()}
        self._names: Collection[str] = frozenset(names)

    def allows_host(self, host: str | None) -> bool:
        """Whether a Host header may ask for anything. Addresses cannot be rebound; names must be ours."""
        name = _host_name(host)
        return name is not None and (
            name in self._names or (self._any_address and _address(name) is not None)
        )

    def allows_origin(self, origin: str | None, host: str | None) -> bool:
        """Whether a WebSocket may open: it comes from our own page, or from no page at all."""
        if origin is None:
            return True
        try:
            found = urlsplit(origin)
        except ValueError:
            return False
        return found.scheme in ("http", "https") and found.netloc.lower() == (host or "").lower()


def _host_name(host: str | None) -> str | None:
    """``example:80`` -> ``example``, ``[::1]:80`` -> ``::1``."""
    try:
        return urlsplit(f"//{host}").hostname if host else None
    except ValueError:
        return None


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None
