"""`SpinHarmonicTransform`: exact transforms of spin-s signals on the sphere."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.grid_sums import GridSums, fill_negative_orders
from spinsdw.harmonics import check_bandlimit, check_flm, check_integer
from spinsdw.memory import MemoryEstimate, check_max_memory
from spinsdw.parallel import resolve_threads
from spinsdw.sampling import Sampling, resolve_sampling
from spinsdw.signals import check_flag, check_map, check_spin, writable

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
    max_memory: int | None = None

    def __init__(  # noqa: PLR0913 - what describes a transform
        self,
        bandlimit: int,
        spin: int = 0,
        *,
        sampling: str | Sampling = "mw",
        real: bool = False,
        threads: int | None = None,
        max_memory: int | None = None,
    ) -> None:
        bandlimit = check_bandlimit(bandlimit)
        spin = check_spin(spin, bandlimit)
        real = check_flag(real, "real")
        if real and spin != 0:
            msg = f"real=True needs spin 0, not spin={spin}; a signal with spin is complex."
            raise ParameterError(msg)
        resolve_threads(threads)
        budget = check_max_memory(max_memory)
        values = (bandlimit, spin, resolve_sampling(sampling, bandlimit), real, threads, budget)
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
        return GridSums(self._grid, (-self.spin,), one, self.real, resolve_threads(self.threads))

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
        working = self._sums.working_bytes
        there, back = MemoryEstimate(flm, maps, working), MemoryEstimate(maps, flm, working)
        return {
            "synthesis": there,
            "analysis": back,
            "adjoint_synthesis": back,
            "adjoint_analysis": there,
        }

    def _check_memory(self, call: str, batch: tuple[int, ...]) -> None:
        if self.max_memory is not None:
            self.memory_estimate(math.prod(batch))[call].require(self.max_memory, call)

    def _to_maps(self, flm: Array, *, quadrature: bool) -> Array:
        self._check_memory("adjoint_analysis" if quadrature else "synthesis", np.shape(flm)[:-1])
        flm = writable(check_flm(flm, self.bandlimit))
        batch = flm.reshape(-1, flm.shape[-1])
        maps = np.empty((batch.shape[0], *self.shape), dtype=self._sums.maps_dtype)
        for one, out in zip(batch, maps, strict=True):
            self._sums.to_grid(one[None], self._weights, quadrature=quadrature, out=out[None])
        return maps.reshape(*flm.shape[:-1], *self.shape)

    def _to_coefficients(self, maps: Array, *, quadrature: bool) -> Array:
        self._check_memory("analysis" if quadrature else "adjoint_synthesis", np.shape(maps)[:-2])
        maps = check_map(maps, self.shape, real=self.real)
        batch = maps.reshape(-1, *self.shape)
        flm = np.zeros((batch.shape[0], self.bandlimit**2), dtype=np.complex128)
        for one, out in zip(batch, flm, strict=True):
            self._sums.from_grid(one[None], self._weights, out=out[None], quadrature=quadrature)
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
        ndarray, shape (..., rings, phi), complex128 (float64 if ``real``)
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
            Maps on the grid; leading axes are a batch.

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
