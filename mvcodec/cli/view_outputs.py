"""The forms that ``decode`` writes: each takes the pictures of all views, frame after frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.errors import OutputError, SettingError
from mvcodec.frames import Picture
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter
from mvcodec.output.mosaic import mosaic
from mvcodec.output.pictures import viewpoint_name, write_png
from mvcodec.output.video_file import Mp4Writer
from mvcodec.stream import view_name

THREADS = 2


@dataclass(frozen=True, slots=True)
class ViewGrid:
    """What is rendered of each frame set.

    Attributes:
        array: of the stream.
        rows, cols: how the views lie in a mosaic, or in the array folder.
        viewpoints: rows * cols of them, row order.
        named_by_place: files are named after the place in this grid, else after the viewpoint.
    """

    array: CameraArray
    rows: int
    cols: int
    viewpoints: tuple[Viewpoint, ...]
    named_by_place: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        """The name of each view in files and folders."""
        if self.named_by_place:
            return tuple(view_name(divmod(number, self.cols)) for number in range(len(self.viewpoints)))
        return tuple(viewpoint_name(viewpoint) for viewpoint in self.viewpoints)

    @property
    def real(self) -> tuple[Position, ...]:
        """The places in this grid where a real camera stands."""
        return tuple(
            divmod(number, self.cols)
            for number, viewpoint in enumerate(self.viewpoints)
            if viewpoint.position in self.array.real
        )


class ViewOutput(Protocol):
    """Takes the pictures; what it wrote has its name only after a body without error."""

    complete: bool
    """True once it wants no further frame."""

    def push(self, pictures: Sequence[Picture], index: int) -> None:
        """Write one frame set.

        Args:
            pictures: uint8 (H, W, 3) RGB of each viewpoint, in their order.
            index: frame number in the original.

        Raises:
            OutputError: the system refuses.
        """
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class _Output:
    """What the forms share: resources that are closed at the end, or given up after an error."""

    complete = False

    def __init__(self, path: Path, views: ViewGrid) -> None:
        self._path, self._views, self._resources = path, views, ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._resources.__exit__(kind, error, trace)


class ArrayOutput(_Output):
    """An array folder, with the places of the real cameras and the first frame's number."""

    _writer: ArrayFolderWriter | None = None

    def push(self, pictures: Sequence[Picture], index: int) -> None:
        """See ViewOutput."""
        if self._writer is None:
            facts = grid_facts(self._views, index)
            self._writer = self._resources.enter_context(ArrayFolderWriter(self._path, facts))
        places = (divmod(number, self._views.cols) for number in range(len(pictures)))
        self._writer.push(dict(zip(places, pictures, strict=True)))


class PngOutput(_Output):
    """A folder for each view, pictures numbered from 0."""

    def __init__(self, path: Path, views: ViewGrid) -> None:
        super().__init__(path, views)
        self._count = 0
        self._pool = self._resources.enter_context(ThreadPoolExecutor(THREADS, "write"))

    def push(self, pictures: Sequence[Picture], index: int) -> None:  # noqa: ARG002 - as ViewOutput has it
        """See ViewOutput."""
        name = f"{self._count:06d}.png"
        paths = [self._path / view / name for view in self._views.names]
        list(self._pool.map(write_png, paths, pictures))
        self._count += 1


class Mp4Output(_Output):
    """A video file for each view."""

    def __init__(self, path: Path, views: ViewGrid) -> None:
        super().__init__(path, views)
        self._writers: list[Mp4Writer] = []
        self._pool = self._resources.enter_context(ThreadPoolExecutor(THREADS, "write"))

    def push(self, pictures: Sequence[Picture], index: int) -> None:  # noqa: ARG002
        """See ViewOutput."""
        array = self._views.array
        if not self._writers:
            for view in self._views.names:
                path = self._path / f"{view}.mp4"
                writer = Mp4Writer(path, array.width, array.height, array.fps)
                self._writers.append(self._resources.enter_context(writer))
        list(self._pool.map(Mp4Writer.push, self._writers, pictures))


class MosaicVideo(_Output):
    """All views side by side in one video file."""

    _writer: Mp4Writer | None = None

    def push(self, pictures: Sequence[Picture], index: int) -> None:  # noqa: ARG002
        """See ViewOutput."""
        sheet = _side_by_side(self._views, pictures)
        if self._writer is None:
            height, width = sheet.shape[:2]
            writer = Mp4Writer(self._path, width, height, self._views.array.fps)
            self._writer = self._resources.enter_context(writer)
        self._writer.push(sheet)


class MosaicPicture(_Output):
    """All views of the first frame set side by side in one picture."""

    def push(self, pictures: Sequence[Picture], index: int) -> None:  # noqa: ARG002
        """See ViewOutput."""
        write_png(self._path, _side_by_side(self._views, pictures))
        self.complete = True


MOSAICS: dict[str, Callable[[Path, ViewGrid], ViewOutput]] = {".mp4": MosaicVideo, ".png": MosaicPicture}
FOLDERS: dict[str, Callable[[Path, ViewGrid], ViewOutput]] = {
    "array": ArrayOutput,
    "png": PngOutput,
    "mp4": Mp4Output,
}
FORMATS = (*FOLDERS, "mosaic")


def check_output(form: str, path: Path) -> None:
    """Refuse what cannot be written before any work is done.

    Raises:
        SettingError: a mosaic whose suffix is neither .mp4 nor .png.
        OutputError: a file is where a folder must go, or the other way round.
    """
    if form in FOLDERS:
        if path.exists() and not path.is_dir():
            raise OutputError(path, "it is a file, --format " + form + " needs a folder")
        return
    if path.suffix.lower() not in MOSAICS:
        raise SettingError(
            "OUT", path, "a name that ends in " + " or ".join(MOSAICS) + " for --format mosaic"
        )
    if path.is_dir():
        raise OutputError(path, "it is a folder, --format mosaic needs a file")


def make_output(form: str, path: Path, views: ViewGrid) -> ViewOutput:
    """The writer of one of FORMATS; see `check_output`."""
    factory = FOLDERS[form] if form in FOLDERS else MOSAICS[path.suffix.lower()]
    return factory(path, views)


def grid_facts(views: ViewGrid, first_frame: int) -> ArrayFacts:
    """The facts of the array that was rendered; its steps may differ from those of the stream's grid."""
    array = views.array
    per_col, per_row = _step(array.cols, views.cols), _step(array.rows, views.rows)
    # Disparity belongs to the horizontal step, or to the vertical one where there is no other.
    upright = views.cols == 1 and array.cols > 1
    disparity_scale = array.rho * per_row if upright else (per_col if array.cols > 1 else per_row)
    calibration, hint = array.calibration, array.disparity_per_step_px
    metres = disparity_scale * (calibration.fx_px / calibration.fy_px if upright else 1)
    square = views.cols == 1 or views.rows == 1
    return ArrayFacts.of(
        array,
        rows=views.rows,
        cols=views.cols,
        rho=1.0 if square else array.rho * per_row / per_col,
        calibration=replace(
            calibration,
            baseline_m=calibration.baseline_m * metres,
            d_inf_px_per_step=calibration.d_inf_px_per_step * disparity_scale,
        )
        if calibration.given
        else None,
        disparity_per_step_px=None
        if hint is None
        else (hint[0] * disparity_scale, hint[1] * disparity_scale),
        real=views.real,
        first_frame=first_frame,
    )


def _step(count: int, rendered: int) -> float:
    """Steps of the stream's grid (`count` views) for one step of the rendered one."""
    return (count - 1) / (rendered - 1) if count > 1 and rendered > 1 else 1.0


def _side_by_side(views: ViewGrid, pictures: Sequence[Picture]) -> Picture:
    return mosaic([pictures[row * views.cols : (row + 1) * views.cols] for row in range(views.rows)])
