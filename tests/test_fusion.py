"""Fusion of what several partners say about one camera."""

from __future__ import annotations

import numpy as np
import pytest

from mvcodec.frames import DisparityMap
from mvcodec.stereo.fusion import fuse, row_texture


def one_pixel(value: float, valid: bool = True) -> DisparityMap:
    return DisparityMap(np.full((1, 1), value, np.float32), np.full((1, 1), valid))


def weight(value: float) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    return np.full((1, 1), value, np.float32)


@pytest.mark.parametrize(
    ("candidates", "value", "valid"),
    [
        ([(4.0, True), (4.5, True)], 4.25, True),  # agree: averaged
        ([(4.0, True), (9.0, False)], 4.0, True),  # the consistent one, nearer or farther
        ([(4.0, False), (9.0, True)], 9.0, True),
        ([(4.0, True), (9.0, True)], 4.0, True),  # both consistent, disagree: the farther
        ([(4.0, False), (9.0, False)], 4.0, False),  # none consistent: the farther
        ([(-9.0, True), (-4.0, True)], -9.0, True),
        ([(4.0, True), (9.0, True), (9.5, True)], 9.25, True),  # the larger group
        ([(1.0, True), (9.0, True), (9.5, True), (9.25, True)], 9.25, True),
        ([(1.0, True), (1.5, True), (9.0, True), (9.5, True)], 1.25, True),  # equal groups: the farther
        ([(7.0, True), (1.0, False), (1.0, False), (1.0, False)], 7.0, True),
    ],
)
def test_pixel(candidates: list[tuple[float, bool]], value: float, valid: bool) -> None:
    for order in (1, -1):
        fused = fuse([one_pixel(*candidate) for candidate in candidates[::order]])
        assert fused.values_px.item() == pytest.approx(value)
        assert fused.valid.item() is valid


def test_weights_decide_between_disagreeing_partners() -> None:
    maps = [one_pixel(4.0), one_pixel(9.0)]
    assert fuse(maps, [weight(1), weight(3)]).values_px.item() == 9.0
    assert fuse(maps, [weight(3), weight(1)]).values_px.item() == 4.0


def test_weights_average_agreeing_partners() -> None:
    fused = fuse([one_pixel(4.0), one_pixel(4.8)], [weight(3), weight(1)])
    assert fused.values_px.item() == pytest.approx(4.2)


def test_equals_its_plain_twin() -> None:
    rng = np.random.default_rng(3)
    shape = 9, 17
    maps = [
        DisparityMap(rng.uniform(0, 4, shape).astype(np.float32), rng.uniform(size=shape) < 0.6)
        for _ in range(4)
    ]
    weights = [rng.uniform(1, 5, shape).astype(np.float32) for _ in maps]
    fused = fuse(maps, weights)
    values = np.stack([candidate.values_px for candidate in maps]).astype(np.float64)
    valid = np.stack([candidate.valid for candidate in maps])
    votes = np.stack(weights) * valid
    near = np.abs(values[:, None] - values[None]) <= 1  # [i, j]: j agrees with i
    group = (near * votes[None]).sum(axis=1)
    mean = (near * (votes * values)[None]).sum(axis=1) / np.maximum(group, 1e-9)
    best = np.where(valid, group, -1).argmax(axis=0)[None]
    expected = np.where(valid.any(axis=0), np.take_along_axis(mean, best, axis=0)[0], values.min(axis=0))
    assert (fused.valid == valid.any(axis=0)).all()
    np.testing.assert_allclose(fused.values_px, expected, atol=1e-5)


def test_one_candidate_stays_as_it_is() -> None:
    only = one_pixel(3.0, valid=False)
    assert fuse([only]) is only


def test_refuses_nothing_and_uneven_weights() -> None:
    with pytest.raises(ValueError, match="found 0 maps"):
        fuse([])
    with pytest.raises(ValueError, match="found 2 maps and 1 weights"):
        fuse([one_pixel(1), one_pixel(1)], [weight(1)])


def test_row_texture_sees_only_what_varies_along_the_row() -> None:
    ramp = np.repeat(np.arange(0, 200, 10, dtype=np.uint8)[None], 20, axis=0)
    along = np.repeat(ramp[..., None], 3, axis=2)
    across = np.ascontiguousarray(along.transpose(1, 0, 2))
    inside = np.s_[2:-2, 2:-2]
    np.testing.assert_allclose(row_texture(along)[inside], np.hypot(20, 2), rtol=1e-5)
    np.testing.assert_allclose(row_texture(across)[inside], 2)
