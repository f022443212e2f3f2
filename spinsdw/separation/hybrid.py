r"""The hybrid method: a joint fit of E and B, its residual and its pure residual, by variance.

E and B are fitted together to the observed map, B with a prior far below that of E, so that what
either could explain goes to E (eq-joint-fit).  Three things are then known of B: the B of the fit,
which is continued over holes and edges, and is all there is where the data determine B, at large
scales; the B of the residual, where the prior held B down, at small scales; and the pure B of the
map without the fitted E, which leaks least at the finest scales and is ruinous at large ones.
What each is worth changes with scale and with the distance from the edge, and with the mask.  It is
therefore decided for every wavelet coefficient, by its scale and the share of its wavelet's energy
in the holes (which depends on position and orientation), from the variances of skies drawn from
the prior and separated behind this very mask (eq-regime).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import ParameterError
from spinsdw.harmonics import check_integer, eb_to_spin, spin_to_eb
from spinsdw.separation.ensemble import ShareBins, draw_fields, draw_white, position_areas
from spinsdw.separation.least_squares import STACK, Convergence, EBPrior, LeastSquares
from spinsdw.separation.method import Estimate
from spinsdw.separation.pure_harmonics import pure_harmonics
from spinsdw.separation.regularised import FitChoices, RegularisedFit, separate_whole
from spinsdw.separation.smooth_masks import SmoothMask, SmoothMasks
from spinsdw.separation.survey import Survey

__all__ = ["Hybrid", "HybridEstimator", "ScaleRegime"]

Array = np.ndarray[Any, Any]
_Parts = tuple[WaveletCoefficients, WaveletCoefficients, WaveletCoefficients | None]

# C^B / C^E of the skies drawn: how much the loss of B counts against leakage. It is below that of
# the fit, which loses more of B the lower its prior is.
_B_SHARE = 3e-6
# Power of the noise drawn over that of B, at each scale: how much its growth counts.
_NOISE_RATIO = 0.3
# Width of the taper of the pure estimator where the user says nothing.
_WIDTH = np.radians(1.0)


@dataclass(frozen=True, eq=False, repr=False)
class Hybrid:
    """Fit E and B jointly; combine fit, residual and pure residual by variances behind this mask.

    Parameters
    ----------
    e_spectrum, b_spectrum : ndarray, shape (at least bandlimit,), optional
        Prior C_l without beam, the square of the map's unit; both or none, with ``noise_level``.
        None: flat l (l + 1) C_l.
    noise_level : float, optional
        Noise of Q and of U, in the map's unit times radians, where mask and relative inverse noise
        are 1. None: 1 arcmin times the root of the prior's l (l + 1) C^E_l / 2 pi.
    b_share : float, default 3e-5
        C^B_l / C^E_l of the flat prior. Larger values keep more of B and leak more of E.
    max_iterations : int, default 100
        The most steps of conjugate gradients.
    tolerance : float, default 1e-4
        The fit stops when its preconditioned gradient has fallen by this factor.
    pure_width : float, optional
        Width of the taper of the pure estimator in radians; 0 leaves it out. None: 1 degree, or
        more where the samples do not resolve that.
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
    max_iterations: int = 100
    tolerance: float = 1e-4
    pure_width: float | None = None
    draws: int = 4
    seed: int = 0

    def __post_init__(self) -> None:
        self._choices  # noqa: B018 - it checks itself
        check_integer(self.draws, "draws", minimum=2, remedy="4 are usual")
        check_integer(self.seed, "seed", minimum=0, remedy="0 is the default")
        width = self.pure_width
        if width is not None and not (math.isfinite(width) and width >= 0):
            msg = f"pure_width={width} must be finite and at least 0; np.radians(1) is usual."
            raise ParameterError(msg)

    @functools.cached_property
    def _choices(self) -> FitChoices:
        e, b = (
            None if one is None else np.asarray(one, np.float64)
            for one in (self.e_spectrum, self.b_spectrum)
        )
        return FitChoices(e, b, self.noise_level, self.b_share, self.max_iterations, self.tolerance)

    def __repr__(self) -> str:
        spectra = "flat" if self.e_spectrum is None else "given"
        names = ("noise_level", "b_share", "max_iterations", "tolerance", "pure_width", "draws")
        values = ", ".join(f"{name}={getattr(self, name)}" for name in names)
        return f"Hybrid(spectra={spectra}, {values})"

    def prepare(self, survey: Survey) -> HybridEstimator:
        """Return the estimator for a survey."""
        fit = RegularisedFit(survey, self._choices)
        return HybridEstimator(survey, fit, self)


@dataclass(frozen=True, eq=False)
class ScaleRegime:
    """What is done at one scale, as functions of the share of a wavelet's energy in the holes.

    The estimate of B is W = W_fit + residual * W_residual + pure * (W_pure - W_fit) (eq-regime).

    Attributes
    ----------
    shares : ndarray, shape (bins,), float64
        Mean share of each bin, increasing.
    residual, pure : ndarray, shape (bins,), float64
        What counts of the residual and of the pure residual, in [0, 1].
    kept : ndarray, shape (bins,), float64
        Squared correlation of the estimate with the true B of the skies drawn, in [0, 1].
    """

    shares: Array
    residual: Array
    pure: Array
    kept: Array

    def at(self, share: Array) -> tuple[Array, Array]:
        """Return what counts of residual and pure residual at given shares."""
        return np.interp(share, self.shares, self.residual), np.interp(
            share, self.shares, self.pure
        )

    def retained(self, share: Array) -> Array:
        """Return the squared correlation at given shares; nothing is kept where nothing is seen."""
        shares = np.append(self.shares, 1.0)
        return np.interp(share, shares, np.append(self.kept, 0.0)) * (share < 1)


@dataclass(frozen=True, eq=False)
class _Candidates:
    """Wavelet coefficients of B, one array for each candidate and each stack of skies."""

    fit: Array
    residual: Array
    pure: Array | None

    def estimate(self, residual: Array | float, pure: Array | float) -> Array:
        """Combine the candidates."""
        found = self.fit + residual * self.residual
        return found if self.pure is None else found + pure * (self.pure - self.fit)


@dataclass(frozen=True, eq=False)
class HybridEstimator:
    """The hybrid method for one survey."""

    survey: Survey
    fit: RegularisedFit
    method: Hybrid

    @functools.cached_property
    def _smooth_mask(self) -> SmoothMask | None:
        """The mask of the pure estimator; None where it is not wanted or does not fit."""
        wanted = self.method.pure_width
        if wanted == 0:
            return None
        masks = SmoothMasks(self.survey.sky, self.survey.footprint)
        if masks.widest < masks.narrowest:
            return None
        width = _WIDTH if wanted is None else wanted
        return masks.of_width(max(width, 1.3 * masks.narrowest) if wanted is None else width)

    @functools.cached_property
    def regimes(self) -> Mapping[int | str, ScaleRegime]:
        """What is done at each scale, and at the scaling part."""
        survey, method = self.survey, self.method
        drawn = np.concatenate(draw_fields(self._drawn_from, method.draws, method.seed))
        noise = draw_white(survey, method.draws, method.seed)
        p = survey.observed * survey.sky.polarisation_map(np.concatenate([drawn, noise]))
        p[len(drawn) :] /= np.sqrt(np.where(survey.weights > 0, survey.weights, 1.0))
        parts, _ = self._parts(self._drawn_fit.solver_for(p), p, with_pure=True)
        truth = survey.transform.analysis_harmonic(np.concatenate([drawn, noise]))
        return {
            key: _regime(
                ShareBins(share, *_geometry(survey, key)),
                _candidates(parts, key),
                -_part(truth, key).imag,
            )
            for key, share in survey.shares.items()
        }

    @property
    def _drawn_from(self) -> EBPrior:
        """The spectra of the skies drawn: those given, or flat ones with a B worth finding."""
        prior, choices = self.fit.prior(), self.fit.choices
        if choices.e_spectrum is not None:
            return prior
        return EBPrior(prior.e_spectrum, _B_SHARE * prior.e_spectrum)

    @functools.cached_property
    def weights(self) -> dict[int | str, Array]:
        """Share of the variance of B that the estimate retains, by the skies drawn."""
        shares = self.survey.shares
        if self.survey.mask is None:
            return {key: np.ones(share.shape) for key, share in shares.items()}
        return {key: regime.retained(shares[key]) for key, regime in self.regimes.items()}

    @property
    def _drawn_fit(self) -> RegularisedFit:
        """The fit of the skies drawn: flat ones have no unit that a noise level could be in."""
        choices = self.fit.choices
        if choices.e_spectrum is not None or choices.noise_level is None:
            return self.fit
        return replace(self.fit, choices=replace(choices, noise_level=None))

    def _parts(
        self, solver: LeastSquares, p: Array, *, with_pure: bool
    ) -> tuple[_Parts, tuple[Convergence, ...]]:
        """Return the coefficients of fit, residual and pure residual, and how the fit went."""
        survey, analysis = self.survey, self.survey.transform.analysis_harmonic
        plm, convergence = solver.solve(p)
        left = self.fit.residual(p, plm)
        pure = None
        if with_pure and self._smooth_mask is not None:
            e_lm, _ = spin_to_eb(plm)
            fitted_e = survey.sky.polarisation_map(eb_to_spin(e_lm, np.zeros_like(e_lm)))
            without = survey.observed * (p - fitted_e)
            pure = analysis(pure_harmonics(survey.sky, self._smooth_mask, without))
        return (analysis(plm), analysis(left), pure), convergence

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        if self.survey.mask is None:
            return separate_whole(self.survey, p)
        # As many maps at a time as are fitted in step: more leave the caches in every step.
        stacks = [slice(start, start + STACK) for start in range(0, len(p), STACK)]
        solver = self.fit.solver_for(p)
        found = [self._estimate(solver, p[one]) for one in stacks]
        values = {
            key: np.concatenate([_part(estimate.coefficients, key) for estimate in found])
            for key in self.survey.shares
        }
        scaling = values.pop("scaling")
        scales = {int(key): part for key, part in values.items()}
        coefficients = WaveletCoefficients(scaling, scales, found[0].coefficients.parameters)
        return Estimate(
            coefficients,
            convergence=tuple(one for estimate in found for one in estimate.convergence),
        )

    def _estimate(self, solver: LeastSquares, p: Array) -> Estimate:
        with_pure = any(regime.pure.any() for regime in self.regimes.values())
        (fitted, left, pure), convergence = self._parts(solver, p, with_pure=with_pure)
        # E leaks nothing that matters into itself: all of its residual is kept.
        found = (fitted + left).map(np.real)
        b_parts = {}
        for key, regime in self.regimes.items():
            candidates = _candidates((fitted, left, pure), key)
            b_parts[key] = candidates.estimate(*regime.at(self.survey.shares[key]))
        scales = {j: found[j] - 1j * b_parts[j] for j in found.scales}
        scaling = found.scaling - 1j * b_parts["scaling"]
        coefficients = WaveletCoefficients(scaling, scales, found.parameters)
        return Estimate(coefficients, convergence=convergence)


def _candidates(parts: _Parts, key: int | str) -> _Candidates:
    """Return the B of one part, minus the imaginary part of the coefficients."""
    fitted, left, pure = parts
    none = None if pure is None else -_part(pure, key).imag
    return _Candidates(-_part(fitted, key).imag, -_part(left, key).imag, none)


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


def _regime(bins: ShareBins, found: _Candidates, truth: Array) -> ScaleRegime:
    """Measure what counts in every bin, from stacks of E alone, B alone and noise alone."""
    e, b, noise = np.split(np.arange(len(truth)), 3)
    everywhere = np.ones(bins.share.shape, dtype=bool)
    power, noisy = (bins.mean(truth[kind] ** 2, everywhere) for kind in (b, noise))
    # Noise counts against B alike at every scale; to pass it as on the full sky costs nothing.
    factors = np.ones(len(truth))
    factors[noise] = np.sqrt(_NOISE_RATIO * power / noisy) if noisy > 0 else 0.0
    columns = [found.residual] if found.pure is None else [found.residual, found.pure - found.fit]
    target = truth.copy()
    target[e] = 0.0
    rows = []
    for inside in bins:
        values = np.array([column[:, inside] for column in (*columns, target - found.fit, target)])
        values *= factors[:, None]
        products = np.einsum("isk,jsk,k->sij", values, values, bins.areas_of(inside))
        wanted = products.sum(axis=0)
        counts = _bounded_fit(wanted[:-2, :-2], wanted[:-2, -2])
        # With these counts the estimate is target - (target - fit) + counts columns.
        mixing = np.array([*counts, -1.0, 1.0])
        signal = products[np.concatenate([e, b])].sum(axis=0)
        total, cross, true = mixing @ signal @ mixing, mixing @ signal[:, -1], signal[-1, -1]
        kept = max(cross, 0.0) ** 2 / (total * true) if total * true > 0 else 0.0
        counts = np.append(counts, np.zeros(2 - counts.size))
        rows.append((bins.mean(bins.share[None], inside), *counts, min(kept, 1.0)))
    return ScaleRegime(*np.array(rows).T)


def _bounded_fit(matrix: Array, vector: Array) -> Array:
    """Minimise x M x / 2 - v x over 0 <= x <= 1."""
    from scipy.optimize import lsq_linear

    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    # Candidates that are nearly alike share the weight.
    scaled = matrix / np.outer(scale, scale) + 1e-6 * np.eye(len(scale))
    root = np.linalg.cholesky(scaled).T
    right = np.linalg.solve(root.T, vector / scale)
    found = lsq_linear(root * scale, right, bounds=(0.0, 1.0))
    return np.asarray(found.x)
