"""Products on the rotation group, of Wigner coefficients: correlations and convolutions.

Functions are sum_lmn (2l+1)/(8 pi^2) F_lmn conj(D^l_mn(rho)), as `WignerTransform` takes them, and
their coefficients have shape (..., orders, bandlimit**2). With d rho the measure of volume 8 pi^2,
each product is one of matrices for every degree.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from spinsdw.errors import ShapeError
from spinsdw.harmonics import bandlimit_of, check_flm, read_flm
from spinsdw.wigner_transform import check_orders

__all__ = ["convolve_functions", "correlate_fields", "correlate_functions"]

Array = np.ndarray[Any, Any]


def correlate_fields(flm: Array, glm: Array, orders: Sequence[int]) -> Array:
    """Return the Wigner coefficients of <f, R_rho g>: 8 pi^2 / (2l+1) f_lm conj(g_ln).

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
        A field of any spin.
    glm : array_like, shape (..., bandlimit**2)
        The field that is turned, of the same spin and bandlimit. Batches are broadcast.
    orders : sequence of int
        The orders n of g to keep, increasing.

    Returns
    -------
    ndarray, shape (..., orders, bandlimit**2), complex128
        Coefficients whose `WignerTransform.synthesis` is the correlation (eq-group-fields).
        `WignerTransform.correlate` goes there at once.

    Raises
    ------
    ShapeError
        If the bandlimits differ.
    DataError
        If a coefficient is not a finite number.
    ParameterError
        If the orders are not increasing integers below the bandlimit.

    Examples
    --------
    >>> found = correlate_fields([0, 0, 1, 0], [0, 0, 1, 0], orders=(0,))
    >>> bool(np.isclose(found[0, 2], 8 * np.pi**2 / 3))
    True
    """
    first, bandlimit = read_flm(flm)
    second = check_flm(glm, bandlimit, "glm")
    kept = check_orders(orders, bandlimit)
    shape = np.broadcast_shapes(first.shape[:-1], second.shape[:-1])
    found = np.zeros((*shape, len(kept), bandlimit**2), dtype=np.complex128)
    for el in range(bandlimit):
        degree = slice(el**2, (el + 1) ** 2)
        for i, n in enumerate(kept):
            if abs(n) <= el:
                turned = second[..., el * el + el + n, None].conj()
                factor = 8 * np.pi**2 / (2 * el + 1)
                found[..., i, degree] = factor * first[..., degree] * turned
    return found


def convolve_functions(first: Array, second: Array, orders: Sequence[int]) -> Array:
    """Return the coefficients of int d rho' f(rho') g(rho'^-1 rho): sum_k F_lmk G_lkn.

    Parameters
    ----------
    first : array_like, shape (..., len(orders), bandlimit**2)
        F_lmk.
    second : array_like, shape (..., any orders, bandlimit**2)
        G_lkn. Batches are broadcast.
    orders : sequence of int
        The orders k of the first function.

    Returns
    -------
    ndarray, shape (..., orders of the second, bandlimit**2), complex128
        Coefficients with the orders n of the second function (eq-group-convolution).

    Raises
    ------
    ShapeError
        If the bandlimits differ, or the first does not have a row for each order.
    DataError
        If a coefficient is not a finite number.
    ParameterError
        If the orders are not increasing integers below the bandlimit.

    Examples
    --------
    The function with F_l00 = 1 convolves every zonal function into itself.

    >>> one = np.array([[1.0, 0, 1.0, 0]])
    >>> convolve_functions(one, one, orders=(0,)).real.tolist()
    [[1.0, 0.0, 1.0, 0.0]]
    """
    left, kept = _read_function(first, orders, "first")
    bandlimit = bandlimit_of(left)
    right = check_flm(second, bandlimit, "second")
    _check_rows(right, None, "second")
    shape = np.broadcast_shapes(left.shape[:-2], right.shape[:-2])
    found = np.zeros((*shape, right.shape[-2], bandlimit**2), dtype=np.complex128)
    for degree, rows, places in _degrees(bandlimit, kept):
        found[..., degree] = right[..., places] @ left[..., rows, degree]
    return found


def correlate_functions(first: Array, second: Array, orders: Sequence[int]) -> Array:
    """Return the coefficients of int d rho' f(rho') conj(g(rho^-1 rho')): sum_k F_lmk conj(G_lnk).

    Parameters
    ----------
    first, second : array_like, shape (..., len(orders), bandlimit**2)
        F_lmk and G_lnk. Batches are broadcast.
    orders : sequence of int
        The orders k of both functions.

    Returns
    -------
    ndarray, shape (..., 2 bandlimit - 1, bandlimit**2), complex128
        Coefficients with every order n from 1 - bandlimit to bandlimit - 1, for those are the
        orders m of the second function (eq-group-correlation).

    Raises
    ------
    ShapeError
        If the bandlimits differ, or a function does not have a row for each order.
    DataError
        If a coefficient is not a finite number.
    ParameterError
        If the orders are not increasing integers below the bandlimit.

    Notes
    -----
    This is what the so3 package calls a convolution.

    Examples
    --------
    >>> one = np.array([[1.0, 0, 2j, 0]])
    >>> correlate_functions(one, one, orders=(0,))[1].real.tolist()
    [1.0, 0.0, 4.0, 0.0]
    """
    left, kept = _read_function(first, orders, "first")
    bandlimit = bandlimit_of(left)
    right = check_flm(second, bandlimit, "second")
    _check_rows(right, len(kept), "second")
    shape = np.broadcast_shapes(left.shape[:-2], right.shape[:-2])
    found = np.zeros((*shape, 2 * bandlimit - 1, bandlimit**2), dtype=np.complex128)
    for el, (degree, rows, _) in enumerate(_degrees(bandlimit, kept)):
        turned = np.swapaxes(right[..., rows, degree], -1, -2).conj()
        every = slice(bandlimit - 1 - el, bandlimit + el)
        found[..., every, degree] = turned @ left[..., rows, degree]
    return found


def _read_function(
    values: Array, orders: Sequence[int], name: str
) -> tuple[Array, tuple[int, ...]]:
    bandlimit = bandlimit_of(values)
    kept = check_orders(orders, bandlimit)
    checked = check_flm(values, bandlimit, name)
    _check_rows(checked, len(kept), name)
    return checked, kept


def _check_rows(values: Array, rows: int | None, name: str) -> None:
    if values.ndim < 2 or rows not in (None, values.shape[-2]):
        wanted = "orders" if rows is None else str(rows)
        msg = (
            f"{name} has shape {values.shape}; it must be (..., {wanted}, {values.shape[-1]}), one "
            "row for each of the orders."
        )
        raise ShapeError(msg)


def _degrees(bandlimit: int, orders: tuple[int, ...]) -> Iterator[tuple[slice, Array, Array]]:
    """Each degree's places, the rows of the orders k that it has, and the places of m = k."""
    kept = np.array(orders)
    for el in range(bandlimit):
        rows = np.flatnonzero(np.abs(kept) <= el)
        yield slice(el**2, (el + 1) ** 2), rows, el * el + el + kept[rows]
