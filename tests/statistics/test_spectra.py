"""Powers measured scale by scale."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.energy import energies
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.masks import taper
from spinsdw.separation.energy_share import energy_shares
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.statistics import scale_spectra, wavelet_variance
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, needs_compiler, random_flm

L = 12


def gaussian_batch(spin, count, bandlimit=L, seed=3):
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    spectrum = 1 / (1 + np.arange(bandlimit))
    flm = random_flm(bandlimit, spin, seed=seed, batch=(count,)) * np.sqrt(spectrum[el] / 2)
    return flm, spectrum


def random_weights(transform, seed=0):
    rng = np.random.default_rng(seed)
    return {key: rng.uniform(0, 1, shape) for key, shape in transform.shapes.items()}


@needs_compiler
@pytest.mark.parametrize("spin", [0, 2, -1])
@pytest.mark.parametrize("sampling", ["mw", "gl"])
def test_expectation_is_the_variance_whatever_the_weights(spin, sampling):
    """<S_jk> = sigma_j^2: of K fields within 6 sigma_j^2 / sqrt(K), for |W|^2 varies by no more."""
    count = 200
    transform = SpinWaveletTransform(L, spin, 2, sampling=sampling)
    flm, spectrum = gaussian_batch(spin, count)
    weights = random_weights(transform)
    found = scale_spectra(transform, transform.analysis_harmonic(flm), weights=weights)
    expected = wavelet_variance(transform.wavelets, spectrum)
    for key, values in found.items():
        bound = 6 * expected[key] / np.sqrt(count)
        assert values.shape == ((count,) if key == "scaling" else (count, 2))
        assert np.all(np.abs(values.mean(axis=0) - expected[key]) <= bound)


def test_without_weights_the_power_is_near_the_energy():
    """The grid's weights integrate |W|^2 up to degree L - 1 only; dh is exact to 2 L - 2."""
    flm, _ = gaussian_batch(2, 1)
    for sampling, tolerance in (("dh", 1e-12), ("mw", 0.5)):
        transform = SpinWaveletTransform(L, 2, 3, sampling=sampling)
        coefficients = transform.analysis_harmonic(flm[0])
        exact = energies(transform, coefficients)
        found = scale_spectra(transform, coefficients)
        for j in transform.scales[1:]:
            desired = exact[j] / (8 * np.pi**2) * 3
            np.testing.assert_allclose(found[j].sum(), desired.sum(), rtol=tolerance)


def test_weights_choose_the_places():
    """Weights of one place give its |W|^2; zero weights give NaN."""
    transform = SpinWaveletTransform(L, 2, 3)
    coefficients = transform.analysis_harmonic(random_flm(L, 2))
    one = np.zeros(transform.shapes[2][1:])
    one[1, 2] = 0.3
    found = scale_spectra(transform, coefficients, weights={2: one, 3: 0.0, "scaling": 2})
    assert_close(found[2], np.abs(coefficients[2][:, 1, 2]) ** 2, ulps=8)
    assert np.isnan(found[3]).all()
    plain = scale_spectra(transform, coefficients)
    assert_close(found["scaling"], plain["scaling"], ulps=8)
    assert_close(found[1], plain[1], ulps=1)


def test_common_power_of_two_maps():
    """S(f, g) is sesquilinear, S(f, f) real, and independent noise averages out."""
    transform = SpinWaveletTransform(L, 1, 2)
    flm, _ = gaussian_batch(1, 1)
    noise, _ = gaussian_batch(1, 2, seed=8)
    one = transform.analysis_harmonic(flm[0])
    assert_close(
        scale_spectra(transform, one, 2j * one)[2],
        -2j * scale_spectra(transform, one)[2],
        ulps=16,
    )
    first, second = (transform.analysis_harmonic(flm[0] + part) for part in noise)
    cross = scale_spectra(transform, first, second)
    assert np.iscomplexobj(cross[2])
    auto = scale_spectra(transform, first)
    clean = scale_spectra(transform, one)
    last = transform.scales[-1]
    errors = [abs(np.mean(spectra[last]) - np.mean(clean[last])) for spectra in (cross, auto)]
    assert errors[0] < errors[1] / 3


@needs_compiler
def test_masked_sky_has_the_power_of_the_whole_where_wavelets_see_no_hole():
    """A cap hides a third of the sky; weights are 0 where 1 % of a wavelet's energy is in it.

    The mean over K skies deviates by the share allowed, and by 6 sigma^2 / sqrt(10 K): more than
    ten wavelets of that scale fit side by side into what is left. Scale 4 is the last that does not
    end at the bandlimit, and so falls off fast around its centre.
    """
    bandlimit, count, spin, scale = 32, 100, 2, 4
    transform = SpinWaveletTransform(bandlimit, spin, 2)
    harmonic = transform.harmonic
    flm, spectrum = gaussian_batch(spin, count, bandlimit)

    def hole_on(grid):
        rings = taper((1.2 - grid.colatitudes[:, None]) / 0.4)
        return np.ascontiguousarray(np.broadcast_to(rings, grid.shape))

    scalar = SpinHarmonicTransform(2 * bandlimit, 0, real=True)
    hole = scalar.analysis(hole_on(scalar.sampling))
    shares = energy_shares(transform, lambda size: hole[: size**2])
    weights = {j: shares[j] < 0.01 for j in transform.scales}
    masked = transform.analysis(harmonic.synthesis(flm) * (1 - hole_on(harmonic.sampling)))
    expected = wavelet_variance(transform.wavelets, spectrum)[scale]
    found = scale_spectra(transform, masked, weights=weights)[scale].mean(axis=0)
    without = scale_spectra(transform, masked)[scale].mean(axis=0)
    assert np.all(np.abs(found / expected - 1) < 0.01 + 6 / np.sqrt(count * 10))
    assert np.all(without < 0.8 * expected)


@pytest.mark.parametrize(
    ("weights", "error", "message"),
    [
        ({9: 1.0}, ParameterError, r"weights for \['9'\] match no scale"),
        ({2: np.ones(4)}, ShapeError, r"weights for 2 have shape \(4,\); they must broadcast"),
        ({2: -1.0}, DataError, "weights for 2 must be finite real numbers of at least 0"),
        ({2: np.nan}, DataError, "weights for 2 must be finite"),
        ({2: 1j}, DataError, "weights for 2 must be finite"),
    ],
)
def test_bad_weights_are_refused(weights, error, message):
    transform = SpinWaveletTransform(L, 2, 3)
    coefficients = transform.analysis_harmonic(random_flm(L, 2))
    with pytest.raises(error, match=message):
        scale_spectra(transform, coefficients, weights=weights)


def test_batches_must_agree():
    transform = SpinWaveletTransform(L, 2, 3)
    one, two = (transform.analysis_harmonic(random_flm(L, 2, batch=b)) for b in ((), (2,)))
    with pytest.raises(ShapeError, match="different batches"):
        scale_spectra(transform, one, two)
