"""Quality of an array of pictures: per view, and means over the real, the virtual and all views."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from statistics import fmean
from threading import Lock
from typing import Any

from mvcodec.array import Position
from mvcodec.evaluation.metrics import psnr, ssim
from mvcodec.evaluation.provenance import ProvenanceQuality
from mvcodec.frames import Picture


@dataclass(frozen=True, slots=True)
class ViewQuality:
    """Means over the pictures of one view.

    Attributes:
        position: the view.
        real: it was coded, not synthesised.
        psnr_y: mean of the per-picture luma PSNR, dB.
        ssim: mean of the per-picture luma SSIM.
        pictures: how many were measured.
    """

    position: Position
    real: bool
    psnr_y: float
    ssim: float
    pictures: int


@dataclass(frozen=True, slots=True)
class Summary:
    """One figure for each class of views; None for a class that has no view.

    Attributes:
        all, real, virtual: means of the per-picture figures.
        worst: the lowest mean of any one view.
    """

    all: float | None
    real: float | None
    virtual: float | None
    worst: float | None

    def to_json(self) -> dict[str, float | None]:
        """Plain JSON values by class."""
        return {"all": self.all, "real": self.real, "virtual": self.virtual, "worst": self.worst}


@dataclass(frozen=True, slots=True)
class Comparison:
    """What was measured, view by view.

    Attributes:
        views: in row order.
        by_provenance: the pixels of the virtual views by how many real cameras saw them (0 = filled);
            None where that is not known.
    """

    views: tuple[ViewQuality, ...]
    by_provenance: Mapping[int, ProvenanceQuality] | None = None

    @property
    def psnr_y(self) -> Summary:
        """Luma PSNR, dB."""
        return _summary((view, view.psnr_y) for view in self.views)

    @property
    def ssim(self) -> Summary:
        """Luma SSIM."""
        return _summary((view, view.ssim) for view in self.views)

    def to_json(self) -> dict[str, Any]:
        """The form that ``mvcodec compare --json`` prints."""
        document: dict[str, Any] = {
            "psnr_y": self.psnr_y.to_json(),
            "ssim": self.ssim.to_json(),
            "views": [
                {
                    "row": view.position[0],
                    "col": view.position[1],
                    "real": view.real,
                    "psnr_y": view.psnr_y,
                    "ssim": view.ssim,
                }
                for view in self.views
            ],
        }
        if self.by_provenance is not None:
            document["by_provenance"] = {
                str(cameras): quality.to_json() for cameras, quality in self.by_provenance.items()
            }
        return document


class QualityMeter:
    """Measures pictures as they come, in any order and from any thread.

    Args:
        real: the views that were coded; every other view counts as virtual.
    """

    def __init__(self, real: Collection[Position]) -> None:
        self._real = frozenset(real)
        self._figures: dict[Position, list[tuple[float, float]]] = {}
        self._lock = Lock()

    def push(self, position: Position, original: Picture, picture: Picture) -> None:
        """Measure one picture of a view.

        Args:
            original, picture: uint8 (H, W, 3) RGB.

        Raises:
            SettingError: the pictures differ in size, or are smaller than SSIM's window.
        """
        figures = psnr(original, picture), ssim(original, picture)
        with self._lock:
            self._figures.setdefault(position, []).append(figures)

    def result(self) -> Comparison:
        """The means over what was pushed so far."""
        with self._lock:
            return _comparison(self._figures, self._real)


def _comparison(
    figures: Mapping[Position, list[tuple[float, float]]], real: Collection[Position]
) -> Comparison:
    views = []
    for position, pictures in sorted(figures.items()):
        # Threads push in any order; a sorted sum makes the means the same in every run.
        psnrs, ssims = sorted(p for p, _ in pictures), sorted(s for _, s in pictures)
        views.append(ViewQuality(position, position in real, fmean(psnrs), fmean(ssims), len(pictures)))
    return Comparison(tuple(views))


def _summary(figures: Iterable[tuple[ViewQuality, float]]) -> Summary:
    scored = list(figures)
    return Summary(
        all=_mean(scored),
        real=_mean([(view, figure) for view, figure in scored if view.real]),
        virtual=_mean([(view, figure) for view, figure in scored if not view.real]),
        worst=min((figure for _, figure in scored), default=None),
    )


def _mean(scored: list[tuple[ViewQuality, float]]) -> float | None:
    pictures = sum(view.pictures for view, _ in scored)
    return sum(view.pictures * figure for view, figure in scored) / pictures if pictures else None
