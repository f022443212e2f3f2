"""Wavelet coefficients in harmonic space: the Wigner coefficients W_lmn of every scale.

There a wavelet transform is a product at each degree and order (eq-analysis, eq-synthesis), exact
to the last bit but for the square roots in psi. The parts are a dict: "scaling" -> W^phi_lm, shape
(..., L_phi**2), and j -> W^j_lmn, shape (..., orders, L_j**2), one row for each order n of
``wavelets.orientations_of(j)``, in increasing order.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from spinsdw.directionality import Orientations
from spinsdw.errors import ParameterError, ShapeError
from spinsdw.grid_sums import GridSums
from spinsdw.harmonics import check_flm
from spinsdw.parallel import resolve_threads
from spinsdw.sampling import Sampling
from spinsdw.wavelets import Wavelets

__all__ = [
    "check_parts",
    "flm_to_parts",
    "orders_to_samples",
    "part_shapes",
    "parts_to_flm",
    "samples_to_orders",
]

Array = np.ndarray[Any, Any]
Parts = dict[int | str, Array]


def part_shapes(wavelets: Wavelets) -> dict[int | str, tuple[int, ...]]:
    """Return the shape of each part of one signal."""
    found: dict[int | str, tuple[int, ...]] = {"scaling": (wavelets.tiling.scaling_bandlimit**2,)}
    for scale in wavelets.scales:
        size = wavelets.tiling.scale_bandlimit(scale) ** 2
        found[scale] = (wavelets.orientations_of(scale).count, size)
    return found


def check_parts(wavelets: Wavelets, parts: Mapping[Any, Array]) -> Parts:
    """Return the parts as complex128 arrays of one batch, or say why they are unusable."""
    shapes = part_shapes(wavelets)
    if not isinstance(parts, Mapping) or set(parts) != set(shapes):
        keys = sorted(map(str, parts)) if isinstance(parts, Mapping) else type(parts).__name__
        msg = (
            f"parts are {keys}; they must be a mapping with 'scaling' and the scales "
            f"{tuple(wavelets.scales)}, as analysis_wigner returns it."
        )
        raise ParameterError(msg)
    found: Parts = {}
    for key, shape in shapes.items():
        name = "scaling part" if key == "scaling" else f"scale {key}"
        values = check_flm(parts[key], int(np.sqrt(shape[-1])), name)
        batch = found["scaling"].shape[:-1] if found else values.shape[:-1]
        if values.shape != (*batch, *shape):
            expected = ", ".join(str(n) for n in (*batch, *shape))
            msg = f"{name} has shape {values.shape}; it must be ({expected}), as the others are."
            raise ShapeError(msg)
        found[key] = values
    return found


def _weights(wavelets: Wavelets, key: int | str, *, is_analysis: bool) -> Array:
    """Return what stands at each (l, m) between f_lm and W_lmn, shape (orders or 1, L_j**2)."""
    if key == "scaling":
        size = wavelets.tiling.scaling_bandlimit
        el = np.arange(size)
        rows: Array = (np.sqrt(4 * np.pi / (2 * el + 1)) * wavelets.scaling_harmonics[:size])[None]
    else:
        rows = wavelets.wavelet_harmonics(int(key))
        el = np.arange(rows.shape[1])
        if is_analysis:
            rows = 8 * np.pi**2 / (2 * el + 1) * rows
    return np.repeat(rows, 2 * el + 1, axis=1)


def flm_to_parts(wavelets: Wavelets, flm: Array, *, is_analysis: bool) -> Parts:
    """Multiply by ``8 pi^2 / (2l+1) conj(psi)``, the analysis, or by ``conj(psi)``.

    With the dual wavelets the latter is the adjoint of the synthesis.
    """
    parts: Parts = {}
    for key, shape in part_shapes(wavelets).items():
        weights = _weights(wavelets, key, is_analysis=is_analysis).conj()
        part = flm[..., None, : shape[-1]] * weights
        parts[key] = part[..., 0, :] if key == "scaling" else part
    return parts


def parts_to_flm(wavelets: Wavelets, parts: Parts, *, is_analysis: bool) -> Array:
    """Add up ``W psi``, the synthesis, or with ``8 pi^2 / (2l+1)`` the adjoint of the analysis."""
    batch = parts["scaling"].shape[:-1]
    flm = np.zeros((*batch, wavelets.bandlimit**2), dtype=np.complex128)
    for key, values in parts.items():
        weights = _weights(wavelets, key, is_analysis=is_analysis)
        rows = values[..., None, :] if key == "scaling" else values
        flm[..., : weights.shape[-1]] += np.einsum("...ni,ni->...i", rows, weights)
    return flm


def _sums(
    grid: Sampling, orientations: Orientations, *, real: bool, threads: int | None
) -> tuple[GridSums, Array]:
    """Return the sums over the orders that a grid can hold, and their rows."""
    kept = np.flatnonzero(np.abs(orientations.orders) < grid.bandlimit)
    orders = tuple(orientations.orders[i] for i in kept)
    mixing = np.ascontiguousarray(orientations.orders_to_orientations[:, kept])
    return GridSums(grid, orders, mixing, real, resolve_threads(threads)), kept


def samples_to_orders(
    values: Array, grid: Sampling, orientations: Orientations, *, threads: int | None
) -> Array:
    """Return W_lmn, (..., orders, L**2), of coefficients (..., orientations, rings, phi)."""
    sums, kept = _sums(grid, orientations, real=False, threads=threads)
    batch = values.reshape(-1, *values.shape[-3:]).astype(np.complex128)
    size = grid.bandlimit
    found = np.zeros((len(batch), orientations.count, size**2), dtype=np.complex128)
    weights = np.full((kept.size, size), 2 * np.pi / orientations.count, dtype=np.complex128)
    if kept.size:
        for one, out in zip(batch, found, strict=True):
            rows = np.zeros((kept.size, size**2), dtype=np.complex128)
            sums.from_grid(one, weights, out=rows, quadrature=True)
            out[kept] = rows
    return found.reshape(*values.shape[:-3], *found.shape[1:])


def orders_to_samples(
    rows: Array, grid: Sampling, orientations: Orientations, *, real: bool, threads: int | None
) -> Array:
    """Return coefficients (..., orientations, rings, phi) of W_lmn, (..., orders, L**2)."""
    sums, kept = _sums(grid, orientations, real=real, threads=threads)
    size, batch = grid.bandlimit, rows.reshape(-1, *rows.shape[-2:])
    padded = np.zeros((len(batch), kept.size, size**2), dtype=np.complex128)
    padded[..., : rows.shape[-1]] = batch[:, kept]
    found = np.zeros((len(batch), *sums.maps_shape), dtype=sums.maps_dtype)
    weights = np.tile((2 * np.arange(size) + 1) / (8 * np.pi**2) + 0j, (kept.size, 1))
    if kept.size:
        for one, out in zip(padded, found, strict=True):
            sums.to_grid(one, weights, out=out)
    return found.reshape(*rows.shape[:-2], *found.shape[1:])
