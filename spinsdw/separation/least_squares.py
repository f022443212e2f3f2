r"""Fit full-sky E and B to polarisation observed behind a mask, by regularised least squares.

For weights W and noise power n^2 the fit is the minimum over E and B of

.. math:: \int W \, |P - {}_2Y p|^2 \, d\Omega \, / \, n^2
          + \sum_{lm} |E_{lm}|^2 / C^E_l + \sum_{lm} |B_{lm}|^2 / C^B_l , \quad p = -(E + iB).

With C the covariance of E and B it is their Wiener filter; with C^B = 0 it explains by E whatever
E can explain.  All is done with p, whose real inner product Re <p, p'> is that of the real degrees
of freedom of E and B: p is split by :math:`\bar p_{lm} = (-1)^m p^*_{l,-m}`, E = -(p + p-bar)/2.

In x = C^{-1/2} p the normal equations are (1 + S Y^H W Y S / n^2) x = S Y^H W P / n^2 with
S = C^{1/2}; they are solved by preconditioned conjugate gradients that carry the residual in the
map (CGLS), so that the condition number enters once instead of squared.  A step lowers the sum by
its length times the power of the gradient.  The preconditioner is the
inverse for uniform weights, 1 / (1 + C <W> / n^2).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import check_integer
from spinsdw.parallel import resolve_threads, threads_for
from spinsdw.separation.skies import Sky
from spinsdw.separation.stacks import SplitFilter, Stacks

__all__ = ["STACK", "Convergence", "EBPrior", "LeastSquares", "Observation"]

Array = np.ndarray[Any, Any]

# Maps fitted in step: more share little further work, and their arrays leave the caches.
STACK = 4


@dataclass(frozen=True, eq=False)
class Convergence:
    """How a fit by conjugate gradients went.

    Attributes
    ----------
    iterations : int
        Steps taken.
    residuals : ndarray, shape (iterations + 1,), float64
        Norm of the preconditioned gradient after each step, relative to its start.
    objective : ndarray, shape (iterations + 1,), float64
        The sum that is minimised, after each step: the first from the map, the others by what a
        step of conjugate gradients takes off. It never rises.
    converged : bool
        Whether the last residual is at most the tolerance.
    """

    iterations: int
    residuals: Array = field(repr=False)
    objective: Array = field(repr=False)
    converged: bool

    @property
    def residual(self) -> float:
        """The last residual."""
        return float(self.residuals[-1])


def _check_spectrum(values: object, name: str) -> Array:
    """Return a prior spectrum, zero at degrees 0 and 1, after checking it."""
    spectrum = np.array(values, dtype=np.float64)
    if spectrum.ndim != 1 or spectrum.size < 3:
        msg = f"{name} has shape {spectrum.shape}; it must hold C_l from l = 0 to 2 at least."
        raise ShapeError(msg)
    bad = np.count_nonzero(~(np.isfinite(spectrum) & (spectrum >= 0)))
    if bad:
        msg = f"{name} holds {bad} values that are negative or not finite; a variance is neither."
        raise DataError(msg)
    spectrum[:2] = 0.0
    spectrum.setflags(write=False)
    return spectrum


@dataclass(frozen=True, eq=False)
class EBPrior:
    """Prior variances C_l of E and B.

    Parameters
    ----------
    e_spectrum, b_spectrum : array_like, shape (bandlimit,)
        C_l from l = 0 on, the square of the map's unit; degrees 0 and 1 are not used. Where C_l is
        zero the fit is zero: ``b_spectrum=numpy.zeros(bandlimit)`` fits E alone.

    Raises
    ------
    ShapeError
        If a spectrum is not one-dimensional, or their lengths differ.
    DataError
        If a value is negative or not finite.
    """

    e_spectrum: Array
    b_spectrum: Array

    def __post_init__(self) -> None:
        for name in ("e_spectrum", "b_spectrum"):
            object.__setattr__(self, name, _check_spectrum(getattr(self, name), name))
        if self.e_spectrum.size != self.b_spectrum.size:
            msg = (
                f"e_spectrum has {self.e_spectrum.size} degrees and b_spectrum "
                f"{self.b_spectrum.size}, and they must agree; cut the longer one."
            )
            raise ShapeError(msg)

    @property
    def bandlimit(self) -> int:
        """L: degrees are l < L."""
        return int(self.e_spectrum.size)

    def root(self, threads: int = 1) -> SplitFilter:
        """Return S = C^(1/2) as an operator on p."""
        return SplitFilter(np.sqrt(self.e_spectrum), np.sqrt(self.b_spectrum), threads)

    def preconditioner(self, precision: float, threads: int = 1) -> SplitFilter:
        """Return 1 / (1 + C precision) as an operator on p."""
        e, b = (1 / (1 + precision * one) for one in (self.e_spectrum, self.b_spectrum))
        return SplitFilter(e, b, threads)


@dataclass(frozen=True, eq=False)
class Observation:
    """What an instrument sees of a sky, in units of its noise: the operator W^(1/2) Y / n.

    Parameters
    ----------
    sky : Sky
        The pixelisation.
    weights : ndarray, shape of a map, float64
        W: a mask, or an inverse-noise map relative to 1 / noise_level^2; not negative.
    noise_level : float
        n: the noise of Q and of U where W is 1, in the map's unit times radians. With
        ``noise_level=1`` the weights are inverse noise powers themselves.

    Raises
    ------
    ParameterError
        If the noise level is not positive.
    DataError
        If a weight is negative or not finite, or all are zero.
    """

    sky: Sky
    weights: Array
    noise_level: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.noise_level) and self.noise_level > 0):
            msg = (
                f"noise_level={self.noise_level} must be positive and finite; a noise-free map is "
                "fitted with a level far below its signal's."
            )
            raise ParameterError(msg)
        bad = np.count_nonzero(~(np.isfinite(self.weights) & (self.weights >= 0)))
        if bad or not np.any(self.weights):
            found = f"{bad} values that are negative or not finite" if bad else "only zeros"
            msg = f"weights hold {found}; they must be at least 0 and observe some of the sky."
            raise DataError(msg)

    @functools.cached_property
    def densities(self) -> Array:
        """Inverse noise power of each sample, W dOmega / n^2; shape of a map, float64."""
        return np.ascontiguousarray(self.weights * self.sky.areas / self.noise_level**2)

    @functools.cached_property
    def _root(self) -> Array:
        return np.sqrt(self.densities)

    @functools.cached_property
    def precision(self) -> float:
        """Mean over the sphere of the inverse noise power, <W> / n^2."""
        return float(np.sum(self.densities) / (4 * math.pi))

    def weight_harmonics(self, bandlimit: int) -> Array:
        """Return the coefficients of the inverse noise power W / n^2 below a bandlimit, by sums."""
        return self.sky.area_sums(self.weights, bandlimit) / self.noise_level**2

    def whiten(self, p: Array) -> Array:
        """Return a map in units of the noise; the sum of squares stands for its integral."""
        return np.asarray(self._root * p)

    def observe(self, plm: Array) -> Array:
        """Return what is seen of coefficients, in units of the noise."""
        return self.whiten(self.sky.polarisation_map(plm))

    def adjoint_observe(self, values: Array) -> Array:
        """Apply the adjoint of `observe`."""
        return self.sky.adjoint_polarisation_map(self._root * values)


@dataclass(eq=False)
class _State:
    """Where the fits of a stack are: the weighted remainder, x, and where it goes next."""

    rest: Array
    x: Array
    direction: Array
    power: Array


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """Fit E and B to an observation by preconditioned conjugate gradients.

    Parameters
    ----------
    observation : Observation
        Where the map was observed and how well.
    prior : EBPrior
        Variances of E and B, of the sky's bandlimit.
    max_iterations : int, default 25
        The most steps to take; each costs one synthesis and its adjoint.
    tolerance : float, default 1e-6
        The fit stops when the preconditioned gradient has fallen by this factor; 0 never stops it.
    preconditioner : callable, optional
        Stacks of x to stacks of x: symmetric, positive and near the inverse of the normal
        equations; by default `EBPrior.preconditioner` for the mean weight.

    Raises
    ------
    ParameterError
        If max_iterations or tolerance is out of range, or the bandlimits differ.

    Examples
    --------
    >>> import numpy as np
    >>> from spinsdw.sampling import MW
    >>> from spinsdw.separation.skies import GridSky
    >>> sky, flat = GridSky(MW(8)), np.ones(8)
    >>> observation = Observation(sky, np.ones((8, 15)), 1e-6)
    >>> p = sky.polarisation_map(np.arange(64.0)[None])
    >>> plm, (convergence,) = LeastSquares(observation, EBPrior(flat, flat)).solve(p)
    >>> bool(np.allclose(plm[0, 4:], np.arange(64.0)[4:])), convergence.converged
    (True, True)
    """

    observation: Observation
    prior: EBPrior
    max_iterations: int = 25
    tolerance: float = 1e-6
    preconditioner: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        remedy = "25 suit an E-projection"
        check_integer(self.max_iterations, "max_iterations", minimum=1, remedy=remedy)
        if not 0 <= self.tolerance < 1:
            msg = f"tolerance={self.tolerance} must be in [0, 1); 1e-6 is the default."
            raise ParameterError(msg)
        if self.prior.bandlimit != self.observation.sky.bandlimit:
            msg = (
                f"prior has bandlimit={self.prior.bandlimit} and the sky "
                f"{self.observation.sky.bandlimit}, and they must agree; cut or extend the spectra."
            )
            raise ParameterError(msg)

    @functools.cached_property
    def _preconditioner(self) -> Callable[[Array], Array]:
        if self.preconditioner is not None:
            return self.preconditioner
        return self.prior.preconditioner(self.observation.precision, self._threads)

    @property
    def _threads(self) -> int:
        sky = self.observation.sky
        return threads_for(sky.bandlimit, resolve_threads(sky.threads))

    @functools.cached_property
    def _root(self) -> SplitFilter:
        return self.prior.root(self._threads)

    @functools.cached_property
    def _stacks(self) -> Stacks:
        return Stacks(self._threads)

    @property
    def _densities(self) -> Array:
        return self.observation.densities.reshape(-1)

    def solve(self, p: Array) -> tuple[Array, tuple[Convergence, ...]]:
        """Return the coefficients p_lm that fit each map of a stack best, and how the fits went.

        Parameters
        ----------
        p : ndarray, shape (batch, map), complex128
            P = Q + iU; finite where the weights are not 0, and zero or finite elsewhere.

        Returns
        -------
        plm : ndarray, shape (batch, bandlimit**2), complex128
            -(E_lm + i B_lm); `spinsdw.harmonics.spin_to_eb` splits it.
        convergence : tuple of Convergence
            Steps, residuals and the sum minimised, for each map.
        """
        fits = [self._solve(p[start : start + STACK]) for start in range(0, len(p), STACK)]
        plm = np.concatenate([found for found, _ in fits])
        return plm, tuple(history for _, histories in fits for history in histories)

    def _solve(self, p: Array) -> tuple[Array, tuple[Convergence, ...]]:
        state = self._start(p)
        powers, objective = [state.power], [self._power_seen(p)]
        while len(powers) <= self.max_iterations:
            # A map that has converged stands still: its result does not depend on the stack.
            active = state.power > self.tolerance**2 * powers[0]
            if not active.any():
                break
            step = self._advance(state, active)
            objective.append(objective[-1] - step * powers[-1])
            powers.append(state.power)
        found = self._root(state.x)
        return found, self._histories(np.array(powers), np.array(objective))

    def _power_seen(self, p: Array) -> Array:
        """Return the sum that is minimised for a fit of zero."""
        maps = np.ascontiguousarray(p, dtype=np.complex128).reshape(len(p), -1)
        return self._stacks.weighted_power(self._densities, maps)

    def _start(self, p: Array) -> _State:
        rest = np.asarray(self.observation.densities * p, dtype=np.complex128)
        gradient = self._root(self.observation.sky.adjoint_polarisation_map(rest))
        direction = self._preconditioner(gradient)
        power = self._stacks.product(gradient, direction)
        return _State(rest, np.zeros_like(direction), direction, power)

    def _advance(self, state: _State, active: Array) -> Array:
        """Take one step for the active maps of a stack; return its length."""
        sky, stacks, size = self.observation.sky, self._stacks, len(state.rest)
        ones = np.ones(size)
        change = sky.polarisation_map(self._root(state.direction)).reshape(size, -1)
        curvature = stacks.weighted_power(self._densities, change)
        curvature += stacks.product(state.direction, state.direction)
        step = np.divide(state.power, curvature, out=np.zeros(size), where=active)
        stacks.add(ones, step, state.direction, state.x)
        stacks.subtract(step, self._densities, change, state.rest.reshape(size, -1))
        gradient = self._root(sky.adjoint_polarisation_map(state.rest))
        stacks.add(ones, -ones, state.x, gradient)
        ahead = self._preconditioner(gradient)
        power = np.where(active, stacks.product(gradient, ahead), state.power)
        ratio = np.divide(power, state.power, out=np.zeros(size), where=state.power > 0)
        stacks.add(ratio, ones, ahead, state.direction)
        state.power = power
        return np.asarray(step)

    def _histories(self, powers: Array, objective: Array) -> tuple[Convergence, ...]:
        """Tell how each map's fit went: columns of both arrays, one row a step."""
        found = []
        for steps, sums in zip(powers.T, objective.T, strict=True):
            # A map of zeros is fitted by zeros, without a step.
            residuals = np.sqrt(steps / (steps[0] if steps[0] > 0 else 1.0))
            above = np.flatnonzero(residuals > self.tolerance)
            taken = min(int(above[-1]) + 1 if above.size else 0, steps.size - 1)
            converged = bool(residuals[taken] <= self.tolerance)
            found.append(Convergence(taken, residuals[: taken + 1], sums[: taken + 1], converged))
        return tuple(found)
