"""Time several callables against each other on a machine whose speed drifts.

They are called in turn, round after round, in one process, so that a slow minute hits all of them,
and the best of each counts: noise only ever adds time.
"""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

__all__ = ["Timings", "best_of", "elapsed"]


@dataclass(frozen=True)
class Timings:
    """Seconds of every call of every callable, by name.

    Parameters
    ----------
    seconds : mapping of str to tuple of float
        One entry a round.
    """

    seconds: Mapping[str, tuple[float, ...]]

    @property
    def best(self) -> dict[str, float]:
        """Shortest time of each."""
        return {name: min(values) for name, values in self.seconds.items()}

    @property
    def median(self) -> dict[str, float]:
        """Median time of each: far above the best on a busy machine."""
        return {name: statistics.median(values) for name, values in self.seconds.items()}

    @property
    def rounds(self) -> int:
        """How often each was called."""
        return min(len(values) for values in self.seconds.values())

    def ratio(self, one: str, other: str) -> float:
        """Return how many times as long ``one`` takes as ``other``."""
        return self.best[one] / self.best[other]


def elapsed(call: Callable[[], object]) -> float:
    """Return the seconds of one call; what it returns is freed after the clock has stopped."""
    gc.collect()
    gc.disable()
    try:
        start = time.perf_counter()
        result = call()
        seconds = time.perf_counter() - start
        del result
    finally:
        gc.enable()
    return seconds


def best_of(
    calls: Mapping[str, Callable[[], object]],
    *,
    fewest: int = 4,
    most: int = 64,
    budget: float = 5.0,
) -> Timings:
    """Call each in turn, ``fewest`` times, and on until ``budget`` seconds or ``most`` rounds.

    Every other round runs in the opposite order: nobody always finds the cache warm.
    """
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    start = time.perf_counter()
    for i in range(most):
        if i >= fewest and time.perf_counter() - start > budget:
            break
        for name in list(calls)[:: -1 if i % 2 else 1]:
            seconds[name].append(elapsed(calls[name]))
    return Timings({name: tuple(values) for name, values in seconds.items()})
