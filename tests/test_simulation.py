"""Gaussian fields, beams and noise: statistics, seeds, and healpy's conventions."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import conjugate_field, degrees, power_spectrum
from spinsdw.healpix import flm_to_alm, qu_to_eb_flm
from spinsdw.simulation import (
    gaussian_beam,
    gaussian_flm,
    random_flm,
    random_wigner,
    simulate_eb,
    simulate_qu,
    white_noise_qu,
)
from spinsdw.wigner_transform import WignerTransform
from tests.helpers import EPS, assert_close

hp = pytest.importorskip("healpy")

L = 48


def test_drawn_coefficients_are_those_of_a_real_field():
    """f_l,-m = (-1)^m conj(f_lm), exactly"""
    flm = gaussian_flm(np.ones(L), L, seed=1)
    assert np.array_equal(conjugate_field(flm), flm)


@pytest.mark.parametrize("m", [0, 1, -3])
def test_every_coefficient_has_the_variance_of_the_spectrum(m):
    """<|f_lm|^2> = C_l, real and imaginary parts alike for m > 0"""
    spectrum = np.arange(1.0, 6)
    drawn = np.stack([gaussian_flm(spectrum, 5, seed=[1, i]) for i in range(4000)])
    column = drawn[:, 4 * 4 + 4 + m]
    assert abs(np.mean(np.abs(column) ** 2) / 5 - 1) < 5 * np.sqrt(2 / 4000)
    if m:
        assert abs(np.mean(column**2)) < 5 * 5 / np.sqrt(4000)


def test_power_of_one_draw_scatters_about_the_spectrum():
    """sum over l of (2l + 1) Chat_l / C_l = chi^2 with L^2 degrees of freedom"""
    spectrum = 1.0 / np.arange(1, L + 1)
    power = power_spectrum(gaussian_flm(spectrum, L, seed=2)) / spectrum
    chi_squared = np.sum((2 * np.arange(L) + 1) * power)
    assert abs(chi_squared - L**2) < 5 * np.sqrt(2) * L


def test_a_larger_bandlimit_keeps_the_large_scales():
    spectrum = np.ones(100)
    small, large = (gaussian_flm(spectrum, bandlimit, seed=3) for bandlimit in (20, 100))
    assert np.array_equal(large[:400], small)


@pytest.mark.parametrize("seed", [5, [5, 6], np.random.SeedSequence(5, spawn_key=(2,))])
def test_a_seed_gives_the_same_numbers_each_time(seed):
    first, second = (simulate_eb(np.ones(8), np.ones(8), 8, seed=seed) for _ in range(2))
    assert np.array_equal(first, second)


def test_streams_of_one_seed_differ():
    e_lm, b_lm = simulate_eb(np.ones(L), np.ones(L), L, seed=4)
    other, _ = simulate_eb(np.ones(L), np.ones(L), L, seed=5)
    for first, second in ((e_lm, b_lm), (e_lm, other)):
        correlation = np.vdot(first, second).real / np.vdot(first, first).real
        assert abs(correlation) < 5 / L


@pytest.mark.parametrize("seed", [None, 1.5, True, "1", -1, [1, -2], [1.5]])
def test_seeds_must_be_given_as_integers(seed):
    with pytest.raises(ParameterError, match=r"seed=.* must "):
        gaussian_flm(np.ones(4), 4, seed=seed)


def test_a_seed_must_be_given():
    with pytest.raises(TypeError, match="seed"):
        gaussian_flm(np.ones(4), 4)


@pytest.mark.parametrize(
    ("spectrum", "error", "message"),
    [
        (np.ones(7), ShapeError, r"spectra_bb has shape \(7,\) but must hold C_l for l = 0 to 7"),
        (np.ones((8, 2)), ShapeError, r"spectra_bb has shape \(8, 2\)"),
        (-np.ones(8), DataError, "spectra_bb holds 8 values that are negative or not finite"),
        (np.full(8, np.nan), DataError, "spectra_bb holds 8 values"),
    ],
)
def test_spectra_are_checked_by_name(spectrum, error, message):
    with pytest.raises(error, match=message):
        simulate_eb(np.ones(8), spectrum, 8, seed=1)


@pytest.mark.parametrize("arcmin", [0.0, 10.0, 60.0])
def test_beam_is_healpy_s_for_polarisation(arcmin):
    """b_l = exp(-(l(l+1) - 4) sigma^2 / 2)"""
    fwhm = np.radians(arcmin / 60)
    expected = hp.gauss_beam(fwhm, lmax=L - 1, pol=True)
    assert_close(gaussian_beam(fwhm, L), expected[:, 1], ulps=16)
    assert_close(gaussian_beam(fwhm, L), expected[:, 2], ulps=16)


@pytest.mark.parametrize("fwhm", [-0.1, np.nan, np.inf])
def test_beam_width_is_checked(fwhm):
    with pytest.raises(ParameterError, match=r"fwhm=.* must be finite and at least 0"):
        gaussian_beam(fwhm, 8)


def test_simulated_fields_carry_the_beam_and_no_degree_below_two():
    """E_lm -> b_l E_lm for l >= 2"""
    spectrum, fwhm = np.ones(L), np.radians(2)
    sharp = simulate_eb(spectrum, spectrum, L, seed=6)
    smooth = simulate_eb(spectrum, spectrum, L, seed=6, beam_fwhm=fwhm)
    factor = gaussian_beam(fwhm, L)[degrees(L)]
    assert_close(np.array(smooth), factor * np.array(sharp), ulps=4)
    assert not np.array(sharp)[:, :4].any()


def test_simulated_maps_are_healpy_s():
    """Q + iU = - sum (E + iB) 2Ylm"""
    nside, bandlimit = 16, 33
    e_lm, b_lm = simulate_eb(np.ones(bandlimit), np.ones(bandlimit), bandlimit, seed=7)
    alms = [flm_to_alm(e_lm), flm_to_alm(b_lm)]
    expected = hp.alm2map_spin(alms, nside, 2, bandlimit - 1)
    assert_close(np.array(simulate_qu(e_lm, b_lm, nside)), expected, ulps=64 * bandlimit)


def test_simulated_maps_return_their_coefficients():
    e_lm, b_lm = simulate_eb(np.ones(17), np.ones(17), 17, seed=8)
    again = qu_to_eb_flm(*simulate_qu(e_lm, b_lm, 8), 17)[:2]
    assert_close(np.array(again), np.array([e_lm, b_lm]), ulps=1e-9 / EPS)


def test_noise_has_the_level_asked_for_and_no_correlation():
    """sigma_pix sqrt(4 pi / npix) = level, in arcmin, for Q and for U"""
    nside = 64
    q, u = white_noise_qu(nside, 5.0, seed=9)
    side = hp.nside2resol(nside, arcmin=True)
    tolerance = 5 / np.sqrt(q.size)
    assert abs(q.std() * side / 5 - 1) < tolerance
    assert abs(u.std() * side / 5 - 1) < tolerance
    assert abs(np.mean(q * u)) < tolerance * q.std() * u.std()


@pytest.mark.parametrize("level", [-1.0, np.nan])
def test_noise_level_is_checked(level):
    with pytest.raises(ParameterError, match=r"uk_arcmin=.* must be finite and at least 0"):
        white_noise_qu(8, level, seed=1)


@pytest.mark.parametrize("spin", [0, 2, -3])
def test_random_fields_of_any_spin_have_their_spectrum(spin):
    """|f_lm|^2 / C_l is exponential: of M modes the mean is 1 within 6 / sqrt(M)."""
    bandlimit = 64
    spectrum = 1 / (1.0 + np.arange(bandlimit))
    flm = random_flm(bandlimit, spin, seed=3, spectrum=spectrum)
    assert not flm[: spin**2].any()
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    ratio = (np.abs(flm) ** 2 / spectrum[el])[spin**2 :]
    assert abs(ratio.mean() - 1) < 6 / np.sqrt(ratio.size)
    assert abs(np.mean(flm[spin**2 :] ** 2 / spectrum[el][spin**2 :])) < 6 / np.sqrt(ratio.size)
    assert np.array_equal(flm[: 20**2], random_flm(20, spin, seed=3, spectrum=spectrum))


@pytest.mark.parametrize(("orders", "real"), [((-2, 0, 2), True), ((-1, 1), True), ((1, 3), False)])
def test_random_functions_of_rotations_are_what_they_say(orders, real):
    """Unit variance at el >= |n|; a real one comes back as a real function."""
    bandlimit = 12
    wigner = random_wigner(bandlimit, orders, seed=2, real=real)
    assert wigner.shape == (len(orders), bandlimit**2)
    for row, n in zip(wigner, orders, strict=True):
        assert not row[: n * n].any()
        kept = np.abs(row[n * n :]) ** 2
        assert abs(kept.mean() - 1) < 6 * np.sqrt(2 / kept.size)
    values = WignerTransform(bandlimit, orders).synthesis(wigner)
    assert (np.abs(values.imag).max() < 1e-13 * np.abs(values).max()) == real


def test_orders_of_a_random_function_do_not_depend_on_each_other():
    both = random_wigner(6, (-1, 1), seed=4)
    assert np.array_equal(random_wigner(6, (1,), seed=4)[0], both[1])
    assert not np.array_equal(both[0], both[1])


def test_random_signals_name_what_is_wrong():
    with pytest.raises(ParameterError, match="spin="):
        random_flm(4, 1.5, seed=1)
    with pytest.raises(ParameterError, match="real=True needs orders symmetric about 0"):
        random_wigner(4, (0, 1), seed=1, real=True)
    with pytest.raises(ShapeError, match="spectrum has shape"):
        random_flm(4, seed=1, spectrum=np.ones(2))
