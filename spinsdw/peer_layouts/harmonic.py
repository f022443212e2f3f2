"""Harmonic and Wigner coefficients in the layouts of s2fft, s2wav, so3 and S2LET."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from spinsdw.errors import ParameterError, ShapeError
from spinsdw.harmonics import (
    bandlimit_of,
    check_bandlimit,
    check_flm,
    check_integer,
    degrees,
    index,
    orders,
)

__all__ = [
    "flm_to_s2fft",
    "s2fft_to_flm",
    "s2fft_to_wigner",
    "so3_to_wigner",
    "wigner_to_s2fft",
    "wigner_to_so3",
]

Array = np.ndarray[Any, Any]


def _places(bandlimit: int) -> tuple[Array, Array]:
    """Return degree and column of every coefficient in s2fft's rectangle."""
    return degrees(bandlimit), orders(bandlimit) + bandlimit - 1


def flm_to_s2fft(flm: Array) -> Array:
    """Return harmonic coefficients as the rectangle of s2fft and s2wav.

    Parameters
    ----------
    flm : ndarray, shape (..., bandlimit**2), complex
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Returns
    -------
    ndarray, shape (..., bandlimit, 2 * bandlimit - 1), complex128
        Row el, column ``m + bandlimit - 1``; zero where ``|m| > el``.

    Raises
    ------
    ShapeError, DataError
        If the last axis is no square long, or a value is not finite.

    Examples
    --------
    >>> flm_to_s2fft(np.arange(4)).real.tolist()
    [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]
    """
    bandlimit = bandlimit_of(flm)
    values = check_flm(flm, bandlimit)
    found = np.zeros((*values.shape[:-1], bandlimit, 2 * bandlimit - 1), dtype=np.complex128)
    found[(..., *_places(bandlimit))] = values
    return found


def s2fft_to_flm(rectangle: Array) -> Array:
    """Return the rectangle of s2fft and s2wav as harmonic coefficients.

    Parameters
    ----------
    rectangle : ndarray, shape (..., bandlimit, 2 * bandlimit - 1), complex
        Row el, column ``m + bandlimit - 1``; what lies at ``|m| > el`` is not looked at.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Raises
    ------
    ShapeError
        If the last two axes are not those of a bandlimit.

    Examples
    --------
    >>> s2fft_to_flm([[0, 5, 0], [1, 2, 3]]).real.tolist()
    [5.0, 1.0, 2.0, 3.0]
    """
    values = np.asarray(rectangle, dtype=np.complex128)
    bandlimit = values.shape[-2] if values.ndim > 1 else 0
    if bandlimit == 0 or values.shape[-1] != 2 * bandlimit - 1:
        msg = f"rectangle has shape {values.shape}; it must be (..., bandlimit, 2 bandlimit - 1)."
        raise ShapeError(msg)
    return np.ascontiguousarray(values[(..., *_places(bandlimit))])


def _rows(orders: Sequence[int], directions: int) -> list[int]:
    """Return the row of each order n among -(N-1)..N-1."""
    found = [check_integer(n, "orders", remedy="each is one") for n in orders]
    if any(abs(n) >= directions for n in found):
        msg = f"orders={tuple(found)} must be below directions={directions} in size; raise it."
        raise ParameterError(msg)
    return [n + directions - 1 for n in found]


def _all_orders(coefficients: Array, orders: Sequence[int], directions: int) -> Array:
    """Return (..., 2N - 1, L*L) with zeros at the orders that are not there."""
    directions = check_integer(directions, "directions", minimum=1)
    rows = _rows(orders, directions)
    bandlimit = bandlimit_of(coefficients)
    values = check_flm(coefficients, bandlimit, "coefficients")
    if values.ndim < 2 or values.shape[-2] != len(rows):
        msg = f"coefficients has shape {values.shape}; it must have a row for each of {orders}."
        raise ShapeError(msg)
    found = np.zeros((*values.shape[:-2], 2 * directions - 1, bandlimit**2), dtype=np.complex128)
    found[..., rows, :] = values
    return found


def wigner_to_s2fft(coefficients: Array, orders: Sequence[int], directions: int) -> Array:
    """Return Wigner coefficients as s2fft's ``flmn``.

    Parameters
    ----------
    coefficients : ndarray, shape (..., orders, bandlimit**2), complex
        One row for each order n, as `spinsdw.WignerTransform` has them; no factor differs.
    orders : sequence of int
        The order of each row.
    directions : int
        N of s2fft, above every |n|.

    Returns
    -------
    ndarray, shape (..., 2 * directions - 1, bandlimit, 2 * bandlimit - 1), complex128
        Row ``n + directions - 1``; zero for orders that are not there.

    Raises
    ------
    ShapeError, DataError, ParameterError
        If the rows are not those of the orders, a value is not finite or an order too large.

    Examples
    --------
    >>> wigner_to_s2fft(np.ones((1, 4)), (0,), 2).shape
    (3, 2, 3)
    """
    return flm_to_s2fft(_all_orders(coefficients, orders, directions))


def s2fft_to_wigner(flmn: Array, orders: Sequence[int]) -> Array:
    """Return s2fft's ``flmn`` as Wigner coefficients of the orders wanted.

    Parameters
    ----------
    flmn : ndarray, shape (..., 2 * directions - 1, bandlimit, 2 * bandlimit - 1), complex
        As `wigner_to_s2fft` returns it.
    orders : sequence of int
        The orders n wanted; others are dropped.

    Returns
    -------
    ndarray, shape (..., orders, bandlimit**2), complex128
        One row for each order.

    Raises
    ------
    ShapeError, ParameterError
        If the axes are not those of a bandlimit, or an order is too large.

    Examples
    --------
    >>> s2fft_to_wigner(np.ones((3, 2, 3)), (-1, 1)).shape
    (2, 4)
    """
    found = s2fft_to_flm(flmn)
    count = found.shape[-2] if found.ndim > 1 else 0
    if count % 2 == 0:
        msg = f"flmn has shape {np.shape(flmn)}; axis -3 must be 2 directions - 1 long."
        raise ShapeError(msg)
    return found[..., _rows(orders, (count + 1) // 2), :]


def wigner_to_so3(
    coefficients: Array, orders: Sequence[int], directions: int, *, storage: str = "padded"
) -> Array:
    """Return Wigner coefficients as the one array of so3, and of S2LET's ``lmn`` functions.

    Parameters
    ----------
    coefficients : ndarray, shape (orders, bandlimit**2), complex
        One row for each order n.
    orders : sequence of int
        The order of each row.
    directions : int
        N of so3, above every |n|.
    storage : {"padded", "compact"}
        "padded" keeps bandlimit**2 numbers for each order (so3's default in Python), "compact"
        only those with ``el >= |n|`` (S2LET). Both run from n = -(N-1) to N-1.

    Returns
    -------
    ndarray, complex128
        Shape ((2N - 1) L**2,), or ((2N - 1) (3 L**2 - N (N - 1)) / 3,) if compact.

    Raises
    ------
    ShapeError, DataError, ParameterError
        As `wigner_to_s2fft`, or if the storage is not known.

    Examples
    --------
    >>> wigner_to_so3(np.ones((1, 9)), (0,), 2, storage="compact").shape
    (25,)
    """
    rows = _all_orders(coefficients, orders, directions)
    if rows.ndim != 2:
        msg = f"coefficients has shape {np.shape(coefficients)}; so3 takes one function, two axes."
        raise ShapeError(msg)
    starts = _starts(directions, storage)
    return np.concatenate([row[start:] for row, start in zip(rows, starts, strict=True)])


def so3_to_wigner(
    flmn: Array, orders: Sequence[int], bandlimit: int, *, storage: str = "padded"
) -> Array:
    """Return the one array of so3 as Wigner coefficients of the orders wanted.

    Parameters
    ----------
    flmn : ndarray, one axis, complex
        As `wigner_to_so3` returns it.
    orders : sequence of int
        The orders n wanted; others are dropped.
    bandlimit : int
        L.
    storage : {"padded", "compact"}
        As in `wigner_to_so3`.

    Returns
    -------
    ndarray, shape (orders, bandlimit**2), complex128
        One row for each order.

    Raises
    ------
    ShapeError, ParameterError
        If the size belongs to no N, an order is too large or the storage is not known.

    Examples
    --------
    >>> so3_to_wigner(np.ones(25), (-1, 1), 3, storage="compact").real.sum(axis=-1).tolist()
    [8.0, 8.0]
    """
    bandlimit = check_bandlimit(bandlimit)
    values = np.asarray(flmn, dtype=np.complex128)
    for directions in range(1, bandlimit + 1):
        starts = _starts(directions, storage)
        lengths = [bandlimit**2 - start for start in starts]
        if values.shape == (sum(lengths),):
            break
    else:
        msg = f"flmn has shape {values.shape}, which belongs to no N at bandlimit={bandlimit}."
        raise ShapeError(msg)
    found = np.zeros((2 * directions - 1, bandlimit**2), dtype=np.complex128)
    parts = np.split(values, np.cumsum(lengths)[:-1])
    for row, start, part in zip(found, starts, parts, strict=True):
        row[start:] = part
    return found[_rows(orders, directions)]


def _starts(directions: int, storage: str) -> list[int]:
    """Return the first index kept of each order -(N-1)..N-1."""
    if storage not in ("padded", "compact"):
        msg = f"storage={storage!r} must be 'padded' or 'compact'; S2LET has the latter."
        raise ParameterError(msg)
    if storage == "padded":
        return [0] * (2 * directions - 1)
    return [int(index(abs(n), -abs(n))) for n in range(1 - directions, directions)]
