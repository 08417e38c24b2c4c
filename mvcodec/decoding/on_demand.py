"""Pictures and maps of a frame set that are made when somebody looks at them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Generic, TypeVar

from mvcodec.array import Position
from mvcodec.workers import Job

Coded = TypeVar("Coded")
Made = TypeVar("Made")


class OnDemand(Mapping[Position, Made], Generic[Coded, Made]):
    """What is coded of each camera, made into what is wanted of it by whoever looks first. Thread-safe.

    A view needs the cameras around it, and frame sets that are only passed on the way to another one need
    none.

    Args:
        coded: by camera; let go of once it is made.
        make: takes a camera and what is coded of it.
    """

    def __init__(self, coded: Mapping[Position, Coded], make: Callable[[Position, Coded], Made]) -> None:
        self._cameras, self._coded, self._make = tuple(coded), dict(coded), make
        self._jobs: dict[Position, Job[Made]] = {}
        self._lock = threading.Lock()

    def __getitem__(self, camera: Position) -> Made:
        job = self._jobs.get(camera)
        if job is None:
            with self._lock:
                if camera not in self._jobs:
                    self._jobs[camera] = Job(self._make, (camera, self._coded.pop(camera)))
            job = self._jobs[camera]
        return job.result()

    def __contains__(self, camera: object) -> bool:
        return camera in self._cameras

    def __iter__(self) -> Iterator[Position]:
        return iter(self._cameras)

    def __len__(self) -> int:
        return len(self._cameras)
