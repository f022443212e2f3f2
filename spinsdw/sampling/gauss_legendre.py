"""The Gauss-Legendre sampling: the fewest rings for which a weighted sum is exact."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.sampling.weighted import WeightedRings

__all__ = ["GaussLegendre"]

Array = np.ndarray[Any, Any]

# Newton's steps double the digits; the first guess has two or more.
_STEPS = 5


def _legendre(degree: int, theta: Array) -> tuple[Array, Array]:
    """Return P_n and P_n - P_{n-1} at cos(theta), theta <= pi / 2.

    By differences, (k+1) (P_{k+1} - P_k) = (2k+1) (x - 1) P_k + k (P_k - P_{k-1}): near the pole x
    is 1 minus something small, which the plain recursion would lose.
    """
    shifted = -2 * np.sin(theta / 2) ** 2
    value, difference = np.ones_like(theta), np.zeros_like(theta)
    for k in range(degree):
        difference = ((2 * k + 1) * shifted * value + k * difference) / (k + 1)
        value = value + difference
    return value, difference


@functools.lru_cache(maxsize=64)
def _nodes(size: int) -> tuple[Array, Array]:
    """Return the colatitudes of the zeros of P_size, increasing, and the weights of the rule."""
    half = size // 2
    phase = (4 * np.arange(half) + 3) * np.pi / (4 * size + 2)
    # Tricomi's approximation of the zeros.
    theta = phase + (1 - 1 / size) / (8 * size**2 * np.tan(phase))
    for _ in range(_STEPS):
        value, difference = _legendre(size, theta)
        slope = size * (difference - 2 * np.sin(theta / 2) ** 2 * value) / np.sin(theta)
        theta = theta - value / slope
    north = np.concatenate([theta, np.full(size % 2, np.pi / 2)])
    value, difference = _legendre(size, north)
    weights = 2 * (np.sin(north) / (size * (difference - 2 * np.sin(north / 2) ** 2 * value))) ** 2
    colatitudes = np.concatenate([north, np.pi - theta[::-1]])
    weights = np.concatenate([weights, weights[:half][::-1]])
    for values in (colatitudes, weights):
        values.flags.writeable = False
    return colatitudes, weights


@dataclass(frozen=True)
class GaussLegendre(WeightedRings):
    """Gauss-Legendre sampling: cos(theta_t) the zeros of P_L, t < L; 2 L - 1 points a ring.

    Parameters
    ----------
    bandlimit : int
        Signals have degrees l < bandlimit.

    Examples
    --------
    >>> GaussLegendre(3).shape
    (3, 5)
    >>> bool(abs(GaussLegendre(2).colatitudes[0] - np.arccos(3**-0.5)) < 1e-15)
    True
    """

    name: ClassVar[str] = "gl"

    @property
    def n_rings(self) -> int:
        """Number of rings, L."""
        return self.bandlimit

    @property
    def colatitudes(self) -> Array:
        """Colatitude of each ring in radians, north to south; float64, shape (n_rings,)."""
        return _nodes(self.bandlimit)[0]

    @property
    def rule(self) -> Array:
        """What multiplies each ring in the integral over cos(theta); float64, shape (n_rings,)."""
        return _nodes(self.bandlimit)[1]
