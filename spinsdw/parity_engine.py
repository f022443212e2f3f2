"""`ParityEngine`: the sums over degree for a few orders, by functions of order 0 and either parity.

They take half the multiply-adds of `RingEngine`, and less than that where several orders share
their values (`compiled.legendre_sums`). The way there divides by sin(theta)^|n|, so the rings next
to a pole, and large orders, are left to a `RingEngine`.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.ring_engine import OrderCall, OrderSums, RingEngine, RowPlaces, share_orders

__all__ = ["HalfRings", "ParityEngine", "interleaved_rings", "mirrored_rings"]

Array = np.ndarray[Any, Any]

# Rings are next to a pole where the division by sin(theta)^|n| would enlarge rounding errors by
# more than this.
_MOST_ENLARGED = 256.0
# Steps of two degrees gather more rounding next to a pole, up to 16 times as much at L = 1024: so
# for any n neither sin(theta) nor L sin(theta) is below these.
_LEAST_SINE = 1 / 16
_LEAST_PHASE = 8.0
# Larger orders have a wide cap, and are summed by runs.
_LARGEST_ORDER = 8
# The part of the rings that may be next to a pole: with more the general sums are faster.
_MOST_POLAR = 0.4
# Axes of the coefficients of one signal: sources, (l, m).
_SINGLE = 2


def _lowering_table(n: int, size: int) -> Array:
    """Return the parts of U_l, V_l, W_l of `compiled.legendre_recursion` that depend on l and n."""
    el = np.arange(n, size, dtype=float)
    table = np.zeros((3, size))
    table[0, n:] = np.sqrt((el - n + 1) * (el - n + 2)) / ((el + 1) * (2 * el + 1))
    table[1, n:] = np.sqrt((el + n) * (el - n + 1)) / (el * (el + 1))
    table[2, n:] = np.sqrt((el + n - 1) * (el + n)) / (el * (2 * el + 1))
    return table


@dataclass(frozen=True, eq=False)
class HalfRings:
    """The rings of a grid, each with its mirror image if it has one, from a pole to the equator.

    Parameters
    ----------
    colatitudes : ndarray, shape (rings,)
        Their distances from the pole that is nearer; increasing.
    places : ndarray of uint64, shape (rings,)
        Where they are in the grid.
    signs : ndarray of float64, shape (rings,)
        Of the cosines of the colatitudes there.
    mirrors : ndarray of uint64, shape (at most rings,)
        Where the mirror images of the first of them are. The equator, last, is none of its own.
    """

    colatitudes: Array
    places: Array
    signs: Array
    mirrors: Array

    @property
    def are_mirrored(self) -> bool:
        """Whether any has a mirror image."""
        return self.mirrors.size > 0


def mirrored_rings(colatitudes: Array) -> HalfRings:
    """Return those of a grid symmetric about the equator."""
    count = (colatitudes.size + 1) // 2
    places = np.arange(colatitudes.size, dtype=np.uint64)
    mirrors = places[: count - 1 : -1].copy()
    return HalfRings(colatitudes[:count], places[:count], np.ones(count), mirrors)


def interleaved_rings(colatitudes: Array) -> HalfRings:
    """Return those of a grid of which the mirror image of no ring is a ring."""
    is_south = colatitudes > np.pi / 2
    distances = np.where(is_south, np.pi - colatitudes, colatitudes)
    places = np.argsort(distances, kind="stable").astype(np.uint64)
    signs = np.where(is_south, -1.0, 1.0)
    return HalfRings(distances[places], places, signs[places], np.empty(0, dtype=np.uint64))


@dataclass(frozen=True, eq=False)
class ParityEngine:
    """Sums over d^l_mn(theta) for one or several orders n.

    Parameters
    ----------
    bandlimit : int
        Degrees are below it.
    half : HalfRings
        The rings.
    orders : tuple of int
        The orders n.
    clears : bool
        Whether `fill_columns` sets columns that do not matter to zero, or leaves them alone.
    """

    bandlimit: int
    half: HalfRings
    orders: tuple[int, ...]
    clears: bool = True

    @property
    def _reach(self) -> int:
        return max((abs(n) for n in self.orders), default=0)

    @functools.cached_property
    def _first_ring(self) -> int:
        """How many rings are next to a pole."""
        size = self._reach
        if size > _LARGEST_ORDER:
            return self.half.places.size
        enlarging = _MOST_ENLARGED ** (-1 / size) if size else 0.0
        least = max(_LEAST_SINE, enlarging, _LEAST_PHASE / self.bandlimit)
        return int(np.count_nonzero(np.sin(self.half.colatitudes) < least))

    @property
    def is_worthwhile(self) -> bool:
        """Whether few enough rings are next to a pole for the others to be faster in all."""
        return self._first_ring <= _MOST_POLAR * self.half.places.size

    @functools.cached_property
    def _caps(self) -> tuple[RingEngine, ...]:
        """The sums on the rings next to a pole."""
        part = slice(0, self._first_ring)
        colatitudes, places = self.half.colatitudes[part], self.half.places[part]
        if self.half.are_mirrored:
            return (RingEngine(self.bandlimit, colatitudes, symmetric=True),) if places.size else ()
        caps = []
        for is_south in (False, True):
            chosen = (self.half.signs[part] < 0) == is_south
            # Where the rings lie from north to south.
            order = np.argsort(places[chosen])
            theta = colatitudes[chosen][order]
            if theta.size:
                theta = np.pi - theta if is_south else theta
                first = int(places[chosen].min())
                caps.append(RingEngine(self.bandlimit, theta, first_ring=first))
        return tuple(caps)

    @functools.cached_property
    def _belt(self) -> RingEngine:
        colatitudes = self.half.colatitudes[self._first_ring :]
        return RingEngine(self.bandlimit + self._reach, colatitudes, symmetric=True)

    @functools.cached_property
    def _rings(self) -> tuple[Array, ...]:
        """Sine, 1 + cos, 1 - cos, cos^2, -sin^2, signed cosine, and places in the grid."""
        sine, plus, minus, _ = self._belt.rings
        # Places beyond the last ring, whose sums have no weight, are at the equator, where no
        # function grows beyond the range of floats: 0 times infinity would be no zero.
        theta = np.full(sine.size, np.pi / 2)
        count = self._belt.colatitudes.size
        theta[:count] = self._belt.colatitudes
        cosine = np.cos(theta)
        signed = cosine.copy()
        signed[:count] *= self.half.signs[self._first_ring :]
        places, mirrors = (x[self._first_ring :] for x in (self.half.places, self.half.mirrors))
        return sine, plus, minus, cosine**2, -(sine**2), signed, places, mirrors

    @functools.cached_property
    def _divisors(self) -> Array:
        """1 / sin(theta)^k, k up to the largest |n|."""
        sine = self._rings[0]
        divisor = 1 / np.where(sine > 0, sine, 1.0)
        return np.array([divisor**k for k in range(self._reach + 1)])

    @functools.cached_property
    def _tables(self) -> tuple[Array, ...]:
        odd = 2.0 * np.arange(self._belt.bandlimit + 4) + 1
        orders = range(1, self._reach + 1)
        lowering = [_lowering_table(n, self._belt.bandlimit + 4) for n in orders]
        stacked = np.array(lowering).reshape(-1, 3, odd.size)
        return *self._belt.tables, 1 / np.sqrt(odd), stacked

    @functools.cached_property
    def limits(self) -> Array:
        """For each half ring the number of orders m >= 0 that matter; others may not be filled."""
        reach = self._reach
        cap = RingEngine(self.bandlimit, self.half.colatitudes[: self._first_ring], symmetric=True)
        parts = []
        for part, more in ((cap, reach), (self._belt, 0)):
            if part.colatitudes.size:
                first = part.windows(more)[0][: self.bandlimit]
                parts.append(np.searchsorted(first, np.arange(part.colatitudes.size), side="right"))
        return np.concatenate(parts)

    def _belt_geometry(self) -> tuple[Any, ...]:
        orders = np.array(self.orders, dtype=np.int64)
        return orders, self._rings, self._divisors, self._belt.windows(0), self._tables

    def _in_cap(self, call: OrderCall) -> OrderCall:
        """Leave out the orders that no ring next to the pole has."""
        count = int(self.limits[: self._first_ring].max())
        return lambda first, stop: call(first, min(stop, count))

    @property
    def _has_belt(self) -> bool:
        return self._first_ring < self.half.places.size

    def _filling(
        self, flm: Array, sums: OrderSums, mixing: Array, out: Array, rows: RowPlaces
    ) -> Iterator[OrderCall]:
        from spinsdw.compiled.legendre_sums import fill_parity_columns

        for cap in self._caps:
            call = cap.filling(flm, sums, mixing, out, rows)
            yield call if self.clears else self._in_cap(call)
        if self._has_belt:
            what = (self.bandlimit, sums.lowest, sums.sides, flm, sums.weights, mixing)
            where = (*self._belt_geometry(), self.clears, rows, out)
            yield lambda first, stop: fill_parity_columns(first, stop, *what, *where)

    def _adding(
        self, columns: Array, sums: OrderSums, out: Array, rows: RowPlaces
    ) -> Iterator[OrderCall]:
        from spinsdw.compiled.legendre_sums import add_parity_columns

        for cap in self._caps:
            yield self._in_cap(cap.adding(columns, sums, out, rows))
        if self._has_belt:
            what = (self.bandlimit, sums.lowest, sums.sides, columns, sums.weights)
            where = (*self._belt_geometry(), rows, out)
            yield lambda first, stop: add_parity_columns(first, stop, *what, *where)

    @staticmethod
    def _together(calls: Iterator[OrderCall]) -> OrderCall:
        """Make all calls for the same orders one after the other: they may add to one output."""
        parts = list(calls)

        def call(first: int, stop: int) -> None:
            for part in parts:
                part(first, stop)

        return call

    def filling(
        self,
        flm: Array,
        sums: OrderSums,
        mixing: Array,
        out: Array,
        rows: RowPlaces | None = None,
    ) -> OrderCall:
        """Return what fills the orders first <= m < stop; as `RingEngine.filling`."""
        if flm.ndim == _SINGLE:
            flm, out = flm[None], out[None]
        return self._together(self._filling(flm, sums, mixing, out, rows or (0, out.shape[2])))

    def adding(
        self, columns: Array, sums: OrderSums, out: Array, rows: RowPlaces | None = None
    ) -> OrderCall:
        """Return what adds to the coefficients of the orders first <= m < stop."""
        if out.ndim == _SINGLE:
            columns, out = columns[None], out[None]
        return self._together(self._adding(columns, sums, out, rows or (0, columns.shape[2])))

    def fill_columns(self, flm: Array, sums: OrderSums, mixing: Array, out: Array) -> None:
        """Fill ``out[..., k, m, ring]``; shapes as in `compiled.legendre_sums`."""
        share_orders(self.filling(flm, sums, mixing, out), self.bandlimit, sums.threads)

    def add_to_harmonics(self, columns: Array, sums: OrderSums, out: Array) -> None:
        """Add to ``out`` the adjoint sums of ``columns``, for conjugated weights."""
        share_orders(self.adding(columns, sums, out), self.bandlimit, sums.threads)
