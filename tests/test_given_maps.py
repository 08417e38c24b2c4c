"""Disparity and depth that the input has are coded in place of what matching finds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from command_line import fails, mvcodec

from mvcodec.capture import open_input
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import InputError
from mvcodec.frames import DisparityMap, FloatMap, Picture
from mvcodec.stereo.given import Given, whole_map

SIZE = (96, 64)
CALIBRATION = {"fx_px": 100, "fy_px": 100, "cx_px": 47.5, "cy_px": 31.5, "baseline_m": 0.05}


def scene() -> tuple[Picture, FloatMap]:
    """A bright square 9 px near before a dark slope of 2 to 4 px, for a baseline of one step."""
    width, height = SIZE
    disparity = np.repeat(np.linspace(2, 4, width, dtype=np.float32)[None], height, 0)
    noise = np.random.default_rng(2).integers(0, 12, (height, width, 1))
    picture = np.full((height, width, 3), 40, np.uint8)
    disparity[20:45, 30:61] = 9
    picture[20:45, 30:61] = 200
    return (picture + noise).astype(np.uint8), disparity


def folder(path: Path, fields: dict[str, Any], values: np.ndarray[Any, Any]) -> Path:
    """An array of 1 x 3 views, two frames, whose two outer cameras have maps."""
    path.mkdir(exist_ok=True)
    picture, _ = scene()
    for col in range(3):
        for frame in range(2):
            cv2.imwrite(str(path / f"c{col}_{frame}.png"), picture[..., ::-1])
            if col != 1:
                cv2.imwrite(str(path / f"m{col}_{frame}.png"), values)
    stated = {"rows": 1, "cols": 3, "fps": 10, "pattern": "c{col}_{frame}.png", "frames": 2}
    (path / "array.json").write_text(json.dumps(stated | {"calibration": CALIBRATION} | fields))
    return path


@pytest.mark.parametrize("kind", ["disparity", "depth"])
def test_given_maps_come_in_as_disparity_of_a_cell(tmp_path: Path, kind: str) -> None:
    _, disparity = scene()
    if kind == "disparity":
        stored, fields = (
            np.round(disparity * 256),
            {"pattern": "m{col}_{frame}.png", "scale": 256, "invalid": 0},
        )
    else:
        stored = np.round(1000 * 100 * 0.05 / disparity)
        fields = {"pattern": "m{col}_{frame}.png", "scale": 1000, "invalid": 0}
    stored[:10] = 0
    source = open_input([folder(tmp_path, {kind: fields}, stored.astype(np.uint16))])
    for item in source.frame_sets():
        found = item.given[0, 2]
        assert not found.valid[:10].any()
        assert found.valid[10:].all()
        tolerance = 0.01 if kind == "disparity" else 0.03
        np.testing.assert_allclose(found.values_px[10:], 2 * disparity[10:], atol=tolerance)
    with pytest.raises(InputError, match=r"m1_0\.png: found no such file"):
        next(open_input([tmp_path], real="all").frame_sets()).given[0, 1]


def test_holes_are_filled_up_to_the_edges_of_the_picture() -> None:
    picture, disparity = scene()
    chance = np.random.default_rng(3)
    known = chance.random(disparity.shape) < 0.1
    known[25:40, 26:34] = False
    found = whole_map(DisparityMap(np.where(known, disparity, np.float32(0)), known), picture)
    assert np.abs(found.values_px - disparity).mean() < 0.1
    assert (np.abs(found.values_px - disparity) > 1).mean() < 0.01, "the contour stays where it is"
    np.testing.assert_array_equal(found.valid, known)


@pytest.mark.parametrize("factor", [2, 3, 4])
def test_smaller_maps_are_enlarged_along_the_edges_of_the_picture(factor: int) -> None:
    picture, disparity = scene()
    width, height = SIZE
    rows, cols = (np.arange(side // factor) * factor + factor // 2 for side in (height, width))
    small = disparity[rows[:, None], cols]
    found = whole_map(DisparityMap(small, np.ones(small.shape, np.bool_)), picture)
    plain = cv2.resize(small, SIZE, interpolation=cv2.INTER_LINEAR)
    wrong, as_bilinear = ((np.abs(values - disparity) > 1).mean() for values in (found.values_px, plain))
    assert wrong < 0.01
    assert wrong < as_bilinear / 3
    inside = np.abs(found.values_px - disparity)[48:, :]
    assert inside.mean() < 0.1, "slopes are no stairs"


def test_whole_maps_stay_as_they_are() -> None:
    picture, disparity = scene()
    found = whole_map(DisparityMap(disparity, np.ones(disparity.shape, np.bool_)), picture)
    np.testing.assert_array_equal(found.values_px, disparity)


def test_the_command_codes_what_is_given(tmp_path: Path) -> None:
    _, disparity = scene()
    stored = np.round(disparity * 256).astype(np.uint16)
    fields = {"disparity": {"pattern": "m{col}_{frame}.png", "scale": 256, "invalid": 0}}
    array, out = folder(tmp_path / "a", fields, stored), tmp_path / "o.mcap"
    options = ["--disparity-scale", "1", "--disparity-qp", "10", "--disparity-cameras", "all"]
    done = mvcodec("encode", array, out, "--matcher", "given", *options)
    assert done.returncode == 0, done.stderr
    assert "same picture" in done.stderr  # as these views are made
    assert done.stderr.count("warning") == 1
    with Decoder.open(out) as decoder:
        for decoded in decoder:
            for found in decoded.disparities.values():
                assert np.median(np.abs(found.values_px - 2 * disparity)) < 0.1
    assert "--matcher given codes" in mvcodec("encode", array, out, "--matcher", "sgbm", "-y").stderr
    document = json.loads((array / "array.json").read_text())
    del document["disparity"]
    (array / "array.json").write_text(json.dumps(document))
    assert "no disparity or depth" in fails(1, "encode", array, out, "--matcher", "given", "-y")


def test_bad_given_maps_are_named(tmp_path: Path) -> None:
    pattern = {"pattern": "m{col}_{frame}.png"}
    values = np.full((64, 96), 9, np.uint16)
    for fields, complaint in (
        ({"disparity": pattern, "depth": pattern}, "both disparity and depth"),
        ({"depth": pattern, "calibration": None}, "found calibration = null|depth without calibration"),
        ({"disparity": {"pattern": "{camera}.png"}}, r"disparity\.pattern = .*no other fields than"),
        ({"disparity": pattern | {"steps": 0}}, r"disparity\.steps = 0"),
        ({"disparity": 5}, "disparity = 5"),
    ):
        path = folder(tmp_path, fields, values)
        with pytest.raises(InputError, match=complaint):
            open_input([path])
    path = folder(tmp_path, {"disparity": pattern}, np.full((64, 64), 9, np.uint16))
    with pytest.raises(InputError, match=r"m0_0\.png: found 64x64 px, expected 96x64 px as the pictures"):
        next(open_input([path]).frame_sets()).given[0, 0]
    with pytest.raises(InputError, match="pictures alone"):
        Given().match(open_input([path]).array, {}, (0.0, 1.0))
