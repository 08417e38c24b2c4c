"""``mvcodec export-web``: a page that shows a file, for any web server or to be mailed."""

from __future__ import annotations

import argparse
import base64
import io
import os
from pathlib import Path

from PIL import Image

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.capture import ArraySource, open_input
from mvcodec.cli.arguments import add_output_options
from mvcodec.cli.paths import add_overwrite, check_folder_target, local_path
from mvcodec.cli.progress import progress
from mvcodec.cli.safety import add_limits, limits_of
from mvcodec.container.limits import Limits
from mvcodec.container.reader import McapReader
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import InputError, SettingError
from mvcodec.output.atomic import replacing, write_bytes
from mvcodec.player.originals import check_original
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.web_player.pages import linked_page, page_files, single_page

RECORDING, POSTER, ORIGINALS = "video.mcap", "poster.jpg", "original"
PAGE_NAMES = r"index\.html|page\.css|player\.js|licences\.txt|video\.mcap|poster\.jpg|original"
"""What a page is made of, which may be overwritten."""

POSTER_QUALITY = 85
POSTER_SYNTHESIZER = "quick"

MOST_SINGLE_BYTES = 256 << 20
"""A page with a larger file in it takes browsers too much memory to open."""

_BLOCK_BYTES = 1 << 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``export-web``."""
    parser.add_argument("input", type=local_path, metavar="IN.mcap", help="the file to show")
    parser.add_argument(
        "output", type=local_path, metavar="OUTDIR", help="a folder; made where it is missing"
    )
    parser.add_argument(
        "--single-file", action="store_true", help="one HTML with everything in it, which opens from disk"
    )
    parser.add_argument("--title", metavar="T", help="of the page (default: the file's name)")
    parser.add_argument("--poster", action="store_true", help="show a picture while the file is loaded")
    parser.add_argument(
        "--original",
        type=local_path,
        metavar="ARRAY",
        help="array folder to compare the views with; its pictures are written as PNG into OUTDIR/original",
    )
    add_overwrite(parser)
    add_limits(parser)
    add_output_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Write the page."""
    source: Path = arguments.input
    folder: Path = arguments.output
    limits = limits_of(arguments)
    check_folder_target(folder, PAGE_NAMES, overwrite=arguments.overwrite)
    if (folder / RECORDING).resolve() == source.resolve():
        raise SettingError("OUTDIR", folder, "another folder than the file's")
    if arguments.single_file and arguments.original is not None:
        raise SettingError(
            "--original", arguments.original, "none with --single-file: the pictures lie beside the page"
        )
    with McapReader.open(
        source, limits
    ) as reader:  # what is no file of ours is told before anything is written
        original = _open_original(arguments.original, reader.header.array)
    title = source.stem if arguments.title is None else arguments.title
    poster = _poster(source, limits) if arguments.poster else None
    if arguments.single_file:
        written = _write_single(source, folder, title, poster)
    else:
        pictures = (
            None
            if original is None
            else _write_originals(original, source, folder, limits, quiet=arguments.quiet)
        )
        written = _write_site(source, folder, title, poster, pictures, quiet=arguments.quiet)
    if not arguments.quiet:
        print(f"{folder}: {', '.join(written)}")


def _write_single(source: Path, folder: Path, title: str, poster: bytes | None) -> list[str]:
    size = source.stat().st_size
    if size > MOST_SINGLE_BYTES:
        raise InputError(source, f"{size} bytes", f"at most {MOST_SINGLE_BYTES} with --single-file")
    url = None if poster is None else f"data:image/jpeg;base64,{base64.b64encode(poster).decode()}"
    write_bytes(folder / "index.html", single_page(title, source.read_bytes(), url).encode())
    return ["index.html, which opens from disk"]


def _write_site(
    source: Path, folder: Path, title: str, poster: bytes | None, originals: str | None, *, quiet: bool
) -> list[str]:
    """Whatever breaks off leaves no page that lacks a part: `index.html` comes last."""
    names = [name for name in page_files() if name != "index.html"]
    for name in names:
        write_bytes(folder / name, page_files()[name])
    if poster is not None:
        write_bytes(folder / POSTER, poster)
    _copy(source, folder / RECORDING, quiet=quiet)
    page = linked_page(title, RECORDING, None if poster is None else POSTER, originals)
    write_bytes(folder / "index.html", page.encode())
    beside = [POSTER] * (poster is not None) + [ORIGINALS] * (originals is not None)
    return ["index.html", *names, RECORDING, *beside]


def _open_original(path: Path | None, array: CameraArray) -> ArraySource | None:
    if path is None:
        return None
    original = open_input([path])
    check_original(original, array)
    return original


def _write_originals(
    original: ArraySource, source: Path, folder: Path, limits: Limits, *, quiet: bool
) -> str:
    """All views of the file's frames, as ``original/FRAME/ROW/COL.png``; the folder's name."""
    with McapReader.open(source, limits) as reader:
        numbers = sorted({packet.index - original.first_frame for _, packet in reader.packets()})
    numbers = [number for number in numbers if 0 <= number < original.frame_count]
    if not numbers:
        raise InputError(original.name, "none of the file's frames", "those that the file was encoded from")
    with progress("originals", len(numbers), quiet=quiet) as bar:
        for number in numbers:
            (frames,) = original.frame_sets(slice(number, number + 1), original.array.positions)
            for (row, col), picture in frames.pictures.items():
                room = io.BytesIO()
                Image.fromarray(picture).save(room, "PNG")
                write_bytes(folder / ORIGINALS / str(frames.index) / str(row) / f"{col}.png", room.getvalue())
            bar.update()
    return ORIGINALS


def _copy(source: Path, target: Path, *, quiet: bool) -> None:
    with (
        source.open("rb") as file,
        replacing(target) as part,
        part.open("wb") as out,
        progress("copy", os.fstat(file.fileno()).st_size, quiet=quiet, unit="B") as bar,
    ):
        while block := file.read(_BLOCK_BYTES):
            out.write(block)
            bar.update(len(block))


def _poster(source: Path, limits: Limits) -> bytes:
    """The first frame from the middle of the array, as JPEG."""
    with Decoder.open(source, slice(0, 1), "skip", limits) as decoder:
        decoded = next(iter(decoder), None)
    if decoded is None:
        raise InputError(source, "no frame set that can be decoded", "one for the poster")
    array = decoded.array
    middle = Viewpoint((array.rows - 1) / 2, (array.cols - 1) / 2)
    picture = make_synthesizer(POSTER_SYNTHESIZER).render(decoded, middle).pixels
    room = io.BytesIO()
    Image.fromarray(picture).save(room, "JPEG", quality=POSTER_QUALITY)
    return room.getvalue()
