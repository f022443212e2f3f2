"""Gaussian E and B fields, beams and white noise, every one from an explicit seed.

The same seed gives the same numbers on every machine, whatever the number of threads, and the
same large scales at every bandlimit: coefficients are drawn degree by degree.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import check_integer, conjugate_field, eb_to_spin, multiply_by_degree
from spinsdw.healpix import check_nside, flm_to_map

__all__ = [
    "Seed",
    "gaussian_beam",
    "gaussian_flm",
    "random_flm",
    "random_wigner",
    "simulate_eb",
    "simulate_qu",
    "white_noise_qu",
]

FloatArray: TypeAlias = NDArray[np.float64]
ComplexArray: TypeAlias = NDArray[np.complex128]
Seed: TypeAlias = int | Sequence[int] | np.random.SeedSequence
"""A seed: numbers that are not negative, or a SeedSequence."""

ARCMIN = math.pi / 10800

# One stream each, so that sky and noise of one seed are independent.
E_STREAM, B_STREAM, NOISE_STREAM = range(3)


def _sequence(seed: Seed, *streams: int) -> np.random.SeedSequence:
    """Return the child of ``seed`` with the given key, leaving ``seed`` itself as it was."""
    if seed is None or isinstance(seed, bool | float):
        msg = f"seed={seed!r} must be an integer, integers or a SeedSequence; seed=1 will do."
        raise ParameterError(msg)
    try:
        root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    except (TypeError, ValueError) as error:
        msg = f"seed={seed!r} must hold integers of at least 0; seed=1 will do."
        raise ParameterError(msg) from error
    return np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, *streams))


def _check_spectrum(spectrum: ArrayLike, bandlimit: int, name: str) -> FloatArray:
    """Return the first ``bandlimit`` values of a power spectrum after checking them."""
    values = np.asarray(spectrum, dtype=np.float64)
    if values.ndim != 1 or values.size < bandlimit:
        msg = f"{name} has shape {values.shape} but must hold C_l for l = 0 to {bandlimit - 1}."
        raise ShapeError(msg)
    used = values[:bandlimit]
    bad = np.count_nonzero(~(np.isfinite(used) & (used >= 0)))
    if bad:
        msg = f"{name} holds {bad} values that are negative or not finite; a variance is neither."
        raise DataError(msg)
    return used


def gaussian_flm(
    spectrum: ArrayLike, bandlimit: int, *, seed: Seed, name: str = "spectrum"
) -> ComplexArray:
    """Draw the coefficients of a real Gaussian field with a given power spectrum.

    ``<|f_lm|^2> = C_l``.  Normal numbers are drawn in the order of the coefficients, so a larger
    bandlimit adds small scales and keeps the rest.

    Parameters
    ----------
    spectrum : array_like, shape (at least bandlimit,)
        C_l from l = 0 on, the square of the field's unit.
    bandlimit : int
        One more than the largest degree.
    seed : int, sequence of int or SeedSequence
        Where the random numbers start.
    name : str
        What an error calls the spectrum.

    Returns
    -------
    ndarray, shape (bandlimit**2,), complex128
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)], with the symmetry
        ``f_{el,-m} = (-1)^m conj(f_{el,m})`` of a real field.

    Raises
    ------
    ShapeError
        If the spectrum is too short.
    DataError
        If a value of the spectrum is negative or not finite.
    ParameterError
        If the bandlimit or the seed is not valid.

    Examples
    --------
    >>> spectrum = np.ones(8)
    >>> bool(np.all(gaussian_flm(spectrum, 8, seed=1)[:9] == gaussian_flm(spectrum, 3, seed=1)))
    True
    """
    bandlimit = check_integer(bandlimit, "bandlimit", minimum=1)
    amplitudes = np.sqrt(_check_spectrum(spectrum, bandlimit, name))
    normal = np.random.default_rng(_sequence(seed)).standard_normal(bandlimit**2)
    # For m > 0 the number at +m becomes the real part and that at -m the imaginary part; m < 0 and
    # the other half of m = 0 come from adding the conjugate field.
    el = np.arange(bandlimit)
    half = np.zeros(bandlimit**2, dtype=np.complex128)
    half[el * el + el] = normal[el * el + el] / 2
    for degree in range(1, bandlimit):
        centre = degree * degree + degree
        above = normal[centre + 1 : centre + degree + 1]
        below = normal[centre - degree : centre][::-1]
        half[centre + 1 : centre + degree + 1] = (above + 1j * below) / math.sqrt(2)
    return multiply_by_degree(half + conjugate_field(half), amplitudes)


def _complex_normal(seed: Seed, size: int) -> ComplexArray:
    """Draw independent numbers with <|z|^2> = 1, the same first ones for every size."""
    normal = np.random.default_rng(_sequence(seed)).standard_normal((size, 2))
    return np.asarray(normal.view(np.complex128)[:, 0] / math.sqrt(2))


def random_flm(
    bandlimit: int, spin: int = 0, *, seed: Seed, spectrum: ArrayLike | None = None
) -> ComplexArray:
    """Draw the coefficients of a complex Gaussian field of any spin: test signals.

    ``<|f_lm|^2> = C_l`` with independent real and imaginary parts and no symmetry between m and
    -m; for a real field see `gaussian_flm`, for E and B `simulate_eb`. A larger bandlimit adds
    small scales and keeps the rest.

    Parameters
    ----------
    bandlimit : int
        One more than the largest degree.
    spin : int
        Degrees below ``abs(spin)`` are zero.
    seed : int, sequence of int or SeedSequence
        Where the random numbers start.
    spectrum : array_like, shape (at least bandlimit,), optional
        C_l; 1 by default.

    Returns
    -------
    ndarray, shape (bandlimit**2,), complex128
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Raises
    ------
    ShapeError, DataError, ParameterError
        As `gaussian_flm`, or if the spin is no integer.

    Examples
    --------
    >>> flm = random_flm(8, 2, seed=1)
    >>> int(np.count_nonzero(flm)), bool(np.all(flm[:25] == random_flm(5, 2, seed=1)))
    (60, True)
    """
    bandlimit = check_integer(bandlimit, "bandlimit", minimum=1)
    spin = check_integer(spin, "spin", remedy="2 is that of Q + iU")
    c_l = np.ones(bandlimit) if spectrum is None else spectrum
    amplitudes = np.sqrt(_check_spectrum(c_l, bandlimit, "spectrum"))
    amplitudes[: abs(spin)] = 0
    return multiply_by_degree(_complex_normal(seed, bandlimit**2), amplitudes)


def random_wigner(
    bandlimit: int, orders: Sequence[int], *, seed: Seed, real: bool = False
) -> ComplexArray:
    """Draw the coefficients of a random function on the rotation group: test signals.

    Parameters
    ----------
    bandlimit : int
        One more than the largest degree.
    orders : sequence of int
        The orders n, one row each.
    seed : int, sequence of int or SeedSequence
        Where the random numbers start; each order has its own stream.
    real : bool
        Whether the function is real, ``W_{l,-m,-n} = (-1)^(m+n) conj(W_lmn)``; the orders must
        then be symmetric about 0.

    Returns
    -------
    ndarray, shape (orders, bandlimit**2), complex128
        ``<|W_lmn|^2> = 1``, independent but for the symmetry; zero below ``abs(n)``. As
        `spinsdw.WignerTransform` takes them.

    Raises
    ------
    ParameterError
        If the bandlimit, an order or the seed is not valid, or a real function has orders of one
        sign.

    Examples
    --------
    >>> random_wigner(4, (-1, 1), seed=1, real=True).shape
    (2, 16)
    """
    bandlimit = check_integer(bandlimit, "bandlimit", minimum=1)
    rows = [check_integer(n, "orders", remedy="each is one") for n in orders]
    if real and sorted(-n for n in rows) != sorted(rows):
        msg = f"real=True needs orders symmetric about 0, not {tuple(rows)}; add the missing signs."
        raise ParameterError(msg)
    # A stream for n and one for -n, whatever other orders there are.
    draws = [_complex_normal(_sequence(seed, abs(n), int(n < 0)), bandlimit**2) for n in rows]
    found = np.array(draws).reshape(len(rows), bandlimit**2)
    if real:
        opposite = found[[rows.index(-n) for n in rows]]
        signs = (-1.0) ** np.array(rows)[:, None]
        found = (found + signs * conjugate_field(opposite)) / math.sqrt(2)
    for row, n in zip(found, rows, strict=True):
        row[: min(abs(n), bandlimit) ** 2] = 0
    return found


def gaussian_beam(fwhm: float, bandlimit: int) -> FloatArray:
    """Return the harmonic factors of a Gaussian beam for polarisation.

    ``exp(-(l (l + 1) - 4) sigma^2 / 2)``, sigma = fwhm / sqrt(8 ln 2): the factor of a spin-2
    field, as the E and B columns of healpy's ``gauss_beam(pol=True)``.  A scalar field has no
    ``- 4``.

    Parameters
    ----------
    fwhm : float
        Full width at half maximum, radians, at least 0.
    bandlimit : int
        One more than the largest degree.

    Returns
    -------
    ndarray, shape (bandlimit,), float64
        One factor for each degree.

    Raises
    ------
    ParameterError
        If the width is negative or not finite, or the bandlimit no positive integer.

    Examples
    --------
    >>> float(gaussian_beam(np.radians(1), 129)[128])
    0.635
    """
    if not (math.isfinite(fwhm) and fwhm >= 0):
        msg = f"fwhm={fwhm} must be finite and at least 0 radians; np.radians(0.5) is 30 arcmin."
        raise ParameterError(msg)
    el = np.arange(check_integer(bandlimit, "bandlimit", minimum=1), dtype=np.float64)
    variance = fwhm**2 / (8 * math.log(2))
    factors: FloatArray = np.exp(-(el * (el + 1) - 4) * variance / 2)
    return factors


def simulate_eb(
    spectra_ee: ArrayLike,
    spectra_bb: ArrayLike,
    bandlimit: int,
    *,
    seed: Seed,
    beam_fwhm: float = 0.0,
) -> tuple[ComplexArray, ComplexArray]:
    """Draw independent Gaussian E and B fields and smooth them with a beam.

    Parameters
    ----------
    spectra_ee, spectra_bb : array_like, shape (at least bandlimit,)
        C_l from l = 0 on; degrees 0 and 1 are not used, for P has none.
    bandlimit : int
        One more than the largest degree.
    seed : int, sequence of int or SeedSequence
        One seed for both; each field has its own stream of it.
    beam_fwhm : float
        Width of the beam of `gaussian_beam`, radians; 0 for none.

    Returns
    -------
    e_lm, b_lm : ndarray, shape (bandlimit**2,), complex128
        Coefficients of real fields, in the unit of the root of the spectra.
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Raises
    ------
    ShapeError, DataError, ParameterError
        As `gaussian_flm` and `gaussian_beam` do.

    Examples
    --------
    >>> e_lm, b_lm = simulate_eb(np.ones(16), np.zeros(16), 16, seed=1)
    >>> bool(np.any(e_lm)), bool(np.any(b_lm))
    (True, False)
    """
    beam = gaussian_beam(beam_fwhm, bandlimit)
    beam[:2] = 0
    e_lm = gaussian_flm(spectra_ee, bandlimit, seed=_sequence(seed, E_STREAM), name="spectra_ee")
    b_lm = gaussian_flm(spectra_bb, bandlimit, seed=_sequence(seed, B_STREAM), name="spectra_bb")
    return multiply_by_degree(e_lm, beam), multiply_by_degree(b_lm, beam)


def simulate_qu(
    e_lm: ArrayLike, b_lm: ArrayLike, nside: int, *, threads: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Evaluate E and B coefficients as Stokes Q and U on HEALPix.

    Parameters
    ----------
    e_lm, b_lm : array_like, shape (..., bandlimit**2), complex
        Coefficients of real fields.
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]
    nside : int
        HEALPix resolution.
    threads : int, optional
        Threads of the transform.

    Returns
    -------
    q, u : ndarray, shape (..., 12 * nside**2), float64
        COSMO frame, RING order, unit of the coefficients; no pixel window.

    Raises
    ------
    ShapeError
        If the shapes differ or are no square long.
    ParameterError
        If ``nside`` is not a HEALPix resolution.

    Examples
    --------
    >>> e_lm = np.zeros(9)
    >>> e_lm[6] = 1
    >>> q, u = simulate_qu(e_lm, np.zeros(9), 4)
    >>> float(q.min()), bool(np.allclose(u, 0))
    (-0.386, True)
    """
    polarisation = flm_to_map(eb_to_spin(e_lm, b_lm), nside, 2, threads=threads)
    return polarisation.real.copy(), polarisation.imag.copy()


def white_noise_qu(nside: int, uk_arcmin: float, *, seed: Seed) -> tuple[FloatArray, FloatArray]:
    """Draw white noise for Stokes Q and U on HEALPix.

    Pixels are independent, with standard deviation ``uk_arcmin`` divided by the side of a pixel
    in arcmin.  White noise is not band-limited: a fit at any bandlimit leaves most of it behind.

    Parameters
    ----------
    nside : int
        HEALPix resolution.
    uk_arcmin : float
        Noise level of Q and of U, each, in uK arcmin (or another unit times arcmin), at least 0.
    seed : int, sequence of int or SeedSequence
        May be that of the sky: the noise has its own stream.

    Returns
    -------
    q, u : ndarray, shape (12 * nside**2,), float64
        uK, RING order.

    Raises
    ------
    ParameterError
        If a parameter is out of range.

    Examples
    --------
    >>> q, u = white_noise_qu(64, 10.0, seed=1)
    >>> bool(abs(q.std() - 10 / 54.97) < 0.003)
    True
    """
    if not (math.isfinite(uk_arcmin) and uk_arcmin >= 0):
        msg = f"uk_arcmin={uk_arcmin} must be finite and at least 0; 2.0 is a deep survey's."
        raise ParameterError(msg)
    npix = 12 * check_nside(nside) ** 2
    deviation = uk_arcmin * ARCMIN / math.sqrt(4 * math.pi / npix)
    generator = np.random.default_rng(_sequence(seed, NOISE_STREAM))
    q, u = deviation * generator.standard_normal((2, npix))
    return q, u
