"""The recycling method: make a template of the leakage from the masked map itself, remove it.

Liu, Creswell, von Hausegger & Naselsky 2019 (arXiv:1811.04691): the E of the masked map, turned
back into Q and U and masked again, leaks into B much as the true E did.  That B is a template of
the leakage; it is fitted to the B of the masked map and removed.  Done again with what is left, it
is a fixed-point iteration for the E-projection, which conjugate gradients reach in fewer steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.harmonics import check_integer, eb_to_spin, spin_to_eb
from spinsdw.separation.masked import MaskedEstimator
from spinsdw.separation.method import Estimate
from spinsdw.separation.skies import GridSky
from spinsdw.separation.survey import Survey

__all__ = ["Recycling", "RecyclingEstimator"]

Array = np.ndarray[Any, Any]


# Rounding, and the tolerance of a fit to a HEALPix map, relative to the E that it came from.
_NO_TEMPLATE = 1e-9


def _is_seen(leaked: Array, e_lm: Array) -> Array:
    """Whether a template is more than rounding: without a mask E leaks nothing; (batch, 1)."""
    power, source = (np.linalg.norm(flm, axis=-1, keepdims=True) for flm in (leaked, e_lm))
    return np.asarray(power > _NO_TEMPLATE * source)


@dataclass(frozen=True)
class Recycling:
    """Remove from the B of the masked map what its E leaks there (eq-recycling).

    Parameters
    ----------
    iterations : int, default 5
        How often a template is made, fitted and removed, at least 1; 1 is the published method.

    Raises
    ------
    ParameterError
        If the number is out of range.
    """

    name: ClassVar[str] = "recycling"
    iterations: int = 5

    def __post_init__(self) -> None:
        check_integer(self.iterations, "iterations", minimum=1, remedy="5 removes most")

    def prepare(self, survey: Survey) -> RecyclingEstimator:
        """Return the estimator for a survey."""
        return RecyclingEstimator(survey, int(self.iterations))


@dataclass(frozen=True, eq=False)
class RecyclingEstimator(MaskedEstimator):
    """The recycling method for one survey; like the plain transform it weighs nothing."""

    iterations: int

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        survey = self.survey
        plm, fit = survey.sky.polarisation_coefficients(survey.footprint * p)
        found_e = np.zeros_like(plm)
        for _ in range(self.iterations):
            e_lm, b_lm = spin_to_eb(plm)
            e_only = eb_to_spin(e_lm, np.zeros_like(e_lm))
            seen = survey.footprint * survey.sky.polarisation_map(e_only)
            template, _ = survey.sky.polarisation_coefficients(seen)
            _, leaked = spin_to_eb(template)
            share = np.where(_is_seen(leaked, e_lm), self._regression(b_lm, leaked), 0.0)
            plm = plm - share * template
            found_e += share * e_only
        return Estimate(survey.transform.analysis_harmonic(plm + found_e), fit)

    def _regression(self, b_lm: Array, template: Array) -> Array:
        """Fit templates to the B maps where the sky is observed: one factor for each map."""
        sky = self.survey.sky
        values, fitted = (sky.scalar_map(flm).real for flm in (b_lm, template))
        # Pixels of HEALPix have one area, those of a grid are smaller near the poles.
        areas = np.sin(sky.points[0]) if isinstance(sky, GridSky) else 1.0
        seen, axes = areas * self.survey.footprint, tuple(range(1, values.ndim))
        above = np.sum(seen * values * fitted, axis=axes)
        below = np.sum(seen * fitted**2, axis=axes)
        share = np.divide(above, below, out=np.zeros_like(above), where=below > 0)
        return np.asarray(share[:, None])
