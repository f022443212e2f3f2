"""`GridSums`: from harmonic coefficients of several orders n to maps on a grid, and back.

    map_k(theta, phi) = sum_m e^{i m phi} sum_i mixing_ki sum_l weight_il f_lm d^l_{m, n_i}(theta)

The spin transform (one order, n = -s), the Wigner transform and the wavelets (several orders, mixed
into orientations) are this one sum; the transforms differ in weights and mixing only.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.fourier import from_half_series, from_series, to_half_series, to_series
from spinsdw.parallel import run_tasks
from spinsdw.ring_engine import RingEngine
from spinsdw.sampling.base import Sampling

__all__ = ["GridSums", "fill_negative_orders"]

Array = np.ndarray[Any, Any]

# Bytes of the rings one task transforms: small enough for a core's second-level cache.
_TASK_BYTES = 2**19


@functools.lru_cache(maxsize=64)
def _engine(sampling: Sampling) -> RingEngine:
    return RingEngine(sampling.bandlimit, sampling.colatitudes)


def fill_negative_orders(flm: Array) -> None:
    """Complete coefficients known for m >= 0 by f_{l,-m} = (-1)^m conj(f_lm), in place."""
    bandlimit = int(np.sqrt(flm.shape[-1]))
    el = np.arange(bandlimit)
    for m in range(1, bandlimit):
        base = el[m:] ** 2 + el[m:]
        flm[..., base - m] = (-1.0) ** m * flm[..., base + m].conj()


@dataclass(frozen=True, eq=False)
class GridSums:
    """The sums for fixed orders on a fixed grid.

    Parameters
    ----------
    sampling : Sampling
        The grid.
    orders : tuple of int
        The orders n_i.
    mixing : ndarray, shape (outputs, orders), complex128
        What combines the orders into output maps.
    real : bool
        Whether the maps are real.
    threads : int
        Threads to share the work.
    """

    sampling: Sampling
    orders: tuple[int, ...]
    mixing: Array
    real: bool
    threads: int

    @property
    def _sides(self) -> int:
        return 1 if self.real else 2

    @property
    def _n_m(self) -> int:
        n_phi = self.sampling.n_phi
        return n_phi // 2 + 1 if self.real else n_phi

    def _ring_tasks(self, call: Any, outputs: int) -> None:
        n_rings = self.sampling.n_rings
        step = max(1, _TASK_BYTES // (16 * self.sampling.n_phi * outputs))
        run_tasks(
            [
                functools.partial(call, first, min(first + step, n_rings))
                for first in range(0, n_rings, step)
            ],
            self.threads,
        )

    def _clear_unused(self, spectra: Array) -> None:
        # MWSS has one more Fourier mode, |m| = L, than a band-limited signal.
        if self.sampling.n_phi == 2 * self.sampling.bandlimit:
            spectra[..., self.sampling.bandlimit] = 0.0

    def _fill_spectra(self, flm: Array, weights: Array, mixing: Array, lowest: int) -> Array:
        shape = (mixing.shape[0], self.sampling.n_rings, self._n_m)
        spectra = np.empty(shape, dtype=np.complex128)
        self._clear_unused(spectra)
        _engine(self.sampling).fill_spectra(
            flm,
            weights,
            orders=self.orders,
            mixing=mixing,
            lowest=lowest,
            sides=self._sides,
            out=spectra,
            threads=self.threads,
        )
        return spectra

    def _weigh_spectra(self, spectra: Array) -> Array:
        columns = np.ascontiguousarray(spectra.transpose(0, 2, 1))
        self.sampling.weigh_columns(columns, self.orders, threads=self.threads)
        mixed = np.tensordot(self.mixing, columns, axes=(1, 0))
        return np.ascontiguousarray(mixed.transpose(0, 2, 1))

    def to_grid(
        self, flm: Array, weights: Array, *, lowest: int = 0, quadrature: bool = False
    ) -> Array:
        """Return maps, shape (outputs, rings, phi), from flm (1 or orders, L*L).

        ``weights``: (orders, L) complex. With ``quadrature`` the grid's quadrature is applied to
        the columns of every order first: that is the adjoint of an analysis.
        """
        if quadrature:
            identity = np.eye(len(self.orders), dtype=np.complex128)
            spectra = self._weigh_spectra(self._fill_spectra(flm, weights, identity, lowest))
        else:
            spectra = self._fill_spectra(flm, weights, self.mixing, lowest)
        if not self.real:
            self._ring_tasks(
                lambda a, b: from_series(spectra[:, a:b], spectra[:, a:b]), spectra.shape[0]
            )
            return spectra
        maps = np.empty((spectra.shape[0], *self.sampling.shape))
        self._ring_tasks(
            lambda a, b: from_half_series(spectra[:, a:b], maps[:, a:b]), spectra.shape[0]
        )
        return maps

    def _columns(self, maps: Array) -> Array:
        """Fourier columns of each order: (orders, m, rings)."""
        from spinsdw.compiled.columns import fill_columns

        columns = np.empty(
            (len(self.orders), self._n_m, self.sampling.n_rings), dtype=np.complex128
        )
        unmixing = np.ascontiguousarray(self.mixing.conj().T)
        transform = to_half_series if self.real else to_series

        def task(first: int, stop: int) -> None:
            shape = (maps.shape[0], stop - first, self._n_m)
            series = np.empty(shape, dtype=np.complex128)
            transform(maps[:, first:stop], series)
            fill_columns(series, unmixing, first, columns)

        self._ring_tasks(task, maps.shape[0])
        return columns

    def from_grid(
        self,
        maps: Array,
        weights: Array,
        *,
        out: Array,
        lowest: int = 0,
        quadrature: bool = False,
    ) -> None:
        """Add to ``out`` (1 or orders, L*L) the adjoint sum of `to_grid` for conjugated weights.

        With ``quadrature`` the sum over rings becomes the exact integral over the sphere.
        """
        columns = self._columns(maps)
        if quadrature:
            self.sampling.weigh_columns(columns, self.orders, threads=self.threads)
        _engine(self.sampling).add_to_harmonics(
            columns,
            weights,
            orders=self.orders,
            lowest=lowest,
            sides=self._sides,
            out=out,
            threads=self.threads,
        )
