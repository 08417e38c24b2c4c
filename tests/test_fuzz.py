"""What fuzzing found worth keeping is read without a crash; and so is whatever Hypothesis thinks of."""

from __future__ import annotations

import re
import subprocess
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path

import pytest
from fuzz_targets import CORPUS, TARGETS, seeds
from hypothesis import given, settings
from hypothesis import strategies as st

SECONDS = 6
"""Of each target: half a minute in all. `make fuzz` takes its time."""


@pytest.mark.skipif(find_spec("atheris") is None, reason="no atheris for this system and Python")
@pytest.mark.parametrize("target", TARGETS)
def test_fuzzing_from_the_kept_corpus_finds_nothing(target: str, tmp_path: Path) -> None:
    tool = Path(__file__).parents[1] / "tools" / "fuzz.py"
    # Linux counts the memory of who called exec towards a process's peak, which the fuzzer has a limit for:
    # a shell in between keeps this process's out of it.
    shell = ("sh", "-c", '"$0" "$@"; exit $?')
    command = [*shell, sys.executable, str(tool), target, "--seconds", str(SECONDS)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    finds = {path.name: path.read_bytes().hex() for path in (tmp_path / "fuzz-finds").iterdir()}
    assert (done.returncode, finds) == (0, {}), done.stderr[-4000:]
    runs = re.search(r"number_of_executed_units: (\d+)", done.stderr)
    covered = re.search(r"INITED cov: (\d+)", done.stderr)
    assert runs is not None
    assert int(runs[1]) > 2 * len(list((CORPUS / target).iterdir())), "more than the corpus once"
    assert covered is not None, "coverage guides it"
    assert int(covered[1]) > 50


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
