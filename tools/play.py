"""``python tools/play.py ...`` is ``mvcodec play ...``."""

from __future__ import annotations

import sys

from mvcodec.cli.main import main

if __name__ == "__main__":
    sys.exit(main(["play", *sys.argv[1:]]))
