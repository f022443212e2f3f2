"""`Sampling`: a grid of rings with an exact sampling theorem, and the names it goes by."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.errors import ParameterError

__all__ = ["Sampling", "check_bandlimit", "resolve_sampling"]

Array = np.ndarray[Any, Any]


def check_bandlimit(bandlimit: object) -> int:
    """Return the bandlimit as an int, or raise `ParameterError`."""
    if isinstance(bandlimit, bool) or not isinstance(bandlimit, int | np.integer) or bandlimit < 1:
        msg = f"bandlimit={bandlimit!r} must be a positive integer; degrees are l < bandlimit."
        raise ParameterError(msg)
    return int(bandlimit)


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
    def weigh_columns(self, columns: Array, orders: tuple[int, ...], *, threads: int) -> None:
        """Apply the exact quadrature in theta to Fourier columns, in place.

        columns : complex128, shape (orders, n_m, n_rings): F_m(theta_t) of each order n times P,
        the number of points of a ring. Afterwards sum_t d^l_mn(theta_t) columns[t] is the integral
        of F d^l_mn over the sphere. The operator is real and symmetric.
        """

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a map: (rings, points on a ring)."""
        return (self.n_rings, self.n_phi)

    @property
    def longitudes(self) -> Array:
        """Longitude phi of each point of a ring in radians; float64, shape (n_phi,)."""
        return 2 * np.pi * np.arange(self.n_phi) / self.n_phi


def resolve_sampling(sampling: str | Sampling, bandlimit: int) -> Sampling:
    """Return the sampling object meant by a name or by an object of the same bandlimit.

    Examples
    --------
    >>> resolve_sampling("mwss", 8).shape
    (9, 16)
    """
    from spinsdw.sampling.equiangular import MW, MWSS

    known: dict[str, type[Sampling]] = {"mw": MW, "mwss": MWSS}
    if isinstance(sampling, Sampling):
        if sampling.bandlimit != bandlimit:
            msg = (
                f"sampling has bandlimit {sampling.bandlimit} but the transform has "
                f"{bandlimit}; make the sampling with the transform's bandlimit."
            )
            raise ParameterError(msg)
        return sampling
    if not isinstance(sampling, str) or sampling.lower() not in known:
        names = ", ".join(repr(name) for name in known)
        msg = f"sampling={sampling!r} is not known; use one of {names} or a Sampling object."
        raise ParameterError(msg)
    return known[sampling.lower()](bandlimit)
