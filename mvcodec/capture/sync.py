"""How far cameras' clocks are apart, estimated from what moves in their pictures or from their sound."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import av.error
import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import InputError
from mvcodec.frames import Picture

MAX_PICTURES = 1200
"""Of each camera that are looked at."""

MIN_STEPS = 6
"""Steps from picture to picture that two cameras must have in common."""

LEAST_LIKENESS = 0.4
"""Correlation below which nothing is claimed."""

AUDIO_HZ = 8000
_MAX_SOUND_S = 600
FLOW_SIZE = (160, 120)
"""Of the copies that motion is told from, (width, height) px."""

_BLUR_PX = 2.0
_STILL_LEVELS = 0.25
"""Grey levels that change on the average where most does: less is noise."""

_SURE_FLOW = 0.8
"""Correlation below which a flow counts for nothing: cameras that stand still have one too, of noise."""

_CHANGE_GRID = (4, 3)

Signal = NDArray[np.float32]
"""float32 (steps, features): how pictures differ from the one before."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """How a camera's pictures change.

    Attributes:
        times_ns: float64 (steps,), the middle between two pictures.
        change: brightness that changes, in all and in parts of the picture.
        flow: how the whole picture moves, px.
    """

    times_ns: NDArray[np.float64]
    change: Signal
    flow: Signal

    @property
    def is_still(self) -> bool:
        """Whether nothing but noise changes."""
        return float(self.change[:, :-1].mean(axis=1).max(initial=0)) < _STILL_LEVELS


def motion_of(pictures: Iterable[Picture | None], times_ns: Sequence[int]) -> Motion:
    """The motion in pictures, uint8 (H, W, 3), at their times."""
    window = cv2.createHanningWindow(FLOW_SIZE, cv2.CV_32F)
    before: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None
    times, change, flow = [], [], []
    at_ns = 0
    for picture, time_ns in zip(pictures, times_ns, strict=False):
        if picture is None:
            continue
        grey = cv2.cvtColor(cv2.resize(picture, FLOW_SIZE, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY)
        sharp = grey.astype(np.float32)
        smooth = np.asarray(cv2.GaussianBlur(sharp, (0, 0), _BLUR_PX), np.float32)
        if before is not None:
            moved = np.abs(smooth - before[1])
            parts = cv2.resize(moved, _CHANGE_GRID, interpolation=cv2.INTER_AREA).ravel()
            times.append((at_ns + time_ns) / 2)
            change.append(np.append(parts, parts.mean() * parts.size))  # the sum counts as all parts do
            # OpenCV may write into what it is given here.
            flow.append(cv2.phaseCorrelate(before[0].copy(), sharp.copy(), window)[0])
        before, at_ns = (sharp, smooth), time_ns
    return Motion(np.array(times), np.array(change, np.float32), np.array(flow, np.float32))


@dataclass(frozen=True, slots=True)
class Lag:
    """How far one camera's motion lies after another's.

    Attributes:
        steps: from the beginning of the first signal to that of the other, in steps of the finer one.
        likeness: correlation there, 0..1.
        unmoved: correlation at no lag at all.
        weighed: `likeness`, less where little is in common.
    """

    steps: float
    likeness: float
    unmoved: float
    weighed: float


def motion_offset_ns(first: Motion, other: Motion) -> tuple[float, float]:
    """(what to add to the other camera's times, ns; correlation 0..1).

    Where the clocks begin counts for nothing; see `lag_of`.
    """
    lag = lag_of(first, other)
    shift = lag.steps * _finer_step(first, other)
    return float(first.times_ns[0] - other.times_ns[0]) + shift, lag.likeness


def lag_of(first: Motion, other: Motion) -> Lag:
    """The lag of two motions.

    Signals are put on one grid of the finer camera's steps; the lag with the highest correlation wins, to
    parts of a step by a parabola through it and its neighbours.
    """
    step = _finer_step(first, other)
    flow, change = (_lag(first, other, kind, step) for kind in ("flow", "change"))
    return flow if flow.likeness >= _SURE_FLOW and flow.weighed > change.weighed else change


def _finer_step(first: Motion, other: Motion) -> float:
    return min(float(np.median(np.diff(each.times_ns))) for each in (first, other))


def _lag(first: Motion, other: Motion, kind: str, step: float) -> Lag:
    ours, theirs = (_on_grid(each.times_ns, getattr(each, kind), step) for each in (first, other))
    least = max(MIN_STEPS, min(len(ours), len(theirs)) // 2)
    lags = range(least - len(theirs), len(ours) - least + 1)
    likeness = np.array([_likeness(ours, theirs, lag) for lag in lags])
    # What two short pieces have in common may be chance.
    common = np.array([min(len(ours), len(theirs) + lag) - max(lag, 0) for lag in lags])
    weighed = likeness * np.sqrt(common / common.max())
    best = int(np.argmax(weighed))
    unmoved = _likeness(ours, theirs, 0)
    return Lag(lags[best] + _peak(likeness, best), float(likeness[best]), unmoved, float(weighed[best]))


def _on_grid(times_ns: NDArray[np.float64], signal: Signal, step: float) -> Signal:
    grid = np.arange(times_ns[0], times_ns[-1] + step / 2, step)
    return np.stack([np.interp(grid, times_ns, column) for column in signal.T], axis=1).astype(np.float32)


def _likeness(ours: Signal, theirs: Signal, lag: int) -> float:
    """Correlation where the other signal begins `lag` steps after ours."""
    begin, end = max(lag, 0), min(len(ours), len(theirs) + lag)
    a, b = ours[begin:end], theirs[begin - lag : end - lag]
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    energy = float(np.sqrt((a * a).sum() * (b * b).sum()))
    return float((a * b).sum()) / energy if energy > 0 else 0.0


def _peak(values: NDArray[np.float64], at: int) -> float:
    """Where the parabola through a peak and its neighbours has its top, from the peak on, in steps."""
    if not 0 < at < len(values) - 1:
        return 0.0
    before, here, after = values[at - 1 : at + 2]
    bend = before - 2 * here + after
    return float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0 else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Sound:
    """A sound track.

    Attributes:
        start_ns: when it begins, on the clock of the file's pictures.
        samples: float32, AUDIO_HZ a second.
    """

    start_ns: float
    samples: NDArray[np.float32]


def sound_of(path: Path) -> Sound:
    """The sound track of a file, the mean of its channels.

    Raises:
        InputError: there is none, or it is damaged.
    """
    resampler = av.AudioResampler(format="flt", layout="mono", rate=AUDIO_HZ)
    pieces: list[NDArray[np.float32]] = []
    start: float | None = None
    try:
        with av.open(f"file:{path}") as container:
            if not container.streams.audio:
                raise InputError(path, "no sound track", "one, for sync audio")
            for frame in container.decode(container.streams.audio[0]):
                if start is None:
                    start = float((frame.pts or 0) * Fraction(frame.time_base or 1) * 10**9)
                for piece in resampler.resample(frame):
                    pieces.append(piece.to_ndarray().reshape(-1).astype(np.float32))
                if sum(map(len, pieces)) > _MAX_SOUND_S * AUDIO_HZ:
                    break
    except av.error.FFmpegError as error:
        raise InputError(
            path, f"an unreadable sound track ({error.strerror})", "one, for sync audio"
        ) from None
    samples = np.concatenate(pieces) if pieces else np.zeros(0, np.float32)
    if not samples.any():
        raise InputError(path, "a silent sound track", "one with sound, for sync audio")
    return Sound(start or 0.0, samples)


def sound_offset_ns(first: Sound, other: Sound) -> tuple[float, float]:
    """(what to add to the other camera's times, ns; correlation 0..1), by the lag of the sounds."""
    from scipy.signal import correlate, correlation_lags

    ours, theirs = (each.samples - each.samples.mean() for each in (first, other))
    found = correlate(ours, theirs, mode="full", method="fft")
    lags = correlation_lags(len(ours), len(theirs), mode="full")
    best = int(np.argmax(found))
    lag = int(lags[best])
    begin, end = max(lag, 0), min(len(ours), len(theirs) + lag)
    a, b = ours[begin:end], theirs[begin - lag : end - lag]
    energy = float(np.sqrt((a * a).sum() * (b * b).sum()))
    likeness = float((a * b).sum()) / energy if energy > 0 else 0.0
    return first.start_ns - other.start_ns + lag * 1e9 / AUDIO_HZ, likeness
