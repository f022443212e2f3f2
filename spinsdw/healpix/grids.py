"""From coefficients to HEALPix maps, and between HEALPix and exact grids.

Evaluating coefficients at pixel centres is exact.  So a map on an exact grid goes to HEALPix
without loss, and comes back through the fit of `spinsdw.healpix.fitting`.
"""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ShapeError
from spinsdw.harmonics import bandlimit_of, is_real_field
from spinsdw.healpix.alm import REALITY_ULPS
from spinsdw.healpix.fitting import FitOptions, HealpixFit, map_to_flm
from spinsdw.healpix.pixels import check_nside, ring_to_nested
from spinsdw.sampling import Sampling
from spinsdw.signals import refuse_masked

__all__ = ["flm_to_map", "healpix_to_mw", "mw_to_healpix"]


def flm_to_map(  # noqa: PLR0913 - one synthesis with its layout choices
    flm: ArrayLike,
    nside: int,
    spin: int = 0,
    *,
    real: bool = False,
    nest: bool = False,
    threads: int | None = None,
) -> NDArray[Any]:
    """Evaluate coefficients at the pixel centres of a HEALPix map.

    Exact at any bandlimit; no pixel window is applied.  `map_to_flm` goes back.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2), complex
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]
    nside : int
        HEALPix resolution.
    spin : int
        Spin weight.
    real : bool
        True for the coefficients of a real field (spin 0), to get float64 maps.
    nest : bool
        True for NESTED order.
    threads : int, optional
        Threads of the transform.

    Returns
    -------
    ndarray, shape (..., 12 * nside**2), complex128, or float64 if ``real``
        The unit of the coefficients.

    Raises
    ------
    ShapeError
        If the number of coefficients is not a square.
    ParameterError
        If ``nside`` is not a HEALPix resolution, or ``real`` goes with a spin.
    DataError
        If ``real`` and the coefficients are not those of a real field.

    Examples
    --------
    >>> bool(np.allclose(flm_to_map([np.sqrt(4 * np.pi)], 2, real=True), 1))
    True
    """
    from spinsdw.ring_transform import HealpixTransform

    values = np.asarray(flm, dtype=np.complex128)
    check_nside(nside, nested=nest)
    if real and not is_real_field(values, REALITY_ULPS):
        msg = "flm breaks f_l,-m = (-1)^m conj(f_lm), which real=True needs; pass real=False."
        raise DataError(msg)
    transform = HealpixTransform(nside, bandlimit_of(values), spin, real=real, threads=threads)
    maps: NDArray[Any] = transform.synthesis(values)
    return ring_to_nested(maps) if nest else maps


def mw_to_healpix(
    maps: ArrayLike,
    nside: int,
    spin: int = 0,
    *,
    sampling: str | Sampling = "mw",
    threads: int | None = None,
) -> NDArray[Any]:
    """Evaluate maps of an exact grid at HEALPix pixel centres, through their coefficients.

    Exact for band-limited maps; `healpix_to_mw` goes back.

    Parameters
    ----------
    maps : array_like, shape (..., rings, phi)
        Real or complex for spin 0, complex for other spins.
    nside : int
        HEALPix resolution.
    spin : int
        Spin weight.
    sampling : str or Sampling
        The grid of the maps: a name that `resolve_sampling` knows, or an object.
    threads : int, optional
        Threads of the transforms.

    Returns
    -------
    ndarray, shape (..., 12 * nside**2)
        Complex128, or float64 for real maps; RING order.

    Raises
    ------
    ShapeError
        If the maps do not have the grid's shape.
    DataError
        If maps of spin not 0 are real.

    Examples
    --------
    >>> bool(np.allclose(mw_to_healpix(np.ones((4, 7)), 2), 1))
    True
    """
    from spinsdw.spin_transform import SpinHarmonicTransform

    refuse_masked(maps, "maps")
    values = np.asarray(maps)
    is_real = _is_real(values, spin)
    if values.ndim < 2:
        msg = f"maps have shape {values.shape} but must have (..., rings, phi); give grid maps."
        raise ShapeError(msg)
    if isinstance(sampling, Sampling):
        bandlimit = sampling.bandlimit
    else:
        # 2 L - 1 points a ring, 2 L on MWSS.
        bandlimit = (values.shape[-1] + 1) // 2
    grid = SpinHarmonicTransform(bandlimit, spin, sampling=sampling, real=is_real, threads=threads)
    return flm_to_map(grid.analysis(values), nside, spin, real=is_real, threads=threads)


def _is_real(maps: NDArray[Any], spin: int) -> bool:
    """Return whether maps hold a real scalar field; refuse real maps of another spin."""
    is_real = not np.iscomplexobj(maps)
    if is_real and spin:
        msg = f"maps of spin={spin} have dtype {maps.dtype} but must be complex; give Q + iU."
        raise DataError(msg)
    return is_real


def healpix_to_mw(
    maps: ArrayLike,
    bandlimit: int,
    spin: int = 0,
    *,
    sampling: str | Sampling = "mw",
    mask: ArrayLike | None = None,
    **options: Unpack[FitOptions],
) -> tuple[NDArray[Any], HealpixFit]:
    """Fit coefficients to HEALPix maps and evaluate them on an exact grid.

    `mw_to_healpix` goes back.

    Parameters
    ----------
    maps : array_like, shape (..., npix)
        Real or complex for spin 0, complex for other spins.
    bandlimit : int
        One more than the largest degree, up to 3 nside.
    spin : int
        Spin weight.
    sampling : str or Sampling
        The grid wanted.
    mask : array_like, shape (npix,), optional
        Weights in [0, 1].
    **options
        The other keyword arguments of `map_to_flm`.

    Returns
    -------
    maps : ndarray, shape (..., rings, phi)
        Complex128, or float64 for real maps.
    fit : HealpixFit
        Steps taken and residuals left.

    Raises
    ------
    ShapeError, DataError, ParameterError
        As `map_to_flm` does.

    Examples
    --------
    >>> grid, fit = healpix_to_mw(np.ones(12 * 8**2), 9)
    >>> grid.shape, bool(np.allclose(grid, 1))
    ((9, 17), True)
    """
    from spinsdw.spin_transform import SpinHarmonicTransform

    flm, fit = map_to_flm(maps, bandlimit, spin, mask=mask, **options)
    is_real = not np.iscomplexobj(maps)
    threads = options.get("threads")
    grid = SpinHarmonicTransform(bandlimit, spin, sampling=sampling, real=is_real, threads=threads)
    return grid.synthesis(flm), fit
