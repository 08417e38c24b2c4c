"""Compiled code is kept where it can be, never outlives a change of what it calls, and compiling is told."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "mvcodec"
REPORT = (
    "from mvcodec.kernels import compiled_code\n"
    "compiled_code.on_first_compilation(lambda: print('compiling'))\n"
    "from mvcodec.kernels.caller import doubled\n"
    "print(doubled(21), compiled_code.folder())\n"
)
CALLER = (
    "from numba import njit\nfrom mvcodec.kernels.callee import factor\n\n\n"
    "@njit(cache=True)\ndef doubled(x):\n    return factor() * x\n"
)
CALLEE = "from numba import njit\n\n\n@njit(cache=True)\ndef factor():\n    return {}\n"


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A package of two small kernels, one of which calls the other, with the cache as it ships."""
    kernels = tmp_path / "site" / "mvcodec" / "kernels"
    kernels.mkdir(parents=True)
    (kernels.parent / "__init__.py").touch()
    for name in ("__init__.py", "compiled_code.py"):
        shutil.copy(PACKAGE / "kernels" / name, kernels)
    (kernels / "caller.py").write_text(CALLER)
    (kernels / "callee.py").write_text(CALLEE.format(2))
    return kernels


def run(installed: Path, program: str = REPORT, **environment: str) -> list[str]:
    """What it prints (whether it compiled, the result and the cache's folder), from a process of its own."""
    variables = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=variables | {"PYTHONPATH": str(installed.parents[1])} | environment,
        capture_output=True,
        text=True,
        check=True,
        cwd=installed,
    )
    return done.stdout.split()


def test_it_compiles_once_beside_the_sources(installed: Path) -> None:
    beside = str(installed / "__pycache__")
    assert run(installed) == ["compiling", "42", beside]
    assert run(installed) == ["42", beside]


def test_a_change_of_what_a_kernel_calls_is_seen(installed: Path) -> None:
    run(installed)
    # A file of another length: within one second Python itself sees no other change.
    (installed / "callee.py").write_text(CALLEE.format(13))
    assert run(installed)[:2] == ["compiling", "273"]


def test_the_folder_that_numba_is_told_holds(installed: Path, tmp_path: Path) -> None:
    told = tmp_path / "told"
    first, result, at = run(installed, NUMBA_CACHE_DIR=str(told))
    assert (first, result) == ("compiling", "42")
    assert Path(at).parent == told
    assert list(Path(at).glob("*.nbi"))
    assert not list(installed.glob("__pycache__/*.nbi"))


def test_where_nothing_can_be_written_beside_it_it_is_kept_for_the_user(
    installed: Path, tmp_path: Path
) -> None:
    (installed / "__pycache__").touch()  # a file in the folder's place, which not even root can write into
    home = tmp_path / "cache"
    environment = {"XDG_CACHE_HOME": str(home), "HOME": str(home), "PYTHONDONTWRITEBYTECODE": "1"}
    first, result, at = run(installed, **environment)
    assert (first, result) == ("compiling", "42")
    assert home in Path(at).parents
    assert run(installed, **environment) == ["42", at]


def test_without_sources_it_works_too(installed: Path) -> None:
    subprocess.run([sys.executable, "-m", "compileall", "-q", "-b", str(installed.parent)], check=True)
    for source in installed.parent.rglob("*.py"):
        source.unlink()
    assert run(installed)[:2] == ["compiling", "42"]
    assert run(installed)[0] == "42"


def test_nothing_else_of_numba_is_moved() -> None:
    from mvcodec.kernels.compiled_code import KernelCode

    def other() -> None: ...

    assert KernelCode.from_function(other, __file__) is None  # type: ignore[arg-type]


STATE = (
    "import sys\nfrom mvcodec.kernels.caller import doubled\n"
    "def state(): print(*(name in sys.modules for name in ('numba.np.arrayobj', 'scipy.linalg')))\n"
    "doubled(21)\nstate()\n"
    "from numba.np import arraymath, linalg\nprint(arraymath._HAVE_BLAS)\nlinalg.ensure_blas()\nstate()\n"
)


def test_what_compiling_needs_is_loaded_for_that_alone_and_scipy_for_other_programs_alone(
    installed: Path,
) -> None:
    pytest.importorskip("scipy")
    assert run(installed, STATE)[:2] == ["True", "False"]
    assert run(installed, STATE) == ["False", "False", "True", "True", "True"]


def test_a_kernel_can_be_compiled_behind_one_whose_code_was_kept(installed: Path) -> None:
    both = "from mvcodec.kernels.caller import doubled\nprint(doubled(21), doubled(1.5))\n"
    run(installed)
    assert run(installed, both) == ["42", "3.0"]
    (installed / "caller.py").write_text(CALLER.replace("* x", "* x + np.zeros(3).sum()"))
    (installed / "caller.py").write_text("import numpy as np\n" + (installed / "caller.py").read_text())
    assert run(installed, both) == ["42.0", "3.0"]
    assert run(installed, both) == ["42.0", "3.0"]
