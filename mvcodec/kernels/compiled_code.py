"""Where compiled kernels are kept between runs, and when kept ones are out of date."""

from __future__ import annotations

import hashlib
import importlib
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import FunctionType
from typing import Any

from numba import config
from numba.core import event
from numba.core.caching import Cache, CacheImpl
from numba.core.cpu import CPUContext
from numba.core.runtime.nrt import rtsys
from numba.misc.appdirs import AppDirs

PACKAGE = "mvcodec.kernels"
COMPILING = "numba:compile"
"""Numba's name for what happens where no compiled code is kept."""


class KernelCode:
    """Numba's locator of a kernel's compiled code (it calls what stands here).

    Numba by itself compares kept code with the function's own file; what that calls from another file would
    stay as it was. Here any change of any kernel makes all kept code stale, and nothing needs to be deleted.
    """

    def __init__(self, function: FunctionType) -> None:
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, function: FunctionType, _source: str) -> KernelCode | None:
        """The locator of a kernel; None for other programs' functions."""
        return cls(function) if function.__module__.startswith(f"{PACKAGE}.") else None

    def get_cache_path(self) -> str:
        """The folder."""
        return str(folder())

    def ensure_cache_path(self) -> None:
        """The folder is there and can be written."""
        folder()

    def get_source_stamp(self) -> str:
        """What must be the same for kept code to be used."""
        return digest()

    def get_disambiguator(self) -> str:
        """Tells functions of one name in one file apart."""
        return str(self._line)


@cache
def digest() -> str:
    """Of all kernels' sources, or of their byte code where no sources were installed."""
    found = hashlib.sha256()
    for item in sorted(files(PACKAGE).iterdir(), key=lambda item: item.name):
        if item.name.endswith((".py", ".pyc")):
            found.update(item.name.encode() + b"\0" + item.read_bytes())
    return found.hexdigest()


@cache
def folder() -> Path:
    """The first that can be written of NUMBA_CACHE_DIR, beside the sources, the user's; or a passing one."""
    return next(filter(_is_writable, _folders()), None) or Path(_for_this_process().name)


def _folders() -> Iterator[Path]:
    home = Path(__file__).resolve().parent
    shared_name = f"mvcodec_kernels_{hashlib.sha256(str(home).encode()).hexdigest()[:16]}"
    told = getattr(config, "CACHE_DIR", "")  # Numba sets it as it reads its environment
    if told:
        yield Path(told) / shared_name
    if home.is_dir():  # else within an archive
        yield home / "__pycache__"
    yield Path(AppDirs(appname="numba", appauthor=False).user_cache_dir) / shared_name


@cache
def _for_this_process() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="mvcodec_kernels_")


def _is_writable(path: Path) -> bool:
    try:
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
    except OSError:
        return False
    return True


class _BeforeCompiling(event.Listener):
    """Loads Numba's linear algebra, which no kernel needs, without SciPy, which takes a third of a second.

    Numba asks whether SciPy is there as it loads, and again whenever something needs it: only the first is
    left out, so that other programs' functions find it.
    """

    def on_start(self, _event: Any) -> None:
        from numba.np import linalg

        asks, linalg.ensure_blas = linalg.ensure_blas, lambda: None
        try:
            importlib.import_module("numba.np.arraymath")
        finally:
            linalg.ensure_blas = asks

    def on_end(self, _event: Any) -> None:
        pass


def _load_overload(cache: Cache, signature: Any, context: CPUContext) -> Any:
    """Load a function's kept code; a kernel's without all that Numba knows for compiling.

    That takes several times as long to load, and Numba goes through it again for each function. Where code
    has to be compiled, it is loaded then.
    """
    if not isinstance(cache._impl.locator, KernelCode):
        return _load_any_overload(cache, signature, context)
    rtsys.initialize(context)  # memory of kernels' own arrays
    with cache._guard_against_spurious_io_errors():
        return cache._load_overload(signature, context)


_load_any_overload = Cache.load_overload


def keep_compiled_code() -> None:
    """Have Numba keep kernels' compiled code where `KernelCode` says, and load no more than that of it."""
    CacheImpl._locator_classes.insert(0, KernelCode)  # type: ignore[arg-type]
    Cache.load_overload = _load_overload  # type: ignore[method-assign]
    event.register(COMPILING, _BeforeCompiling())


class _Once(event.Listener):
    def __init__(self, tell: Callable[[], object]) -> None:
        self._tell: Callable[[], object] | None = tell

    def on_start(self, _event: Any) -> None:
        tell, self._tell = self._tell, None
        if tell is not None:
            tell()

    def on_end(self, _event: Any) -> None:
        pass


def on_first_compilation(tell: Callable[[], object]) -> None:
    """Call `tell` when something has to be compiled, once; not where kept code is used."""
    event.register(COMPILING, _Once(tell))
