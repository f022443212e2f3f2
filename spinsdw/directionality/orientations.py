"""`Orientations`: the fewest equally spaced angles that hold given azimuthal orders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ParameterError
from spinsdw.harmonics import check_integer

__all__ = ["Orientations"]

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Orientations:
    """Equally spaced angles, as many as there are azimuthal orders (eq-steering).

    The orders are n = -n_max, -n_max + step, ..., n_max. A function of gamma with no others is
    known everywhere from its values at that many angles: between 0 and pi where ``step`` is 2,
    since half a turn then is a sign, and between 0 and 2 pi where it is 1.

    Parameters
    ----------
    count : int
        The number of orders, at least 1.
    step : {1, 2}
        The distance between orders. With 1, ``count`` is odd.

    Raises
    ------
    ParameterError
        If ``count`` is not an integer of at least 1, or ``step`` not 1 or 2, or both leave no
        orders symmetric about 0.

    Examples
    --------
    >>> Orientations(3).orders, Orientations(3, step=1).orders
    ((-2, 0, 2), (-1, 0, 1))
    >>> Orientations(4).angles.round(3).tolist()
    [0.0, 0.785, 1.571, 2.356]
    """

    count: int
    step: int = 2

    def __post_init__(self) -> None:
        count = check_integer(self.count, "count", minimum=1, remedy="it counts the orders")
        object.__setattr__(self, "count", count)
        if self.step not in {1, 2} or (self.step == 1 and count % 2 == 0):
            msg = (
                f"step={self.step} must be 2, or 1 for an odd count, not {count}; "
                "else the orders are not symmetric about 0."
            )
            raise ParameterError(msg)

    @property
    def largest_order(self) -> int:
        """The largest order, n_max."""
        return (self.count - 1) * self.step // 2

    @property
    def orders(self) -> tuple[int, ...]:
        """The orders n, increasing."""
        return tuple(range(-self.largest_order, self.largest_order + 1, self.step))

    @cached_property
    def angles(self) -> FloatArray:
        """The angles gamma_k = 2 pi k / (step count), shape (count,), radians, read-only."""
        angles = np.arange(self.count) * (2 * np.pi) / (self.step * self.count)
        angles.flags.writeable = False
        return angles

    @cached_property
    def orders_to_orientations(self) -> ComplexArray:
        """``exp(i n gamma_k)``, shape (count, count), read-only.

        Row k, column as in ``orders``: it takes coefficients by order to coefficients by
        orientation. Its inverse is its conjugate transpose divided by ``count``.
        """
        matrix: ComplexArray = np.exp(1j * np.outer(self.angles, self.orders))
        matrix.flags.writeable = False
        return matrix

    def steering_weights(self, angle: ArrayLike) -> FloatArray:
        """Return the weights that give the coefficients at any angle (eq-steering).

        Parameters
        ----------
        angle : float or array_like, shape (...)
            Radians.

        Returns
        -------
        ndarray, shape (..., count), float64
            ``z(angle - gamma_k)``, so that ``W(angle) = sum_k weights[k] W(gamma_k)``.

        Raises
        ------
        DataError
            If an angle is not finite.

        Examples
        --------
        >>> Orientations(3).steering_weights(np.pi / 3).round(12).tolist()
        [0.0, 1.0, 0.0]
        """
        values = np.asarray(angle, dtype=np.float64)
        if not np.isfinite(values).all():
            msg = f"angle={angle!r} must be finite; give it in radians."
            raise DataError(msg)
        difference = values[..., None] - self.angles
        phases = difference[..., None] * np.array(self.orders)
        weights: FloatArray = np.mean(np.cos(phases), axis=-1)
        return weights
