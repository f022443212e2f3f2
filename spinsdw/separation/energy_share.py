"""The share of each wavelet's energy that falls where the sky is not observed.

For a wavelet psi moved to rho = (alpha, beta, gamma) and a mask M the share is

    f(rho) = <1 - M, R_rho |psi|^2> / <1, |psi|^2>,

between 0 and 1. |psi|^2 is a scalar function of bandlimit 2 L_j - 1, with even orders up to
2 (N - 1) only, so f is one correlation on the rotation group, computed as a wavelet analysis of
1 - M is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from spinsdw.fourier import from_series
from spinsdw.parallel import resolve_threads
from spinsdw.ring_engine import OrderSums, RingEngine
from spinsdw.sampling.base import Sampling
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["correlate_with_energy", "energy_shares", "wavelet_energy"]

Array = np.ndarray[Any, Any]


def wavelet_energy(psi: Array, orders: tuple[int, ...], spin: int, threads: int | None) -> Array:
    """Return the coefficients of |psi|^2, bandlimit 2 L - 1, from psi_ln of shape (orders, L).

    Parameters
    ----------
    psi : ndarray, shape (orders, L), complex128
        Coefficients of a function of the given spin at the orders n.
    orders : tuple of int
        The orders n.
    spin : int
        Spin of the function.
    threads : int or None
        Threads of the transforms.

    Returns
    -------
    ndarray, shape ((2 L - 1)**2,), complex128
        Coefficients of the real field |psi|^2.
    """
    size = psi.shape[1]
    bandlimit = max(2 * size - 1, abs(spin) + 1)
    flm = np.zeros(bandlimit**2, dtype=np.complex128)
    for row, n in zip(psi, orders, strict=True):
        el = np.arange(abs(n), size)
        flm[el**2 + el + n] = row[abs(n) :]
    values = SpinHarmonicTransform(bandlimit, spin, threads=threads).synthesis(flm)
    energy = SpinHarmonicTransform(bandlimit, 0, real=True, threads=threads)
    return energy.analysis(values.real**2 + values.imag**2)


def correlate_with_energy(
    holes: Array, energy: Array, grid: Sampling, gammas: Array, *, threads: int | None
) -> Array:
    """Return <holes, R_rho energy> / <1, energy> at the points of a grid and angles gamma.

    Parameters
    ----------
    holes, energy : ndarray, shape (D**2,), complex128
        Coefficients of real fields of one bandlimit D; energy has even orders only.
    grid : Sampling
        Positions; its own bandlimit may be smaller than D.
    gammas : ndarray, shape (N,)
        Orientations in radians; |q| <= 2 (N - 1) for the orders of energy.

    Returns
    -------
    ndarray, shape (N, rings, phi), float64
        The correlation; for 0 <= holes <= 1 a share between 0 and 1.
    """
    from spinsdw.compiled.folding import fill_folded

    bandlimit = int(np.sqrt(holes.size))
    largest = min(2 * (gammas.size - 1), 2 * ((bandlimit - 1) // 2))
    orders = tuple(range(-largest, largest + 1, 2))
    weights = np.zeros((len(orders), bandlimit), dtype=np.complex128)
    for row, q in zip(weights, orders, strict=True):
        el = np.arange(abs(q), bandlimit)
        row[abs(q) :] = energy[el**2 + el + q].conj()
    weights /= np.sqrt(4 * np.pi) * energy[0].real
    columns = np.empty((gammas.size, 2 * bandlimit - 1, grid.n_rings), dtype=np.complex128)
    mixing = np.exp(1j * np.outer(gammas, orders))
    sums = OrderSums(orders, weights, threads=resolve_threads(threads))
    RingEngine(bandlimit, grid.colatitudes).fill_columns(holes[None], sums, mixing, columns)
    shares = np.empty((gammas.size, *grid.shape))
    rings = np.arange(grid.n_rings)
    sizes, limits = np.full_like(rings, grid.n_phi), np.full_like(rings, bandlimit)
    geometry = (rings, sizes, np.zeros(grid.n_rings), limits, rings[None] * grid.n_phi)
    folded = np.empty(grid.n_rings * grid.n_phi, dtype=np.complex128)
    for column, share in zip(columns[:, None], shares, strict=True):
        fill_folded(column, *geometry, False, folded)
        rows = folded.reshape(grid.shape)
        from_series(rows, rows)
        share[...] = rows.real
    return shares


def energy_shares(
    transform: SpinWaveletTransform,
    integrals: Callable[[int], Array],
) -> dict[int | str, Array]:
    """Return the share of energy in the holes for every coefficient of a wavelet transform.

    Parameters
    ----------
    transform : SpinWaveletTransform
        The wavelets and their grids.
    integrals : callable
        bandlimit -> coefficients <Ylm, 1 - M> of the holes up to that bandlimit.

    Returns
    -------
    dict
        "scaling" -> (rings, phi) and j -> (directions, rings, phi), float64, in [0, 1]: the shapes
        of the transform's coefficients. Wavelets that are zero (L_j <= |spin|) have share 0.
    """
    shares: dict[int | str, Array] = {}
    threads, wavelets = transform.threads, transform.wavelets
    tiling = wavelets.tiling
    for key, shape in transform.shapes.items():
        is_scaling = key == "scaling"
        size = tiling.scaling_bandlimit if is_scaling else tiling.scale_bandlimit(int(key))
        kept: tuple[int, ...] = (0,)
        if is_scaling:
            psi = wavelets.scaling_harmonics[None, :size].astype(np.complex128)
            gammas = np.zeros(1)
        else:
            orientations = wavelets.orientations_of(int(key))
            orders, gammas = orientations.orders, orientations.angles
            kept = tuple(n for n in orders if abs(n) < size)
            rows = [i for i, n in enumerate(orders) if n in kept]
            psi = wavelets.wavelet_harmonics(int(key))[rows, :size]
        if not np.any(psi):
            shares[key] = np.zeros(shape)
            continue
        energy = wavelet_energy(psi, kept, transform.spin, threads)
        holes = integrals(int(np.sqrt(energy.size)))
        grid = transform.grid_of(size)
        share = correlate_with_energy(holes, energy, grid, gammas, threads=threads)
        # The correlation is exact; a mask that is not band-limited rings a little beyond [0, 1].
        shares[key] = np.clip(share, 0.0, 1.0).reshape(shape)
    return shares
