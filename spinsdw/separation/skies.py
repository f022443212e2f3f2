"""`Sky`: the pixelisation that Q and U come on, as the separation sees it."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from spinsdw.errors import ParameterError, ShapeError
from spinsdw.harmonics import check_bandlimit, resize
from spinsdw.healpix import (
    HealpixFit,
    default_bandlimit,
    flm_to_map,
    map_to_flm,
    nside_of,
    pixel_at,
    pixel_directions,
    quadrature_flm,
)
from spinsdw.ring_transform import HealpixTransform
from spinsdw.sampling import MW, MWSS, Sampling
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["GridSky", "HealpixSky", "Sky", "finer_grid", "position_map", "sky_of"]

Array = np.ndarray[Any, Any]


class Sky(Protocol):
    """What a separation asks of the sky it works on."""

    @property
    def bandlimit(self) -> int:
        """Degrees used are below it."""
        ...

    @property
    def threads(self) -> int | None:
        """Threads of the transforms; all cores when None."""
        ...

    @property
    def sampling_name(self) -> str:
        """Kind of grid the wavelet coefficients of this sky live on."""
        ...

    def polarisation_coefficients(self, p: Array) -> tuple[Array, HealpixFit | None]:
        """Return the spin-2 coefficients of P = Q + iU, and how well they fit."""
        ...

    @property
    def map_shape(self) -> tuple[int, ...]:
        """Shape of one map."""
        ...

    @property
    def points(self) -> tuple[Array, Array]:
        """Colatitudes and longitudes of the points in radians, of the shape of a map."""
        ...

    @property
    def spacing(self) -> float:
        """Distance between neighbouring samples in radians."""
        ...

    def scalar_map(self, flm: Array) -> Array:
        """Return the complex map of spin-0 coefficients of any bandlimit."""
        ...

    def integrals(self, weights: Array, bandlimit: int) -> Array:
        """Return <Ylm, weights> for l < bandlimit: coefficients of a real field."""
        ...

    def polarisation_map(self, plm: Array) -> Array:
        """Return P = Q + iU of spin-2 coefficients."""
        ...

    def adjoint_polarisation_map(self, p: Array) -> Array:
        """Apply the adjoint of `polarisation_map`: sums over samples."""
        ...

    @property
    def areas(self) -> Array:
        """Solid angle that each sample stands for; positive, of a shape that maps broadcast to."""
        ...

    def area_sums(self, weights: Array, bandlimit: int) -> Array:
        """Return sums of Ylm* times weights over samples with their areas, l < bandlimit."""
        ...

    def nearest(self, values: Array, angles: tuple[Array, Array]) -> Array:
        """Return the values of a map at the samples nearest to colatitudes and longitudes."""
        ...

    def weighted_coefficients(self, maps: Array, bandlimit: int, spin: int) -> Array:
        """Return <sYlm, maps> of complex maps of any spin that need not be band-limited."""
        ...


@dataclass(frozen=True)
class HealpixSky:
    """HEALPix maps in ring order."""

    nside: int
    bandlimit: int
    threads: int | None = None
    tolerance: float = 1e-10

    @property
    def sampling_name(self) -> str:
        """Kind of grid the wavelet coefficients of this sky live on."""
        return "mw"

    @property
    def map_shape(self) -> tuple[int, ...]:
        """Shape of one map."""
        return (12 * self.nside**2,)

    @property
    def points(self) -> tuple[Array, Array]:
        """Colatitudes and longitudes of the points in radians, of the shape of a map."""
        return pixel_directions(self.nside)

    @property
    def spacing(self) -> float:
        """Mean distance between neighbouring samples in radians."""
        return float(np.sqrt(np.pi / 3)) / self.nside

    def polarisation_coefficients(self, p: Array) -> tuple[Array, HealpixFit | None]:
        """Return the spin-2 coefficients of P = Q + iU, and how well they fit."""
        return map_to_flm(p, self.bandlimit, 2, tolerance=self.tolerance, threads=self.threads)

    def scalar_map(self, flm: Array) -> Array:
        """Return the complex map of spin-0 coefficients of any bandlimit."""
        return flm_to_map(flm, self.nside, threads=self.threads)

    def integrals(self, weights: Array, bandlimit: int) -> Array:
        """Return <Ylm, weights> for l < bandlimit: coefficients of a real field."""
        # A sum over pixel centres: no fit, so that a share computed from it stays non-negative.
        transform = HealpixTransform(self.nside, bandlimit, real=True, threads=self.threads)
        return transform.adjoint_synthesis(weights) * (4 * np.pi / weights.size)

    @functools.cached_property
    def _transform(self) -> HealpixTransform:
        return HealpixTransform(self.nside, self.bandlimit, 2, threads=self.threads)

    def polarisation_map(self, plm: Array) -> Array:
        """Return P = Q + iU of spin-2 coefficients."""
        return self._transform.synthesis(plm)

    def adjoint_polarisation_map(self, p: Array) -> Array:
        """Apply the adjoint of `polarisation_map`: sums over samples."""
        return self._transform.adjoint_synthesis(p)

    @property
    def areas(self) -> Array:
        """Solid angle that each sample stands for; positive, of a shape that maps broadcast to."""
        return np.full(1, np.pi / (3 * self.nside**2))

    def area_sums(self, weights: Array, bandlimit: int) -> Array:
        """Return sums of Ylm* times weights over samples with their areas, l < bandlimit."""
        return self.integrals(weights, bandlimit)

    def nearest(self, values: Array, angles: tuple[Array, Array]) -> Array:
        """Return the values of a map at the samples nearest to colatitudes and longitudes."""
        return values[pixel_at(self.nside, *angles)]

    def weighted_coefficients(self, maps: Array, bandlimit: int, spin: int) -> Array:
        """Return <sYlm, maps> of complex maps of any spin that need not be band-limited."""
        # The weights are exact where degrees add up to 2.75 nside: beyond nside one step helps.
        iterations = 0 if bandlimit <= self.nside else 1
        return quadrature_flm(maps, bandlimit, spin, iterations=iterations, threads=self.threads)


@dataclass(frozen=True)
class GridSky:
    """Maps on an MW or MWSS grid, which may be finer than their bandlimit needs.

    Parameters
    ----------
    sampling : Sampling
        The grid.
    threads : int, optional
        Threads of the transforms.
    limit : int, optional
        Degrees used are below it; the grid's own bandlimit when None.
    """

    sampling: Sampling
    threads: int | None = None
    limit: int | None = None

    @property
    def bandlimit(self) -> int:
        """Degrees used are below it."""
        return self.sampling.bandlimit if self.limit is None else self.limit

    @property
    def sampling_name(self) -> str:
        """Kind of grid the wavelet coefficients of this sky live on."""
        return self.sampling.name

    @property
    def map_shape(self) -> tuple[int, ...]:
        """Shape of one map."""
        return self.sampling.shape

    @property
    def points(self) -> tuple[Array, Array]:
        """Colatitudes and longitudes of the points in radians, of the shape of a map."""
        grid = self.sampling
        colatitudes, longitudes = np.meshgrid(grid.colatitudes, grid.longitudes, indexing="ij")
        return colatitudes, longitudes

    @property
    def spacing(self) -> float:
        """Distance between neighbouring rings in radians."""
        return 2 * np.pi / self.sampling.n_phi

    def _transform(self, spin: int, *, real: bool = False) -> SpinHarmonicTransform:
        grid = self.sampling
        return SpinHarmonicTransform(
            grid.bandlimit, spin, sampling=grid, real=real, threads=self.threads
        )

    def polarisation_coefficients(self, p: Array) -> tuple[Array, HealpixFit | None]:
        """Return the spin-2 coefficients of P = Q + iU, and how well they fit."""
        return self._cut(self._transform(2).analysis(p)), None

    def _cut(self, flm: Array) -> Array:
        return flm if self.limit is None else resize(flm, self.limit)

    def _fill(self, flm: Array) -> Array:
        return flm if self.limit is None else resize(flm, self.sampling.bandlimit)

    def scalar_map(self, flm: Array) -> Array:
        """Return the complex map of spin-0 coefficients of any bandlimit."""
        return self._transform(0).synthesis(resize(flm, self.sampling.bandlimit))

    def integrals(self, weights: Array, bandlimit: int) -> Array:
        """Return <Ylm, weights> for l < bandlimit: coefficients of a real field."""
        # Between its samples a mask on this grid is the band-limited function they define.
        return resize(self._transform(0, real=True).analysis(weights), bandlimit)

    def polarisation_map(self, plm: Array) -> Array:
        """Return P = Q + iU of spin-2 coefficients."""
        return self._transform(2).synthesis(self._fill(plm))

    def adjoint_polarisation_map(self, p: Array) -> Array:
        """Apply the adjoint of `polarisation_map`: sums over samples."""
        return self._cut(self._transform(2).adjoint_synthesis(p))

    @property
    def areas(self) -> Array:
        """Solid angle that each sample stands for; positive, of a shape that maps broadcast to."""
        # At a pole all samples are one, with the area of a cap of half a step.
        grid = self.sampling
        areas = np.maximum(np.sin(grid.colatitudes), np.pi / (8 * grid.n_rings))[:, None]
        return np.asarray(areas * (4 * np.pi / (areas.sum() * grid.n_phi)))

    def area_sums(self, weights: Array, bandlimit: int) -> Array:
        """Return sums of Ylm* times weights over samples with their areas, l < bandlimit."""
        sums = self._transform(0, real=True).adjoint_synthesis(weights * self.areas)
        return resize(sums, bandlimit)

    def nearest(self, values: Array, angles: tuple[Array, Array]) -> Array:
        """Return the values of a map at the samples nearest to colatitudes and longitudes."""
        grid, (colatitudes, longitudes) = self.sampling, angles
        rings = grid.colatitudes
        step = 2 * np.pi / grid.n_phi
        ring = np.rint((colatitudes - rings[0]) / step).astype(np.int64)
        place = np.rint(longitudes / step).astype(np.int64) % grid.n_phi
        return values[np.clip(ring, 0, grid.n_rings - 1), place]

    def weighted_coefficients(self, maps: Array, bandlimit: int, spin: int) -> Array:
        """Return <sYlm, maps> of complex maps of any spin that need not be band-limited."""
        return resize(self._transform(spin).analysis(maps), bandlimit)

    def for_products(self, bandlimit: int) -> GridSky:
        """Return the sky on which products with fields of a bandlimit are integrated.

        A map sampled at its own bandlimit goes to a finer grid, which holds the product; one on a
        finer grid stays, for it may end at the edge of a footprint, where it is not band-limited.
        """
        if self.limit is not None:
            return self
        grid, _ = finer_grid(self.sampling, self.bandlimit + bandlimit - 1)
        return replace(self, sampling=grid, limit=self.bandlimit)

    def evaluate(self, p: Array, sky: GridSky) -> Array:
        """Return P on another grid: the band-limited function that its samples define."""
        if sky.sampling == self.sampling:
            return p
        plm = self._transform(2).analysis(p)
        return sky._transform(2).synthesis(resize(plm, sky.sampling.bandlimit))


def finer_grid(grid: Sampling, bandlimit: int) -> tuple[Sampling, tuple[slice, slice]]:
    """Return a grid of at least a bandlimit that holds the samples of another one, and where."""
    times = -(-bandlimit // grid.bandlimit)
    if isinstance(grid, MW):
        # theta = (2 t + 1) pi / (2 L - 1): the odd multiples of 2 L - 1 are the finer grids.
        times = (
            1 if times == 1 else -(-(2 * bandlimit - 1) // (2 * grid.bandlimit - 1)) // 2 * 2 + 1
        )
        finer: Sampling = MW((times * (2 * grid.bandlimit - 1) + 1) // 2)
        return finer, (slice(times // 2, None, times), slice(None, None, times))
    return MWSS(times * grid.bandlimit), (slice(None, None, times), slice(None, None, times))


def position_map(
    values: Array, transform: SpinWaveletTransform, scale: int, sky: HealpixSky | GridSky
) -> Array:
    """Return weights given at the positions of one scale's coefficients at the sky's points.

    Parameters
    ----------
    values : ndarray, shape (rings, phi), float64
        Weights in [0, 1] at the scale's positions.
    transform : SpinWaveletTransform
        What the scale belongs to.
    scale : int
        The scale j.
    sky : HealpixSky or GridSky
        Where the weights are wanted.

    Returns
    -------
    ndarray, float64
        Weights in [0, 1], interpolated linearly in both angles: harmonics would ring where the
        weights fall steeply.
    """
    grid = transform.part_grid(scale)
    colatitudes, longitudes = sky.points
    rings = grid.colatitudes
    last = grid.n_rings - 1
    step = rings[1] - rings[0] if last > 0 else np.pi
    ring = np.clip((colatitudes - rings[0]) / step, 0, last)
    above = np.minimum(ring.astype(np.int64), max(last - 1, 0))
    below = np.minimum(above + 1, last)
    place = longitudes * (grid.n_phi / (2 * np.pi))
    west = place.astype(np.int64)
    across, down = place - west, ring - above
    west, east = west % grid.n_phi, (west + 1) % grid.n_phi
    north = (1 - across) * values[above, west] + across * values[above, east]
    south = (1 - across) * values[below, west] + across * values[below, east]
    return np.asarray((1 - down) * north + down * south)


def sky_of(
    values: Array, bandlimit: int | None, *, name: str, threads: int | None
) -> HealpixSky | GridSky:
    """Return the sky a map or mask is on: HEALPix if it is 1-D, MW or MWSS if it is 2-D.

    Raises
    ------
    ShapeError
        If the shape is none of theirs.
    ParameterError
        If the grid is too coarse for the bandlimit.
    """
    if values.ndim == 1:
        nside = nside_of(values)
        limit = default_bandlimit(nside) if bandlimit is None else check_bandlimit(bandlimit)
        return HealpixSky(nside, limit, threads)
    if values.ndim == 2:
        rings, phis = values.shape
        for sampling, size in ((MW, rings), (MWSS, rings - 1)):
            if size >= 1 and sampling(size).shape == (rings, phis):
                grid_limit = None if bandlimit in {None, size} else check_bandlimit(bandlimit)
                if grid_limit is not None and grid_limit > size:
                    msg = (
                        f"{name} has the shape {values.shape} of bandlimit {size}, below "
                        f"bandlimit={bandlimit}; lower it or give maps on a finer grid."
                    )
                    raise ParameterError(msg)
                return GridSky(sampling(size), threads, grid_limit)
    msg = (
        f"{name} has shape {values.shape}; it must be a HEALPix map (12 nside^2,), an MW map "
        "(L, 2 L - 1) or an MWSS map (L + 1, 2 L)."
    )
    raise ShapeError(msg)
