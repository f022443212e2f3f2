"""`Sampling`: a grid of rings with an exact sampling theorem."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.harmonics import check_bandlimit

__all__ = ["Sampling"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Sampling(abc.ABC):
    """Rings of equally spaced points on which band-limited signals are known exactly.

    Parameters
    ----------
    bandlimit : int
        Signals have degrees l < bandlimit.

    Examples
    --------
    >>> from spinsdw.sampling import MW
    >>> MW(4).shape
    (4, 7)
    """

    bandlimit: int
    name: ClassVar[str]

    def __post_init__(self) -> None:
        object.__setattr__(self, "bandlimit", check_bandlimit(self.bandlimit))

    @property
    @abc.abstractmethod
    def n_rings(self) -> int:
        """Number of rings."""

    @property
    @abc.abstractmethod
    def n_phi(self) -> int:
        """Number of points on each ring."""

    @property
    @abc.abstractmethod
    def colatitudes(self) -> Array:
        """Colatitude theta of each ring in radians; float64, shape (n_rings,)."""

    @abc.abstractmethod
    def weigh_columns(
        self, columns: Array, orders: tuple[int, ...], *, mixing: Array, threads: int
    ) -> None:
        """Mix Fourier columns into orders and apply the exact quadrature in theta, in place.

        columns : complex128, shape (at least orders, n_m, n_rings): F_m(theta_t) times P, the
        number of points of a ring; mixing : complex128, shape (orders, rows of columns). Row i
        becomes that of order n_i, and sum_t d^l_{m, n_i}(theta_t) columns[i, m, t] the integral of
        F d^l_mn over the sphere. Without mixing the operator is real and symmetric.
        """

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a map: (rings, points on a ring)."""
        return (self.n_rings, self.n_phi)

    @property
    def longitudes(self) -> Array:
        """Longitude phi of each point of a ring in radians; float64, shape (n_phi,)."""
        return 2 * np.pi * np.arange(self.n_phi) / self.n_phi
