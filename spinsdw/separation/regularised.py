r"""What the methods that fit E and B share: the prior, the noise, the solver, and the residual.

With nothing given the prior is flat, :math:`\ell(\ell+1) C^E_\ell / 2\pi` constant, and the noise
is a small share of it: the fit then depends on neither scale, so that the unit of the map does not
matter.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.harmonics import check_integer
from spinsdw.separation.inputs import check_spectrum
from spinsdw.separation.least_squares import Convergence, EBPrior, LeastSquares, Observation
from spinsdw.separation.low_degrees import LowDegreeBlock
from spinsdw.separation.method import Estimate
from spinsdw.separation.survey import Survey

__all__ = ["FitChoices", "RegularisedFit", "flat_spectrum", "separate_whole"]

Array = np.ndarray[Any, Any]

# n / sqrt(D^E) in radians where the user says nothing: 1 uK arcmin for a D^E of 1 uK^2.
_NOISE_SHARE = math.pi / 10800


def flat_spectrum(survey: Survey) -> Array:
    """Return C_l = 2 pi / (l (l + 1)), zero at l < 2.

    It is not smoothed by the beam: a prior that falls below the noise at small scales would leave
    E there in the residual.
    """
    el = np.arange(survey.bandlimit, dtype=np.float64)
    spectrum = np.zeros(survey.bandlimit)
    spectrum[2:] = 2 * np.pi / (el[2:] * (el[2:] + 1))
    return spectrum


def separate_whole(survey: Survey, p: Array) -> Estimate:
    """Separate maps of the full sky, where E and B are known and nothing has to be assumed."""
    plm, fit = survey.sky.polarisation_coefficients(p)
    return Estimate(survey.transform.analysis_harmonic(plm), fit)


@dataclass(frozen=True, eq=False)
class FitChoices:
    """Free choices of a regularised fit.

    Parameters
    ----------
    e_spectrum, b_spectrum : ndarray, shape (at least bandlimit,), optional
        C_l of the sky without beam, the square of the map's unit; both or none.
    noise_level : float, optional
        Noise of Q and of U, in the map's unit times radians, where mask and relative inverse noise
        are 1. None: 1 arcmin times the root of the flat prior's l (l + 1) C_l / 2 pi.
    b_share : float
        C^B_l / C^E_l of the flat prior.
    max_iterations : int
        The most steps of conjugate gradients.
    tolerance : float
        The preconditioned gradient has to fall by this factor.

    Raises
    ------
    ParameterError
        If a number is out of range, or one spectrum is given without the other or the noise.
    """

    e_spectrum: Array | None = None
    b_spectrum: Array | None = None
    noise_level: float | None = None
    b_share: float = 0.0
    max_iterations: int = 100
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        check_integer(self.max_iterations, "max_iterations", minimum=1, remedy="100 is usual")
        if not 0 <= self.tolerance < 1:
            msg = f"tolerance={self.tolerance} must be in [0, 1); 1e-4 is usual."
            raise ParameterError(msg)
        if not (math.isfinite(self.b_share) and self.b_share >= 0):
            msg = f"b_share={self.b_share} must be finite and at least 0; 3e-5 is usual."
            raise ParameterError(msg)
        level = self.noise_level
        if level is not None and not (math.isfinite(level) and level > 0):
            msg = (
                f"noise_level={level} must be positive and finite, in the map's unit times radians."
            )
            raise ParameterError(msg)
        if (self.e_spectrum is None) != (self.b_spectrum is None):
            msg = "e_spectrum and b_spectrum must both be given, or none; zeros are a spectrum too."
            raise ParameterError(msg)
        if self.e_spectrum is not None and level is None:
            msg = "noise_level=None leaves spectra without a scale; give the noise in their unit."
            raise ParameterError(msg)


@dataclass(frozen=True, eq=False)
class RegularisedFit:
    """The fit of E and B for one survey, with its choices."""

    survey: Survey
    choices: FitChoices

    def prior(self, amplitude: float = 1.0) -> EBPrior:
        """Return the prior variances; ``amplitude`` is l (l + 1) C^E_l / 2 pi of the flat one."""
        chosen, survey = self.choices, self.survey
        if chosen.e_spectrum is None or chosen.b_spectrum is None:
            flat = amplitude * flat_spectrum(survey)
            return EBPrior(flat, chosen.b_share * flat)
        e, b = (
            check_spectrum(one, survey.bandlimit) for one in (chosen.e_spectrum, chosen.b_spectrum)
        )
        return EBPrior(e * survey.beam**2, b * survey.beam**2)

    @functools.cached_property
    def _solvers(self) -> dict[int, LeastSquares]:
        return {}

    def solver_for(self, p: Array) -> LeastSquares:
        """Return the solver for a stack of maps; the same one where no scale was given."""
        chosen = self.choices
        if chosen.e_spectrum is not None or chosen.noise_level is None:
            return self._solver(0)
        # Amplitudes a tenth of a decade apart share a solver.
        return self._solver(round(10 * math.log10(self._amplitude(p))))

    def noise_level(self, p: Array) -> float:
        """Return the noise given, or else the share of the power of a stack that stands for it."""
        level = self.choices.noise_level
        return _NOISE_SHARE * math.sqrt(self._amplitude(p)) if level is None else level

    def _amplitude(self, p: Array) -> float:
        """Return the flat prior's l (l + 1) C_l / 2 pi that has the power of the maps."""
        survey = self.survey
        seen = np.broadcast_to(survey.weights, p.shape)
        power = float(np.sum(seen * np.abs(p) ** 2) / np.sum(seen))
        el = np.arange(survey.bandlimit)
        one = float(np.sum((2 * el + 1) * flat_spectrum(survey)) / (4 * np.pi))
        return power / one if power > 0 else 1.0

    def _solver(self, decibels: int) -> LeastSquares:
        if decibels not in self._solvers:
            survey, chosen = self.survey, self.choices
            level = _NOISE_SHARE if chosen.noise_level is None else chosen.noise_level
            seen = Observation(survey.sky, survey.weights, level)
            prior = self.prior(10 ** (decibels / 10))
            block = LowDegreeBlock(seen, prior) if self.is_wide else None
            self._solvers[decibels] = LeastSquares(
                seen, prior, chosen.max_iterations, chosen.tolerance, block
            )
        return self._solvers[decibels]

    @property
    def is_wide(self) -> bool:
        """Whether the footprint is so wide that a block of low degrees is nearly on its own."""
        return self.survey.sky_fraction > 0.05

    def fit(self, p: Array) -> tuple[Array, tuple[Convergence, ...]]:
        """Return p_lm of the fit for each map of a stack, and how the fits went."""
        return self.solver_for(p).solve(p)

    def residual(self, p: Array, plm: Array) -> Array:
        """Return the coefficients of what a fit leaves of the observed maps.

        Added to the fit they make it faithful to the data wherever there are data, at the degrees
        that the prior has held down; where there are none the fit stays as it is.
        """
        survey = self.survey
        left = survey.footprint * (p - survey.sky.polarisation_map(plm))
        return survey.sky.weighted_coefficients(left, survey.bandlimit, 2)
