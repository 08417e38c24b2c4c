"""Quality of an array of pictures: per view, and means over the real, the virtual and all views."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from statistics import fmean
from threading import Lock
from typing import Any

from mvcodec.array import Position
from mvcodec.evaluation.metrics import psnr, psnr_yuv, ssim
from mvcodec.evaluation.quality_by_provenance import ProvenanceQuality
from mvcodec.frames import Picture

METRICS = ("psnr_y", "psnr_yuv", "ssim", "temporal_psnr_y", "iv_psnr")
"""Figures of views, by the names of `ViewQuality`; the first three are always there."""


@dataclass(frozen=True, slots=True)
class ViewQuality:
    """Means over the pictures of one view.

    Attributes:
        position: the view.
        real: it was coded, not synthesised.
        psnr_y: mean of the per-picture luma PSNR, dB.
        psnr_yuv: mean of the per-picture PSNR of luma and chroma, 6:1:1, dB.
        ssim: mean of the per-picture luma SSIM.
        pictures: how many were measured.
        temporal_psnr_y: of the view's sequence, dB, see `FlickerMeter`; None where that was not measured.
        iv_psnr: mean of the per-picture IV-PSNR, dB; None where that was not measured.
    """

    position: Position
    real: bool
    psnr_y: float
    psnr_yuv: float
    ssim: float
    pictures: int
    temporal_psnr_y: float | None = None
    iv_psnr: float | None = None


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
        return self.summary("psnr_y")

    @property
    def psnr_yuv(self) -> Summary:
        """PSNR of luma and chroma, 6:1:1, dB."""
        return self.summary("psnr_yuv")

    @property
    def ssim(self) -> Summary:
        """Luma SSIM."""
        return self.summary("ssim")

    def summary(self, metric: str) -> Summary:
        """Of one of METRICS; all None where it was not measured."""
        found = [(view, getattr(view, metric)) for view in self.views]
        return _summary((view, figure) for view, figure in found if figure is not None)

    @property
    def measured(self) -> tuple[str, ...]:
        """Those of METRICS that every view has."""
        return tuple(
            metric for metric in METRICS if all(getattr(view, metric) is not None for view in self.views)
        )

    def to_json(self) -> dict[str, Any]:
        """As plain JSON values."""
        metrics = self.measured
        document: dict[str, Any] = {metric: self.summary(metric).to_json() for metric in metrics}
        document["views"] = [
            {
                "row": view.position[0],
                "col": view.position[1],
                "real": view.real,
                **{metric: getattr(view, metric) for metric in metrics},
            }
            for view in self.views
        ]
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
        self._figures: dict[Position, list[tuple[float, float, float]]] = {}
        self._lock = Lock()

    def push(self, position: Position, original: Picture, picture: Picture) -> None:
        """Measure one picture of a view.

        Args:
            original, picture: uint8 (H, W, 3) RGB.

        Raises:
            SettingError: the pictures differ in size, or are smaller than SSIM's window.
        """
        figures = psnr(original, picture), psnr_yuv(original, picture), ssim(original, picture)
        with self._lock:
            self._figures.setdefault(position, []).append(figures)

    def result(self) -> Comparison:
        """The means over what was pushed so far."""
        with self._lock:
            return _comparison(self._figures, self._real)


def _comparison(
    figures: Mapping[Position, list[tuple[float, float, float]]], real: Collection[Position]
) -> Comparison:
    views = []
    for position, pictures in sorted(figures.items()):
        # Threads push in any order; a sorted sum makes the means the same in every run.
        psnr_y, yuv, similarity = (fmean(sorted(values)) for values in zip(*pictures, strict=True))
        views.append(ViewQuality(position, position in real, psnr_y, yuv, similarity, len(pictures)))
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
