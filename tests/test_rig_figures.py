"""What `rectify` reaches: on rough sample rigs against their exact truth, and on a real unrectified pair."""

from __future__ import annotations

from pathlib import Path

import pytest
from real_rig import opened, rectified_residuals
from rough_rigs import ideal_db, measure

from mvcodec.rigs.calibration import calibrate_from_files, calibrate_from_scene
from mvcodec.scenes.rough_rig import FLAWS

EUROC = Path(__file__).parents[2] / "shared" / "data" / "euroc_raw"
IN_STEP = tuple(flaw for flaw in FLAWS if flaw != "delay")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 4])
def test_a_rough_rig_is_found(seed: int) -> None:
    found = measure(seed, (2, 2), IN_STEP, ideal_db((2, 2)))
    assert found.angle_deg < 0.08
    for spread in (found.rows, found.columns):
        assert spread.median is not None
        assert spread.p95 is not None
        assert spread.median < 0.3
        assert spread.p95 < 1.0
    assert found.views_db > found.ideal_db - 2.0


@pytest.mark.slow
@pytest.mark.shared_data
@pytest.mark.skipif(not EUROC.is_dir(), reason="../shared/data is not here")
def test_rows_of_a_real_pair_agree_by_its_files_and_by_the_scene(tmp_path: Path) -> None:
    source = opened([EUROC / "cam0", EUROC / "cam1"], tmp_path)
    chosen = range(source.frame_count)
    files = [EUROC / "cam0_sensor.yaml", EUROC / "cam1_sensor.yaml"]
    by_file = rectified_residuals(calibrate_from_files(source, chosen, files), source, [2, 14]).rows.median
    by_scene = rectified_residuals(calibrate_from_scene(source, chosen), source, [2, 14]).rows.median
    assert by_file is not None
    assert by_scene is not None
    assert by_file < 0.3
    assert by_scene < 0.5
