"""Wavelet coefficients at the pixels of a HEALPix map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.directionality import Orientations
from spinsdw.errors import ParameterError
from spinsdw.harmonics import degrees
from spinsdw.healpix.grids import flm_to_map
from spinsdw.healpix.pixels import check_nside
from spinsdw.sampling import Sampling
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform

__all__ = ["coefficients_to_healpix", "samples_to_healpix"]

Array = NDArray[Any]


def coefficients_to_healpix(
    transform: SpinWaveletTransform,
    coefficients: WaveletCoefficients,
    scale: int | str,
    nside: int,
) -> Array:
    """Evaluate the coefficients of one scale at the pixel centres of HEALPix, exactly.

    W(theta, phi, gamma_k) = sum_n e^{i n gamma_k} W_n(theta, phi), and W_n is a field of spin -n
    (eq-separation); nothing is interpolated.

    Parameters
    ----------
    transform : SpinWaveletTransform
        What made the coefficients.
    coefficients : WaveletCoefficients
        Band-limited, as an analysis returns them; of others it is what a synthesis sees.
    scale : int or "scaling"
        The part wanted.
    nside : int
        Resolution; it may be coarse, for no transform back is meant.

    Returns
    -------
    ndarray, shape (..., directions, 12 * nside**2), complex128 (float64 if ``transform.real``)
        RING order, each orientation gamma_k a map; without the axis of directions for the scaling
        part. Leading axes are the batch. Of single precision for coefficients of that.

    Raises
    ------
    ParameterError
        If there is no such scale, or ``nside`` is no HEALPix resolution.
    ShapeError, DataError
        If the coefficients are not the transform's.

    Examples
    --------
    >>> transform = SpinWaveletTransform(16, spin=2, directions=3)
    >>> coefficients = transform.analysis_harmonic(np.ones(256))
    >>> coefficients_to_healpix(transform, coefficients, 2, nside=4).shape
    (3, 192)
    """
    arrays = transform.arrays(coefficients)
    if not isinstance(scale, int | np.integer | str) or scale not in arrays:
        msg = f"scale={scale!r} is not held; give 'scaling' or one of {transform.scales}."
        raise ParameterError(msg)
    is_scaling = scale == "scaling"
    orientations = None if is_scaling else transform.wavelets.orientations_of(int(scale))
    grid = transform.part_grid(scale)
    return samples_to_healpix(arrays[scale], grid, orientations, nside, threads=transform.threads)


def samples_to_healpix(
    values: Array,
    grid: Sampling,
    orientations: Orientations | None,
    nside: int,
    *,
    threads: int | None = None,
) -> Array:
    """Evaluate one part's samples at the pixel centres; `coefficients_to_healpix` says how.

    Parameters
    ----------
    values : ndarray, shape (..., orientations, rings, phi), or (..., rings, phi)
        The samples, real or complex.
    grid : Sampling
        Where they are.
    orientations : Orientations or None
        Theirs; None for a scaling part.
    nside : int
        Resolution.
    threads : int, optional
        Threads to use; all cores when None.

    Returns
    -------
    ndarray, shape (..., orientations, 12 * nside**2), or (..., 12 * nside**2)
        RING order, of the type of ``values``.
    """
    nside = check_nside(nside)
    if orientations is None:
        real = bool(np.isrealobj(values))
        harmonic = SpinHarmonicTransform(grid.bandlimit, sampling=grid, real=real, threads=threads)
        maps = flm_to_map(harmonic.analysis(values), nside, real=real, threads=threads)
        return np.asarray(maps, dtype=values.dtype)
    rows = values.reshape(-1, *values.shape[-3:])
    found = [_scale_maps(row, grid, orientations, nside, threads) for row in rows]
    return np.array(found, dtype=values.dtype).reshape(*values.shape[:-2], 12 * nside**2)


def _scale_maps(
    values: Array, grid: Sampling, orientations: Orientations, nside: int, threads: int | None
) -> Array:
    """Return the maps of one signal, shape (orientations, pixels)."""
    orders = tuple(n for n in orientations.orders if abs(n) < grid.bandlimit)
    maps = np.zeros((orientations.count, 12 * nside**2), dtype=values.dtype)
    if not orders:
        return maps
    real = bool(np.isrealobj(values))
    wigner = WignerTransform(grid.bandlimit, orders, sampling=grid, real=real, threads=threads)
    weights = orientations.steering_weights(wigner.gammas)
    coefficients = wigner.analysis(np.einsum("gk,ktp->gtp", weights, values))
    factor = np.sqrt((2 * degrees(grid.bandlimit) + 1) / (4 * np.pi)) / (2 * np.pi)
    for n, row in zip(orders, coefficients, strict=True):
        # Of real coefficients the orders n and -n are conjugate fields.
        if real and n < 0:
            continue
        part = flm_to_map((-1) ** n * factor * row, nside, -n, threads=threads)
        phases = np.exp(1j * n * orientations.angles)[:, None]
        if real:
            maps += (2 if n else 1) * (phases * part).real
        else:
            maps += phases * part
    return maps
