r"""Spectra found in wavelet coefficients, and the errors that a method makes on such skies.

The variance of a scale's coefficients where their wavelets see the sky is a band power.  A prior
that gives every scale its variance is diagonal in wavelet space; being isotropic it is a spectrum,
:math:`C_\ell = \sum_j \kappa_j^2(\ell) S_j` (eq-wavelet-prior).

The error of an estimate is estimate minus truth on simulated skies.  For the Wiener filter, and for
it alone, estimate minus error is a draw from the posterior: a constrained realisation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import DataError
from spinsdw.separation.ensemble import draw_fields, draw_white, position_areas
from spinsdw.separation.least_squares import EBPrior
from spinsdw.separation.method import Estimator
from spinsdw.separation.survey import Survey

__all__ = ["draw_errors", "estimate_spectra"]

Array = np.ndarray[Any, Any]

# Coefficients with less of their energy in the holes tell the variance of a scale.
_SEEN_SHARE = 0.1
# A variance is not let fall below this share of E's: what has no variance is fitted as zero.
_LEAST_SHARE = 1e-6


def estimate_spectra(
    survey: Survey, coefficients: WaveletCoefficients, noise_level: float
) -> EBPrior:
    """Return the spectra of E and B, with the beam, that a separation finds scale by scale.

    Parameters
    ----------
    survey : Survey
        Where the sky was observed.
    coefficients : WaveletCoefficients
        What a method found, of one map or of a stack of maps of one kind.
    noise_level : float
        Noise of Q and of U in the map's unit times radians; its power is subtracted.

    Returns
    -------
    EBPrior
        C_l = sum_j kappa_j^2(l) S_j, the lowest scale's S for the scaling part.

    Raises
    ------
    DataError
        If no wavelet of any scale sees the sky.
    """
    tiling = survey.transform.wavelets.tiling
    powers: dict[int, Array] = {}
    for j in survey.transform.scales:
        share = survey.shares[j]
        grid = survey.transform.part_grid(j)
        areas = np.broadcast_to(position_areas(grid), share.shape) * (share < _SEEN_SHARE)
        if areas.any():
            powers[j] = _band_powers(coefficients[j], areas, tiling.kernel(j)) - noise_level**2
    if not powers:
        msg = "mask leaves no wavelet with nine tenths of its energy on the observed sky; raise J0."
        raise DataError(msg)
    spectra = np.zeros((2, survey.bandlimit))
    scales = np.array(sorted(powers))
    for j in survey.transform.scales:
        # A scale that sees nothing takes the power of the nearest that does.
        spectra += np.outer(
            powers[int(scales[np.argmin(np.abs(scales - j))])], tiling.kernel(j) ** 2
        )
    spectra += np.outer(powers[int(scales[0])], tiling.scaling_kernel**2)
    floor = _LEAST_SHARE * np.max(spectra[0])
    e, b = np.maximum(spectra, floor) * (survey.beam**2 > 0)
    return EBPrior(e, b)


def _band_powers(values: Array, areas: Array, kernel: Array) -> Array:
    """Return S of E and of B: the variance over that of a spectrum of 1."""
    degrees = 2 * np.arange(kernel.size) + 1
    one = float(degrees @ kernel**2) / (8 * np.pi**2)
    stack = values.reshape(-1, *areas.shape)
    squares = np.array([np.mean(part**2, axis=0) for part in (stack.real, stack.imag)])
    return np.asarray(np.sum(squares * areas, axis=(1, 2, 3)) / areas.sum() / one)


def draw_errors(  # noqa: PLR0913, PLR0917 - what errs, on which skies, and how many
    survey: Survey,
    estimator: Estimator,
    prior: EBPrior,
    noise_level: float,
    count: int,
    seed: int,
) -> Array:
    """Return p_lm of estimate minus truth on simulated skies, shape (count, L^2).

    Parameters
    ----------
    survey : Survey
        Where the sky is observed.
    estimator : Estimator
        What is applied to the skies.
    prior : EBPrior
        Spectra of E and B of the skies, with the beam.
    noise_level : float
        Noise of Q and of U where the weights are 1, in the map's unit times radians.
    count, seed : int
        How many skies to draw, and from where.
    """
    truth = sum(draw_fields(prior, count, seed), start=np.zeros(()))
    noise = noise_level * survey.sky.polarisation_map(draw_white(survey, count, seed))
    noise /= np.sqrt(np.where(survey.weights > 0, survey.weights, 1.0))
    p = survey.observed * (survey.sky.polarisation_map(truth) + noise)
    found = estimator.estimate(p).coefficients
    return survey.transform.synthesis_harmonic(found) - truth
