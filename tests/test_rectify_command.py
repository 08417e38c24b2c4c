"""From ordinary cameras to an array and to a file, by the commands, as a user types them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from command_line import mvcodec

from mvcodec import open as open_video
from mvcodec.array import CameraArray, Viewpoint
from mvcodec.capture import open_input
from mvcodec.output.pictures import write_png
from mvcodec.rigs.look import look_at
from mvcodec.scenes.rough_rig import RoughRigSettings, RoughScene
from mvcodec.scenes.scene import SceneSettings

FLAWS = ("angles", "focal", "distortion", "gain")


@pytest.fixture(scope="module")
def cameras(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The picture files of two cameras beside each other."""
    scene = RoughScene.of(SceneSettings((1, 2), 1, (320, 180)), RoughRigSettings(1, FLAWS))
    folder = tmp_path_factory.mktemp("rough")
    paths = []
    for at in scene.array.positions:
        paths.append(folder / f"camera{at[1]}.png")
        write_png(paths[-1], scene.render(Viewpoint(*at), 0)[0])
    return paths


def looks_right(array: CameraArray, folder: Path) -> bool:
    (first,) = open_input([folder], real="all").frame_sets(slice(1))
    return look_at(array, first.pictures) == []


def test_cameras_become_an_array_and_a_report(cameras: list[Path], tmp_path: Path) -> None:
    straight, report = tmp_path / "straight", tmp_path / "rig.html"
    done = mvcodec("rectify", *cameras, straight, "--grid", "1x2", "--report", report)
    assert done.returncode == 0, done.stderr
    assert looks_right(open_input([straight], real="all").array, straight)
    assert (straight / "rig.json").is_file()
    page = report.read_text()
    assert page.count("<img") >= 2
    # Matches that could not be made finer are no sign of cameras out of step.
    (share,) = re.findall(r"observations \((\d+)%\) were left out", page)
    assert int(share) < 5


def test_encode_rectifies_while_it_codes_and_says_what_it_does_not_know(
    cameras: list[Path], tmp_path: Path
) -> None:
    coded = tmp_path / "rig.mcap"
    done = mvcodec("encode", *cameras, coded, "--grid", "1x2", "--rig", "auto", "--speed", "realtime")
    assert done.returncode == 0, done.stderr
    assert "does not say how far its cameras stand apart" in done.stderr
    assert "nominal values" not in done.stderr
    assert "mends that" not in done.stderr
    with open_video(coded) as video:
        array = video.array
        assert look_at(array, dict(video[0].pictures)) == []
    assert array.width <= 320
    assert array.calibration.fx_px != 320
