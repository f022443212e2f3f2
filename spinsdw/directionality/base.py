"""What every directionality offers."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from spinsdw.directionality.orientations import Orientations

__all__ = ["ComplexArray", "Directionality"]

ComplexArray = NDArray[np.complex128]


class Directionality(ABC):
    """The azimuthal part zeta_ln of a wavelet, for every degree l and order n.

    At each degree that it holds the squares of zeta and of its `dual` pair up to 1:
    ``sum_n zeta_ln conj(dual_ln) = 1``. A subclass is a frozen dataclass that says
    `orientations_at` and `coefficients`, whose ``zeta_{l,-n} = (-1)**n conj(zeta_ln)`` at spin 0
    makes the wavelets real functions.
    """

    @abstractmethod
    def orientations_at(self, bandlimit: int) -> Orientations:
        """Return the orders and orientations of a wavelet of degrees below a bandlimit.

        Parameters
        ----------
        bandlimit : int

        Returns
        -------
        Orientations

        Raises
        ------
        ParameterError
            If ``bandlimit`` is not an integer of at least 1.
        """

    @abstractmethod
    def coefficients(self, bandlimit: int, spin: int = 0) -> ComplexArray:
        """Return zeta_ln for every degree below a bandlimit.

        Parameters
        ----------
        bandlimit : int
        spin : int
            The spin of the wavelet.

        Returns
        -------
        ndarray, shape (count, bandlimit), complex128
            Row as in the orders of `orientations_at`, column is the degree. Degree 0 is zero: it
            belongs to the scaling function. Zero for |n| > l.

        Raises
        ------
        ParameterError
            If ``bandlimit`` is not an integer of at least 1.
        """

    @property
    def dual(self) -> Directionality:
        """The directionality that synthesises what this one analyses: mostly itself."""
        return self

    def held_degrees(self, bandlimit: int, spin: int = 0) -> NDArray[np.bool_]:
        """Tell for each degree below a bandlimit whether the wavelets hold it.

        Parameters
        ----------
        bandlimit : int
        spin : int

        Returns
        -------
        ndarray, shape (bandlimit,), bool

        Examples
        --------
        >>> from spinsdw.directionality import RidgeletDirectionality
        >>> RidgeletDirectionality().held_degrees(6).tolist()
        [False, False, True, False, True, False]
        """
        return np.asarray(np.any(self.coefficients(bandlimit, spin) != 0, axis=0))
