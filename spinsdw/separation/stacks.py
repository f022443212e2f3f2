"""Operations on stacks of maps or coefficients, one row each, shared among threads.

Rows are split in ranges that are the same for any number of threads, and so are the results.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from spinsdw.parallel import run_tasks

__all__ = ["SplitFilter", "Stacks"]

Array = np.ndarray[Any, Any]

# Samples or coefficients that one task takes of every row.
_RANGE = 2**15


@dataclass(frozen=True, eq=False)
class SplitFilter:
    """Multiply E and B by real factors of degree, acting on p = -(E + iB).

    Parameters
    ----------
    e_factors, b_factors : ndarray, shape (bandlimit,), float64
        The factors.
    threads : int, default 1
        Threads to use.
    """

    e_factors: Array
    b_factors: Array
    threads: int = 1

    @functools.cached_property
    def _factors(self) -> tuple[Array, Array]:
        return (self.e_factors + self.b_factors) / 2, (self.e_factors - self.b_factors) / 2

    def __call__(self, plm: Array) -> Array:
        """Return the product for coefficients, shape (..., L^2), complex128."""
        from spinsdw.compiled.fit_updates import split_degrees

        found = np.empty_like(plm)
        stacks = [one.reshape(-1, plm.shape[-1]) for one in (plm, found)]
        bandlimit = self.e_factors.size
        # Equal numbers of coefficients for each thread.
        ends = np.sqrt(np.arange(1, self.threads + 1) / self.threads) * bandlimit
        shares = pairwise([0, *np.rint(ends).astype(int)])
        what = (*self._factors, *stacks)
        tasks = [functools.partial(split_degrees, *one, *what) for one in shares]
        run_tasks(tasks, self.threads)
        return found


@dataclass(frozen=True, eq=False)
class Stacks:
    """Sums and updates of rows.

    Parameters
    ----------
    threads : int
        Threads to use.
    """

    threads: int

    def _ranges(self, size: int) -> list[tuple[int, int]]:
        return [(first, min(first + _RANGE, size)) for first in range(0, size, _RANGE)]

    def _share(self, call: Callable[..., None], size: int, *what: Array) -> None:
        ranges = self._ranges(size)
        run_tasks([functools.partial(call, *one, *what) for one in ranges], self.threads)

    def _sum(self, call: Callable[..., None], left: Array, right: Array) -> Array:
        ranges = self._ranges(right.shape[1])
        sums = np.empty((len(ranges), len(right)))
        tasks = [
            functools.partial(call, *one, left, right, part)
            for one, part in zip(ranges, sums, strict=True)
        ]
        run_tasks(tasks, self.threads)
        return np.asarray(sums.sum(axis=0))

    def product(self, left: Array, right: Array) -> Array:
        """Re <left, right> of each row: the inner product of the real degrees of freedom."""
        from spinsdw.compiled.fit_updates import sum_products

        return self._sum(sum_products, left, right)

    def weighted_power(self, weights: Array, values: Array) -> Array:
        """Return the sums of weights |values|^2 of each row."""
        from spinsdw.compiled.fit_updates import sum_weighted

        return self._sum(sum_weighted, weights, values)

    def subtract(self, factors: Array, weights: Array, values: Array, out: Array) -> None:
        """Subtract factors times weights times values."""
        from spinsdw.compiled.fit_updates import subtract_weighted

        self._share(subtract_weighted, out.shape[1], factors, weights, values, out)

    def add(self, scales: Array, factors: Array, values: Array, out: Array) -> None:
        """Put scales times ``out`` plus factors times values in ``out``."""
        from spinsdw.compiled.fit_updates import add_multiples

        self._share(add_multiples, out.shape[1], scales, factors, values, out)
