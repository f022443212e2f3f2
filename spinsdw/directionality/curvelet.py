"""The directionality of second-generation curvelets, after Chan et al. (2015)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinsdw.directionality.base import ComplexArray, Directionality
from spinsdw.directionality.orientations import Orientations
from spinsdw.directionality.steerable import binomial_roots
from spinsdw.errors import ParameterError
from spinsdw.harmonics import check_bandlimit

__all__ = ["CurveletDirectionality"]


@dataclass(frozen=True)
class CurveletDirectionality(Directionality):
    """The orders |n| = l and no other: curvelets, as wide as the square of their length.

    Order n occurs at degree |n| alone, so a scale of bandlimit L_j has orders of both parities up
    to L_j - 1 and 2 L_j - 1 orientations around the full circle (eq-curvelet). Coefficients of
    all scales take some 4 L**3 numbers: curvelets are for bandlimits of a few hundred.

    Such a curvelet lies on the equator, at longitude pi, and along the meridian there: the Euler
    angles (alpha, beta) are not its place but the pole of a great circle that it crosses, and
    gamma says where. ``centred`` turns it to the north pole first, so that they are its place and
    gamma its orientation (eq-curvelet-centred). The orders are then the even ones, and half as
    many orientations hold the same.

    Parameters
    ----------
    centred : bool
        Whether a curvelet that is not rotated lies at the north pole, along the x axis.

    Raises
    ------
    ParameterError
        If ``centred`` is not a bool.

    References
    ----------
    J. Y. H. Chan, B. Leistedt, T. D. Kitching, J. D. McEwen, "Second-generation curvelets on the
    sphere", IEEE Trans. Signal Process. 65, 5 (2017), arXiv:1511.05578.

    Examples
    --------
    >>> zeta = CurveletDirectionality().coefficients(3)
    >>> (np.abs(zeta[:, 2]) ** 2).round(12).tolist()
    [0.5, 0.0, 0.0, 0.0, 0.5]
    >>> CurveletDirectionality(centred=True).orientations_at(6).orders
    (-4, -2, 0, 2, 4)
    """

    centred: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.centred, bool | np.bool_):
            msg = f"centred={self.centred!r} must be True or False."
            raise ParameterError(msg)
        object.__setattr__(self, "centred", bool(self.centred))

    def orientations_at(self, bandlimit: int) -> Orientations:
        """Return the orders and orientations of a scale, which grow with its bandlimit.

        Parameters
        ----------
        bandlimit : int
            L_j.

        Returns
        -------
        Orientations
            2 L_j - 1 of them; if ``centred`` the largest odd number that is at most L_j.

        Raises
        ------
        ParameterError
            If ``bandlimit`` is not an integer of at least 1.

        Examples
        --------
        >>> CurveletDirectionality().orientations_at(16).count
        31
        """
        bandlimit = check_bandlimit(bandlimit)
        if self.centred:
            return Orientations(2 * ((bandlimit - 1) // 2) + 1)
        return Orientations(2 * bandlimit - 1, step=1)

    def coefficients(self, bandlimit: int, spin: int = 0) -> ComplexArray:  # noqa: ARG002 - as every directionality
        """Return zeta_ln for every degree below a bandlimit (eq-curvelet, eq-curvelet-centred).

        Parameters
        ----------
        bandlimit : int
        spin : int
            Makes no difference.

        Returns
        -------
        ndarray, shape (count, bandlimit), complex128
            Row as in the orders of `orientations_at`, column is the degree. The squares of a
            column add up to 1, but for degree 0, which is zero.

        Raises
        ------
        ParameterError
            If ``bandlimit`` is not an integer of at least 1.

        Examples
        --------
        >>> zeta = CurveletDirectionality(centred=True).coefficients(5)
        >>> (np.abs(zeta[:, 2]) ** 2).round(12).tolist()
        [0.0, 0.125, 0.75, 0.125, 0.0]
        """
        orientations = self.orientations_at(bandlimit)
        middle = orientations.count // 2
        zeta = np.zeros((orientations.count, bandlimit), dtype=np.complex128)
        for el in range(1, bandlimit):
            if self.centred:
                # sqrt(2) d^l_nl(pi / 2) at even n.
                roots = np.sqrt(2) * binomial_roots(2 * el)[el % 2 :: 2]
                zeta[middle - el // 2 : middle + el // 2 + 1, el] = roots
            else:
                zeta[middle + el, el] = np.sqrt(0.5)
                zeta[middle - el, el] = np.sqrt(0.5) * (-1) ** el
        return zeta
