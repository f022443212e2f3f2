"""The power of a map at each scale and orientation, with weights where not all is trusted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.sampling import Sampling
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["scale_spectra", "sphere_mean"]

Array = NDArray[Any]


def sphere_mean(values: Array, grid: Sampling) -> Array:
    """Return the mean over the sphere by the grid's weights; the last two axes go."""
    return np.asarray(grid.integrate(values) / (4 * np.pi))


def scale_spectra(
    transform: SpinWaveletTransform,
    coefficients: WaveletCoefficients,
    other: WaveletCoefficients | None = None,
    *,
    weights: Mapping[Any, Any] | None = None,
) -> dict[int | str, Array]:
    """Measure the mean power of each scale at each orientation, or that of two maps in common.

    S_jk = sum_p a_p w_p W_p conj(V_p) / sum_p a_p w_p over the places p of a scale, a_p the area
    of a sample (eq-scale-spectrum). For an isotropic field its expectation is `wavelet_variance`
    whatever the weights are.

    Parameters
    ----------
    transform : SpinWaveletTransform
        What made the coefficients.
    coefficients : WaveletCoefficients
        W.
    other : WaveletCoefficients, optional
        V; W itself by default. Of two maps with independent noise the noise averages out.
    weights : mapping of int or "scaling" to array, optional
        w >= 0, broadcasting to the part, (directions, rings, phi): small where a wavelet sees what
        is masked, such as the weights of `spinsdw.EBMaps`. 1 for parts that are not named.

    Returns
    -------
    dict
        "scaling" -> shape (...), j -> shape (..., directions); float64, or complex128 for two
        maps. The square of the unit; NaN where all weights are zero.

    Raises
    ------
    ShapeError
        If the coefficients are not the transform's, or weights do not fit.
    ParameterError
        If weights are named for no part.
    DataError
        If a weight is negative or not finite.

    Examples
    --------
    >>> from spinsdw.simulation import gaussian_flm
    >>> transform = SpinWaveletTransform(32, directions=3)
    >>> found = scale_spectra(transform, transform.analysis_harmonic(gaussian_flm(np.ones(32), 32,
    ...                                                                           seed=1)))
    >>> found[4].shape
    (3,)
    """
    arrays = transform.arrays(coefficients)
    others = arrays if other is None else transform.arrays(other)
    if arrays["scaling"].shape != others["scaling"].shape:
        msg = "coefficients and other have different batches, which must be the same."
        raise ShapeError(msg)
    given = {} if weights is None else weights
    unknown = set(given) - set(arrays)
    if unknown:
        msg = f"weights for {sorted(map(str, unknown))} match no scale of {transform.scales}."
        raise ParameterError(msg)
    found: dict[int | str, Array] = {}
    for key, values in arrays.items():
        grid, shape = transform.part_grid(key), transform.shapes[key]
        areas = _areas(given.get(key, 1.0), grid, shape, key)
        total = np.sum(areas, axis=(-2, -1))
        products = values * others[key].conj()
        products = products.real if other is None else products
        sums = np.sum(areas * products, axis=(-2, -1))
        found[key] = np.divide(sums, total, out=np.full_like(sums, np.nan), where=total > 0)
    return found


def _areas(weights: object, grid: Sampling, shape: tuple[int, ...], key: int | str) -> Array:
    """Return area times weight of every sample of a part."""
    values = np.asarray(weights)
    try:
        full = np.broadcast_to(values, shape)
    except ValueError:
        msg = f"weights for {key} have shape {values.shape}; they must broadcast to {shape}."
        raise ShapeError(msg) from None
    if full.dtype.kind not in "buif" or not np.all(np.isfinite(full) & (full >= 0)):
        msg = f"weights for {key} must be finite real numbers of at least 0."
        raise DataError(msg)
    return np.asarray(full * grid.weights[:, None])
