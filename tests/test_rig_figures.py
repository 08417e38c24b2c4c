"""What `rectify` reaches: on rough sample rigs against their exact truth, and on a real unrectified pair."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from real_rig import compared, opened, rectified_residuals
from rough_rigs import Measured, ideal_db, measure

from mvcodec.rigs.calibration import calibrate_from_files, calibrate_from_scene
from mvcodec.scenes.rough_rig import FLAWS

EUROC = Path(__file__).parents[2] / "shared" / "data" / "euroc_raw"
IN_STEP = tuple(flaw for flaw in FLAWS if flaw != "delay")
IN_PLACE = tuple(flaw for flaw in IN_STEP if flaw != "positions")

MOST_CPU_S = 20.0
"""10 s on two cores."""

best = cache(ideal_db)


def check(found: Measured, apart_db: float) -> None:
    """What every rig must reach, and its views."""
    assert found.angle_deg < 0.08
    for spread in (found.rows, found.columns):
        assert spread.median is not None
        assert spread.p95 is not None
        assert spread.median < 0.3
        assert spread.p95 < 1.0
    assert found.views_db > found.ideal_db - apart_db


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 5])
def test_a_rough_rig_comes_within_1_db_of_the_ideal_one(seed: int) -> None:
    found = measure(seed, (2, 2), IN_PLACE, best((2, 2)))
    check(found, 1.0)
    assert found.cpu_s < MOST_CPU_S


@pytest.mark.slow
def test_a_rig_of_nine_comes_within_1_db_of_the_ideal_one() -> None:
    check(measure(1, (3, 3), IN_PLACE, best((3, 3))), 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 4])
def test_cameras_beside_their_places_cost_another_1_db_at_most(seed: int) -> None:
    check(measure(seed, (2, 2), IN_STEP, best((2, 2))), 2.0)


@pytest.mark.slow
def test_with_all_flaws_a_late_camera_is_put_in_step() -> None:
    check(measure(2, (2, 2), FLAWS, best((2, 2)), sync=True), 2.0)


@pytest.mark.slow
@pytest.mark.shared_data
@pytest.mark.skipif(not EUROC.is_dir(), reason="../shared/data is not here")
def test_a_real_pair_is_found_by_its_files_and_by_the_scene(tmp_path: Path) -> None:
    """Distances agree but for one factor: a scene does not say where infinity lies."""
    source = opened([EUROC / "cam0", EUROC / "cam1"], tmp_path)
    chosen = range(source.frame_count)
    by_file = calibrate_from_files(source, chosen, [EUROC / f"cam{n}_sensor.yaml" for n in (0, 1)])
    by_scene = calibrate_from_scene(source, chosen)
    for found, most_px in ((by_file, 0.3), (by_scene, 0.5)):
        median = rectified_residuals(found, source, [2, 14]).rows.median
        assert median is not None
        assert median < most_px
    _, ratio, alike, known = compared(by_file, by_scene, source, 12)
    assert alike < 0.02
    assert abs(ratio - 1) < 0.25
    assert known > 0.7
