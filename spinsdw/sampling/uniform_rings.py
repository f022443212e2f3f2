"""Equally spaced rings with the weights of Fejer and of Clenshaw and Curtis.

Both rules integrate the polynomial in cos(theta) that interpolates the samples (Waldvogel 2006, BIT
46, 195), by int_0^pi cos(k theta) sin(theta) d theta = 2 / (1 - k^2) for even k and 0 for odd.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.sampling.weighted import WeightedRings

__all__ = ["ClenshawCurtis", "DriscollHealy", "Fejer1"]

Array = np.ndarray[Any, Any]


def _moments(size: int) -> Array:
    """int_0^pi cos(k theta) sin(theta) d theta for k < size."""
    k = np.arange(size, dtype=float)
    even = k % 2 == 0
    return np.where(even, 2 / (1 - np.where(even, k, 0.0) ** 2), 0.0)


@functools.lru_cache(maxsize=64)
def _fejer_weights(size: int) -> Array:
    """Weights of the rings (2 t + 1) pi / (2 size), exact to degree size - 1 in cos(theta)."""
    from scipy.fft import dct

    return np.asarray(dct(_moments(size), type=3) / size)


@functools.lru_cache(maxsize=64)
def _clenshaw_curtis_weights(size: int) -> Array:
    """Weights of the rings pi t / (size - 1), exact to degree size - 1 in cos(theta)."""
    from scipy.fft import dct

    weights = dct(_moments(size), type=1) / (size - 1)
    weights[[0, -1]] *= 0.5
    return np.asarray(weights)


@dataclass(frozen=True)
class _FejerRings(WeightedRings):
    """Rings at odd multiples of half a step: no pole is a ring."""

    @property
    def colatitudes(self) -> Array:
        """Colatitude of each ring in radians; float64, shape (n_rings,)."""
        return (2 * np.arange(self.n_rings) + 1) * np.pi / (2 * self.n_rings)

    @property
    def rule(self) -> Array:
        """What multiplies each ring in the integral over cos(theta); float64, shape (n_rings,)."""
        return _fejer_weights(self.n_rings)


@dataclass(frozen=True)
class DriscollHealy(_FejerRings):
    """Driscoll-Healy sampling: theta_t = (2 t + 1) pi / 4 L, t < 2 L; 2 L - 1 points a ring.

    The rings of the ssht package. Its weights (Driscoll & Healy 1994, Adv. Appl. Math. 15, 202) are
    those of Fejer's rule, the only ones that are exact to degree 2 L - 1 on these rings.

    Parameters
    ----------
    bandlimit : int
        Signals have degrees l < bandlimit.

    Examples
    --------
    >>> DriscollHealy(3).shape
    (6, 5)
    """

    name: ClassVar[str] = "dh"

    @property
    def n_rings(self) -> int:
        """Number of rings, 2 L."""
        return 2 * self.bandlimit


@dataclass(frozen=True)
class Fejer1(_FejerRings):
    """Fejer's first rule: theta_t = (2 t + 1) pi / (4 L - 2), t < 2 L - 1; 2 L - 1 points a ring.

    One ring fewer than Driscoll-Healy: the fewest of this kind for which a weighted sum is exact.

    Parameters
    ----------
    bandlimit : int
        Signals have degrees l < bandlimit.

    Examples
    --------
    >>> Fejer1(3).shape
    (5, 5)
    """

    name: ClassVar[str] = "fejer1"

    @property
    def n_rings(self) -> int:
        """Number of rings, 2 L - 1."""
        return 2 * self.bandlimit - 1


@dataclass(frozen=True)
class ClenshawCurtis(WeightedRings):
    """Clenshaw-Curtis sampling: theta_t = pi t / (2 L - 2), t < 2 L - 1; 2 L - 1 points a ring.

    Both poles are rings; L = 1 has these two alone. `MWSS` has half the rings, by a quadrature that
    is more than a weighted sum.

    Parameters
    ----------
    bandlimit : int
        Signals have degrees l < bandlimit.

    Examples
    --------
    >>> ClenshawCurtis(3).shape
    (5, 5)
    """

    name: ClassVar[str] = "cc"

    @property
    def n_rings(self) -> int:
        """Number of rings, 2 L - 1, and no fewer than 2."""
        return max(2 * self.bandlimit - 1, 2)

    @property
    def colatitudes(self) -> Array:
        """Colatitude of each ring in radians; float64, shape (n_rings,)."""
        return np.pi * np.arange(self.n_rings) / (self.n_rings - 1)

    @property
    def rule(self) -> Array:
        """What multiplies each ring in the integral over cos(theta); float64, shape (n_rings,)."""
        return _clenshaw_curtis_weights(self.n_rings)
