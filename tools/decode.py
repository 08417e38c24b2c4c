"""``python tools/decode.py ...`` is ``mvcodec decode ...``."""

from __future__ import annotations

import sys

from mvcodec.cli.main import main

if __name__ == "__main__":
    sys.exit(main(["decode", *sys.argv[1:]]))
