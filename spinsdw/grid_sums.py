"""`GridSums`: from harmonic coefficients of several orders n to maps on a grid, and back.

    map_k(theta, phi) = sum_m e^{i m phi} sum_i mixing_ki sum_l weight_il f_lm d^l_{m, n_i}(theta)

The spin transform (one order, n = -s), the Wigner transform and the wavelets (several orders, mixed
into orientations) are this one sum; the transforms differ in weights and mixing only.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.fourier import fill_maps, fill_maps_columns
from spinsdw.mirror_engine import MirrorEngine
from spinsdw.parallel import run_tasks, threads_for
from spinsdw.ring_engine import OrderSums, RingEngine
from spinsdw.sampling.base import Sampling
from spinsdw.signals import stored_dtype

__all__ = ["GridSums", "engine_of", "fill_negative_orders"]

Array = np.ndarray[Any, Any]

# Bytes of the rings one task transforms: small enough for a core's second-level cache, but never
# so few rings that columns are read in pieces shorter than a few cache lines.
_TASK_BYTES = 2**19
_FEWEST_RINGS = 16
# Such batches that a thread has at a time, while circles are shifted.
_SCRATCH_ARRAYS = 4


@functools.lru_cache(maxsize=64)
def engine_of(sampling: Sampling) -> RingEngine:
    """Return the sums over degree on the rings of a sampling."""
    rings = sampling.colatitudes
    if sampling.is_symmetric:
        return RingEngine(sampling.bandlimit, rings[: (rings.size + 1) // 2], symmetric=True)
    return RingEngine(sampling.bandlimit, rings)


@functools.lru_cache(maxsize=64)
def _mirror_engine(sampling: Sampling, order: int) -> MirrorEngine:
    north = sampling.colatitudes[: (sampling.n_rings + 1) // 2]
    return MirrorEngine(sampling.bandlimit, north, order)


def fill_negative_orders(flm: Array) -> None:
    """Complete coefficients known for m >= 0 by f_{l,-m} = (-1)^m conj(f_lm), in place."""
    from spinsdw.compiled.symmetry import fill_negative_m

    fill_negative_m(int(np.sqrt(flm.shape[-1])), flm.reshape(-1, flm.shape[-1]))


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
    dtype : str, default "complex128"
        Type that Fourier columns and complex maps are stored in; all sums are of double precision.
    workspace : ndarray, shape (at least `workspace_size`,), of that type, optional
        Room for the Fourier columns: fresh memory costs as much as the transform that fills it.
    """

    sampling: Sampling
    orders: tuple[int, ...]
    mixing: Array
    real: bool
    threads: int
    dtype: str = "complex128"
    workspace: Array | None = None

    @property
    def _threads(self) -> int:
        return threads_for(self.sampling.bandlimit, self.threads)

    @property
    def _n_m(self) -> int:
        n_phi = self.sampling.n_phi
        return n_phi // 2 + 1 if self.real else n_phi

    def _order_sums(self, weights: Array, lowest: int) -> OrderSums:
        return OrderSums(self.orders, weights, lowest, 1 if self.real else 2, self._threads)

    @property
    def workspace_size(self) -> int:
        """Complex numbers that hold the Fourier columns of all outputs."""
        return max(self.mixing.shape) * self._n_m * self.sampling.n_rings

    @property
    def scratch_bytes(self) -> int:
        """Bytes that a call takes beyond its input, output and workspace."""
        circle = 16 * self.sampling.n_phi * len(self.orders)
        batches = self._threads * max(_TASK_BYTES, circle)
        circles = (self._n_m + 1) // 2 * circle
        return _SCRATCH_ARRAYS * min(batches, circles)

    @property
    def working_bytes(self) -> int:
        """Bytes that a call takes beyond its input and output."""
        return np.dtype(self.dtype).itemsize * self.workspace_size + self.scratch_bytes

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
        return (self.mixing.shape[0], *self.sampling.shape)

    def _columns(self) -> Array:
        """Return room for the Fourier columns of all outputs, in the workspace if there is one."""
        shape = (max(self.mixing.shape), self._n_m, self.sampling.n_rings)
        room = self.workspace
        if room is None:
            room = np.empty(self.workspace_size, dtype=self.dtype)
        columns = room[: self.workspace_size].reshape(shape)
        # MWSS has one more Fourier mode, |m| = L, than a band-limited signal.
        if self.sampling.n_phi == 2 * self.sampling.bandlimit:
            columns[:, self.sampling.bandlimit] = 0.0
        return columns

    @property
    def _mirror(self) -> MirrorEngine | None:
        """The faster sums of a single order on rings that mirror each other."""
        if len(self.orders) > 1 or not self.sampling.is_symmetric:
            return None
        return _mirror_engine(self.sampling, self.orders[0])

    def _fill_columns(self, flm: Array, sums: OrderSums, mixing: Array, columns: Array) -> None:
        from spinsdw.compiled.columns import clear_outer_rings

        mirror = self._mirror
        if mirror is None:
            engine_of(self.sampling).fill_columns(flm, sums, mixing, columns)
            return
        mirror.fill_columns(flm, sums, columns[:1])
        clear_outer_rings(mirror.limits, sums.sides, columns[0])
        if not np.array_equal(mixing, [[1.0]]):
            self._mix(mixing, columns)

    def _add_columns(self, columns: Array, sums: OrderSums, out: Array) -> None:
        mirror = self._mirror
        if mirror is None:
            engine_of(self.sampling).add_to_harmonics(columns, sums, out)
        else:
            mirror.add_to_harmonics(columns[:1], sums, out)

    def _share(self, call: Callable[[int, int], None], size: int, step: int) -> None:
        tasks = [
            functools.partial(call, first, min(first + step, size))
            for first in range(0, size, step)
        ]
        run_tasks(tasks, self._threads)

    def _share_rings(self, call: Callable[[int, int], None], outputs: int) -> None:
        step = max(_FEWEST_RINGS, _TASK_BYTES // (16 * self.sampling.n_phi * outputs))
        self._share(call, self.sampling.n_rings, step)

    def _mix(self, mixing: Array, columns: Array) -> None:
        from spinsdw.compiled.columns import mix_columns

        self._share(lambda a, b: mix_columns(mixing, a, b, columns), self._n_m, 32)

    def to_grid(
        self,
        flm: Array,
        weights: Array,
        *,
        lowest: int = 0,
        quadrature: bool = False,
        out: Array | None = None,
    ) -> Array:
        """Return maps, shape (outputs, rings, phi), from flm (1 or orders, L*L).

        ``weights``: (orders, L) complex. With ``quadrature`` the grid's quadrature is applied to
        the columns of every order first: that is the adjoint of an analysis. The maps go to
        ``out`` where it is given.
        """
        columns = self._columns()
        sums = self._order_sums(weights, lowest)
        if quadrature:
            identity = np.eye(len(self.orders), dtype=np.complex128)
            self._fill_columns(flm, sums, identity, columns)
            self.sampling.weigh_columns(
                columns, self.orders, mixing=identity, threads=self._threads
            )
            self._mix(self.mixing, columns)
        else:
            self._fill_columns(flm, sums, self.mixing, columns)
        outputs = self.mixing.shape[0]
        maps = np.empty(self.maps_shape, dtype=self.maps_dtype) if out is None else out
        self._share_rings(lambda a, b: fill_maps(columns[:outputs, :, a:b], maps[:, a:b]), outputs)
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
        """Add to ``out`` (1 or orders, L*L) the adjoint sum of `to_grid` for conjugated weights.

        With ``quadrature`` the sum over rings becomes the exact integral over the sphere.
        """
        columns = self._columns()
        self._share_rings(
            lambda a, b: fill_maps_columns(maps[:, a:b], columns[: maps.shape[0], :, a:b]),
            maps.shape[0],
        )
        unmixing = np.ascontiguousarray(self.mixing.conj().T)
        if quadrature:
            self.sampling.weigh_columns(
                columns, self.orders, mixing=unmixing, threads=self._threads
            )
        elif not np.array_equal(unmixing, [[1.0]]):
            self._mix(unmixing, columns)
        self._add_columns(columns, self._order_sums(weights, lowest), out)
