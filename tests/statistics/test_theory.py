"""Variances and covariances: exact sums over coefficients, and Gaussian fields in the mean."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.directionality import CurveletDirectionality
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import eb_to_spin
from spinsdw.simulation import gaussian_flm, simulate_eb
from spinsdw.statistics import covariance_function, wavelet_covariance, wavelet_variance
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, needs_compiler, random_flm

L = 8
SPECTRUM = 1 / (1 + np.arange(L)) ** 2

TRANSFORMS = [
    SpinWaveletTransform(L, 0, 1),
    SpinWaveletTransform(L, 2, 3),
    SpinWaveletTransform(L, -1, 4, lowest_scale=1),
    SpinWaveletTransform(L, 1, 2, original_spin=2),
    SpinWaveletTransform(L, 0, directionality=CurveletDirectionality()),
]
every_transform = pytest.mark.parametrize("transform", TRANSFORMS, ids=str)


def responses(transform):
    """Coefficients of every f_lm = sqrt(C_l), one at a time: the batch is an axis of modes."""
    held = np.where(transform.wavelets.lost_degrees, 0, SPECTRUM)
    el = np.repeat(np.arange(L), 2 * np.arange(L) + 1)
    return transform.analysis_harmonic(np.diag(np.sqrt(held[el])))


@every_transform
def test_variance_is_the_sum_over_independent_modes(transform):
    """<|W(rho)|^2> = sum_lm C_l |dW(rho)/df_lm|^2, the same at every rho."""
    found = wavelet_variance(transform.wavelets, SPECTRUM)
    coefficients = responses(transform)
    for key in ("scaling", *transform.scales):
        values = coefficients.scaling if key == "scaling" else coefficients[key]
        desired = np.sum(np.abs(values) ** 2, axis=0)
        assert_close(desired, np.full(desired.shape, found[key]), ulps=256)


@every_transform
def test_covariance_is_the_sum_over_independent_modes(transform):
    """Between all orientations of two scales, at places that both grids have: the south pole."""
    coefficients = responses(transform)
    largest = max(wavelet_variance(transform.wavelets, SPECTRUM).values())
    for scale in transform.scales:
        for other in transform.scales:
            one, two = coefficients[scale][:, :, -1, 0], coefficients[other][:, :, -1, 0]
            desired = np.einsum("ik,il->kl", one, two.conj())
            found = wavelet_covariance(transform.wavelets, SPECTRUM, scale, other)
            np.testing.assert_allclose(found, desired, rtol=0, atol=1e-13 * largest)
    last = transform.scales[-1]
    found = wavelet_covariance(transform.wavelets, SPECTRUM, last)
    assert_close(np.diag(found), np.full(len(found), np.trace(found) / len(found)), ulps=64)
    assert_close(found, found.conj().T, ulps=64)


@pytest.mark.parametrize("transform", TRANSFORMS[:3], ids=str)
def test_covariance_function_is_the_sum_over_independent_modes(transform):
    """<W^j'(rho) conj(W^j(1))>, the pole being a sample of MWSS."""
    symmetric = SpinWaveletTransform(
        L, transform.spin, transform.directions, tiling=transform.tiling, sampling="mwss"
    )
    coefficients = responses(symmetric)
    for scale in symmetric.scales:
        found = covariance_function(symmetric, SPECTRUM, scale)
        pole = coefficients[scale][:, 0, 0, 0].conj()
        for other in symmetric.scales:
            desired = np.einsum("i,iktp->ktp", pole, coefficients[other])
            np.testing.assert_allclose(found[other], desired, rtol=0, atol=1e-13)


def test_variance_adds_up_to_that_of_the_field():
    """8 pi^2 sum_j sigma_j^2 + 4 pi sigma_phi^2 = sum_l (2l+1) C_l."""
    for spin in (0, 2, -3):
        wavelets = SpinWaveletTransform(L, spin, 3, lowest_scale=1).wavelets
        found = wavelet_variance(wavelets, SPECTRUM)
        total = 4 * np.pi * found.pop("scaling") + 8 * np.pi**2 * sum(found.values())
        desired = np.sum((2 * np.arange(L) + 1)[abs(spin) :] * SPECTRUM[abs(spin) :])
        assert_close(total, desired, ulps=64)


@needs_compiler
@pytest.mark.parametrize(("spin", "directions"), [(0, 2), (1, 3), (-2, 1)])
def test_gaussian_fields_of_any_spin_have_that_variance_in_the_mean(spin, directions):
    """Of K complex fields the mean of |W|^2 is sigma^2 within 6 sigma^2 / sqrt(K) everywhere."""
    count = 400
    transform = SpinWaveletTransform(L, spin, directions)
    el = np.repeat(np.arange(L), 2 * np.arange(L) + 1)
    flm = random_flm(L, spin, seed=5, batch=(count,)) * np.sqrt(SPECTRUM[el] / 2)
    coefficients = transform.analysis_harmonic(flm)
    expected = wavelet_variance(transform.wavelets, SPECTRUM)
    for j in transform.scales:
        mean = np.mean(np.abs(coefficients[j]) ** 2, axis=0)
        assert np.all(np.abs(mean - expected[j]) <= 6 * expected[j] / np.sqrt(count))


@needs_compiler
def test_parts_of_a_polarised_transform_have_the_variances_of_e_and_b():
    """Re W has that of EE, Im W that of BB; of K fields within 6 sqrt(2 / K) of it."""
    count = 400
    transform = SpinWaveletTransform(L, 2, 3)
    ee, bb = SPECTRUM, 0.1 * SPECTRUM[::-1].copy()
    pairs = [simulate_eb(ee, bb, L, seed=seed) for seed in range(count)]
    coefficients = transform.analysis_harmonic(np.array([eb_to_spin(*pair) for pair in pairs]))
    theory = {
        "real": wavelet_variance(transform.wavelets, ee),
        "imag": wavelet_variance(transform.wavelets, bb),
    }
    both = wavelet_variance(transform.wavelets, ee + bb)
    for j in transform.scales:
        for part, expected in theory.items():
            mean = np.mean(getattr(coefficients[j], part) ** 2, axis=0)
            assert np.all(np.abs(mean - expected[j]) <= 6 * expected[j] * np.sqrt(2 / count))
        assert_close(theory["real"][j] + theory["imag"][j], both[j], ulps=16)


@needs_compiler
def test_real_fields_have_the_same_variance():
    count = 400
    transform = SpinWaveletTransform(L, 0, 2, real=True)
    flm = np.array([gaussian_flm(SPECTRUM, L, seed=seed) for seed in range(count)])
    coefficients = transform.analysis_harmonic(flm)
    expected = wavelet_variance(transform.wavelets, SPECTRUM)
    for j in transform.scales:
        mean = np.mean(coefficients[j] ** 2, axis=0)
        assert np.all(np.abs(mean - expected[j]) <= 6 * expected[j] * np.sqrt(2 / count))


def test_orientations_of_axisymmetric_wavelets_are_one():
    found = wavelet_covariance(TRANSFORMS[0].wavelets, SPECTRUM, 2)
    assert found.shape == (1, 1)
    assert_close(found[0, 0], wavelet_variance(TRANSFORMS[0].wavelets, SPECTRUM)[2], ulps=8)


@pytest.mark.parametrize(
    ("spectrum", "error", "message"),
    [
        (np.ones(3), ShapeError, r"spectrum has shape \(3,\) .* l = 0 to 7"),
        (np.ones((8, 8)), ShapeError, "must hold real C_l"),
        (np.full(8, 1j), ShapeError, "must hold real C_l"),
        (np.full(8, np.nan), DataError, "not finite; set those of no interest to 0"),
    ],
)
def test_bad_spectra_are_refused(spectrum, error, message):
    for call in (
        lambda: wavelet_variance(TRANSFORMS[1].wavelets, spectrum),
        lambda: wavelet_covariance(TRANSFORMS[1].wavelets, spectrum, 1),
        lambda: covariance_function(TRANSFORMS[1], spectrum, 1),
    ):
        with pytest.raises(error, match=message):
            call()


def test_scales_must_exist():
    with pytest.raises(ParameterError, match="scale=9 must be from 0 to 3"):
        wavelet_covariance(TRANSFORMS[1].wavelets, SPECTRUM, 1, 9)
