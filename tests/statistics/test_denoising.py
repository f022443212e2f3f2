"""Shrinkage: its formula, Stein's estimate against the true error, and what it gains."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.datasets import wmap_synchrotron_paths
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.healpix import map_to_flm
from spinsdw.maps_io import read_polarisation
from spinsdw.simulation import gaussian_flm
from spinsdw.statistics import denoise, shrinkage_levels, wavelet_variance
from spinsdw.statistics.denoising import _LEVELS, _stein_risks
from spinsdw.statistics.theory import wavelet_covariance
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, needs_compiler, random_flm

L = 12


def noise_of(spectrum, spin, *, seed=0, batch=()):
    """Draw complex noise with <|n_lm|^2> = N_l."""
    bandlimit = len(spectrum)
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    return random_flm(bandlimit, spin, seed=seed, batch=batch) * np.sqrt(spectrum[el] / 2)


def snr(signal, found):
    """10 log10 of power over squared error, in decibels, as the C library's demonstration has."""
    return 10 * np.log10(np.sum(np.abs(signal) ** 2) / np.sum(np.abs(found - signal) ** 2))


@pytest.mark.parametrize(("spin", "directions"), [(0, 1), (2, 3), (-1, 4)])
@pytest.mark.parametrize("batch", [(), (2,)])
def test_orientations_of_a_place_shrink_together(spin, directions, batch):
    """W_k -> max(0, 1 - t^2 sigma^2 / e^2) W_k with e^2 the mean over k of |W_k|^2."""
    transform = SpinWaveletTransform(L, spin, directions)
    coefficients = transform.analysis_harmonic(random_flm(L, spin, batch=batch))
    noise = np.full(L, 0.4)
    variances = wavelet_variance(transform.wavelets, noise)
    levels = {j: 0.5 + 0.25 * j for j in transform.scales}
    found = denoise(transform, coefficients, noise, levels=levels)
    assert np.array_equal(found.scaling, coefficients.scaling)
    for j in transform.scales:
        values = coefficients[j]
        power = np.mean(np.abs(values) ** 2, axis=-3, keepdims=True)
        ratio = levels[j] ** 2 * variances[j] / np.where(power > 0, power, 1)
        desired = np.where(power > 0, np.maximum(0, 1 - ratio), 0) * values
        assert_close(found[j], desired, ulps=16)


def test_one_direction_is_the_garrote():
    transform = SpinWaveletTransform(L, 2, 1)
    coefficients = transform.analysis_harmonic(random_flm(L, 2))
    variances = wavelet_variance(transform.wavelets, np.ones(L))
    thresholds = {j: 1.5 * np.sqrt(variances[j]) for j in transform.scales}
    found = denoise(transform, coefficients, np.ones(L), levels=1.5)
    desired = coefficients.threshold(thresholds, rule="garrote")
    for j in transform.scales:
        assert_close(found[j], desired[j], ulps=32)


def test_no_noise_leaves_everything():
    transform = SpinWaveletTransform(L, 2, 3)
    coefficients = transform.analysis_harmonic(random_flm(L, 2))
    for levels in (None, 3.0):
        found = denoise(transform, coefficients, np.zeros(L), levels=levels)
        assert (found - coefficients).norm() == 0


def true_risks(clean, noisy, variance, areas):
    """The squared error of each level, summed over places by area."""
    power = np.mean(np.abs(noisy) ** 2, axis=-3, keepdims=True)
    risks = []
    for level in _LEVELS:
        factor = np.maximum(0, 1 - level**2 * variance / power)
        risks.append(np.sum(areas * np.abs(factor * noisy - clean) ** 2))
    return np.array(risks)


@needs_compiler
@pytest.mark.parametrize(
    ("spin", "directions", "real"), [(2, 3, False), (1, 2, False), (0, 1, True), (0, 3, True)]
)
def test_steins_estimate_is_the_error_in_the_mean(spin, directions, real):
    """E[SURE(t)] + K sigma^2 area = E[error(t)]: over M noises within 6 standard errors."""
    count, bandlimit = 400, 8
    transform = SpinWaveletTransform(bandlimit, spin, directions, real=real)
    noise = 1 / (1.0 + np.arange(bandlimit))
    signal = 1.5 * gaussian_flm(noise, bandlimit, seed=99)
    signal[: spin**2] = 0
    if real:
        draws = np.array([gaussian_flm(noise, bandlimit, seed=seed) for seed in range(count)])
    else:
        draws = noise_of(noise, spin, batch=(count,))
    clean = transform.analysis_harmonic(signal)
    noisy = transform.analysis_harmonic(signal + draws)
    scale = transform.scales[-1]
    covariance = wavelet_covariance(transform.wavelets, noise, scale)
    areas = transform.part_grid(scale).weights[:, None]
    variance = covariance[0, 0].real
    constant = directions * variance * np.sum(areas * np.ones(transform.shapes[scale][1:]))
    differences = np.array(
        [
            _stein_risks(one, covariance, areas)
            + constant
            - true_risks(clean[scale], one, variance, areas)
            for one in noisy[scale]
        ]
    )
    error = differences.std(axis=0) / np.sqrt(count)
    assert np.all(np.abs(differences.mean(axis=0)) <= 6 * error + 1e-12 * constant)


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_levels_do_not_depend_on_the_unit(factor):
    transform = SpinWaveletTransform(L, 2, 3)
    noise = np.full(L, 0.5)
    coefficients = transform.analysis_harmonic(random_flm(L, 2))
    found = shrinkage_levels(transform, factor * coefficients, factor**2 * noise)
    assert found == shrinkage_levels(transform, coefficients, noise)


@pytest.fixture(scope="module")
def synchrotron():
    """WMAP's synchrotron map, the data of the C library's demonstration of spin denoising."""
    stated = {"unit": "mK_RJ", "polconv": "COSMO"}
    maps = read_polarisation(wmap_synchrotron_paths(), columns="BESTFIT", **stated)
    return map_to_flm(maps.q + 1j * maps.u, 65, 2)[0]


@needs_compiler
@pytest.mark.parametrize("snr_in", [0.0, 10.0, 20.0])
def test_denoising_gains_more_than_a_hard_threshold(synchrotron, snr_in):
    """The C library cuts at 3 sigma with N = 4; that loses at 20 dB what it wins at 0 dB."""
    bandlimit = 65
    level = np.sum(np.abs(synchrotron) ** 2) / (bandlimit**2 - 4) / 10 ** (snr_in / 10)
    noise = np.full(bandlimit, level)
    noisy = synchrotron + noise_of(noise, 2, seed=4)
    before = snr(synchrotron, noisy)
    transform = SpinWaveletTransform(bandlimit, 2, 4)
    coefficients = transform.analysis_harmonic(noisy)
    variances = wavelet_variance(transform.wavelets, noise)
    cut = coefficients.threshold({j: 3 * np.sqrt(variances[j]) for j in transform.scales})
    hard = snr(synchrotron, transform.synthesis_harmonic(cut))
    ours = snr(synchrotron, transform.synthesis_harmonic(denoise(transform, coefficients, noise)))
    assert ours > hard + 0.5
    assert ours > before + {0.0: 8.0, 10.0: 3.0, 20.0: 0.3}[snr_in]


@pytest.mark.parametrize(
    ("levels", "message"),
    [
        (-1.0, "levels=-1.0 for scale 0 must be a number of at least 0"),
        (np.nan, "must be a number of at least 0"),
        ("high", "levels='high' for scale 0 must be a number"),
        ({2: 1.0}, "must have one for each of the scales"),
    ],
)
def test_bad_levels_are_refused(levels, message):
    transform = SpinWaveletTransform(L, 2, 3)
    coefficients = transform.analysis_harmonic(random_flm(L, 2))
    with pytest.raises(ParameterError, match=message):
        denoise(transform, coefficients, np.ones(L), levels=levels)


def test_bad_noise_is_refused():
    transform = SpinWaveletTransform(L, 2, 3)
    coefficients = transform.analysis_harmonic(random_flm(L, 2))
    with pytest.raises(ShapeError, match="noise_spectrum has shape"):
        denoise(transform, coefficients, np.ones(3))
    with pytest.raises(DataError, match="noise_spectrum holds values that are not finite"):
        shrinkage_levels(transform, coefficients, np.full(L, np.inf))
