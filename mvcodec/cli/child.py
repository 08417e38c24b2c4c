"""``python -m mvcodec.cli.child COMMAND ...``: a command that ends when the process that started it does.

That one holds standard input open and says nothing; where it is gone, however it ended, the pipe is closed.
"""

from __future__ import annotations

import os
import sys
import threading

from mvcodec.cli.main import EXIT_FAILURE, main


def _end_with_parent() -> None:
    while os.read(0, 1):  # not sys.stdin, whose lock a thread may not hold when Python ends
        pass
    os._exit(EXIT_FAILURE)


if __name__ == "__main__":
    threading.Thread(target=_end_with_parent, daemon=True).start()
    sys.exit(main())
