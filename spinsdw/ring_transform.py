"""`HealpixTransform`: spin-s synthesis on HEALPix maps, and its adjoint."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.grid_sums import cleared_flm, fill_negative_orders
from spinsdw.harmonics import check_bandlimit, check_flm, check_integer
from spinsdw.memory import MemoryEstimate, check_max_memory
from spinsdw.parallel import resolve_threads, run_tasks, threads_for
from spinsdw.parity_engine import ParityEngine
from spinsdw.ring_blocks import BeltBlock, CapBlock, healpix_engine, ring_blocks, task_bytes
from spinsdw.ring_engine import OrderSums
from spinsdw.sampling.healpix_rings import HealpixRings
from spinsdw.signals import check_flag, check_map, check_spin, writable

__all__ = ["HealpixTransform"]

Array = np.ndarray[Any, Any]

# Maps that go through the sums together, and bytes of their Fourier columns: with more maps values
# made once save little more, and columns leave the cache.
_MOST_MAPS = 4
_COLUMN_BYTES = 2**25


@dataclass(frozen=True, eq=False)
class HealpixTransform:
    """Compute HEALPix maps (ring order) of spin s from harmonic coefficients, and the adjoint.

    HEALPix has no sampling theorem: the adjoint is not the inverse. `healpix.map_to_flm` inverts by
    least squares with these two operations.

    Parameters
    ----------
    nside : int
        Resolution; maps have 12 nside^2 pixels.
    bandlimit : int
        L: degrees are l < L.
    spin : int, default 0
        s, |s| < L.
    real : bool, default False
        Whether maps are real (spin 0 only).
    threads : int, optional
        Threads to use; all cores when None. Results do not depend on it.
    max_memory : int, optional
        Bytes that a call may take by `memory_estimate`; one that would take more is refused before
        it allocates anything. No limit when None.

    Examples
    --------
    >>> import numpy as np
    >>> flm = np.zeros(16, dtype=complex)
    >>> flm[0] = np.sqrt(4 * np.pi)
    >>> bool(np.allclose(HealpixTransform(2, 4).synthesis(flm), 1.0, rtol=0, atol=1e-15))
    True
    """

    nside: int
    bandlimit: int
    spin: int = 0
    real: bool = False
    threads: int | None = None
    max_memory: int | None = None

    def __init__(  # noqa: PLR0913 - what describes a transform
        self,
        nside: int,
        bandlimit: int,
        spin: int = 0,
        *,
        real: bool = False,
        threads: int | None = None,
        max_memory: int | None = None,
    ) -> None:
        bandlimit = check_bandlimit(bandlimit)
        spin = check_spin(spin, bandlimit)
        real = check_flag(real, "real")
        if real and spin != 0:
            msg = f"real=True needs spin 0, not spin={spin}; a signal with spin is complex."
            raise ParameterError(msg)
        resolve_threads(threads)
        budget = check_max_memory(max_memory)
        values = (HealpixRings(nside).nside, bandlimit, spin, real, threads, budget)
        for field, value in zip(fields(self), values, strict=True):
            object.__setattr__(self, field.name, value)

    @property
    def rings(self) -> HealpixRings:
        """The ring layout."""
        return HealpixRings(self.nside)

    @property
    def shape(self) -> tuple[int]:
        """Shape of one map: (pixels,)."""
        return (self.rings.n_pixels,)

    @property
    def _threads(self) -> int:
        return threads_for(self.bandlimit, resolve_threads(self.threads))

    @functools.cached_property
    def _weights(self) -> Array:
        el = np.arange(self.bandlimit)
        weights = (-1.0) ** self.spin * np.sqrt((2 * el + 1) / (4 * np.pi))
        weights[: abs(self.spin)] = 0.0
        return weights.astype(np.complex128)[None]

    @property
    def _sums(self) -> OrderSums:
        sides = 1 if self.real else 2
        return OrderSums((-self.spin,), self._weights, 0, sides, self._threads)

    @property
    def _columns_shape(self) -> tuple[int, int]:
        n_m = self.bandlimit if self.real else 2 * self.bandlimit - 1
        return (n_m, self.rings.n_rings)

    @property
    def _engine(self) -> ParityEngine:
        return healpix_engine(self.nside, self.bandlimit, -self.spin)

    @property
    def _maps_dtype(self) -> type[np.generic]:
        return np.float64 if self.real else np.complex128

    def memory_estimate(self, batch: int = 1) -> dict[str, MemoryEstimate]:
        """Return the bytes that one call of each method takes.

        Parameters
        ----------
        batch : int, default 1
            Signals handed over in one call.

        Returns
        -------
        dict of str to MemoryEstimate
            By the name of the method.

        Raises
        ------
        ParameterError
            If ``batch`` is not an integer of at least 0.

        Examples
        --------
        >>> found = HealpixTransform(512, 1024, 2).memory_estimate()["synthesis"]
        >>> found.input == 16 * 1024**2, found.output == 16 * 12 * 512**2
        (True, True)
        """
        batch = check_integer(batch, "batch", minimum=0)
        flm = batch * 16 * self.bandlimit**2
        maps = batch * self.rings.n_pixels * np.dtype(self._maps_dtype).itemsize
        together = min(batch, self._maps_together)
        columns = 16 * together * math.prod(self._columns_shape)
        working = columns + self._threads * task_bytes(self.nside)
        return {
            "synthesis": MemoryEstimate(flm, maps, working),
            "adjoint_synthesis": MemoryEstimate(maps, flm, working),
        }

    def _check_memory(self, call: str, batch: tuple[int, ...]) -> None:
        if self.max_memory is not None:
            self.memory_estimate(math.prod(batch))[call].require(self.max_memory, call)

    def _share_rings(self, call: Callable[[BeltBlock | CapBlock, slice], None], maps: int) -> None:
        """Call for every block of every map: the modes of one fit a core's cache."""
        blocks = ring_blocks(self.nside, self.bandlimit, -self.spin)
        places = [slice(i, i + 1) for i in range(maps)]
        tasks = [functools.partial(call, block, one) for block in blocks for one in places]
        run_tasks(tasks, self._threads)

    @property
    def _maps_together(self) -> int:
        """Maps that go through the sums at once: they share recursions, and add up in memory."""
        fitting = _COLUMN_BYTES // (16 * math.prod(self._columns_shape))
        return min(_MOST_MAPS, max(1, fitting))

    def _parts(self, maps: int) -> list[slice]:
        step = self._maps_together
        return [slice(first, first + step) for first in range(0, maps, step)]

    def _fill_maps(self, flm: Array, maps: Array) -> None:
        columns = np.empty((len(flm), *self._columns_shape), dtype=np.complex128)
        one = np.ones((1, 1), dtype=np.complex128)
        self._engine.fill_columns(flm[:, None], self._sums, one, columns[:, None])
        self._share_rings(lambda block, i: block.fill_pixels(columns[i], maps[i]), len(maps))

    def _add_coefficients(self, maps: Array, flm: Array) -> None:
        columns = np.empty((len(flm), *self._columns_shape), dtype=np.complex128)
        self._share_rings(lambda block, i: block.fill_columns(maps[i], columns[i]), len(maps))
        self._engine.add_to_harmonics(columns[:, None], self._sums, flm[:, None])

    def synthesis(self, flm: Array) -> Array:
        """Compute maps from harmonic coefficients.

        Parameters
        ----------
        flm : ndarray, shape (..., bandlimit**2), complex
            [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]; with ``real`` those of
            a real field, of which only m >= 0 is read.

        Returns
        -------
        ndarray, shape (..., pixels), complex128 (float64 if ``real``)
            Maps in ring order; leading axes are a batch.

        Raises
        ------
        ShapeError
            If the last axis is not bandlimit**2 long.
        DataError
            If a coefficient is not a finite number.
        MemoryBudgetError
            If the call would take more than ``max_memory``.
        """
        self._check_memory("synthesis", np.shape(flm)[:-1])
        flm = writable(check_flm(flm, self.bandlimit))
        batch = flm.reshape(-1, flm.shape[-1])
        maps = np.empty((len(batch), *self.shape), dtype=self._maps_dtype)
        for part in self._parts(len(batch)):
            self._fill_maps(batch[part], maps[part])
        return maps.reshape(*flm.shape[:-1], *self.shape)

    def adjoint_synthesis(self, maps: Array) -> Array:
        """Apply the adjoint of `synthesis`: sums over pixels, without quadrature weights.

        Parameters
        ----------
        maps : ndarray, shape (..., pixels)
            Maps in ring order.

        Returns
        -------
        ndarray, shape (..., bandlimit**2), complex128
            The coefficients.

        Raises
        ------
        ShapeError
            If the last axis is not 12 nside^2 long.
        DataError
            If a value is not a finite number, or is complex with ``real``.
        MemoryBudgetError
            If the call would take more than ``max_memory``.
        """
        self._check_memory("adjoint_synthesis", np.shape(maps)[:-1])
        maps = check_map(maps, self.shape, real=self.real)
        rows = maps.reshape(-1, self.rings.n_pixels)
        flm = cleared_flm((rows.shape[0], self.bandlimit**2))
        for part in self._parts(len(rows)):
            self._add_coefficients(rows[part], flm[part])
        if self.real:
            fill_negative_orders(flm)
        return flm.reshape(*maps.shape[:-1], self.bandlimit**2)
