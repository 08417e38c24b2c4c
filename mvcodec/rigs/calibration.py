"""The calibration of a rig, from whatever says how its cameras are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mvcodec.capture.source import ArraySource
from mvcodec.frames import FrameSet
from mvcodec.rigs.colour_match import matched_colours
from mvcodec.rigs.framing import Crop
from mvcodec.rigs.from_scene import SceneFit, rig_from_scene, spread_frames
from mvcodec.rigs.rig import Rig


@dataclass(frozen=True, slots=True, eq=False)
class Calibrated:
    """A calibrated rig, and what it was found from.

    Attributes:
        rig: with colours.
        fit: points and residuals.
        frame_sets: that were looked at.
    """

    rig: Rig
    fit: SceneFit
    frame_sets: list[FrameSet]

    def summary(self) -> str:
        """One line for people."""
        after = self.rig.rectified
        residual = self.rig.figures["residual_px"]
        return (
            f"{self.rig.rows} x {self.rig.cols} cameras, rectified {after.width} x {after.height} px,"
            f" residual {residual['median']:.2f} px (95 %: {residual['p95']:.2f})"
        )


def calibrate(
    source: ArraySource, chosen: range, *, crop: Crop = "common", size: tuple[int, int] | None = None
) -> Calibrated:
    """Find a rig from the scene alone.

    Args:
        source: the input, all of whose cameras are looked at.
        chosen: frame numbers to look at some of.
        crop, size: as in `framed`.

    Raises:
        InputError: the cameras share too little.
        NothingInCommon: they look at different things.
    """
    frame_sets = [
        frame_set
        for index in spread_frames(len(chosen))
        for frame_set in source.frame_sets(
            slice(chosen[index], chosen[index] + 1), views=source.array.positions
        )
    ]
    fit = rig_from_scene(source.array, frame_sets, source.name, crop=crop, size=size)
    rig = matched_colours(fit.rig, fit.adjusted.tracks, frame_sets)
    residual = np.abs(fit.adjusted.residual_px[fit.adjusted.tracks.seen])
    figures = {
        "points": len(fit.adjusted.tracks.seen),
        "observations": int(fit.adjusted.tracks.seen.sum()),
        "residual_px": {"median": float(np.median(residual)), "p95": float(np.percentile(residual, 95))},
    }
    return Calibrated(replace(rig, figures=figures), fit, frame_sets)
