"""The Wiener filter is the posterior mean; errors and spectra are those of the skies drawn."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import power_spectrum, spin_to_eb
from spinsdw.polarisation import EBSeparator
from spinsdw.sampling import MW
from spinsdw.separation import Wiener
from spinsdw.separation.ensemble import draw_fields
from spinsdw.separation.least_squares import EBPrior
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.separation.uncertainty import estimate_spectra
from tests.helpers import needs_compiler
from tests.separation.test_regularised import cap, survey_of

L = 17
SKY = HealpixSky(8, L)
EL = np.arange(L)
SPECTRUM = np.where(EL > 1, 1.0 / np.maximum(EL * (EL + 1.0), 1), 0)
NOISE = 0.02


def drawn(seed, count=1, noise=NOISE):
    """Skies of the spectra with white noise, and their maps behind the cap."""
    prior = EBPrior(SPECTRUM, 0.3 * SPECTRUM)
    truth = sum(draw_fields(prior, count, seed))
    rng = np.random.default_rng(seed)
    shape = (count, *SKY.map_shape)
    white = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    return truth, SKY.polarisation_map(truth) + noise * white / np.sqrt(SKY.areas)


def separator(mask=None, **options):
    options = {"noise_level": NOISE, "e_spectrum": SPECTRUM, "b_spectrum": 0.3 * SPECTRUM} | options
    return EBSeparator(L, mask, method=Wiener(**options))


def test_full_sky_filter_divides_signal_by_signal_and_noise():
    """E_lm -> C / (C + n^2) E_lm, where sums over pixels are integrals"""
    truth, p = drawn(1, noise=0.0)
    maps = separator(tolerance=1e-10).separate(p[0].real, p[0].imag)
    e_lm, b_lm = spin_to_eb(truth[0])
    for found, flm, spectrum in ((maps.E, e_lm, SPECTRUM), (maps.B, b_lm, 0.3 * SPECTRUM)):
        gain = np.repeat(spectrum / (spectrum + NOISE**2), 2 * EL + 1)
        expected = SKY.scalar_map(gain * flm).real
        assert np.max(np.abs(found - expected)) < 5e-3 * np.max(np.abs(expected))


@needs_compiler
def test_no_other_scaling_of_the_prior_has_a_smaller_error():
    """<|estimate - truth|^2> over the sphere is least for the true spectra"""
    truth, p = drawn(2, count=24)
    mask = cap(SKY, 80.0)
    errors = []
    for factor in (1e-3, 1.0, 1e3):
        spectra = {"e_spectrum": factor * SPECTRUM, "b_spectrum": 0.3 * factor * SPECTRUM}
        one = separator(mask, **spectra)
        maps = one.separate(p.real, p.imag)
        fields = SKY.scalar_map(-truth)
        errors.append(np.sum((maps.E - fields.real) ** 2) + np.sum((maps.B - fields.imag) ** 2))
    assert errors[1] < 0.99 * min(errors[0], errors[2])


@needs_compiler
def test_simulated_errors_are_the_errors():
    """mean square over the observed sky, within 25 percent for 12 skies of each"""
    truth, p = drawn(3, count=12)
    mask = cap(SKY, 80.0)
    one = separator(mask)
    maps = one.separate(p.real, p.imag)
    spectra = SPECTRUM, 0.3 * SPECTRUM
    found = one.uncertainty(maps, noise_level=NOISE, spectra=spectra, draws=12, seed=7)
    fields, seen = SKY.scalar_map(-truth), mask > 0
    assert found.E.shape == found.B.shape == mask.shape
    assert found.E_draws.shape == (12, mask.size)
    assert not np.any(found.B[~seen])
    for error, field, mine in ((found.E, fields.real, maps.E), (found.B, fields.imag, maps.B)):
        true = np.mean((mine - field)[:, seen] ** 2)
        assert abs(np.mean(error[seen] ** 2) / true - 1) < 0.25


@needs_compiler
def test_constrained_realisations_have_the_power_of_the_sky():
    """estimate - error is a draw from the posterior: its power is the prior's, not the filter's"""
    _, p = drawn(4)
    mask = cap(SKY, 60.0)
    one = separator(mask, tolerance=1e-6)
    maps = one.separate(p[0].real, p[0].imag)
    survey = one._prepared(SKY).survey
    from spinsdw.separation.uncertainty import draw_errors

    prior = EBPrior(SPECTRUM, 0.3 * SPECTRUM)
    errors = draw_errors(survey, one._prepared(SKY).estimator, prior, NOISE, 40, 5)
    mean = survey.transform.synthesis_harmonic(maps.coefficients)
    e_lm, _ = spin_to_eb(mean - errors)
    power = np.mean([power_spectrum(one_e) for one_e in e_lm], axis=0)[2:12]
    low, high = power / SPECTRUM[2:12], np.abs(power / SPECTRUM[2:12] - 1)
    filtered = power_spectrum(spin_to_eb(mean)[0])[2:12] / SPECTRUM[2:12]
    assert np.mean(high) < 0.6
    assert np.mean(low) > 2 * np.mean(filtered)


def test_spectra_are_found_where_the_sky_is_seen():
    """C_l = sum_j kappa_j^2 S_j: within the sample variance of 8 skies"""
    survey = survey_of(SKY, cap(SKY, 120.0))
    prior = EBPrior(np.full(L, 2.0), np.full(L, 0.5))
    coefficients = survey.transform.analysis_harmonic(sum(draw_fields(prior, 8, 1)))
    found = estimate_spectra(survey, coefficients, 0.0)
    assert np.max(np.abs(found.e_spectrum[6:] / 2.0 - 1)) < 0.35
    assert np.max(np.abs(found.b_spectrum[6:] / 0.5 - 1)) < 0.35
    noisy = estimate_spectra(survey, coefficients, 0.5)
    assert np.max(np.abs(found.e_spectrum - noisy.e_spectrum - 0.25)[6:]) < 1e-9


def test_prior_found_in_the_maps_is_nearly_as_good():
    truth, p = drawn(6, count=4)
    mask = cap(SKY, 120.0)
    fields = SKY.scalar_map(-truth).real[:, mask > 0]
    errors = []
    for one in (separator(mask), EBSeparator(L, mask, method=Wiener(noise_level=NOISE))):
        found = one.separate(p.real, p.imag).E[:, mask > 0]
        errors.append(np.mean((found - fields) ** 2))
    assert errors[1] < 1.5 * errors[0]


def test_filter_works_by_name_and_on_grids():
    sky = GridSky(MW(16))
    prior = EBPrior(np.ones(16), np.ones(16))
    p = sky.polarisation_map(sum(draw_fields(prior, 1, 1)))[0]
    maps = EBSeparator(16, cap(sky, 120.0), method="wiener").separate(p.real, p.imag)
    assert np.all(np.isfinite(maps.E))
    assert maps.info.convergence[0].iterations > 0


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: Wiener(noise_level=-1.0), ParameterError, "noise_level=-1.0 must be positive"),
        (lambda: Wiener(e_spectrum=SPECTRUM), ParameterError, "must both be given, or none"),
        (lambda: Wiener(max_iterations=0), ParameterError, "max_iterations=0 must be"),
        (
            lambda: separator(e_spectrum=SPECTRUM[:9], b_spectrum=SPECTRUM[:9]).separate(
                *np.zeros((2, 768))
            ),
            ShapeError,
            r"spectrum has shape \(9,\); it must hold C_l for l = 0 to 16",
        ),
    ],
)
def test_choices_are_checked(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_uncertainty_checks_what_it_is_given():
    one = separator(cap(SKY, 120.0))
    maps = one.separate(*np.zeros((2, 768)))
    with pytest.raises(ParameterError, match="draws=1 must be"):
        one.uncertainty(maps, noise_level=NOISE, draws=1)
    with pytest.raises(ParameterError, match=r"noise_level=-1.0 must be finite and at"):
        one.uncertainty(maps, noise_level=-1.0)
    with pytest.raises(ShapeError, match="spectrum has shape"):
        one.uncertainty(maps, noise_level=NOISE, spectra=(SPECTRUM[:3], SPECTRUM[:3]))
    small = EBSeparator(L, cap(SKY, 15.0), method=Wiener(noise_level=NOISE))
    with pytest.raises(DataError, match="mask leaves no wavelet"):
        small.separate(*np.ones((2, 768)))
