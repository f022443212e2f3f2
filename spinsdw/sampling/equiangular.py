"""The McEwen-Wiaux samplings: equally spaced in theta, exact with the fewest rings.

The integral over the sphere of F_m(theta) d^l_mn(theta) is half the integral over the full circle
of F d |sin|, both extended to negative theta by the parity (-1)^(m + n). There F and d are
trigonometric polynomials of degree below L, so only the part of F |sin| below L counts, call it H,
and H d, of degree at most 2 L - 2, is integrated exactly by the grid's own C = 2 L - 1 (MW) or 2 L
(MWSS) points. With S the shift by half a step (exact for F), w the series of |sin| up to degree
2 L - 2, and A, B the grid's points and those half-way between,

    H = (w_A F + S^T w_B S F) / 2,

because the 2 C points together resolve the product. Hence no second grid and no second sum over l.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.parallel import run_tasks
from spinsdw.sampling.base import Sampling
from spinsdw.sampling.half_step import HalfStep, modes
from spinsdw.sampling.refinement import BATCH_SIZE, RingRefinement, column_parities

__all__ = ["MW", "MWSS"]

Array = np.ndarray[Any, Any]


def _sine_weights(bandlimit: int, size: int, first: float) -> tuple[Array, Array]:
    """|sin(theta)| up to degree 2 L - 2, at theta = first + 2 pi t / size and half a step on."""
    degree = modes(2 * size)
    even = (degree % 2 == 0) & (np.abs(degree) <= 2 * bandlimit - 2)
    series = np.where(even, 2 / (np.pi * (1 - np.where(even, degree, 0.0) ** 2)), 0.0)
    values = np.fft.ifft(series * np.exp(1j * degree * first)).real * (2 * size)
    return np.ascontiguousarray(values[::2]), np.ascontiguousarray(values[1::2])


@functools.lru_cache(maxsize=128)
def _pairs(bandlimit: int, n_phi: int, n_m: int) -> tuple[Array, Array]:
    """Return places of even m and of odd m, in two arrays of one length, -1 for none."""
    m = np.arange(n_m)
    if n_m == n_phi:
        m = np.where(m < bandlimit, m, m - n_m)
    even, odd = np.flatnonzero(m % 2 == 0), np.flatnonzero(m % 2 != 0)
    pairs = np.full((2, max(even.size, odd.size)), -1)
    pairs[0, : even.size], pairs[1, : odd.size] = even, odd
    return pairs[0], pairs[1]


@dataclass(frozen=True)
class _Equiangular(Sampling):
    """What MW and MWSS share: C points on the full circle in theta."""

    # Ring t mirrors to C - _offset - t modulo C.
    _offset: ClassVar[int]

    @property
    def n_phi(self) -> int:
        return 2 * self.bandlimit - self._offset

    @functools.cached_property
    def weights(self) -> Array:
        """Weight of each point of a ring; float64, shape (n_rings,): the quadrature of d^0_00."""
        columns = np.ones((1, 1, self.n_rings), dtype=np.complex128)
        self.weigh_columns(columns, (0,), mixing=np.ones((1, 1), dtype=complex), threads=1)
        weights = columns[0, 0].real.copy()
        weights.flags.writeable = False
        return weights

    @functools.cached_property
    def _circle_weights(self) -> tuple[Array, Array]:
        size = self.n_phi
        here, between = _sine_weights(self.bandlimit, size, float(self.colatitudes[0]))
        # 2 pi / P of the ring sums, pi / C of the circle, 1 / 2 of the two grids.
        factor = np.pi**2 / size**2
        return here * factor, between * factor

    @functools.cached_property
    def refinement(self) -> RingRefinement:
        """The same quadrature as a weighted sum over twice as many rings."""
        return RingRefinement(self.n_phi, self._offset, self._circle_weights)

    @functools.cached_property
    def _half_step(self) -> HalfStep:
        return HalfStep(self.n_phi)

    def _weigh_batch(
        self, columns: Array, mixing: Array, parities: Array, pairs: tuple[Array, Array]
    ) -> None:
        from spinsdw.compiled.columns import fill_circles, fold_circles

        even, odd = pairs
        shape = (parities.size, even.size, self.n_phi)
        circles = np.empty(shape, dtype=np.complex128)
        fill_circles(columns, mixing, even, odd, parities, self._offset, circles)
        # (w_A + S^T w_B S) circles, times the constants; the sum is left to the folding.
        here, between = self._circle_weights
        shifted = self._half_step.shift(circles)
        shifted *= between
        shifted = self._half_step.shift_back(shifted)
        fold_circles(circles, here, shifted, even, odd, parities, self._offset, columns)

    def weigh_columns(
        self, columns: Array, orders: tuple[int, ...], *, mixing: Array, threads: int
    ) -> None:
        even, odd = _pairs(self.bandlimit, self.n_phi, columns.shape[1])
        parities = column_parities(orders)
        step = max(1, BATCH_SIZE // (self.n_phi * len(orders)))
        tasks = [
            functools.partial(
                self._weigh_batch,
                columns,
                mixing,
                parities,
                (even[j : j + step], odd[j : j + step]),
            )
            for j in range(0, even.size, step)
        ]
        run_tasks(tasks, threads)


@dataclass(frozen=True)
class MW(_Equiangular):
    """McEwen-Wiaux sampling: theta_t = (2 t + 1) pi / (2 L - 1), t < L; 2 L - 1 points a ring.

    The last ring is the south pole. McEwen & Wiaux 2011, arXiv:1110.6298.

    Parameters
    ----------
    bandlimit : int
        Signals have degrees l < bandlimit.

    Examples
    --------
    >>> MW(3).shape
    (3, 5)
    >>> bool(MW(3).colatitudes[-1] == np.pi)
    True
    """

    name: ClassVar[str] = "mw"
    _offset: ClassVar[int] = 1

    @property
    def n_rings(self) -> int:
        """Number of rings, L."""
        return self.bandlimit

    @property
    def integral_bandlimit(self) -> int:
        """L: a weighted sum over L rings does not integrate the product of two signals."""
        return self.bandlimit

    @property
    def colatitudes(self) -> Array:
        """Colatitude of each ring in radians; float64, shape (n_rings,)."""
        return (2 * np.arange(self.bandlimit) + 1) * np.pi / (2 * self.bandlimit - 1)


@dataclass(frozen=True)
class MWSS(_Equiangular):
    """Symmetric McEwen-Wiaux sampling: theta_t = pi t / L, t <= L; 2 L points a ring.

    Both poles are rings. Ducasse, McEwen & Wiaux; the layout of the s2fft and ssht packages.

    Parameters
    ----------
    bandlimit : int
        Signals have degrees l < bandlimit.

    Examples
    --------
    >>> MWSS(3).shape
    (4, 6)
    """

    name: ClassVar[str] = "mwss"
    is_symmetric: ClassVar[bool] = True
    _offset: ClassVar[int] = 0

    @property
    def n_rings(self) -> int:
        """Number of rings, L + 1."""
        return self.bandlimit + 1

    @property
    def integral_bandlimit(self) -> int:
        """L + 1, or L + 2 for even L: that of Clenshaw and Curtis with L + 1 rings."""
        return self.bandlimit + 2 - self.bandlimit % 2

    @property
    def colatitudes(self) -> Array:
        """Colatitude of each ring in radians; float64, shape (n_rings,)."""
        return np.pi * np.arange(self.bandlimit + 1) / self.bandlimit
