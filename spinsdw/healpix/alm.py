"""The order in which healpy keeps coefficients, and the sign of its E and B.

The package keeps coefficients at index ``el*el + el + m`` with both signs of m.  healpy keeps
those of real fields, ``m >= 0``, order by order.  ``lmax`` is always ``bandlimit - 1`` and
``mmax`` is ``lmax``.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ShapeError
from spinsdw.harmonics import bandlimit_of, check_flm, eb_to_spin, is_real_field, spin_to_eb

__all__ = ["alm_to_flm", "eb_alm_to_spin_flm", "flm_to_alm", "spin_flm_to_eb_alm"]

ComplexArray: TypeAlias = NDArray[np.complex128]

REALITY_ULPS = 1e6
"""How far coefficients may be from a real field's: rounding passes, another field does not."""


def alm_to_flm(alm: ArrayLike, bandlimit: int) -> ComplexArray:
    """Unfold healpy's coefficients of a real scalar field; the inverse is `flm_to_alm`.

    healpy stores ``m >= 0`` only, at index ``m (2 lmax + 1 - m) / 2 + el`` with
    ``lmax = bandlimit - 1``; the rest follows from ``f_{el,-m} = (-1)^m conj(f_{el,m})``.

    Parameters
    ----------
    alm : array_like, shape (..., bandlimit * (bandlimit + 1) / 2), complex
        [(el, m) for m in range(bandlimit) for el in range(m, bandlimit)]
    bandlimit : int
        One more than the largest degree.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Raises
    ------
    ShapeError
        If the number of coefficients does not belong to ``bandlimit``.

    Examples
    --------
    >>> alm_to_flm([1, 2, 3j], 2)
    array([1.+0.j, 0.+3.j, 2.+0.j, 0.+3.j])
    """
    values = np.asarray(alm, dtype=np.complex128)
    size = values.shape[-1] if values.ndim else 0
    if size != bandlimit * (bandlimit + 1) // 2:
        msg = (
            f"alm holds {size} coefficients but bandlimit={bandlimit} (lmax={bandlimit - 1}) "
            f"needs {bandlimit * (bandlimit + 1) // 2}; lmax is bandlimit - 1 and mmax is lmax."
        )
        raise ShapeError(msg)
    flm = np.empty((*values.shape[:-1], bandlimit**2), dtype=np.complex128)
    for m, column in enumerate(_columns(bandlimit)):
        el = np.arange(m, bandlimit)
        flm[..., el * el + el - m] = (-1) ** m * values[..., column].conj()
        flm[..., el * el + el + m] = values[..., column]
    return flm


def _columns(bandlimit: int) -> list[slice]:
    """Return where the coefficients of each order m lie in healpy's array."""
    starts = [m * (2 * bandlimit - 1 - m) // 2 + m for m in range(bandlimit + 1)]
    return [slice(starts[m], starts[m] + bandlimit - m) for m in range(bandlimit)]


def flm_to_alm(flm: ArrayLike) -> ComplexArray:
    """Fold the coefficients of a real scalar field into healpy's order.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2), complex
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Returns
    -------
    ndarray, shape (..., bandlimit * (bandlimit + 1) / 2), complex128
        [(el, m) for m in range(bandlimit) for el in range(m, bandlimit)]

    Raises
    ------
    ShapeError
        If the number of coefficients is not a square.
    DataError
        If the coefficients are not those of a real field, so that folding would lose something.

    Examples
    --------
    >>> flm_to_alm([1, 3j, 2, 3j])
    array([1.+0.j, 2.+0.j, 0.+3.j])
    """
    bandlimit = bandlimit_of(flm)
    values = check_flm(flm, bandlimit)
    if not is_real_field(values, REALITY_ULPS):
        msg = "flm breaks f_l,-m = (-1)^m conj(f_lm), so that folding would lose half of it."
        raise DataError(msg)
    alm = np.empty((*values.shape[:-1], bandlimit * (bandlimit + 1) // 2), dtype=np.complex128)
    for m, column in enumerate(_columns(bandlimit)):
        el = np.arange(m, bandlimit)
        alm[..., column] = values[..., el * el + el + m]
    return alm


def eb_alm_to_spin_flm(alm_e: ArrayLike, alm_b: ArrayLike) -> ComplexArray:
    """Join healpy's E and B to the coefficients of the spin field they describe.

    For every spin s > 0 healpy's ``alm2map_spin``, and for s = 2 its ``alm2map``, make the map
    ``Q + iU = -sum (E + iB) sYlm``, so ``f = -(E + iB)``.  At spin 0 ``alm2map`` has the plus sign
    and needs `alm_to_flm` alone, while ``alm2map_spin`` returns the negative of the field.

    Parameters
    ----------
    alm_e, alm_b : array_like, shape (..., bandlimit * (bandlimit + 1) / 2), complex
        [(el, m) for m in range(bandlimit) for el in range(m, bandlimit)]

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Raises
    ------
    ShapeError
        If the shapes differ, or their size belongs to no bandlimit with ``mmax = lmax``.

    Examples
    --------
    >>> eb_alm_to_spin_flm([0, 2, 0], [0, 0, 1j]).real.tolist()
    [0.0, 1.0, -2.0, 1.0]
    """
    shapes = np.shape(alm_e), np.shape(alm_b)
    if shapes[0] != shapes[1]:
        msg = f"alm_e has shape {shapes[0]} and alm_b {shapes[1]}, which must be the same."
        raise ShapeError(msg)
    size = shapes[0][-1] if shapes[0] else 0
    bandlimit = (math.isqrt(8 * size + 1) - 1) // 2
    if size == 0 or bandlimit * (bandlimit + 1) // 2 != size:
        msg = f"alm_e holds {size} coefficients, which fit no bandlimit; mmax must equal lmax."
        raise ShapeError(msg)
    return eb_to_spin(alm_to_flm(alm_e, bandlimit), alm_to_flm(alm_b, bandlimit))


def spin_flm_to_eb_alm(flm: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """Split the coefficients of a field of spin s > 0 into healpy's E and B.

    The inverse of `eb_alm_to_spin_flm`.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2), complex
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Returns
    -------
    alm_e, alm_b : ndarray, shape (..., bandlimit * (bandlimit + 1) / 2), complex128
        [(el, m) for m in range(bandlimit) for el in range(m, bandlimit)]

    Raises
    ------
    ShapeError, DataError
        If the last axis is no square long, or a value is not finite.

    Examples
    --------
    >>> alm_e, alm_b = spin_flm_to_eb_alm([0, 1, -2, 1])
    >>> alm_e.real.tolist(), alm_b.imag.tolist()
    ([0.0, 2.0, 0.0], [0.0, 0.0, 1.0])
    """
    e_flm, b_flm = spin_to_eb(flm)
    return flm_to_alm(e_flm), flm_to_alm(b_flm)
