"""A prediction with a share of the track's past: its twin, what it saves, and files without."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import past_twins as twins
import pytest
from coding import make_array
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from small_arrays import photograph

from mvcodec.array import CameraArray
from mvcodec.enhancement import EnhancedView, EnhancementHeader
from mvcodec.stream import PredictedCamera, StreamHeader
from mvcodec.video import past
from mvcodec.video.bits import NalError
from mvcodec.video.codec import Planes
from mvcodec.video.colour import to_planes
from mvcodec.video.past import MOST_SHARE, Past, best_share
from mvcodec.video.vp9_reference import (
    ReferenceSettings,
    ReferenceUnit,
    Vp9ReferenceDecoder,
    Vp9ReferenceEncoder,
    checksum,
)
from mvcodec.workers import threads

SEEDS = st.integers(0, 2**32 - 1)


def random_planes(seed: int, half: tuple[int, int], step: tuple[int, int]) -> tuple[Planes, Planes]:
    """A picture of soft shapes, and one where it has moved by a step, each with noise of its own."""
    rng = np.random.default_rng(seed)
    height, width = 2 * half[0], 2 * half[1]
    coarse = rng.integers(0, 256, (height // 4 + 20, width // 4 + 20))
    soft = coarse.repeat(4, axis=0).repeat(4, axis=1)
    contrast = rng.choice([1, 8, 256])

    def cut(y: int, x: int, tall: int, wide: int) -> NDArray[np.uint8]:
        part = soft[32 + y : 32 + y + tall, 32 + x : 32 + x + wide] // contrast
        return np.asarray(np.clip(part + rng.integers(0, 4, part.shape), 0, 255), np.uint8)

    found = []
    for y, x in ((0, 0), step):
        found.append(Planes(cut(y, x, height, width), *(cut(y // 2, x // 2, *half) for _ in range(2))))
    return found[0], found[1]


@settings(max_examples=20, deadline=None)
@given(
    SEEDS,
    st.tuples(st.integers(1, 20), st.integers(1, 20)),
    st.tuples(st.integers(-26, 26), st.integers(-26, 26)),
    st.integers(1, MOST_SHARE),
)
def test_blending_is_its_twin(seed: int, half: tuple[int, int], step: tuple[int, int], share: int) -> None:
    prediction, before = random_planes(seed, half, step)
    found = Past(prediction, before).blended(share)
    now, then = ([each.y, each.u, each.v] for each in (prediction, before))
    expected = twins.blended(now, then, share)
    for plane, twin in zip((found.y, found.u, found.v), expected, strict=True):
        np.testing.assert_array_equal(plane, twin)


def moving(index: int) -> Planes:
    top, left = 40 + index, 60 + 3 * index
    return to_planes(photograph("coffee")[top : top + 96, left : left + 128])


def missed_some(planes: Planes, seed: int) -> Planes:
    """The picture as a synthesis may guess it: with soft errors of its own in each frame."""
    errors = np.random.default_rng(seed).normal(0, 9, (planes.y.shape[0] // 2, planes.y.shape[1] // 2))
    y = planes.y + errors.repeat(2, axis=0).repeat(2, axis=1)
    return Planes(np.clip(y, 0, 255).astype(np.uint8), planes.u, planes.v)


def error(planes: Planes, index: int) -> float:
    return float(((planes.y.astype(float) - moving(index).y) ** 2).mean())


def test_what_moves_is_found_and_predicted_better_whatever_the_threads() -> None:
    guess, sums = missed_some(moving(1), 1), set()
    for count in (1, 2, 5):
        with threads(count):
            found = Past(guess, moving(0)).blended(MOST_SHARE)
            sums.add(checksum([found]))
    assert len(sums) == 1
    assert error(found, 1) < 0.6 * error(guess, 1)
    share, best = best_share(guess, missed_some(moving(0), 2), moving(1))
    assert share > 0
    assert error(best, 1) < error(guess, 1)


def test_what_stands_or_is_another_picture_has_no_share() -> None:
    guess = missed_some(moving(1), 1)
    noise = np.random.default_rng(0).integers(0, 256, (96, 128), dtype=np.uint8)
    for other in (moving(1), Planes(noise, guess.u, guess.v)):
        found = Past(guess, other).blended(1)
        assert np.mean(found.y != guess.y) < 0.1
    assert best_share(guess, other, moving(1))[0] == 0


def units(shares: bool, monkeypatch: pytest.MonkeyPatch) -> list[bytes]:
    if not shares:
        monkeypatch.setattr(past, "MOST_SHARE", 0)
    encoder = Vp9ReferenceEncoder(ReferenceSettings(128, 96, 40))
    found = [encoder.push(moving(i), [missed_some(moving(i), i)], i % 4 == 0) for i in range(6)]
    monkeypatch.undo()
    return found


def decoded(coded: list[bytes]) -> list[Planes]:
    decoder = Vp9ReferenceDecoder((128, 96))
    return [
        decoder.push(unit, [missed_some(moving(i), i)], i % 4 == 0, f"unit {i}")
        for i, unit in enumerate(coded)
    ]


def test_units_with_a_share_are_smaller_and_those_without_decode(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, shared = units(False, monkeypatch), units(True, monkeypatch)
    said = [[ReferenceUnit.parse(unit).share for unit in each] for each in (plain, shared)]
    assert said[0] == [0] * 6
    assert said[1][0] == said[1][4] == 0
    assert min(said[1][i] for i in (1, 2, 3, 5)) > 0
    sizes = [sum(map(len, each)) for each in (plain, shared)]
    errors = [np.mean([error(p, i) for i, p in enumerate(decoded(each))]) for each in (plain, shared)]
    assert sizes[1] < 0.95 * sizes[0]
    assert errors[1] < 1.1 * errors[0]


def test_the_encoder_has_what_the_decoder_has() -> None:
    encoder = Vp9ReferenceEncoder(ReferenceSettings(128, 96, 30))
    decoder = Vp9ReferenceDecoder((128, 96))
    for i in range(3):
        prediction = [missed_some(moving(i), i)]
        unit = encoder.push(moving(i), prediction, i == 0)
        assert checksum([encoder.decoded]) == checksum([decoder.push(unit, prediction, i == 0, "unit")])


def test_a_share_that_cannot_be_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    coded = [ReferenceUnit.parse(unit) for unit in units(True, monkeypatch)]
    for unit, share in ((coded[0], 1), (coded[1], MOST_SHARE + 1)):
        with pytest.raises(NalError, match=f"share {share} of the past"):
            ReferenceUnit.parse(replace(unit, share=share).to_bytes())


@pytest.mark.parametrize("predictor", ["warp-1", "warp-2"])
def test_headers_keep_the_name_of_the_prediction(predictor: str) -> None:
    array = CameraArray(1, 3, 64, 48, 10.0, (0,), (0, 2), make_array(64, 48).calibration)
    first, second = array.real
    header = StreamHeader(
        array, (0.0, 8.0), predicted=(PredictedCamera(second, (first,)),), predictor=predictor
    )
    assert StreamHeader.from_json(header.to_json()) == header
    layer = EnhancementHeader((EnhancedView((0, 1), (first,)),), {}, predictor=predictor)
    assert EnhancementHeader.from_json(layer.to_json(), header, "layer") == layer
