"""What a method of separation is: a description, prepared once for a survey, applied to maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.healpix import HealpixFit
from spinsdw.separation.least_squares import Convergence
from spinsdw.separation.survey import Survey

__all__ = ["Estimate", "Estimator", "Method"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False)
class Estimate:
    """What a method makes of a stack of maps.

    Attributes
    ----------
    coefficients : WaveletCoefficients
        Of every map: -Re is E and -Im is B, for scalar wavelets with the coefficients psi_lm.
    fit : HealpixFit or None
        How well harmonic coefficients fitted the maps, where they were fitted without a prior.
    convergence : tuple of Convergence
        How the regularised fit of each map went; empty where there was none.
    """

    coefficients: WaveletCoefficients
    fit: HealpixFit | None = None
    convergence: tuple[Convergence, ...] = ()


class Estimator(Protocol):
    """A method prepared for one survey; what depends on the mask only is computed once."""

    @property
    def weights(self) -> Mapping[int | str, Array]:
        """How much of the sky each coefficient keeps, in [0, 1]; shapes of the coefficients."""
        ...

    def estimate(self, p: Array) -> Estimate:
        """Separate maps P = Q + iU, shape (batch, *map), complex128, zero where the mask is."""
        ...


class Method(Protocol):
    """The description of a method: its free choices, checked when it is made."""

    name: ClassVar[str]

    def prepare(self, survey: Survey) -> Estimator:
        """Return what separates the maps of a survey."""
        ...
