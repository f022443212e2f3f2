r"""Smooth masks on the sphere with their first two spin derivatives, for pure estimators.

A pure estimator needs a mask that vanishes with its gradient on the edge of the footprint, and
:math:`\bar\eth M` and :math:`\bar\eth^2 M` that belong to exactly this mask.  Here

.. math:: M = 1_{\{d > w/2\}} \star k_{w/2},

with d the distance to the nearest unobserved sample, w the width of the taper, and k the
band-limited function that a cap of radius w/2 holds best: the first Slepian function of the cap
(Simons, Dahlen & Wieczorek 2006, SIAM Review 48, 504).  So M is 0 on what was not observed and 1
farther than w inside, whatever corners and holes the footprint has, both but for the share of k
outside its cap, which falls as exp(-L_M w / 2).  M is band-limited, so its derivatives are exact.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinsdw.errors import ParameterError
from spinsdw.harmonics import multiply_by_degree, raise_spin
from spinsdw.healpix import flm_to_map, map_to_flm
from spinsdw.masks import apodise
from spinsdw.parallel import resolve_threads
from spinsdw.sampling import GaussLegendre, Sampling
from spinsdw.separation.skies import GridSky, HealpixSky, finer_grid
from spinsdw.spin_transform import SpinHarmonicTransform

__all__ = ["SmoothMask", "SmoothMasks", "concentrated_kernel", "profile_mask"]

Array = NDArray[Any]
AnySky = HealpixSky | GridSky

# L_M times the kernel's radius: what is outside its cap falls as exp(-that). Where sums over
# samples are not exact, products with a mask of higher degrees lose more than that disturbs.
_HEALPIX_CONCENTRATION, _CONCENTRATION, _EXACT_CONCENTRATION = 14.0, 18.0, 36.0
# Largest L_M in units of nside, and of a grid's bandlimit, where products are not exact.
_PER_NSIDE, _PER_BANDLIMIT = 3, 2


@dataclass(frozen=True, eq=False)
class SmoothMask:
    """A smooth mask of a sky.

    Parameters
    ----------
    width : float
        Width of its taper in radians.
    sky : HealpixSky or GridSky
        The pixelisation.
    harmonics : ndarray, shape (L_M**2,), complex128
        Coefficients of M, or where M is given those that its derivatives are made of.
    observed : ndarray, shape of a map, bool, optional
        What is not observed has M = 0 without the ringing of the band-limited M.
    given : ndarray, shape of a map, float64, optional
        M itself, where it is not band-limited.
    """

    width: float
    sky: AnySky
    harmonics: Array = field(repr=False)
    observed: Array | None = field(default=None, repr=False)
    given: Array | None = field(default=None, repr=False)
    _elsewhere: dict[AnySky, SmoothMask] = field(default_factory=dict, init=False, repr=False)

    @property
    def bandlimit(self) -> int:
        """L_M: the degrees of M are below it."""
        return math.isqrt(self.harmonics.size)

    @functools.cached_property
    def values(self) -> Array:
        """M: 0 where not observed, 1 farther than the width inside; shape of a map, float64."""
        return self._masked(self._band_limited if self.given is None else self.given)

    @functools.cached_property
    def first(self) -> Array:
        """eth-bar M, of spin -1; shape of a map, complex128."""
        one = raise_spin(self.harmonics, 0)
        return self._masked(_at_points(self.sky, one, 1).conj())

    @functools.cached_property
    def second(self) -> Array:
        """eth-bar^2 M, of spin -2; shape of a map, complex128."""
        two = raise_spin(raise_spin(self.harmonics, 0), 1)
        return self._masked(_at_points(self.sky, two, 2).conj())

    @functools.cached_property
    def _band_limited(self) -> Array:
        return _at_points(self.sky, self.harmonics, 0).real

    def _masked(self, values: Array) -> Array:
        masked = values.copy() if self.observed is None else values * self.observed
        masked.setflags(write=False)
        return masked

    @property
    def ringing(self) -> float:
        """Largest band-limited M where nothing was observed, which ought to be 0."""
        if self.observed is None:
            return 0.0
        return float(np.max(np.abs(self._band_limited[~self.observed]), initial=0.0))

    def on(self, sky: AnySky) -> SmoothMask:
        """Return the same mask at the samples of another sky, where all of it is observed."""
        if sky == self.sky:
            return self
        if sky not in self._elsewhere:
            self._elsewhere[sky] = SmoothMask(self.width, sky, self.harmonics)
        return self._elsewhere[sky]

    def weights(self, grid: Sampling) -> Array:
        """Return M at the samples of a grid, clipped to [0, 1]; float64, shape (rings, phi)."""
        return np.clip(_at_points(GridSky(grid), self.harmonics, 0).real, 0.0, 1.0)


def concentrated_kernel(bandlimit: int, radius: float) -> Array:
    """Return the band-limited axisymmetric function that a cap holds best.

    The eigenvector of a tridiagonal matrix that commutes with the concentration in the cap
    (Grunbaum, Longhi & Perlstadt 1982).

    Parameters
    ----------
    bandlimit : int
        L: its degrees are l < L.
    radius : float
        Radius of the cap in radians.

    Returns
    -------
    ndarray, shape (bandlimit,), float64
        b_l with b_0 = 1: a convolution multiplies f_lm by it.

    Examples
    --------
    >>> kernel = concentrated_kernel(40, 0.5)
    >>> float(kernel[0]), bool(np.all(np.diff(kernel) < 0))
    (1.0, True)
    """
    from scipy.linalg import eigh_tridiagonal

    if bandlimit == 1:
        return np.ones(1)
    el = np.arange(bandlimit, dtype=np.float64)
    diagonal = -el * (el + 1) * math.cos(radius)
    below = el[:-1]
    beside = (below * (below + 2) - (bandlimit - 1) * (bandlimit + 1)) * (below + 1)
    beside /= np.sqrt((2 * below + 1) * (2 * below + 3))
    _, vectors = eigh_tridiagonal(diagonal, beside, select="i", select_range=(0, 0))
    kernel: Array = vectors[:, 0] / np.sqrt(2 * el + 1)
    return kernel / kernel[0]


@dataclass(frozen=True, eq=False)
class SmoothMasks:
    """The smooth masks of a footprint, one for every width of the taper, each made once.

    Parameters
    ----------
    sky : HealpixSky or GridSky
        The pixelisation.
    mask : ndarray, shape of a map, float64
        In [0, 1], ring order, 0 where the sky was not observed; `Survey.footprint` has it.
    largest_share : float, default 0.8
        Share of the inradius of the footprint that a width may have; wider ones are clipped to it.

    Notes
    -----
    Weights between 0 and 1 are taken along: they multiply the indicator before the convolution, and
    the mask is their smooth version.

    Examples
    --------
    >>> from spinsdw.healpix import pixel_directions
    >>> cap = (pixel_directions(16)[0] < 1.0).astype(float)
    >>> smooth = SmoothMasks(HealpixSky(16, 33), cap).of_width(0.6)
    >>> bool(abs(smooth.values[0] - 1) < 1e-4), smooth.ringing < 1e-4
    (True, True)
    """

    sky: AnySky
    mask: Array
    largest_share: float = 0.8
    _held: dict[float, SmoothMask] = field(default_factory=dict, init=False, repr=False)

    @functools.cached_property
    def _tree(self) -> Any:
        """The unobserved samples."""
        from scipy.spatial import cKDTree

        hidden = self.mask.ravel() == 0
        return cKDTree(_vectors(*(angle.ravel()[hidden] for angle in self.sky.points)))

    @functools.cached_property
    def inradius(self) -> float:
        """Radius of the largest disc that the footprint holds, in radians: pi on the full sky."""
        observed = self.mask.ravel() > 0
        if observed.all():
            return math.pi
        points = _vectors(*(angle.ravel()[observed] for angle in self.sky.points))
        chords, _ = self._tree.query(points, workers=resolve_threads(self.sky.threads))
        return float(2 * np.arcsin(min(chords.max() / 2, 1.0)))

    @property
    def narrowest(self) -> float:
        """The least width: less than it, and the gaps between samples would look observed."""
        return 2 * _sample_radius(self.sky)

    @property
    def widest(self) -> float:
        """The largest width."""
        return self.largest_share * self.inradius

    def of_width(self, width: float) -> SmoothMask:
        """Return the mask whose taper has a width in radians, or the widest that fits.

        Raises
        ------
        ParameterError
            If the width is less than the samples resolve, or the footprint holds no such taper.
        """
        if not (math.isfinite(width) and width >= self.narrowest):
            msg = (
                f"width={width} must be at least {self.narrowest:.4g} radians, what the samples "
                "of this sky resolve; widen the taper."
            )
            raise ParameterError(msg)
        if self.widest < self.narrowest:
            msg = (
                f"mask holds no disc larger than {self.inradius:.4g} radians, too small for any "
                f"taper of at least {self.narrowest:.4g} radians; give finer or larger maps."
            )
            raise ParameterError(msg)
        width = min(float(width), self.widest)
        if width not in self._held:
            self._held[width] = self._make(width)
        return self._held[width]

    def _make(self, width: float) -> SmoothMask:
        if np.all(self.mask == 1):
            # Bandlimit 3, the least that holds fields of spin 2.
            flm = np.zeros(9, dtype=np.complex128)
            flm[0] = math.sqrt(4 * math.pi)
            return SmoothMask(width, self.sky, flm)
        bandlimit = self._bandlimit(width)
        radius = (width - math.pi / bandlimit) / 2
        flm = self._inner_harmonics(bandlimit, width)
        flm = multiply_by_degree(flm, concentrated_kernel(bandlimit, radius))
        return SmoothMask(width, self.sky, flm, self.mask > 0)

    def _bandlimit(self, width: float) -> int:
        """Return L_M: as large as the kernel needs, unless products would not be integrated."""
        sky = self.sky
        if isinstance(sky, HealpixSky):
            wanted = _kernel_bandlimit(_HEALPIX_CONCENTRATION, width)
            return max(3, min(wanted, _PER_NSIDE * sky.nside))
        size, wanted = sky.sampling.bandlimit, _kernel_bandlimit(_EXACT_CONCENTRATION, width)
        if sky.bandlimit + wanted - 1 > size:
            wanted = min(_kernel_bandlimit(_CONCENTRATION, width), _PER_BANDLIMIT * size)
        return max(3, wanted)

    def _inner_harmonics(self, bandlimit: int, width: float) -> Array:
        """Return the coefficients of the mask where it is farther than width / 2 from its edge."""
        # Gauss-Legendre weights are positive and exact: the kernel's values add up to 1.
        grid = GaussLegendre(bandlimit)
        values = np.empty(grid.shape)
        for ring, colatitude in enumerate(grid.colatitudes):
            angles = np.full(grid.n_phi, colatitude), grid.longitudes
            values[ring] = self._inside(angles, width, np.pi / bandlimit)
        transform = SpinHarmonicTransform(
            bandlimit, sampling=grid, real=True, threads=self.sky.threads
        )
        return transform.analysis(values)

    def _inside(self, angles: tuple[Array, Array], width: float, step: float) -> Array:
        """Return the mask at points farther than width / 2 from its edge, rising in one step.

        The kernel is smaller by half a step, for M to be 0 at the edge and 1 one width inside.
        """
        bound = 2 * math.sin(min(width / 2 + step, math.pi) / 2)
        chords, _ = self._tree.query(
            _vectors(*angles),
            distance_upper_bound=bound,
            workers=resolve_threads(self.sky.threads),
        )
        # Beyond the bound the distance is infinite.
        depth = 2 * np.arcsin(np.minimum(chords / 2, 1.0)) - width / 2
        return np.clip(depth / step + 0.5, 0.0, 1.0) * self.sky.nearest(self.mask, angles)


def _kernel_bandlimit(concentration: float, width: float) -> int:
    """Return the L_M with which a kernel of radius (width - pi / L_M) / 2 is so concentrated."""
    return math.ceil((2 * concentration + math.pi) / width)


def profile_mask(sky: HealpixSky, mask: Array, width: float, profile: str) -> SmoothMask:
    """Taper a HEALPix mask pixel by pixel and differentiate it in harmonic space.

    What harmonic pure estimators in use do: such a mask has no bandlimit, so its derivatives are
    only about those of its values.

    Parameters
    ----------
    sky : HealpixSky
        The pixelisation.
    mask : ndarray, shape (npix,), float64
        In [0, 1], ring order.
    width : float
        Width of the taper in radians.
    profile : str
        A profile of `spinsdw.masks.apodise`.

    Returns
    -------
    SmoothMask
        M is the tapered mask itself; its derivatives are those of its fit up to degree 2.5 nside.

    Raises
    ------
    ParameterError
        As `apodise` does.
    """
    tapered = apodise(mask, width, profile=profile)
    flm, _ = map_to_flm(tapered, int(2.5 * sky.nside), threads=sky.threads)
    return SmoothMask(width, sky, flm, tapered > 0, tapered)


def _vectors(colatitudes: Array, longitudes: Array) -> Array:
    """Return unit vectors, shape (points, 3)."""
    sines = np.sin(colatitudes)
    parts = (sines * np.cos(longitudes), sines * np.sin(longitudes), np.cos(colatitudes))
    return np.stack(parts, axis=-1)


def _sample_radius(sky: AnySky) -> float:
    """Return a bound of the angle from any point to the nearest sample."""
    # HEALPix pixels reach 0.84 / nside from their centres at most.
    if isinstance(sky, HealpixSky):
        return min(0.9 / sky.nside, math.pi)
    return math.pi / sky.sampling.bandlimit


def _at_points(sky: AnySky, flm: Array, spin: int) -> Array:
    """Evaluate coefficients of any bandlimit at the samples of a sky, complex128."""
    if isinstance(sky, HealpixSky):
        return flm_to_map(flm, sky.nside, spin, threads=sky.threads)
    bandlimit = math.isqrt(flm.shape[-1])
    grid, part = finer_grid(sky.sampling, bandlimit)
    transform = SpinHarmonicTransform(grid.bandlimit, spin, sampling=grid, threads=sky.threads)
    padded = np.zeros(grid.bandlimit**2, dtype=np.complex128)
    padded[: flm.size] = flm
    return transform.synthesis(padded)[part].copy()
