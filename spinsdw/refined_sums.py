"""`RefinedSums`: the exact quadrature of the McEwen-Wiaux grid and the sums over degree in one.

Columns are brought to the rings half a step apart, which mirror each other, a few orders m at a
time (`sampling.refinement`): there the integral over theta is a weighted sum, and the sums over
degree are those by parity.
"""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.parallel import run_tasks, threads_for
from spinsdw.parity_engine import ParityEngine, mirrored_rings
from spinsdw.ring_engine import OrderSums, RowPlaces
from spinsdw.sampling.equiangular import MW

__all__ = ["RefinedSums"]

Array = np.ndarray[Any, Any]

# Bytes of the refined columns that a task has at a time, but for those of the fewest orders m:
# they stay in a core's second-level cache.
_ROOM_BYTES = 2**20
# Refinement is faster from here on.
_LEAST_BANDLIMIT = 192
# Tasks of a transform that several threads may share.
_SPANS = 8


@functools.lru_cache(maxsize=128)
def _engine_of(sampling: MW, orders: tuple[int, ...]) -> ParityEngine:
    half = mirrored_rings(sampling.refinement.colatitudes)
    return ParityEngine(sampling.bandlimit, half, orders)


@dataclass(frozen=True, eq=False)
class RefinedSums:
    """Sums over degree of the columns of a few orders n that are mixed into outputs.

    Parameters
    ----------
    sampling : MW
        The grid.
    orders : tuple of int
        The orders n_i.
    mixing : ndarray, shape (outputs, orders), complex128
        What combines the orders into outputs.
    real : bool
        Whether there are columns of m >= 0 only.
    threads : int
        Threads to share the work.
    """

    sampling: MW
    orders: tuple[int, ...]
    mixing: Array
    real: bool
    threads: int

    @property
    def _engine(self) -> ParityEngine:
        return _engine_of(self.sampling, self.orders)

    @property
    def is_worthwhile(self) -> bool:
        """Whether this is faster than a quadrature on the grid's own rings."""
        return self.sampling.bandlimit >= _LEAST_BANDLIMIT and self._engine.is_worthwhile

    def _room_shape(self, maps: int, orders: int) -> tuple[int, int, int, int]:
        """Shape of the refined columns of some orders m and their opposites."""
        rows = orders if self.real else 2 * orders
        return (maps, len(self.orders), rows, self.sampling.n_phi + 1)

    @property
    def _step(self) -> int:
        """Return how many orders m are refined at a time, a multiple of `M_CHUNK`.

        Whatever the number of threads and of maps: results must not depend on them.
        """
        from spinsdw.compiled.order_sums import M_CHUNK

        bandlimit = self.sampling.bandlimit
        fitting = _ROOM_BYTES // (16 * math.prod(self._room_shape(1, M_CHUNK)))
        if threads_for(bandlimit, 2) > 1:
            fitting = min(fitting, bandlimit // (M_CHUNK * _SPANS))
        return min(M_CHUNK * max(1, fitting), bandlimit)

    def room_bytes(self, maps: int) -> int:
        """Return the bytes of the refined columns that all threads have at a time."""
        return self.threads * 16 * math.prod(self._room_shape(maps, self._step))

    def _share(self, call: Callable[[range, Array], None], maps: int) -> None:
        """Call for ranges of orders m, each with room for its refined columns."""
        bandlimit, step = self.sampling.bandlimit, self._step
        rooms: deque[Array] = deque()

        def call_span(span: range) -> None:
            try:
                room = rooms.pop()
            except IndexError:
                room = np.empty(math.prod(self._room_shape(maps, step)), dtype=np.complex128)
            shape = self._room_shape(maps, len(span))
            call(span, room[: math.prod(shape)].reshape(shape))
            rooms.append(room)

        spans = [range(m, min(m + step, bandlimit)) for m in range(0, bandlimit, step)]
        run_tasks([functools.partial(call_span, span) for span in spans], self.threads)

    @staticmethod
    def _rows(span: range) -> RowPlaces:
        """Return where the orders m and -m of a range are in its refined columns."""
        return span.start, 2 * len(span) - 1 + span.start

    def fill_columns(self, flm: Array, sums: OrderSums, columns: Array) -> None:
        """Fill columns [map, output, m, ring] with the adjoint of the integrals over theta."""
        identity = np.eye(len(self.orders), dtype=np.complex128)

        def fill(span: range, room: Array) -> None:
            call = self._engine.filling(flm, sums, identity, room, self._rows(span))
            call(span.start, span.stop)
            for fine, one in zip(room, columns, strict=True):
                self.sampling.refinement.coarsen(fine, self.orders, span, one)
                self._mix(span, one)

        self._share(fill, len(flm))

    def _mix(self, span: range, columns: Array) -> None:
        from spinsdw.compiled.columns import mix_columns

        mix_columns(self.mixing, span.start, span.stop, columns)
        if not self.real:
            end = columns.shape[1] + 1
            mix_columns(self.mixing, end - span.stop, end - max(span.start, 1), columns)

    def add_to_harmonics(self, columns: Array, sums: OrderSums, out: Array) -> None:
        """Add to ``out`` what the columns [map, output, m, ring] of integrands integrate to."""
        unmixing = np.ascontiguousarray(self.mixing.conj().T)

        def add(span: range, room: Array) -> None:
            for one, fine in zip(columns, room, strict=True):
                self.sampling.refinement.refine(one, self.orders, unmixing, span, fine)
            self._engine.adding(room, sums, out, self._rows(span))(span.start, span.stop)

        self._share(add, len(out))
