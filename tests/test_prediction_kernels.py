"""Predicted pictures: kernels against their twins; the same bits on any processor, with any threads."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import prediction_twins as twins
import pytest
from coding import make_array
from hypothesis import given, settings
from hypothesis import strategies as st
from plane_scene import Plane, PlaneScene

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.kernels import prediction_colour, prediction_depth
from mvcodec.kernels.prediction_moves import UNKNOWN
from mvcodec.synthesis import prediction
from mvcodec.synthesis.prediction import PredictionSource, predict, predicted_disparity
from mvcodec.video.codec import Planes
from mvcodec.video.colour import to_planes
from mvcodec.video.past import MOST_SHARE, Past
from mvcodec.video.vp9_reference import checksum
from mvcodec.workers import threads

SEEDS, SIZES = st.integers(0, 2**32 - 1), st.tuples(st.integers(1, 12), st.integers(1, 40))
SHIFTS = st.tuples(st.integers(-(1 << 17), 1 << 17), st.integers(-(1 << 17), 1 << 17))


@settings(max_examples=40, deadline=None)
@given(SEEDS, SIZES)
def test_enlarging_is_its_twin(seed: int, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(seed)
    small = rng.integers(-300, 300, (-(-size[0] // 2), -(-size[1] // 2)), dtype=np.int32)
    luma = rng.integers(0, 256, size, dtype=np.uint8)
    found = np.empty(size, np.int32)
    prediction_depth.enlarge(small, luma, found)
    np.testing.assert_array_equal(found, twins.enlarge(small, luma, size))


@settings(max_examples=40, deadline=None)
@given(SEEDS, SIZES, SHIFTS)
def test_moving_is_its_twin(seed: int, size: tuple[int, int], shift: tuple[int, int]) -> None:
    values = np.random.default_rng(seed).integers(-200, 400, size, dtype=np.int32)
    margin = prediction_depth.MARGIN
    found = np.empty((size[0] + 2, size[1] + 2 * margin), np.int32)
    prediction_depth.splat(values, *shift, found)
    np.testing.assert_array_equal(found[1:-1, margin:-margin], twins.splat(values, *shift))


@settings(max_examples=40, deadline=None)
@given(SEEDS, SIZES, st.integers(1, 4))
def test_voting_and_filling_are_their_twins(seed: int, size: tuple[int, int], count: int) -> None:
    rng = np.random.default_rng(seed)
    moved = rng.integers(-200, 200, (count, *size), dtype=np.int32)
    moved[rng.random(moved.shape) < 0.5] = UNKNOWN
    weights = rng.integers(1, 5000, count)
    found = np.empty(size, np.float32)
    bordered = np.pad(moved, ((0, 0), (1, 1), (prediction_depth.MARGIN,) * 2))
    prediction_depth.vote(bordered, weights, found, 0, size[0])
    np.testing.assert_array_equal(found, twins.vote(moved, weights))
    filled = np.empty(size, np.int32)
    prediction_depth.fill(found, -77, filled, 0, size[0])
    np.testing.assert_array_equal(filled, twins.fill(found.astype(np.int32), -77))


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.tuples(st.integers(1, 3), st.integers(1, 25)), st.integers(1, 3), st.sampled_from([1, 40]))
def test_fetching_is_its_twin(seed: int, half: tuple[int, int], count: int, coarse: int) -> None:
    rng = np.random.default_rng(seed)
    height, width = 2 * half[0], 2 * half[1]
    # Of wide surfaces, or of pixels that have nothing to do with each other.
    values = rng.choice([-90, 0, 64, 130, 500], (count + 1, height, -(-width // coarse)))
    *maps, disparity = values.repeat(coarse, axis=2)[:, :, :width].astype(np.int32)
    shifts = rng.integers(-70000, 70000, (count, 2)).astype(np.int32) * rng.integers(
        0, 2, (count, 2), np.int32
    )
    weights = rng.integers(1, 5000, count)
    luma = rng.integers(0, 256, (count, height, width), dtype=np.uint8)
    chroma = rng.integers(0, 256, (2, count, *half), dtype=np.uint8)
    planes = [Planes(luma[i], chroma[0, i], chroma[1, i]) for i in range(count)]
    ready = [PredictionSource((0, i), planes[i], maps[i]).ready for i in range(count)]
    y, uv = np.empty((height, width), np.uint8), np.empty((2, *half), np.uint8)
    cameras = prediction.addresses(ready)
    prediction_colour.predict(cameras, shifts, weights, np.ascontiguousarray(disparity), y, uv, 0, half[0])
    common = np.array(maps), shifts.astype(np.int64), weights
    bordered = [np.pad(each, ((0, 0), (2, 2), (2, 2)), mode="edge") for each in (luma, *chroma)]
    np.testing.assert_array_equal(y, twins.predict(bordered[0], *common, twins.CUBIC, disparity, 1))
    for plane in (0, 1):
        expected = twins.predict(bordered[1 + plane], *common, twins.LINEAR, disparity, 2)
        np.testing.assert_array_equal(uv[plane], expected)


def test_the_taps_are_the_formats() -> None:
    assert twins.CUBIC.sum(axis=1).tolist() == [128] * 16
    assert twins.CUBIC[[0, 4, 8, 12]].tolist() == [
        [0, 128, 0, 0],
        [-13, 112, 33, -4],
        [-11, 75, 75, -11],
        [-4, 33, 112, -13],
    ]
    assert twins.LINEAR[5].tolist() == [88, 40]


def scene_sources(array: CameraArray) -> tuple[PlaneScene, list[PredictionSource]]:
    scene = PlaneScene(array, 4, (Plane(8, (24, 40, 60, 80)), Plane(12, (10, 84, 40, 100))))
    sources = []
    for camera in array.real:
        picture, values = scene.render(Viewpoint(*camera))
        fine = np.rint(64 * values).astype(np.int32)
        sources.append(PredictionSource(camera, to_planes(picture), fine))
    return scene, sources


def predicted() -> tuple[Planes, ...]:
    """A view in the middle, a camera from the three others, and the view with a share of its past."""
    array = CameraArray(3, 3, 128, 80, 10.0, (0, 2), (0, 2), make_array(128, 80).calibration)
    scene, sources = scene_sources(array)
    maps = {source.place: source.disparity for source in sources}
    middle = predicted_disparity(array, maps, (1, 1), (0.0, 16.0))
    found = predict(array, sources, (1, 1), middle)
    corner = predict(array, sources[:3], (2, 2), sources[3].disparity)
    expected = to_planes(scene.render(Viewpoint(1, 1))[0])
    assert np.abs(found.y.astype(int) - expected.y).mean() < 1
    unlike = np.abs(corner.y.astype(int) - sources[3].planes.y) > 2
    assert unlike.mean() < 0.25
    before = Planes(*(np.roll(plane, (1, 2), (0, 1)) for plane in (found.y, found.u, found.v)))
    return found, corner, Past(found, before).blended(MOST_SHARE)


def test_planes_are_predicted_where_cameras_see_them_whatever_the_threads() -> None:
    found = []
    for count in (1, 2, 5):
        with threads(count):
            found.append(checksum(predicted()))
    assert len(set(found)) == 1


PROGRAM = """
import sys
sys.path.insert(0, {tests!r})
from test_prediction_kernels import checksum, predicted
print(checksum(predicted()))
"""


@pytest.mark.slow
@pytest.mark.parametrize("features", ["", "+sse2,+sse4.2", "+avx2,+fma"])
def test_the_bits_are_the_same_on_other_processors(features: str, tmp_path: Path) -> None:
    """Numba compiles for a processor that has other instructions, OpenCV runs without any of its own."""
    environment = {
        **os.environ,
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CPU_FEATURES": features,
        "NUMBA_CACHE_DIR": str(tmp_path),
        "OPENCV_CPU_DISABLE": "AVX2,AVX,SSE4.2,SSE4.1,SSSE3,FP16",
    }
    program = PROGRAM.format(tests=str(Path(__file__).parent))
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert int(done.stdout) == checksum(predicted())
