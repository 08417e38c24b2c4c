"""One command on many recordings, in segments where that is possible: what is missing is done, by Dask."""

from __future__ import annotations

import glob
import hashlib
import json
import shutil
import tempfile
import uuid
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import mvcodec
from mvcodec.cluster.batch_inputs import Recording
from mvcodec.cluster.connection import RETRIES
from mvcodec.cluster.frame_segments import cut
from mvcodec.cluster.places import Place
from mvcodec.cluster.tasks import PART, Outcome, join_parts, run_command
from mvcodec.errors import OutputError

RECORDS = "batch"
"""The folder beside the outputs that holds a record of each, and the segments that wait for others."""

SEGMENTED = ("encode", "decode")

Option = tuple[str, ...]
"""An option as it was given: its name, then its values."""


@dataclass(frozen=True, slots=True)
class Batch:
    """What to do.

    Attributes:
        command: encode, decode, render or validate.
        options: the command's own.
        output: folder of the outputs.
        ending: of an output's name; empty for a folder.
        segment_s: length of segments, s; None: a recording is one task.
        retries: how often a task that was killed is tried again.
        overwrite: outputs that were made with other options, or not by a batch, are made anew.
        threads: of each task; None: all cores of the worker's machine.
    """

    command: str
    options: tuple[Option, ...]
    output: Place
    ending: str
    segment_s: float | None = None
    retries: int = RETRIES.default
    overwrite: bool = False
    threads: int | None = None


@dataclass(slots=True)
class Job:
    """A recording on its way.

    Attributes:
        digest: of all that its output depends on.
        waiting: segments that are not there yet.
        parts: the segments' places, in order.
        error: one line, where it failed.
        skipped: its output was there already.
        result: what the command said of it.
    """

    recording: Recording
    target: Place
    digest: str
    waiting: int = 0
    parts: list[str] = field(default_factory=list)
    error: str | None = None
    skipped: bool = False
    result: Any = None


@dataclass(frozen=True, slots=True)
class Progress:
    """Told of frame sets: how many more there are to do, and how many more are done."""

    more: Callable[[int], object]
    done: Callable[[int], object]


def run_batch(client: Any, batch: Batch, recordings: Sequence[Recording], progress: Progress) -> list[Job]:
    """Do what is missing.

    Args:
        client: a `distributed.Client`.

    Returns:
        A job for each recording; one that failed does not keep the others.

    Raises:
        InputError: an input is gone, or cannot be asked.
        OutputError: an output is there that was made otherwise.
        KeyboardInterrupt: after what runs was cancelled; segments that are finished stay.
    """
    jobs = [_job(batch, recording) for recording in recordings]
    run = _Run(client, batch, progress)
    try:
        for job in jobs:
            if not job.skipped:
                run.start(job)
        run.finish()
    except BaseException:
        run.cancel()
        raise
    return jobs


def _job(batch: Batch, recording: Recording) -> Job:
    """A recording's job; raises OutputError where something else is in the way."""
    target = batch.output / f"{recording.name}{batch.ending}"
    depends_on = [batch.command, batch.options, Place(recording.source).fingerprint(), mvcodec.__version__]
    digest = hashlib.blake2b(json.dumps(depends_on).encode(), digest_size=8).hexdigest()
    job = Job(recording, target, digest)
    if not target.exists():
        return job
    job.skipped = _digest_of(_record(batch, recording)) == digest
    if not job.skipped and not batch.overwrite:
        reason = "it is there and was not made from this input with these options (-y: make it anew)"
        raise OutputError(target.url, reason)
    return job


def _record(batch: Batch, recording: Recording) -> Place:
    return batch.output / RECORDS / f"{recording.name}.json"


def _digest_of(record: Place) -> str | None:
    if not record.exists():
        return None
    try:
        found = json.loads(record.read())
    except ValueError:
        return None
    return found.get("digest") if isinstance(found, dict) else None


class _Run:
    """Submits tasks, and what follows from those that end."""

    def __init__(self, client: Any, batch: Batch, progress: Progress) -> None:
        import distributed

        self._client, self._batch, self._progress = client, batch, progress
        self._name = f"mvcodec-{uuid.uuid4().hex}"
        self._cancelled = distributed.Event(self._name, client=client)
        self._ended = distributed.as_completed()
        self._futures: dict[str, Any] = {}
        self._jobs: dict[str, tuple[Job, Callable[[Outcome], None]]] = {}

    def start(self, job: Job) -> None:
        """Submit a recording's first task."""
        batch = self._batch
        if batch.segment_s is None or batch.command not in SEGMENTED:
            self._whole(job)
        elif batch.command == "encode":
            options = ["plan.mcap", *_flat(batch.options), "--dry-run"]
            self._submit(job, "plan", partial(self._encode, job), "encode", options, None)
        else:
            self._submit(job, "plan", partial(self._decode, job), "info", ["--json"], None)

    def finish(self) -> None:
        """Wait for all tasks, and for those that they bring about."""
        for future in self._ended:
            job, follow = self._jobs.pop(future.key)
            del self._futures[future.key]
            if future.status != "finished":
                error = future.exception()
                told = " ".join(str(error).split()) or type(error).__name__
                job.error = job.error or f"given up after {self._batch.retries} retries: {told}"
                continue
            outcome: Outcome = future.result()
            if outcome.error is not None and not _is_verdict(outcome):
                job.error = job.error or outcome.error
            elif job.error is None:
                follow(outcome)

    def cancel(self) -> None:
        """Cancel what runs; what is finished stays."""
        self._cancelled.set()
        self._client.cancel(list(self._futures.values()), force=True)

    def _whole(self, job: Job) -> None:
        """Submit a recording as one task."""
        batch = self._batch
        own = {"validate": ["--json"], "render": ["--quiet"]}.get(batch.command, ["--json", "--quiet"])
        target = None if batch.command == "validate" else job.target.url
        follow = partial(self._done, job)
        self._submit(job, "whole", follow, batch.command, [*_flat(batch.options), *own], target)

    def _encode(self, job: Job, planned: Outcome) -> None:
        """Submit the segments of a recording whose frames and range are known."""
        plan = planned.result
        frames = range(*plan["frames"])
        self._progress.more(len(frames))
        low, high = plan["disparity_range_px"]
        found = plan["keyframe_ratio"]
        ratio = [] if found is None else [f"--keyframe-ratio={found!r}"]
        others = [
            option
            for option in self._batch.options
            if option[0] not in ("--frames", "--disparity-range", "--exact-range", "--keyframe-ratio")
        ]
        segments = cut(frames, plan["gop"], plan["fps"], self._batch.segment_s)
        # All are waited for before the first is looked at: one that is there already must not end the job.
        job.waiting = len(segments)
        for segment in segments:
            own = [f"--frames={segment.start}:{segment.stop}"]
            own += [f"--disparity-range={low!r},{high!r}", "--exact-range", *ratio]
            if segment.start > frames.start:
                own.append(f"--continues={segment.start - frames.start}")
            part = self._segments(job) / f"{segment.start:08d}-{segment.stop:08d}.mcap"
            job.parts.append(part.url)
            if part.exists():
                self._segment_done(job, len(segment), Outcome())
                continue
            follow = partial(self._segment_done, job, len(segment))
            options = [*_flat(others), *own, "--json", "--quiet"]
            self._submit(job, f"{segment.start}-{segment.stop}", follow, "encode", options, part.url)

    def _segment_done(self, job: Job, frames: int, _: Outcome) -> None:
        self._progress.done(frames)
        job.waiting -= 1
        if job.waiting == 0:
            arguments = (tuple(job.parts), job.target.url, self._name)
            self._send(job, "join", partial(self._done, job), join_parts, arguments)

    def _decode(self, job: Job, planned: Outcome) -> None:
        """Submit the segments of a file whose length is known."""
        info = planned.result
        frames = range(info["frames"])
        self._progress.more(len(frames))
        segments = cut(frames, 1, info["fps"], self._batch.segment_s)
        job.waiting = len(segments)
        for segment in segments:
            part = self._segments(job) / f"{segment.start:08d}-{segment.stop:08d}"
            if part.exists():
                self._views_done(job, len(segment), Outcome())
                continue
            options = [*_flat(self._batch.options), f"--frames={segment.start}:{segment.stop}", "--quiet"]
            follow = partial(self._views_done, job, len(segment))
            self._submit(job, f"{segment.start}-{segment.stop}", follow, "decode", options, part.url)

    def _views_done(self, job: Job, frames: int, outcome: Outcome) -> None:
        self._progress.done(frames)
        job.waiting -= 1
        if job.waiting == 0:
            self._segments(job).move(job.target)
            self._done(job, outcome)

    def _segments(self, job: Job) -> Place:
        """The folder of a recording's segments until they are complete."""
        return self._batch.output / RECORDS / f"{job.recording.name}-{job.digest}"

    def _done(self, job: Job, outcome: Outcome) -> None:
        """Write the record of a finished job, which is the last thing that it does."""
        job.result = outcome.result
        if self._batch.command == "validate":
            _write(job.target, outcome.result)
        if job.parts:
            self._segments(job).remove()
        record = {
            "digest": job.digest,
            "command": self._batch.command,
            "options": self._batch.options,
            "input": job.recording.source,
            "mvcodec": mvcodec.__version__,
            "last_task": asdict(outcome),
        }
        _write(_record(self._batch, job.recording), record)
        _remove_parts(job.target)

    def _submit(
        self,
        job: Job,
        what: str,
        follow: Callable[[Outcome], None],
        command: str,
        options: Sequence[str],
        target: str | None,
    ) -> None:
        if self._batch.threads is not None and command != "info":
            options = [*options, f"--threads={self._batch.threads}"]
        arguments = (command, job.recording.source, tuple(options), target, self._name, mvcodec.__version__)
        self._send(job, what, follow, run_command, arguments)

    def _send(
        self,
        job: Job,
        what: str,
        follow: Callable[[Outcome], None],
        function: Callable[..., Outcome],
        arguments: tuple[Any, ...],
    ) -> None:
        # The scheduler's dashboard shows these names, and groups them by their words.
        key = f"{self._batch.command}-{what}-{job.recording.name}-{uuid.uuid4().hex[:8]}"
        self._jobs[key] = job, follow
        future = self._client.submit(function, *arguments, key=key, pure=False, retries=self._batch.retries)
        self._futures[key] = future
        self._ended.add(future)


def _flat(options: Sequence[Option]) -> list[str]:
    return list(chain.from_iterable(options))


def _is_verdict(outcome: Outcome) -> bool:
    """Whether a command failed because a file is not clean, which is what was asked."""
    return isinstance(outcome.result, dict) and "findings" in outcome.result


def _remove_parts(target: Place) -> None:
    """Remove what runs that were killed left beside an output that is whole now."""
    if target.local is not None:
        for folder in target.local.parent.glob(f".{glob.escape(target.name)}.*{PART}"):
            shutil.rmtree(folder, ignore_errors=True)


def _write(place: Place, document: Any) -> None:
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / place.name
        made.write_text(json.dumps(document, indent=1), encoding="utf-8")
        place.put(made)
