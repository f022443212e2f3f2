"""Footprints: the shapes of surveys, evaluated at any set of points.

A footprint is an array of weights: 1 where the sky is observed, 0 where it is not.  Every function
takes the colatitudes and longitudes of points, which broadcast together: a grid gives
``colatitudes[:, None]`` and ``longitudes``, a HEALPix map `spinsdw.healpix.pixel_directions`.
Footprints multiply: a survey with holes is the product of its outline and of `disc_holes`.
All angles are radians, and all edges are sharp; `spinsdw.masks` tapers them, and has `cap_mask`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import check_integer

__all__ = ["disc_holes", "random_discs", "rectangle_mask", "wavy_cut"]

FloatArray = NDArray[np.float64]


def _points(colatitudes: ArrayLike, longitudes: ArrayLike) -> tuple[FloatArray, FloatArray]:
    return np.asarray(colatitudes, dtype=np.float64), np.asarray(longitudes, dtype=np.float64)


def rectangle_mask(
    colatitudes: ArrayLike,
    longitudes: ArrayLike,
    *,
    longitude: tuple[float, float],
    latitude: tuple[float, float],
) -> FloatArray:
    """Observe a rectangle in longitude and latitude, with sharp corners.

    Parameters
    ----------
    colatitudes, longitudes : array_like
        Points in radians; they broadcast together.
    longitude : tuple of float
        From where to where, eastwards, radians; the second may pass 2 pi and is above the first,
        by 2 pi at most.
    latitude : tuple of float
        From where to where, radians from the equator, rising, in [-pi/2, pi/2].

    Returns
    -------
    ndarray, float64
        1 or 0, of the broadcast shape; points on the southern and western edge are inside.

    Raises
    ------
    ParameterError
        If a pair does not rise, or a latitude is beyond a pole.

    Examples
    --------
    >>> points = np.array([1.4, 1.4, 1.8]), np.array([0.1, 6.2, 0.1])
    >>> rectangle_mask(*points, longitude=(-0.2, 0.2), latitude=(0.0, 0.5))
    array([1., 1., 0.])
    """
    west, east = longitude
    south, north = latitude
    if not 0 < east - west <= 2 * math.pi:
        msg = f"longitude={longitude} must rise by at most 2 pi; give west first, then east."
        raise ParameterError(msg)
    if not -math.pi / 2 <= south < north <= math.pi / 2:
        msg = f"latitude={latitude} must rise within [-pi/2, pi/2]; give south first, then north."
        raise ParameterError(msg)
    theta, phi = _points(colatitudes, longitudes)
    height = math.pi / 2 - theta
    across = np.mod(phi - west, 2 * math.pi) < east - west
    return np.asarray(across & (south <= height) & (height < north), dtype=np.float64)


def wavy_cut(
    colatitudes: ArrayLike,
    longitudes: ArrayLike,
    *,
    latitude: float,
    amplitude: float,
    seed: int,
) -> FloatArray:
    r"""Mask a band around the equator whose edges wave, as the edge of a galactic mask does.

    The edge of each hemisphere lies at the latitude
    :math:`b + a \sum_{k=2}^{9} c_k \cos(k \phi + \phi_k)` with random phases and
    :math:`c_k \propto 1/k`, :math:`\sum_k c_k = 1`.

    Parameters
    ----------
    colatitudes, longitudes : array_like
        Points in radians; they broadcast together.
    latitude : float
        b, the mean latitude of the edge, radians.
    amplitude : float
        a, the farthest the edge may be from its mean, radians, at least 0;
        ``amplitude <= latitude`` and their sum is below pi/2.
    seed : int
        Sets the phases, each hemisphere its own.

    Returns
    -------
    ndarray, float64
        1 or 0, of the broadcast shape.

    Raises
    ------
    ParameterError
        If the edge could cross the equator or reach a pole, or the seed is negative.

    Examples
    --------
    >>> wavy_cut([0.0, 1.5, 3.1], 0.0, latitude=0.35, amplitude=0.05, seed=1)
    array([1., 0., 1.])
    """
    if not (0 <= amplitude <= latitude and latitude + amplitude < math.pi / 2):
        msg = (
            f"amplitude={amplitude} must be from 0 to latitude={latitude} and their sum below "
            "pi/2; np.radians(3) about np.radians(20) is a galactic mask's."
        )
        raise ParameterError(msg)
    seed = check_integer(seed, "seed", minimum=0)
    theta, phi = _points(colatitudes, longitudes)
    waves = np.arange(2, 10)
    shares = (1 / waves) / np.sum(1 / waves)
    phases = np.random.default_rng(seed).uniform(0, 2 * math.pi, (2, waves.size))
    north, south = (
        latitude
        + amplitude
        * sum(c * np.cos(k * phi + p) for c, k, p in zip(shares, waves, row, strict=True))
        for row in phases
    )
    height = math.pi / 2 - theta
    return np.asarray((height >= north) | (height <= -south), dtype=np.float64)


def random_discs(
    count: int, radii: tuple[float, float], *, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Draw discs at random over the whole sphere, for instance holes at bright sources.

    Parameters
    ----------
    count : int
        How many, at least 0.
    radii : tuple of float
        The smallest and the largest radius, radians; radii are uniform between them.
    seed : int
        The same seed gives the same discs; a larger count adds discs and keeps the rest.

    Returns
    -------
    centres : ndarray, shape (count, 2), float64
        Colatitude and longitude of each disc, uniform over the sphere.
    radii : ndarray, shape (count,), float64
        Radius of each disc.

    Raises
    ------
    ParameterError
        If the count or the seed is negative, or the radii do not rise within (0, pi].

    Examples
    --------
    >>> centres, radii = random_discs(100, (0.01, 0.02), seed=1)
    >>> centres.shape, bool(radii.min() >= 0.01), bool(radii.max() <= 0.02)
    ((100, 2), True, True)
    """
    count = check_integer(count, "count", minimum=0)
    seed = check_integer(seed, "seed", minimum=0)
    least, largest = radii
    if not 0 < least <= largest <= math.pi:
        msg = f"radii={radii} must rise within (0, pi]; np.radians([0.5, 1]) are usual holes."
        raise ParameterError(msg)
    draws = np.random.default_rng(seed).uniform(size=(count, 3))
    centres = np.stack([np.arccos(1 - 2 * draws[:, 0]), 2 * math.pi * draws[:, 1]], axis=1)
    return centres, least + (largest - least) * draws[:, 2]


def disc_holes(
    colatitudes: ArrayLike, longitudes: ArrayLike, centres: ArrayLike, radii: ArrayLike
) -> FloatArray:
    """Mask discs: 0 nearer to a centre than its radius, 1 elsewhere.

    Parameters
    ----------
    colatitudes, longitudes : array_like
        Points in radians; they broadcast together.
    centres : array_like, shape (count, 2)
        Colatitude and longitude of each centre, radians.
    radii : array_like, shape (count,) or a number
        Radius of each disc, radians in (0, pi].

    Returns
    -------
    ndarray, float64
        1 or 0, of the broadcast shape.

    Raises
    ------
    ShapeError
        If the centres are not pairs.
    DataError
        If a centre or radius is not finite, or a radius outside (0, pi].

    Examples
    --------
    >>> disc_holes([0.0, 0.3, 1.0], 0.0, [[0.25, 0.0]], 0.1)
    array([1., 0., 1.])
    """
    places = np.asarray(centres, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 2:
        msg = f"centres has shape {places.shape}; it must hold a colatitude and longitude per disc."
        raise ShapeError(msg)
    sizes = np.broadcast_to(np.asarray(radii, dtype=np.float64), places.shape[:1])
    if not (np.isfinite(places).all() and np.all((sizes > 0) & (sizes <= math.pi))):
        msg = "centres or radii hold values that are not finite or radii outside (0, pi]."
        raise DataError(msg)
    theta, phi = np.broadcast_arrays(*_points(colatitudes, longitudes))
    kept = np.ones(theta.shape, dtype=bool)
    for (centre, longitude), radius in zip(places, sizes, strict=True):
        near = np.nonzero(np.abs(theta - centre) < radius)
        # Half the squared chord, from half angles: accurate for small discs.
        versine = np.sin((theta[near] - centre) / 2) ** 2
        versine += np.sin(theta[near]) * math.sin(centre) * np.sin((phi[near] - longitude) / 2) ** 2
        kept[near] &= versine >= math.sin(radius / 2) ** 2
    return kept.astype(np.float64)
