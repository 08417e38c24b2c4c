"""The demo and the benchmark on a small array, and what make says where Python is missing."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from small_arrays import HEIGHT, WIDTH, write_array

from mvcodec.capture.picture_files import read_picture
from mvcodec.cli.main import command_parser
from mvcodec.container import read_info

ROOT = Path(__file__).parents[1]


def run(tool: str, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, ROOT / "tools" / tool, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("arrays") / "small", frames=2)


def test_demo_leaves_file_pictures_and_table(array: Path, tmp_path: Path) -> None:
    out, copy = tmp_path / "out", tmp_path / "view.png"
    done = run(
        "demo.py", "--input", array, "--out", out, "--qp", "30", "--picture", copy, "--synthesizer", "linear"
    )
    assert done.returncode == 0, done.stderr
    info = read_info(out / "array.mcap")
    assert info.frames == 2
    lines = {line[:24].strip(): line[24:].split() for line in done.stdout.splitlines()}
    assert lines["kbit"][0] == f"{info.bits.total / 1e3:.1f}"
    for name in ("Y-PSNR dB", "SSIM"):
        for kind in ("all", "real", "virtual", "worst"):
            ours, simulcast = (float(figure) for figure in lines[f"{name}, {kind}"])
            assert 0 < ours < 60
            assert 0 < simulcast < 60
    assert lines["Y-PSNR dB, real"][0] == lines["Y-PSNR dB, real"][1]
    for name in ("contact_sheet.png", "original_synthesised_error.png"):
        assert read_picture(out / name).any()
    assert (out / "mosaic.mp4").stat().st_size > 0
    assert read_picture(out / "first_view.png").shape == (HEIGHT, WIDTH, 3)
    assert done.stdout.index("first_view.png") < done.stdout.index("synthesising 9 views")
    for line, name in zip(done.stdout.splitlines()[-2:], ("play", "render"), strict=True):
        program, command, *rest = shlex.split(line)
        assert (ROOT / program).is_file()
        assert command == name
        command_parser(name).parse_args(rest)
    assert copy.read_bytes() == (out / "original_synthesised_error.png").read_bytes()


def test_benchmark_has_the_documented_form(array: Path) -> None:
    done = run("benchmark.py", "--data", array.parent, "--synthesizer", "linear", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert list(document) == ["sets", "ratios"]
    assert list(document["sets"]) == ["small"]
    figures = document["sets"]["small"]
    assert list(figures) == ["psnr_y", "ssim", "worst_psnr_y", "seconds_per_view"]
    assert figures["worst_psnr_y"] <= figures["psnr_y"]
    assert set(document["ratios"]) == {"view", "match", "encode", "decode"}
    assert all(ratio > 0 for ratio in document["ratios"].values())


def test_benchmark_puts_other_maps_beside_the_default_ones(array: Path) -> None:
    options = ("--data", array, "--what", "quality", "--synthesizer", "linear")
    done = run("benchmark.py", *options, "--maps", "sgbm-h", "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)["sets"]["small"]
    assert list(figures) == ["psnr_y", "ssim", "worst_psnr_y", "seconds_per_view", "maps"]
    alone = run("benchmark.py", *options, "--matcher", "sgbm-h", "--json")
    expected = json.loads(alone.stdout)["sets"]["small"]
    for name in ("psnr_y", "ssim", "worst_psnr_y"):
        assert figures["maps"]["sgbm-h"][name] == expected[name] != figures[name]
    header, line = done.stderr.splitlines()
    assert "sgbm-h maps" in header
    assert f"{figures['psnr_y']:.2f}" in line.split("|")[0]
    assert f"{expected['psnr_y']:.2f}" in line.split("|")[1]
    wrong = run("benchmark.py", *options, "--maps", "sgmb")
    assert wrong.returncode == 2
    assert wrong.stderr.count("\n") == 1
    assert "matcher: found sgmb, expected one of joint, " in wrong.stderr


def test_benchmark_takes_refined_matchers(array: Path) -> None:
    options = ("--data", array, "--what", "quality", "--synthesizer", "linear", "--json")
    done = run("benchmark.py", *options, "--matcher", "sad", "--maps", "sad+dlr")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)["sets"]["small"]
    refined = json.loads(run("benchmark.py", *options, "--matcher", "sad+dlr").stdout)["sets"]["small"]
    assert figures["maps"]["sad+dlr"]["psnr_y"] == refined["psnr_y"] != figures["psnr_y"]
    wrong = run("benchmark.py", *options, "--matcher", "sad+dlx")
    assert wrong.returncode == 2
    assert "matcher refinement: found dlx, expected one of dlr, dlr-thesis" in wrong.stderr


def test_benchmark_skips_what_has_no_virtual_view_and_says_so(array: Path, tmp_path: Path) -> None:
    shutil.copytree(array, tmp_path / "with")
    write_array(tmp_path / "pair", 1, 2, 1)
    done = run("benchmark.py", "--data", tmp_path, "--what", "quality", "--synthesizer", "linear")
    assert done.returncode == 0, done.stderr
    assert "pair: skipped, its 1 x 2 grid has no virtual view" in done.stdout
    assert run("benchmark.py", "--data", tmp_path, "--sets", "other").returncode == 2


def test_error_shares_add_up(array: Path) -> None:
    done = run("error_shares.py", "--data", array.parent, "--json")
    assert done.returncode == 0, done.stderr
    shares = json.loads(done.stdout)["sets"]["small"]
    assert list(shares) == ["regions", "worst_share", "brightness_share", "noise_share"]
    assert list(shares["regions"]) == ["filled", "edges", "flat", "texture"]
    for name in ("share", "error_share"):
        assert sum(region[name] for region in shares["regions"].values()) == pytest.approx(1)
    texture = shares["regions"]["texture"]
    assert f"{texture['share']:.1%} {texture['error_share']:6.1%}" in done.stderr
    done = run("error_shares.py", "--data", array / "none")
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize("python", ["", "false"])
def test_make_says_in_one_line_that_python_is_missing(tmp_path: Path, python: str) -> None:
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    done = subprocess.run(
        ["make", "test", f"PYTHON={python}"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "mvcodec needs Python 3.11 or newer" in done.stderr
    assert not (tmp_path / ".venv").exists()


@pytest.mark.slow
def test_figures_that_everyone_can_make_are_made() -> None:
    done = run("sample_figures.py")
    assert done.returncode == 0, done.stderr
    for name in ("layered", "dils", "joint", "sgbm", "realtime"):
        assert f"| {name} |" in done.stdout
