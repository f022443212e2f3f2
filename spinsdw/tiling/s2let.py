"""The numerical choices of the C library S2LET, for results that agree with it to rounding.

Found by experiment: 300 trapezia of equal width from the point to 1 for each degree by itself,
the highest scale from rounded logarithms, and no difference below zero.
"""

from __future__ import annotations

import math

import numpy as np

from spinsdw.tiling.base import FloatArray

__all__ = ["highest_scale", "keep_last_real_root", "trapezoid_profile"]

_INTERVALS = 300


def highest_scale(bandlimit: int, dilation: float) -> int:
    """Return ``ceil(log L / log dilation)`` as floating point has it.

    Parameters
    ----------
    bandlimit : int
    dilation : float

    Returns
    -------
    int
        One more than needed for L = 125 and dilation 5, and where L - 1 is a power of the dilation.

    Examples
    --------
    >>> highest_scale(125, 5.0), highest_scale(513, 2.0)
    (4, 10)
    """
    return math.ceil(math.log(bandlimit) / math.log(dilation))


def _bump(u: FloatArray, dilation: float) -> FloatArray:
    """``s_lambda(u)**2 / u``, zero off the bump (eq-bump)."""
    x = (u - 1 / dilation) * (2 * dilation / (dilation - 1)) - 1
    inside = x * x < 1
    exponents = -2.0 / (1 - x[inside] * x[inside])
    values = np.zeros_like(u)
    # The C library's exponential: NumPy's may differ in the last bit, which the square root of a
    # small difference would show as 1e-8.
    values[inside] = np.fromiter(map(math.exp, exponents.tolist()), float, exponents.size)
    values[inside] /= u[inside]
    return values


def _trapezoid(lower: FloatArray, dilation: float) -> FloatArray:
    """Integrate the bump from each point to 1, adding from left to right."""
    step = ((1.0 - lower) / _INTERVALS)[:, None]
    values = _bump(lower[:, None] + np.arange(_INTERVALS + 1) * step, dilation)
    areas = (values[:, :-1] + values[:, 1:]) * step / 2
    return np.asarray(np.cumsum(areas, axis=1)[:, -1])


def trapezoid_profile(ratio: FloatArray, dilation: float) -> tuple[FloatArray, FloatArray]:
    """Return what the low-pass profile k_lambda (eq-step) passes and stops, by 300 trapezia.

    Parameters
    ----------
    ratio : ndarray, shape (n,), float64
    dilation : float

    Returns
    -------
    passed, stopped : ndarray, shape (n,), float64
        Within 1e-5 of the exact integral.

    Examples
    --------
    >>> passed, stopped = trapezoid_profile(np.array([0.0, 0.75, 1.0]), 2.0)
    >>> passed.round(5).tolist()
    [1.0, 0.45255, 0.0]
    """
    passed = np.where(ratio <= 1 / dilation, 1.0, 0.0)
    falling = (ratio > 1 / dilation) & (ratio < 1)
    total = _trapezoid(np.array([1 / dilation]), dilation)
    passed[falling] = _trapezoid(ratio[falling], dilation) / total
    return passed, 1 - passed


def keep_last_real_root(squares: FloatArray) -> FloatArray:
    """Return square roots; a negative number takes the root of the last one that is not.

    Parameters
    ----------
    squares : ndarray, shape (n,), float64

    Returns
    -------
    ndarray, shape (n,), float64

    Examples
    --------
    >>> keep_last_real_root(np.array([-1.0, 4.0, -1.0, -1.0, 9.0])).tolist()
    [0.0, 2.0, 2.0, 2.0, 3.0]
    """
    last = np.maximum.accumulate(np.where(squares >= 0, np.arange(squares.size), -1))
    roots = np.sqrt(np.maximum(squares, 0.0))[np.maximum(last, 0)]
    return np.where(last >= 0, roots, 0.0)
