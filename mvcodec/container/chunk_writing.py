"""An MCAP file that grows by whole chunks of whole frame sets; see FORMAT.md."""

from __future__ import annotations

import io
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Protocol

from mcap.writer import CompressionType, Writer

import mvcodec
from mvcodec.errors import OutputError
from mvcodec.settings import Setting

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

CHUNK_MS = Setting(
    "chunk_ms",
    int,
    500,
    "stream time that waits before it is written, ms, which is what a power cut can lose; 0 writes each frame"
    " set at once",
    low=0,
    high=60_000,
    expected="a whole number of ms, 0..60000",
)

FULL_CHUNK_BYTES = 1 << 26
"""A chunk ends when it holds so much, well below what readers take."""

LIBRARY = f"mvcodec {mvcodec.__version__}"


class MessageListener(Protocol):
    """Hears of all that goes into a file, in order; called by the thread that writes."""

    def add_channel(self, topic: str, encoding: str, name: str, schema_encoding: str, schema: bytes) -> None:
        """A topic was declared."""
        ...

    def begin_set(self, keyframe: bool) -> None:
        """A frame set begins."""
        ...

    def add(self, topic: str, time_ns: int, data: bytes) -> None:
        """A message was added."""
        ...


class ChunkedFile:
    """Writes messages, frame set by frame set: `open`, then `begin_set`, `add` ..., `end_set`.

    Args:
        target: path, or an open binary file, which may be a pipe and stays open.
        chunk_ms: the most stream time that waits before it is written, 0..60000; with 0 each
            frame set is written at once. See `CHUNK_MS`.
        listener: hears of all that is written.

    Raises:
        SettingError (at once): chunk_ms is outside its range.
        OutputError (from every method): the system refuses to open or write.
    """

    def __init__(
        self,
        target: BinaryIO | Path,
        chunk_ms: int = CHUNK_MS.default,
        listener: MessageListener | None = None,
    ) -> None:
        CHUNK_MS.check(chunk_ms)
        self._chunk_ns = chunk_ms * 1_000_000
        self._target, self._listener = target, listener
        name = target if isinstance(target, Path) else getattr(target, "name", "output")
        self._name = "standard output" if name == 1 else str(name)
        self._file: io.BufferedWriter | None = None
        self._mcap: Writer | None = None
        self._schemas: dict[str, int] = {}
        self.channels: dict[str, int] = {}
        self._chunk_start_ns: int | None = None
        self._chunk_bytes = 0
        self._sets_in_chunk = 0
        self.sets_written = 0

    @property
    def is_open(self) -> bool:
        """Whether `open` was called."""
        return self._mcap is not None

    @property
    def joinable(self) -> bool:
        """Whether somebody may begin to read in the middle: of a pipe."""
        return not isinstance(self._target, Path) and not self._target.seekable()

    def open(self) -> None:
        """Open the file and write its start."""
        target = self._target
        with self._writing():
            self._file = target.open("wb") if isinstance(target, Path) else io.BufferedWriter(_Pipe(target))
            # Chunks end where `begin_set` says, never by size. Summary offsets are optional, and
            # checkers fault those of empty groups (a file without attachments).
            self._mcap = Writer(
                self._file,
                chunk_size=1 << 62,
                compression=CompressionType.ZSTD,
                use_summary_offsets=False,
                enable_data_crcs=True,
            )
            self._mcap.start(profile="", library=LIBRARY)

    def add_channel(self, topic: str, encoding: str, name: str, schema_encoding: str, schema: bytes) -> None:
        """Declare a topic and the schema of its messages (once for all topics of a schema's name)."""
        mcap = self._opened()
        if name not in self._schemas:
            self._schemas[name] = mcap.register_schema(name, schema_encoding, schema)
        self.channels[topic] = mcap.register_channel(topic, encoding, self._schemas[name])
        if self._listener is not None:
            self._listener.add_channel(topic, encoding, name, schema_encoding, schema)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record before the chunk at hand."""
        with self._writing():
            self._opened().add_metadata(name, dict(values))

    def begin_set(self, time_ns: int, keyframe: bool) -> None:
        """Begin a frame set; writes the chunk before it where that is full.

        A chunk starts at each keyframe, so that a reader reaches keyframes by the chunk index.
        """
        if self._listener is not None:
            self._listener.begin_set(keyframe)
        start = self._chunk_start_ns
        if start is not None and (
            keyframe or time_ns - start >= self._chunk_ns or self._chunk_bytes >= FULL_CHUNK_BYTES
        ):
            self._end_chunk()
        if self._chunk_start_ns is None:
            self._chunk_start_ns = time_ns

    def add(self, topic: str, index: int, time_ns: int, data: bytes) -> None:
        """Add a message to the frame set."""
        self._chunk_bytes += len(data)
        self._opened().add_message(self.channels[topic], time_ns, data, time_ns, sequence=index)
        if self._listener is not None:
            self._listener.add(topic, time_ns, data)

    def end_set(self) -> None:
        """End the frame set; without chunk time it is written now."""
        self._sets_in_chunk += 1
        if not self._chunk_ns:
            self._end_chunk()

    def close(self) -> None:
        """Complete the file with its summary."""
        try:
            with self._writing():
                if self._mcap is not None:
                    self._mcap.finish()  # type: ignore[no-untyped-call]
                if self._file is not None:
                    self._file.close()  # a file that was handed in stays open: see _Pipe
                self._count_chunk()
        finally:
            if self._file is not None:
                # After a failure the buffer would be written again, and fail again, at exit.
                with suppress(OSError):
                    self._file.raw.close()

    def _opened(self) -> Writer:
        assert self._mcap is not None
        return self._mcap

    def _end_chunk(self) -> None:
        """Write the chunk, and see that it outlasts a loss of power."""
        with self._writing():
            self._opened().flush()  # type: ignore[no-untyped-call]
            self._chunk_start_ns, self._chunk_bytes = None, 0
            if not isinstance(self._target, Path):
                self._target.flush()  # it may have a buffer of its own
            elif self._file is not None:
                descriptor = self._file.fileno()
                if stat.S_ISREG(os.fstat(descriptor).st_mode):
                    os.fsync(descriptor)
            self._count_chunk()

    def _count_chunk(self) -> None:
        self.sets_written += self._sets_in_chunk
        self._sets_in_chunk = 0

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise OutputError(self._name, error.strerror or error) from None


class _Pipe(io.RawIOBase):
    """Any binary output with the `tell` that the MCAP library asks for; leaves the output open."""

    def __init__(self, output: BinaryIO) -> None:
        self._output = output
        self._written = 0

    def writable(self) -> bool:
        return True

    def write(self, data: ReadableBuffer, /) -> int:
        count = self._output.write(data)  # may be a part: io.BufferedWriter writes the rest
        self._written += count
        return count

    def tell(self) -> int:
        return self._written

    def flush(self) -> None:
        self._output.flush()
