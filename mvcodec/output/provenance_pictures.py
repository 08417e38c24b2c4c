"""Provenance of synthesised views out: a PNG beside each view's picture (synthesis/provenance.py)."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path

from PIL import Image
from PIL.PngImagePlugin import PngInfo

from mvcodec.frames import RenderedView
from mvcodec.output.atomic import write_bytes
from mvcodec.synthesis.provenance import LAYERS_TEXT, Provenance, provenance_name


class ProvenanceWriter:
    """Writes the provenance of frame set after frame set beside the pictures of a form of folders.

    Args:
        folder: that of the form.
        names: of the views' folders in it (`OutputPlan.names`).
    """

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        self._folders = [folder / name for name in names]
        self._count = 0

    def push(self, views: Sequence[RenderedView]) -> None:
        """Write the next frame set's, one view for each name.

        Raises:
            OutputError: the system refuses.
        """
        for folder, view in zip(self._folders, views, strict=True):
            write_provenance(folder / provenance_name(self._count), Provenance.of(view))
        self._count += 1


def write_provenance(path: Path, provenance: Provenance) -> None:
    """Write one PNG, complete or not at all.

    Raises:
        OutputError: the system refuses.
    """
    texts, data = PngInfo(), io.BytesIO()
    texts.add_text(LAYERS_TEXT, json.dumps(provenance.layers.bounds_px))
    Image.fromarray(provenance.picture()).save(data, "PNG", pnginfo=texts)
    write_bytes(path, data.getbuffer())
