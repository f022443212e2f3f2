"""Describe the installation and the machine, for reports of bugs."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path

from spinsdw.compiled.jit import cache_directory
from spinsdw.compiled.vectors import WIDTH
from spinsdw.parallel import resolve_threads

__all__ = ["describe"]

PACKAGES = (
    "numpy",
    "scipy",
    "numba",
    "llvmlite",
    "healpy",
    "ducc0",
    "astropy",
    "click",
    "rich",
    "matplotlib",
    "zarr",
)
VARIABLES = ("SPINSDW_CACHE", "SPINSDW_VECTOR_WIDTH", "NUMBA_DISABLE_JIT", "NUMBA_CPU_NAME")


def describe() -> dict[str, str]:
    """Return what a report of a bug should say, name to fact, in the order to be read.

    Examples
    --------
    >>> "processor" in describe()
    True
    """
    facts = {name: _version(name) for name in ("spinsdw", *PACKAGES)}
    facts["python"] = f"{platform.python_version()} ({platform.python_implementation()})"
    facts["system"] = platform.platform()
    facts["processor"] = _processor()
    facts["threads"] = f"{resolve_threads(None)} available"
    facts["vectors"] = f"{WIDTH} doubles"
    facts["cache"] = str(cache_directory() or "none: switched off or not writable")
    return facts | {name: os.environ[name] for name in VARIABLES if name in os.environ}


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    # platform.processor() is empty or "x86_64" on Linux.
    table = Path("/proc/cpuinfo")
    if table.is_file():
        for line in table.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
