"""One file for the pictures of a video, by its ending: MP4, GIF, WebP; PNG holds the first one."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from typing import Any

from PIL import Image

from mvcodec.errors import MvCodecWarning, OutputError, SettingError
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

MAX_GIF_TICKS = (1 << 16) - 1
MAX_WEBP_MS = (1 << 24) - 1
"""How long a picture can be shown, by the fields of these formats."""

Timed = Iterator[tuple[Picture, int]]
"""uint8 (H, W, 3) RGB pictures of one size, each with its time, ns, ascending."""

PictureWriter = Callable[[Path, Timed, float], None]


def at_rate(pictures: Iterable[Picture], fps: float) -> Timed:
    """Pictures with the times of a constant rate."""
    for number, picture in enumerate(pictures):
        yield picture, round(number * 1e9 / fps)


def _write_mp4(path: Path, pictures: Timed, fps: float) -> None:
    with ExitStack() as stack:
        writer: Mp4Writer | None = None
        for picture, time_ns in pictures:
            if writer is None:
                writer = stack.enter_context(Mp4Writer(path, picture.shape[1], picture.shape[0], fps))
            writer.push(picture, time_ns)


def _write_still(path: Path, pictures: Timed, _fps: float) -> None:
    for picture, _ in pictures:
        write_png(path, picture)
        return


def _write_webp(path: Path, pictures: Timed, fps: float) -> None:
    images: list[Image.Image] = []
    times_ns: list[int] = []
    for picture, time_ns in _bounded(path, pictures):
        images.append(Image.fromarray(picture))
        times_ns.append(time_ns)
    if images:
        steps = [(after - before) / 1e6 for before, after in pairwise([*times_ns, times_ns[-1] + 1e9 / fps])]
        # Pillow sums the durations up before it rounds to ms.
        _save(path, images, _clipped(path, steps, MAX_WEBP_MS), quality=WEBP_QUALITY, method=WEBP_METHOD)


def _write_gif(path: Path, pictures: Timed, fps: float) -> None:
    images: list[Image.Image] = []
    starts: list[int] = []
    first_ns, end = None, 0
    for picture, time_ns in _bounded(path, pictures):
        first_ns = time_ns if first_ns is None else first_ns
        start = round(GIF_TICKS * (time_ns - first_ns) / 1e9)
        end = round(GIF_TICKS * ((time_ns - first_ns) / 1e9 + 1 / fps))
        if not starts or start - starts[-1] >= MIN_GIF_TICKS:
            starts.append(start)
            images.append(_paletted(picture))
    if images:
        ends = [*starts[1:], max(end, starts[-1] + MIN_GIF_TICKS)]
        tick_ms = 1000 / GIF_TICKS
        durations = [tick_ms * (after - start) for start, after in zip(starts, ends, strict=True)]
        _save(path, images, _clipped(path, durations, MAX_GIF_TICKS * tick_ms))


def _clipped(path: Path, durations_ms: list[float], longest_ms: float) -> list[float]:
    """The durations as the format can hold them; what is cut off is told."""
    if max(durations_ms) > longest_ms:
        text = f"{path}: pictures are shown for {longest_ms / 1000:g} s at most, the longest that it can hold"
        warnings.warn(f"{text}; .mp4 has no such limit", MvCodecWarning, stacklevel=4)
    return [min(duration, longest_ms) for duration in durations_ms]


WRITERS: dict[str, PictureWriter] = {
    ".mp4": _write_mp4,
    STILL_SUFFIX: _write_still,
    ".gif": _write_gif,
    ".webp": _write_webp,
}
"""By the file's ending: (path, pictures, nominal pictures a second: the last one lasts one of them)."""


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


def _bounded(path: Path, pictures: Timed) -> Timed:
    total = 0
    for picture, time_ns in pictures:
        total += picture.shape[0] * picture.shape[1]
        if total > MAX_ANIMATION_PX:
            held = MAX_ANIMATION_PX // (picture.shape[0] * picture.shape[1])
            raise OutputError(path, f"more than {held} such pictures don't fit; .mp4 takes any number")
        yield picture, time_ns


def _paletted(picture: Picture) -> Image.Image:
    # Dithering flickers from picture to picture, and half as many bytes again are spent on it.
    return Image.fromarray(picture).quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)


def _save(path: Path, images: list[Image.Image], durations_ms: list[float], **options: Any) -> None:
    with replacing(path) as part:
        first, *others = images
        first.save(part, save_all=True, append_images=others, duration=durations_ms, loop=0, **options)
