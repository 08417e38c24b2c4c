"""`import mvcodec`: what is public, and that nothing is loaded before it is used."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import mvcodec
import mvcodec.errors
from mvcodec.errors import MvCodecError, MvCodecWarning

SOURCE = Path(mvcodec.__file__)


def imported_for_type_checkers() -> dict[str, str]:
    """Public name -> module, from the imports that only type checkers read."""
    (block,) = (node for node in ast.parse(SOURCE.read_text()).body if isinstance(node, ast.If))
    return {
        name.name: str(node.module)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for name in node.names
    }


def test_type_checkers_see_what_is_loaded() -> None:
    assert imported_for_type_checkers() == mvcodec._HOMES
    assert set(mvcodec.__all__) == {*mvcodec._HOMES, "__version__"}


@pytest.mark.parametrize("name", mvcodec.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(mvcodec, name) is not None
    assert name in dir(mvcodec)


def test_every_error_is_public() -> None:
    kinds = [kind for kind in vars(mvcodec.errors).values() if isinstance(kind, type)]
    errors = {kind.__name__ for kind in kinds if issubclass(kind, (MvCodecError, MvCodecWarning))}
    assert errors <= set(mvcodec.__all__)


def test_a_name_that_is_not_there_is_told() -> None:
    with pytest.raises(AttributeError, match="module 'mvcodec' has no attribute 'Nonsense'"):
        mvcodec.Nonsense  # noqa: B018


def test_importing_loads_nothing_else() -> None:
    program = "import sys; before = set(sys.modules); import mvcodec; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert loaded - sys.stdlib_module_names == {"mvcodec"}
    assert "dataclasses" not in loaded
