"""`OrientationSums`: what `GridSums` computes, for many orders, mixed by a Fourier transform.

    map_k(theta, phi) = sum_n e^{i n gamma_k} sum_m e^{i m phi} sum_l weight_nl f_lm d^l_mn(theta)

The orders are summed a few at a time, each into a map of its own, and all maps are transformed from
n to gamma. Of a real signal only n >= 0 is summed: the map of -n is the conjugate of that of n.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.directionality import Orientations
from spinsdw.fourier import from_orders, to_orders
from spinsdw.grid_sums import GridSums, fill_negative_orders
from spinsdw.harmonics import conjugate_field
from spinsdw.parallel import run_tasks, threads_for
from spinsdw.sampling.base import Sampling
from spinsdw.signals import stored_dtype

__all__ = ["OrientationSums"]

Array = np.ndarray[Any, Any]

# Sizes |n| whose maps are summed at a time.
_GROUP = 8


@dataclass(frozen=True, eq=False)
class OrientationSums:
    """The sums for many orders on a fixed grid.

    Parameters
    ----------
    sampling : Sampling
        The grid.
    orders : tuple of int
        The orders n that have weights, symmetric about 0.
    orientations : Orientations
        The angles gamma_k of the output maps, an odd number of them.
    real : bool
        Whether the maps are real; then ``weight_{-n} = (-1)**n conj(weight_n)``.
    threads : int
        Threads to share the work.
    dtype : str, default "complex128"
        Type that spectra and complex maps are stored in; all sums are of double precision.
    workspace : ndarray, shape (at least `workspace_size`,), of that type, optional
        Room for the Fourier columns of a few orders.
    """

    sampling: Sampling
    orders: tuple[int, ...]
    orientations: Orientations
    real: bool
    threads: int
    dtype: str = "complex128"
    workspace: Array | None = None

    def workspace_size(self, batch: int = 1) -> int:
        """Return how many complex numbers hold the Fourier columns of a few orders of one map."""
        sizes = (sums.workspace_size(min(batch, 1)) for sums, *_ in self._groups())
        return max(sizes, default=0)

    def scratch_bytes(self, batch: int = 1, *, quadrature: bool = False) -> int:
        """Return the bytes that a call takes beyond its input, output and workspace."""
        size = np.dtype(self.dtype).itemsize
        groups = [
            sums.scratch_bytes(min(batch, 1), quadrature=quadrature)
            + size * math.prod(sums.maps_shape)
            for sums, *_ in self._groups()
        ]
        # The maps of the orders; `to_grid` puts complex ones in the output itself.
        return max(groups, default=0) + size * math.prod(self._spectrum_shape)

    @property
    def maps_itemsize(self) -> int:
        """Bytes of one number of the output maps."""
        return self.maps_dtype.itemsize

    @property
    def maps_dtype(self) -> np.dtype[Any]:
        """Type of the output maps."""
        return stored_dtype(self.dtype, real=self.real)

    @property
    def maps_shape(self) -> tuple[int, int, int]:
        """Shape of the output maps."""
        return (self.orientations.count, *self.sampling.shape)

    def _groups(self) -> Iterator[tuple[GridSums, Array, Array]]:
        """Give sums of a few orders, their rows of weights and their places in the spectrum."""
        orders = np.array(self.orders)
        sizes = np.unique(np.abs(orders))
        for first in range(0, sizes.size, _GROUP):
            is_chosen = np.isin(np.abs(orders), sizes[first : first + _GROUP])
            if self.real:
                is_chosen &= orders >= 0
            rows = np.flatnonzero(is_chosen)
            places = orders[rows] // self.orientations.step % self.orientations.count
            identity = np.eye(rows.size, dtype=np.complex128)
            chosen = tuple(orders[rows].tolist())
            options = (self.threads, self.dtype, self.workspace)
            sums = GridSums(self.sampling, chosen, identity, False, *options)
            yield sums, rows, places

    @property
    def _spectrum_shape(self) -> tuple[int, int, int]:
        count = self.orientations.count
        return (count // 2 + 1 if self.real else count, *self.sampling.shape)

    def _share_rings(self, call: Callable[[slice], None]) -> None:
        threads = threads_for(self.sampling.bandlimit, self.threads)
        tasks = [
            functools.partial(call, slice(ring, ring + 1)) for ring in range(self.sampling.n_rings)
        ]
        run_tasks(tasks, threads)

    def to_grid(
        self,
        flm: Array,
        weights: Array,
        *,
        lowest: int = 0,
        quadrature: bool = False,
        out: Array | None = None,
    ) -> Array:
        """Return maps, shape (orientations, rings, phi); as `GridSums.to_grid`."""
        maps = np.empty(self.maps_shape, dtype=self.maps_dtype) if out is None else out
        spectrum = np.empty(self._spectrum_shape, dtype=self.dtype) if self.real else maps
        spectrum[...] = 0.0
        if self.real:
            flm = flm.copy()
            fill_negative_orders(flm)
        for sums, rows, places in self._groups():
            spectrum[places] = sums.to_grid(
                flm, weights[rows], lowest=lowest, quadrature=quadrature
            )
        self._share_rings(lambda ring: from_orders(spectrum[:, ring], maps[:, ring]))
        return maps

    def from_grid(
        self,
        maps: Array,
        weights: Array,
        *,
        out: Array,
        lowest: int = 0,
        quadrature: bool = False,
    ) -> None:
        """Add to ``out`` (1, L*L) the adjoint sum of `to_grid`; as `GridSums.from_grid`."""
        spectrum = np.empty(self._spectrum_shape, dtype=self.dtype)
        self._share_rings(lambda ring: to_orders(maps[:, ring], spectrum[:, ring]))
        target = np.zeros_like(out) if self.real else out
        if self.real:
            # Every order counts with its opposite, and 0 with itself.
            weights = weights * np.where(np.array(self.orders) == 0, 0.5, 1.0)[:, None]
        for sums, rows, places in self._groups():
            sums.from_grid(
                spectrum[places], weights[rows], out=target, lowest=lowest, quadrature=quadrature
            )
        if self.real:
            out += target + conjugate_field(target)

    def fill_maps(
        self, flm: Array, weights: Array, out: Array, *, lowest: int = 0, quadrature: bool = False
    ) -> None:
        """Fill a batch of maps one by one; as `GridSums.fill_maps`."""
        size = self.sampling.bandlimit**2
        for one, maps in zip(flm, out, strict=True):
            self.to_grid(one[:, :size], weights, lowest=lowest, quadrature=quadrature, out=maps)

    def add_maps(
        self, maps: Array, weights: Array, out: Array, *, lowest: int = 0, quadrature: bool = False
    ) -> None:
        """Add what a batch of maps holds one by one; as `GridSums.add_maps`."""
        size = self.sampling.bandlimit**2
        for one, flm in zip(maps, out, strict=True):
            target = flm[:, :size]
            self.from_grid(one, weights, out=target, lowest=lowest, quadrature=quadrature)
