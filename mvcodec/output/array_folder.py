"""Array folders out: numbered PNG pictures of every view, exact truth where known, `array.json` last."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.closing import Completing
from mvcodec.errors import OutputError, SettingError, StreamClosed
from mvcodec.frames import FloatMap, Picture
from mvcodec.output.atomic import write_bytes
from mvcodec.output.pictures import write_pfm, write_png
from mvcodec.stream import view_name
from mvcodec.workers import settle, submit

MANIFEST_NAME = "array.json"
PICTURE_PATTERN = "r{row:02d}_c{col:02d}/{frame:06d}.png"
VIDEO_PATTERN = "r{row:02d}_c{col:02d}.mp4"


@dataclass(frozen=True, slots=True)
class ArrayFacts:
    """What `array.json` states besides the pictures.

    Attributes:
        rows, cols, fps: the grid and its frame sets a second.
        name, licence: texts; left out where empty.
        rho, calibration, disparity_per_step_px: as in CameraArray; None is left out.
        real: positions of the coded views, in a folder that `decode` writes; else None.
        first_frame: index in the original of frame 0.
    """

    rows: int
    cols: int
    fps: float
    name: str = ""
    rho: float = 1.0
    calibration: Calibration | None = None
    disparity_per_step_px: tuple[float, float] | None = None
    real: Collection[Position] | None = None
    first_frame: int = 0
    licence: str = ""

    @classmethod
    def of(cls, array: CameraArray, **changes: Any) -> ArrayFacts:
        """The facts of an array; nominal calibration is not passed on as if it were given."""
        facts: dict[str, Any] = {
            "rows": array.rows,
            "cols": array.cols,
            "fps": array.fps,
            "name": array.name,
            "rho": array.rho,
            "calibration": array.calibration if array.calibration.given else None,
            "disparity_per_step_px": array.disparity_per_step_px,
        }
        return cls(**(facts | changes))

    def document(self) -> dict[str, Any]:
        """The JSON object of docs/array-folders.md, without the pictures' names."""
        document: dict[str, Any] = {"rows": self.rows, "cols": self.cols, "fps": self.fps, "rho": self.rho}
        if self.name:
            document = {"name": self.name} | document
        if self.disparity_per_step_px is not None:
            document["disparity_per_step_px"] = list(self.disparity_per_step_px)
        if self.calibration is not None:
            document["calibration"] = asdict(self.calibration)
            del document["calibration"]["given"]
        if self.real is not None:
            document["real"] = [list(position) for position in sorted(self.real)]
        if self.first_frame:
            document["first_frame"] = self.first_frame
        if self.licence:
            document["licence"] = self.licence
        return document


class ArrayFolderWriter(Completing):
    """Writes an array folder, frame set by frame set.

    An existing folder is written into. Its old `array.json` goes at the first push, so that a run
    that breaks off never leaves one that speaks of other pictures.

    Args:
        folder: made where it is missing.
        facts: what `array.json` shall state.

    Raises:
        OutputError: the system refuses.
    """

    def __init__(self, folder: Path, facts: ArrayFacts) -> None:
        self.folder, self.facts = folder, facts
        self.frame_count = 0
        self._times_ns: list[int] = []
        self._positions = {(row, col) for row in range(facts.rows) for col in range(facts.cols)}
        self._with_truth: set[Position] = set()
        self._closed = False

    def push(
        self,
        pictures: Mapping[Position, Picture],
        truth: Mapping[Position, FloatMap] | None = None,
        time_ns: int | None = None,
    ) -> None:
        """Write the next frame set.

        Args:
            pictures: uint8 (H, W, 3) RGB of every view of the grid.
            truth: float32 (H, W) px for one grid step, by view; not finite where unknown. The same
                views in each frame set.
            time_ns: when they were taken; `array.json` says so where that isn't at a constant rate.

        Raises:
            StreamClosed: after `close`.
            SettingError: views are missing or lie outside the grid.
            OutputError: the system refuses.
        """
        truth = truth or {}
        self._check(pictures, truth)
        if not self.frame_count:
            self._forget_old_manifest()
            self._with_truth = set(truth)
        number = self.frame_count
        jobs = [
            submit(write_png, self.folder / view_name(view) / f"{number:06d}.png", picture)
            for view, picture in pictures.items()
        ]
        jobs += [
            submit(write_pfm, self.folder / _truth_pattern(view).format(frame=number), values)
            for view, values in truth.items()
        ]
        settle(jobs)
        for job in jobs:
            job.result()
        self._times_ns.append(self._steady_ns(number) if time_ns is None else time_ns)
        self.frame_count += 1

    def _steady_ns(self, number: int) -> int:
        return round((self.facts.first_frame + number) * 1e9 / self.facts.fps)

    def _check(self, pictures: Mapping[Position, Picture], truth: Mapping[Position, FloatMap]) -> None:
        if self._closed:
            raise StreamClosed(f"{self.folder} is closed")
        if set(pictures) != self._positions:
            grid = f"every view of the {self.facts.rows}x{self.facts.cols} grid"
            raise SettingError("pictures", f"{len(pictures)} views", grid)
        expected = self._with_truth if self.frame_count else self._positions
        if not (set(truth) <= expected and (not self.frame_count or set(truth) == expected)):
            raise SettingError("truth", sorted(truth), "views of the grid, the same in each frame set")

    def _forget_old_manifest(self) -> None:
        path = self.folder / MANIFEST_NAME
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(path, error.strerror or error) from None

    def close(self) -> None:
        """Write `array.json`. A second call does nothing.

        Raises:
            OutputError: nothing was pushed, or the system refuses.
        """
        if self._closed:
            return
        self.abort()
        if not self.frame_count:
            raise OutputError(self.folder, "an array without a frame set")
        files: dict[str, Any] = {"pattern": PICTURE_PATTERN, "frames": self.frame_count}
        if self._times_ns != [self._steady_ns(number) for number in range(self.frame_count)]:
            files["times_ns"] = self._times_ns
        if self._with_truth:
            files["truth"] = {
                view_name(view): {"file": _truth_pattern(view), "scale": 1.0, "steps": 1}
                for view in sorted(self._with_truth)
            }
        write_manifest(self.folder, self.facts, files)

    def abort(self) -> None:
        """Stop without an `array.json`; pictures already written stay."""
        self._closed = True


def write_manifest(folder: Path, facts: ArrayFacts, files: Mapping[str, Any]) -> None:
    """Write `array.json`: the facts and the keys that name the files (docs/array-folders.md).

    Raises:
        OutputError: the system refuses.
    """
    document = facts.document() | dict(files)
    write_bytes(folder / MANIFEST_NAME, (json.dumps(document, indent=2) + "\n").encode())


def _truth_pattern(view: Position) -> str:
    return f"truth/{view_name(view)}/{{frame:06d}}.pfm"
