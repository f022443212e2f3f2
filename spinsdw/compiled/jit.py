"""The one decorator for compiled functions, numba's options, and where machine code is cached.

Why a cache of our own: numba's in-tree cache knows one source file, while a function here inlines
helpers from its neighbours; a half-written or unreadable cache file makes numba raise at the first
call; and a read-only home makes it raise at import. `PackageCache` stamps every entry with the
content of the whole folder and treats anything it cannot read or write as "not cached".
"""

from __future__ import annotations

import functools
import hashlib
import os
import pickle
import stat
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import caching, config
from numba.core.dispatcher import Dispatcher

__all__ = ["cache_directory", "kernel", "reduction_kernel"]

Function = TypeVar("Function", bound=Callable[..., Any])

# "nnan" and "ninf" are left out: with them a NaN in a map could turn into a plausible number.
_FAST = {"contract", "nsz", "arcp"}
_FOLDER = Path(__file__).resolve().parent


def cache_directory() -> Path | None:
    """Return the folder for machine code, or None where caching is off or nothing is writable.

    ``SPINSDW_CACHE`` names a folder, or switches caching off with ``0``; otherwise it is
    ``spinsdw`` below ``XDG_CACHE_HOME`` or ``~/.cache``.
    """
    setting = os.environ.get("SPINSDW_CACHE", "")
    if setting == "0":
        return None
    if setting:
        base = Path(setting)
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "spinsdw"
    folder = base / f"numba-{numba.__version__}-python-{sys.version_info[0]}{sys.version_info[1]}"
    return folder if _is_ours(folder) else None


def _is_ours(folder: Path) -> bool:
    """Create the folder; refuse one that another user could write code into."""
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        status = folder.stat()
    except OSError:
        return False
    writable_by_others = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    mine = not hasattr(os, "getuid") or status.st_uid == os.getuid()
    return mine and not writable_by_others and os.access(folder, os.W_OK)


@functools.cache
def _source_stamp() -> str:
    """Hash every file of this folder: a change in one invalidates all that may inline it."""
    digest = hashlib.sha256()
    for path in sorted(_FOLDER.glob("*.py")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    # The vector width is chosen at run time and compiled in.
    digest.update(os.environ.get("SPINSDW_VECTOR_WIDTH", "").encode())
    return digest.hexdigest()


class _Locator(caching._CacheLocator):
    """Tell numba where this package's machine code goes and when it is stale."""

    def __init__(self, py_file: str, line: int, folder: Path) -> None:
        self._py_file = py_file
        self._line = line
        self._folder = folder

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return _source_stamp()

    def get_disambiguator(self) -> str:
        return str(self._line)


class _Implementation(caching.CompileResultCacheImpl):
    """`CompileResultCacheImpl` with the locator above in place of numba's search."""

    def __init__(self, py_func: Callable[..., Any], folder: Path) -> None:
        code = py_func.__code__
        self._lineno = code.co_firstlineno
        self._locator = _Locator(code.co_filename, self._lineno, folder)
        name = f"{Path(code.co_filename).stem}.{py_func.__qualname__}"
        self._filename_base = self.get_filename_base(name, getattr(sys, "abiflags", ""))


class PackageCache(caching.FunctionCache):
    """Numba's function cache that never fails: what cannot be read is compiled again."""

    def __init__(self, py_func: Callable[..., Any], folder: Path) -> None:
        self._name = repr(py_func)
        self._py_func = py_func
        self._impl = _Implementation(py_func, folder)
        self._cache_path = str(folder)
        self._cache_file = caching.IndexDataCacheFile(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )
        self.enable()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except (OSError, EOFError, pickle.UnpicklingError, ValueError, ImportError, AttributeError):
            # Empty, truncated or foreign file: numba will compile and write a new one.
            self._forget()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except (OSError, EOFError, pickle.UnpicklingError, ValueError):
            self._forget()

    def _forget(self) -> None:
        try:
            self._cache_file.flush()
        except OSError:
            self.disable()


def _compiled(function: Function, fastmath: set[str]) -> Function:
    jitted = numba.njit(nogil=True, error_model="numpy", fastmath=fastmath)(function)
    folder = None if config.DISABLE_JIT else cache_directory()
    if isinstance(jitted, Dispatcher) and folder is not None:
        jitted._cache = PackageCache(jitted.py_func, folder)
    return jitted


def kernel(function: Function) -> Function:
    """Compile on first call: no interpreter lock, numpy division, fused multiply-adds allowed."""
    return _compiled(function, _FAST)


def reduction_kernel(function: Function) -> Function:
    """As `kernel`, and sums may be reordered: only for plain sums over many terms."""
    return _compiled(function, _FAST | {"reassoc"})
