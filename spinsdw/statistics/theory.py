"""Variances and covariances of the wavelet coefficients of an isotropic field."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import DataError, ShapeError
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wavelets import Wavelets

__all__ = ["check_spectrum", "covariance_function", "wavelet_covariance", "wavelet_variance"]

FloatArray = NDArray[np.float64]
Array = NDArray[Any]


def check_spectrum(spectrum: ArrayLike, bandlimit: int, name: str = "spectrum") -> FloatArray:
    """Return C_l for l = 0..bandlimit - 1 as float64 after checking it."""
    values = np.asarray(spectrum)
    if values.ndim != 1 or values.size < bandlimit or values.dtype.kind not in "buif":
        msg = (
            f"{name} has shape {values.shape} and dtype {values.dtype}; it must hold real C_l for "
            f"l = 0 to {bandlimit - 1}."
        )
        raise ShapeError(msg)
    used = values[:bandlimit].astype(np.float64)
    if not np.isfinite(used).all():
        msg = f"{name} holds values that are not finite; set those of no interest to 0."
        raise DataError(msg)
    return used


def wavelet_variance(wavelets: Wavelets, spectrum: ArrayLike) -> dict[int | str, float]:
    """Return the variance of the coefficients of every scale, for a given power spectrum.

    ``<|W^j|^2> = sum_ln C_l |psi^j_ln|^2``, the same at every place and orientation (eq-variance).

    Parameters
    ----------
    wavelets : Wavelets
        Such as ``transform.wavelets``.
    spectrum : array_like, shape (at least bandlimit,)
        ``C_l = <|f_lm|^2>`` from l = 0 on, of the spin field itself: for P = Q + iU EE + BB.
        EE alone gives the variance of the real part of W, which is that of the scalar E, and BB
        that of the imaginary part; a cross spectrum gives the covariance of two fields'
        coefficients, and may be negative.

    Returns
    -------
    dict of "scaling" and int to float
        The square of the field's unit.

    Raises
    ------
    ShapeError
        If the spectrum is too short.
    DataError
        If a value is not finite.

    Examples
    --------
    >>> from spinsdw.directionality import SteerableDirectionality
    >>> from spinsdw.tiling import ScaleDiscretisedTiling
    >>> wavelets = Wavelets(ScaleDiscretisedTiling(8), SteerableDirectionality(3), spin=2)
    >>> kernel = wavelets.tiling.kernel(2)
    >>> expected = np.sum((2 * np.arange(8) + 1) / (8 * np.pi**2) * kernel**2)
    >>> bool(np.isclose(wavelet_variance(wavelets, np.ones(8))[2], expected))
    True
    """
    c_l = check_spectrum(spectrum, wavelets.bandlimit)
    found: dict[int | str, float] = {"scaling": float(np.sum(wavelets.scaling_harmonics**2 * c_l))}
    for j in wavelets.scales:
        psi = wavelets.wavelet_harmonics(j)
        found[j] = float(np.sum(np.abs(psi) ** 2 @ c_l[: psi.shape[1]]))
    return found


def wavelet_covariance(
    wavelets: Wavelets, spectrum: ArrayLike, scale: int, other: int | None = None
) -> Array:
    """Return the covariance of coefficients at one place between orientations, and scales.

    <W^j(gamma) conj(W^j'(gamma'))> = sum_ln C_l conj(psi^j_ln) psi^j'_ln e^{i n (gamma - gamma')}
    (eq-covariance).

    Parameters
    ----------
    wavelets : Wavelets
        Such as ``transform.wavelets``.
    spectrum : array_like, shape (at least bandlimit,)
        As for `wavelet_variance`.
    scale : int
        j.
    other : int, optional
        j', the same as j by default.

    Returns
    -------
    ndarray, shape (orientations of j, orientations of j'), complex128
        Row gamma_k, column gamma'_k. Real for steerable wavelets.

    Raises
    ------
    ShapeError, DataError
        As `wavelet_variance`.
    ParameterError
        If there is no such scale.

    Examples
    --------
    >>> from spinsdw.directionality import SteerableDirectionality
    >>> from spinsdw.tiling import ScaleDiscretisedTiling
    >>> wavelets = Wavelets(ScaleDiscretisedTiling(8), SteerableDirectionality(2), spin=2)
    >>> found = wavelet_covariance(wavelets, np.ones(8), 2)
    >>> found.shape, bool(np.isclose(found[0, 0].real, wavelet_variance(wavelets, np.ones(8))[2]))
    ((2, 2), True)
    """
    c_l = check_spectrum(spectrum, wavelets.bandlimit)
    other = scale if other is None else other
    first, second = wavelets.wavelet_harmonics(scale), wavelets.wavelet_harmonics(other)
    size = min(first.shape[1], second.shape[1])
    left, right = wavelets.orientations_of(scale), wavelets.orientations_of(other)
    products = (first[:, :size].conj() * c_l[:size]) @ second[:, :size].T
    # Place by place orders are independent: n of one goes with n of the other.
    same = np.equal.outer(left.orders, right.orders)
    ours, theirs = left.orders_to_orientations, right.orders_to_orientations
    return np.asarray(ours @ np.where(same, products, 0) @ theirs.conj().T)


def covariance_function(
    transform: SpinWaveletTransform, spectrum: ArrayLike, scale: int
) -> WaveletCoefficients:
    """Return the covariance of all coefficients with one at the north pole.

    <W^j'(rho) conj(W^j(1))> is the analysis of the field with coefficients C_l psi^j_lm
    (eq-covariance-function). By isotropy it tells the covariance of any two, from the rotation
    between them.

    Parameters
    ----------
    transform : SpinWaveletTransform
        The wavelets and the places wanted.
    spectrum : array_like, shape (at least bandlimit,)
        As for `wavelet_variance`.
    scale : int
        j, the scale of the coefficient at the pole, at orientation 0.

    Returns
    -------
    WaveletCoefficients
        The covariance at each scale j', place and orientation.

    Raises
    ------
    ShapeError, DataError
        As `wavelet_variance`.
    ParameterError
        If there is no such scale.

    Examples
    --------
    >>> transform = SpinWaveletTransform(8, spin=2, directions=3, sampling="mwss")
    >>> found = covariance_function(transform, np.ones(8), 2)
    >>> variance = wavelet_variance(transform.wavelets, np.ones(8))[2]
    >>> bool(np.isclose(found[2][0, 0, 0], variance))
    True
    """
    c_l = check_spectrum(spectrum, transform.bandlimit)
    psi = transform.wavelets.wavelet_harmonics(scale)
    flm = np.zeros(transform.bandlimit**2, dtype=np.complex128)
    for row, n in zip(psi, transform.wavelets.orientations_of(scale).orders, strict=True):
        el = np.arange(abs(n), psi.shape[1])
        flm[el * el + el + n] = (row * c_l[: row.size])[abs(n) :]
    return transform.analysis_harmonic(flm)
