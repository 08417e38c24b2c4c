"""Context managers that close themselves, or give up where the block ends with an error."""

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


class Completing(Closing):
    """What `close` completes; a `with` block that ends with an error gives it up."""

    def abort(self) -> None:
        """Give up; each class says what stays."""
        raise NotImplementedError

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        else:
            self.abort()
