"""`SpinHarmonicTransform`: exact transforms of spin-s signals on the sphere."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from spinsdw.errors import ParameterError
from spinsdw.grid_sums import GridSums, cleared_flm, fill_negative_orders
from spinsdw.harmonics import (
    check_bandlimit,
    check_flm,
    check_integer,
    lower_spin,
    raise_spin,
    resize,
)
from spinsdw.memory import MemoryEstimate, check_max_memory
from spinsdw.parallel import resolve_threads, threads_for
from spinsdw.point_sums import PointSums, check_accuracy, check_points
from spinsdw.ring_engine import OrderSums
from spinsdw.rotation import rotate_flm
from spinsdw.sampling import Sampling, resolve_sampling
from spinsdw.signals import check_dtype, check_flag, check_map, check_spin, writable

__all__ = ["SpinHarmonicTransform"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False)
class SpinHarmonicTransform:
    """Transform between maps of spin s and their harmonic coefficients, exactly.

    f(theta, phi) = sum_lm f_lm sYlm(theta, phi) with sYlm = (-1)^s sqrt((2l+1)/4pi)
    d^l_{m,-s}(theta) e^{i m phi} (McEwen & Wiaux 2011, arXiv:1110.6298; `conventions`).

    Parameters
    ----------
    bandlimit : int
        L: degrees are l < L.
    spin : int, default 0
        s, of either sign, |s| < L.
    sampling : str or Sampling, default "mw"
        The grid of the maps: "mw", "mwss", "gl", "cc", "fejer1", "dh" or an object (`sampling`).
    real : bool, default False
        Whether maps are real (spin 0 only): half the work and half the memory.
    threads : int, optional
        Threads to use; all cores when None. Results do not depend on it.
    dtype : {"complex128", "complex64"}, default "complex128"
        What maps are stored in; with "complex64" real ones are float32, in half the memory.
        Sums are of double precision and harmonic coefficients complex128 in any case; what is
        stored is rounded to 6e-8 of its size (`docs/engine`).
    max_memory : int, optional
        Bytes that a call may take by `memory_estimate`; one that would take more is refused before
        it allocates anything. No limit when None.

    Notes
    -----
    Cost O(L^3). `analysis` is the inverse of `synthesis` for band-limited signals. The adjoints are
    those of the plain dot product of the stored arrays (no quadrature weights); with ``real=True``
    the coefficients are those of a real field, f_{l,-m} = (-1)^m conj(f_lm), all stored.

    Examples
    --------
    >>> import numpy as np
    >>> transform = SpinHarmonicTransform(8, spin=2)
    >>> flm = np.zeros(64, dtype=complex)
    >>> flm[3 * 3 + 3 + 1] = 1.0
    >>> bool(np.allclose(transform.analysis(transform.synthesis(flm)), flm, rtol=0, atol=1e-14))
    True
    """

    bandlimit: int
    spin: int = 0
    sampling: Sampling | str = "mw"
    real: bool = False
    threads: int | None = None
    dtype: str = "complex128"
    max_memory: int | None = None

    def __init__(  # noqa: PLR0913 - what describes a transform
        self,
        bandlimit: int,
        spin: int = 0,
        *,
        sampling: str | Sampling = "mw",
        real: bool = False,
        threads: int | None = None,
        dtype: str = "complex128",
        max_memory: int | None = None,
    ) -> None:
        bandlimit = check_bandlimit(bandlimit)
        spin = check_spin(spin, bandlimit)
        real = check_flag(real, "real")
        if real and spin != 0:
            msg = f"real=True needs spin 0, not spin={spin}; a signal with spin is complex."
            raise ParameterError(msg)
        resolve_threads(threads)
        grid = resolve_sampling(sampling, bandlimit)
        stored, budget = check_dtype(dtype), check_max_memory(max_memory)
        values = (bandlimit, spin, grid, real, threads, stored, budget)
        for name, value in zip(self.__dataclass_fields__, values, strict=True):
            object.__setattr__(self, name, value)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of one map: (rings, points on a ring)."""
        return self._grid.shape

    @property
    def _grid(self) -> Sampling:
        return self.sampling  # type: ignore[return-value]

    @functools.cached_property
    def _weights(self) -> Array:
        el = np.arange(self.bandlimit)
        weights = (-1.0) ** self.spin * np.sqrt((2 * el + 1) / (4 * np.pi))
        weights[: abs(self.spin)] = 0.0
        return weights.astype(np.complex128)[None]

    @property
    def _sums(self) -> GridSums:
        one = np.ones((1, 1), dtype=np.complex128)
        threads = resolve_threads(self.threads)
        return GridSums(self._grid, (-self.spin,), one, self.real, threads, self.dtype)

    def memory_estimate(self, batch: int = 1) -> dict[str, MemoryEstimate]:
        """Return the bytes that one call of each method takes.

        Parameters
        ----------
        batch : int, default 1
            Signals handed over in one call.

        Returns
        -------
        dict of str to MemoryEstimate
            By the name of the method.

        Raises
        ------
        ParameterError
            If ``batch`` is not an integer of at least 0.

        Examples
        --------
        >>> found = SpinHarmonicTransform(2048, spin=2).memory_estimate()["synthesis"]
        >>> found.input == 16 * 2048**2, found.output == 16 * 2048 * 4095
        (True, True)
        >>> found.peak < 2 * (found.input + found.output)
        True
        """
        batch = check_integer(batch, "batch", minimum=0)
        flm = batch * 16 * self.bandlimit**2
        maps = batch * math.prod(self.shape) * self._sums.maps_itemsize
        plain, exact = (self._sums.working_bytes(batch, quadrature=one) for one in (False, True))
        return {
            "synthesis": MemoryEstimate(flm, maps, plain),
            "analysis": MemoryEstimate(maps, flm, exact),
            "adjoint_synthesis": MemoryEstimate(maps, flm, plain),
            "adjoint_analysis": MemoryEstimate(flm, maps, exact),
        }

    def _check_memory(self, call: str, batch: tuple[int, ...]) -> None:
        if self.max_memory is not None:
            self.memory_estimate(math.prod(batch))[call].require(self.max_memory, call)

    def _to_maps(self, flm: Array, *, quadrature: bool) -> Array:
        self._check_memory("adjoint_analysis" if quadrature else "synthesis", np.shape(flm)[:-1])
        flm = writable(check_flm(flm, self.bandlimit))
        batch = flm.reshape(-1, flm.shape[-1])
        maps = np.empty((batch.shape[0], *self.shape), dtype=self._sums.maps_dtype)
        self._sums.fill_maps(batch[:, None], self._weights, maps[:, None], quadrature=quadrature)
        return maps.reshape(*flm.shape[:-1], *self.shape)

    def _to_coefficients(self, maps: Array, *, quadrature: bool) -> Array:
        self._check_memory("analysis" if quadrature else "adjoint_synthesis", np.shape(maps)[:-2])
        maps = check_map(maps, self.shape, real=self.real, may_be_single=True)
        batch = maps.reshape(-1, *self.shape)
        flm = cleared_flm((batch.shape[0], self.bandlimit**2))
        self._sums.add_maps(batch[:, None], self._weights, flm[:, None], quadrature=quadrature)
        if self.real:
            fill_negative_orders(flm)
        return flm.reshape(*maps.shape[:-2], self.bandlimit**2)

    def synthesis(self, flm: Array) -> Array:
        """Compute maps from harmonic coefficients.

        Parameters
        ----------
        flm : ndarray, shape (..., bandlimit**2), complex
            [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]; entries with
            el < abs(spin) do not contribute.

        Returns
        -------
        ndarray, shape (..., rings, phi), ``dtype`` (of its precision, but real, if ``real``)
            The maps; leading axes are a batch.

        Raises
        ------
        ShapeError
            If the last axis is not bandlimit**2 long.
        DataError
            If a coefficient is not a finite number.
        MemoryBudgetError
            If the call would take more than ``max_memory``.
        """
        return self._to_maps(flm, quadrature=False)

    def analysis(self, maps: Array) -> Array:
        """Compute harmonic coefficients from maps, exactly for band-limited signals.

        Parameters
        ----------
        maps : ndarray, shape (..., rings, phi)
            Maps on the grid, of either precision; leading axes are a batch.

        Returns
        -------
        ndarray, shape (..., bandlimit**2), complex128
            The coefficients, zero for el < abs(spin).

        Raises
        ------
        ShapeError
            If the last two axes are not the grid's.
        DataError
            If a value is not a finite number, or is complex with ``real``.
        MemoryBudgetError
            If the call would take more than ``max_memory``.
        """
        return self._to_coefficients(maps, quadrature=True)

    def adjoint_synthesis(self, maps: Array) -> Array:
        """Apply the adjoint of `synthesis` to maps; shapes and errors of `analysis`."""
        return self._to_coefficients(maps, quadrature=False)

    def adjoint_analysis(self, flm: Array) -> Array:
        """Apply the adjoint of `analysis` to coefficients; shapes and errors of `synthesis`."""
        return self._to_maps(flm, quadrature=True)

    def _point_sums(self, theta: Array, phi: Array, accuracy: float) -> PointSums:
        sides, threads = 1 if self.real else 2, resolve_threads(self.threads)
        threads = threads_for(self.bandlimit, threads)
        sums = OrderSums((-self.spin,), self._weights, 0, sides, threads)
        return PointSums(sums, theta.ravel(), phi.ravel(), check_accuracy(accuracy))

    def _check_point_memory(self, sums: PointSums, batch: int, call: str) -> None:
        flm, values = 16 * batch * self.bandlimit**2, batch * sums.values_bytes
        there = (flm, values) if call == "synthesis_at" else (values, flm)
        MemoryEstimate(*there, sums.working_bytes).require(self.max_memory, call)

    def synthesis_at(
        self,
        flm: Array,
        colatitudes: ArrayLike,
        longitudes: ArrayLike,
        *,
        accuracy: float = 1e-12,
    ) -> Array:
        """Evaluate signals at arbitrary points.

        Parameters
        ----------
        flm : ndarray, shape (..., bandlimit**2), complex
            As in `synthesis`.
        colatitudes, longitudes : array_like, broadcast to one shape
            The points, in radians; 0 <= colatitude <= pi.
        accuracy : float, default 1e-12
            Error, relative to the root of the mean square of the signal, from 1e-12 to 1e-2: fewer
            digits take less time. Up to ``bandlimit`` points are summed directly, to rounding.

        Returns
        -------
        ndarray, shape (..., points), complex128 (float64 if ``real``)
            The values, with the axes of the points last; those of spin s in the frame (e_theta,
            e_phi) of each point, at a pole that of the meridian that its longitude tells.

        Raises
        ------
        ShapeError
            If the last axis is not bandlimit**2 long, or the points do not broadcast.
        DataError
            If a coefficient or an angle is not a finite number, or a colatitude out of range.
        ParameterError
            If the accuracy is out of range.

        Notes
        -----
        Cost O(L^2) a point for few points, O(L^3) and a non-uniform Fourier transform for many. The
        bits of the latter may depend on the number of threads.

        Examples
        --------
        >>> transform = SpinHarmonicTransform(8, real=True)
        >>> flm = np.zeros(64)
        >>> flm[2] = np.sqrt(4 * np.pi / 3)
        >>> transform.synthesis_at(flm, [0.0, np.pi / 3], 0.0).round(12).tolist()
        [1.0, 0.5]
        """
        flm = writable(check_flm(flm, self.bandlimit))
        theta, phi = check_points(colatitudes, longitudes)
        sums = self._point_sums(theta, phi, accuracy)
        batch = flm.reshape(-1, self.bandlimit**2)
        self._check_point_memory(sums, batch.shape[0], "synthesis_at")
        values = np.empty((batch.shape[0], theta.size), float if self.real else complex)
        for one, out in zip(batch, values, strict=True):
            out[...] = sums.to_points(one)
        return values.reshape((*flm.shape[:-1], *theta.shape))

    def adjoint_synthesis_at(
        self,
        values: Array,
        colatitudes: ArrayLike,
        longitudes: ArrayLike,
        *,
        accuracy: float = 1e-12,
    ) -> Array:
        """Apply the adjoint of `synthesis_at`: sums over points, without weights.

        Parameters
        ----------
        values : ndarray, shape (..., points)
            Values at the points, whose axes are theirs.
        colatitudes, longitudes, accuracy
            As in `synthesis_at`.

        Returns
        -------
        ndarray, shape (..., bandlimit**2), complex128
            The coefficients.

        Raises
        ------
        ShapeError, DataError, ParameterError
            As `synthesis_at`, and if the values do not have the shape of the points.
        """
        theta, phi = check_points(colatitudes, longitudes)
        if theta.ndim == 0:
            theta, phi, values = theta[None], phi[None], np.expand_dims(values, -1)
        values = check_map(values, theta.shape, real=self.real, name="values")
        sums = self._point_sums(theta, phi, accuracy)
        leading = values.shape[: values.ndim - theta.ndim]
        self._check_point_memory(sums, math.prod(leading), "adjoint_synthesis_at")
        flm = np.zeros((math.prod(leading), self.bandlimit**2), dtype=np.complex128)
        for one, out in zip(values.reshape(len(flm), theta.size), flm, strict=True):
            sums.from_points(one, out)
        if self.real:
            fill_negative_orders(flm)
        return flm.reshape(*leading, self.bandlimit**2)

    def resample(self, maps: Array, target: Sampling | str) -> Array:
        """Compute the maps' values on another grid, exactly for band-limited signals.

        Parameters
        ----------
        maps : ndarray, shape (..., rings, phi)
            Maps on this transform's grid.
        target : Sampling or str
            The other grid, of this bandlimit or a larger one; a name means this one.

        Returns
        -------
        ndarray, shape (..., rings, phi), complex128 (float64 if ``real``)
            Maps on the target.

        Raises
        ------
        ParameterError
            If the target is not a grid, or cannot hold the bandlimit.
        ShapeError, DataError
            As `analysis`.

        Examples
        --------
        >>> from spinsdw.sampling import GaussLegendre
        >>> transform = SpinHarmonicTransform(8, real=True)
        >>> transform.resample(np.ones((8, 15)), GaussLegendre(10)).shape
        (10, 19)
        """
        bandlimit = target.bandlimit if isinstance(target, Sampling) else self.bandlimit
        if bandlimit < self.bandlimit:
            msg = (
                f"target has bandlimit {bandlimit}, which cannot hold signals of bandlimit "
                f"{self.bandlimit}; take one as large, or cut the coefficients off by "
                "harmonics.resize between analysis and synthesis."
            )
            raise ParameterError(msg)
        other = self._other(bandlimit, self.spin, target)
        return other.synthesis(resize(self.analysis(maps), bandlimit))

    def _other(
        self, bandlimit: int, spin: int, sampling: Sampling | str, *, real: bool | None = None
    ) -> SpinHarmonicTransform:
        real = self.real if real is None else real
        return SpinHarmonicTransform(
            bandlimit,
            spin,
            sampling=sampling,
            real=real,
            threads=self.threads,
            dtype=self.dtype,
            max_memory=self.max_memory,
        )

    def rotate(self, maps: Array, rotation: Sequence[float]) -> Array:
        """Turn signals about z by gamma, then y by beta, then z by alpha; see `rotate_flm`.

        Parameters
        ----------
        maps : ndarray, shape (..., rings, phi)
            Maps on the grid.
        rotation : sequence of 3 floats
            Euler angles alpha, beta, gamma in radians, zyz.

        Returns
        -------
        ndarray, shape (..., rings, phi)
            The turned signals, those with spin in the frame of where they now are.

        Raises
        ------
        ParameterError
            If the rotation is not three finite numbers.
        ShapeError, DataError
            As `analysis`.
        """
        flm = self.analysis(maps)
        return self.synthesis(rotate_flm(flm, rotation, real=self.real, threads=self.threads))

    def raise_spin(self, maps: Array) -> Array:
        """Apply eth (eq-eth) to maps; those of spin ``spin + 1`` on the same grid are complex.

        Shapes and errors are those of `analysis`; spin + 1 must be below the bandlimit. Minus
        `lower_spin` of the transform of spin + 1 is the adjoint, in the integral over the sphere.
        """
        other = self._other(self.bandlimit, self.spin + 1, self.sampling, real=False)
        return other.synthesis(raise_spin(self.analysis(maps), self.spin))

    def lower_spin(self, maps: Array) -> Array:
        """Apply eth-bar (eq-eth) to maps, which gives spin ``spin - 1``; as `raise_spin`."""
        other = self._other(self.bandlimit, self.spin - 1, self.sampling, real=False)
        return other.synthesis(lower_spin(self.analysis(maps), self.spin))
