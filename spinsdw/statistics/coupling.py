"""How a mask mixes the degrees of a power spectrum."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ShapeError
from spinsdw.harmonics import check_bandlimit
from spinsdw.sampling import GaussLegendre
from spinsdw.signals import check_spin

__all__ = ["mode_coupling"]

FloatArray = NDArray[np.float64]


def _rows(bandlimit: int, orders: tuple[int, int], x: FloatArray) -> FloatArray:
    """Return d^l_mn at cos(theta) = x for |m| = |n|, up to one sign; shape (bandlimit, points)."""
    m, n = orders
    rows = np.zeros((bandlimit, x.size))
    start = abs(m)
    if start >= bandlimit:
        return rows
    rows[start] = ((1 + x if m == n else 1 - x) / 2) ** start
    for el in range(start, bandlimit - 1):
        if el == 0:
            rows[1] = x
            continue
        # (eq-coupling-recursion); the root of the degree before is zero at the start.
        before = (el + 1) * (el**2 - m**2) * rows[el - 1]
        here = (2 * el + 1) * (el * (el + 1) * x - m * n) * rows[el]
        rows[el + 1] = (here - before) / (el * ((el + 1) ** 2 - m**2))
    return rows


def mode_coupling(
    mask_spectrum: ArrayLike, bandlimit: int, spin: int = 0
) -> tuple[FloatArray, FloatArray]:
    """Compute the matrices that take spectra to the expected spectra of masked fields.

    For P = Q + iU times a mask, <EE'> = same @ EE + mixed @ BB and <BB'> = mixed @ EE + same @ BB
    (eq-coupling), and for a real scalar <C'> = same @ C. Of a complex field of any spin the
    spectrum goes to (same + mixed) @ C.

    Parameters
    ----------
    mask_spectrum : array_like, shape (degrees,)
        W_l = sum_m ``|w_lm|**2`` / (2l+1) of the mask, such as `harmonics.power_spectrum` gives, to
        as high a degree as there is; more than 2 * bandlimit - 1 make no difference.
    bandlimit : int
        L of the spectra, before and after.
    spin : int
        Spin of the field.

    Returns
    -------
    same, mixed : ndarray, shape (bandlimit, bandlimit), float64
        Row: degree after masking; column: degree before. Zero below ``abs(spin)``; ``mixed`` is
        zero for spin 0.

    Raises
    ------
    ShapeError, DataError
        If the spectrum of the mask is no row of finite numbers.
    ParameterError
        If the bandlimit is no positive integer, or the spin not below it.

    Notes
    -----
    The integral over theta of three Wigner functions by Gauss-Legendre quadrature, exact; no 3j
    symbols are needed. Cost O(L^3).

    Examples
    --------
    >>> same, mixed = mode_coupling([4 * np.pi], 8, spin=2)  # no mask at all
    >>> bool(np.allclose(same[2:, 2:], np.eye(6))), bool(np.allclose(mixed, 0))
    (True, True)
    """
    bandlimit = check_bandlimit(bandlimit)
    spin = check_spin(spin, bandlimit)
    values = np.asarray(mask_spectrum)
    if values.ndim != 1 or not values.size or values.dtype.kind not in "buif":
        msg = f"mask_spectrum has shape {values.shape}; it must hold real W_l from l = 0 on."
        raise ShapeError(msg)
    if not np.isfinite(values).all():
        msg = "mask_spectrum holds values that are not finite; find out where they come from."
        raise DataError(msg)
    used = values[: 2 * bandlimit - 1].astype(np.float64)
    grid = GaussLegendre(2 * bandlimit - 1)
    nodes, weights = np.cos(grid.colatitudes), grid.weights * grid.n_phi / (2 * math.pi)
    legendre = _rows(used.size, (0, 0), nodes)
    correlation = (2 * np.arange(used.size) + 1) * used / (4 * math.pi) @ legendre
    density = correlation * weights / 2 * (2 * np.arange(bandlimit) + 1)[:, None]
    plus, minus = (
        rows @ (rows * density).T
        for rows in (_rows(bandlimit, (spin, sign * spin), nodes) for sign in (1, -1))
    )
    return (plus + minus) / 2, (plus - minus) / 2
