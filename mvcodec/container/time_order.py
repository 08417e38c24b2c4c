"""The messages of an indexed MCAP file in the order of their time, however they were written."""

from __future__ import annotations

import heapq
from bisect import bisect_left, bisect_right
from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise

from mcap.records import Message

from mvcodec.container.chunk_reading import ChunkReader, TopicMessage

_RUN = 5
"""Messages that two stretches of a topic must have at the same times before its clock was set back."""


_MAX_RUNS = 100
"""More are disorder, no clock that was set."""


def in_time_order(reader: ChunkReader, topics: Collection[str]) -> Iterator[TopicMessage]:
    """The messages on some topics by their log time; chunks that lie over one another are held in memory."""
    waiting: list[tuple[int, int, str, Message]] = []
    count = 0
    for chunk in sorted(reader.chunks_with(topics), key=lambda chunk: chunk.message_start_time):
        while waiting and waiting[0][0] < chunk.message_start_time:
            yield _popped(waiting)
        for topic, message in reader.read_chunk(chunk):
            if topic in topics:
                heapq.heappush(waiting, (message.log_time, count, topic, message))
                count += 1
    while waiting:
        yield _popped(waiting)


def _popped(waiting: list[tuple[int, int, str, Message]]) -> TopicMessage:
    _, _, topic, message = heapq.heappop(waiting)
    return topic, message


def was_set_back(times_ns: Sequence[int]) -> bool:
    """Whether the clock of a topic, its times in the order of the file, went over the same time twice.

    Messages that merely lie in another order do not: what came late fills a gap.
    """
    cuts = [0, *(number + 1 for number, (a, b) in enumerate(pairwise(times_ns)) if b < a), len(times_ns)]
    if len(cuts) > _MAX_RUNS:
        return False
    earlier: list[int] = []
    for begin, end in pairwise(cuts):
        run = times_ns[begin:end]
        again = bisect_right(earlier, run[-1]) - bisect_left(earlier, run[0])
        known = bisect_right(run, earlier[-1]) if earlier else 0
        if again >= _RUN and known >= _RUN:
            return True
        earlier = sorted([*earlier, *run]) if earlier and run[0] < earlier[-1] else [*earlier, *run]
    return False
