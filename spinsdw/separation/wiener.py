r"""The Wiener filter: the mean of E and B given the map, their spectra and the noise.

No linear method has a smaller mean square error when the spectra are right, so that it is the bound
others are measured against.  It pays with leakage: where the data do not tell E from B it takes the
likelier one, and some E is always found in B (eq-wiener).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.separation.least_squares import EBPrior, LeastSquares, Observation
from spinsdw.separation.low_degrees import LowDegreeBlock
from spinsdw.separation.method import Estimate
from spinsdw.separation.regularised import FitChoices, RegularisedFit
from spinsdw.separation.survey import Survey
from spinsdw.separation.uncertainty import estimate_spectra

__all__ = ["Wiener", "WienerEstimator"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False, repr=False)
class Wiener:
    """Estimate E and B by their posterior mean.

    Parameters
    ----------
    noise_level : float, optional
        Noise of Q and of U, in the map's unit times radians, where mask and relative inverse noise
        are 1; 2 uK arcmin are ``2 * np.pi / 10800``. None, without spectra: 1 arcmin times the root
        of the l (l + 1) C_l / 2 pi of a flat spectrum with the power of the maps.
    e_spectrum, b_spectrum : ndarray, shape (at least bandlimit,), optional
        C_l of the sky without beam, the square of the map's unit; both or none. None: the band
        powers that a fit with a flat prior finds in the maps, a prior that is diagonal in wavelets.
    max_iterations : int, default 200
        The most steps of conjugate gradients.
    tolerance : float, default 1e-5
        The fit stops when its preconditioned gradient has fallen by this factor.

    Raises
    ------
    ParameterError
        If a number is out of range, or one spectrum is given without the other.
    """

    name: ClassVar[str] = "wiener"
    noise_level: float | None = None
    e_spectrum: Array | None = None
    b_spectrum: Array | None = None
    max_iterations: int = 200
    tolerance: float = 1e-5

    def __post_init__(self) -> None:
        self.choices  # noqa: B018 - it checks itself

    @functools.cached_property
    def choices(self) -> FitChoices:
        """The choices of the fit, checked."""
        e, b = (
            None if one is None else np.asarray(one, np.float64)
            for one in (self.e_spectrum, self.b_spectrum)
        )
        return FitChoices(e, b, self.noise_level, 1e-3, self.max_iterations, self.tolerance)

    def __repr__(self) -> str:
        spectra = "estimated" if self.e_spectrum is None else "given"
        return (
            f"Wiener(noise_level={self.noise_level}, spectra={spectra}, "
            f"max_iterations={self.max_iterations}, tolerance={self.tolerance})"
        )

    def prepare(self, survey: Survey) -> WienerEstimator:
        """Return the estimator for a survey."""
        return WienerEstimator(survey, RegularisedFit(survey, self.choices))


@dataclass(frozen=True, eq=False)
class WienerEstimator:
    """The Wiener filter for one survey."""

    survey: Survey
    fit: RegularisedFit

    @property
    def weights(self) -> dict[int | str, Array]:
        """Share of each wavelet's energy on the observed sky."""
        return self.survey.seen_shares

    def _solver(self, p: Array) -> LeastSquares:
        chosen = self.fit.choices
        if chosen.e_spectrum is not None:
            return self.fit.solver_for(p)
        level = self.fit.noise_level(p)
        prior = self._found_prior(p, level)
        seen = Observation(self.survey.sky, self.survey.weights, level)
        block = LowDegreeBlock(seen, prior) if self.fit.is_wide else None
        return LeastSquares(seen, prior, chosen.max_iterations, chosen.tolerance, block)

    def _found_prior(self, p: Array, noise_level: float) -> EBPrior:
        """Return the spectra of a stack, by a fit that prefers E and what it leaves."""
        plm, _ = self.fit.fit(p)
        plm += self.fit.residual(p, plm)
        coefficients = self.survey.transform.analysis_harmonic(plm)
        return estimate_spectra(self.survey, coefficients, noise_level)

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        plm, convergence = self._solver(p).solve(p)
        coefficients = self.survey.transform.analysis_harmonic(plm)
        return Estimate(coefficients, convergence=convergence)
