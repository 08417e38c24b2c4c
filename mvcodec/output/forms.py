"""The forms in which views leave: array folder, picture folders, video files, a mosaic."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self

from mvcodec.array import Calibration, CameraArray, Position, Viewpoint
from mvcodec.closing import Closing, Completing
from mvcodec.errors import OutputError, SettingError, StreamClosed
from mvcodec.frames import Picture
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter
from mvcodec.output.mosaic import mosaic
from mvcodec.output.pictures import viewpoint_name, write_png
from mvcodec.output.video_file import Mp4Writer
from mvcodec.stream import view_name
from mvcodec.workers import run_all


@dataclass(frozen=True, slots=True)
class OutputPlan:
    """Which views will come.

    Attributes:
        array: of the input (its calibration, frame rate and real cameras).
        viewpoints: in the order in which their pictures are pushed.
        grid: (rows, cols) where the viewpoints are a full grid in row order; None where they
            are single ones.
        first_frame: index in the original of the first frame that will come.
    """

    array: CameraArray
    viewpoints: tuple[Viewpoint, ...]
    grid: tuple[int, int] | None
    first_frame: int = 0

    def __post_init__(self) -> None:
        if not self.viewpoints:
            raise SettingError("viewpoints", "none", "one at least")
        if self.grid is not None and math.prod(self.grid) != len(self.viewpoints):
            raise SettingError("grid", f"{self.grid[0]}x{self.grid[1]}", f"{len(self.viewpoints)} views")

    @property
    def names(self) -> tuple[str, ...]:
        """Of each view's files: its place in the grid (as in the array form), or its viewpoint."""
        if self.grid is None:
            return tuple(viewpoint_name(viewpoint) for viewpoint in self.viewpoints)
        return tuple(view_name(divmod(number, self.grid[1])) for number in range(len(self.viewpoints)))

    @property
    def layout(self) -> tuple[int, int]:
        """(rows, cols) to show the views in: the grid, or the squarest one for single views."""
        if self.grid is not None:
            return self.grid
        cols = math.ceil(math.sqrt(len(self.viewpoints)))
        return math.ceil(len(self.viewpoints) / cols), cols


class ViewWriter(Protocol):
    """Takes the pictures of each frame in the plan's order. An error inside `with` aborts it."""

    def push(self, pictures: Sequence[Picture], time_ns: int | None = None) -> None:
        """Write uint8 (H, W, 3) RGB, one for each viewpoint of the plan.

        Args:
            time_ns: when they were taken; None: one step of the frame rate after those before.

        Raises:
            OutputError: the system refuses.
        """
        ...

    def close(self) -> None:
        """Complete the output."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class ArrayForm:
    """An array folder (docs/array-folders.md) with `real` and `first_frame`.

    Raises:
        SettingError: the plan is no full grid.
    """

    def __init__(self, target: Path, plan: OutputPlan) -> None:
        facts = grid_facts(plan)
        self._positions = [(row, col) for row in range(facts.rows) for col in range(facts.cols)]
        self._writer = ArrayFolderWriter(target, facts)

    def push(self, pictures: Sequence[Picture], time_ns: int | None = None) -> None:
        """See ViewWriter."""
        self._writer.push(dict(zip(self._positions, pictures, strict=True)), time_ns=time_ns)

    def close(self) -> None:
        """Write `array.json`."""
        self._writer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.__exit__(kind, error, trace)


class PictureForm(Closing):
    """A folder of numbered PNG pictures, which say no times, for each viewpoint: ``r00_c00/000000.png``."""

    def __init__(self, target: Path, plan: OutputPlan) -> None:
        self._folders = [target / name for name in plan.names]
        self._count = 0

    def push(self, pictures: Sequence[Picture], time_ns: int | None = None) -> None:  # noqa: ARG002
        """See ViewWriter."""
        paths = [folder / f"{self._count:06d}.png" for folder in self._folders]
        run_all(write_png, paths, pictures)
        self._count += 1

    def close(self) -> None:
        """Every picture is complete already."""


class VideoForm:
    """An MP4 file for each viewpoint: ``r00_c00.mp4``. They appear together at the end."""

    def __init__(self, target: Path, plan: OutputPlan) -> None:
        array = plan.array
        with ExitStack() as stack:
            self._writers = [
                stack.enter_context(Mp4Writer(target / f"{name}.mp4", array.width, array.height, array.fps))
                for name in plan.names
            ]
            self._resources = stack.pop_all()

    def push(self, pictures: Sequence[Picture], time_ns: int | None = None) -> None:
        """See ViewWriter."""
        run_all(Mp4Writer.push, self._writers, pictures, [time_ns] * len(self._writers))

    def close(self) -> None:
        """Finish every file."""
        self._resources.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._resources.__exit__(kind, error, trace)


class MosaicForm(Completing):
    """All views side by side: an MP4 file, or a PNG of the first frame.

    Raises:
        SettingError: the target is neither.
    """

    def __init__(self, target: Path, plan: OutputPlan) -> None:
        if target.suffix.lower() not in (".mp4", ".png"):
            raise SettingError("OUT", target, "a .mp4 or .png file for a mosaic")
        self._target, self._fps, self._layout = target, plan.array.fps, plan.layout
        self._is_video = target.suffix.lower() == ".mp4"
        self._video: Mp4Writer | None = None
        self._count, self._closed = 0, False

    def push(self, pictures: Sequence[Picture], time_ns: int | None = None) -> None:
        """See ViewWriter. After the first frame a PNG takes no more of them."""
        if self._closed:
            raise StreamClosed(f"{self._target} is closed")
        self._count += 1
        if not self._is_video and self._count > 1:
            return
        whole = mosaic(self._arranged(pictures))
        if not self._is_video:
            write_png(self._target, whole)
            return
        if self._video is None:
            self._video = Mp4Writer(self._target, whole.shape[1], whole.shape[0], self._fps)
        self._video.push(whole, time_ns)

    def _arranged(self, pictures: Sequence[Picture]) -> list[list[Picture]]:
        rows, cols = self._layout
        padded = list(pictures) + [pictures[0] * 0] * (rows * cols - len(pictures))
        return [padded[row * cols : (row + 1) * cols] for row in range(rows)]

    def close(self) -> None:
        """Complete the file.

        Raises:
            OutputError: nothing was pushed.
        """
        if self._closed:
            return
        self._closed = True
        if not self._count:
            raise OutputError(self._target, "a mosaic without a frame")
        if self._video is not None:
            self._video.close()

    def abort(self) -> None:
        """Drop a video; a PNG is complete already."""
        if self._video is not None:
            self._video.abort()


FORMS: dict[str, Callable[[Path, OutputPlan], ViewWriter]] = {
    "array": ArrayForm,
    "png": PictureForm,
    "mp4": VideoForm,
    "mosaic": MosaicForm,
}


def open_form(name: str, target: Path, plan: OutputPlan) -> ViewWriter:
    """A writer of the named form.

    Raises:
        SettingError: no such form, or the plan or target doesn't suit it.
        OutputError: the system refuses.
    """
    if name not in FORMS:
        raise SettingError("format", name, " | ".join(FORMS))
    return FORMS[name](target, plan)


def grid_facts(plan: OutputPlan) -> ArrayFacts:
    """What `array.json` states of a plan's grid, which may be denser or coarser than the input's.

    Steps, disparity and calibration are those of the new grid; `real` lists the views of it that
    are real cameras.

    Raises:
        SettingError: the plan is no full grid.
    """
    if plan.grid is None:
        raise SettingError("views", f"{len(plan.viewpoints)} single views", "a whole grid for `format` array")
    array, (rows, cols) = plan.array, plan.grid
    # Old grid steps in one new step; an axis of one view has no step.
    down = (array.rows - 1) / (rows - 1) if rows > 1 else 0.0
    right = (array.cols - 1) / (cols - 1) if cols > 1 else 0.0
    vertical = array.rho * down
    # One step of the baseline that disparity belongs to, in the input's: horizontal where there is one.
    baseline = right or vertical or 1.0
    rho = vertical / right if right and vertical else 1.0
    hint, calibration = array.disparity_per_step_px, array.calibration
    cameras = {Viewpoint(float(row), float(col)) for row, col in array.real}
    real: list[Position] = [
        (number // cols, number % cols)
        for number, viewpoint in enumerate(plan.viewpoints)
        if viewpoint in cameras
    ]
    return ArrayFacts.of(
        array,
        rows=rows,
        cols=cols,
        rho=rho,
        disparity_per_step_px=None if hint is None else (hint[0] * baseline, hint[1] * baseline),
        calibration=_rescaled(array, baseline, right) if calibration.given else None,
        real=real,
        first_frame=plan.first_frame,
    )


def _rescaled(array: CameraArray, baseline: float, right: float) -> Calibration:
    """The calibration with the baseline of the new grid's step."""
    calibration = array.calibration
    # A vertical step of rho * d px measures rho * fx / fy horizontal ones in metres.
    metres = baseline if right or array.cols == 1 else baseline * calibration.fx_px / calibration.fy_px
    return replace(
        calibration,
        baseline_m=calibration.baseline_m * metres,
        d_inf_px_per_step=calibration.d_inf_px_per_step * baseline,
    )
