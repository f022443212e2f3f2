"""`PointSums`: the sum of spin harmonics at arbitrary points of the sphere, and its adjoint.

Few points are rings of one point each. For many, the Fourier columns on the MW grid, continued to
the full circle in theta, are a trigonometric polynomial on the torus (eq-points-torus), which a
non-uniform Fourier transform evaluates.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.fourier import from_modes, from_series, to_modes, to_series
from spinsdw.grid_sums import engine_of
from spinsdw.parallel import threads_for
from spinsdw.ring_engine import OrderSums, RingEngine
from spinsdw.sampling import MW
from spinsdw.signals import check_finite

__all__ = ["PointSums", "check_accuracy", "check_points"]

Array = np.ndarray[Any, Any]

# What the non-uniform transform can reach in double precision.
_FINEST, _COARSEST = 1e-12, 1e-2
# The most by which it refines the grid of modes, along either axis.
_OVERSAMPLING = 2.51


def check_accuracy(accuracy: float) -> float:
    """Return the accuracy of a non-uniform transform, or say what is wrong with it."""
    is_number = isinstance(accuracy, float | np.floating) and not isinstance(accuracy, bool)
    if not is_number or not _FINEST <= accuracy <= _COARSEST:
        msg = (
            f"accuracy={accuracy!r} must be a float from {_FINEST:g} to {_COARSEST:g}; "
            "up to bandlimit points at once are summed directly, to rounding."
        )
        raise ParameterError(msg)
    return float(accuracy)


def check_points(colatitudes: ArrayLike, longitudes: ArrayLike) -> tuple[Array, Array]:
    """Return colatitudes and longitudes broadcast to one shape, float64, or say what is wrong."""
    theta, phi = (np.asarray(angles) for angles in (colatitudes, longitudes))
    for name, angles in (("colatitudes", theta), ("longitudes", phi)):
        if angles.dtype.kind not in "iuf":
            msg = f"{name} has dtype {angles.dtype}; it must hold real angles in radians."
            raise DataError(msg)
        check_finite(angles, name)
    try:
        theta, phi = np.broadcast_arrays(theta.astype(float), phi.astype(float))
    except ValueError:
        msg = (
            f"colatitudes has shape {theta.shape} and longitudes {phi.shape}, which do not "
            "broadcast; give one of each for every point."
        )
        raise ShapeError(msg) from None
    if theta.size and not 0 <= theta.min() <= theta.max() <= np.pi:
        msg = (
            f"colatitudes run from {theta.min():g} to {theta.max():g} and must stay within 0 and "
            "pi; a colatitude is pi / 2 minus the latitude, in radians."
        )
        raise DataError(msg)
    return np.array(theta), np.array(phi)


@dataclass(frozen=True, eq=False)
class PointSums:
    """The sums at fixed points.

    Parameters
    ----------
    sums : OrderSums
        One order n = -s, its weights, and whether m < 0 is summed.
    colatitudes, longitudes : ndarray, shape (points,), float64
        Where.
    accuracy : float
        Of the non-uniform transform.
    """

    sums: OrderSums
    colatitudes: Array
    longitudes: Array
    accuracy: float

    @property
    def _bandlimit(self) -> int:
        return int(self.sums.weights.shape[1])

    @property
    def _is_real(self) -> bool:
        return self.sums.sides == 1

    @property
    def _is_direct(self) -> bool:
        return self.colatitudes.size <= self._bandlimit

    @property
    def _n_m(self) -> int:
        return self._bandlimit if self._is_real else 2 * self._bandlimit - 1

    @property
    def values_bytes(self) -> int:
        """Bytes of the values at all points."""
        return (8 if self._is_real else 16) * self.colatitudes.size

    @property
    def working_bytes(self) -> int:
        """Bytes that a call takes beyond its input and output."""
        points = self.colatitudes.size
        if self._is_direct:
            return 3 * 16 * self._n_m * points
        modes = 16 * self._n_m * (2 * self._bandlimit - 1)
        return 16 * self._n_m * self._bandlimit + int((2 + _OVERSAMPLING**2) * modes) + 48 * points

    def _columns(self, rings: int) -> Array:
        return np.empty((1, self._n_m, rings), dtype=np.complex128)

    def _hemispheres(self) -> Iterator[tuple[Array, RingEngine, Array]]:
        """Points by hemisphere: where they stand, from north to south, sums, and e^{i m phi}.

        A block of rings takes cos(theta) - 1 or cos(theta) + 1, so none may lie on both sides.
        """
        order = np.argsort(self.colatitudes, kind="stable")
        m = np.arange(1 - self._bandlimit, self._bandlimit)
        m = np.roll(m, self._bandlimit)[: self._n_m]
        for part in np.split(order, [np.searchsorted(self.colatitudes[order], np.pi / 2)]):
            if part.size:
                phases = np.exp(1j * np.outer(m, self.longitudes[part]))
                yield part, RingEngine(self._bandlimit, self.colatitudes[part]), phases

    def to_points(self, flm: Array) -> Array:
        """Return the values at the points, shape (points,), from flm (L*L)."""
        if not self._is_direct:
            return self._to_many_points(flm)
        values = np.empty(self.colatitudes.size, dtype=float if self._is_real else complex)
        for part, engine, phases in self._hemispheres():
            columns = self._columns(part.size)
            engine.fill_columns(flm[None], self.sums, np.ones((1, 1), dtype=complex), columns)
            if self._is_real:
                columns[0, 1:] *= 2.0
                values[part] = np.einsum("mp,mp->p", columns[0], phases).real
            else:
                values[part] = np.einsum("mp,mp->p", columns[0], phases)
        return values

    def from_points(self, values: Array, out: Array) -> None:
        """Add to ``out`` (L*L) the adjoint sum; for real values m >= 0 only."""
        if not self._is_direct:
            self._from_many_points(values, out)
            return
        for part, engine, phases in self._hemispheres():
            columns = np.ascontiguousarray((phases.conj() * values[part])[None])
            engine.add_to_harmonics(columns, self.sums, out[None])

    @property
    def _parities(self) -> Array:
        """(-1)^(m + n) of each column: F_m(-theta) = (-1)^(m + n) F_m(theta)."""
        m = np.arange(self._n_m)
        # Behind 0 .. L - 1 stand -(L - 1) .. -1, in place L of which m has the parity of L - 1.
        m = np.where(m < self._bandlimit, m, m + 1)
        return np.where((m + self.sums.orders[0]) % 2 == 0, 1.0, -1.0)[:, None]

    @property
    def _half_step(self) -> Array:
        """e^{-i k theta_0} / C for the modes k on the circle: the first ring is half a step on."""
        size = 2 * self._bandlimit - 1
        k = np.arange(size)
        k = np.where(2 * k < size, k, k - size)
        return np.exp(-1j * np.pi * k / size) / size

    @property
    def _shift(self) -> int:
        """By how much real signals' modes m >= 0 are moved to lie about zero."""
        return self._bandlimit // 2 if self._is_real else 0

    @property
    def _points(self) -> Array:
        return np.stack([self.longitudes, self.colatitudes], axis=-1)

    def _to_many_points(self, flm: Array) -> Array:
        size = self._bandlimit
        columns = self._columns(size)
        engine = engine_of(MW(size), self.sums.orders)
        engine.fill_columns(flm[None], self.sums, np.ones((1, 1), dtype=complex), columns)
        modes = np.empty((columns.shape[1], 2 * size - 1), dtype=np.complex128)
        modes[:, :size] = columns[0]
        np.multiply(self._parities, columns[0, :, size - 2 :: -1], out=modes[:, size:])
        to_series(modes, modes)
        modes *= self._half_step
        if not self._is_real:
            return from_modes(modes, self._points, self.accuracy, self._threads)
        modes[1:] *= 2.0
        modes = np.roll(modes, -self._shift, axis=0)
        values = from_modes(modes, self._points, self.accuracy, self._threads)
        return (values * np.exp(1j * self._shift * self.longitudes)).real

    def _from_many_points(self, values: Array, out: Array) -> None:
        size = self._bandlimit
        columns = self._columns(size)
        modes = np.empty((columns.shape[1], 2 * size - 1), dtype=np.complex128)
        turned = values * np.exp(-1j * self._shift * self.longitudes)
        to_modes(turned, self._points, modes, self.accuracy, self._threads)
        modes = np.roll(modes, self._shift, axis=0) if self._is_real else modes
        modes *= self._half_step.conj()
        from_series(modes, modes)
        columns[0] = modes[:, :size]
        columns[0, :, : size - 1] += self._parities * modes[:, : size - 1 : -1]
        engine_of(MW(size), self.sums.orders).add_to_harmonics(columns, self.sums, out[None])

    @property
    def _threads(self) -> int:
        return threads_for(self._bandlimit, self.sums.threads)
