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
from spinsdw.separation.least_squares import EBPrior, Observation
from spinsdw.spin_transform import SpinHarmonicTransform

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
    def _inverse(self) -> Array:
        """Inverse of the matrix, for the real and imaginary parts of p_lm, l >= 2."""
        from scipy.linalg import eigh

        values, vectors = eigh(self._matrix, overwrite_a=True)
        # 1 + a positive operator: what is below 1 comes from the sums over samples.
        return np.asarray((vectors / np.maximum(values, 1.0)) @ vectors.T)

    @property
    def _matrix(self) -> Array:
        """1 + S Y^H W Y S / n^2 on the real and imaginary parts of p_lm, l >= 2."""
        from scipy.sparse import csr_array

        size, first = self._size, 4
        root = EBPrior(self.prior.e_spectrum[:size], self.prior.b_spectrum[:size]).root()
        apply = self._weigher(size)
        ones = np.eye(size**2, dtype=np.complex128)[first:]
        weighed = np.concatenate([apply(ones[i : i + _BATCH]) for i in range(0, len(ones), _BATCH)])
        units = np.concatenate([ones, 1j * ones])
        # S mixes real and imaginary parts, the weights do not: half the transforms.
        seen = csr_array(root(units)[:, first:]) @ weighed
        changed = (units + root(seen))[:, first:]
        matrix = np.concatenate([changed.real, changed.imag], axis=1)
        return np.asarray((matrix + matrix.T) / 2)

    def _weigher(self, size: int) -> Callable[[Array], Array]:
        """Return Y^H W Y / n^2 for degrees below ``size``, by exact integrals."""
        seen, bandlimit = self.observation, 3 * size - 2
        scalar = SpinHarmonicTransform(bandlimit, real=True, threads=1)
        weights = scalar.synthesis(resize(seen.weight_harmonics(2 * size - 1), bandlimit))
        transform = SpinHarmonicTransform(bandlimit, 2, threads=1)

        def weigh(plm: Array) -> Array:
            values = transform.synthesis(resize(plm, bandlimit))
            return resize(transform.analysis(weights * values), size)

        return weigh

    def __call__(self, x: Array) -> Array:
        """Apply the preconditioner to a stack, shape (batch, L^2)."""
        y = self._above(x)
        size = self._size
        low = x[:, 4 : size**2]
        # Not by BLAS: after a product its threads wait for more, on the cores of our transforms.
        parts = np.concatenate([low.real, low.imag], axis=1)
        solved = np.einsum("bj,ij->bi", parts, self._inverse)
        half = low.shape[1]
        y[:, 4 : size**2] = solved[:, :half] + 1j * solved[:, half:]
        return y
