"""The rings of a HEALPix map: colatitudes, points and first longitude of each.

Gorski et al. 2005, ApJ 622, 759, equations 4 to 9. No sampling theorem: analysis is a fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.harmonics import check_integer

__all__ = ["HealpixRings"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class HealpixRings:
    """The ring layout of resolution ``nside``, north to south.

    Parameters
    ----------
    nside : int
        Any positive integer; only powers of two have a nested order.

    Raises
    ------
    ParameterError
        If ``nside`` is not an integer of at least 1.

    Examples
    --------
    >>> rings = HealpixRings(2)
    >>> rings.n_phi.tolist()
    [4, 8, 8, 8, 8, 8, 4]
    >>> int(rings.n_phi.sum()) == rings.n_pixels
    True
    """

    nside: int

    def __post_init__(self) -> None:
        remedy = "a map has 12 nside**2 pixels"
        nside = check_integer(self.nside, "nside", minimum=1, remedy=remedy)
        object.__setattr__(self, "nside", nside)

    @property
    def n_pixels(self) -> int:
        """Number of pixels of a map, 12 nside^2."""
        return 12 * self.nside**2

    @property
    def n_rings(self) -> int:
        """Number of rings, 4 nside - 1."""
        return 4 * self.nside - 1

    @property
    def _index(self) -> Array:
        """Ring number counted from the nearer pole, from 1."""
        i = np.arange(1, self.n_rings + 1)
        return np.minimum(i, 4 * self.nside - i)

    @property
    def colatitudes(self) -> Array:
        """Colatitude of each ring in radians; float64, shape (n_rings,)."""
        index, nside = self._index.astype(float), self.nside
        # Near the pole 1 - cos(theta) = i^2 / (3 nside^2) is exact, cos(theta) is not.
        cap = 2 * np.arcsin(np.minimum(index / (np.sqrt(6.0) * nside), 1.0))
        belt = np.arccos(np.clip((4.0 * nside - 2.0 * index) / (3.0 * nside), -1, 1))
        north = np.where(self._index < nside, cap, belt)
        half = 2 * nside - 1
        return np.concatenate([north[:half], [np.pi / 2], np.pi - north[:half][::-1]])

    @property
    def n_phi(self) -> Array:
        """Number of pixels of each ring; int64, shape (n_rings,)."""
        return 4 * np.minimum(self._index, self.nside).astype(np.int64)

    @property
    def first_longitudes(self) -> Array:
        """Longitude of the first pixel of each ring in radians; float64, shape (n_rings,)."""
        shifted = (self._index < self.nside) | ((self._index - self.nside) % 2 == 0)
        return np.where(shifted, np.pi / self.n_phi, 0.0)

    @property
    def starts(self) -> Array:
        """Index of the first pixel of each ring; int64, shape (n_rings,)."""
        return np.concatenate([[0], np.cumsum(self.n_phi)[:-1]])
