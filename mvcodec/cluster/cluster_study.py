"""A rate-distortion study whose points are measured by the workers of a Dask cluster."""

from __future__ import annotations

import hashlib
import tempfile
import threading
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mvcodec.capture import open_input
from mvcodec.cluster.places import Place
from mvcodec.cluster.tasks import ASK_SECONDS
from mvcodec.errors import InputError, MvCodecError, OutputError
from mvcodec.evaluation.fingerprint import InputFacts
from mvcodec.evaluation.points import CurvePoint, PointStore
from mvcodec.evaluation.study import Study, StudyRun, StudyStopped


@dataclass(frozen=True, slots=True)
class Opening:
    """How a worker opens the input.

    Attributes:
        inputs: paths from the root, or URLs.
        grid, real: as `open_input` takes them.
    """

    inputs: tuple[str, ...]
    grid: tuple[int, int] | None
    real: str


@dataclass(frozen=True, slots=True)
class PointTask:
    """One point to measure.

    Attributes:
        frames: numbers of the first frame and of the one after the last.
        curve: number of the curve in `study.curves`.
        name: the point's key as the client has it.
        run: name of the event that cancels the run.
    """

    opening: Opening
    study: Study
    frames: tuple[int, int]
    facts: InputFacts
    curve: int
    qp: int
    name: str
    run: str


@dataclass(frozen=True, slots=True)
class MeasuredPoint:
    """What a worker sends back: the figures, and the stream that they belong to, as small as it is coded.

    Attributes:
        error: one line, where the point cannot be measured.
    """

    point: CurvePoint | None = None
    stream: bytes | None = None
    error: str | None = None


def measure_on_cluster(
    client: Any, study_run: StudyRun, opening: Opening, retries: int, on_pictures: Callable[[int], object]
) -> dict[str, list[CurvePoint]]:
    """The points of every curve by its name; those that the store holds are not measured again.

    Args:
        client: a `distributed.Client`.
        study_run: says what there is to measure, and keeps what was.

    Raises:
        InputError: a point cannot be measured; those that are measured stay in the store.
        OutputError: the system refuses to keep one.
    """
    import distributed

    run = f"mvcodec-{uuid.uuid4().hex}"
    cancelled = distributed.Event(run, client=client)
    store, study = study_run.store, study_run.study
    wanted: dict[str, tuple[str, Mapping[str, Any], int]] = {}
    futures = []
    measured = study_run.measured_curves
    for number, curve in enumerate(study.curves):
        for qp in curve.qps if curve in measured else ():
            depends_on = study_run.depends_on(curve, qp)
            name, pictures = store.name(depends_on), study_run.pictures_of(curve)
            if store.find(name) is not None:
                on_pictures(pictures)
                continue
            frames = (study_run.chosen.start, study_run.chosen.stop)
            task = PointTask(opening, study, frames, study_run.facts, number, qp, name, run)
            key = f"evaluate-{curve.name}-{qp}-{name[:8]}-{run[-6:]}"
            wanted[key] = name, depends_on, pictures
            futures.append(client.submit(measure_point, task, key=key, pure=False, retries=retries))
    try:
        for future in distributed.as_completed(futures):
            name, found_with, pictures = wanted[future.key]
            if future.status != "finished":
                told = " ".join(str(future.exception()).split())
                raise InputError(future.key, f"a task that failed {retries + 1} times ({told})", "a point")
            _keep(store, name, future.result(), found_with)
            on_pictures(pictures)
    except BaseException:
        cancelled.set()
        client.cancel(futures, force=True)
        raise
    return study_run.measure()  # all are there


def _keep(store: PointStore, name: str, found: MeasuredPoint, depends_on: Mapping[str, Any]) -> None:
    if found.point is None:
        raise InputError("a worker", found.error or "nothing", "a measured point")
    if found.stream is not None and found.point.file is not None:
        path = store.folder / found.point.file
        part = path.with_suffix(".part")
        try:
            store.folder.mkdir(parents=True, exist_ok=True)
            part.write_bytes(found.stream)
            part.replace(path)
        except OSError as error:
            raise OutputError(path, error.strerror or error) from None
    store.keep(name, found.point, depends_on)


def measure_point(task: PointTask) -> MeasuredPoint:
    """Measure one point: what a worker does."""
    try:
        return _WORKBENCH.measure(task)
    except MvCodecError as error:
        return MeasuredPoint(error=" ".join(str(error).split()))


class _Workbench:
    """Keeps the last task's input open, and the maps that were matched for it, for the next task's sake."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._key = ""
        self._held = ExitStack()
        self._run: StudyRun | None = None
        self._task: PointTask | None = None
        self._asked = time.monotonic()

    def measure(self, task: PointTask) -> MeasuredPoint:
        with self._lock:  # matched maps are kept in one file, and video encoders use all cores anyway
            self._task = task
            run = self._study_run(task)
            curve = task.study.curves[task.curve]
            if run.store.name(run.depends_on(curve, task.qp)) != task.name:
                return MeasuredPoint(
                    error="other libraries or another mvcodec on this worker than at the client"
                )
            point = run.point(curve, task.qp)
            stream = None if point.file is None else (run.store.folder / point.file).read_bytes()
            return MeasuredPoint(point, stream)

    def _study_run(self, task: PointTask) -> StudyRun:
        key = hashlib.blake2b(repr((task.opening, task.study, task.frames)).encode()).hexdigest()
        if self._run is None or key != self._key:
            self._run = None
            self._held.close()
            folder = Path(self._held.enter_context(tempfile.TemporaryDirectory(prefix="mvcodec-study-")))
            paths = [self._held.enter_context(Place(name).fetched(folder)) for name in task.opening.inputs]
            source = open_input(paths, grid=task.opening.grid, real=task.opening.real)
            store = PointStore(folder)
            self._run = StudyRun(
                task.study, source, range(*task.frames), task.facts, store, self._on_pictures
            )
            self._key = key
        return self._run

    def _on_pictures(self, _: int) -> None:
        """End the task where its run was cancelled."""
        import distributed

        if time.monotonic() - self._asked < ASK_SECONDS or self._task is None:
            return
        self._asked = time.monotonic()
        if distributed.Event(self._task.run).is_set():
            raise StudyStopped


_WORKBENCH = _Workbench()


def opening_of(inputs: Sequence[Path | str], grid: tuple[int, int] | None, real: str) -> Opening:
    """What workers open: this machine's paths from the root."""
    places = [str(item.resolve()) if isinstance(item, Path) else item for item in inputs]
    return Opening(tuple(places), grid, real)
