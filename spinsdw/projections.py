"""Where the points of a flat picture lie on the sphere, and maps read off there.

North is up and east is to the left, as on sky maps.

===============  =============================================================================
projection       distance from the centre at the angle a, or the plane coordinates
===============  =============================================================================
mollweide        x = 2 (phi / pi) cos t, y = sin t, 2 t + sin 2 t = pi sin(latitude)
sinusoidal       x = phi cos(latitude), y = latitude
mercator         x = phi, y = log tan(pi / 4 + latitude / 2)
orthographic     sin a
stereographic    2 tan(a / 2)
gnomonic         tan a
equal_area       2 sin(a / 2)
===============  =============================================================================
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import check_integer
from spinsdw.healpix import nside_of
from spinsdw.sampling import MW, MWSS, Sampling

__all__ = ["Projection", "Raster", "grid_of", "project_map"]

FloatArray = NDArray[np.float64]
Array = NDArray[Any]
Plane = tuple[FloatArray, FloatArray]


def _mollweide(x: FloatArray, y: FloatArray) -> Plane:
    auxiliary = np.arcsin(y)
    latitudes = np.arcsin((2 * auxiliary + np.sin(2 * auxiliary)) / np.pi)
    return latitudes, np.pi * x / (2 * np.cos(auxiliary))


def _sinusoidal(x: FloatArray, y: FloatArray) -> Plane:
    return y, x / np.cos(y)


def _mercator(x: FloatArray, y: FloatArray) -> Plane:
    return 2 * np.arctan(np.exp(y)) - np.pi / 2, x


# Latitude and longitude, eastwards to the right, from the plane.
_WHOLE: dict[str, Callable[[FloatArray, FloatArray], Plane]] = {
    "mollweide": _mollweide,
    "sinusoidal": _sinusoidal,
    "mercator": _mercator,
}
# Distance in the plane from the angle to the centre, and back.
_AROUND: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "orthographic": (np.sin, np.arcsin),
    "stereographic": (lambda a: 2 * np.tan(a / 2), lambda r: 2 * np.arctan(r / 2)),
    "gnomonic": (np.tan, np.arctan),
    "equal_area": (lambda a: 2 * np.sin(a / 2), lambda r: 2 * np.arcsin(r / 2)),
}
# The usual edge and the largest: the angle to the centre, or of Mercator's the latitude.
_EDGES = {
    "mollweide": (np.pi / 2, np.pi / 2),
    "sinusoidal": (np.pi / 2, np.pi / 2),
    "mercator": (np.radians(80), np.radians(89.9)),
    "orthographic": (np.pi / 2, np.pi / 2),
    "stereographic": (np.pi / 2, np.radians(179)),
    "gnomonic": (np.radians(45), np.radians(89)),
    "equal_area": (np.pi, np.pi),
}


@dataclass(frozen=True, eq=False)
class Raster:
    """Directions of the points of a picture, nan outside its edge; row 0 is the top.

    Attributes
    ----------
    colatitudes, longitudes : ndarray, shape (rows, columns)
        Radians.
    angles : ndarray, shape (rows, columns)
        By how much the picture's frame at each point, x down and y to the left at the centre, is
        turned from south towards east (eq-frame).
    """

    colatitudes: FloatArray
    longitudes: FloatArray
    angles: FloatArray

    def picture(self, values: Array, sampling: Sampling | None = None) -> Array:
        """Return the value nearest to each point, nan outside."""
        inside = np.isfinite(self.colatitudes)
        colatitudes, longitudes = self.colatitudes[inside], self.longitudes[inside]
        picture = np.full(inside.shape, np.nan, dtype=np.result_type(values, np.float64))
        if values.ndim == 1:
            picture[inside] = _nearest_pixels(values, colatitudes, longitudes)
        else:
            grid = grid_of(values.shape) if sampling is None else sampling
            picture[inside] = _nearest_samples(values, grid, colatitudes, longitudes)
        return picture


@dataclass(frozen=True)
class Projection:
    """A flat picture of the sphere, or of a part of it.

    Parameters
    ----------
    name : str
        "mollweide", "sinusoidal" or "mercator", of the whole sky; "orthographic", "stereographic",
        "gnomonic" or "equal_area", of what lies around the centre.
    centre : pair of float
        Colatitude and longitude of the middle, radians. Pictures of the whole sky have the equator
        in the middle.
    radius : float, optional
        Angle from the centre to the edge, or Mercator's largest latitude, radians.
    rows : int
        Height of the picture in points.

    Raises
    ------
    ParameterError
        If the name is not known, the centre no direction or off the equator for a picture of the
        whole sky, the radius too large, or ``rows`` not positive.

    Examples
    --------
    >>> projection = Projection("gnomonic", centre=(0.5, 1.0), radius=0.2, rows=5)
    >>> projection.raster.colatitudes.shape, float(projection.raster.longitudes[2, 2])
    ((5, 5), 1.0)
    """

    name: str = "mollweide"
    centre: tuple[float, float] = (np.pi / 2, 0.0)
    radius: float | None = None
    rows: int = 600

    def __post_init__(self) -> None:
        if self.name not in _EDGES:
            msg = f"name={self.name!r} must be a projection, one of {sorted(_EDGES)}."
            raise ParameterError(msg)
        self._check_centre()
        usual, largest = _EDGES[self.name]
        radius = usual if self.radius is None else self.radius
        number = np.asarray(radius)
        if number.ndim or number.dtype.kind not in "iuf" or not 0 < number <= largest + 1e-12:
            msg = f"radius={radius!r} must be above 0 and at most {largest:.4g} for {self.name}."
            raise ParameterError(msg)
        object.__setattr__(self, "radius", float(number))
        check_integer(self.rows, "rows", minimum=1, remedy="600 fill a page")

    def _check_centre(self) -> None:
        values = np.asarray(self.centre, dtype=np.float64)
        if values.shape != (2,) or not np.isfinite(values).all() or not 0 <= values[0] <= np.pi:
            msg = f"centre={self.centre!r} must be a colatitude from 0 to pi and a longitude."
            raise ParameterError(msg)
        if self.is_whole and abs(values[0] - np.pi / 2) > 1e-12:
            msg = f"centre={self.centre!r} must lie on the equator for {self.name}; rotate the map."
            raise ParameterError(msg)
        object.__setattr__(self, "centre", (float(values[0]), float(values[1])))

    @property
    def is_whole(self) -> bool:
        """Whether the picture is of the whole sky."""
        return self.name in _WHOLE

    @property
    def half_size(self) -> tuple[float, float]:
        """Half the width and half the height of the picture in the plane."""
        if not self.is_whole:
            edge = float(_AROUND[self.name][0](self.radius))
            return edge, edge
        heights = {"mollweide": 1.0, "sinusoidal": np.pi / 2}
        top = math.log(math.tan(math.pi / 4 + float(self.radius or 0) / 2))
        return (
            2.0 if self.name == "mollweide" else np.pi,
            float(heights.get(self.name, top)),
        )

    @cached_property
    def raster(self) -> Raster:
        """The directions of the picture's points, shape (rows, columns)."""
        width, height = self.half_size
        columns = max(1, round(self.rows * width / height))
        y = height * (1 - (2 * np.arange(self.rows) + 1) / self.rows)[:, None]
        x = width * ((2 * np.arange(columns) + 1) / columns - 1)[None, :]
        return self._whole(x, y) if self.is_whole else self._around(x, y)

    def _whole(self, x: FloatArray, y: FloatArray) -> Raster:
        latitudes, longitudes = np.broadcast_arrays(*_WHOLE[self.name](x, y))
        inside = np.abs(longitudes) <= np.pi
        # Minus, because east is to the left.
        places = (self.centre[1] - longitudes) % (2 * np.pi)
        colatitudes = np.where(inside, np.pi / 2 - latitudes, np.nan)
        return Raster(colatitudes, np.where(inside, places, np.nan), np.zeros(inside.shape))

    def _around(self, x: FloatArray, y: FloatArray) -> Raster:
        centre, south, east = _frame(*self.centre)
        distance = np.hypot(x, y)
        edge = self.half_size[0]
        inside = distance <= edge
        angle = _AROUND[self.name][1](np.where(inside, distance, 0.0))
        # Of the direction in which a point lies: up is north, left is east.
        ratio = np.sin(angle) / np.where(distance > 0, distance, 1.0)
        along = -y[..., None] * south - x[..., None] * east
        vectors = np.cos(angle)[..., None] * centre + ratio[..., None] * along
        colatitudes = np.arctan2(np.hypot(vectors[..., 0], vectors[..., 1]), vectors[..., 2])
        longitudes = np.arctan2(vectors[..., 1], vectors[..., 0]) % (2 * np.pi)
        angles = _transport_angles(vectors, centre, south, (colatitudes, longitudes))
        hidden = [np.where(inside, part, np.nan) for part in (colatitudes, longitudes, angles)]
        return Raster(*hidden)


def _frame(colatitude: Any, longitude: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit vectors outwards, to the south and to the east, the last axis x, y, z."""
    sin_t, cos_t = np.sin(colatitude), np.cos(colatitude)
    sin_p, cos_p = np.sin(longitude), np.cos(longitude)
    out = np.stack([sin_t * cos_p, sin_t * sin_p, cos_t], axis=-1)
    south = np.stack([cos_t * cos_p, cos_t * sin_p, -sin_t], axis=-1)
    east = np.stack([-sin_p, cos_p, np.zeros_like(cos_p)], axis=-1)
    return out, south, east


def _transport_angles(
    vectors: FloatArray, centre: FloatArray, south: FloatArray, places: Plane
) -> FloatArray:
    """Return the angle from the local south to the centre's, carried along the great circle."""
    _, local_south, local_east = _frame(*places)
    along = vectors @ south
    # v - (v . p) / (1 + c . p) (c + p): the rotation that takes c to p. The antipode has none.
    factor = along / np.maximum(1 + vectors @ centre, np.finfo(float).tiny)
    carried = south - factor[..., None] * (centre + vectors)
    towards_east = np.sum(carried * local_east, axis=-1)
    return np.asarray(np.arctan2(towards_east, np.sum(carried * local_south, axis=-1)))


def project_map(
    values: ArrayLike,
    projection: Projection,
    *,
    spin: int = 0,
    sampling: Sampling | None = None,
) -> Array:
    """Return the flat picture of a map: to draw, or to hand to what wants a plane.

    Parameters
    ----------
    values : array_like, shape (12 * nside**2,) or (rings, phi), real or complex
        A HEALPix map in RING order, or a map on a grid.
    projection : Projection
        The picture wanted.
    spin : int
        Spin of a complex map. Around a centre its frame is carried along great circles, so that
        one frame, x down and y to the left, serves the whole picture; f turns into
        ``exp(-i spin chi) f`` (eq-frame). Pictures of the whole sky keep the local frame.
    sampling : Sampling, optional
        The grid of ``values``; by default MW or MWSS, whichever has that shape.

    Returns
    -------
    ndarray, shape (rows, columns), float64 or complex128
        The value of the sample nearest to each point, nan outside the edge.

    Raises
    ------
    ShapeError
        If the map is neither HEALPix nor on the grid.
    DataError
        If it does not hold numbers, or is real with a spin.
    ParameterError
        If the spin is no integer.

    Examples
    --------
    >>> north = Projection("orthographic", centre=(0.0, 0.0), rows=4)
    >>> float(np.nanmax(project_map(np.arange(12), north)))
    3.0
    """
    array = np.asarray(values)
    spin = check_integer(spin, "spin", remedy="2 is that of Q + iU")
    if array.dtype.kind not in "buifc" or (spin and array.dtype.kind != "c"):
        msg = f"values have dtype {array.dtype}; a field of spin {spin} needs complex numbers."
        raise DataError(msg)
    if sampling is not None and array.shape != sampling.shape:
        msg = f"values have shape {array.shape}; they must have {sampling.shape} on {sampling!r}."
        raise ShapeError(msg)
    raster = projection.raster
    picture = raster.picture(array, sampling)
    return picture * np.exp(-1j * spin * raster.angles) if spin else picture


def _nearest_pixels(values: Array, colatitudes: FloatArray, longitudes: FloatArray) -> Array:
    import healpy

    return np.asarray(values[healpy.ang2pix(nside_of(values), colatitudes, longitudes)])


def _nearest_samples(
    values: Array, grid: Sampling, colatitudes: FloatArray, longitudes: FloatArray
) -> Array:
    between = (grid.colatitudes[1:] + grid.colatitudes[:-1]) / 2
    rings = np.searchsorted(between, colatitudes)
    points = np.rint(longitudes * grid.n_phi / (2 * np.pi)).astype(np.int64) % grid.n_phi
    return np.asarray(values[rings, points])


def grid_of(shape: tuple[int, ...]) -> Sampling:
    """Return the MW or MWSS grid of maps of a shape.

    Parameters
    ----------
    shape : tuple of int

    Returns
    -------
    Sampling

    Raises
    ------
    ShapeError
        If the shape belongs to neither.

    Examples
    --------
    >>> grid_of((4, 7)), grid_of((5, 8))
    (MW(bandlimit=4), MWSS(bandlimit=4))
    """
    if len(shape) == 2:
        rings, points = shape
        if rings >= 1 and points == 2 * rings - 1:
            return MW(rings)
        if rings >= 2 and points == 2 * rings - 2:
            return MWSS(rings - 1)
    msg = (
        f"map has shape {shape}; it must be HEALPix (12 nside**2,), MW (L, 2L-1) or MWSS (L+1, 2L)."
    )
    raise ShapeError(msg)
