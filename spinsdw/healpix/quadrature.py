r"""Quadrature on HEALPix: weights of the pixels that make low degrees exact.

Equal weights integrate a HEALPix map to about 1e-3.  The weights nearest to them for which

.. math:: \sum_p w_p Y_{lm}(p) = \sqrt{4\pi}\, \delta_{l0} \qquad (l \le 2.75\, n_\mathrm{side})

make the inner product of two fields exact whose degrees together do not pass that limit.  Beyond
2.75 nside conjugate gradients slow down, and at 3.25 nside no such weights exist.  They are
computed here and kept: nothing is downloaded.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from spinsdw.healpix.pixels import check_nside, nside_of

__all__ = ["pixel_weights", "quadrature_flm"]

_EXACT_DEGREES = 2.75
_TOLERANCE = 1e-8


@functools.lru_cache(maxsize=8)
def pixel_weights(nside: int, threads: int | None = None) -> NDArray[np.float64]:
    """Return weights whose sums over pixels are integrals, for degrees up to 2.75 nside.

    Parameters
    ----------
    nside : int
        HEALPix resolution.
    threads : int, optional
        Threads of the transforms.

    Returns
    -------
    ndarray, shape (12 * nside**2,), float64
        RING order, read-only; they add up to 4 pi.

    Raises
    ------
    ParameterError
        If ``nside`` is not a HEALPix resolution.

    Examples
    --------
    >>> from spinsdw.healpix import pixel_directions
    >>> weights, (colatitudes, _) = pixel_weights(8), pixel_directions(8)
    >>> bool(abs(np.sum(weights * np.cos(colatitudes) ** 16) - 4 * np.pi / 17) < 1e-7)
    True
    """
    from spinsdw.ring_transform import HealpixTransform

    nside = check_nside(nside)
    bandlimit = int(_EXACT_DEGREES * nside) + 1
    transform = HealpixTransform(nside, bandlimit, real=True, threads=threads)
    weights = np.full(12 * nside**2, 4 * np.pi / (12 * nside**2))
    # Conjugate gradients for Y^H Y x = what equal weights miss, at most 20 steps; Y x mends them.
    rest = -transform.adjoint_synthesis(weights)
    rest[0] += np.sqrt(4 * np.pi)
    direction, power = rest.copy(), _power(rest)
    while power > _TOLERANCE**2:
        change = transform.synthesis(direction)
        step = power / _power(change)
        weights += step * change
        rest -= step * transform.adjoint_synthesis(change)
        previous, power = power, _power(rest)
        direction = rest + power / previous * direction
    weights.setflags(write=False)
    return weights


def _power(values: NDArray[np.complex128] | NDArray[np.float64]) -> float:
    return float(np.vdot(values, values).real)


def quadrature_flm(
    maps: NDArray[np.complex128],
    bandlimit: int,
    spin: int,
    *,
    iterations: int = 0,
    threads: int | None = None,
) -> NDArray[np.complex128]:
    """Compute coefficients by weighted sums over pixels, for maps that are not band-limited.

    `map_to_flm` fits instead, which lets degrees beyond the bandlimit disturb those below.

    Parameters
    ----------
    maps : ndarray, shape (..., npix), complex128
        RING order.
    bandlimit : int
        One more than the largest degree.
    spin : int
        Spin weight of the maps.
    iterations : int
        How often what the coefficients leave of the map is added (Jacobi iteration); worth it
        where the bandlimit exceeds nside.
    threads : int, optional
        Threads of the transforms.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Raises
    ------
    ShapeError, DataError
        If the maps are no whole-sky maps, or not finite.

    Examples
    --------
    >>> flm = quadrature_flm(np.ones(12 * 8**2, dtype=complex), 5, 0)
    >>> bool(abs(flm[0] - np.sqrt(4 * np.pi)) < 1e-9)
    True
    """
    from spinsdw.ring_transform import HealpixTransform

    nside = nside_of(maps)
    weights = pixel_weights(nside, threads)
    transform = HealpixTransform(nside, bandlimit, spin, threads=threads)
    flm = transform.adjoint_synthesis(weights * maps)
    for _ in range(iterations):
        flm += transform.adjoint_synthesis(weights * (maps - transform.synthesis(flm)))
    return flm
