"""Pure E and B coefficients of a masked map: derivatives act on the mask instead of the map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spinsdw.harmonics import multiply_by_degree, polarisation_factor
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.separation.smooth_masks import SmoothMask

__all__ = ["pure_harmonics"]


def pure_harmonics(
    sky: HealpixSky | GridSky,
    mask: SmoothMask,
    p: NDArray[np.complex128],
    bandlimit: int | None = None,
) -> NDArray[np.complex128]:
    """Compute the spin-2 coefficients -(e + ib) of the pure estimator (eq-pure-harmonic).

    N_l e_lm and N_l b_lm are the coefficients of M times the second derivatives of E and of B:
    what is E in the map stays out of b, whatever the mask.

    Parameters
    ----------
    sky : HealpixSky or GridSky
        The pixelisation.
    mask : SmoothMask
        M and its derivatives at the sky's samples.
    p : ndarray, shape (..., map), complex128
        P = Q + iU, ring order; finite where M is 0.
    bandlimit : int, optional
        One more than the largest degree wanted; the sky's when None.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        -(e_lm + i b_lm), zero at degrees 0 and 1; what a spin-2 wavelet transform takes.

    Raises
    ------
    ShapeError, DataError
        If maps have another shape than the sky's, or are not finite.

    Notes
    -----
    Exact to rounding on a grid that holds the product, of bandlimit L + L_M - 1 for a map of
    bandlimit L. Maps sampled at their own bandlimit are brought to such a grid: exactly where they
    are known everywhere; where they end at the edge of a footprint they are not band-limited.
    """
    bandlimit = sky.bandlimit if bandlimit is None else bandlimit
    el = np.arange(bandlimit, dtype=np.float64)
    factor = polarisation_factor(bandlimit)
    inverse = np.divide(1.0, factor, out=np.zeros(bandlimit), where=factor > 0)
    if isinstance(sky, GridSky):
        fine = sky.for_products(mask.bandlimit)
        p, mask, sky = sky.evaluate(p, fine), mask.on(fine), fine
    plm = sky.weighted_coefficients(mask.values * p, bandlimit, 2)
    one = sky.weighted_coefficients(mask.first * p, bandlimit, 1)
    plm += multiply_by_degree(one, 2 * np.sqrt(el * (el + 1)) * inverse)
    zero = sky.weighted_coefficients(mask.second * p, bandlimit, 0)
    plm += multiply_by_degree(zero, inverse)
    plm[..., :4] = 0.0
    return plm
