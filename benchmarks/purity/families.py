"""Results of one method behind one mask, whose free choices may be several: the best of them."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from benchmarks.purity.measures import Result

__all__ = ["Family", "families"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Family:
    """The results of one label, on the same skies.

    A method with one choice is read as it is; of several, such as NaMaster's apodisations, each
    band takes the best for itself, and each point of a curve as well.
    """

    results: tuple[Result, ...]

    @property
    def label(self) -> str:
        """Name of the method."""
        return self.results[0].method

    @property
    def scales(self) -> tuple[int, ...]:
        """The scales j."""
        return self.results[0].scales

    @property
    def seconds(self) -> float:
        """Wall time of one map, of the fastest."""
        return min(result.seconds / result.separations for result in self.results)

    def f_ret(self, limit: float) -> Array:
        """Return the most sky kept below a leakage, shape (scales,)."""
        return np.max([result.f_ret(limit) for result in self.results], axis=0)

    def at(self, measure: str, distance: float) -> Array:
        """Return a measure at a distance for the choice that keeps most sky, shape (scales,)."""
        values = np.array([result.at(measure, distance) for result in self.results])
        return values[self._chosen, np.arange(len(self.scales))]

    @functools.cached_property
    def _chosen(self) -> Array:
        """For each scale the choice with the most sky below 1e-4, or else the least leakage."""
        kept = np.array([result.f_ret(1e-4) for result in self.results])
        leak = np.array([result.at("r_leak", 1) for result in self.results])
        leak = np.where(np.isfinite(leak), leak, np.inf)
        return np.where(kept.max(axis=0) > 0, kept.argmax(axis=0), leak.argmin(axis=0))

    def frontier(self, scale: int) -> tuple[Array, Array]:
        """Return the points (f_eff, r_leak) of one scale that no other beats, sky falling."""
        row = self.scales.index(scale)
        sky = np.concatenate([result.f_eff[row] for result in self.results])
        leak = np.concatenate([result.r_leak[row] for result in self.results])
        seen = (sky > 0) & np.isfinite(leak)
        order = np.argsort(-sky[seen], kind="stable")
        sky, leak = sky[seen][order], leak[seen][order]
        if leak.size == 0:
            return sky, leak
        best = leak <= np.minimum.accumulate(leak)
        return sky[best], leak[best]


def families(results: Iterable[Result], survey: str, model: str = "cmb") -> list[Family]:
    """Group the results behind one mask by their label, in the order of `ORDER`."""
    groups: dict[str, list[Result]] = {}
    for result in results:
        if (result.survey, result.model) == (survey, model):
            groups.setdefault(result.method, []).append(result)
    names = sorted(groups, key=lambda name: (_place(name), name))
    return [Family(tuple(groups[name])) for name in names]


ORDER = (
    "masked",
    "needlets",
    "pseudo",
    "NaMaster",
    "harmonic-pure",
    "pure",
    "recycling",
    "projection",
    "hybrid",
    "wiener",
)


def _place(name: str) -> int:
    start = name.split(",", maxsplit=1)[0]
    return ORDER.index(start) if start in ORDER else len(ORDER)
