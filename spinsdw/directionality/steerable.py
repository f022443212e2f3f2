"""The directionality that steers with the fewest orders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.directionality.base import ComplexArray, Directionality
from spinsdw.directionality.orientations import Orientations
from spinsdw.harmonics import check_bandlimit, check_integer

__all__ = ["SteerableDirectionality", "binomial_roots"]

FloatArray = NDArray[np.float64]


def binomial_roots(count: int) -> FloatArray:
    """Return sqrt(binom(count, k) / 2**count) for k = 0..count, as a unit vector.

    Parameters
    ----------
    count : int
        Not negative.

    Returns
    -------
    ndarray, shape (count + 1,), float64

    Examples
    --------
    >>> (binomial_roots(2) ** 2).round(12).tolist()
    [0.25, 0.5, 0.25]
    """
    k = np.arange((count + 1) // 2, count)
    # Outwards from the largest term: an underflow is then a true zero, and no factorial or
    # logarithm costs digits.
    outward = np.concatenate([[1.0], np.cumprod((count - k) / (k + 1.0))])
    inward = outward[::-1] if count % 2 else outward[:0:-1]
    terms = np.concatenate([inward, outward])
    roots: FloatArray = np.sqrt(terms / np.sum(terms))
    return roots


@dataclass(frozen=True)
class SteerableDirectionality(Directionality):
    """The directionality that steers exactly with ``directions`` orientations (eq-directionality).

    The wavelets hold the azimuthal orders n = -(N-1), -(N-3), ..., N-1 and no other, so their
    coefficients at N orientations between 0 and pi give those at any other.

    Parameters
    ----------
    directions : int
        N, at least 1. 1 makes axisymmetric wavelets; the larger, the narrower in angle. It may
        exceed the bandlimit of a small scale.

    Raises
    ------
    ParameterError
        If ``directions`` is not an integer of at least 1.

    Examples
    --------
    >>> directionality = SteerableDirectionality(3)
    >>> directionality.orders
    (-2, 0, 2)
    >>> (directionality.coefficients(4)[:, 3].real ** 2).round(12).tolist()
    [0.25, 0.5, 0.25]
    """

    directions: int

    def __post_init__(self) -> None:
        remedy = "1 makes axisymmetric wavelets"
        directions = check_integer(self.directions, "directions", minimum=1, remedy=remedy)
        object.__setattr__(self, "directions", directions)

    @cached_property
    def _orientations(self) -> Orientations:
        return Orientations(self.directions)

    @property
    def orders(self) -> tuple[int, ...]:
        """The orders n = -(N-1), -(N-3), ..., N-1 that the wavelets hold."""
        return self._orientations.orders

    @property
    def orientations(self) -> FloatArray:
        """The angles k pi / N for k = 0..N-1, shape (directions,), radians, read-only."""
        return self._orientations.angles

    @property
    def orders_to_orientations(self) -> ComplexArray:
        """``exp(i n gamma_k)``, shape (directions, directions); see `Orientations`."""
        return self._orientations.orders_to_orientations

    def orientations_at(self, bandlimit: int) -> Orientations:
        """Return the orders and orientations, the same at every bandlimit.

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

        Examples
        --------
        >>> SteerableDirectionality(2).orientations_at(16).orders
        (-1, 1)
        """
        check_bandlimit(bandlimit)
        return self._orientations

    def coefficients(self, bandlimit: int, spin: int = 0) -> ComplexArray:  # noqa: ARG002 - as every directionality
        """Return zeta_ln for every degree below a bandlimit (eq-directionality).

        Parameters
        ----------
        bandlimit : int
        spin : int
            Makes no difference.

        Returns
        -------
        ndarray, shape (directions, bandlimit), complex128
            Row as in ``orders``, column is the degree. The squares of a column add up to 1, but
            for degree 0, which is zero: it belongs to the scaling function. Zero for |n| > l.

        Raises
        ------
        ParameterError
            If ``bandlimit`` is not an integer of at least 1.

        Examples
        --------
        >>> zeta = SteerableDirectionality(2).coefficients(5)
        >>> np.allclose(np.sum(np.abs(zeta[:, 1:]) ** 2, axis=0), 1)
        True
        """
        bandlimit = check_bandlimit(bandlimit)
        size = self.directions
        phase = 1.0 if size % 2 else 1.0j
        zeta = np.zeros((size, bandlimit), dtype=np.complex128)
        for spread in range((size - 1) % 2, min(size, bandlimit), 2):
            # The degrees g and g + 1 share the spread g; the widest serves all above.
            last = bandlimit if spread == size - 1 else min(spread + 2, bandlimit)
            margin = (size - 1 - spread) // 2
            column = phase * binomial_roots(spread)
            zeta[margin : size - margin, max(spread, 1) : last] = column[:, None]
        return zeta

    def steering_weights(self, angle: ArrayLike) -> FloatArray:
        """Return the weights that give the coefficients at any angle (eq-steering).

        Parameters
        ----------
        angle : float or array_like, shape (...)
            Radians.

        Returns
        -------
        ndarray, shape (..., directions), float64
            ``z(angle - gamma_k)``, so that ``W(angle) = sum_k weights[k] W(gamma_k)``.

        Raises
        ------
        DataError
            If an angle is not finite.

        Examples
        --------
        >>> SteerableDirectionality(3).steering_weights(np.pi / 3).round(12).tolist()
        [0.0, 1.0, 0.0]
        """
        return self._orientations.steering_weights(angle)
