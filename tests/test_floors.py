"""The default chain on the real arrays: what it must reach at least."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import succeeds

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data"

FLOORS = {
    "tsukuba": (28.90, 0.924),
    "cones": (28.81, 0.919),
    "art": (26.00, 0.878),
    "moebius": (29.72, 0.939),
    "antinous": (44.21, 0.990),
    "shop_s1": (35.10, 0.937),
    "shop_s2": (33.64, 0.926),
    "shop_v3": (32.97, 0.918),
    "shop_v4": (34.21, 0.930),
    "shop_17x17": (30.50, 0.887),
}
"""Mean luma PSNR (dB) and SSIM of the virtual views, corners uncoded: what an experiment reached."""

SHOP_V3_QP = 32
SHOP_V3_KBIT, SHOP_V3_DB = 560, 32.0
"""For each time instant of the whole array, container included; mean over all 25 views."""

pytestmark = [
    pytest.mark.shared_data,
    pytest.mark.slow,
    pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is not here"),
]


@pytest.mark.parametrize("name", FLOORS)
def test_synthesis_from_uncoded_corners(name: str) -> None:
    command = [sys.executable, str(ROOT / "tools" / "benchmark.py"), "--data", str(DATA), "--sets", name]
    done = subprocess.run(
        [*command, "--what", "quality", "--json"], capture_output=True, text=True, check=True
    )
    figures = json.loads(done.stdout)["sets"][name]
    psnr, ssim = FLOORS[name]
    # The floors are printed with two and three digits.
    assert figures["psnr_y"] > psnr - 0.005
    assert figures["ssim"] > ssim - 0.0005


def test_coded_video(tmp_path: Path) -> None:
    coded, decoded = tmp_path / "v3.mcap", tmp_path / "v3"
    info = succeeds("encode", DATA / "shop_v3", coded, "--qp", str(SHOP_V3_QP), "--json")
    succeeds("decode", coded, decoded)
    quality = json.loads(succeeds("compare", DATA / "shop_v3", decoded, "--json"))
    assert json.loads(info)["bits"]["total"] / 9 <= SHOP_V3_KBIT * 1000
    assert quality["psnr_y"]["all"] >= SHOP_V3_DB
