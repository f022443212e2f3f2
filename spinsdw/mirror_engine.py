"""`MirrorEngine`: the sums over degree for one order on rings symmetric about the equator.

Away from the poles they are sums of functions of order 0 and of either parity, which take half the
multiply-adds (`compiled.legendre_sums`). The way there divides by sin(theta)^|n|, so the rings next
to a pole, and large orders, are left to a `RingEngine`.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.ring_engine import OrderCall, OrderSums, RingEngine, share_orders

__all__ = ["MirrorEngine"]

Array = np.ndarray[Any, Any]

# Rings with sin(theta) below |n| times this are next to a pole: the division by sin(theta)^|n|
# would enlarge rounding errors by more than 16 (n = 1), 64 (2) .. 256 (4 and 8).
_LEAST_SINE = 1 / 16
# Steps of two degrees gather more rounding next to a pole, up to 16 times as much at L = 1024: so
# for n = 0 the rule of n = 1 holds, and for any n, L sin(theta) is not below this.
_LEAST_PHASE = 8.0
_LARGEST_ORDER = 8


def _lowering_table(n: int, size: int) -> Array:
    """Return the parts of U_l, V_l, W_l of `compiled.legendre_recursion` that depend on l and n."""
    el = np.arange(n, size, dtype=float)
    table = np.zeros((3, size))
    table[0, n:] = np.sqrt((el - n + 1) * (el - n + 2)) / ((el + 1) * (2 * el + 1))
    table[1, n:] = np.sqrt((el + n) * (el - n + 1)) / (el * (el + 1))
    table[2, n:] = np.sqrt((el + n - 1) * (el + n)) / (el * (2 * el + 1))
    return table


@dataclass(frozen=True, eq=False)
class MirrorEngine:
    """Sums over d^l_mn(theta) for one order n.

    Parameters
    ----------
    bandlimit : int
        Degrees are below it.
    colatitudes : ndarray, shape (rings,)
        Of the northern rings and of the equator, if it is one; increasing.
    order : int
        n.
    """

    bandlimit: int
    colatitudes: Array
    order: int

    @functools.cached_property
    def _first_ring(self) -> int:
        """How many rings are next to the pole."""
        size = abs(self.order)
        if size > _LARGEST_ORDER:
            return self.colatitudes.size
        least = max(max(size, 1) * _LEAST_SINE, _LEAST_PHASE / self.bandlimit)
        return int(np.count_nonzero(np.sin(self.colatitudes) < least))

    @functools.cached_property
    def _cap(self) -> RingEngine:
        return RingEngine(self.bandlimit, self.colatitudes[: self._first_ring], symmetric=True)

    @functools.cached_property
    def _belt(self) -> RingEngine:
        colatitudes = self.colatitudes[self._first_ring :]
        return RingEngine(self.bandlimit + abs(self.order), colatitudes, symmetric=True)

    @functools.cached_property
    def _rings(self) -> tuple[Array, ...]:
        sine, plus, minus, _ = self._belt.rings
        # Places beyond the last ring, whose sums have no weight, are at the equator, where no
        # function grows beyond the range of floats: 0 times infinity would be no zero.
        theta = np.full(sine.size, np.pi / 2)
        theta[: self._belt.colatitudes.size] = self._belt.colatitudes
        cosine = np.cos(theta)
        divided = np.where(sine > 0, sine, 1.0) ** -abs(self.order)
        return sine, plus, minus, cosine**2, -(sine**2), cosine, divided

    @functools.cached_property
    def _tables(self) -> tuple[Array, ...]:
        odd = 2.0 * np.arange(self._belt.bandlimit + 4) + 1
        orders = range(1, abs(self.order) + 1)
        lowering = [_lowering_table(n, self._belt.bandlimit + 4) for n in orders]
        stacked = np.array(lowering).reshape(-1, 3, odd.size)
        return *self._belt.tables, 1 / np.sqrt(odd), stacked

    @functools.cached_property
    def limits(self) -> Array:
        """For each ring the number of orders m >= 0 that matter; others are not filled."""
        parts = []
        for part, reach in ((self._cap, abs(self.order)), (self._belt, 0)):
            if part.colatitudes.size:
                first = part.windows(reach)[0][: self.bandlimit]
                parts.append(np.searchsorted(first, np.arange(part.colatitudes.size), side="right"))
        return np.concatenate(parts)

    def _belt_geometry(self) -> tuple[Any, ...]:
        return self._rings, self._belt.windows(0), self._tables

    def _in_cap(self, call: OrderCall) -> OrderCall:
        """Leave out the orders that no ring next to the pole has."""
        count = int(self.limits[: self._first_ring].max())
        return lambda first, stop: call(first, min(stop, count))

    def _filling(self, flm: Array, sums: OrderSums, out: Array) -> Iterator[OrderCall]:
        from spinsdw.compiled.legendre_sums import fill_mirrored_columns

        one = np.ones((1, 1), dtype=np.complex128)
        if self._first_ring > 0:
            yield self._in_cap(self._cap.filling(flm[:, None], sums, one, out[:, None]))
        if self._first_ring < self.colatitudes.size:
            what = (self.bandlimit, sums.sides, self.order, self._first_ring, flm, sums.weights[0])
            where = (*self._belt_geometry(), out)
            yield lambda first, stop: fill_mirrored_columns(first, stop, *what, *where)

    def _adding(self, columns: Array, sums: OrderSums, out: Array) -> Iterator[OrderCall]:
        from spinsdw.compiled.legendre_sums import add_mirrored_to_harmonics

        if self._first_ring > 0:
            yield self._in_cap(self._cap.adding(columns[:, None], sums, out[:, None]))
        if self._first_ring < self.colatitudes.size:
            what = (self.bandlimit, sums.sides, self.order, self._first_ring, columns)
            where = (sums.weights[0], *self._belt_geometry(), out)
            yield lambda first, stop: add_mirrored_to_harmonics(first, stop, *what, *where)

    def _share(self, calls: Iterator[OrderCall], threads: int) -> None:
        """Make all calls for the same orders one after the other: they may add to one output."""
        parts = list(calls)

        def call(first: int, stop: int) -> None:
            for part in parts:
                part(first, stop)

        share_orders(call, self.bandlimit, threads)

    def fill_columns(self, flm: Array, sums: OrderSums, out: Array) -> None:
        """Fill ``out[i, m, ring]`` from ``flm[i]``; shapes as in `compiled.legendre_sums`."""
        self._share(self._filling(flm, sums, out), sums.threads)

    def add_to_harmonics(self, columns: Array, sums: OrderSums, out: Array) -> None:
        """Add to ``out[i]`` the adjoint sums of ``columns[i]``, for conjugated weights."""
        self._share(self._adding(columns, sums, out), sums.threads)
