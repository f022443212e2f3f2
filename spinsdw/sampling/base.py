"""`Sampling`: a grid of rings with an exact sampling theorem."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.errors import ShapeError
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
    # Whether ring t and ring n_rings - 1 - t mirror each other: then sums over degree are shared.
    is_symmetric: ClassVar[bool] = False

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

    @property
    @abc.abstractmethod
    def weights(self) -> Array:
        """Weight of each point of a ring, so that sum_tp weights[t] f[t, p] is the integral of f.

        float64, shape (n_rings,); exact for scalars of bandlimit up to `integral_bandlimit`.
        """

    @property
    @abc.abstractmethod
    def integral_bandlimit(self) -> int:
        """The largest bandlimit of a scalar whose weighted sum is its integral.

        The product of a field and a conjugate field of the same spin, of bandlimits A and B, has
        A + B - 1. Analysis, which is more than a weighted sum, is exact up to `bandlimit`.
        """

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

    @property
    def points(self) -> tuple[Array, Array]:
        """Colatitude and longitude of every point in radians; float64, each of shape `shape`."""
        theta, phi = np.meshgrid(self.colatitudes, self.longitudes, indexing="ij")
        return theta, phi

    def integrate(self, maps: Array) -> Array:
        """Integrate scalar maps over the sphere: the weighted sum of their values.

        Parameters
        ----------
        maps : ndarray, shape (..., rings, phi)
            Maps on this grid, of bandlimit up to `integral_bandlimit`; leading axes are a batch.

        Returns
        -------
        ndarray, shape (...)
            The integrals; 4 pi for a map of ones.

        Raises
        ------
        ShapeError
            If the last two axes are not the grid's.
        """
        values = np.asarray(maps)
        if values.shape[-2:] != self.shape:
            msg = (
                f"maps has shape {values.shape}; its last two axes must be {self.shape} on this "
                f"grid, {self!r}."
            )
            raise ShapeError(msg)
        return np.einsum("...tp,t->...", values, self.weights)
