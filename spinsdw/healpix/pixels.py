"""The pixels of HEALPix maps: resolution, centres, RING and NESTED order.

The package works in RING order.  healpy is imported where NESTED order is converted, not before.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import ParameterError, ShapeError
from spinsdw.harmonics import check_integer
from spinsdw.sampling.healpix_rings import HealpixRings

__all__ = [
    "check_nside",
    "degrade_map",
    "nested_to_ring",
    "nside_of",
    "pixel_at",
    "pixel_directions",
    "ring_to_nested",
    "upgrade_map",
]

FloatArray: TypeAlias = NDArray[np.float64]

LARGEST_NSIDE = 2**29


def check_nside(nside: int, *, nested: bool = False) -> int:
    """Return ``nside`` as an int after checking that it names a HEALPix resolution.

    Parameters
    ----------
    nside : int
        Number of pixels along the side of a base pixel, from 1 to 2**29.
    nested : bool
        Also require a power of two, which NESTED order needs and RING order does not.

    Returns
    -------
    int
        The same number.

    Raises
    ------
    ParameterError
        If ``nside`` is not an integer, is out of range, or is no power of two where needed.

    Examples
    --------
    >>> check_nside(48)
    48
    """
    nside = check_integer(nside, "nside", minimum=1, remedy="512 has pixels of 7 arcmin")
    if nside > LARGEST_NSIDE:
        msg = f"nside={nside} must not exceed 2**29; 512 has pixels of 7 arcmin."
        raise ParameterError(msg)
    if nested and nside & (nside - 1):
        msg = f"nside={nside} must be a power of two for NESTED order; use RING order instead."
        raise ParameterError(msg)
    return nside


def nside_of(maps: ArrayLike) -> int:
    """Return the nside of whole-sky maps from their number of pixels.

    Parameters
    ----------
    maps : array_like, shape (..., npix)
        One map or a stack of maps, ``npix = 12 nside**2``.

    Returns
    -------
    int
        The resolution parameter.

    Raises
    ------
    ShapeError
        If the last axis has no valid number of pixels.

    Examples
    --------
    >>> nside_of(np.zeros((3, 192)))
    4
    """
    shape = np.shape(maps)
    npix = shape[-1] if shape else 0
    nside = math.isqrt(npix // 12)
    if nside == 0 or 12 * nside**2 != npix:
        msg = f"the last axis has {npix} pixels but must have 12 nside**2; give whole-sky maps."
        raise ShapeError(msg)
    return nside


def pixel_directions(nside: int) -> tuple[FloatArray, FloatArray]:
    """Return the colatitude and the longitude of every pixel centre, in RING order.

    Parameters
    ----------
    nside : int
        HEALPix resolution.

    Returns
    -------
    colatitudes, longitudes : ndarray, shape (12 * nside**2,), float64
        Radians.

    Raises
    ------
    ParameterError
        If ``nside`` is not a HEALPix resolution.

    Examples
    --------
    >>> colatitudes, longitudes = pixel_directions(1)
    >>> bool(np.allclose(np.cos(colatitudes[[0, 4, 8]]), [2 / 3, 0, -2 / 3]))
    True
    """
    rings = HealpixRings(check_nside(nside))
    along = np.arange(rings.n_pixels) - np.repeat(rings.starts, rings.n_phi)
    steps = np.repeat(2 * np.pi / rings.n_phi, rings.n_phi)
    longitudes = np.repeat(rings.first_longitudes, rings.n_phi) + along * steps
    return np.repeat(rings.colatitudes, rings.n_phi), longitudes


def pixel_at(nside: int, colatitudes: ArrayLike, longitudes: ArrayLike) -> NDArray[np.int64]:
    """Return the pixels that hold given points; `pixel_directions` has the pixels' centres.

    Parameters
    ----------
    nside : int
        HEALPix resolution.
    colatitudes, longitudes : array_like
        Radians; they broadcast together.

    Returns
    -------
    ndarray, int64
        Pixel numbers in RING order, of the broadcast shape.

    Raises
    ------
    ParameterError
        If ``nside`` is not a HEALPix resolution.

    Examples
    --------
    >>> pixel_at(1, [0.1, 3.1], [0.2, 0.2]).tolist()
    [0, 8]
    """
    import healpy

    pixels: NDArray[np.int64] = healpy.ang2pix(check_nside(nside), colatitudes, longitudes)
    return pixels


def nested_to_ring(maps: ArrayLike) -> NDArray[Any]:
    """Reorder maps from NESTED to RING; the inverse is `ring_to_nested`.

    Parameters
    ----------
    maps : array_like, shape (..., npix)
        Whole-sky maps of any dtype, NESTED order.

    Returns
    -------
    ndarray, shape (..., npix)
        The same values in RING order, same dtype.

    Raises
    ------
    ShapeError
        If the number of pixels is not ``12 nside**2``.
    ParameterError
        If nside is not a power of two.

    Examples
    --------
    >>> nested_to_ring(np.arange(48))[:4].tolist()
    [3, 7, 11, 15]
    """
    import healpy

    values = np.asarray(maps)
    nside = check_nside(nside_of(values), nested=True)
    # int64 throughout: 32-bit pixel numbers overflow above nside 8192.
    pixels = np.arange(values.shape[-1], dtype=np.int64)
    reordered: NDArray[Any] = values[..., healpy.ring2nest(nside, pixels)]
    return reordered


def ring_to_nested(maps: ArrayLike) -> NDArray[Any]:
    """Reorder maps from RING to NESTED; the inverse is `nested_to_ring`.

    Parameters
    ----------
    maps : array_like, shape (..., npix)
        Whole-sky maps of any dtype, RING order.

    Returns
    -------
    ndarray, shape (..., npix)
        The same values in NESTED order, same dtype.

    Raises
    ------
    ShapeError
        If the number of pixels is not ``12 nside**2``.
    ParameterError
        If nside is not a power of two.

    Examples
    --------
    >>> bool(np.all(nested_to_ring(ring_to_nested(np.arange(48))) == np.arange(48)))
    True
    """
    import healpy

    values = np.asarray(maps)
    nside = check_nside(nside_of(values), nested=True)
    pixels = np.arange(values.shape[-1], dtype=np.int64)
    reordered: NDArray[Any] = values[..., healpy.nest2ring(nside, pixels)]
    return reordered


def degrade_map(maps: ArrayLike, nside: int) -> FloatArray:
    """Average maps over the pixels of a coarser resolution.

    Every pixel counts alike: bad pixels must be dealt with before.

    Parameters
    ----------
    maps : array_like, shape (..., npix), real
        Whole-sky maps, RING order.
    nside : int
        The resolution wanted, at most that of the maps; both powers of two.

    Returns
    -------
    ndarray, shape (..., 12 * nside**2), float64
        Means of the ``(nside_of(maps) / nside)**2`` pixels in each coarse pixel, RING order.

    Raises
    ------
    ParameterError
        If ``nside`` is finer than the maps, or either resolution is no power of two.

    Examples
    --------
    >>> float(degrade_map(np.arange(48), 1).sum())
    282.0
    """
    fine = ring_to_nested(np.asarray(maps, dtype=np.float64))
    if check_nside(nside, nested=True) > nside_of(fine):
        msg = f"nside={nside} must not exceed the map's nside={nside_of(fine)}; use upgrade_map."
        raise ParameterError(msg)
    # In NESTED order the children of one coarse pixel are neighbours in memory.
    children = fine.reshape(*fine.shape[:-1], 12 * nside**2, -1)
    return nested_to_ring(children.mean(axis=-1))


def upgrade_map(maps: ArrayLike, nside: int) -> NDArray[Any]:
    """Repeat the value of each pixel on the pixels of a finer resolution.

    Parameters
    ----------
    maps : array_like, shape (..., npix)
        Whole-sky maps, RING order.
    nside : int
        The resolution wanted, at least that of the maps; both powers of two.

    Returns
    -------
    ndarray, shape (..., 12 * nside**2)
        RING order, same dtype; `degrade_map` takes it back.

    Raises
    ------
    ParameterError
        If ``nside`` is coarser than the maps, or either resolution is no power of two.

    Examples
    --------
    >>> bool(np.all(degrade_map(upgrade_map(np.arange(12), 4), 1) == np.arange(12)))
    True
    """
    coarse = ring_to_nested(maps)
    if check_nside(nside, nested=True) < nside_of(coarse):
        msg = f"nside={nside} must reach the map's nside={nside_of(coarse)}; use degrade_map."
        raise ParameterError(msg)
    return nested_to_ring(np.repeat(coarse, (nside // nside_of(coarse)) ** 2, axis=-1))
