"""What can be done to coefficients without any sampling: conjugate, split, change spin, sum."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from spinsdw.errors import ShapeError
from spinsdw.harmonics.layout import (
    ComplexArray,
    FloatArray,
    bandlimit_of,
    check_bandlimit,
    check_flm,
    check_integer,
    read_flm,
)

__all__ = [
    "conjugate_field",
    "eb_to_spin",
    "is_real_field",
    "lower_spin",
    "multiply_by_degree",
    "polarisation_factor",
    "power_spectrum",
    "raise_spin",
    "spin_to_eb",
]


def conjugate_field(flm: ArrayLike) -> ComplexArray:
    """Return the coefficients of the complex conjugate of a field of spin 0.

    They are ``(-1)**m conj(f[el, -m])``. Applied twice it changes nothing.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128

    Raises
    ------
    ShapeError, DataError
        As `check_flm`.

    Examples
    --------
    >>> conjugate_field([0, 1 + 2j, 0, 0])[3] == -(1 - 2j)
    np.True_
    """
    values, bandlimit = read_flm(flm)
    result = np.empty_like(values)
    for el in range(bandlimit):
        degree = slice(el * el, (el + 1) ** 2)
        np.conjugate(values[..., degree][..., ::-1], out=result[..., degree])
    # el**2 + el is even, so m is odd exactly where the index is.
    odd = result[..., 1::2]
    np.negative(odd, out=odd)
    return result


def is_real_field(flm: ArrayLike, ulps: float = 64.0) -> bool:
    """Return whether coefficients of spin 0 are those of a real field.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
    ulps : float
        The largest ``|f - conjugate_field(f)|`` let pass, in units of machine epsilon times the
        largest ``|f|``.

    Returns
    -------
    bool

    Raises
    ------
    ShapeError, DataError
        As `check_flm`.

    Examples
    --------
    >>> is_real_field([1, 1 + 2j, 3, -1 + 2j])
    True
    """
    values, _ = read_flm(flm)
    allowed = ulps * np.finfo(float).eps * np.max(np.abs(values), initial=0.0)
    return bool(np.max(np.abs(values - conjugate_field(values)), initial=0.0) <= allowed)


def eb_to_spin(e_lm: ArrayLike, b_lm: ArrayLike) -> ComplexArray:
    """Join E and B to the spin-2 coefficients of P = Q + iU: ``-(E + iB)`` (eq-eb).

    Parameters
    ----------
    e_lm, b_lm : array_like, shape (..., bandlimit**2)
        Spin-0 coefficients of one shape. `spin_to_eb` is the inverse where both are real fields.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        Degrees 0 and 1 follow the same rule; no field of spin 2 has them.

    Raises
    ------
    ShapeError
        If a last axis is not a perfect square long, or the shapes differ.
    DataError
        As `check_flm`.

    Examples
    --------
    >>> eb_to_spin([0, 1, 2j, 1], [0, 1, 2, 3]).tolist()
    [0j, (-1-1j), -4j, (-1-3j)]
    """
    e_values, _ = read_flm(e_lm, "e_lm")
    b_values, _ = read_flm(b_lm, "b_lm")
    if e_values.shape != b_values.shape:
        msg = (
            f"e_lm has shape {e_values.shape} and b_lm {b_values.shape}, and they must agree; "
            "harmonics.resize changes the bandlimit."
        )
        raise ShapeError(msg)
    return 0.0 - (e_values + 1j * b_values)


def spin_to_eb(p_lm: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """Split the spin-2 coefficients of P = Q + iU into E and B (eq-eb-inverse).

    Parameters
    ----------
    p_lm : array_like, shape (..., bandlimit**2)

    Returns
    -------
    e_lm, b_lm : ndarray, shape (..., bandlimit**2), complex128
        Spin-0 coefficients of real fields. `eb_to_spin` is the inverse.

    Raises
    ------
    ShapeError, DataError
        As `check_flm`.

    Examples
    --------
    >>> e_lm, b_lm = spin_to_eb(eb_to_spin([1, 1, 0, -1], [2, 1j, 3, 1j]))
    >>> e_lm.real.tolist(), b_lm.imag.tolist()
    ([1.0, 1.0, 0.0, -1.0], [0.0, 1.0, 0.0, 1.0])
    """
    values, _ = read_flm(p_lm, "p_lm")
    conjugate = conjugate_field(values)
    return -0.5 * (values + conjugate), 0.5j * (values - conjugate)


def polarisation_factor(bandlimit: int) -> FloatArray:
    """Return N_l = sqrt((l+2)!/(l-2)!), which turns E and B into their derivatives (eq-eb-tilde).

    Parameters
    ----------
    bandlimit : int

    Returns
    -------
    ndarray, shape (bandlimit,), float64
        One value for each degree; zero at degrees 0 and 1.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is not an integer of at least 1.

    Examples
    --------
    >>> (polarisation_factor(4) ** 2).round().tolist()
    [0.0, 0.0, 24.0, 120.0]
    """
    el = np.arange(check_bandlimit(bandlimit), dtype=np.float64)
    return np.sqrt(np.maximum((el + 2) * (el + 1) * el * (el - 1), 0.0))


def multiply_by_degree(flm: ArrayLike, factor: ArrayLike) -> ComplexArray:
    """Multiply every coefficient by a factor of its degree alone.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
    factor : array_like, shape (bandlimit,)
        Real or complex, such as a beam.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128

    Raises
    ------
    ShapeError
        If ``factor`` has another shape than ``(bandlimit,)``.
    DataError
        As `check_flm`.

    Examples
    --------
    >>> multiply_by_degree([1, 1, 1, 1], [2, 3]).real.tolist()
    [2.0, 3.0, 3.0, 3.0]
    """
    values, bandlimit = read_flm(flm)
    weights = np.asarray(factor)
    if weights.shape != (bandlimit,):
        msg = (
            f"factor has shape {weights.shape}, and must have shape ({bandlimit},) like the "
            "degrees of flm; pass one value for each degree."
        )
        raise ShapeError(msg)
    el = np.arange(bandlimit)
    return np.asarray(values * np.repeat(weights, 2 * el + 1), dtype=np.complex128)


def _ladder(bandlimit: int, spin: int) -> FloatArray:
    """sqrt((l-s)(l+s+1)): the step from spin s to s + 1, zero where either has no harmonic."""
    el = np.arange(bandlimit, dtype=np.float64)
    return np.sqrt(np.maximum((el - spin) * (el + spin + 1), 0.0))


def raise_spin(flm: ArrayLike, spin: int) -> ComplexArray:
    """Apply eth: from a field of spin ``spin`` to one of spin ``spin + 1`` (eq-eth).

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
    spin : int
        The spin of ``flm``.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        ``sqrt((el - spin) * (el + spin + 1)) * flm``, zero below both spins. Minus `lower_spin`
        from ``spin + 1`` is the adjoint.

    Raises
    ------
    ParameterError
        If ``spin`` is not an integer.
    ShapeError, DataError
        As `check_flm`.

    Examples
    --------
    >>> (raise_spin([1, 1, 1, 1], 0).real ** 2).round().tolist()
    [0.0, 2.0, 2.0, 2.0]
    """
    spin = check_integer(spin, "spin")
    return multiply_by_degree(flm, _ladder(bandlimit_of(flm), spin))


def lower_spin(flm: ArrayLike, spin: int) -> ComplexArray:
    """Apply eth-bar: from a field of spin ``spin`` to one of spin ``spin - 1`` (eq-eth).

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
    spin : int
        The spin of ``flm``.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        ``-sqrt((el + spin) * (el - spin + 1)) * flm``, zero below both spins. Minus `raise_spin`
        from ``spin - 1`` is the adjoint.

    Raises
    ------
    ParameterError
        If ``spin`` is not an integer.
    ShapeError, DataError
        As `check_flm`.

    Examples
    --------
    >>> lower_spin([0, 0, 2, 0], 1).real.round(3).tolist()
    [0.0, 0.0, -2.828, 0.0]
    """
    spin = check_integer(spin, "spin")
    return multiply_by_degree(flm, 0.0 - _ladder(bandlimit_of(flm), spin - 1))


def power_spectrum(flm: ArrayLike, other: ArrayLike | None = None) -> FloatArray:
    """Return the power at each degree, or the cross power of two fields.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
    other : array_like, shape (..., bandlimit**2), optional
        The second field; ``flm`` itself by default. Batches are broadcast.

    Returns
    -------
    ndarray, shape (..., bandlimit), float64
        ``sum_m Re(f conj(g)) / (2 el + 1)``, in the square of the unit of ``flm``.

    Raises
    ------
    ShapeError
        If the bandlimits differ.
    DataError
        As `check_flm`.

    Examples
    --------
    >>> power_spectrum([2, 1, 1j, 1]).tolist()
    [4.0, 1.0]
    """
    values, bandlimit = read_flm(flm)
    second = values if other is None else check_flm(other, bandlimit, "other")
    products = values.real * second.real + values.imag * second.imag
    el = np.arange(bandlimit)
    total: FloatArray = np.add.reduceat(products, el * el, axis=-1)
    return total / (2 * el + 1)
