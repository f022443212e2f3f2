"""How a wavelet depends on azimuth: its orders, its orientations, and steering between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError
from spinsdw.harmonics import check_bandlimit, check_integer

__all__ = ["Directionality"]

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


def _binomial_roots(count: int) -> FloatArray:
    """Return sqrt(binom(count, k) / 2**count) for k = 0..count, as a unit vector."""
    k = np.arange((count + 1) // 2, count)
    # Outwards from the largest term: an underflow is then a true zero, and no factorial or
    # logarithm costs digits.
    outward = np.concatenate([[1.0], np.cumprod((count - k) / (k + 1.0))])
    inward = outward[::-1] if count % 2 else outward[:0:-1]
    terms = np.concatenate([inward, outward])
    roots: FloatArray = np.sqrt(terms / np.sum(terms))
    return roots


@dataclass(frozen=True)
class Directionality:
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
    >>> directionality = Directionality(3)
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

    @property
    def orders(self) -> tuple[int, ...]:
        """The orders n = -(N-1), -(N-3), ..., N-1 that the wavelets hold."""
        return tuple(range(1 - self.directions, self.directions, 2))

    @cached_property
    def orientations(self) -> FloatArray:
        """The angles k pi / N for k = 0..N-1, shape (directions,), radians, read-only."""
        angles = np.arange(self.directions) * np.pi / self.directions
        angles.flags.writeable = False
        return angles

    @cached_property
    def orders_to_orientations(self) -> ComplexArray:
        """``exp(i n gamma_k)``, shape (directions, directions), read-only.

        Row k, column as in ``orders``: it takes coefficients by order to coefficients by
        orientation. Its inverse is its conjugate transpose divided by ``directions``.
        """
        matrix: ComplexArray = np.exp(1j * np.outer(self.orientations, self.orders))
        matrix.flags.writeable = False
        return matrix

    def coefficients(self, bandlimit: int) -> ComplexArray:
        """Return zeta_ln for every degree below a bandlimit (eq-directionality).

        Parameters
        ----------
        bandlimit : int

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
        >>> zeta = Directionality(2).coefficients(5)
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
            column = phase * _binomial_roots(spread)
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
        >>> Directionality(3).steering_weights(np.pi / 3).round(12).tolist()
        [0.0, 1.0, 0.0]
        """
        values = np.asarray(angle, dtype=np.float64)
        if not np.isfinite(values).all():
            msg = f"angle={angle!r} must be finite; give it in radians."
            raise DataError(msg)
        difference = values[..., None] - self.orientations
        phases = difference[..., None] * np.array(self.orders)
        weights: FloatArray = np.mean(np.cos(phases), axis=-1)
        return weights
