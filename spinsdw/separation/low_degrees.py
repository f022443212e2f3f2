r"""A preconditioner that solves the lowest degrees of a fit exactly.

The normal equations :math:`1 + S Y^H W Y S / n^2` are worst conditioned at the lowest degrees,
where the prior exceeds the noise most and a mask couples nearly everything.  There are few of them:
restricted to :math:`l < L_0` the equations are one small dense matrix, which depends on the weights
through their coefficients below :math:`2 L_0 - 1` only.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.harmonics import resize
from spinsdw.ring_transform import HealpixTransform
from spinsdw.separation.least_squares import EBPrior, Observation

__all__ = ["LowDegreeBlock"]

Array = np.ndarray[Any, Any]

_BATCH = 256


@dataclass(frozen=True, eq=False)
class LowDegreeBlock:
    """The inverse of the normal equations at l < L0, and that for uniform weights above.

    Parameters
    ----------
    observation : Observation
        Where the map was observed and how well.
    prior : EBPrior
        Variances of E and B.
    bandlimit : int, default 24
        L0; the matrix has 2 (L0^2 - 4) rows.

    Notes
    -----
    It helps where the footprint is much wider than 180 degrees / L0. On small patches the mask
    couples degrees across L0 and the cut slows the fit down.
    """

    observation: Observation
    prior: EBPrior
    bandlimit: int = 24

    @property
    def _size(self) -> int:
        return min(self.bandlimit, self.prior.bandlimit)

    @functools.cached_property
    def _above(self) -> Callable[[Array], Array]:
        return self.prior.preconditioner(self.observation.precision)

    @functools.cached_property
    def _factor(self) -> tuple[Array, bool]:
        """Cholesky factor of the matrix, for the real and imaginary parts of p_lm, l >= 2."""
        from scipy.linalg import cho_factor

        size, first = self._size, 4
        prior = EBPrior(self.prior.e_spectrum[:size], self.prior.b_spectrum[:size])
        apply = self._weigher(size)
        units = np.eye(size**2, dtype=np.complex128)[first:]
        units = np.concatenate([units, 1j * units])
        matrix = np.empty((len(units), len(units)))
        for start in range(0, len(units), _BATCH):
            rows = slice(start, start + _BATCH)
            changed = units[rows] + prior.root(apply(prior.root(units[rows])))
            matrix[rows] = np.concatenate(
                [changed.real[:, first:], changed.imag[:, first:]], axis=1
            )
        return cho_factor((matrix + matrix.T) / 2, lower=True, overwrite_a=True)

    def _weigher(self, size: int) -> Callable[[Array], Array]:
        """Return Y^H W Y / n^2 for degrees below ``size``, by sums over coarse pixels."""
        seen = self.observation
        nside = 8
        # Products of degree 4 (size - 1) at most are integrated: sums are good to 3 nside or so.
        while 3 * nside < 4 * size:
            nside *= 2
        bandlimit = 2 * size - 1
        coefficients = seen.sky.integrals(seen.weights, min(bandlimit, 2 * seen.sky.bandlimit))
        smooth = HealpixTransform(nside, bandlimit, real=True, threads=1)
        weights = smooth.synthesis(resize(coefficients, bandlimit))
        weights *= 4 * np.pi / weights.size / seen.noise_level**2
        transform = HealpixTransform(nside, size, 2, threads=1)
        return lambda plm: transform.adjoint_synthesis(weights * transform.synthesis(plm))

    def __call__(self, x: Array) -> Array:
        """Apply the preconditioner to a stack, shape (batch, L^2)."""
        from scipy.linalg import cho_solve

        y = self._above(x)
        size = self._size
        low = x[:, 4 : size**2]
        solved = cho_solve(self._factor, np.concatenate([low.real, low.imag], axis=1).T).T
        half = low.shape[1]
        y[:, 4 : size**2] = solved[:, :half] + 1j * solved[:, half:]
        return y
