"""The harmonic pure estimator: one mask for all scales (Smith 2006, arXiv:astro-ph/0511629).

What NaMaster's ``purify_b`` and ``purify_e`` do, followed by the wavelets of e and b.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.separation.pure import PureEstimator, check_positive
from spinsdw.separation.report import check_choice
from spinsdw.separation.skies import HealpixSky
from spinsdw.separation.smooth_masks import SmoothMask, SmoothMasks, profile_mask
from spinsdw.separation.survey import Survey

__all__ = ["HarmonicPure"]

Profile = Literal["smooth", "C1", "C2"]


@dataclass(frozen=True)
class HarmonicPure:
    """Separate E and B in harmonic space with one tapered mask, then analyse them by wavelets.

    Parameters
    ----------
    width : float, default 5 degrees
        Width of the taper in radians.
    profile : {"smooth", "C1", "C2"}, default "smooth"
        "smooth" is the mask of `Pure`. "C1" and "C2" are the tapers of `spinsdw.masks.apodise`,
        differentiated in harmonic space as NaMaster does, on HEALPix only.

    Raises
    ------
    ParameterError
        If the width is not positive or the profile not known.

    Examples
    --------
    >>> HarmonicPure(profile="C2").name
    'harmonic-pure'
    """

    name: ClassVar[str] = "harmonic-pure"
    width: float = float(np.radians(5))
    profile: Profile = "smooth"

    def __post_init__(self) -> None:
        check_positive(self.width, "width", "np.radians(5) is a taper of 5 degrees")
        check_choice("profile", self.profile, get_args(Profile))

    def prepare(self, survey: Survey) -> PureEstimator:
        """Return the estimator for a survey.

        Raises
        ------
        ParameterError
            If the footprint holds no such taper, or C1 or C2 is asked for on a grid.
        """
        mask = self._mask(survey)
        return PureEstimator(survey, dict.fromkeys(survey.transform.shapes, mask))

    def _mask(self, survey: Survey) -> SmoothMask:
        sky = survey.sky
        if self.profile == "smooth":
            return SmoothMasks(sky, survey.footprint).of_width(self.width)
        if not isinstance(sky, HealpixSky):
            msg = f"profile={self.profile!r} needs HEALPix maps; use profile='smooth' on a grid."
            raise ParameterError(msg)
        return profile_mask(sky, survey.footprint, self.width, self.profile)
