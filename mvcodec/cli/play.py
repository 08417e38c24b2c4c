"""``mvcodec play``: watch a file in the browser, from any viewpoint."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from mvcodec.array import CameraArray
from mvcodec.cli.arguments import DEFAULT_SYNTHESIZER, add_matcher, add_synthesizer, check_matcher
from mvcodec.cli.paths import local_path
from mvcodec.cli.safety import add_limits, add_on_error, limits_of
from mvcodec.container.reader import McapReader
from mvcodec.errors import require_packages
from mvcodec.synthesis.synthesizers import make_synthesizer, quicker_synthesizer

if TYPE_CHECKING:
    from mvcodec.player.originals import Originals

EXTRA = "play"
PACKAGES = ("starlette", "uvicorn", "websockets")
MAX_PORT = 65535
RENDERERS = ("web", "server")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``play``."""
    parser.add_argument("input", type=local_path, metavar="FILE.mcap", help="the file to watch")
    parser.add_argument(
        "--original", type=local_path, metavar="ARRAY", help="array folder to compare the pictures with"
    )
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default: %(default)s)")
    parser.add_argument("--port", type=_port, default=0, help="0 takes any free one (default: 0)")
    parser.add_argument("--no-browser", action="store_true", help="print the URL, open no browser")
    parser.add_argument(
        "--renderer",
        choices=RENDERERS,
        help="who decodes and synthesises: the browser (web), or this program, which sends pictures; "
        "default: web; server with --synthesizer or --matcher, for a file without maps, and for one with "
        "enhanced views",
    )
    add_synthesizer(parser)
    add_matcher(parser)
    add_on_error(parser, "skip")
    add_limits(parser)


def run(arguments: argparse.Namespace) -> None:
    """Serve the page until Ctrl-C."""
    require_packages(PACKAGES, EXTRA)
    if _renderer(arguments) == "web":
        _serve_file(arguments)
    else:
        _serve_pictures(arguments)


def _renderer(arguments: argparse.Namespace) -> str:
    """Who renders: as asked, else whoever can do what is asked for."""
    if arguments.renderer is not None:
        return str(arguments.renderer)
    if arguments.matcher is not None or arguments.synthesizer != DEFAULT_SYNTHESIZER:
        return "server"
    with McapReader.open(arguments.input, limits_of(arguments)) as reader:
        return "server" if reader.header.version > 1 or reader.has_layer else "web"


def _serve_file(arguments: argparse.Namespace) -> None:
    """The page decodes by itself; this program hands it the file."""
    from mvcodec.player.serving import serve
    from mvcodec.player.web_server import make_web_app

    with McapReader.open(arguments.input, limits_of(arguments)) as reader:
        array = reader.header.array  # what is no file of ours is told at once
    _serve(serve, partial(make_web_app, arguments.input, _originals(arguments, array)), arguments)


def _originals(arguments: argparse.Namespace, array: CameraArray) -> Originals | None:
    from mvcodec.capture import open_input
    from mvcodec.player.originals import Originals

    return None if arguments.original is None else Originals(open_input([arguments.original]), array)


def _serve(serve: Callable[..., None], make: Callable[..., object], arguments: argparse.Namespace) -> None:
    with suppress(KeyboardInterrupt):
        serve(
            make,
            arguments.host,
            arguments.port,
            on_ready=_announce,
            open_browser=not arguments.no_browser,
        )


def _serve_pictures(arguments: argparse.Namespace) -> None:
    """This program decodes and synthesises, and sends pictures."""
    from mvcodec.player.picture_maker import PictureMaker
    from mvcodec.player.server import Broadcast, make_app
    from mvcodec.player.serving import serve
    from mvcodec.player.warming import warm_up_beside

    make_synthesizer(arguments.synthesizer)  # a wrong name is told before anything is opened
    quicker = quicker_synthesizer(arguments.synthesizer)
    makers = [partial(make_synthesizer, name) for name in (arguments.synthesizer, quicker) if name]
    maker = PictureMaker(
        arguments.input,
        makers[0],
        makers[1] if quicker else None,
        limits_of(arguments),
        arguments.matcher,
    )
    try:
        check_matcher(arguments.matcher, maker.store.table.header)
        maker.originals = _originals(arguments, maker.store.table.header.array)
        broadcast = Broadcast(
            maker,
            title=arguments.input.name,
            synthesizer=arguments.synthesizer,
            stop_on_damage=arguments.on_error == "stop",
        )
        warm_up_beside(makers, _tell_compiling)
        _serve(serve, partial(make_app, broadcast), arguments)
    finally:
        maker.close()


def _tell_compiling() -> None:
    text = "compiling, once after an installation: the first pictures take longer"
    print(f"mvcodec: {text}", file=sys.stderr, flush=True)


def _announce(url: str) -> None:
    print(f"{url} (Ctrl-C stops)", flush=True)


def _port(text: str) -> int:
    if not re.fullmatch(r"\d{1,5}", text) or int(text) > MAX_PORT:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected 0..{MAX_PORT}")
    return int(text)
