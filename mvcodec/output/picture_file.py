"""One file for the pictures of a video, by its ending: MP4, GIF, WebP; PNG holds the first one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from PIL import Image

from mvcodec.errors import OutputError, SettingError
from mvcodec.frames import Picture
from mvcodec.output.atomic import replacing
from mvcodec.output.pictures import write_png
from mvcodec.output.video_file import Mp4Writer

STILL_SUFFIX = ".png"
MAX_ANIMATION_PX = 2**28
"""Pixels of all pictures of a GIF or WebP together: Pillow holds them all in memory."""

WEBP_QUALITY, WEBP_METHOD = 75, 4
GIF_TICKS = 100
"""A second's; a GIF counts time in them."""

MIN_GIF_TICKS = 2
"""Browsers show shorter pictures for ten."""

PictureWriter = Callable[[Path, Iterator[Picture], float], None]


def _write_mp4(path: Path, pictures: Iterator[Picture], fps: float) -> None:
    with ExitStack() as stack:
        writer: Mp4Writer | None = None
        for picture in pictures:
            if writer is None:
                writer = stack.enter_context(Mp4Writer(path, picture.shape[1], picture.shape[0], fps))
            writer.push(picture)


def _write_still(path: Path, pictures: Iterator[Picture], _fps: float) -> None:
    for picture in pictures:
        write_png(path, picture)
        return


def _write_webp(path: Path, pictures: Iterator[Picture], fps: float) -> None:
    images = [Image.fromarray(picture) for picture in _bounded(path, pictures)]
    if images:
        # Pillow sums the durations up before it rounds to ms.
        _save(path, images, [1000 / fps] * len(images), quality=WEBP_QUALITY, method=WEBP_METHOD)


def _write_gif(path: Path, pictures: Iterator[Picture], fps: float) -> None:
    images: list[Image.Image] = []
    starts: list[int] = []
    end = 0
    for number, picture in enumerate(_bounded(path, pictures)):
        start, end = round(GIF_TICKS * number / fps), round(GIF_TICKS * (number + 1) / fps)
        if not starts or start - starts[-1] >= MIN_GIF_TICKS:
            starts.append(start)
            images.append(_paletted(picture))
    if images:
        ends = [*starts[1:], max(end, starts[-1] + MIN_GIF_TICKS)]
        durations = [1000 / GIF_TICKS * (after - start) for start, after in zip(starts, ends, strict=True)]
        _save(path, images, durations)


WRITERS: dict[str, PictureWriter] = {
    ".mp4": _write_mp4,
    STILL_SUFFIX: _write_still,
    ".gif": _write_gif,
    ".webp": _write_webp,
}
"""By the file's ending: (path, uint8 (H, W, 3) RGB pictures of one size, pictures a second)."""


def find_writer(path: Path) -> PictureWriter:
    """The writer for this file's ending. It writes the file complete or not at all.

    GIF and WebP are repeated for ever. GIF leaves pictures out above 50 a second.

    Raises:
        SettingError: there is none; the message names the endings.
    """
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        raise SettingError("OUT", path, f"a name that ends in {', '.join(WRITERS)}")
    return WRITERS[suffix]


def _bounded(path: Path, pictures: Iterator[Picture]) -> Iterator[Picture]:
    total = 0
    for picture in pictures:
        total += picture.shape[0] * picture.shape[1]
        if total > MAX_ANIMATION_PX:
            held = MAX_ANIMATION_PX // (picture.shape[0] * picture.shape[1])
            raise OutputError(path, f"more than {held} such pictures don't fit; .mp4 takes any number")
        yield picture


def _paletted(picture: Picture) -> Image.Image:
    # Dithering flickers from picture to picture, and half as many bytes again are spent on it.
    return Image.fromarray(picture).quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)


def _save(path: Path, images: list[Image.Image], durations_ms: list[float], **options: Any) -> None:
    with replacing(path) as part:
        first, *others = images
        first.save(part, save_all=True, append_images=others, duration=durations_ms, loop=0, **options)
