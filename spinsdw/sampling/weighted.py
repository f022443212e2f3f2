"""`WeightedRings`: samplings whose analysis is a weighted sum over their points.

The product d^l_mn d^l'_mn is a polynomial of degree l + l' in cos(theta). A rule over rings that is
exact to degree 2 L - 2 therefore makes the adjoint of the synthesis, each ring times its weight,
the inverse of it.
"""

from __future__ import annotations

import abc
import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.parallel import run_tasks
from spinsdw.sampling.base import Sampling

__all__ = ["WeightedRings"]

Array = np.ndarray[Any, Any]

# Orders m that one task weighs.
_M_STEP = 32


@dataclass(frozen=True)
class WeightedRings(Sampling):
    """Any rings of 2 L - 1 points each with a rule for them; the base of samplings of one's own.

    A subclass is a frozen dataclass that gives `n_rings`, `colatitudes`, `rule`, a ``name``, and
    ``is_symmetric = False`` where its rings do not mirror each other. Its analysis inverts its
    synthesis where the rule is exact for polynomials in cos(theta) up to degree 2 L - 2.

    Parameters
    ----------
    bandlimit : int
        Signals have degrees l < bandlimit.

    Examples
    --------
    The midpoints of rings of equal height hold a constant and nothing else.

    >>> class Midpoints(WeightedRings):
    ...     name, n_rings = "midpoints", 4
    ...     colatitudes = np.arccos([0.75, 0.25, -0.25, -0.75])
    ...     rule = np.full(4, 0.5)
    >>> float(Midpoints(1).integrate(np.ones((4, 1))).round(12)) == round(4 * np.pi, 12)
    True
    """

    is_symmetric: ClassVar[bool] = True

    @property
    def n_phi(self) -> int:
        """Number of points on each ring, 2 L - 1."""
        return 2 * self.bandlimit - 1

    @property
    def integral_bandlimit(self) -> int:
        """2 L - 1, which holds the product of two fields of bandlimit L."""
        return 2 * self.bandlimit - 1

    @property
    @abc.abstractmethod
    def rule(self) -> Array:
        """What multiplies each ring in the integral over cos(theta); float64, shape (n_rings,)."""

    @functools.cached_property
    def weights(self) -> Array:
        """Weight of each point of a ring; float64, shape (n_rings,)."""
        weights = self.rule * (2 * np.pi / self.n_phi)
        weights.flags.writeable = False
        return weights

    def _weigh_batch(self, columns: Array, mixing: Array, first: int, stop: int) -> None:
        from spinsdw.compiled.columns import mix_columns

        if not np.array_equal(mixing, np.eye(*mixing.shape)):
            mix_columns(mixing, first, stop, columns)
        columns[: mixing.shape[0], first:stop] *= self.weights

    def weigh_columns(
        self,
        columns: Array,
        orders: tuple[int, ...],  # noqa: ARG002 - the weights are the same for all
        *,
        mixing: Array,
        threads: int,
    ) -> None:
        """Mix Fourier columns into orders and weigh their rings, in place; see `Sampling`."""
        n_m = columns.shape[1]
        tasks = [
            functools.partial(self._weigh_batch, columns, mixing, m, min(m + _M_STEP, n_m))
            for m in range(0, n_m, _M_STEP)
        ]
        run_tasks(tasks, threads)
