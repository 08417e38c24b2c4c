"""Feeds damaged input, guided by coverage, to what reads files: anything but an MvCodecError is a find.

    python tools/fuzz.py TARGET [--seconds 600] [--corpus FOLDER] [--keep]

Stops at the first crash, hang (10 s) or use of more than 1 GiB, and leaves the input in ./fuzz-finds.
With --keep, inputs that reach new code are added to the corpus.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
from pathlib import Path

try:
    import atheris
except ImportError:
    sys.exit("atheris is not installed; it has wheels for Linux on x86-64 (pip install atheris)")

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
with atheris.instrument_imports(include=["mvcodec"]):
    from fuzz_targets import CORPUS, SEED_BYTES, TARGETS, seeds

FINDS = Path("fuzz-finds")


def main() -> int:
    """Fuzz one target."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--corpus", type=Path, default=CORPUS)
    parser.add_argument("--keep", action="store_true")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    FINDS.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for number, seed in enumerate(seeds(arguments.target)):
            (Path(folder) / f"seed{number}").write_bytes(seed)
        kept = arguments.corpus / arguments.target
        kept.mkdir(parents=True, exist_ok=True)
        folders = [kept, folder] if arguments.keep else [folder, kept]
        limits = [f"-max_total_time={arguments.seconds}", "-rss_limit_mb=1024", "-timeout=10"]
        options = [*limits, f"-artifact_prefix={FINDS}/", "-print_final_stats=1", f"-max_len={SEED_BYTES}"]
        atheris.Setup([sys.argv[0], *options, *map(str, folders)], TARGETS[arguments.target])
        atheris.Fuzz()
    return 0


if __name__ == "__main__":
    sys.exit(main())
