"""Many pictures in one: mosaics, contact sheets with labels, original beside synthesised beside error."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mvcodec.errors import SettingError
from mvcodec.frames import Picture

MOSAIC_SIZE = (1920, 1080)
ERROR_GAIN = 4
_GAP_PX = 4
_BACKGROUND = 24
_TEXT = (235, 235, 235)

PictureGrid = Sequence[Sequence[Picture]]
"""Rows of pictures uint8 (H, W, 3) RGB, all of one size."""


def mosaic(pictures: PictureGrid, max_size: tuple[int, int] = MOSAIC_SIZE) -> Picture:
    """The pictures side by side, shrunk together until they fit; never enlarged.

    Args:
        pictures: rows of equal length.
        max_size: (width, height) px that the result must not exceed.

    Returns:
        uint8 (H, W, 3) RGB.

    Raises:
        SettingError: no picture, rows of different length, or pictures of different size.
    """
    width, height = _tile_size(pictures, max_size)
    return np.vstack([np.hstack([_fit(picture, width, height) for picture in row]) for row in pictures])


def contact_sheet(
    pictures: PictureGrid,
    labels: Sequence[Sequence[str]],
    max_size: tuple[int, int] = MOSAIC_SIZE,
) -> Picture:
    """A mosaic with gaps and a label under each picture.

    Args:
        pictures: rows of equal length.
        labels: one for each picture, in the same order.
        max_size: (width, height) px that the pictures, without gaps and labels, must not exceed.

    Raises:
        SettingError: as `mosaic`; or labels of another number.
    """
    width, height = _tile_size(pictures, max_size)
    if [len(row) for row in labels] != [len(row) for row in pictures]:
        raise SettingError("labels", [len(row) for row in labels], "one for each picture")
    font = ImageFont.load_default(max(11, min(18, width // 16)))
    line = round(1.6 * font.getbbox("Ag")[3])
    cell_width, cell_height = width + _GAP_PX, height + line + _GAP_PX
    size = len(pictures[0]) * cell_width + _GAP_PX, len(pictures) * cell_height + _GAP_PX
    sheet = Image.new("RGB", size, (_BACKGROUND,) * 3)
    draw = ImageDraw.Draw(sheet)
    for row, (shown, texts) in enumerate(zip(pictures, labels, strict=True)):
        for col, (picture, text) in enumerate(zip(shown, texts, strict=True)):
            left, top = _GAP_PX + col * cell_width, _GAP_PX + row * cell_height
            sheet.paste(Image.fromarray(_fit(picture, width, height)), (left, top))
            draw.text((left + width / 2, top + height + line / 2), text, _TEXT, font, anchor="mm")
    return np.asarray(sheet, np.uint8)


def error_picture(original: Picture, synthesised: Picture, label: str = "synthesised") -> Picture:
    """Original, synthesised and error side by side, labelled.

    The error is the absolute difference, the largest of the three channels, times 4, in grey.

    Args:
        original, synthesised: uint8 (H, W, 3) RGB of one size.
        label: for the second picture.

    Raises:
        SettingError: pictures of different size.
    """
    if original.shape != synthesised.shape:
        raise SettingError("picture", _size_text(synthesised), f"{_size_text(original)} as the original")
    error = cv2.absdiff(original, synthesised).max(axis=2).astype(np.uint16) * ERROR_GAIN
    grey = np.repeat(np.minimum(error, 255).astype(np.uint8)[..., None], 3, axis=2)
    tile_height, tile_width = original.shape[:2]
    labels = [["original", label, f"absolute error x {ERROR_GAIN}"]]
    return contact_sheet([[original, synthesised, grey]], labels, (3 * tile_width, tile_height))


def _tile_size(pictures: PictureGrid, max_size: tuple[int, int]) -> tuple[int, int]:
    """(width, height) px of each picture in a sheet of at most `max_size`."""
    counts = {len(row) for row in pictures}
    if len(counts) != 1 or counts == {0}:
        raise SettingError("pictures", sorted(counts), "rows of equal length with pictures in them")
    shapes = {picture.shape for row in pictures for picture in row}
    if len(shapes) != 1:
        raise SettingError("pictures", sorted(shapes), "pictures of one size")
    height, width = pictures[0][0].shape[:2]
    scale = min(1.0, max_size[0] / (width * counts.pop()), max_size[1] / (height * len(pictures)))
    return max(1, int(width * scale)), max(1, int(height * scale))


def _fit(picture: Picture, width: int, height: int) -> Picture:
    if picture.shape[:2] == (height, width):
        return picture
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _size_text(picture: Picture) -> str:
    return f"{picture.shape[1]}x{picture.shape[0]} px"
