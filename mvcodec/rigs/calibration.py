"""The calibration of a rig, from whatever says how its cameras are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mvcodec.capture.source import ArraySource
from mvcodec.errors import InputError
from mvcodec.frames import FrameSet
from mvcodec.rigs.adjustment import adjust
from mvcodec.rigs.board import Sightings
from mvcodec.rigs.calibration_files import KnownCamera, read_cameras
from mvcodec.rigs.colour_match import matched_colours
from mvcodec.rigs.features import PairCount, Tracks, find_tracks
from mvcodec.rigs.finer import finer
from mvcodec.rigs.framing import Crop
from mvcodec.rigs.from_board import LensChoice, cameras_from_board
from mvcodec.rigs.from_scene import FEWEST_POINTS, check_shared, rig_from_adjusted
from mvcodec.rigs.known import rig_from_cameras
from mvcodec.rigs.residuals import Residuals, disparities, rectified_tracks, residuals_of
from mvcodec.rigs.rig import Rig, read_rig
from mvcodec.stream import view_name

MOST_FRAME_SETS = 4
MOST_BOARD_SETS = 150
BEYOND_PX = 3.0
"""Points that far off from a known rig are wrong matches, or things that move."""


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the rectified pictures shall be.

    Attributes:
        crop, size: as in `framed`.
    """

    crop: Crop = "common"
    size: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Calibrated:
    """A calibrated rig, and how well it fits what its cameras see.

    Attributes:
        rig: with colours.
        frame_sets: that were looked at.
        every: the points that were found in them; by the scene alone, those that could be laid on each other.
        tracks: of these, those that agree with the rig.
        pairs: how well the pictures were matched.
        before, after: residuals of `tracks` in the cameras' pictures and in the rectified ones.
    """

    rig: Rig
    frame_sets: list[FrameSet]
    every: Tracks
    tracks: Tracks
    pairs: list[PairCount]
    before: Residuals
    after: Residuals

    def summary(self) -> str:
        """One line for people."""
        after = self.rig.rectified
        return (
            f"{self.rig.rows} x {self.rig.cols} cameras, rectified {after.width} x {after.height} px;"
            f" rows apart {self.before.rows.text()} before, {self.after.rows.text()} after"
            f"; columns {self.before.columns.text()} before, {self.after.columns.text()} after"
        )


def calibrate_from_scene(
    source: ArraySource, chosen: range, wishes: Wishes | None = None, focal_px: float | None = None
) -> Calibrated:
    """Find a rig from the scene alone.

    Args:
        source: the input, all of whose cameras are looked at.
        chosen: frame numbers to look at some of.
        wishes: what the rectified pictures shall be.
        focal_px: of the cameras, where it is known.

    Raises:
        InputError: the cameras share too little.
        NothingInCommon: they look at different things.
    """
    wishes = wishes or Wishes()
    array = source.array
    frame_sets = some_frame_sets(source, chosen)
    every, pairs = find_tracks(frame_sets, array.positions)
    check_shared(every, source.name)
    grid = np.array([(col, row * array.rho) for row, col in array.positions], np.float64)
    size = array.width, array.height
    known = focal_px is not None
    expected = array.calibration.fx_px if focal_px is None else focal_px
    fine = finer(every, frame_sets)
    adjusted = adjust(fine, grid, size, expected, focal_known=known)
    rig = rig_from_adjusted(array, adjusted, wishes.crop, wishes.size)
    return _finished(rig, frame_sets, fine, adjusted.tracks, pairs)


def calibrate_from_files(
    source: ArraySource, chosen: range, paths: Sequence[Path], wishes: Wishes | None = None
) -> Calibrated:
    """The rig that calibration files describe: one of RIG.json, or see `read_cameras`.

    Args, raises: as in `calibrate_from_scene`; InputError too where the files don't fit the input.
    """
    if len(paths) == 1 and paths[0].suffix.lower() == ".json":
        rig = read_rig(paths[0])
        rig.array(source.array)
        frame_sets = some_frame_sets(source, chosen)
        every, pairs = find_tracks(frame_sets, source.array.positions)
        return _finished(rig, frame_sets, every, agreeing_with(rig, every), pairs)
    name = str(paths[0]) if len(paths) == 1 else f"{paths[0]} ... {paths[-1]}"
    return calibrate_known(source, chosen, read_cameras(paths), name, "file", wishes)


def calibrate_known(
    source: ArraySource,
    chosen: range,
    cameras: Sequence[KnownCamera],
    name: str,
    found_by: str,
    wishes: Wishes | None = None,
) -> Calibrated:
    """The rig of known cameras; see `rig_from_cameras`."""
    wishes = wishes or Wishes()
    array = source.array
    rig = rig_from_cameras(array, cameras, name, found_by, wishes.crop, wishes.size)
    frame_sets = some_frame_sets(source, chosen)
    every, pairs = find_tracks(frame_sets, array.positions)
    tracks = agreeing_with(rig, every)
    if len(tracks.seen):
        _, disparity = disparities(rectified_tracks(rig, tracks), rig.rectified.rho)
        w = float(np.median(disparity)) / rig.rectified.focal_px
        rig = rig_from_cameras(array, cameras, name, found_by, wishes.crop, wishes.size, w)
        tracks = agreeing_with(rig, every)
    return _finished(rig, frame_sets, every, tracks, pairs)


def calibrate_from_board(
    source: ArraySource,
    chosen: range,
    sightings: Sightings,
    name: str,
    lens: LensChoice = "auto",
    wishes: Wishes | None = None,
) -> Calibrated:
    """The rig that a board tells; baselines are metric.

    Args:
        source, chosen, wishes: as in `calibrate_from_scene`.
        sightings: of the board, see `find_board`.
        name: of the pictures that show it, for messages.
        lens: see `cameras_from_board`.

    Raises:
        InputError: see `cameras_from_board`; or the board's cameras don't fit the input.
    """
    told = cameras_from_board(sightings, name, lens)
    found = calibrate_known(source, chosen, told.cameras, name, "board", wishes)
    figures = dict(found.rig.figures) | {
        "board": {
            "text": sightings.board.text,
            "rms_px": told.rms_px,
            "corners_left_out": told.left_out,
            "sightings": {
                view_name(at): count for at, count in zip(sightings.cameras, told.sightings, strict=True)
            },
        }
    }
    return replace(found, rig=replace(found.rig, figures=figures))


def spread_frame_sets(source: ArraySource, most: int = MOST_BOARD_SETS) -> Iterator[FrameSet]:
    """Up to so many frame sets of a whole input, evenly spread, with every camera's picture."""
    every = -(-source.frame_count // most)
    for number, frame_set in enumerate(source.frame_sets(None, source.array.positions)):
        if number % every == 0:
            yield frame_set


def some_frame_sets(source: ArraySource, chosen: range) -> list[FrameSet]:
    """Up to MOST_FRAME_SETS of the input, far apart, with every camera's picture."""
    indices = np.linspace(0, len(chosen) - 1, min(len(chosen), MOST_FRAME_SETS))
    numbers = sorted({chosen[round(index)] for index in indices})
    views = source.array.positions
    return [frame for number in numbers for frame in source.frame_sets(slice(number, number + 1), views)]


def agreeing_with(rig: Rig, tracks: Tracks) -> Tracks:
    """The observations that agree with a rig: the worst of a point go one by one."""
    straight = rectified_tracks(rig, tracks)
    kept = straight
    places = tracks
    while len(kept.seen):
        residual, _ = disparities(kept, rig.rectified.rho)
        length = np.hypot(residual[..., 0], residual[..., 1])
        bad = (length > BEYOND_PX) & (length == length.max(axis=1, keepdims=True))
        if not bad.any():
            break
        seen = kept.seen & ~bad
        kept, places = kept.kept(seen), places.kept(seen)
    return places


def left_by_places_px(rig: Rig, tracks: Tracks) -> float:
    """What cameras beside their places leave over, px: it depends on the distance, so that no turn mends it.

    Of the camera that is farthest beside its place, at the 5 % of the points that are the farthest from the
    typical distance.
    """
    view = rig.rectified
    _, disparity = disparities(rectified_tracks(rig, tracks), view.rho)
    away = np.abs(disparity / view.focal_px - view.typical_w)
    beside = [
        np.abs(camera.place[:2] - (at[1], at[0] * view.rho)).max() for at, camera in rig.cameras.items()
    ]
    return float(max(beside) * np.percentile(away, 95) * view.focal_px)


def _finished(
    rig: Rig, frame_sets: list[FrameSet], every: Tracks, tracks: Tracks, pairs: list[PairCount]
) -> Calibrated:
    if not len(tracks.seen) and len(every.seen) >= FEWEST_POINTS:
        found = "no point of the scene in the pictures that agrees with the calibration"
        raise InputError("rig", found, "the calibration of these cameras, in this order")
    rig = matched_colours(rig, tracks, frame_sets)
    before = residuals_of(tracks, rig.rectified.rho)
    after = residuals_of(rectified_tracks(rig, tracks), rig.rectified.rho)
    figures: dict[str, Any] = {
        "points": len(tracks.seen),
        "observations": int(tracks.seen.sum()),
        "observations_left_out": int(every.seen.sum() - tracks.seen.sum()),
        "left_by_places_px": left_by_places_px(rig, tracks),
        "before_px": asdict(before),
        "after_px": asdict(after),
    }
    return Calibrated(replace(rig, figures=figures), frame_sets, every, tracks, pairs, before, after)
