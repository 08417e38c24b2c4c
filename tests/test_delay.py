"""A camera of a rig that is late is told, and `--sync motion` puts it in step."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import mvcodec

from mvcodec.array import Position
from mvcodec.capture import open_input
from mvcodec.capture.timing import Timing
from mvcodec.frames import Picture
from mvcodec.rigs.delay import Delay, find_delays

SIZE = (240, 160)
FRAMES = 16
CAMERAS = [(row, col) for row in (0, 1) for col in (0, 1)]
LAYERS = [((0, 0, 260, 180), 4), ((20, 20, 70, 50), 8), ((140, 80, 80, 60), 11)]
"""Rectangles (x, y, width, height) of texture, px, and their disparity of a step."""


def texture(seed: int, width: int, height: int) -> Picture:
    noise = np.random.default_rng(seed).integers(0, 256, (height // 4 + 2, width // 4 + 2, 3), np.uint8)
    large = cv2.resize(noise, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC)
    return np.asarray(large[:height, :width], np.uint8)


def picture(camera: Position, frame: int, *, moving: bool) -> Picture:
    """Layers of texture, and a bright and a dark sheet before them that go their unsteady ways."""
    row, col = camera
    seen = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    for number, ((left_px, top_px, width, height), step) in enumerate(LAYERS):
        x, y = left_px - col * step, top_px - row * step
        sheet = texture(number, width, height)
        top, left = max(y, 0), max(x, 0)
        part = sheet[top - y : SIZE[1] - y, left - x : SIZE[0] - x]
        seen[top : top + part.shape[0], left : left + part.shape[1]] = part
    if moving:
        walk = np.random.default_rng(9).integers(-14, 15, (FRAMES + 1, 4)).cumsum(axis=0)[frame + 1]
        for start, gone, level in ((np.array([60, 100]), walk[:2], 250), (np.array([170, 45]), walk[2:], 10)):
            x, y = start + gone
            at = int(x - col * 9), int(y - row * 9)
            cv2.rectangle(seen, at, (at[0] + 40, at[1] + 30), (level, level, level), -1)
    return seen


def rig(folder: Path, late: Position | None, *, moving: bool = True) -> Path:
    """An array folder, one camera of which shows the frame before."""
    for camera in CAMERAS:
        for frame in range(FRAMES):
            shown = picture(camera, frame - (camera == late), moving=moving)
            path = folder / f"r{camera[0]:02d}_c{camera[1]:02d}" / f"{frame:04d}.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(path), shown[..., ::-1])
    text = {
        "rows": 2,
        "cols": 2,
        "fps": 25,
        "frames": FRAMES,
        "pattern": "r{row:02d}_c{col:02d}/{frame:04d}.png",
    }
    (folder / "array.json").write_text(json.dumps(text))
    return folder


def delays(folder: Path, timing: Timing | None = None) -> list[Delay]:
    source = open_input([folder], real="all", timing=timing)
    return find_delays(source, range(source.frame_count))


@pytest.mark.parametrize("late", CAMERAS)
def test_a_late_camera_is_found_whichever_it_is(tmp_path: Path, late: Position) -> None:
    assert delays(rig(tmp_path, late)) == [Delay(late, 1, -40.0)]


def test_cameras_in_step_and_a_scene_that_stands_still_are_no_alarm(tmp_path: Path) -> None:
    assert delays(rig(tmp_path / "in_step", None)) == []
    assert delays(rig(tmp_path / "still", (1, 0), moving=False)) == []


def rectify(*arguments: Path | str) -> str:
    """What the command says on standard error."""
    done = mvcodec("rectify", *arguments)
    assert done.returncode == 0, done.stderr
    return done.stderr


def test_rectify_tells_a_late_camera_and_what_it_says_mends_it(tmp_path: Path) -> None:
    rough = rig(tmp_path / "rough", (0, 1))
    told = rectify(rough, tmp_path / "rig.json", "--quiet")
    assert "camera r00_c01 is one frame late against the others" in told
    assert "--sync motion" in told
    assert "--offset r00_c01=-40.0" in told
    straight = tmp_path / "straight"
    assert "late against" not in rectify(rough, straight, "--quiet", "--sync", "motion")
    assert delays(straight) == []
    assert open_input([straight], real="all").frame_count == FRAMES - 1
    assert delays(rough, Timing(offsets_ms={"r00_c01": -40.0})) == []
