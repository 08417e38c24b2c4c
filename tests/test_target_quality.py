"""`--target-psnr`: the largest QP that reaches a quality."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import fails, succeeds
from small_arrays import write_array

from mvcodec.capture import open_input
from mvcodec.container import read_info
from mvcodec.encoding.config import EncoderConfig
from mvcodec.errors import SettingError
from mvcodec.evaluation.target_quality import qp_for_quality
from mvcodec.synthesis.synthesizers import make_synthesizer

CONFIG = EncoderConfig(matcher="sgbm", preset="ultrafast", disparity_range_px=(0, 12))
LAYERED = make_synthesizer("layered")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("array"), 3, 3, 2)


@pytest.mark.parametrize("target_db", [26.0, 32.0])
def test_the_largest_qp_that_reaches_it_is_found(folder: Path, target_db: float) -> None:
    source = open_input([folder])
    config = EncoderConfig(
        matcher="sgbm", preset="ultrafast", disparity_range_px=(0, 12), enhance="auto", qp=20
    )
    tried: list[None] = []
    found = qp_for_quality(source, range(2), config, target_db, LAYERED, lambda: tried.append(None))
    assert found.psnr_y >= target_db
    assert found.codings == len(tried) <= 8
    coarser = qp_for_quality(source, range(2), config, found.psnr_y + 0.01, LAYERED)
    assert coarser.qp < found.qp


def test_a_quality_that_synthesis_cannot_reach_is_told(folder: Path) -> None:
    with pytest.raises(
        SettingError, match=r"target_psnr: found 90 dB, expected at most .* dB, which QP 1 re"
    ):
        qp_for_quality(open_input([folder]), range(2), CONFIG, 90.0, LAYERED)


def test_the_command_codes_with_what_it_finds(folder: Path, tmp_path: Path) -> None:
    options = ("--matcher", "sgbm", "--preset", "ultrafast", "--disparity-range", "0,12")
    out = tmp_path / "x.mcap"
    said = succeeds("encode", folder, out, "--target-psnr", "30", *options)
    qp = read_info(out).header.settings["qp"]
    assert f"QP {qp}: 30." in said or f"QP {qp}: 31." in said
    assert "not allowed with" in fails(2, "encode", folder, out, "-y", "--target-psnr", "30", "--qp", "3")
