"""The orientation of the strongest response: maxima of trigonometric polynomials, one per place.

At each place the coefficients are W(gamma) = sum_n c_n e^{i n gamma} of a few orders, and |W|^2 has
the orders of their autocorrelation. One frequency has its maximum in closed form. With more, the
derivative is read at 32 points of the shortest period; every maximum between two of them that may
be the highest is refined by Newton's method in its bracket.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from spinsdw.directionality import Orientations

__all__ = ["strongest_orientations"]

Array = np.ndarray[Any, Any]

_POINTS = 32
# Complex numbers of one block of places: the values at all points stay in cache.
_BLOCK = 2**18
# Bisection alone needs 53 steps, Newton's method four or five.
_STEPS = 60


@dataclass(frozen=True, eq=False)
class _Polynomials:
    """P(x) = constant + 2 Re sum_k amplitudes_k e^{i frequencies_k x}, one for each place.

    constant: (places,); amplitudes: (frequencies, places) complex; frequencies: positive integers.
    """

    constant: Array
    amplitudes: Array
    frequencies: Array

    @classmethod
    def from_orders(cls, by_order: Array, step: int, *, modulus: bool) -> _Polynomials:
        """Take W itself, or |W|^2, from its coefficients c_n, shape (orders, places)."""
        count = len(by_order)
        if modulus:
            lags = [
                np.sum(by_order[lag:] * by_order[: count - lag].conj(), axis=0)
                for lag in range(count)
            ]
            return cls(lags[0].real, np.array(lags[1:]), step * np.arange(1, count))
        middle = count // 2
        constant = by_order[middle].real if count % 2 else np.zeros(by_order.shape[1])
        amplitudes = by_order[middle + count % 2 :]
        first = step if count % 2 else 1
        return cls(constant, amplitudes, first + step * np.arange(len(amplitudes)))

    @cached_property
    def period(self) -> float:
        """After which every one repeats."""
        return 2 * math.pi / (math.gcd(*self.frequencies.tolist()) or 1)

    def derivative(self, times: int) -> _Polynomials:
        """Return the polynomials' derivative, so many times."""
        factor = (1j * self.frequencies[:, None]) ** times
        return _Polynomials(0 * self.constant, self.amplitudes * factor, self.frequencies)

    def at_all(self, points: Array) -> Array:
        """Return every polynomial at the same points, shape (points, places)."""
        phases = np.exp(1j * np.outer(points, self.frequencies))
        values = phases.real @ self.amplitudes.real - phases.imag @ self.amplitudes.imag
        return np.asarray(self.constant + 2 * values)

    def at(self, places: Array, points: Array) -> Array:
        """Return polynomial ``places[i]`` at ``points[i]``."""
        phases = np.exp(1j * np.outer(self.frequencies, points))
        values = np.sum((self.amplitudes[:, places] * phases).real, axis=0)
        return np.asarray(self.constant[places] + 2 * values)

    def maxima(self) -> Array:
        """Return where each has its highest value, shape (places,), in [0, period)."""
        if not len(self.frequencies):
            return np.zeros(self.constant.shape)
        if len(self.frequencies) == 1:
            return -np.angle(self.amplitudes[0]) / self.frequencies[0] % self.period
        size = round(_POINTS * self.frequencies[-1] * self.period / (2 * math.pi))
        points = self.period / size * np.arange(size)
        values, slopes = self.at_all(points), self.derivative(1).at_all(points)
        best = np.argmax(values, axis=0)
        angles, heights = points[best], np.take_along_axis(values, best[None], axis=0)[0]
        lower, places = self._brackets(values, slopes)
        found = self._refined(places, points[lower], points[lower] + self.period / size)
        refined = self.at(places, found)
        # A maximum at a point may be found lower than the point itself by rounding.
        size_of_terms = np.abs(self.constant) + 2 * np.sum(np.abs(self.amplitudes), axis=0)
        is_highest = refined >= heights[places] - 8 * np.finfo(float).eps * size_of_terms[places]
        order = np.flatnonzero(is_highest)[np.argsort(refined[is_highest], kind="stable")]
        # Of values for one place numpy keeps the last, which is the highest.
        angles[places[order]] = found[order]
        return angles % self.period

    def _brackets(self, values: Array, slopes: Array) -> tuple[Array, Array]:
        """Return (point, place) after which a maximum follows that may be the place's highest."""
        after = np.roll(values, -1, axis=0)
        is_maximum = (slopes >= 0) & (np.roll(slopes, -1, axis=0) < 0)
        step = self.period / len(values)
        # No maximum is higher above the points around it than its curvature allows.
        curvature = 2 * self.frequencies**2 @ np.abs(self.amplitudes)
        reach = np.maximum(values, after) + curvature * step**2 / 8
        lower, places = np.nonzero(is_maximum & (reach >= values.max(axis=0)))
        return lower, places

    def _refined(self, places: Array, lower: Array, upper: Array) -> Array:
        """Return where the slope falls through zero, between two bounds for each."""
        slope, curvature = self.derivative(1), self.derivative(2)
        points = (lower + upper) / 2
        for _ in range(_STEPS):
            rise = slope.at(places, points)
            lower, upper = np.where(rise > 0, points, lower), np.where(rise > 0, upper, points)
            bend = curvature.at(places, points)
            newton = points - np.divide(rise, bend, out=np.zeros_like(rise), where=bend < 0)
            is_inside = (bend < 0) & (newton >= lower) & (newton <= upper)
            following = np.where(is_inside, newton, (lower + upper) / 2)
            if np.all(np.abs(following - points) <= 4 * np.finfo(float).eps * self.period):
                return following
            points = following
        return points


def strongest_orientations(
    values: Array, orientations: Orientations, *, modulus: bool
) -> tuple[Array, Array]:
    """Return the orientation of the strongest response at every place, and the response there.

    Parameters
    ----------
    values : ndarray, shape (..., orientations, rings, phi)
        Coefficients of a scale, real unless ``modulus``.
    orientations : Orientations
        Where they are.
    modulus : bool
        Whether the modulus is to be largest, or the value itself.

    Returns
    -------
    angles, strengths : ndarray, shape (..., rings, phi), float64
        Radians, and the unit of the values.

    Examples
    --------
    >>> values = np.cos(Orientations(2).angles - 0.3)[:, None, None]
    >>> angles, strengths = strongest_orientations(values, Orientations(2), modulus=False)
    >>> angles.round(12).tolist(), strengths.round(12).tolist()
    ([[0.3]], [[1.0]])
    """
    count = orientations.count
    rows = np.moveaxis(values, -3, 0).reshape(count, -1)
    to_orders = orientations.orders_to_orientations.conj().T / count
    angles, strengths = np.empty(rows.shape[1]), np.empty(rows.shape[1])
    points = _POINTS * (1 + orientations.largest_order) * (1 + modulus)
    step = max(1, _BLOCK // points)
    orders = np.array(orientations.orders)
    for first in range(0, rows.shape[1], step):
        block = slice(first, first + step)
        by_order = to_orders @ rows[:, block]
        polynomials = _Polynomials.from_orders(by_order, orientations.step, modulus=modulus)
        angles[block] = polynomials.maxima()
        phases = np.exp(1j * orders[:, None] * angles[block])
        found = np.sum(by_order * phases, axis=0)
        strengths[block] = np.abs(found) if modulus else found.real
    shape = (*values.shape[:-3], *values.shape[-2:])
    return angles.reshape(shape), strengths.reshape(shape)
