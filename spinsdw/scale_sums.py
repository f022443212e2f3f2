"""From harmonic coefficients to one part of a wavelet transform on its grid, and back."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from spinsdw.directionality import Orientations
from spinsdw.grid_sums import GridSums
from spinsdw.orientation_sums import OrientationSums
from spinsdw.parallel import resolve_threads
from spinsdw.sampling import Sampling
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelets import Wavelets

__all__ = ["ScaleSums", "ScalingSums", "scale_sums"]

Array = np.ndarray[Any, Any]

# With more orders a Fourier transform mixes them into orientations faster than a matrix.
_MOST_MIXED_ORDERS = 32


@dataclass(frozen=True, eq=False)
class ScaleSums:
    """The sums of one scale.

    Parameters
    ----------
    sums : GridSums or OrientationSums
        Those of the orders that the scale has, on its grid.
    psi, dual : ndarray, shape (orders, grid's bandlimit), complex128
        The wavelets of the analysis and of the synthesis.
    lowest : int
        The lowest degree of either.
    """

    sums: GridSums | OrientationSums
    psi: Array
    dual: Array
    lowest: int

    @property
    def _integration(self) -> float:
        """What a sum over orientations has to be multiplied with to be an integral."""
        return 2 * np.pi / self.sums.maps_shape[0]

    def to_grid(self, flm: Array, workspace: Array, *, adjoint: bool) -> Array:
        """Return coefficients, shape (..., orientations, rings, phi): analysis, or the adjoint.

        ``adjoint`` is that of the synthesis; flm has the shape (..., L*L), L at least the grid's.
        """
        weights = self.dual.conj() * self._integration if adjoint else self.psi.conj()
        batch = flm.reshape(-1, 1, flm.shape[-1])
        maps = np.zeros((len(batch), *self.sums.maps_shape), dtype=self.sums.maps_dtype)
        if self.sums.orders:
            sums = replace(self.sums, workspace=workspace)
            sums.fill_maps(batch, weights, maps, lowest=self.lowest, quadrature=adjoint)
        return maps.reshape(*flm.shape[:-1], *self.sums.maps_shape)

    def add_to_harmonics(
        self, values: Array, flm: Array, workspace: Array, *, adjoint: bool
    ) -> None:
        """Add what coefficients synthesise to flm, shape (batch, L*L).

        ``adjoint`` is that of the analysis.
        """
        if not self.sums.orders:
            return
        weights = self.psi if adjoint else self.dual * self._integration
        sums = replace(self.sums, workspace=workspace)
        rows = values.reshape(-1, *self.sums.maps_shape)
        sums.add_maps(rows, weights, flm[:, None], lowest=self.lowest, quadrature=not adjoint)


def scale_sums(
    wavelets: Wavelets, dual: Wavelets, scale: int, grid: Sampling, harmonic: SpinHarmonicTransform
) -> ScaleSums:
    """Return the sums of one scale on its grid, of the kind of values that a transform has.

    ``wavelets`` and ``dual`` are those of analysis and of synthesis; of the harmonic transform
    ``real``, ``threads`` and ``dtype`` are taken.
    """
    psi, other = (one.wavelet_harmonics(scale) for one in (wavelets, dual))
    # Orders beyond the scale's degrees, and of curvelets those below them, are zero.
    kept = np.flatnonzero(np.any(psi, axis=1))
    padding = ((0, 0), (0, grid.bandlimit - psi.shape[1]))
    lowest = max(wavelets.tiling.scale_lowest_degree(scale), wavelets.lowest_degree)
    return ScaleSums(
        _sums_of(grid, wavelets.orientations_of(scale), kept, harmonic),
        np.pad(psi[kept], padding),
        np.pad(other[kept], padding),
        min(lowest, grid.bandlimit),
    )


def _sums_of(
    grid: Sampling, orientations: Orientations, kept: Array, harmonic: SpinHarmonicTransform
) -> GridSums | OrientationSums:
    orders = tuple(orientations.orders[i] for i in kept)
    kind = harmonic.real, resolve_threads(harmonic.threads), harmonic.dtype
    if orientations.count % 2 and len(orders) > _MOST_MIXED_ORDERS:
        return OrientationSums(grid, orders, orientations, *kind)
    mixing = np.ascontiguousarray(orientations.orders_to_orientations[:, kept])
    return GridSums(grid, orders, mixing, *kind)


@dataclass(frozen=True, eq=False)
class ScalingSums:
    """The sums of the scaling part, a scalar field whatever the spin of the signal.

    Parameters
    ----------
    wavelets, dual : Wavelets
        Of the analysis and of the synthesis.
    grid : Sampling
        Where the part is sampled.
    harmonic : SpinHarmonicTransform
        The signal's, of which ``real``, ``threads`` and ``dtype`` are taken.
    """

    wavelets: Wavelets
    dual: Wavelets
    grid: Sampling
    harmonic: SpinHarmonicTransform

    @functools.cached_property
    def transform(self) -> SpinHarmonicTransform:
        """The scalar transform of the part."""
        return SpinHarmonicTransform(
            self.grid.bandlimit,
            sampling=self.grid,
            real=self.harmonic.real,
            threads=self.harmonic.threads,
            dtype=self.harmonic.dtype,
        )

    @functools.cached_property
    def _factors(self) -> tuple[Array, Array]:
        """sqrt(4 pi / (2l + 1)) phi_l0 of analysis and synthesis, at each (l, m) of the part."""
        el = np.arange(self.grid.bandlimit)
        ours, dual = (
            np.sqrt(4 * np.pi / (2 * el + 1)) * wavelets.scaling_harmonics[: el.size]
            for wavelets in (self.wavelets, self.dual)
        )
        return np.repeat(ours, 2 * el + 1), np.repeat(dual, 2 * el + 1)

    def to_grid(self, flm: Array, *, adjoint: bool) -> Array:
        """Return the part, shape (..., rings, phi): of the analysis, or adjoint synthesis."""
        factor = self._factors[1 if adjoint else 0]
        part = flm[..., : factor.size] * factor
        part[..., : self.wavelets.spin**2] = 0.0
        return self.transform.adjoint_analysis(part) if adjoint else self.transform.synthesis(part)

    def add_to_harmonics(self, values: Array, flm: Array, *, adjoint: bool) -> None:
        """Add what the part synthesises to flm, shape (..., L*L), or the adjoint analysis does."""
        transform = self.transform
        part = transform.adjoint_synthesis(values) if adjoint else transform.analysis(values)
        part *= self._factors[0 if adjoint else 1]
        flm[..., : part.shape[-1]] += part
