"""`GridSums`: from harmonic coefficients of several orders n to maps on a grid, and back.

    map_k(theta, phi) = sum_m e^{i m phi} sum_i mixing_ki sum_l weight_il f_lm d^l_{m, n_i}(theta)

The spin transform (one order, n = -s), the Wigner transform and the wavelets (several orders, mixed
into orientations) are this one sum; the transforms differ in weights and mixing only.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.fourier import fill_maps, fill_maps_columns
from spinsdw.parallel import run_tasks, threads_for
from spinsdw.parity_engine import ParityEngine, interleaved_rings, mirrored_rings
from spinsdw.refined_sums import RefinedSums
from spinsdw.ring_engine import OrderSums, RingEngine
from spinsdw.sampling.base import Sampling
from spinsdw.sampling.equiangular import MW
from spinsdw.signals import stored_dtype

__all__ = [
    "LARGE_BANDLIMIT",
    "GridSums",
    "cleared_flm",
    "engine_of",
    "fill_negative_orders",
]

Array = np.ndarray[Any, Any]

# Bytes of the rings one task transforms: small enough for a core's second-level cache, but never
# so few rings that columns are read in pieces shorter than a few cache lines.
_TASK_BYTES = 2**19
_FEWEST_RINGS = 16
# Maps that go through the sums together, and bytes of their Fourier columns: with more maps values
# made once save little more, and columns leave the cache.
_MOST_MAPS = 4
_COLUMN_BYTES = 2**25
# Such batches that a thread has at a time, while circles are shifted.
_SCRATCH_ARRAYS = 4
# On rings without mirror images sums by parity are faster from here on.
LARGE_BANDLIMIT = 384


@functools.lru_cache(maxsize=64)
def _ring_engine(sampling: Sampling) -> RingEngine:
    rings = sampling.colatitudes
    if sampling.is_symmetric:
        return RingEngine(sampling.bandlimit, rings[: (rings.size + 1) // 2], symmetric=True)
    return RingEngine(sampling.bandlimit, rings)


@functools.lru_cache(maxsize=128)
def engine_of(sampling: Sampling, orders: tuple[int, ...]) -> RingEngine | ParityEngine:
    """Return the faster sums over degree of these orders on the rings of a sampling."""
    is_interleaved = isinstance(sampling, MW) and sampling.bandlimit >= LARGE_BANDLIMIT
    if sampling.is_symmetric or is_interleaved:
        half = (interleaved_rings if is_interleaved else mirrored_rings)(sampling.colatitudes)
        engine = ParityEngine(sampling.bandlimit, half, orders)
        if engine.is_worthwhile:
            return engine
    return _ring_engine(sampling)


def cleared_flm(shape: tuple[int, ...]) -> Array:
    """Return complex128 zeros that sums are added to.

    Written one by one: a page of `np.zeros` that is first read and then written, as by adding, is
    made twice, and the second time every thread of the process waits.
    """
    return np.full(shape, 0.0, dtype=np.complex128)


def fill_negative_orders(flm: Array) -> None:
    """Complete coefficients known for m >= 0 by f_{l,-m} = (-1)^m conj(f_lm), in place."""
    from spinsdw.compiled.symmetry import fill_negative_m

    fill_negative_m(int(np.sqrt(flm.shape[-1])), flm.reshape(-1, flm.shape[-1]))


def _ranges(call: Callable[[int, int], None], size: int, step: int) -> list[Callable[[], None]]:
    """Split what is called for a range into calls for parts of it."""
    return [
        functools.partial(call, first, min(first + step, size)) for first in range(0, size, step)
    ]


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
    workspace : ndarray, shape (at least `workspace_size` of the batch,), of that type, optional
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
    def _columns_shape(self) -> tuple[int, int, int]:
        return (max(self.mixing.shape), self._n_m, self.sampling.n_rings)

    @property
    def _maps_together(self) -> int:
        """Maps that go through the sums at once: they share recursions, and add up in memory."""
        fitting = _COLUMN_BYTES // (16 * math.prod(self._columns_shape))
        return min(_MOST_MAPS, max(1, fitting))

    def workspace_size(self, batch: int = 1) -> int:
        """Return how many complex numbers hold the Fourier columns of all outputs."""
        return min(batch, self._maps_together) * math.prod(self._columns_shape)

    def scratch_bytes(self, batch: int = 1, *, quadrature: bool = False) -> int:
        """Return the bytes that a call takes beyond its input, output and workspace."""
        circle = 16 * self.sampling.n_phi * len(self.orders)
        batches = self._threads * max(_TASK_BYTES, circle)
        circles = (self._n_m + 1) // 2 * circle
        refined = self._refined if quadrature else None
        room = refined.room_bytes(min(batch, self._maps_together)) if refined else 0
        return _SCRATCH_ARRAYS * min(batches, circles) + room

    def working_bytes(self, batch: int = 1, *, quadrature: bool = False) -> int:
        """Return the bytes that a call takes beyond its input and output."""
        workspace = np.dtype(self.dtype).itemsize * self.workspace_size(batch)
        return workspace + self.scratch_bytes(batch, quadrature=quadrature)

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

    def _columns(self, maps: int) -> Array:
        """Return room for the Fourier columns of all outputs, in the workspace if there is one."""
        room, size = self.workspace, self.workspace_size(maps)
        if room is None:
            room = np.empty(size, dtype=self.dtype)
        columns = room[:size].reshape(maps, *self._columns_shape)
        # MWSS has one more Fourier mode, |m| = L, than a band-limited signal.
        if self.sampling.n_phi == 2 * self.sampling.bandlimit:
            columns[:, :, self.sampling.bandlimit] = 0.0
        return columns

    @property
    def _engine(self) -> RingEngine | ParityEngine:
        return engine_of(self.sampling, self.orders)

    @property
    def _refined(self) -> RefinedSums | None:
        """The sums on refined rings, if they are the way of the quadrature."""
        if not isinstance(self.sampling, MW) or not self.orders:
            return None
        refined = RefinedSums(self.sampling, self.orders, self.mixing, self.real, self._threads)
        return refined if refined.is_worthwhile else None

    def _share(self, call: Callable[[int, int], None], size: int, step: int) -> None:
        run_tasks(_ranges(call, size, step), self._threads)

    def _share_rings(self, call: Callable[[int, int, int], None], maps: int, outputs: int) -> None:
        """Call for ranges of rings of every map."""
        step = max(_FEWEST_RINGS, _TASK_BYTES // (16 * self.sampling.n_phi * outputs))
        calls = [functools.partial(call, i) for i in range(maps)]
        tasks = [task for one in calls for task in _ranges(one, self.sampling.n_rings, step)]
        run_tasks(tasks, self._threads)

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
        """Return maps, shape (outputs, rings, phi), from flm (1 or orders, at least L*L).

        ``weights``: (orders, L) complex. With ``quadrature`` the grid's quadrature is applied to
        the columns of every order first: that is the adjoint of an analysis. The maps go to
        ``out`` where it is given.
        """
        maps = np.empty(self.maps_shape, dtype=self.maps_dtype) if out is None else out
        self.fill_maps(flm[None], weights, maps[None], lowest=lowest, quadrature=quadrature)
        return maps

    def fill_maps(
        self, flm: Array, weights: Array, out: Array, *, lowest: int = 0, quadrature: bool = False
    ) -> None:
        """Fill maps, shape (batch, outputs, rings, phi), each as `to_grid` does, some together."""
        sums = self._order_sums(weights, lowest)
        for part in self._parts(len(flm)):
            self._fill_together(flm[part], sums, out[part], quadrature=quadrature)

    def _parts(self, batch: int) -> list[slice]:
        step = self._maps_together
        return [slice(first, first + step) for first in range(0, batch, step)]

    def _fill_together(self, flm: Array, sums: OrderSums, maps: Array, *, quadrature: bool) -> None:
        columns, refined = self._columns(len(flm)), self._refined if quadrature else None
        if refined:
            refined.fill_columns(flm, sums, columns)
        elif quadrature:
            identity = np.eye(len(self.orders), dtype=np.complex128)
            self._engine.fill_columns(flm, sums, identity, columns)
            for one in columns:
                self._weigh(one, identity)
                self._mix(self.mixing, one)
        else:
            self._engine.fill_columns(flm, sums, self.mixing, columns)
        outputs = self.mixing.shape[0]
        self._share_rings(
            lambda i, a, b: fill_maps(columns[i, :outputs, :, a:b], maps[i, :, a:b]),
            len(maps),
            outputs,
        )

    def _weigh(self, columns: Array, mixing: Array) -> None:
        self.sampling.weigh_columns(columns, self.orders, mixing=mixing, threads=self._threads)

    def from_grid(
        self,
        maps: Array,
        weights: Array,
        *,
        out: Array,
        lowest: int = 0,
        quadrature: bool = False,
    ) -> None:
        """Add to ``out`` (1 or orders, at least L*L) the adjoint of `to_grid`, weights conjugated.

        With ``quadrature`` the sum over rings becomes the exact integral over the sphere.
        """
        self.add_maps(maps[None], weights, out[None], lowest=lowest, quadrature=quadrature)

    def add_maps(
        self, maps: Array, weights: Array, out: Array, *, lowest: int = 0, quadrature: bool = False
    ) -> None:
        """Add what a batch of maps holds, each as `from_grid` does, some together."""
        sums = self._order_sums(weights, lowest)
        for part in self._parts(len(maps)):
            self._add_together(maps[part], sums, out[part], quadrature=quadrature)

    def _add_together(self, maps: Array, sums: OrderSums, out: Array, *, quadrature: bool) -> None:
        columns, outputs = self._columns(len(maps)), maps.shape[1]
        self._share_rings(
            lambda i, a, b: fill_maps_columns(maps[i, :, a:b], columns[i, :outputs, :, a:b]),
            len(maps),
            outputs,
        )
        refined = self._refined if quadrature else None
        if refined:
            refined.add_to_harmonics(columns, sums, out)
            return
        unmixing = np.ascontiguousarray(self.mixing.conj().T)
        for one in columns:
            if quadrature:
                self._weigh(one, unmixing)
            elif not np.array_equal(unmixing, [[1.0]]):
                self._mix(unmixing, one)
        self._engine.add_to_harmonics(columns, sums, out)
