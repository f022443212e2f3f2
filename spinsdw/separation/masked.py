"""The plain transform of the masked map: what every method of separation is compared with."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.separation.method import Estimate
from spinsdw.separation.survey import Survey

__all__ = ["Masked", "MaskedEstimator"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Masked:
    """Transform the masked map and weigh nothing, as ``healpy.map2alm`` of M (Q + iU) would.

    On the full sky it is exact.  Behind a mask the E and B of M P are not those of P: the power of
    E along the edge of the mask is found in B (Lewis, Challinor & Turok 2002, eq-masked-leakage).
    """

    name: ClassVar[str] = "masked"

    def prepare(self, survey: Survey) -> MaskedEstimator:
        """Return the estimator for a survey."""
        return MaskedEstimator(survey)


@dataclass(frozen=True, eq=False)
class MaskedEstimator:
    """The plain transform for one survey."""

    survey: Survey

    @functools.cached_property
    def weights(self) -> dict[int | str, Array]:
        """Ones: every coefficient is kept as it is."""
        return {key: np.ones(shape) for key, shape in self.survey.transform.shapes.items()}

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        survey = self.survey
        plm, fit = survey.sky.polarisation_coefficients(survey.footprint * p)
        return Estimate(survey.transform.analysis_harmonic(plm), fit)
