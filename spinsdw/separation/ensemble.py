"""Skies drawn from a prior, and what an estimator makes of them: the variances of a survey.

The wavelet coefficients of one scale are sorted by the share of their wavelet's energy that falls
where the sky is not observed. Coefficients of one share are as good as draws of one ensemble, so
that a few skies tell the variances of every position and orientation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.harmonics import eb_to_spin
from spinsdw.sampling import Sampling
from spinsdw.separation.least_squares import EBPrior
from spinsdw.separation.survey import Survey
from spinsdw.simulation import gaussian_flm

__all__ = ["ShareBins", "draw_fields", "draw_white", "position_areas"]

Array = np.ndarray[Any, Any]

# Where the share changes what a coefficient is worth fastest, the bins are finest.
_EDGES = np.array([0.0, 0.01, 0.03, 0.07, 0.15, 0.3, 0.5, 0.7, 0.9, 1.0])
# A bin holds at least so many independent coefficients, or joins its neighbour.
_LEAST_COUNT = 24.0


def draw_fields(prior: EBPrior, count: int, seed: int) -> tuple[Array, Array]:
    """Return coefficients p_lm of E alone and of B alone, shape (count, L^2) each."""
    size = prior.bandlimit
    draws = [
        np.array([gaussian_flm(spectrum, size, seed=[seed, kind, i]) for i in range(count)])
        for kind, spectrum in enumerate((prior.e_spectrum, prior.b_spectrum))
    ]
    none = np.zeros_like(draws[0])
    return eb_to_spin(draws[0], none), eb_to_spin(none, draws[1])


def draw_white(survey: Survey, count: int, seed: int) -> Array:
    """Return coefficients p_lm of white noise in Q and U, shape (count, L^2)."""
    flat = np.ones(survey.bandlimit)
    flat[:2] = 0.0
    return sum(draw_fields(EBPrior(flat, flat), count, seed + 1), start=np.zeros(()))


@dataclass(frozen=True, eq=False)
class ShareBins:
    """The coefficients of one scale, sorted by share.

    Parameters
    ----------
    share : ndarray, shape of one scale's coefficients, float64
        Share of each wavelet's energy in the holes.
    areas : ndarray, broadcast to that shape
        Solid angle of each coefficient's position, in any unit.
    modes : float
        How many independent coefficients the whole sphere holds.
    """

    share: Array
    areas: Array
    modes: float

    def __iter__(self) -> Iterator[Array]:
        """Give a boolean array for each bin; together they hold all coefficients."""
        for start, stop in self._ranges():
            inside = self.share >= _EDGES[start]
            if stop < _EDGES.size - 1:
                inside &= self.share < _EDGES[stop]
            yield inside

    def _ranges(self) -> list[tuple[int, int]]:
        """Join neighbouring intervals until each holds enough coefficients."""
        areas = np.broadcast_to(self.areas, self.share.shape)
        counts, _ = np.histogram(self.share, _EDGES, weights=areas)
        counts *= self.modes / areas.sum()
        ranges, start = [], 0
        for stop in range(1, _EDGES.size):
            if counts[start:stop].sum() >= _LEAST_COUNT:
                ranges.append((start, stop))
                start = stop
        last = _EDGES.size - 1
        if not ranges:
            return [(0, last)]
        # What is left over joins its neighbour.
        ranges[-1] = ranges[-1][0], last
        return ranges

    def areas_of(self, inside: Array) -> Array:
        """Return the areas of the coefficients of a bin."""
        return np.asarray(np.broadcast_to(self.areas, self.share.shape)[inside])

    def mean(self, values: Array, inside: Array) -> float:
        """Return the mean over a bin of a stack of values, weighted by area."""
        areas = self.areas_of(inside)
        return float((values[:, inside] @ areas).sum() / (areas.sum() * len(values)))


def position_areas(grid: Sampling) -> Array:
    """Return the relative area of each ring's points, shape (rings, 1)."""
    # At a pole all points are one, with the area of a cap of half a step.
    return np.maximum(np.sin(grid.colatitudes), np.pi / (8 * grid.n_rings))[:, None]
