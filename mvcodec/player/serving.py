"""Runs the server until it is interrupted."""

from __future__ import annotations

import socket
import sys
import threading
import warnings
import webbrowser
from collections.abc import Callable

import uvicorn
from starlette.types import ASGIApp

from mvcodec.decoding.kept_memory import keep_freed_memory_of_a_server
from mvcodec.errors import MvCodecWarning, SettingError
from mvcodec.player.access import AccessRules, is_loopback
from mvcodec.player.messages import MAX_MESSAGE_BYTES

SWITCH_S = 0.0005
"""A picture is made in some twenty steps that each wait for the interpreter; at Python's own 5 ms a thread
that is busy elsewhere doubles the time that the picture takes."""

WILDCARDS = {
    "0.0.0.0": (socket.AF_INET, "192.0.2.1", "127.0.0.1"),
    "::": (socket.AF_INET6, "2001:db8::1", "::1"),
}
"""Hosts that stand for all addresses; an address elsewhere (of documents, nobody's), and loopback."""

GRACE_S = 2
"""How long an interrupted server waits for its viewers' connections to close."""


def serve(
    make: Callable[[AccessRules], ASGIApp],
    host: str,
    port: int,
    *,
    on_ready: Callable[[str], object],
    open_browser: bool = False,
) -> None:
    """Serve until Ctrl-C or SIGTERM.

    Args:
        make: makes the application, which must keep the rules.
        host: address or name to bind to; beyond loopback it is warned about.
        port: 0 takes any free one.
        on_ready: called with the page's URL once the port is bound.
        open_browser: show the page in the default browser.

    Raises:
        SettingError: the address cannot be bound.
    """
    listener = _bind(host, port)
    with listener:
        url = page_url(host, listener.getsockname()[1])
        if not is_loopback(host):
            text = f"`host` {host}: everyone who reaches this machine over the network can watch this file"
            warnings.warn(text, MvCodecWarning, stacklevel=2)
        config = uvicorn.Config(
            make(AccessRules(host)),
            log_level="warning",
            access_log=False,
            server_header=False,
            ws="websockets-sansio",
            ws_max_size=MAX_MESSAGE_BYTES,
            # Pictures are compressed already.
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=GRACE_S,
        )
        sys.setswitchinterval(SWITCH_S)
        keep_freed_memory_of_a_server()
        on_ready(url)
        if open_browser:
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
        uvicorn.Server(config).run(sockets=[listener])


def _bind(host: str, port: int) -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen()
        except BaseException:
            listener.close()
            raise
    except OSError as error:
        found = f"{host}, {port} ({error.strerror or error})"
        raise SettingError("host, port", found, "an address of this machine and a free port") from None
    return listener


def page_url(host: str, port: int) -> str:
    """Where the page is; of a host that stands for all addresses, one that others can use."""
    shown = _reachable(host) if host in WILDCARDS else host
    return f"http://[{shown}]:{port}/" if ":" in shown else f"http://{shown}:{port}/"


def _reachable(wildcard: str) -> str:
    """The address of this machine that others can use, loopback where it has none."""
    family, elsewhere, loopback = WILDCARDS[wildcard]
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((elsewhere, 9))  # sends nothing: it only chooses the way that packets would take
            return str(probe.getsockname()[0])
        except OSError:
            return loopback
