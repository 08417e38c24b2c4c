"""Reading, coding and writing side by side, with bounded queues between them."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from queue import Empty, Full, Queue
from typing import Literal, get_args

from mvcodec.container import McapWriter
from mvcodec.encoding.encoder import Encoder
from mvcodec.frames import FrameSet
from mvcodec.settings import check_settings, setting
from mvcodec.stream import Packet

WhenBehind = Literal["drop", "block"]

WAITING_INPUT = 4
"""Frame sets that may wait to be coded."""

WAITING_OUTPUT = 8
"""Coded frame sets that may wait to be written."""

_POLL_S = 0.1


@dataclass(slots=True)
class _End:
    """The end of the input: an error, or nothing."""

    error: BaseException | None = None


@dataclass(frozen=True, slots=True)
class BehindSettings:
    """What is done where frame sets come faster than they can be coded and written.

    Raises:
        SettingError: another policy.
    """

    when_behind: WhenBehind = setting(
        "block",
        "where coding or the reader of the output is too slow: leave frame sets out before they are coded, or"
        " let the input wait",
        choices=get_args(WhenBehind),
    )

    def __post_init__(self) -> None:
        check_settings(self)


class LiveEncoding:
    """Codes frame sets as they come.

    Args:
        encoder: codes.
        writer: takes the packets; both are closed by the caller.
        settings: the numbers of frame sets that are left out are missing in the file.
    """

    def __init__(
        self, encoder: Encoder, writer: McapWriter, settings: BehindSettings = BehindSettings()
    ) -> None:
        self._encoder, self._writer = encoder, writer
        self._drops = settings.when_behind == "drop"
        self._input: Queue[FrameSet | _End] = Queue(WAITING_INPUT)
        self._output: Queue[list[Packet] | None] = Queue(WAITING_OUTPUT)
        self._failure: BaseException | None = None
        self._ended = threading.Event()
        self._dropped_by: Counter[str] = Counter()

    @property
    def dropped(self) -> int:
        """Frame sets left out."""
        return self._dropped_by.total()

    def run(
        self,
        frame_sets: Iterable[FrameSet],
        stopped: Callable[[], bool] = lambda: False,
        on_frame: Callable[[], object] = lambda: None,
    ) -> None:
        """Code until the input ends or `stopped` says so; then everything coded is written.

        Raises:
            MvCodecError: what reading, coding or writing raises.
        """
        # The reader may sit in a read that never returns; the process must be able to end.
        threading.Thread(target=self._read, args=(frame_sets,), daemon=True).start()
        writer = threading.Thread(target=self._write, daemon=True)
        writer.start()
        try:
            self._code(stopped, on_frame)
        finally:
            self._ended.set()
            self._put_output(None)
            writer.join()
        if self._failure is not None:
            raise self._failure

    def _read(self, frame_sets: Iterable[FrameSet]) -> None:
        end = _End()
        try:
            for frame_set in frame_sets:
                if self._drops:
                    try:
                        self._input.put_nowait(frame_set)
                    except Full:
                        self._dropped_by["reader"] += 1
                else:
                    self._put_input(frame_set)
                if self._ended.is_set():
                    return
        except BaseException as error:  # raised again in the caller's thread
            end.error = error
        self._put_input(end)

    def _put_input(self, item: FrameSet | _End) -> None:
        while not self._ended.is_set():
            try:
                self._input.put(item, timeout=_POLL_S)
                return
            except Full:
                continue

    def _code(self, stopped: Callable[[], bool], on_frame: Callable[[], object]) -> None:
        while self._failure is None and not stopped():
            try:
                item = self._input.get(timeout=_POLL_S)
            except Empty:
                continue
            if isinstance(item, _End):
                if item.error is not None:
                    raise item.error
                return
            if self._drops and self._output.full():
                self._dropped_by["coder"] += 1  # each thread has a count of its own: += is two steps
                continue
            self._put_output(self._encoder.push(item))
            on_frame()

    def _put_output(self, packets: list[Packet] | None) -> None:
        while self._failure is None:
            try:
                self._output.put(packets, timeout=_POLL_S)
                return
            except Full:
                continue

    def _write(self) -> None:
        try:
            while (packets := self._output.get()) is not None:
                self._writer.push(packets)
        except BaseException as error:  # raised again in the caller's thread
            self._failure = error
