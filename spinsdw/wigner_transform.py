"""`WignerTransform`: exact transforms on the rotation group, for the orders n asked for."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.grid_sums import GridSums, cleared_flm
from spinsdw.harmonics import check_bandlimit, check_flm, check_integer
from spinsdw.harmonics import orders as orders_of
from spinsdw.memory import MemoryEstimate, check_max_memory
from spinsdw.parallel import resolve_threads
from spinsdw.sampling import Sampling, resolve_sampling
from spinsdw.signals import check_flag, check_map, writable

__all__ = ["WignerTransform", "check_orders"]

Array = np.ndarray[Any, Any]


def check_orders(orders: Sequence[int], bandlimit: int) -> tuple[int, ...]:
    """Return orders n as a tuple of ints, distinct, increasing and below the bandlimit in size."""
    if not isinstance(orders, Iterable):
        msg = f"orders={orders!r} must be a sequence of integers; pass a tuple."
        raise ParameterError(msg)
    values = tuple(check_integer(n, "orders", remedy="each is one") for n in orders)
    if not values or sorted(set(values)) != list(values):
        msg = f"orders={values} must be distinct integers in increasing order; sort them."
        raise ParameterError(msg)
    largest = max(abs(n) for n in values)
    if largest >= bandlimit:
        msg = f"orders reach {largest}, which must stay below bandlimit={bandlimit}; drop the rest."
        raise ParameterError(msg)
    return values


@dataclass(frozen=True, eq=False)
class WignerTransform:
    """Transform between functions of (alpha, beta, gamma) and their Wigner coefficients.

    W(rho) = sum_lmn (2l+1)/(8 pi^2) W_lmn conj(D^l_mn(rho)), sampled at (beta, alpha) = (theta,
    phi) of a grid of the sphere and at the fewest gamma that tell the orders apart
    (McEwen et al. 2015, arXiv:1508.03101; `conventions`).

    Parameters
    ----------
    bandlimit : int
        L: degrees are l < L.
    orders : sequence of int
        The orders n present, increasing, |n| < L.
    sampling : str or Sampling, default "mw"
        Grid in (beta, alpha), as in `SpinHarmonicTransform`.
    real : bool, default False
        Whether functions are real; the orders must then be symmetric about 0.
    threads : int, optional
        Threads to use; all cores when None.
    max_memory : int, optional
        Bytes that a call may take by `memory_estimate`; one that would take more is refused before
        it allocates anything. No limit when None.

    Notes
    -----
    Orders n0, n0 + q, ... up to the last, q the greatest common step, need as many samples as there
    are terms: gamma_k = 2 pi k / (q terms). For the wavelets' orders (step 2) these are N angles in
    [0, pi). Cost O(orders L^3).

    Examples
    --------
    >>> import numpy as np
    >>> transform = WignerTransform(8, orders=(-2, 0, 2))
    >>> coefficients = np.zeros((3, 64), dtype=complex)
    >>> coefficients[2, 4 * 4 + 4 - 1] = 1.0
    >>> found = transform.analysis(transform.synthesis(coefficients))
    >>> bool(np.allclose(found, coefficients, rtol=0, atol=1e-13))
    True
    """

    bandlimit: int
    orders: tuple[int, ...]
    sampling: Sampling | str = "mw"
    real: bool = False
    threads: int | None = None
    max_memory: int | None = None

    def __init__(  # noqa: PLR0913 - what describes a transform
        self,
        bandlimit: int,
        orders: Sequence[int],
        *,
        sampling: str | Sampling = "mw",
        real: bool = False,
        threads: int | None = None,
        max_memory: int | None = None,
    ) -> None:
        bandlimit = check_bandlimit(bandlimit)
        checked = check_orders(orders, bandlimit)
        real = check_flag(real, "real")
        if real and tuple(-n for n in reversed(checked)) != checked:
            msg = f"real=True needs orders symmetric about 0, not {checked}; add the missing signs."
            raise ParameterError(msg)
        resolve_threads(threads)
        budget = check_max_memory(max_memory)
        values = (bandlimit, checked, resolve_sampling(sampling, bandlimit), real, threads, budget)
        for name, value in zip(self.__dataclass_fields__, values, strict=True):
            object.__setattr__(self, name, value)

    @property
    def gammas(self) -> Array:
        """Third Euler angle of each sample in radians; float64, shape (n_gamma,)."""
        step = math.gcd(*(n - self.orders[0] for n in self.orders)) or 1
        terms = (self.orders[-1] - self.orders[0]) // step + 1
        return 2 * np.pi * np.arange(terms) / (step * terms)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of one function: (gammas, rings, points on a ring)."""
        return (self.gammas.size, *self._grid.shape)

    @property
    def _grid(self) -> Sampling:
        return self.sampling  # type: ignore[return-value]

    @property
    def _sums(self) -> GridSums:
        mixing = np.exp(1j * np.outer(self.gammas, self.orders))
        return GridSums(self._grid, self.orders, mixing, self.real, resolve_threads(self.threads))

    def _weights(self, per_degree: Array) -> Array:
        weights = np.zeros((len(self.orders), self.bandlimit), dtype=np.complex128)
        for row, n in zip(weights, self.orders, strict=True):
            row[abs(n) :] = per_degree[abs(n) :]
        return weights

    @property
    def _synthesis_weights(self) -> Array:
        return self._weights((2 * np.arange(self.bandlimit) + 1) / (8 * np.pi**2))

    @property
    def _analysis_weights(self) -> Array:
        return self._weights(np.full(self.bandlimit, 2 * np.pi / self.gammas.size))

    def memory_estimate(self, batch: int = 1) -> dict[str, MemoryEstimate]:
        """Return the bytes that one call of each method takes.

        Parameters
        ----------
        batch : int, default 1
            Functions handed over in one call.

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
        >>> found = WignerTransform(512, orders=(-2, 0, 2)).memory_estimate()["analysis"]
        >>> found.input == 16 * 3 * 512 * 1023, found.output == 16 * 3 * 512**2
        (True, True)
        """
        batch = check_integer(batch, "batch", minimum=0)
        sums = self._sums
        coefficients = batch * 16 * len(self.orders) * self.bandlimit**2
        functions = batch * math.prod(self.shape) * sums.maps_itemsize
        plain, exact = (sums.working_bytes(quadrature=one) for one in (False, True))
        return {
            "synthesis": MemoryEstimate(coefficients, functions, plain),
            "analysis": MemoryEstimate(functions, coefficients, exact),
            "adjoint_synthesis": MemoryEstimate(functions, coefficients, plain),
            "adjoint_analysis": MemoryEstimate(coefficients, functions, exact),
        }

    def _check_memory(self, call: str, batch: tuple[int, ...]) -> None:
        if self.max_memory is not None:
            self.memory_estimate(math.prod(batch))[call].require(self.max_memory, call)

    def _to_functions(self, coefficients: Array, weights: Array, *, quadrature: bool) -> Array:
        call = "adjoint_analysis" if quadrature else "synthesis"
        self._check_memory(call, np.shape(coefficients)[:-2])
        values = writable(check_flm(coefficients, self.bandlimit, "coefficients"))
        expected = (len(self.orders), self.bandlimit**2)
        if values.shape[-2:] != expected:
            msg = (
                f"coefficients has shape {values.shape}; it must be (..., {expected[0]}, "
                f"{expected[1]}), one row for each of the orders."
            )
            raise ShapeError(msg)
        batch = values.reshape(-1, *expected)
        maps = np.empty((batch.shape[0], *self.shape), dtype=self._sums.maps_dtype)
        for one, out in zip(batch, maps, strict=True):
            self._sums.to_grid(one, weights, quadrature=quadrature, out=out)
        return maps.reshape(*values.shape[:-2], *self.shape)

    def _to_coefficients(self, functions: Array, weights: Array, *, quadrature: bool) -> Array:
        call = "analysis" if quadrature else "adjoint_synthesis"
        self._check_memory(call, np.shape(functions)[:-3])
        values = check_map(functions, self.shape, real=self.real, name="function")
        batch = values.reshape(-1, *self.shape)
        size = (batch.shape[0], len(self.orders), self.bandlimit**2)
        found = cleared_flm(size)
        for one, out in zip(batch, found, strict=True):
            self._sums.from_grid(one, weights, out=out, quadrature=quadrature)
            if self.real:
                self._fill_negative(out)
        return found.reshape(*values.shape[:-3], *size[1:])

    def _fill_negative(self, found: Array) -> None:
        """W_{l,-m,-n} = (-1)^(m+n) conj(W_lmn) of a real function."""
        el = np.arange(self.bandlimit)
        opposite = found[::-1].copy()
        signs = (-1.0) ** np.array(self.orders)[:, None]
        for m in range(1, self.bandlimit):
            base = el[m:] ** 2 + el[m:]
            found[..., base - m] = (-1.0) ** m * signs * opposite[..., base + m].conj()
        # Of order m = 0, those of n < 0 follow from those of n > 0, and n = 0 is its own opposite.
        zero, middle = el**2 + el, len(self.orders) // 2
        found[:middle, zero] = (signs * opposite[:, zero].conj())[:middle]
        if 0 in self.orders:
            found.imag[middle, zero] = 0.0

    def synthesis(self, coefficients: Array) -> Array:
        """Compute functions from Wigner coefficients.

        Parameters
        ----------
        coefficients : ndarray, shape (..., orders, bandlimit**2), complex
            W_lmn; last axis [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)],
            entries with el < |n| do not contribute.

        Returns
        -------
        ndarray, shape (..., gammas, rings, phi), complex128 (float64 if ``real``)
            The functions; leading axes are a batch.

        Raises
        ------
        ShapeError
            If the last two axes have other lengths.
        DataError
            If a coefficient is not a finite number.
        MemoryBudgetError
            If the call would take more than ``max_memory``.
        """
        return self._to_functions(coefficients, self._synthesis_weights, quadrature=False)

    def analysis(self, functions: Array) -> Array:
        """Compute Wigner coefficients W_lmn = int d rho W(rho) D^l_mn(rho), exactly.

        Parameters
        ----------
        functions : ndarray, shape (..., gammas, rings, phi)
            Samples; leading axes are a batch.

        Returns
        -------
        ndarray, shape (..., orders, bandlimit**2), complex128
            The coefficients; the inverse of `synthesis` for band-limited functions.

        Raises
        ------
        ShapeError
            If the last three axes are not the grid's.
        DataError
            If a value is not a finite number, or is complex with ``real``.
        MemoryBudgetError
            If the call would take more than ``max_memory``.
        """
        return self._to_coefficients(functions, self._analysis_weights, quadrature=True)

    def adjoint_synthesis(self, functions: Array) -> Array:
        """Apply the adjoint of `synthesis`; shapes and errors of `analysis`."""
        return self._to_coefficients(functions, self._synthesis_weights, quadrature=False)

    def adjoint_analysis(self, coefficients: Array) -> Array:
        """Apply the adjoint of `analysis`; shapes and errors of `synthesis`."""
        return self._to_functions(coefficients, self._analysis_weights, quadrature=True)

    def correlate(self, flm: Array, glm: Array) -> Array:
        """Compare a field with another in every place and orientation: <f, R_rho g>.

        Parameters
        ----------
        flm : ndarray, shape (..., bandlimit**2), complex
            The field f; leading axes are a batch.
        glm : ndarray, shape (bandlimit**2,), complex
            The field g that is turned, of the same spin, which may be any; of orders in ``orders``
            alone. With ``real`` both are real scalars.

        Returns
        -------
        ndarray, shape (..., gammas, rings, phi), complex128 (float64 if ``real``)
            The integral over the sphere of f times the conjugate of the turned g, at each sample.
            Its Wigner coefficients are those of `rotation_group.correlate_fields`.

        Raises
        ------
        ShapeError
            If a last axis is not bandlimit**2 long, or g is a batch.
        DataError
            If a coefficient is not a finite number, or g has orders that the transform has not.
        MemoryBudgetError
            If the call would take more than ``max_memory``.

        Examples
        --------
        >>> flm = np.arange(16) + 0j
        >>> transform = WignerTransform(4, orders=range(-3, 4))
        >>> energy = transform.correlate(flm, flm)[0, 0].real.max()
        >>> bool(energy < np.vdot(flm, flm).real)
        True
        """
        values = writable(check_flm(flm, self.bandlimit))
        weights = self._correlation_weights(glm)
        batch, sums = values.reshape(-1, self.bandlimit**2), self._sums
        size = batch.shape[0] * math.prod(self.shape) * sums.maps_itemsize
        estimate = MemoryEstimate(values.nbytes, size, sums.working_bytes())
        estimate.require(self.max_memory, "correlate")
        out = np.empty((batch.shape[0], *self.shape), dtype=sums.maps_dtype)
        for one, function in zip(batch, out, strict=True):
            sums.to_grid(one[None], weights, out=function)
        return out.reshape(*values.shape[:-1], *self.shape)

    def _correlation_weights(self, glm: Array) -> Array:
        """conj(g_ln), one row for each of the orders."""
        values = check_flm(glm, self.bandlimit, "glm")
        if values.ndim != 1:
            msg = f"glm has shape {values.shape}; it must be one field, ({self.bandlimit**2},)."
            raise ShapeError(msg)
        weights = np.zeros((len(self.orders), self.bandlimit), dtype=np.complex128)
        rest = values.copy()
        for row, n in zip(weights, self.orders, strict=True):
            el = np.arange(abs(n), self.bandlimit)
            row[abs(n) :] = values[el**2 + el + n].conj()
            rest[el**2 + el + n] = 0.0
        if np.any(rest):
            missing = sorted(set(orders_of(self.bandlimit)[rest != 0].tolist()))
            msg = (
                f"glm has orders {missing} that are not among orders={self.orders}; "
                "make the transform with them, or set them to zero."
            )
            raise DataError(msg)
        return weights
