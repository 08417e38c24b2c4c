"""Measured points of rate-distortion curves, and the folder that keeps them for the next run."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from mvcodec.errors import OutputError
from mvcodec.evaluation.quality import Comparison, ViewQuality


@dataclass(frozen=True, slots=True)
class BitsSplit:
    """Where bits go.

    Attributes:
        texture: access units of pictures.
        disparity: access units of maps.
        rest: container, headers, calibration.
        enhancement: units of the enhancement layer.
    """

    texture: int
    disparity: int
    rest: int
    enhancement: int = 0


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """One coding of an array.

    Attributes:
        qp: of the pictures, on the codec's own scale.
        bits: of all frame sets.
        kbps: the same, kbit/s.
        quality: of the decoded (and synthesised) views.
        encode_seconds, decode_seconds: wall-clock seconds of the stages, without measuring. Matching is
            done once for all QPs of a run, and counted in each: where its maps were there already,
            encode_seconds is what the encoder took without it, plus match_seconds. That may be a little
            too much, since an encoder that matches codes its pictures meanwhile.
        match_seconds: of matching alone, within encode_seconds; None for an anchor.
        file: name of the kept stream in the folder; None for an anchor.
        settings: the encoder's record in that stream's header; None for an anchor.
        versions: what it was measured with, by name; what is known of it.
    """

    qp: int
    bits: int
    kbps: float
    quality: Comparison
    split: BitsSplit
    encode_seconds: float
    decode_seconds: float
    file: str | None = None
    settings: Mapping[str, Any] | None = None
    match_seconds: float | None = None
    versions: Mapping[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """As ``report.json`` has it: without the single views."""
        document = {
            "qp": self.qp,
            "bits": self.bits,
            "kbps": self.kbps,
            "psnr_y": self.quality.psnr_y.to_json(),
            "psnr_yuv": self.quality.psnr_yuv.to_json(),
            "ssim": self.quality.ssim.to_json(),
            "bits_split": asdict(self.split),
            "encode_seconds": self.encode_seconds,
            "decode_seconds": self.decode_seconds,
        }
        if self.match_seconds is not None:
            document["match_seconds"] = self.match_seconds
        return document if self.settings is None else {**document, "settings": dict(self.settings)}


class PointStore:
    """A folder of measured points, each under a key of everything that it depends on.

    Args:
        folder: made when the first point comes.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def name(self, depends_on: Mapping[str, Any]) -> str:
        """The key: the same for equal settings, inputs and versions (plain JSON values)."""
        text = json.dumps(depends_on, sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=10).hexdigest()

    def find(self, name: str) -> CurvePoint | None:
        """The point of this key, if it was measured; a damaged one counts as not measured."""
        try:
            document = json.loads((self.folder / f"{name}.json").read_bytes())
            # Points of before they stated versions have those that their key is made of.
            point = _from_document({"versions": document["depends_on"]["libraries"], **document["point"]})
        except (OSError, ValueError, KeyError, TypeError):
            return None
        complete = point.file is None or (self.folder / point.file).is_file()
        return point if complete else None

    def keep(self, name: str, point: CurvePoint, depends_on: Mapping[str, Any]) -> None:
        """Store a point, complete or not at all.

        Raises:
            OutputError: the system refuses.
        """
        document = {"depends_on": dict(depends_on), "point": asdict(point)}
        path = self.folder / f"{name}.json"
        part = path.with_suffix(f".{os.getpid()}.part")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            part.write_text(json.dumps(document, indent=1), encoding="utf-8")
            part.replace(path)
        except OSError as error:
            raise OutputError(path, error.strerror or error) from None


def _from_document(document: Mapping[str, Any]) -> CurvePoint:
    fields = dict(document)
    views = tuple(
        ViewQuality(**{**view, "position": tuple(view["position"])}) for view in fields["quality"]["views"]
    )
    return CurvePoint(**{**fields, "quality": Comparison(views), "split": BitsSplit(**fields["split"])})
