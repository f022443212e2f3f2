"""The pure estimator: wavelets of the masked derivatives, with a smooth mask for every scale.

With M_j the mask of scale j and chi the scalar of eq-chi,

    W^j(rho) = -<M_j (E~ + i B~), R_rho chi^j>
             = <M_j P, R 2psi^j> + 2 <(eth-bar M_j) P, R 1psi^j> + <(eth-bar^2 M_j) P, R chi^j>:

nothing of E is in its imaginary part, whatever the footprint.  What cannot be told apart is lost,
a taper's width along every edge; fine scales need a narrow one only.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.harmonics import resize
from spinsdw.separation.method import Estimate
from spinsdw.separation.pure_harmonics import pure_harmonics
from spinsdw.separation.smooth_masks import SmoothMask, SmoothMasks
from spinsdw.separation.survey import Survey

__all__ = ["Pure", "PureEstimator"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Pure:
    """Analyse the masked derivatives of the map, with a smooth mask for every scale.

    Parameters
    ----------
    taper : float, default 2.0
        Width of the taper of a scale times the degree at which its wavelets peak, in radians.
    samples : float, default 6.0
        Least width of a taper, in distances between samples: a narrower one has more structure than
        they can integrate, and lets E through.
    widths : mapping of (int or "scaling") to float, optional
        Widths in radians of single scales, instead of those of ``taper``.
    largest_share : float, default 0.8
        Share of the radius of the largest disc in the footprint, in (0, 1), that a width may have:
        tapers of large structures are clipped to it.

    Raises
    ------
    ParameterError
        If a number is out of range.

    Notes
    -----
    The maps are not divided by the masks: band j is that of N^-1 M_j N E, which is about M_j E
    where the mask changes slowly, and ``weights`` says what M_j is. Inverse noise is not used.

    Examples
    --------
    >>> Pure(taper=2.5).largest_share
    0.8
    """

    name: ClassVar[str] = "pure"
    taper: float = 2.0
    samples: float = 6.0
    widths: Mapping[int | str, float] | None = None
    largest_share: float = 0.8

    def __post_init__(self) -> None:
        check_positive(self.taper, "taper", "2.0 keeps most of the sky")
        check_positive(self.samples, "samples", "6.0 suits maps with a beam")
        for key, width in (self.widths or {}).items():
            check_positive(width, f"widths[{key!r}]", "np.radians(2) is a taper of 2 degrees")
        check_positive(self.largest_share, "largest_share", "0.8 is usual")
        if self.largest_share >= 1:
            msg = f"largest_share={self.largest_share!r} must be below 1, or no sky is left."
            raise ParameterError(msg)

    def width(self, survey: Survey, part: int | str) -> float:
        """Return the width wanted for a scale or the scaling part, before it is clipped."""
        if self.widths is not None and part in self.widths:
            return float(self.widths[part])
        return max(self.taper / peak_degree(survey, part), self.samples * survey.sky.spacing)

    def prepare(self, survey: Survey) -> PureEstimator:
        """Return the estimator for a survey.

        Raises
        ------
        ParameterError
            If ``widths`` names a scale that is not there, or the footprint holds no taper.
        """
        parts = tuple(survey.transform.shapes)
        unknown = sorted(set(self.widths or ()) - set(parts), key=str)
        if unknown:
            msg = f"widths has the part {unknown[0]!r}; the parts of these wavelets are {parts}."
            raise ParameterError(msg)
        masks = SmoothMasks(survey.sky, survey.footprint, self.largest_share)
        return PureEstimator(
            survey, {part: masks.of_width(self.width(survey, part)) for part in parts}
        )


@dataclass(frozen=True, eq=False)
class PureEstimator:
    """The pure estimator for one survey.

    Attributes
    ----------
    survey : Survey
        What it was prepared for.
    masks : dict
        The smooth mask of every scale and of the scaling part.
    """

    survey: Survey
    masks: Mapping[int | str, SmoothMask]

    @functools.cached_property
    def weights(self) -> dict[int | str, Array]:
        """The mask of each scale at the positions of its coefficients."""
        transform, found = self.survey.transform, {}
        for part, shape in transform.shapes.items():
            grid = transform.grid_of(part_bandlimit(self.survey, part))
            found[part] = np.broadcast_to(self.masks[part].weights(grid), shape)
        return found

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        survey = self.survey
        if np.all(survey.footprint == 1):
            plm, fit = survey.sky.polarisation_coefficients(p)
            return Estimate(survey.transform.analysis_harmonic(plm), fit)
        return Estimate(survey.transform.analysis_by_part(self._coefficients(p)))

    def _coefficients(self, p: Array) -> dict[int | str, Array]:
        """Return the pure coefficients for every part; parts of one mask share an array."""
        survey = self.survey
        found: dict[int, Array] = {}
        for mask in self.masks.values():
            if id(mask) not in found:
                parts = [part for part, its in self.masks.items() if its is mask]
                limit = max([3, *(part_bandlimit(survey, part) for part in parts)])
                plm = pure_harmonics(survey.sky, mask, p, limit)
                found[id(mask)] = resize(plm, survey.bandlimit)
        return {part: found[id(mask)] for part, mask in self.masks.items()}


def part_bandlimit(survey: Survey, part: int | str) -> int:
    """Return the bandlimit of a scale or of the scaling part."""
    tiling = survey.transform.wavelets.tiling
    return tiling.scaling_bandlimit if part == "scaling" else tiling.scale_bandlimit(int(part))


def peak_degree(survey: Survey, part: int | str) -> int:
    """Return the degree at which the wavelets of a scale peak, and half the scaling bandlimit."""
    tiling = survey.transform.wavelets.tiling
    if part == "scaling":
        return max(1, tiling.scaling_bandlimit // 2)
    return max(1, int(np.argmax(tiling.kernel(int(part)))))


def check_positive(value: object, name: str, remedy: str) -> None:
    """Raise `ParameterError` unless a value is a positive finite number."""
    is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if not is_number or not 0 < float(value) < math.inf:  # type: ignore[arg-type]
        msg = f"{name}={value!r} must be positive and finite; {remedy}."
        raise ParameterError(msg)
