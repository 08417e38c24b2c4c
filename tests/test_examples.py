"""The examples run as they stand."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from small_arrays import HEIGHT, WIDTH, write_array

from mvcodec.capture.picture_files import read_picture
from mvcodec.container import read_info

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_encode_decode(tmp_path: Path) -> None:
    script = EXAMPLES / "encode_decode.py"
    assert len(script.read_text("utf-8").splitlines()) < 40
    folder, coded, picture = (
        write_array(tmp_path / "array", frames=2),
        tmp_path / "x.mcap",
        tmp_path / "x.png",
    )
    subprocess.run([sys.executable, script, folder, coded, picture], check=True)
    assert read_info(coded).frames == 2
    assert read_picture(picture).shape == (HEIGHT, WIDTH, 3)
