"""The algebra of spherical-harmonic coefficients, without any sampling.

Coefficients of a field of any spin are one array ``flm`` whose last axis has ``bandlimit**2``
entries, in the order ``[(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]``. Axes
before the last are a batch. Equation labels are those of ``docs/conventions``.
"""

from __future__ import annotations

import math
import operator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ParameterError, ShapeError

__all__ = [
    "bandlimit_of",
    "check_flm",
    "check_integer",
    "conjugate_field",
    "degrees",
    "eb_to_spin",
    "index",
    "is_real_field",
    "lower_spin",
    "multiply_by_degree",
    "orders",
    "polarisation_factor",
    "power_spectrum",
    "raise_spin",
    "resize",
    "spin_to_eb",
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


def _check_bandlimit(bandlimit: object) -> int:
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


def _checked(flm: ArrayLike, name: str = "flm") -> tuple[ComplexArray, int]:
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
    el = np.arange(_check_bandlimit(bandlimit), dtype=np.int64)
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
    values, bandlimit = _checked(flm)
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
    values, _ = _checked(flm)
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
    e_values, _ = _checked(e_lm, "e_lm")
    b_values, _ = _checked(b_lm, "b_lm")
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
    values, _ = _checked(p_lm, "p_lm")
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
    el = np.arange(_check_bandlimit(bandlimit), dtype=np.float64)
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
    values, bandlimit = _checked(flm)
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
    values, bandlimit = _checked(flm)
    second = values if other is None else check_flm(other, bandlimit, "other")
    products = values.real * second.real + values.imag * second.imag
    el = np.arange(bandlimit)
    total: FloatArray = np.add.reduceat(products, el * el, axis=-1)
    return total / (2 * el + 1)


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
    values, old = _checked(flm)
    kept = min(old, _check_bandlimit(bandlimit)) ** 2
    result = np.zeros((*values.shape[:-1], bandlimit**2), dtype=np.complex128)
    result[..., :kept] = values[..., :kept]
    return result
