"""The decorators of compiled functions, numba's options, and where machine code is cached.

Why a cache of our own: numba's in-tree cache knows one source file, while a function here inlines
helpers from its neighbours; a half-written or unreadable cache file makes numba raise at the first
call, a damaged one may end the process; and a read-only home makes it raise at import.
`PackageCache` has a folder for each content of this one, seals every file with a digest and treats
anything it cannot read or write as "not cached".
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

from spinsdw.compiled.linking import PartCompiler, is_possible, make_callable

__all__ = ["cache_directory", "inner", "kernel", "room"]

Function = TypeVar("Function", bound=Callable[..., Any])

# "nnan" and "ninf" are left out: with them a NaN in a map could turn into a plausible number.
_FAST = {"contract", "nsz", "arcp"}
_FOLDER = Path(__file__).resolve().parent
_SEAL_BYTES = hashlib.sha256().digest_size


def cache_directory() -> Path | None:
    """Return the folder for machine code, or None where caching is off or nothing is writable.

    ``SPINSDW_CACHE`` names a folder, or switches caching off with ``0``; otherwise it is
    ``spinsdw`` below ``XDG_CACHE_HOME`` or ``~/.cache``. In it every version of numba, Python, the
    package and every setting of the vector width has a folder of its own.
    """
    setting = os.environ.get("SPINSDW_CACHE", "")
    if setting == "0":
        return None
    if setting:
        base = Path(setting)
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "spinsdw"
    python = f"{sys.version_info[0]}{sys.version_info[1]}"
    width = _vector_setting() or "host"
    versions = f"numba-{numba.__version__}-python-{python}-width-{width}-{_source_stamp()[:16]}"
    folder = base / versions
    return folder if _is_ours(folder) else None


def _vector_setting() -> str:
    """Return the vector width asked for, "" where the machine decides."""
    setting = os.environ.get("SPINSDW_VECTOR_WIDTH", "")
    return setting if setting in {"2", "4", "8"} else ""


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
    digest.update(_vector_setting().encode())
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


class _SealedFile(caching.IndexDataCacheFile):
    """Numba's index and data files, each after the digest of its content.

    A changed byte of machine code crashes the process, and one of a pickle may do anything: so
    nothing is unpickled before its digest is found right. This is against accidents; against
    others there is `_is_ours`.
    """

    def _write(self, path: str, content: object) -> None:
        data = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(hashlib.sha256(data).digest() + data)

    def _read(self, path: str) -> Any:
        """Return what was written, None where it is not there or not whole."""
        try:
            sealed = Path(path).read_bytes()
        except FileNotFoundError:
            return None
        seal, data = sealed[:_SEAL_BYTES], sealed[_SEAL_BYTES:]
        return pickle.loads(data) if hashlib.sha256(data).digest() == seal else None

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, (self._source_stamp, overloads))

    def _load_index(self) -> dict[Any, str]:
        stamp, overloads = self._read(self._index_path) or (None, {})
        return overloads if stamp == self._source_stamp else {}

    def _save_data(self, name: str, data: object) -> None:
        self._write(self._data_path(name), data)

    def _load_data(self, name: str) -> Any:
        return self._read(self._data_path(name))


class PackageCache(caching.FunctionCache):
    """Numba's function cache that never fails: what cannot be read is compiled again."""

    def __init__(self, py_func: Callable[..., Any], folder: Path) -> None:
        self._name = repr(py_func)
        self._py_func = py_func
        self._impl = _Implementation(py_func, folder)
        self._cache_path = str(folder)
        self._cache_file = _SealedFile(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )
        self.enable()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:
            # Whole, but of no use here: unpickling and linking raise whatever the parts they call
            # raise. Nothing is lost: numba compiles as if there were no file, and raises again
            # what is not the file's fault.
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


def kernel(function: Function) -> Function:
    """Compile on first call: no interpreter lock, numpy division, fused multiply-adds allowed."""
    jitted = _compile(function, no_cfunc_wrapper=True)
    folder = None if config.DISABLE_JIT else cache_directory()
    if isinstance(jitted, Dispatcher) and folder is not None:
        jitted._cache = PackageCache(jitted.py_func, folder)
    return jitted


def inner(function: Function) -> Function:
    """Compile like `kernel` what only kernels call, to be part of them: it must not allocate.

    Numba counts references to arrays, for every slice as well, with atomic instructions: around the
    short loops of a block they took as long as the loops. Here it does not.
    """
    return _compile_part(function, _nrt=False)


def room(function: Function) -> Function:
    """Compile like `inner` what gives a kernel room: it may allocate."""
    return _compile_part(function)


def _compile_part(function: Function, **options: bool) -> Function:
    """Compile what is in the cache only as a part of kernels."""
    if not is_possible():
        return _compile(function, **options)
    part = _compile(
        function,
        pipeline_class=PartCompiler,
        no_cpython_wrapper=True,
        no_cfunc_wrapper=True,
        **options,
    )
    if isinstance(part, Dispatcher):
        make_callable(part, _compile)
    return part


def _compile(function: Function, **options: Any) -> Function:
    return numba.njit(nogil=True, error_model="numpy", fastmath=_FAST, **options)(function)
