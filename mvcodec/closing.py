"""Context managers that close themselves, however the block ends."""

from __future__ import annotations

from types import TracebackType
from typing import Self


class Closing:
    """What `close` ends, a `with` block ends too."""

    def close(self) -> None:
        """End the work; each class says what that is."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
