"""Checks of what users hand over: spins, flags and maps."""

from __future__ import annotations

from typing import Any

import numpy as np

from spinsdw.errors import DataError, ParameterError, ShapeError

__all__ = [
    "check_dtype",
    "check_finite",
    "check_flag",
    "check_map",
    "check_spin",
    "refuse_masked",
    "stored_dtype",
    "writable",
]

Array = np.ndarray[Any, Any]


def check_spin(spin: object, bandlimit: int) -> int:
    """Return the spin as an int; a signal of bandlimit L has |spin| < L."""
    if isinstance(spin, bool) or not isinstance(spin, int | np.integer):
        msg = f"spin={spin!r} must be an integer."
        raise ParameterError(msg)
    if abs(int(spin)) >= bandlimit:
        msg = (
            f"spin={spin} must be smaller in size than bandlimit={bandlimit}; "
            "no degree below the bandlimit carries it."
        )
        raise ParameterError(msg)
    return int(spin)


def check_flag(value: object, name: str) -> bool:
    """Return a flag as a bool; a text such as "no" would count as true."""
    if not isinstance(value, bool | np.bool_):
        msg = f"{name}={value!r} must be True or False."
        raise ParameterError(msg)
    return bool(value)


def check_dtype(dtype: object) -> str:
    """Return the name of the type that maps are stored in: "complex128" or "complex64"."""
    try:
        name = np.dtype(dtype).name  # type: ignore[call-overload]
    except TypeError:
        name = ""
    if dtype is None or name not in {"complex128", "complex64"}:
        msg = (
            f"dtype={dtype!r} must be 'complex128' or 'complex64'; real maps are then stored as "
            "float64 or float32."
        )
        raise ParameterError(msg)
    return name


def stored_dtype(dtype: str, *, real: bool) -> np.dtype[Any]:
    """Return the type of maps, real or complex, of the precision of a complex type."""
    stored = np.dtype(dtype)
    return np.empty(0, dtype=stored).real.dtype if real else stored


def check_finite(values: Array, name: str) -> None:
    """Raise `DataError` if an array holds NaN or infinity."""
    bad = values.size - int(np.count_nonzero(np.isfinite(values)))
    if bad:
        found = "1 value that is" if bad == 1 else f"{bad} values that are"
        remedy = f"mask or replace {'it' if bad == 1 else 'them'} first"
        msg = f"{name} has {found} not finite; {remedy}."
        raise DataError(msg)


def refuse_masked(values: object, name: str) -> None:
    """Raise `DataError` for an array of numpy.ma with masked entries: its mask would be lost."""
    if np.ma.is_masked(values):
        msg = f"{name} has masked entries, and every value must be known; fill them first."
        raise DataError(msg)


def writable(values: Array) -> Array:
    """Return an array for compiled code: itself, or a copy of a read-only or unaligned one.

    A loop is compiled for one kind of array, and to the compiler those are others.
    """
    return np.require(values, requirements=["C", "A", "W"])


def check_map(
    maps: object,
    shape: tuple[int, ...],
    *,
    real: bool,
    name: str = "map",
    may_be_single: bool = False,
) -> Array:
    """Return maps as a native C-ordered float64 (``real``) or complex128 array, checked.

    With ``may_be_single`` those of single precision become float32 or complex64: as they are, not
    copies of twice the size.
    """
    refuse_masked(maps, name)
    values = np.asarray(maps)
    if values.dtype.kind not in "biufc":
        msg = f"{name} has dtype {values.dtype}; it must hold real or complex numbers."
        raise DataError(msg)
    if values.shape[-len(shape) :] != shape:
        expected = ", ".join(str(n) for n in shape)
        msg = f"{name} has shape {values.shape}; it must be (..., {expected}) for this transform."
        raise ShapeError(msg)
    if real and values.dtype.kind == "c":
        msg = (
            f"{name} is complex but real=True was asked for; pass its real part or use real=False."
        )
        raise DataError(msg)
    is_single = may_be_single and np.result_type(values.dtype, np.complex64) == np.complex64
    stored = stored_dtype("complex64" if is_single else "complex128", real=real)
    values = np.ascontiguousarray(values, dtype=stored)
    check_finite(values, name)
    return values
