"""Opens what the user named: an array folder, its `array.json`, or video files in row order."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.capture.bit_depth import BitDepth
from mvcodec.capture.manifest import DEFAULT_FPS, MANIFEST_NAME, Manifest, ViewFiles, read_manifest
from mvcodec.capture.named_files import open_files, tell_notes
from mvcodec.capture.reading import Reading
from mvcodec.capture.selection import CORNERS, RealAxes, select_real
from mvcodec.capture.shared_clock import StatedTimes, common_times
from mvcodec.capture.source import ArraySource
from mvcodec.capture.time_gaps import Gaps
from mvcodec.capture.timing import Timing
from mvcodec.capture.video_input import VideoView
from mvcodec.capture.view_array import PictureView, ViewArray, ViewReader, check_sizes
from mvcodec.errors import InputError, SettingError
from mvcodec.workers import run_all

EXPECTED = (
    f'a folder with {MANIFEST_NAME}, which `mvcodec init` writes; the smallest one: {{"rows": 2, "cols": 2, '
    '"pattern": "r{row:02d}_c{col:02d}.mp4"}'
)


def open_input(
    paths: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
    *,
    grid: tuple[int, int] | None = None,
    real: str = CORNERS,
    timing: Timing | None = None,
    reading: Reading | None = None,
    originals: bool = True,
) -> ArraySource:
    """Open an input; of pictures the headers are read, of videos the packets and the first frame.

    Pictures are put together by their times; what is left out or guessed is a warning.

    Args:
        paths: one array folder (or its `array.json`), or rows * cols videos or pictures in row order.
        grid: (rows, cols); needed for several files, must agree with an array folder.
        real: which cameras are real: ``corners``, ``all``, ``every:K`` or ``R,R..xC,C..``.
        timing: what is known better than the files say.
        reading: how pictures are read, and what happens to unreadable ones.
        originals: virtual views' own pictures are wanted too; if not, real cameras alone decide when
            there are frame sets, and nothing else can be read.

    Raises:
        SettingError: `grid`, `real` or `timing` doesn't fit the input.
        InputError: something is missing, unreadable, malformed, the views differ in size, or have
            no time in common.
    """
    timing, reading = timing or Timing(), reading or Reading()
    given = [Path(path) for path in ([paths] if isinstance(paths, str | os.PathLike) else paths)]
    if not given:
        raise SettingError("INPUT", "nothing", "an array folder, or video files and `grid`, RxC")
    for path in given:
        if not path.exists():
            raise InputError(path, "nothing there", "an array folder or a video file")
        if path.suffix.lower() == ".mcap":
            expected = "an array folder or video files; `mvcodec decode` makes such a folder of a coded file"
            raise InputError(path, "an MCAP file", expected)
    if len(given) == 1 and (given[0].is_dir() or given[0].suffix.lower() == ".json"):
        return _open_folder(given[0], grid, real, timing, reading, originals)
    return _open_videos(given, grid, real, timing, reading, originals)


def _open_folder(
    path: Path,
    grid: tuple[int, int] | None,
    real: str,
    timing: Timing,
    reading: Reading,
    originals: bool,
) -> ViewArray:
    manifest = read_manifest(_find_manifest(path))
    if grid not in (None, (manifest.rows, manifest.cols)):
        raise SettingError(
            "grid", _grid_text(grid), f"{manifest.rows}x{manifest.cols} as {manifest.path} says"
        )
    if manifest.given is not None and manifest.given.kind == "depth" and manifest.calibration is None:
        raise InputError(manifest.path, "depth without calibration", "calibration, which makes it disparity")
    depth = BitDepth(str(path), reading.bits)
    views = _open_views(manifest, depth, reading.gaps)
    stated = StatedTimes(manifest.path, manifest.fps, manifest.times_ns, manifest.first_frame)
    axes = select_real(real, manifest.rows, manifest.cols)
    deciding = views if originals else _crossings(axes)
    fps, pairing = common_times(str(path), views, stated, timing, DEFAULT_FPS, deciding)
    array = _folder_array(manifest, views[0, 0].size, fps, axes)
    for position, files in manifest.truth.items():
        count = views[position].count
        if len(files.names) not in (1, count):
            found = f"{len(files.names)} truth files for view {position[0]},{position[1]}"
            raise InputError(manifest.path, found, f"1 or {count}, one for each frame")
    return ViewArray(
        str(path),
        array,
        views,
        pairing,
        on_unreadable=reading.on_unreadable,
        truth=manifest.truth,
        given=manifest.given,
        first_frame=manifest.first_frame,
        listed_real=manifest.real,
    )


def _find_manifest(path: Path) -> Path:
    if not path.is_dir():
        return path
    manifest = path / MANIFEST_NAME
    if manifest.is_file():
        return manifest
    try:
        is_empty = not any(path.iterdir())
    except OSError as error:
        raise InputError(path, error.strerror or "an unreadable folder", "an array folder") from None
    raise InputError(path, "an empty folder" if is_empty else f"no {MANIFEST_NAME}", EXPECTED)


def _folder_array(manifest: Manifest, size: tuple[int, int], fps: float, real: RealAxes) -> CameraArray:
    try:
        return CameraArray(
            rows=manifest.rows,
            cols=manifest.cols,
            width=size[0],
            height=size[1],
            fps=fps,
            real_rows=real[0],
            real_cols=real[1],
            calibration=manifest.calibration or Calibration.nominal(*size),
            rho=manifest.rho,
            disparity_per_step_px=manifest.disparity_per_step_px,
            name=manifest.name,
        )
    except SettingError as error:
        raise InputError(manifest.path, f"{error.setting} = {error.found}", error.expected) from None


def _open_videos(
    paths: Sequence[Path],
    grid: tuple[int, int] | None,
    real: str,
    timing: Timing,
    reading: Reading,
    originals: bool,
) -> ViewArray:
    name = str(paths[0]) if len(paths) == 1 else f"{paths[0]} ... {paths[-1]}"
    (rows, cols), views = open_files(paths, name, grid, reading)
    tell_notes(views)
    first = views[0, 0]
    default_fps = None if any(view.times_ns for view in views.values()) else DEFAULT_FPS
    axes = select_real(real, rows, cols)
    deciding = views if originals else _crossings(axes)
    fps, pairing = common_times(name, views, StatedTimes(), timing, default_fps, deciding)
    width, height = first.size
    calibration = Calibration.nominal(width, height)
    array = CameraArray(
        rows,
        cols,
        width,
        height,
        fps,
        *axes,
        calibration,
        name=first.path.resolve().parent.name,
    )
    return ViewArray(name, array, views, pairing, on_unreadable=reading.on_unreadable)


def _open_views(manifest: Manifest, depth: BitDepth, gaps: Gaps | None) -> dict[Position, ViewReader]:
    def opened(files: ViewFiles) -> ViewReader:
        return VideoView(files, gaps) if isinstance(files, Path) else PictureView(files, depth)

    views = dict(zip(manifest.views, run_all(opened, manifest.views.values()), strict=True))
    check_sizes(views)
    tell_notes(views)
    return views


def _crossings(axes: RealAxes) -> set[Position]:
    return {(row, col) for row in axes[0] for col in axes[1]}


def _grid_text(grid: tuple[int, int] | None) -> str:
    return "nothing" if grid is None else f"{grid[0]}x{grid[1]}"
