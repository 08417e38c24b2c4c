"""What the core can do without the packages of the extras: all but what they are for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SAMPLE = Path(__file__).parent.parent / "samples" / "room_2x2"

# A finder in front of all others, for which the packages do not exist.
WITHOUT = """
import sys
class Gone:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"skimage", "matplotlib", "bjontegaard", "foxglove", "fsspec"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Gone())
from mvcodec.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def without(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", WITHOUT, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_coding_and_decoding_need_no_extra(tmp_path: Path) -> None:
    coded, decoded = tmp_path / "x.mcap", tmp_path / "views"
    fast = ("--frames", ":1", "--preset", "ultrafast", "--matcher", "sgbm", "--quiet")
    for step in (
        ("encode", SAMPLE, coded, *fast),
        ("info", coded),
        ("validate", coded),
        ("decode", coded, decoded, "--quiet"),
        ("compare", SAMPLE, decoded, "--frames", ":1", "--quiet"),
    ):
        done = without(*step)
        assert done.returncode == 0, done.stderr
    assert (decoded / "array.json").is_file()


def test_the_sample_scenes_name_what_they_lack(tmp_path: Path) -> None:
    for scene in ("room", "motorcycle"):
        done = without("sample", tmp_path / scene, "--scene", scene, "--frames", "1")
        assert done.returncode == 1
        found = done.stderr.strip()
        assert found.startswith(
            "mvcodec: error: scikit-image is not installed; install it with: pip install "
        )
        assert "\n" not in found
        assert not (tmp_path / scene).exists()
