"""`HealpixTransform`: spin-s synthesis on HEALPix maps, and its adjoint."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.fourier import from_half_series, from_series, to_half_series, to_series
from spinsdw.grid_sums import fill_negative_orders
from spinsdw.harmonics import check_flm
from spinsdw.parallel import resolve_threads, run_tasks
from spinsdw.ring_engine import RingEngine
from spinsdw.sampling.base import check_bandlimit
from spinsdw.sampling.healpix_rings import HealpixRings
from spinsdw.signals import check_map, check_spin

__all__ = ["HealpixTransform"]

Array = np.ndarray[Any, Any]

# Rings of the equatorial belt that one task transforms.
_BELT_RINGS = 16


@functools.lru_cache(maxsize=16)
def _engine(nside: int, bandlimit: int) -> RingEngine:
    north = HealpixRings(nside).colatitudes[: 2 * nside]
    return RingEngine(bandlimit, north, symmetric=True)


@dataclass(frozen=True, eq=False)
class HealpixTransform:
    """Compute HEALPix maps (ring order) of spin s from harmonic coefficients, and the adjoint.

    HEALPix has no sampling theorem: the adjoint is not the inverse. `healpix.map_to_flm` inverts by
    least squares with these two operations.

    Parameters
    ----------
    nside : int
        Resolution; maps have 12 nside^2 pixels.
    bandlimit : int
        L: degrees are l < L.
    spin : int, default 0
        s, |s| < L.
    real : bool, default False
        Whether maps are real (spin 0 only).
    threads : int, optional
        Threads to use; all cores when None. Results do not depend on it.

    Examples
    --------
    >>> import numpy as np
    >>> flm = np.zeros(16, dtype=complex)
    >>> flm[0] = np.sqrt(4 * np.pi)
    >>> bool(np.allclose(HealpixTransform(2, 4).synthesis(flm), 1.0, rtol=0, atol=1e-15))
    True
    """

    nside: int
    bandlimit: int
    spin: int = 0
    real: bool = False
    threads: int | None = None

    def __init__(
        self,
        nside: int,
        bandlimit: int,
        spin: int = 0,
        *,
        real: bool = False,
        threads: int | None = None,
    ) -> None:
        bandlimit = check_bandlimit(bandlimit)
        spin = check_spin(spin, bandlimit)
        if real and spin != 0:
            msg = f"real=True needs spin 0, not spin={spin}; a signal with spin is complex."
            raise ParameterError(msg)
        resolve_threads(threads)
        values = (HealpixRings(nside).nside, bandlimit, spin, bool(real), threads)
        for field, value in zip(fields(self), values, strict=True):
            object.__setattr__(self, field.name, value)

    @property
    def rings(self) -> HealpixRings:
        """The ring layout."""
        return HealpixRings(self.nside)

    @property
    def shape(self) -> tuple[int]:
        """Shape of one map: (pixels,)."""
        return (self.rings.n_pixels,)

    @property
    def _sides(self) -> int:
        return 1 if self.real else 2

    @property
    def _n_m(self) -> int:
        return self.bandlimit if self.real else 2 * self.bandlimit - 1

    @functools.cached_property
    def _weights(self) -> Array:
        el = np.arange(self.bandlimit)
        weights = (-1.0) ** self.spin * np.sqrt((2 * el + 1) / (4 * np.pi))
        weights[: abs(self.spin)] = 0.0
        return weights.astype(np.complex128)[None]

    @functools.cached_property
    def _groups(self) -> list[tuple[int, int, float, int]]:
        """(first ring, rings, first longitude, points) of runs of rings alike."""
        rings = self.rings
        sizes, phis = rings.n_phi, rings.first_longitudes
        groups = [(r, 1, float(phis[r]), int(sizes[r])) for r in range(rings.n_rings)]
        # Largest first, so that threads finish together.
        return sorted(groups, key=lambda group: -group[3])

    def _ring_tasks(self, call: Callable[[list[tuple[int, int, float, int]]], None]) -> None:
        groups = self._groups
        step = _BELT_RINGS
        tasks = [functools.partial(call, groups[i : i + step]) for i in range(0, len(groups), step)]
        run_tasks(tasks, resolve_threads(self.threads))

    def _to_map(self, flm: Array) -> Array:
        from spinsdw.compiled.folding import fill_half_rings, fill_rings

        rings = self.rings
        spectra = np.empty((1, rings.n_rings, self._n_m), dtype=np.complex128)
        _engine(self.nside, self.bandlimit).fill_spectra(
            flm[None],
            self._weights,
            orders=(-self.spin,),
            mixing=np.ones((1, 1), dtype=np.complex128),
            lowest=0,
            sides=self._sides,
            out=spectra,
            threads=resolve_threads(self.threads),
        )
        pixels = np.empty(rings.n_pixels, dtype=np.float64 if self.real else np.complex128)
        starts = rings.starts
        fold = fill_half_rings if self.real else fill_rings
        back = from_half_series if self.real else from_series

        def task(groups: list[tuple[int, int, float, int]]) -> None:
            for first, _, phi, points in groups:
                modes = points // 2 + 1 if self.real else points
                folded = np.empty((1, modes), dtype=np.complex128)
                fold(self.bandlimit, spectra[0], first, phi, folded)
                start = starts[first]
                back(folded, pixels[None, start : start + points])

        self._ring_tasks(task)
        return pixels

    def _to_coefficients(self, pixels: Array, flm: Array) -> None:
        from spinsdw.compiled.folding import fill_half_unfolded, fill_unfolded

        rings = self.rings
        columns = np.empty((1, self._n_m, rings.n_rings), dtype=np.complex128)
        starts = rings.starts
        unfold = fill_half_unfolded if self.real else fill_unfolded
        transform = to_half_series if self.real else to_series

        def task(groups: list[tuple[int, int, float, int]]) -> None:
            for first, _, phi, points in groups:
                modes = points // 2 + 1 if self.real else points
                series = np.empty((1, modes), dtype=np.complex128)
                start = starts[first]
                transform(pixels[None, start : start + points], series)
                unfold(self.bandlimit, series, first, phi, columns[0])

        self._ring_tasks(task)
        _engine(self.nside, self.bandlimit).add_to_harmonics(
            columns,
            self._weights,
            orders=(-self.spin,),
            lowest=0,
            sides=self._sides,
            out=flm[None],
            threads=resolve_threads(self.threads),
        )

    def synthesis(self, flm: Array) -> Array:
        """Compute maps from harmonic coefficients.

        Parameters
        ----------
        flm : ndarray, shape (..., bandlimit**2), complex
            [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]; with ``real`` those of
            a real field, of which only m >= 0 is read.

        Returns
        -------
        ndarray, shape (..., pixels), complex128 (float64 if ``real``)
            Maps in ring order; leading axes are a batch.

        Raises
        ------
        ShapeError
            If the last axis is not bandlimit**2 long.
        DataError
            If a coefficient is not a finite number.
        """
        flm = check_flm(flm, self.bandlimit)
        if flm.ndim == 1:
            return self._to_map(flm)
        maps = [self._to_map(one) for one in flm.reshape(-1, flm.shape[-1])]
        return np.stack(maps).reshape(*flm.shape[:-1], self.rings.n_pixels)

    def adjoint_synthesis(self, maps: Array) -> Array:
        """Apply the adjoint of `synthesis`: sums over pixels, without quadrature weights.

        Parameters
        ----------
        maps : ndarray, shape (..., pixels)
            Maps in ring order.

        Returns
        -------
        ndarray, shape (..., bandlimit**2), complex128
            The coefficients.

        Raises
        ------
        ShapeError
            If the last axis is not 12 nside^2 long.
        DataError
            If a value is not a finite number, or is complex with ``real``.
        """
        maps = check_map(maps, self.shape, real=self.real)
        rows = maps.reshape(-1, self.rings.n_pixels)
        flm = np.zeros((rows.shape[0], self.bandlimit**2), dtype=np.complex128)
        for one, out in zip(rows, flm, strict=True):
            self._to_coefficients(one, out)
        if self.real:
            fill_negative_orders(flm)
        return flm.reshape(*maps.shape[:-1], self.bandlimit**2)
