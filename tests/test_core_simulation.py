"""Traced work played on any number of cores: by hand, and what a trace of real jobs holds."""

from __future__ import annotations

import pytest
from core_simulation import ENDLESS, Traced, alone, play, traced

from mvcodec.workers import run_all, settle, submit


def forked(*seconds: float, before: float = 1.0) -> Traced:
    """Work, then jobs of these times, then a wait for all, the last first."""
    jobs = [Traced([("work", time)]) for time in seconds]
    root = Traced([("work", before), *(("submit", job) for job in jobs)])
    root.events += [("wait", job) for job in reversed(jobs)]
    return root


@pytest.mark.parametrize(("cores", "expected"), [(1, 9.0), (2, 5.0), (4, 3.0), (ENDLESS, 3.0)])
def test_jobs_are_shared_among_cores(cores: int, expected: float) -> None:
    assert play(forked(2, 2, 2, 2), cores) == pytest.approx(expected)


def test_the_longest_job_bounds_it() -> None:
    root = forked(1, 1, 6)
    assert play(root, ENDLESS) == pytest.approx(7)
    assert alone(root) == pytest.approx(1)


def test_jobs_may_hand_out_jobs() -> None:
    root = Traced([("submit", inner := forked(2, 2)), ("work", 3.0), ("wait", inner)])
    assert play(root, 1) == pytest.approx(8)
    assert play(root, 2) == pytest.approx(5)
    assert play(root, 3) == pytest.approx(3)


def test_a_trace_holds_every_job_and_their_results_are_as_ever() -> None:
    found: list[list[int]] = []

    def work() -> None:
        job = submit(sum, range(4))
        found.append([*run_all(lambda number: sum(run_all(abs, [number, -number])), range(3)), job.result()])
        settle([job])

    root = traced(work, 2)
    assert found[0] == [0, 2, 4, 6]
    assert [what for what, _ in root.events if what != "work"].count("submit") == 4
    assert play(root, 2) <= play(root, 1)
