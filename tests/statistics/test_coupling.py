"""What a mask does to spectra: 3j symbols, and masked Gaussian fields in the mean."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import eb_to_spin, power_spectrum, spin_to_eb
from spinsdw.simulation import gaussian_flm, random_flm, simulate_eb
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.statistics import mode_coupling
from tests.helpers import needs_compiler

ducc0 = pytest.importorskip("ducc0")


def direct_coupling(mask_spectrum, bandlimit, spin):
    """(2l'+1)/(4 pi) sum_l3 (2 l3 + 1) W_l3 (l l' l3; s -s 0)^2, split by parity of l + l' + l3."""
    matrices = np.zeros((2, bandlimit, bandlimit))
    degrees = range(abs(spin), bandlimit)
    for el, other in ((el, other) for el in degrees for other in degrees):
        first, symbols = ducc0.misc.wigner3j_int(el, other, spin, -spin)
        third = np.arange(first, first + symbols.size)
        power = np.array([mask_spectrum[k] if k < len(mask_spectrum) else 0.0 for k in third])
        terms = (2 * other + 1) / (4 * np.pi) * (2 * third + 1) * power * symbols**2
        for parity in (0, 1):
            matrices[parity, el, other] = np.sum(terms[(el + other + third) % 2 == parity])
    return matrices


@pytest.mark.parametrize("spin", [0, 1, 2, -3])
@pytest.mark.parametrize("bandlimit", [4, 7])
@pytest.mark.parametrize("size", [1, 5, 13, 20])
def test_matrices_are_the_sums_over_3j_symbols(spin, bandlimit, size):
    mask_spectrum = np.random.default_rng(1).uniform(0, 1, size)
    found = mode_coupling(mask_spectrum, bandlimit, spin)
    desired = direct_coupling(mask_spectrum, bandlimit, spin)
    np.testing.assert_allclose(found, desired, rtol=0, atol=1e-13 * np.abs(desired).max())


@pytest.mark.parametrize("bandlimit", [1, 2, 3, 128])
def test_no_mask_mixes_nothing(bandlimit):
    for spin in (0, min(2, bandlimit - 1)):
        same, mixed = mode_coupling([4 * np.pi], bandlimit, spin)
        desired = np.diag((np.arange(bandlimit) >= spin).astype(float))
        np.testing.assert_allclose(same, desired, rtol=0, atol=1e-12)
        np.testing.assert_allclose(mixed, 0, rtol=0, atol=1e-12)


def masked_spectra(flm, spin, mask_flm, bandlimit):
    """Return the coefficients of mask times field below the bandlimit, without aliasing."""
    fine = 2 * bandlimit - 1
    padded = np.zeros((len(flm), fine**2), dtype=complex)
    padded[:, : bandlimit**2] = flm
    mask = np.zeros(fine**2, dtype=complex)
    mask[: bandlimit**2] = mask_flm
    maps = SpinHarmonicTransform(fine, spin).synthesis(padded)
    maps = maps * SpinHarmonicTransform(fine, 0, real=True).synthesis(mask)
    return SpinHarmonicTransform(fine, spin).analysis(maps)[:, : bandlimit**2]


@needs_compiler
def test_masked_polarisation_has_those_spectra_in_the_mean():
    """Of K skies the mean deviates by at most 6 standard errors at each degree."""
    bandlimit, count = 12, 400
    mask = gaussian_flm(1 / (1.0 + np.arange(bandlimit)) ** 2, bandlimit, seed=5)
    ee, bb = 1 / (1.0 + np.arange(bandlimit)), np.full(bandlimit, 0.05)
    skies = np.array(
        [eb_to_spin(*simulate_eb(ee, bb, bandlimit, seed=seed)) for seed in range(count)]
    )
    e_lm, b_lm = spin_to_eb(masked_spectra(skies, 2, mask, bandlimit))
    same, mixed = mode_coupling(power_spectrum(mask), bandlimit, 2)
    ee[:2] = bb[:2] = 0
    for fields, desired in ((e_lm, same @ ee + mixed @ bb), (b_lm, mixed @ ee + same @ bb)):
        spectra = np.array([power_spectrum(one) for one in fields])
        error = spectra.std(axis=0) / np.sqrt(count)
        assert np.all(np.abs(spectra.mean(axis=0) - desired) <= 6 * error)


@needs_compiler
@pytest.mark.parametrize("spin", [0, -1, 3])
def test_masked_complex_fields_have_that_spectrum_in_the_mean(spin):
    bandlimit, count = 10, 400
    mask = gaussian_flm(1 / (1.0 + np.arange(bandlimit)) ** 2, bandlimit, seed=5)
    c_l = 1 / (1.0 + np.arange(bandlimit))
    skies = np.array(
        [random_flm(bandlimit, spin, seed=seed, spectrum=c_l) for seed in range(count)]
    )
    spectra = np.array(
        [power_spectrum(one) for one in masked_spectra(skies, spin, mask, bandlimit)]
    )
    desired = sum(mode_coupling(power_spectrum(mask), bandlimit, spin)) @ c_l
    error = spectra.std(axis=0) / np.sqrt(count)
    assert np.all(np.abs(spectra.mean(axis=0) - desired) <= 6 * error)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((np.ones((2, 2)), 4), ShapeError, "mask_spectrum has shape"),
        (([], 4), ShapeError, "mask_spectrum has shape"),
        (([1j], 4), ShapeError, "must hold real W_l"),
        (([np.nan], 4), DataError, "mask_spectrum holds values that are not finite"),
        (([1.0], 0), ParameterError, "bandlimit=0"),
        (([1.0], 4, 4), ParameterError, "spin=4 must be smaller in size"),
    ],
)
def test_bad_input_is_named(arguments, error, message):
    with pytest.raises(error, match=message):
        mode_coupling(*arguments)
