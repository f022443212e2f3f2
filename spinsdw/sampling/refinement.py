"""`RingRefinement`: an integral over theta as a weighted sum over twice as many rings.

Between the C points of the full circle, A, lie C more, B, and S is the shift from A to B
(`half_step`). F |sin|, cut off at degree 2 L - 2, and d^l_mn are trigonometric polynomials that the
2 C points integrate (`equiangular`), so with w that cut-off series

    integral of F d^l_mn sin(theta) = pi / (2 C) (sum_A w F d^l_mn + sum_B w (S F) d^l_mn) .

Both functions have a parity on the circle, so the sum over it is one over the C + 1 rings at
k pi / C, which mirror each other.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.sampling.half_step import HalfStep

__all__ = ["BATCH_SIZE", "RingRefinement", "column_parities"]

Array = np.ndarray[Any, Any]

# Complex numbers of one batch of circles: 4 such batches stay in a core's cache.
BATCH_SIZE = 2**14


@dataclass(frozen=True, eq=False)
class RingRefinement:
    """Between Fourier columns on the rings of a grid and those on the rings half a step apart.

    Parameters
    ----------
    size : int
        C, points of the full circle.
    offset : int
        1 if only the southern pole is a ring (MW), 0 if both are (MWSS).
    weights : tuple of ndarray, each of shape (C,)
        Quadrature weights of the points of the circle and of those half a step on.
    """

    size: int
    offset: int
    weights: tuple[Array, Array]

    @property
    def colatitudes(self) -> Array:
        """Colatitudes of the rings; float64, shape (C + 1,)."""
        return np.pi * np.arange(self.size + 1) / self.size

    @functools.cached_property
    def _half_step(self) -> HalfStep:
        return HalfStep(self.size)

    @functools.cached_property
    def _ones(self) -> Array:
        return np.ones(self.size)

    def _batches(self, span: range, n_m: int, orders: int) -> Iterator[tuple[Array, Array]]:
        """Give places of even m and of odd m, in pairs: (in columns, in fine rows), -1 for none.

        Fine rows are of m in ``span`` and, of complex signals, then of -m from the last on. Pairs
        and batches do not depend on where a span of whole multiples of 16 begins and ends.
        """
        even = np.arange(span.start, span.stop, 2)
        m = np.stack([even, even + 1])
        is_there = m < span.stop
        source, target = np.where(is_there, m, -1), np.where(is_there, m - span.start, -1)
        if n_m == self.size:
            is_there = is_there & (m > 0)
            last = 2 * len(span) - 1 + span.start
            opposite = np.where(is_there, n_m - m, -1), np.where(is_there, last - m, -1)
            # Next to each other: (2 k, 2 k + 1), (-2 k, -2 k - 1).
            source = np.stack([source, opposite[0]], axis=-1).reshape(2, -1)
            target = np.stack([target, opposite[1]], axis=-1).reshape(2, -1)
        step = 2 * max(1, BATCH_SIZE // (2 * self.size * orders))
        for first in range(0, source.shape[1], step):
            part = slice(first, first + step)
            yield np.ascontiguousarray(source[:, part]), np.ascontiguousarray(target[:, part])

    def refine(
        self, columns: Array, orders: tuple[int, ...], mixing: Array, span: range, fine: Array
    ) -> None:
        """Mix the columns of some orders m, bring them to the fine rings and multiply with weights.

        columns : complex, shape (at least rows of mixing, n_m, rings), times P; mixing :
        complex128, shape (orders, rows of columns); fine : complex128, shape (orders, rows of
        ``span`` and its opposites, C + 1), of which sum_k d^l_{m, n_i}(theta_k) fine[i, m, k] is
        the integral of F d^l_mn over the sphere.
        """
        from spinsdw.compiled.columns import fill_circles, split_circles

        parities, offset = column_parities(orders), self.offset
        for source, target in self._batches(span, columns.shape[1], parities.size):
            shape = (parities.size, source.shape[1], self.size)
            circles = np.empty(shape, dtype=np.complex128)
            fill_circles(columns, mixing, source[0], source[1], parities, offset, circles)
            shifted = self._half_step.shift(circles)
            split_circles(circles, self.weights[0], target, parities, offset, 0, fine)
            split_circles(shifted, self.weights[1], target, parities, offset, 1, fine)

    def coarsen(self, fine: Array, orders: tuple[int, ...], span: range, columns: Array) -> None:
        """Apply the adjoint of `refine` without mixing: fill rows i < orders of the columns."""
        from spinsdw.compiled.columns import fold_circles, join_circles

        parities, offset = column_parities(orders), self.offset
        for target, source in self._batches(span, columns.shape[1], parities.size):
            shape = (parities.size, source.shape[1], self.size)
            circles, shifted = (np.empty(shape, dtype=np.complex128) for _ in range(2))
            join_circles(fine, self.weights[0], source, parities, offset, 0, circles)
            join_circles(fine, self.weights[1], source, parities, offset, 1, shifted)
            shifted = self._half_step.shift_back(shifted)
            even, odd = target
            fold_circles(circles, self._ones, shifted, even, odd, parities, offset, columns)


def column_parities(orders: tuple[int, ...]) -> Array:
    """Return the parity in theta of the columns of even m, for each order n."""
    return np.where(np.array(orders) % 2 == 0, 1.0, -1.0)
