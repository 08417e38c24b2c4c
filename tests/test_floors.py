"""The default chain on the real arrays: what it must reach, and did when that was written down."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from command_line import succeeds

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data"

SYNTHESIS = {
    "tsukuba": (30.0, 0.940),
    "cones": (29.5, 0.928),
    "art": (27.5, 0.900),
    "moebius": (30.7, 0.948),
    "antinous": (46.3, 0.993),
    "shop_s1": (36.0, 0.946),
    "shop_s2": (35.0, 0.938),
    "shop_v3": (34.5, 0.933),
    "shop_v4": (35.3, 0.941),
    "shop_17x17": (32.0, 0.905),
}
"""Mean luma PSNR (dB) and SSIM of the virtual views, corners uncoded."""

TMIV_RETUNED = {
    "tsukuba": 29.14,
    "cones": 28.87,
    "art": 26.62,
    "antinous": 45.33,
    "shop_s1": 35.03,
    "shop_s2": 34.26,
}
"""MPEG's renderer, retuned, on plain SGBM maps of horizontal partners, dB (docs/measurements.md)."""

CODED = {
    "shop_v3": (32, 300, 32.0),
    "shop_v2": (37, 330, 30.0),
}
"""QP; at most so many kbit for each time instant, container included; mean dB of all views."""

MAPS_SHARE = {"shop_v3": 0.20, "shop_v2": 0.20}
KITTI_QP, KITTI_MAPS_SHARE = 27, 0.15

pytestmark = [
    pytest.mark.shared_data,
    pytest.mark.slow,
    pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is not here"),
]


def figures_of(name: str, *options: str) -> dict[str, float]:
    """What the benchmark prints of a set."""
    command = [sys.executable, str(ROOT / "tools" / "benchmark.py"), "--data", str(DATA), "--sets", name]
    done = subprocess.run(
        [*command, "--what", "quality", "--json", *options], capture_output=True, text=True, check=True
    )
    found: dict[str, float] = json.loads(done.stdout)["sets"][name]
    return found


@pytest.mark.parametrize("name", SYNTHESIS)
def test_synthesis_from_uncoded_corners(name: str) -> None:
    figures = figures_of(name)
    psnr, ssim = SYNTHESIS[name]
    # They are stated with one and three digits.
    assert figures["psnr_y"] > psnr - 0.005
    assert figures["ssim"] > ssim - 0.0005


@pytest.mark.parametrize("name", TMIV_RETUNED)
def test_the_renderer_alone_is_ahead_of_mpegs(name: str) -> None:
    assert figures_of(name, "--maps", "sgbm-h")["psnr_y"] > TMIV_RETUNED[name]


def coded(name: str, qp: int, folder: Path) -> tuple[dict[str, Any], Path]:
    file = folder / f"{name}.mcap"
    options = "--qp", str(qp), "--preset", "slow", "--disparity-range", "auto", "--json"
    return json.loads(succeeds("encode", DATA / name, file, *options)), file


def maps_share(info: dict[str, Any]) -> float:
    return float(info["bits"]["disparity"] / info["bits"]["total"])


@pytest.mark.parametrize("name", CODED)
def test_coded_video(name: str, tmp_path: Path) -> None:
    qp, kbit, decibel = CODED[name]
    info, file = coded(name, qp, tmp_path)
    succeeds("decode", file, tmp_path / "decoded")
    quality = json.loads(succeeds("compare", DATA / name, tmp_path / "decoded", "--json"))
    assert info["bits"]["total"] / info["frames"] <= kbit * 1000
    assert quality["psnr_y"]["all"] >= decibel
    assert maps_share(info) <= MAPS_SHARE[name]


def test_maps_of_kitti(tmp_path: Path) -> None:
    info, _ = coded("kitti", KITTI_QP, tmp_path)
    assert maps_share(info) <= KITTI_MAPS_SHARE
