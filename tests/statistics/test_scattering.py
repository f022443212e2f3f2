"""Moments of the modulus, against the same means taken step by step."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.directionality import CurveletDirectionality
from spinsdw.errors import ParameterError
from spinsdw.harmonics import resize
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.statistics import scale_spectra, scattering
from spinsdw.tiling import CustomTiling, NeedletTiling, ScaleDiscretisedTiling, SplineTiling
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, needs_compiler, random_flm

TRANSFORMS = [
    SpinWaveletTransform(16, 0, 1),
    SpinWaveletTransform(16, 2, 3),
    SpinWaveletTransform(17, -1, 2, lowest_scale=1, sampling="mwss"),
    SpinWaveletTransform(12, 1, 2, multiresolution=False),
    SpinWaveletTransform(12, 2, 2, dilation=1.5, sampling="gl"),
    SpinWaveletTransform(8, 0, 4, dilation=1.3, lowest_scale=4),
    SpinWaveletTransform(16, 0, 3, tiling=NeedletTiling(16)),
    SpinWaveletTransform(16, 0, 3, tiling=SplineTiling(16)),
]
every_transform = pytest.mark.parametrize("transform", TRANSFORMS, ids=str)


def area_mean(values, grid):
    return np.sum(values * grid.weights[:, None], axis=(-2, -1)) / (4 * np.pi)


@every_transform
def test_first_order_is_the_mean_modulus(transform):
    """S1(j, k) = mean |W^j_k|, and S1^2 <= mean |W|^2."""
    flm = random_flm(transform.bandlimit, transform.spin)
    coefficients = transform.analysis_harmonic(flm)
    found = scattering(transform, coefficients)
    assert tuple(found.first) == transform.scales
    powers = scale_spectra(transform, coefficients)
    for j in transform.scales:
        desired = area_mean(np.abs(coefficients[j]), transform.part_grid(j))
        assert_close(found.first[j], desired, ulps=16)
        assert np.all(found.first[j] ** 2 <= powers[j] * (1 + 1e-12))


@every_transform
def test_second_order_is_the_first_order_of_the_modulus(transform):
    """S2 from |W^j1_k1| taken to the full bandlimit and analysed by the parent's own tiling."""
    flm = random_flm(transform.bandlimit, transform.spin)
    coefficients = transform.analysis_harmonic(flm)
    found = scattering(transform, coefficients)
    last = (transform.scales[-1], transform.scales[0])
    assert found.second[last].shape == (transform.directions, transform.directions)
    expected = [(j, i) for j in transform.scales for i in transform.scales if i < j]
    assert sorted(found.second) == sorted(expected)
    for (j, i), values in found.second.items():
        assert values.shape[-2] == transform.directions
        parent = SpinWaveletTransform(
            transform.bandlimit,
            0,
            values.shape[-1],
            tiling=transform.tiling,
            sampling=transform.sampling,
            real=True,
        )
        grid = transform.part_grid(j)
        modulus = SpinHarmonicTransform(grid.bandlimit, sampling=grid, real=True).analysis(
            np.abs(coefficients[j])
        )
        again = parent.analysis_harmonic(resize(modulus, transform.bandlimit))
        desired = area_mean(np.abs(again[i]), parent.part_grid(i))
        np.testing.assert_allclose(values, desired, rtol=0, atol=1e-12)


def test_moments_have_the_unit_of_the_signal_and_keep_the_batch():
    """S(c f) = |c| S(f), signal by signal."""
    transform = SpinWaveletTransform(16, 2, 2)
    flm = random_flm(16, 2, batch=(2, 3))
    together = scattering(transform, transform.analysis_harmonic(flm))
    alone = scattering(transform, transform.analysis_harmonic(-3j * flm[1, 2]))
    for found, desired in ((together.first, alone.first), (together.second, alone.second)):
        for key, values in found.items():
            assert values.shape[:2] == (2, 3)
            np.testing.assert_allclose(3 * values[1, 2], desired[key], rtol=0, atol=1e-12)


@needs_compiler
def test_uneven_power_shows_in_the_second_order_and_not_in_the_spectrum():
    """White noise that is strong on one side of the sky, against the same coefficients shuffled.

    Signs drawn for each coefficient keep every |f_lm|^2 and undo what ties them together.
    """
    bandlimit = 64
    transform = SpinWaveletTransform(bandlimit, 0, 2, lowest_scale=1, real=True)
    harmonic = transform.harmonic
    rng = np.random.default_rng(1)
    sky = rng.standard_normal(harmonic.shape) * (1.2 + np.sin(harmonic.sampling.longitudes))
    flm = harmonic.analysis(sky)
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    order = np.abs(np.arange(bandlimit**2) - el**2 - el)
    signs = rng.choice([-1.0, 1.0], (bandlimit, bandlimit))[el, order]
    uneven, even = (
        scattering(transform, transform.analysis_harmonic(one)) for one in (flm, flm * signs)
    )
    for j in (4, 5):
        ratios = [np.mean(one.second[j, 1]) / np.mean(one.first[j]) for one in (uneven, even)]
        assert ratios[0] > 1.5 * ratios[1]


def test_tilings_and_directionalities_without_larger_kin_are_refused():
    plain = ScaleDiscretisedTiling(8)
    kernels = np.array([plain.kernel(j) for j in plain.scales])
    custom = SpinWaveletTransform(8, 0, 2, tiling=CustomTiling(plain.scaling_kernel, kernels))
    with pytest.raises(ParameterError, match="must be one that a dilation makes"):
        scattering(custom, custom.analysis_harmonic(random_flm(8)))
    curvelets = SpinWaveletTransform(8, 0, directionality=CurveletDirectionality())
    with pytest.raises(ParameterError, match="must be steerable"):
        scattering(curvelets, curvelets.analysis_harmonic(random_flm(8)))
