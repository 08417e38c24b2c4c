"""The wheel, installed apart from the repository: its types, its program, its command and its page."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from packages import build_wheel, installed

from mvcodec.kernels.compiled_code import folder

ROOT = Path(__file__).parents[1]

PROGRAM = """
from pathlib import Path
import numpy as np
import mvcodec

def frames() -> list[np.ndarray[tuple[int, ...], np.dtype[np.uint8]]]:
    wide = np.arange(64 * 80, dtype=np.uint32).reshape(64, 80, 1).repeat(3, 2) * 7 % 251
    views = [[wide[:48, shift : shift + 64] for shift in (0, 4)] for _ in range(2)]
    return [np.array(views, np.uint8)] * 2

info: mvcodec.StreamInfo = mvcodec.encode(frames(), "x.mcap", fps=30, qp=27, matcher="sgbm:p1=2")
with mvcodec.open("x.mcap", synthesizer="linear") as video:  # which compiles least
    array: mvcodec.CameraArray = video.array
    fps: float = video.fps
    print(len(video), round(video.duration_s, 3), video.codec, array.cols, f"{fps:g}", info.frames)
    frame: mvcodec.DecodedSet = video[1]
    assert video.at(0.05).index == frame.index
    picture: mvcodec.Picture = video.render(0.5, 0.25, frame=1)
    print(picture.shape, picture.dtype, video.disparity(0.5, 0.25, frame=1).dtype)
    for frame in video:
        print(frame.index)
try:
    mvcodec.EncoderConfig(crf=99)
except mvcodec.SettingError as error:
    print(error)
print(Path(mvcodec.__file__).parent.parent)
"""
WRONG = "import mvcodec\nwith mvcodec.open('x.mcap') as video:\n    video.render('0')\n"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy, since building leaves files beside the sources."""
    place = tmp_path_factory.mktemp("wheel")
    copy = place / "source"
    copy.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE", "mvcodec"):
        subprocess.run(["cp", "-r", str(ROOT / name), str(copy)], check=True)
    return build_wheel(copy, place)


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The wheel is installed, and has the kernels that were compiled before, as long as they are the same."""
    site = tmp_path_factory.mktemp("installed") / "site"
    found = installed(site, wheel)
    for kept in folder().glob("*.nb[ci]"):
        shutil.copy(kept, site / "mvcodec" / "kernels" / "__pycache__")
    return found


def test_page_and_type_marker_are_in_the_wheel(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as held:
        names = set(held.namelist())
    page = {path.relative_to(ROOT).as_posix() for path in (ROOT / "mvcodec/web_player/dist").rglob("*.*")}
    assert page
    assert page | {"mvcodec/py.typed"} <= names
    assert not [name for name in names if name.startswith(("tests", "tools", "examples"))]


def test_a_program_outside_runs_and_type_checks(environment: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    (tmp_path / "wrong.py").write_text(WRONG)
    done = subprocess.run(
        [sys.executable, "program.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.splitlines() == [
        "2 0.067 h264 2 30 2",
        "(48, 64, 3) uint8 float32",
        "0",
        "1",
        "crf: found 99, expected 1..63",
        environment["PYTHONPATH"],
    ], done.stderr
    checked = subprocess.run(
        [
            sys.executable,
            "-m",
            "mypy",
            "--strict",
            "--cache-dir",
            str(tmp_path / "cache"),
            "program.py",
            "wrong.py",
        ],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "wrong.py:3: error: Missing positional argument" in checked.stdout, checked.stdout
    assert "program.py" not in checked.stdout


def test_the_command_is_installed(environment: dict[str, str], tmp_path: Path) -> None:
    command = [str(Path(environment["PYTHONPATH"]) / "bin" / "mvcodec"), "info", "--json"]
    sample = ROOT / "samples" / "room_2x2.mcap"
    done = subprocess.run(
        [*command, str(sample)], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert '"grid": [2, 2]' in done.stdout
