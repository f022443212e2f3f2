"""Masks: cuts, distances to the edge, smooth tapers, changes of resolution.

A mask is an array of weights in [0, 1]: 1 where the sky is observed, 0 where it is not.  HEALPix
masks are whole-sky, RING order, shape (12 * nside**2,); `cap_mask` serves any set of points.
All angles are radians.

The default taper has every derivative continuous: beyond l of about 60 / width (in radians) the
power of a tapered cap is below that of the others, and it keeps falling faster.  A narrow taper at
lower degrees has less power with "C1".
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import ParameterError
from spinsdw.healpix import check_mask, degrade_map, nside_of, pixel_directions, upgrade_map

__all__ = [
    "apodise",
    "cap_mask",
    "check_mask",
    "degrade",
    "distance_to_edge",
    "fill_holes",
    "galactic_cut",
    "sky_fraction",
    "taper",
    "upgrade",
]

FloatArray: TypeAlias = NDArray[np.float64]


def galactic_cut(nside: int, latitude: float) -> FloatArray:
    """Mask the band of latitudes around the equator.

    Parameters
    ----------
    nside : int
        HEALPix resolution.
    latitude : float
        Pixels whose centre is nearer to the equator than this are masked; radians in [0, pi/2).

    Returns
    -------
    ndarray, shape (12 * nside**2,), float64
        1 or 0, RING order.

    Raises
    ------
    ParameterError
        If the latitude is out of range or would mask every pixel.

    Examples
    --------
    >>> round(sky_fraction(galactic_cut(16, np.radians(30))), 2)
    0.5
    """
    if not 0 <= latitude < math.pi / 2:
        msg = f"latitude={latitude} must be in [0, pi/2) radians; np.radians(20) is a usual cut."
        raise ParameterError(msg)
    colatitudes, _ = pixel_directions(nside)
    kept = np.abs(np.pi / 2 - colatitudes) >= latitude
    if not kept.any():
        msg = f"latitude={latitude} must leave a pixel of nside={nside}; take a smaller latitude."
        raise ParameterError(msg)
    return kept.astype(np.float64)


def cap_mask(
    colatitudes: ArrayLike,
    longitudes: ArrayLike,
    *,
    centre: tuple[float, float],
    radius: float,
    taper_width: float = 0.0,
) -> FloatArray:
    """Observe a cap, with a C-infinity taper on the inside of its edge.

    The weight is `taper` of (radius - distance) / taper_width: 1 up to ``radius - taper_width``
    from the centre, 0 from ``radius`` on.

    Parameters
    ----------
    colatitudes, longitudes : array_like
        Points in radians; they broadcast together.  A grid takes ``colatitudes[:, None]`` and
        ``longitudes``, a HEALPix map `spinsdw.healpix.pixel_directions`.
    centre : tuple of float
        Colatitude and longitude of the centre, radians.
    radius : float
        Radius of the cap, radians in (0, pi].
    taper_width : float
        Width of the taper, radians in [0, radius]; 0 is a sharp edge.

    Returns
    -------
    ndarray, float64
        Weights in [0, 1], of the broadcast shape.

    Raises
    ------
    ParameterError
        If the radius or the width is out of range.

    Examples
    --------
    >>> cap_mask(np.array([0.0, 0.35, 0.5]), 0.0, centre=(0, 0), radius=0.4, taper_width=0.1)
    array([1. , 0.5, 0. ])
    """
    if not 0 < radius <= math.pi:
        msg = f"radius={radius} must be in (0, pi] radians; np.radians(20) is a cap of 20 degrees."
        raise ParameterError(msg)
    if not 0 <= taper_width <= radius:
        msg = f"taper_width={taper_width} must be from 0 to radius={radius}; narrow the taper."
        raise ParameterError(msg)
    depth = radius - _distance(np.asarray(colatitudes), np.asarray(longitudes), centre)
    if taper_width == 0:
        return np.asarray(depth > 0, dtype=np.float64)
    return taper(depth / taper_width)


def _distance(
    colatitudes: NDArray[np.floating], longitudes: NDArray[np.floating], centre: tuple[float, float]
) -> FloatArray:
    """Return the angles to ``centre`` (haversine formula, accurate for small angles)."""
    across = np.sin((longitudes - centre[1]) / 2) ** 2
    along = np.sin((colatitudes - centre[0]) / 2) ** 2
    haversine = along + np.sin(colatitudes) * math.sin(centre[0]) * across
    angles: FloatArray = 2 * np.arcsin(np.sqrt(np.clip(haversine, 0, 1)))
    return angles


def _vectors(colatitudes: FloatArray, longitudes: FloatArray) -> FloatArray:
    """Return unit vectors, shape (points, 3)."""
    sines = np.sin(colatitudes)
    parts = [sines * np.cos(longitudes), sines * np.sin(longitudes), np.cos(colatitudes)]
    return np.stack(parts, axis=-1)


def distance_to_edge(mask: ArrayLike) -> FloatArray:
    """Return the angle from each observed pixel to the nearest masked pixel.

    Distances are between pixel centres.

    Parameters
    ----------
    mask : array_like, shape (12 * nside**2,)
        RING order; masked means zero.

    Returns
    -------
    ndarray, shape (12 * nside**2,), float64
        Radians; 0 at masked pixels, infinity everywhere if no pixel is masked.

    Raises
    ------
    ShapeError, DataError
        If the array is no whole-sky mask with values in [0, 1].

    Examples
    --------
    >>> distances = distance_to_edge(galactic_cut(16, np.radians(30)))
    >>> bool(abs(distances.max() - np.radians(60)) < np.radians(3))
    True
    """
    return _bounded_distance(_checked(mask), math.pi)


def _bounded_distance(weights: FloatArray, bound: float) -> FloatArray:
    """Return the distance to the nearest masked pixel, or infinity beyond ``bound``."""
    from scipy.spatial import cKDTree

    masked = weights == 0
    distances = np.where(masked, 0.0, np.inf)
    if not masked.any():
        return distances
    vectors = _vectors(*pixel_directions(nside_of(weights)))
    edge = vectors[masked][_is_at_edge(vectors, masked)]
    chords, _ = cKDTree(edge).query(vectors[~masked], distance_upper_bound=_chord(bound))
    angles = 2 * np.arcsin(np.minimum(chords / 2, 1))
    distances[~masked] = np.where(np.isfinite(chords), angles, np.inf)
    return distances


def _is_at_edge(vectors: FloatArray, masked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which masked pixels can be the nearest one to an observed pixel.

    Let c be nearest to x, and r just above the largest distance of a point from its pixel's
    centre.  The point at distance r from c on the way to x lies in a pixel whose centre is nearer
    to x than c, so is observed, and is less than 2 r from c.
    """
    import healpy
    from scipy.spatial import cKDTree

    reach = 2.01 * healpy.max_pixrad(math.isqrt(len(vectors) // 12))
    observed = cKDTree(vectors[~masked])
    chords, _ = observed.query(vectors[masked], distance_upper_bound=_chord(reach))
    near: NDArray[np.bool_] = np.isfinite(chords)
    return near


def _chord(angle: float) -> float:
    """Return a chord that spans a little more than ``angle`` on the unit sphere."""
    return 2.001 * math.sin(min(angle, math.pi) / 2)


def _checked(mask: ArrayLike) -> FloatArray:
    """Return a whole-sky HEALPix mask as checked float64 weights."""
    return check_mask(mask, (12 * nside_of(mask) ** 2,))


def taper(depth: ArrayLike) -> FloatArray:
    r"""Rise from 0 at ``depth <= 0`` to 1 at ``depth >= 1`` with every derivative continuous.

    .. math:: t(x) = \frac{e^{-1/x}}{e^{-1/x} + e^{-1/(1-x)}},  \qquad  t(x) + t(1 - x) = 1.

    The high-degree coefficients of a cap tapered so are as small as with the integral of the
    squared bump that shapes the wavelets, and no quadrature is needed.

    Parameters
    ----------
    depth : array_like
        Distance from the edge in units of the taper's width.

    Returns
    -------
    ndarray, float64
        Weights in [0, 1], same shape.

    Examples
    --------
    >>> taper([-1.0, 0.5, 2.0])
    array([0. , 0.5, 1. ])
    """
    # Adding 0.0 turns -0.0 into 0.0: 1 / -0.0 would be the wrong infinity.
    x = np.clip(np.asarray(depth, dtype=np.float64), 0, 1) + 0.0
    with np.errstate(divide="ignore", over="ignore"):
        # Minus infinity at x = 0 and infinity at 1, where tanh takes its limits.
        steepness = 1 / (1 - x) - 1 / x
    weights: FloatArray = (1 + np.tanh(steepness / 2)) / 2
    return weights


PROFILES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "smooth": taper,
    "C1": lambda x: x - np.sin(2 * np.pi * x) / (2 * np.pi),
    "C2": lambda x: (1 - np.cos(np.pi * x)) / 2,
}


def apodise(mask: ArrayLike, width: float, *, profile: str = "smooth") -> FloatArray:
    r"""Taper a mask inwards from its edge.

    The mask is multiplied by f(x), where :math:`x^2 = (1 - \cos d)/(1 - \cos w)` with d the
    distance to the nearest masked pixel and w the width, and f = 1 from x = 1 on:

    ========  ==================================  ==========================================
    profile   f(x) for 0 <= x <= 1                also called
    ========  ==================================  ==========================================
    smooth    `taper`, in closed form             all derivatives are continuous
    C1        x - sin(2 pi x) / (2 pi)            "C1" in NaMaster, C2 in Grain et al. 2009
    C2        (1 - cos(pi x)) / 2                 "C2" in NaMaster, C1 in Grain et al. 2009
    ========  ==================================  ==========================================

    NaMaster's "Smooth", a Gaussian smoothing of a shrunken mask, is another thing.  Distances are
    those to pixel centres, so the taper follows the steps of a pixelised edge; where the edge is a
    circle, `cap_mask` is free of them.

    Parameters
    ----------
    mask : array_like, shape (12 * nside**2,)
        RING order; the edge lies where it reaches zero.
    width : float
        Width of the taper, radians in (0, pi].
    profile : {"smooth", "C1", "C2"}
        The shape of the taper.

    Returns
    -------
    ndarray, shape (12 * nside**2,), float64
        Weights in [0, 1]; a mask without masked pixels comes back as it is.

    Raises
    ------
    ParameterError
        If the width or the profile is not valid.
    ShapeError, DataError
        If the array is no whole-sky mask with values in [0, 1].

    Examples
    --------
    >>> cut = galactic_cut(16, np.radians(20))
    >>> sky_fraction(apodise(cut, np.radians(10))) < sky_fraction(cut)
    True
    """
    if profile not in PROFILES:
        msg = f"profile={profile!r} must be one of {', '.join(PROFILES)}; 'smooth' is the default."
        raise ParameterError(msg)
    if not 0 < width <= math.pi:
        msg = f"width={width} must be in (0, pi] radians; np.radians(5) is a taper of 5 degrees."
        raise ParameterError(msg)
    weights = _checked(mask)
    distances = np.minimum(_bounded_distance(weights, width), width)
    return weights * PROFILES[profile](np.sin(distances / 2) / math.sin(width / 2))


def fill_holes(mask: ArrayLike, largest: float) -> FloatArray:
    """Observe again what a mask hides in small holes, such as those at point sources.

    A hole is a set of neighbouring pixels of weight 0.  For a signal that point sources do not
    touch, such as diffuse synchrotron, this leaves the galactic part of an analysis mask.

    Parameters
    ----------
    mask : array_like, shape (npix,)
        RING order; nside a power of two.
    largest : float
        Solid angle in steradians; holes of at most this size are filled.

    Returns
    -------
    ndarray, shape (npix,), float64
        RING order, 1 where a hole was filled.

    Raises
    ------
    ParameterError
        If ``largest`` is not positive.

    Examples
    --------
    >>> mask = galactic_cut(16, np.radians(20))
    >>> mask[0] = 0
    >>> bool(np.array_equal(fill_holes(mask, 0.01), galactic_cut(16, np.radians(20))))
    True
    """
    import healpy
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not 0 < largest < np.inf:
        msg = f"largest={largest} must be a solid angle above 0; np.radians(5) ** 2 is 25 deg^2."
        raise ParameterError(msg)
    weights = _checked(mask)
    hidden = np.flatnonzero(weights == 0)
    place = np.full(weights.size, -1)
    place[hidden] = np.arange(hidden.size)
    neighbours = healpy.get_all_neighbours(nside_of(weights), hidden)
    rows = np.broadcast_to(np.arange(hidden.size), neighbours.shape)
    # healpy says -1 for a neighbour that does not exist.
    joined = (neighbours >= 0) & (place[neighbours] >= 0)
    links = (np.ones(np.count_nonzero(joined)), (rows[joined], place[neighbours[joined]]))
    count, label = connected_components(coo_array(links, shape=(hidden.size, hidden.size)))
    size = np.bincount(label, minlength=count) * (4 * np.pi / weights.size)
    weights[hidden[size[label] <= largest]] = 1.0
    return weights


def upgrade(mask: ArrayLike, nside: int) -> FloatArray:
    """Give each pixel's weight to the pixels of a finer resolution.

    Parameters
    ----------
    mask : array_like, shape (npix,)
        RING order.
    nside : int
        The resolution wanted, at least that of the mask; both powers of two.

    Returns
    -------
    ndarray, shape (12 * nside**2,), float64
        RING order.

    Raises
    ------
    ParameterError
        If ``nside`` is coarser than the mask, or either resolution is no power of two.
    ShapeError, DataError
        If the array is no whole-sky mask with values in [0, 1].

    Examples
    --------
    >>> upgrade(galactic_cut(4, 0.5), 8).size
    768
    """
    return upgrade_map(_checked(mask), nside)


def degrade(mask: ArrayLike, nside: int, *, threshold: float | None = 0.5) -> FloatArray:
    """Bring a mask to a coarser resolution.

    Parameters
    ----------
    mask : array_like, shape (npix,)
        RING order.
    nside : int
        The resolution wanted, at most that of the mask; both powers of two.
    threshold : float in (0, 1], optional
        A coarse pixel is 1 if the mean weight of its parts reaches the threshold, else 0; 1 keeps
        only fully observed pixels.  None returns the mean weights themselves.

    Returns
    -------
    ndarray, shape (12 * nside**2,), float64
        RING order.

    Raises
    ------
    ParameterError
        If the threshold is out of range, ``nside`` is finer than the mask, or either resolution
        is no power of two.
    ShapeError, DataError
        If the array is no whole-sky mask with values in [0, 1], or nothing reaches the threshold.

    Examples
    --------
    >>> mask = galactic_cut(8, 0.5)
    >>> bool(degrade(mask, 4, threshold=1).sum() <= degrade(mask, 4).sum())
    True
    """
    if threshold is not None and not 0 < threshold <= 1:
        msg = f"threshold={threshold} must be in (0, 1]; 1 keeps fully observed pixels only."
        raise ParameterError(msg)
    means = degrade_map(_checked(mask), nside)
    if threshold is None:
        return means
    return check_mask(means >= threshold, means.shape)


def sky_fraction(mask: ArrayLike) -> float:
    """Return the mean weight of a HEALPix mask, whose pixels have equal areas.

    Parameters
    ----------
    mask : array_like, shape (12 * nside**2,)
        Any order.

    Returns
    -------
    float
        In (0, 1].

    Raises
    ------
    ShapeError, DataError
        If the array is no whole-sky mask with values in [0, 1].

    Examples
    --------
    >>> sky_fraction(np.ones(48))
    1.0
    """
    return float(_checked(mask).mean())
