"""Energies of wavelet coefficients: integrals over the rotation group, which a plain sum is not.

    ``integral |W|^2 d rho = (2 pi / K) sum_k integral |W(theta, phi, gamma_k)|^2 d Omega``

with K orientations. The Fourier columns F_m(theta) of one orientation are trigonometric polynomials
of parity (-1)^(m + n), n any of its orders, so the sampling's own quadrature in theta integrates
the product of two of them exactly, in O(L^2 log L).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import ShapeError
from spinsdw.fourier import fill_maps_columns, to_orders
from spinsdw.sampling import Sampling
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["energies", "inner_product", "norm"]

Array = np.ndarray[Any, Any]


def _columns(maps: Array, grid: Sampling) -> Array:
    """Return F_m(theta_t) times the points of a ring, shape (maps, m, rings)."""
    n_m = grid.n_phi if np.iscomplexobj(maps) else grid.n_phi // 2 + 1
    columns = np.empty((maps.shape[0], n_m, grid.n_rings), dtype=np.complex128)
    fill_maps_columns(maps, columns)
    return columns


def _copies(grid: Sampling, n_m: int) -> Array:
    """Count the orders that each column stands for: m and -m of a real map."""
    copies = np.full(n_m, 1.0 if n_m == grid.n_phi else 2.0)
    copies[0] = 1.0
    if grid.n_phi % 2 == 0:
        copies[grid.n_phi // 2] = 1.0
    return copies


def _integrate(first: Array, second: Array, grid: Sampling, orders: tuple[int, ...]) -> Array:
    """Return the integral over the sphere of first * conj(second) for each of the maps.

    ``first``, ``second``: shape (maps, rings, phi), both real or both complex, whose Fourier
    columns have parity (-1)^(m + n) in theta, n the order of each.
    """
    left = _columns(first, grid)
    right = left.copy() if second is first else _columns(second, grid)
    identity = np.eye(len(first), dtype=np.complex128)
    grid.weigh_columns(left, orders, mixing=identity, threads=1)
    copies = _copies(grid, left.shape[1]) / grid.n_phi
    found = np.einsum("kmt,kmt,m->k", left, right.conj(), copies)
    return found if np.iscomplexobj(first) else found.real


def _by_order(maps: Array) -> Array:
    """Return maps by order 0, 1, ..., -1 from maps by orientation: a unitary transform."""
    spectrum = maps.astype(np.complex128)
    to_orders(spectrum, spectrum)
    return spectrum / np.sqrt(len(maps))


def _products(one: Array, other: Array, transform: SpinWaveletTransform, key: int | str) -> Array:
    """Return the integral of one * conj(other) at each orientation, shape (..., orientations)."""
    is_scaling = key == "scaling"
    grid = transform.part_grid(key)
    step: int = 2
    orders: tuple[int, ...] = (0,)
    if not is_scaling:
        orientations = transform.wavelets.orientations_of(int(key))
        step, orders = orientations.step, (orientations.largest_order,) * orientations.count
    if step == 1:
        orders = (*range(len(orders) // 2 + 1), *range(-(len(orders) // 2), 0))
    rows = one.reshape(-1, *transform.shapes[key]), other.reshape(-1, *transform.shapes[key])
    found = np.empty(one.shape[:-2], dtype=np.result_type(one, np.float64))
    products = found.reshape(len(rows[0]), len(orders))
    for product, first, second in zip(products, *rows, strict=True):
        maps = first.reshape(-1, *grid.shape)
        others = maps if other is one else second.reshape(-1, *grid.shape)
        if step == 1:
            maps = _by_order(maps)
            others = maps if other is one else _by_order(others)
        values = _integrate(maps, others, grid, orders)
        product[...] = values if np.iscomplexobj(found) else values.real
    return found if is_scaling else found * (2 * np.pi / len(orders))


def _all_products(
    transform: SpinWaveletTransform, one: WaveletCoefficients, other: WaveletCoefficients
) -> dict[int | str, Array]:
    first = transform.arrays(one)
    second = first if other is one else transform.arrays(other)
    if first["scaling"].shape != second["scaling"].shape:
        msg = (
            f"coefficients have the batches {first['scaling'].shape[:-2]} and "
            f"{second['scaling'].shape[:-2]}, which must be the same."
        )
        raise ShapeError(msg)
    return {key: _products(first[key], second[key], transform, key) for key in first}


def energies(
    transform: SpinWaveletTransform, coefficients: WaveletCoefficients
) -> dict[int | str, Array]:
    """Compute the energy of the scaling part, and of every scale at every orientation.

    All of them add up to the energy of the signal, ``sum |f_lm|^2`` (eq-parseval).

    Parameters
    ----------
    transform : SpinWaveletTransform
        What made the coefficients.
    coefficients : WaveletCoefficients
        Band-limited, as an analysis returns them. Of others, such as thresholded ones, it is the
        energy of the trigonometric polynomials through the samples.

    Returns
    -------
    dict
        "scaling" -> shape (...), j -> shape (..., directions), float64, the square of the
        signal's unit; leading axes are the batch. An orientation is counted from the meridian, so
        its share depends on the frame; the sum over orientations does not. Of curvelets that are
        not centred, whose orientations no quadrature keeps apart, it is the energy of each order
        n = 0, 1, ..., -1 instead: the sum is the same.

    Raises
    ------
    ShapeError, ParameterError, DataError
        If the coefficients are not the transform's.

    Examples
    --------
    >>> transform = SpinWaveletTransform(16, spin=2, directions=3)
    >>> flm = np.ones(256)
    >>> flm[:4] = 0
    >>> found = energies(transform, transform.analysis_harmonic(flm))
    >>> found[2].shape
    (3,)
    >>> float(sum(np.sum(values) for values in found.values()).round(10))
    252.0
    """
    products = _all_products(transform, coefficients, coefficients)
    # Rounding may leave the integral of a square below zero.
    return {key: np.maximum(values.real, 0.0) for key, values in products.items()}


def inner_product(
    transform: SpinWaveletTransform, one: WaveletCoefficients, other: WaveletCoefficients
) -> Array:
    """Compute <one, other>, the inner product that analysis preserves.

    Parameters
    ----------
    transform : SpinWaveletTransform
        What made both.
    one, other : WaveletCoefficients
        Of one batch.

    Returns
    -------
    ndarray, shape (...), complex128 (float64 if ``transform.real``)
        ``sum f_lm conj(g_lm)`` for the analyses of f and g; one number for each of the batch.

    Raises
    ------
    ShapeError, ParameterError, DataError
        If the coefficients are not the transform's, or their batches differ.

    Examples
    --------
    >>> transform = SpinWaveletTransform(8, directions=2)
    >>> one = transform.analysis_harmonic(np.ones(64))
    >>> float(inner_product(transform, one, 1j * one).imag.round(10))
    -64.0
    """
    products = _all_products(transform, one, other)
    scaling = products.pop("scaling")
    return np.asarray(scaling + sum(np.sum(values, axis=-1) for values in products.values()))


def norm(transform: SpinWaveletTransform, coefficients: WaveletCoefficients) -> Array:
    """Compute the norm that analysis preserves: the root of the sum of all `energies`.

    Parameters
    ----------
    transform : SpinWaveletTransform
        What made the coefficients.
    coefficients : WaveletCoefficients
        As `energies` takes them.

    Returns
    -------
    ndarray, shape (...), float64
        One norm for each of the batch. `WaveletCoefficients.norm` is the plain sum over the samples
        instead, which weighs the poles like the equator.

    Raises
    ------
    ShapeError, ParameterError, DataError
        If the coefficients are not the transform's.

    Examples
    --------
    >>> transform = SpinWaveletTransform(8, directions=2)
    >>> float(norm(transform, transform.analysis_harmonic(np.ones(64))).round(10))
    8.0
    """
    found = energies(transform, coefficients)
    scaling = found.pop("scaling")
    return np.asarray(np.sqrt(scaling + sum(np.sum(values, axis=-1) for values in found.values())))
