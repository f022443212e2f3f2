"""The pseudo estimator: weigh each wavelet coefficient of the masked map by what it can see.

The three steps of McEwen et al. 2014 (arXiv:1412.1340): a spin wavelet transform of M (Q + iU); a
mitigation of the mask in wavelet space; a scalar synthesis of minus the real and imaginary parts.
The weights depend on scale, position and orientation through the share of each wavelet's energy
that falls where the sky is not observed.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.masks import taper
from spinsdw.separation.inputs import check_largest_share
from spinsdw.separation.method import Estimate
from spinsdw.separation.survey import Survey

__all__ = ["Pseudo", "PseudoEstimator"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Pseudo:
    """Weigh the coefficients of the masked map by the sky their wavelets see (eq-share-weights).

    Parameters
    ----------
    largest_share : float, default 0.2
        Share of its energy in the hole, in (0, 1], at which a coefficient is dropped.

    Raises
    ------
    ParameterError
        If the share is out of range.
    """

    name: ClassVar[str] = "pseudo"
    largest_share: float = 0.2

    def __post_init__(self) -> None:
        check_largest_share(self.largest_share)

    def prepare(self, survey: Survey) -> PseudoEstimator:
        """Return the estimator for a survey."""
        return PseudoEstimator(survey, float(self.largest_share))


@dataclass(frozen=True, eq=False)
class PseudoEstimator:
    """The pseudo estimator for one survey."""

    survey: Survey
    largest_share: float

    @functools.cached_property
    def weights(self) -> dict[int | str, Array]:
        """1 where a wavelet sees no hole, falling smoothly to 0 at ``largest_share``."""
        shares = self.survey.shares
        return {key: 1.0 - taper(share / self.largest_share) for key, share in shares.items()}

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        survey = self.survey
        plm, fit = survey.sky.polarisation_coefficients(survey.footprint * p)
        coefficients = survey.transform.analysis_harmonic(plm)
        return Estimate(coefficients if survey.mask is None else coefficients * self.weights, fit)
