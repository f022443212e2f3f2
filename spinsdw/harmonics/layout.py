"""How coefficients are laid out: indices, the bandlimit, and the one check of every array."""

from __future__ import annotations

import math
import operator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ParameterError, ShapeError

__all__ = [
    "bandlimit_of",
    "check_bandlimit",
    "check_flm",
    "check_integer",
    "degrees",
    "index",
    "orders",
    "read_flm",
    "resize",
]

ComplexArray: TypeAlias = NDArray[np.complex128]
FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]


def check_integer(
    value: object, name: str, *, minimum: int | None = None, remedy: str = "pass an int"
) -> int:
    """Return ``value`` as an int, or say what is wrong with parameter ``name``.

    Parameters
    ----------
    value : object
        Any integer, NumPy's included. Booleans and floats are refused, whole or not.
    name : str
        What the message calls the value.
    minimum : int, optional
        The lowest value allowed.
    remedy : str
        The last words of the message.

    Returns
    -------
    int

    Raises
    ------
    ParameterError
        If the value is not an integer, or below ``minimum``.

    Examples
    --------
    >>> check_integer(np.int64(3), "bandlimit", minimum=1)
    3
    """
    rule = "an integer" if minimum is None else f"an integer of at least {minimum}"
    msg = f"{name}={value!r} must be {rule}; {remedy}."
    if isinstance(value, (bool, np.bool_)):
        raise ParameterError(msg)
    try:
        whole = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ParameterError(msg) from None
    if minimum is not None and whole < minimum:
        raise ParameterError(msg)
    return whole


def check_bandlimit(bandlimit: object) -> int:
    """Return a bandlimit as an int, or say what is wrong with it.

    Parameters
    ----------
    bandlimit : object
        Any integer of at least 1.

    Returns
    -------
    int

    Raises
    ------
    ParameterError
        If it is not an integer, or below 1.

    Examples
    --------
    >>> check_bandlimit(64)
    64
    """
    return check_integer(bandlimit, "bandlimit", minimum=1, remedy="it is the highest degree + 1")


def bandlimit_of(flm: ArrayLike) -> int:
    """Return the bandlimit L of coefficients whose last axis has L**2 entries.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)

    Returns
    -------
    int

    Raises
    ------
    ShapeError
        If the last axis is missing, empty or not a perfect square long.

    Examples
    --------
    >>> bandlimit_of(np.zeros((3, 16)))
    4
    """
    shape = np.shape(flm)
    size = shape[-1] if shape else 0
    bandlimit = math.isqrt(size)
    if size == 0 or bandlimit**2 != size:
        msg = (
            f"flm has shape {shape}, and its last axis must be bandlimit**2 long; "
            "pass every order -el..el of every degree, as healpix.alm_to_flm does."
        )
        raise ShapeError(msg)
    return bandlimit


def check_flm(flm: ArrayLike, bandlimit: int, name: str = "flm") -> ComplexArray:
    """Return coefficients as a contiguous complex128 array, or say why they are unusable.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
        Real or complex numbers of any precision.
    bandlimit : int
        The bandlimit wanted.
    name : str
        What the message calls the array.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        C-contiguous; the array itself, not a copy, where it is that already.

    Raises
    ------
    ShapeError
        If the last axis is not ``bandlimit**2`` long.
    DataError
        If the values are not numbers, some are masked, or some are NaN or infinite.

    Examples
    --------
    >>> check_flm([1, 2, 3, 4], 2).dtype
    dtype('complex128')
    """
    values = np.asanyarray(flm)
    if values.dtype.kind not in "iufc":
        msg = f"{name} has dtype {values.dtype}, and must hold numbers; convert it to complex128."
        raise DataError(msg)
    if np.ma.is_masked(values):
        msg = f"{name} has masked entries, and every one must be known; fill them first."
        raise DataError(msg)
    if values.ndim == 0 or values.shape[-1] != bandlimit**2:
        msg = (
            f"{name} has shape {values.shape}, and its last axis must be bandlimit**2 = "
            f"{bandlimit**2} long; harmonics.resize changes the bandlimit."
        )
        raise ShapeError(msg)
    result = np.ascontiguousarray(values, dtype=np.complex128)
    if not np.isfinite(result).all():
        msg = f"{name} has NaN or infinite entries, and all must be finite; mend them first."
        raise DataError(msg)
    return result.view(np.ndarray)


def read_flm(flm: ArrayLike, name: str = "flm") -> tuple[ComplexArray, int]:
    """Return coefficients as `check_flm` does, with the bandlimit that their size says.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
    name : str
        What the message calls the array.

    Returns
    -------
    flm : ndarray, shape (..., bandlimit**2), complex128
    bandlimit : int

    Raises
    ------
    ShapeError
        If the last axis is not a perfect square long.
    DataError
        As `check_flm`.

    Examples
    --------
    >>> read_flm(np.zeros(9))[1]
    3
    """
    bandlimit = bandlimit_of(flm)
    return check_flm(flm, bandlimit, name), bandlimit


def degrees(bandlimit: int) -> IntArray:
    """Return the degree of each coefficient.

    Parameters
    ----------
    bandlimit : int

    Returns
    -------
    ndarray, shape (bandlimit**2,), int64
        ``[el for el in range(bandlimit) for m in range(-el, el + 1)]``.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is not an integer of at least 1.

    Examples
    --------
    >>> degrees(3).tolist()
    [0, 1, 1, 1, 2, 2, 2, 2, 2]
    """
    el = np.arange(check_bandlimit(bandlimit), dtype=np.int64)
    return np.repeat(el, 2 * el + 1)


def orders(bandlimit: int) -> IntArray:
    """Return the order of each coefficient.

    Parameters
    ----------
    bandlimit : int

    Returns
    -------
    ndarray, shape (bandlimit**2,), int64
        ``[m for el in range(bandlimit) for m in range(-el, el + 1)]``.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is not an integer of at least 1.

    Examples
    --------
    >>> orders(3).tolist()
    [0, -1, 0, 1, -2, -1, 0, 1, 2]
    """
    el = degrees(bandlimit)
    return np.arange(el.size, dtype=np.int64) - el * (el + 1)


def index(el: ArrayLike, m: ArrayLike) -> Any:
    """Return where degree ``el`` and order ``m`` stand: ``el**2 + el + m`` (eq-index).

    Parameters
    ----------
    el, m : int or array_like of int
        Broadcast against each other, with ``|m| <= el``.

    Returns
    -------
    int64 or ndarray of int64

    Raises
    ------
    ParameterError
        If a value is not an integer, or ``|m| > el`` somewhere.

    Examples
    --------
    >>> int(index(2, -1))
    5
    """
    degree, order = np.asarray(el), np.asarray(m)
    if degree.dtype.kind not in "iu" or order.dtype.kind not in "iu":
        msg = f"el={el!r}, m={m!r} must be integers; a coefficient has a whole degree and order."
        raise ParameterError(msg)
    degree, order = degree.astype(np.int64), order.astype(np.int64)
    if np.any(np.abs(order) > degree):
        msg = f"el={el!r}, m={m!r} must keep |m| <= el; no other order exists."
        raise ParameterError(msg)
    return degree * (degree + 1) + order


def resize(flm: ArrayLike, bandlimit: int) -> ComplexArray:
    """Cut coefficients off at another bandlimit, or fill up with zeros to it.

    Parameters
    ----------
    flm : array_like, shape (..., old_bandlimit**2)
    bandlimit : int
        The new bandlimit.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        A new array.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is not an integer of at least 1.
    ShapeError, DataError
        As `check_flm`.

    Examples
    --------
    >>> resize([1, 2, 3, 4], 1).real.tolist(), resize([1], 2).real.tolist()
    ([1.0], [1.0, 0.0, 0.0, 0.0])
    """
    values, old = read_flm(flm)
    kept = min(old, check_bandlimit(bandlimit)) ** 2
    result = np.zeros((*values.shape[:-1], bandlimit**2), dtype=np.complex128)
    result[..., :kept] = values[..., :kept]
    return result
