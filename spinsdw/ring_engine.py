"""`RingEngine`: Wigner sums over degree for a set of rings, and their adjoint.

The compiled kernels need the rings' geometry padded to whole vector blocks, tables of square roots
and binomials, and for each m the range of rings where d^l_mn is not negligible. This object holds
them for one bandlimit and one set of colatitudes, and shares the work among threads.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.parallel import run_tasks

__all__ = ["OrderCall", "OrderSums", "RingEngine", "RowPlaces", "make_runs", "share_orders"]

Array = np.ndarray[Any, Any]
OrderCall = Callable[[int, int], None]
# (a, b): columns of order m are in row m - a, those of -m in row b - m.
RowPlaces = tuple[int, int]

# exp(-45) = 2**-65: d^l_mn below it adds nothing to a sum in double precision.
_NEGLIGIBLE = 45.0
# Axes of the coefficients of one signal: sources, (l, m).
_SINGLE = 2
# Ranges of orders for each thread.
_RANGES = 8


def share_orders(call: OrderCall, bandlimit: int, threads: int) -> None:
    """Call for ranges of orders that cover 0 <= m < bandlimit, on ``threads`` threads."""
    from spinsdw.compiled.order_sums import M_CHUNK

    # Fewer ranges are fewer calls; the last are short work all the same, for their m is large.
    step = M_CHUNK * max(1, bandlimit // (M_CHUNK * _RANGES * threads))
    step = bandlimit if threads == 1 else step
    ranges = [(m, min(m + step, bandlimit)) for m in range(0, bandlimit, step)]
    run_tasks([functools.partial(call, *one) for one in ranges], threads)


@functools.lru_cache(maxsize=128)
def make_runs(orders: tuple[int, ...], *, symmetric: bool = False, sides: int = 2) -> Array:
    """List the passes of the recursion that serve every series F_n(+-m), n in ``orders``.

    Each row is n, then (i, sigma, mirrored) for up to two series, as `compiled.order_sums` reads
    them. ``symmetric`` grids compute the northern rings and mirror them.
    """
    place = {n: i for i, n in enumerate(orders)}
    none = (-1, 1, 0)
    rows: list[tuple[int, ...]] = []
    if symmetric:
        for n, i in place.items():
            if n == 0 and sides == 1:
                rows.append((0, i, 1, 0, i, 1, 1))
            else:
                rows.append((n, i, 1, 0, i, -1, 1))
                rows.append((-n, i, 1, 1, i, -1, 0))
    else:
        for size in sorted({abs(n) for n in orders}):
            for n in (size, -size) if size else (0,):
                plus = (place[n], 1, 0) if n in place else none
                minus = (place[-n], -1, 0) if -n in place else none
                if plus[0] >= 0 or minus[0] >= 0:
                    rows.append((n, *plus, *minus))
    return np.array(rows, dtype=np.int64)


def _barrier(m: Array, bandlimit: int, sine: Array) -> Array:
    """Return the exponent of decay of d^l_m0, l = bandlimit, behind its turning point sin = m/l.

    It is the integral of sqrt(m^2 / sin^2 - l^2) over theta (WKB), zero in the classical region.
    """
    degree = float(bandlimit)
    cosine = np.sqrt(1 - sine**2)
    q = np.sqrt(np.maximum(m**2 - (degree * sine) ** 2, 0.0))
    k = np.sqrt(np.maximum(degree**2 - m**2, 1e-30))
    ratio = np.minimum(q / np.maximum(m * cosine, 1e-300), 1 - 1e-16)
    exponent = m * np.arctanh(ratio) - degree * np.log(np.maximum(degree * cosine + q, 1e-300) / k)
    return np.where(q > 0, exponent, 0.0)


def _largest_order(sine: Array, bandlimit: int) -> Array:
    """Return for each ring the largest m at which d^l_m0, l < bandlimit, is not negligible."""
    low, high = np.minimum(bandlimit * sine, bandlimit - 1.0), np.full(sine.shape, float(bandlimit))
    for _ in range(40):
        middle = 0.5 * (low + high)
        beyond = _barrier(middle, bandlimit, sine) > _NEGLIGIBLE
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.ceil(high).astype(np.int64)


@dataclass(frozen=True, eq=False)
class OrderSums:
    """What is summed: sum_l weights[i, l] f_lm d^l_{m, n_i}(theta) for each order n_i.

    Parameters
    ----------
    orders : tuple of int
        The orders n_i.
    weights : ndarray, shape (orders, L), complex128
        A factor for each order and degree.
    lowest : int
        Degrees below it have weight zero, and are skipped.
    sides : int
        2 for +-m, 1 for m >= 0 only.
    threads : int
        Threads to share the work.
    """

    orders: tuple[int, ...]
    weights: Array
    lowest: int = 0
    sides: int = 2
    threads: int = 1


@dataclass(frozen=True, eq=False)
class RingEngine:
    """Sums over d^l_mn(theta) at fixed colatitudes.

    Parameters
    ----------
    bandlimit : int
        Degrees are below it.
    colatitudes : ndarray, shape (rings,)
        Increasing, in [0, pi]; of a symmetric grid the northern rings and the equator.
    symmetric : bool
        Whether the rings pi - theta belong to the grid too.
    first_ring : int
        Where the rings begin in columns of more rings; only if not symmetric.
    """

    bandlimit: int
    colatitudes: Array
    symmetric: bool = False
    first_ring: int = 0

    @functools.cached_property
    def tables(self) -> tuple[Array, Array, Array]:
        """sqrt(k), the central binomials over 4^k, and 1 / k."""
        numbers = np.arange(2 * self.bandlimit + 2, dtype=float)
        inverse = np.divide(1.0, numbers, out=np.zeros_like(numbers), where=numbers > 0)
        # binom(2M, M) / 4**M, up to M = L for the orders above m.
        index = np.arange(1, self.bandlimit + 1, dtype=float)
        central = np.concatenate([[1.0], np.cumprod((2 * index - 1) / (2 * index))])
        return np.sqrt(numbers), central, inverse

    def _padded_rings(self, padding: int) -> tuple[Array, ...]:
        half = self.colatitudes / 2
        sine = np.sin(self.colatitudes)
        plus, minus = 2 * np.cos(half) ** 2, 2 * np.sin(half) ** 2
        # sin(pi) is not zero in floats, but a pole must be one: d^l_mn vanishes there exactly.
        pole = sine < 4e-16
        sine[pole] = 0.0
        plus[pole & (minus > 1)], minus[pole & (minus < 1)] = 0.0, 0.0
        columns = ((sine, 1.0), (plus, 1.0), (minus, 1.0), (-minus, -1.0))
        return tuple(np.concatenate([v, np.full(padding, fill)]) for v, fill in columns)

    @functools.cached_property
    def rings(self) -> tuple[Array, ...]:
        """sin, 1 + cos, 1 - cos and cos - 1 of every ring, and of one block of padding."""
        from spinsdw.compiled.vectors import RINGS

        return self._padded_rings(RINGS)

    @functools.lru_cache(maxsize=32)  # noqa: B019 - engines are few and shared
    def windows(self, largest_order: int) -> Array:
        """For each m the first and one past the last ring that matter at |n| <= largest_order."""
        sine = self.rings[0][: self.colatitudes.size]
        reach = _largest_order(sine, self.bandlimit) + largest_order
        m = np.arange(self.bandlimit)
        north = np.maximum.accumulate(reach)
        south = np.maximum.accumulate(reach[::-1])
        low = np.searchsorted(north, m)
        high = sine.size - np.searchsorted(south, m)
        return np.stack([np.minimum(low, sine.size), np.maximum(high, 0)]).astype(np.int64)

    def _geometry(self, sums: OrderSums) -> tuple[Any, ...]:
        runs = make_runs(sums.orders, symmetric=self.symmetric, sides=sums.sides)
        windows = self.windows(max(abs(n) for n in sums.orders))
        return runs, windows

    def filling(
        self,
        flm: Array,
        sums: OrderSums,
        mixing: Array,
        out: Array,
        rows: RowPlaces | None = None,
    ) -> OrderCall:
        """Return what fills the orders first <= m < stop of ``out[..., k, row, ring]``.

        Shapes as in `compiled.order_sums.fill_columns`; both arrays may be without a batch. By
        default m is in row m and -m in the m-th from the end.
        """
        from spinsdw.compiled.order_sums import fill_columns

        if flm.ndim == _SINGLE:
            flm, out = flm[None], out[None]
        runs, windows = self._geometry(sums)
        inputs = (self.bandlimit, sums.lowest, sums.sides, flm, sums.weights, runs, mixing)
        geometry = (self.rings, windows, self.tables)
        place = (*(rows or (0, out.shape[-2])), self.first_ring)
        return lambda first, stop: fill_columns(first, stop, *inputs, *geometry, place, out)

    def adding(
        self, columns: Array, sums: OrderSums, out: Array, rows: RowPlaces | None = None
    ) -> OrderCall:
        """Return what adds to the coefficients ``out`` of the orders first <= m < stop.

        Shapes as in `compiled.order_sums.add_columns_to_harmonics`, or without a batch; rows as in
        `filling`.
        """
        from spinsdw.compiled.order_sums import add_columns_to_harmonics

        if out.ndim == _SINGLE:
            columns, out = columns[None], out[None]
        runs, windows = self._geometry(sums)
        inputs = (self.bandlimit, sums.lowest, sums.sides, columns, sums.weights, runs)
        place = (*(rows or (0, columns.shape[-2])), self.first_ring)
        geometry = (self.rings, windows, self.tables, place)
        return lambda first, stop: add_columns_to_harmonics(first, stop, *inputs, *geometry, out)

    def fill_columns(self, flm: Array, sums: OrderSums, mixing: Array, out: Array) -> None:
        """Fill ``out[k, m, ring]``, on ``sums.threads`` threads."""
        share_orders(self.filling(flm, sums, mixing, out), self.bandlimit, sums.threads)

    def add_to_harmonics(self, columns: Array, sums: OrderSums, out: Array) -> None:
        """Add to the coefficients ``out``, on ``sums.threads`` threads."""
        share_orders(self.adding(columns, sums, out), self.bandlimit, sums.threads)
