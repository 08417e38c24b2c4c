"""Which recordings a batch works on, and what their outputs are called."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mvcodec.cluster.places import Place
from mvcodec.errors import InputError

MANIFEST_SUFFIX = ".csv"
ARRAY_FILE = "array.json"


@dataclass(frozen=True, slots=True)
class Recording:
    """One input.

    Attributes:
        source: path from the root, or URL.
        name: of its output, without ending; each name occurs once.
    """

    source: str
    name: str


def find_recordings(inputs: Sequence[str]) -> list[Recording]:
    """What the user named: paths, URLs, patterns of either, and manifests.

    A manifest is a CSV file with a column ``input`` and, where wanted, one ``name``; its relative paths count
    from its own folder.

    Raises:
        InputError: nothing is there, a manifest is none, or two outputs would have one name.
    """
    found: list[Recording] = []
    for text in inputs:
        if text.lower().endswith(MANIFEST_SUFFIX):
            found += _of_manifest(Place(text))
            continue
        places = Place(text).matches()
        if not places:
            raise InputError(text, "nothing that matches", "some inputs")
        for place in places:
            if not place.exists():
                raise InputError(place.url, "nothing there", "an input, a pattern or a manifest (.csv)")
            found.append(_recording(place))
    seen: dict[str, Recording] = {}
    for recording in found:
        other = seen.setdefault(recording.name, recording)
        if other is not recording:
            both = f"{other.source} and {recording.source} under one name, {recording.name}"
            raise InputError(inputs[0], both, "other names, in a manifest's column `name`")
    return found


def _recording(place: Place, name: str | None = None) -> Recording:
    source = place.url if place.local is None else str(place.local.resolve())
    plain = place.url.removesuffix(f"/{ARRAY_FILE}") if place.name == ARRAY_FILE else place.url
    last = plain.rstrip("/").rsplit("/", 1)[-1]
    return Recording(source, name or Path(last).stem or Path(source).stem)


def _of_manifest(place: Place) -> list[Recording]:
    try:
        rows = list(csv.DictReader(io.StringIO(place.read().decode("utf-8-sig"))))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(place.url, str(error), "a CSV file in UTF-8") from None
    if not rows or "input" not in rows[0]:
        found = "no row" if not rows else f"columns {', '.join(filter(None, rows[0]))}"
        raise InputError(place.url, found, "a column `input`, and `name` where wanted")
    recordings = []
    for number, row in enumerate(rows, 2):
        text, name = (row.get("input") or "").strip(), (row.get("name") or "").strip()
        if not text or "/" in name:
            raise InputError(f"{place.url}, line {number}", text and name, "an input, and a name without /")
        relative = "://" not in text and not Path(text).is_absolute()
        source = Place(place.url.rsplit("/", 1)[0] if "/" in place.url else ".") / text if relative else None
        recording = _recording(source or Place(text), name or None)
        if not Place(recording.source).exists():
            raise InputError(f"{place.url}, line {number}", f"{text}, where nothing is", "an input")
        recordings.append(recording)
    return recordings
