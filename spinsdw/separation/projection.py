r"""E-projection: fit E to the whole observed map, and look for B in what is left.

A full-sky, band-limited E field is fitted to P behind the mask by least squares with a weak prior
(eq-projection).  What it leaves holds B and almost no E, whatever the shape of the mask, so that
the wavelets of the residual see hardly any leakage.  It is the limit of the recycling method,
reached by conjugate gradients instead of fixed-point iterations.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.separation.method import Estimate
from spinsdw.separation.regularised import FitChoices, RegularisedFit, separate_whole
from spinsdw.separation.survey import Survey

__all__ = ["Projection", "ProjectionEstimator"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False, repr=False)
class Projection:
    """Subtract the E field that fits the observed map best, then take wavelets of the rest.

    Parameters
    ----------
    e_spectrum : ndarray, shape (at least bandlimit,), optional
        Prior C_l of E without beam, the square of the map's unit; needs ``noise_level``. None: a
        flat l (l + 1) C_l, which loses nothing against the true one.
    noise_level : float, optional
        Noise of Q and of U, in the map's unit times radians, where mask and relative inverse noise
        are 1. None: 1 arcmin times the root of the prior's l (l + 1) C_l / 2 pi.
    max_iterations : int, default 25
        The most steps of conjugate gradients.
    tolerance : float, default 1e-4
        The fit stops when its preconditioned gradient has fallen by this factor.

    Raises
    ------
    ParameterError
        If a number is out of range.
    """

    name: ClassVar[str] = "projection"
    e_spectrum: Array | None = None
    noise_level: float | None = None
    max_iterations: int = 25
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        self._choices  # noqa: B018 - it checks itself

    @functools.cached_property
    def _choices(self) -> FitChoices:
        spectrum = None if self.e_spectrum is None else np.asarray(self.e_spectrum, np.float64)
        none = None if spectrum is None else np.zeros_like(spectrum)
        return FitChoices(
            spectrum, none, self.noise_level, 0.0, self.max_iterations, self.tolerance
        )

    def __repr__(self) -> str:
        shape = "flat" if self.e_spectrum is None else "given"
        return (
            f"Projection(e_spectrum={shape}, noise_level={self.noise_level}, "
            f"max_iterations={self.max_iterations}, tolerance={self.tolerance})"
        )

    def prepare(self, survey: Survey) -> ProjectionEstimator:
        """Return the estimator for a survey."""
        return ProjectionEstimator(survey, RegularisedFit(survey, self._choices))


@dataclass(frozen=True, eq=False)
class ProjectionEstimator:
    """The projection for one survey."""

    survey: Survey
    fit: RegularisedFit

    @property
    def weights(self) -> dict[int | str, Array]:
        """Share of each wavelet's energy on the observed sky."""
        return self.survey.seen_shares

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        if self.survey.mask is None:
            return separate_whole(self.survey, p)
        plm, convergence = self.fit.fit(p)
        plm += self.fit.residual(p, plm)
        coefficients = self.survey.transform.analysis_harmonic(plm)
        return Estimate(coefficients, convergence=convergence)
