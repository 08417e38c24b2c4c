"""A decoded array against its original: frames paired by their number, views by their place."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import fmean

from mvcodec.array import Position
from mvcodec.capture import ArraySource, resolve_frames
from mvcodec.errors import InputError, MvCodecWarning
from mvcodec.evaluation.flicker import FlickerMeter
from mvcodec.evaluation.immersive import iv_psnr
from mvcodec.evaluation.metrics import ssim_picture
from mvcodec.evaluation.quality import Comparison, QualityMeter, ViewQuality
from mvcodec.evaluation.quality_by_provenance import ProvenanceMeter, read_seen_by
from mvcodec.frames import FrameSet, Picture
from mvcodec.workers import run_all


def compare(
    original: ArraySource,
    decoded: ArraySource,
    frames: slice | None = None,
    *,
    provenance: Path | None = None,
    immersive: bool = False,
    on_ssim_map: Callable[[Position, Picture], object] | None = None,
    on_frame: Callable[[], object] | None = None,
) -> Comparison:
    """Measure every view of a decoded array: PSNR, SSIM and, of two frames or more, temporal PSNR.

    The decoded array says which of its views were coded; where it does not (an original), every
    view counts as virtual.

    Args:
        frames: a range of the frames that both hold (a slice of step 1); all of them if None.
        provenance: the folder where `ProvenanceWriter` wrote (the decoded array's own one, as a
            rule); the virtual views are measured by how many cameras saw each pixel then.
        immersive: IV-PSNR as well: 0.6 s for a picture of 960 x 640, where all others take 0.04 s.
        on_ssim_map: called, from any thread, with each view of the first frame and its `ssim_picture`.
        on_frame: called after each frame that was measured.

    Raises:
        InputError: the grids or the picture sizes differ, no frame is in both, or provenance is missing.
        SettingError: `frames` selects none.
    """
    first, count = _common_frames(original, decoded)
    _check_equal(original, decoded)
    chosen = resolve_frames(frames, count, decoded.name)
    positions = decoded.array.positions
    real = decoded.listed_real or ()
    meter, by_cameras = QualityMeter(real), ProvenanceMeter()
    sequences = {view: _Sequence() for view in positions}

    def measure(ours: FrameSet, theirs: FrameSet, view: Position) -> None:
        pictures = ours.pictures[view], theirs.pictures[view]
        meter.push(view, *pictures)
        if on_ssim_map is not None and sequences[view].flicker.frames == 0:
            on_ssim_map(view, ssim_picture(*pictures))
        sequences[view].push(*pictures, immersive)
        if provenance is not None and view not in real:
            number = theirs.index - decoded.first_frame
            by_cameras.push(*pictures, read_seen_by(provenance, view, number, decoded.array))

    for ours, theirs in zip(
        original.frame_sets(_own_slice(original, first, chosen), positions),
        decoded.frame_sets(_own_slice(decoded, first, chosen), positions),
        strict=True,
    ):
        run_all(partial(measure, ours, theirs), positions)
        if on_frame is not None:
            on_frame()
    views = tuple(sequences[view.position].added_to(view) for view in meter.result().views)
    return Comparison(views, None if provenance is None else by_cameras.result())


@dataclass(slots=True)
class _Sequence:
    """What is measured of one view's pictures in the order of their frames."""

    flicker: FlickerMeter = field(default_factory=FlickerMeter)
    iv_psnrs: list[float] = field(default_factory=list)

    def push(self, original: Picture, picture: Picture, immersive: bool) -> None:
        self.flicker.push(original, picture)
        if immersive:
            self.iv_psnrs.append(iv_psnr(original, picture))

    def added_to(self, view: ViewQuality) -> ViewQuality:
        return replace(
            view,
            temporal_psnr_y=self.flicker.result() if self.flicker.frames > 1 else None,
            iv_psnr=fmean(self.iv_psnrs) if self.iv_psnrs else None,
        )


def common_frame_count(original: ArraySource, decoded: ArraySource) -> int:
    """How many frames (by number) are in both.

    Raises:
        InputError: none.
    """
    return _common_frames(original, decoded)[1]


def _common_frames(original: ArraySource, decoded: ArraySource) -> tuple[int, int]:
    first = max(original.first_frame, decoded.first_frame)
    end = min(_end(original), _end(decoded))
    if first >= end:
        found = f"frames {decoded.first_frame}..{_end(decoded) - 1}"
        expected = f"some of the frames {original.first_frame}..{_end(original) - 1} of {original.name}"
        raise InputError(decoded.name, found, expected)
    if end - first < decoded.frame_count:
        text = f"{decoded.name}: {decoded.frame_count - (end - first)} frames are not in {original.name}"
        warnings.warn(text, MvCodecWarning, stacklevel=3)
    return first, end - first


def _end(source: ArraySource) -> int:
    return source.first_frame + source.frame_count


def _own_slice(source: ArraySource, first: int, chosen: range) -> slice:
    start = first - source.first_frame
    return slice(start + chosen.start, start + chosen.stop)


def _check_equal(original: ArraySource, decoded: ArraySource) -> None:
    ours, theirs = original.array, decoded.array
    for what, expected, found in (
        ("grid", (ours.rows, ours.cols), (theirs.rows, theirs.cols)),
        ("pictures of", (ours.width, ours.height), (theirs.width, theirs.height)),
    ):
        if expected != found:
            raise InputError(
                decoded.name,
                f"{what} {found[0]}x{found[1]}",
                f"{what} {expected[0]}x{expected[1]} as in {original.name}",
            )
