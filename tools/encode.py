"""``python tools/encode.py ...`` is ``mvcodec encode ...``."""

from __future__ import annotations

import sys

from mvcodec.cli.main import main

if __name__ == "__main__":
    sys.exit(main(["encode", *sys.argv[1:]]))
