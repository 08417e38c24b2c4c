"""What fuzzing found worth keeping is read without a crash; and so is whatever Hypothesis thinks of."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest
from fuzz_targets import CORPUS, TARGETS, seeds
from hypothesis import given, settings
from hypothesis import strategies as st


@pytest.mark.parametrize("target", TARGETS)
def test_the_kept_corpus_is_read_without_a_crash(target: str) -> None:
    kept: list[Path] = sorted((CORPUS / target).iterdir())
    assert len(kept) >= 10
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for path in kept:
            TARGETS[target](path.read_bytes())


@pytest.mark.parametrize("target", TARGETS)
@settings(max_examples=40, deadline=None, derandomize=True)
@given(data=st.data())
def test_changed_input_is_read_without_a_crash(target: str, data: st.DataObject) -> None:
    """Undamaged input with pieces replaced, left out or put in."""
    content = bytearray(data.draw(st.sampled_from(list(seeds(target)))))
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        gone = data.draw(st.integers(0, 12))
        content[start : start + gone] = data.draw(st.binary(max_size=12))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        TARGETS[target](bytes(content))
