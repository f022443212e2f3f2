r"""The hybrid method: a joint fit of E and B, and of its residual as much as this mask bears.

E and B are fitted together to the observed map, B with a prior far below that of E, so that what
either could explain goes to E (eq-joint-fit).  Where the data determine B, at large scales, the
fit's B is the estimate: it is continued over holes and edges.  Where the prior holds it down, at
small scales, B is left in the residual, and the wavelets of the residual are added.  Near an edge
the residual of a coarse scale is distorted, near none that of a fine one is.  How much of it is
kept is therefore decided for every wavelet coefficient: for its scale and the share of its
wavelet's energy in the holes, which depends on position and orientation, from the variances of
skies drawn from the prior and separated behind this very mask (eq-residual-gain).
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.harmonics import check_integer
from spinsdw.separation.ensemble import ShareBins, draw_fields, position_areas
from spinsdw.separation.least_squares import EBPrior
from spinsdw.separation.method import Estimate
from spinsdw.separation.regularised import FitChoices, RegularisedFit
from spinsdw.separation.survey import Survey

__all__ = ["Hybrid", "HybridEstimator", "ScaleRegime"]

Array = np.ndarray[Any, Any]

# C^B / C^E of the skies drawn: how much leakage counts against how much loss. The prior of the fit
# is lower, for there it is E that must win wherever the data leave a choice.
_B_SHARE = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class Hybrid:
    """Fit E and B jointly; keep of the residual what the variances behind this mask allow.

    Parameters
    ----------
    e_spectrum, b_spectrum : ndarray, shape (at least bandlimit,), optional
        Prior C_l without beam, the square of the map's unit; both or none, with ``noise_level``.
        None: flat l (l + 1) C_l.
    noise_level : float, optional
        Noise of Q and of U, in the map's unit times radians, where mask and relative inverse noise
        are 1. None: 2 arcmin times the root of the prior's l (l + 1) C^E_l / 2 pi.
    b_share : float, default 3e-5
        C^B_l / C^E_l of the flat prior. Larger values keep more of B and leak more of E.
    max_iterations : int, default 50
        The most steps of conjugate gradients.
    tolerance : float, default 1e-4
        The fit stops when its preconditioned gradient has fallen by this factor.
    draws : int, default 4
        Skies of each kind that are separated to prepare a mask.
    seed : int, default 0
        Seed of these skies.

    Raises
    ------
    ParameterError
        If a number is out of range, or one spectrum is given without the other or the noise.
    """

    name: ClassVar[str] = "hybrid"
    e_spectrum: Array | None = None
    b_spectrum: Array | None = None
    noise_level: float | None = None
    b_share: float = 3e-5
    max_iterations: int = 50
    tolerance: float = 1e-4
    draws: int = 4
    seed: int = 0

    def __post_init__(self) -> None:
        self._choices  # noqa: B018 - it checks itself
        check_integer(self.draws, "draws", minimum=2, remedy="4 are usual")
        check_integer(self.seed, "seed", minimum=0, remedy="0 is the default")

    @functools.cached_property
    def _choices(self) -> FitChoices:
        e, b = (
            None if one is None else np.asarray(one, np.float64)
            for one in (self.e_spectrum, self.b_spectrum)
        )
        return FitChoices(
            e, b, self.noise_level, self.b_share, self.max_iterations, self.tolerance
        )

    def __repr__(self) -> str:
        spectra = "flat" if self.e_spectrum is None else "given"
        names = ("noise_level", "b_share", "max_iterations", "tolerance", "draws", "seed")
        values = ", ".join(f"{name}={getattr(self, name)}" for name in names)
        return f"Hybrid(spectra={spectra}, {values})"

    def prepare(self, survey: Survey) -> HybridEstimator:
        """Return the estimator for a survey."""
        fit = RegularisedFit(survey, self._choices)
        return HybridEstimator(survey, fit, self.draws, self.seed)


@dataclass(frozen=True, eq=False)
class ScaleRegime:
    """What is done at one scale, as functions of the share of a wavelet's energy in the holes.

    Attributes
    ----------
    shares : ndarray, shape (bins,), float64
        Mean share of each bin, increasing.
    gains : ndarray, shape (bins,), float64
        How much of the residual's B is added to that of the fit, in [0, 1] (eq-residual-gain).
    kept : ndarray, shape (bins,), float64
        Squared correlation of the estimate with the true B of prior skies, in [0, 1].
    """

    shares: Array
    gains: Array
    kept: Array

    def gain(self, share: Array) -> Array:
        """Return the gain at given shares."""
        return np.interp(share, self.shares, self.gains)

    def retained(self, share: Array) -> Array:
        """Return the squared correlation at given shares; nothing is kept where nothing is seen."""
        shares = np.append(self.shares, 1.0)
        return np.interp(share, shares, np.append(self.kept, 0.0)) * (share < 1)


@dataclass(frozen=True, eq=False)
class HybridEstimator:
    """The hybrid method for one survey."""

    survey: Survey
    fit: RegularisedFit
    draws: int
    seed: int

    @functools.cached_property
    def regimes(self) -> Mapping[int | str, ScaleRegime]:
        """What is done at each scale, and at the scaling part."""
        survey = self.survey
        if survey.mask is None:
            full = ScaleRegime(np.zeros(1), np.ones(1), np.ones(1))
            return dict.fromkeys(survey.transform.shapes, full)
        skies = draw_fields(self._drawn_from, self.draws, self.seed)
        drawn = np.concatenate(skies)
        p = survey.observed * survey.sky.polarisation_map(drawn)
        fitted, left, _ = self._parts(p)
        truth = survey.transform.analysis_harmonic(drawn)
        return {
            key: _regime(
                ShareBins(share, *_geometry(survey, key)),
                *(-_part(one, key).imag for one in (fitted, left, truth)),
            )
            for key, share in survey.shares.items()
        }

    @property
    def _drawn_from(self) -> EBPrior:
        """The spectra of the skies drawn: those given, or flat ones with a B worth finding."""
        prior, choices = self.fit.prior(), self.fit.choices
        if choices.e_spectrum is not None:
            return prior
        return EBPrior(prior.e_spectrum, max(choices.b_share, _B_SHARE) * prior.e_spectrum)

    @functools.cached_property
    def weights(self) -> dict[int | str, Array]:
        """Share of the variance of B that the estimate retains, by the skies drawn."""
        shares = self.survey.shares
        if self.survey.mask is None:
            return {key: np.ones(share.shape) for key, share in shares.items()}
        return {key: regime.retained(shares[key]) for key, regime in self.regimes.items()}

    def _parts(self, p: Array) -> tuple[WaveletCoefficients, WaveletCoefficients, Any]:
        """Return the coefficients of the fit, those of its residual, and how the fit went."""
        analysis = self.survey.transform.analysis_harmonic
        plm, convergence = self.fit.fit(p)
        return analysis(plm), analysis(self.fit.residual(p, plm)), convergence

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        fitted, left, convergence = self._parts(p)
        if self.survey.mask is None:
            return Estimate(fitted + left, convergence=convergence)
        shares = self.survey.shares
        gains = {key: regime.gain(shares[key]) for key, regime in self.regimes.items()}
        # E leaks nothing that matters into itself: all of its residual is kept.
        kept = left.map(np.real) + 1j * (left.map(np.imag) * gains)
        return Estimate(fitted + kept, convergence=convergence)


def _part(coefficients: WaveletCoefficients, key: int | str) -> Array:
    return coefficients.scaling if key == "scaling" else coefficients[int(key)]


def _geometry(survey: Survey, key: int | str) -> tuple[Array, float]:
    """Return the areas of a part's positions, and how many modes it has on the sphere."""
    tiling = survey.transform.wavelets.tiling
    if key == "scaling":
        size, profile = tiling.scaling_bandlimit, tiling.scaling_kernel
    else:
        size, profile = tiling.scale_bandlimit(int(key)), tiling.kernel(int(key))
    degrees = 2 * np.arange(profile.size) + 1
    power = profile**2
    # sum (2l+1) k^2 squared over sum (2l+1) k^4: the modes of a band with this profile.
    summed, squared = float(degrees @ power), float(degrees @ power**2)
    modes = summed**2 / squared if squared > 0 else 0.0
    return position_areas(survey.transform.grid_of(size)), modes


def _regime(bins: ShareBins, fitted: Array, left: Array, truth: Array) -> ScaleRegime:
    """Measure gain and correlation in every bin, from stacks of E alone and then of B alone."""
    count = len(truth) // 2
    shares, gains, kept = [], [], []
    for inside in bins:
        mean = functools.partial(bins.mean, inside=inside)
        missing = truth[count:] - fitted[count:]
        power = mean(left**2)
        wanted = mean(missing * left[count:]) - mean(fitted[:count] * left[:count])
        gain = float(np.clip(wanted / (2 * power), 0, 1)) if power > 0 else 1.0
        found = fitted + gain * left
        cross, total = mean(found[count:] * truth[count:]), 2 * mean(found**2)
        true = mean(truth[count:] ** 2)
        shares.append(bins.mean(bins.share[None], inside))
        gains.append(gain)
        kept.append(min(max(cross, 0.0) ** 2 / (total * true), 1.0) if total * true > 0 else 0.0)
    return ScaleRegime(np.array(shares), np.array(gains), np.array(kept))
