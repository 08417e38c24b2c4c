"""One setting for threads: no result depends on it, jobs inside jobs come to an end, errors come in order."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from coding import RANGE_PX, config, encode, frame_set, make_array
from command_line import fails, succeeds

from mvcodec.array import Viewpoint
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, find_matcher
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet
from mvcodec.stereo.matchers import MATCHERS
from mvcodec.synthesis.layered import Layered
from mvcodec.synthesis.quick import Quick
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.video.codecs import CODECS
from mvcodec.workers import (
    run_all,
    run_in_bands,
    set_threads,
    settle,
    submit,
    submit_later,
    thread_count,
    threads,
)

NUMBERS = (1, 2, 3, 8)
ARRAY = make_array(70, 51)


def test_jobs_inside_of_jobs_come_to_an_end_with_any_number_of_threads() -> None:
    def tree(depth: int) -> int:
        return 1 if depth == 0 else sum(run_all(tree, [depth - 1] * 3))

    for number in NUMBERS:
        with threads(number):
            assert run_all(tree, [4, 3, 2]) == [81, 27, 9]


@pytest.mark.parametrize("number", NUMBERS)
def test_as_many_compute_at_once_as_were_asked_for(number: int) -> None:
    most, now, lock = 0, 0, threading.Lock()
    together = threading.Barrier(number)

    def work(_: int) -> None:
        nonlocal most, now
        with lock:
            now += 1
            most = max(most, now)
        together.wait(60)  # none goes on before `number` of them are here
        with lock:
            now -= 1

    with threads(number):
        run_all(work, range(3 * number))
    assert most == number


def test_jobs_know_the_setting_of_who_gave_them() -> None:
    with threads(3):
        assert run_all(lambda _: thread_count(), range(5)) == [3] * 5
        with threads(2):
            assert run_all(lambda _: thread_count(), range(5)) == [2] * 5
        with threads(None):
            assert thread_count() == 3


def test_the_first_error_in_order_is_raised_after_all_are_done() -> None:
    done: set[int] = set()

    def work(number: int) -> int:
        done.add(number)
        if number in (2, 5):
            raise ValueError(str(number))
        return number

    for number in NUMBERS:
        done.clear()
        with threads(number), pytest.raises(ValueError, match="2"):
            run_all(work, range(8))
        assert done == set(range(8))


def test_a_job_that_nobody_has_begun_can_be_left() -> None:
    begun, go = threading.Event(), threading.Event()

    def block() -> None:
        begun.set()
        go.wait(60)

    with threads(2):
        first = submit(block)
        begun.wait(60)
        second = submit(lambda: pytest.fail("it was cancelled"))
        second.cancel()
        go.set()
        settle([first, second])
        first.result()


def test_what_can_wait_is_begun_last() -> None:
    begun, go, order = threading.Event(), threading.Event(), list[str]()

    def block() -> None:
        begun.set()
        go.wait(60)

    with threads(2):
        first = submit(block)
        begun.wait(60)
        jobs = [
            submit_later(order.append, "later"),
            submit(order.append, "now"),
            submit(order.append, "then"),
        ]
        go.set()
        for job in [first, *jobs]:
            job.wait()
    assert order == ["now", "then", "later"]


def test_who_has_to_wait_does_what_can_wait() -> None:
    begun, done = threading.Event(), threading.Event()

    def needs_the_other() -> bool:
        begun.set()
        return done.wait(60)

    with threads(2):
        first = submit(needs_the_other)
        begun.wait(60)  # the only other thread waits now
        later = submit_later(done.set)
        settle([first])
        assert first.result()
        assert later.done


def test_jobs_let_go_of_what_they_needed() -> None:
    class Thing:
        pass

    for number in NUMBERS:
        with threads(number):
            thing = Thing()
            gone = weakref.ref(thing)
            job = submit(lambda _: 5, thing)
            del thing
            assert job.result() == 5
            assert gone() is None


@pytest.mark.parametrize("length", [0, 1, 5, 64])
def test_bands_hold_every_row_once(length: int) -> None:
    for number in NUMBERS:
        rows = np.zeros(length, np.int64)

        def work(start: int, stop: int, rows: np.ndarray[tuple[int, ...], np.dtype[np.int64]] = rows) -> None:
            rows[start:stop] += 1

        with threads(number):
            run_in_bands(length, work)
        assert (rows == 1).all()


@pytest.mark.parametrize("number", [0, -1, 257, 2.0, True, "2"])
def test_numbers_that_cannot_be_are_refused(number: int) -> None:
    for use in (lambda n: Decoder(threads=n), lambda n: Layered(thread_count=n), set_threads):
        with pytest.raises(SettingError, match="threads"):
            use(number)


def _same(make: Callable[[int], object]) -> None:
    first = make(NUMBERS[0])
    for number in NUMBERS[1:]:
        np.testing.assert_equal(make(number), first)


@pytest.mark.parametrize("codec", CODECS)
def test_a_file_is_the_same_for_every_number_of_threads(codec: str) -> None:
    def packets(number: int) -> list[bytes]:
        with Encoder(ARRAY, config(codec=codec, threads=number)) as encoder:
            return [p.data for index in range(3) for p in encoder.push(frame_set(ARRAY, index))]

    _same(packets)


@pytest.mark.parametrize("name", [name for name in MATCHERS if name != "given"])
def test_maps_are_the_same_for_every_number_of_threads(name: str) -> None:
    array = make_array(70, 51, rows=1, cols=2)
    pictures = frame_set(array, 0).pictures

    def maps(number: int) -> list[np.ndarray[tuple[int, ...], np.dtype[np.float32]]]:
        with threads(number):
            return [m.values_px for m in find_matcher(name).match(array, pictures, RANGE_PX).values()]

    _same(maps)


def _decoded(number: int) -> list[DecodedSet]:
    sets = encode(ARRAY, 2, gop=2, disparity_cameras="alternate", disparity_scale=2)
    with Decoder(threads=number) as decoder:
        return [decoded for packets in sets for packet in packets for decoded in decoder.push(packet)]


def test_decoded_sets_are_the_same_for_every_number_of_threads() -> None:
    def planes(number: int) -> list[object]:
        return [
            value
            for decoded in _decoded(number)
            for camera in decoded.array.real
            for value in (decoded.pictures[camera], decoded.disparities[camera].values_px)
        ]

    _same(planes)


@pytest.mark.parametrize("make", [Layered, Quick])
def test_views_are_the_same_for_every_number_of_threads(make: Callable[..., Synthesizer]) -> None:
    decoded = _decoded(2)[0]

    def view(number: int) -> list[object]:
        found = make(thread_count=number).render(decoded, Viewpoint(0.3, 0.6))
        return [found.pixels, found.disparity_px, found.seen_by]

    _same(view)


def test_the_command_line_takes_the_number_and_refuses_others(tmp_path: Path) -> None:
    message = fails(2, "sample", tmp_path / "a", "--threads", "0")
    assert "--threads: found 0, expected a whole number, 1..256" in message
    size = ("--grid", "1x3", "--frames", "1", "--size", "48x32")
    for number in ("1", "3"):
        succeeds("sample", tmp_path / number, *size, "--threads", number)
    one, three = (sorted(p for p in (tmp_path / n).rglob("*.png")) for n in ("1", "3"))
    assert one
    assert [p.read_bytes() for p in one] == [p.read_bytes() for p in three]
