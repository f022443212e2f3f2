"""The harmonic form of the pure estimator, against M times the derivatives themselves."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.harmonics import (
    eb_to_spin,
    multiply_by_degree,
    polarisation_factor,
    resize,
    spin_to_eb,
)
from spinsdw.healpix import flm_to_map, pixel_weights
from spinsdw.sampling import MW, MWSS
from spinsdw.separation.pure_harmonics import pure_harmonics
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.separation.smooth_masks import SmoothMasks
from spinsdw.simulation import simulate_eb
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import EPS, assert_close, needs_compiler
from tests.separation.test_smooth_masks import cap, footprint

L, SIGNAL = 160, 24


def random_eb(b_power=1.0, seed=0):
    return simulate_eb(np.ones(SIGNAL), np.full(SIGNAL, b_power), SIGNAL, seed=seed)


def polarisation(sky, e_lm, b_lm):
    plm = eb_to_spin(e_lm, b_lm)
    if isinstance(sky, HealpixSky):
        return flm_to_map(plm, sky.nside, 2)
    return SpinHarmonicTransform(L, 2, sampling=sky.sampling).synthesis(resize(plm, L))


@needs_compiler
@pytest.mark.parametrize("sampling", [MW, MWSS])
def test_pure_coefficients_are_the_mask_times_the_derivatives(sampling):
    """N_l p_lm = -(M (E~ + i B~))_lm, to rounding where the grid holds the product"""
    sky = GridSky(sampling(L), None, SIGNAL)
    smooth = SmoothMasks(sky, footprint(sky)).of_width(0.58)
    assert smooth.bandlimit + SIGNAL <= L
    e_lm, b_lm = random_eb()
    found = pure_harmonics(sky, smooth, polarisation(sky, e_lm, b_lm), L)
    scalar = SpinHarmonicTransform(L, sampling=sky.sampling)
    derivatives = multiply_by_degree(e_lm + 1j * b_lm, polarisation_factor(SIGNAL))
    expected = -scalar.analysis(smooth.values * scalar.synthesis(resize(derivatives, L)))
    found = multiply_by_degree(found, polarisation_factor(L))
    # Three terms of size up to L^2 |M P| cancel into one.
    scale = np.abs(expected).max()
    assert np.abs(found - expected)[4:].max() < 64 * L**2 * EPS * scale


@needs_compiler
@pytest.mark.parametrize(
    ("sky", "tolerance"),
    [
        (GridSky(MW(L), None, SIGNAL), 1e-12),
        (GridSky(MWSS(L), None, SIGNAL), 1e-12),
        (HealpixSky(64, 65), 3e-5),
    ],
    ids=["mw", "mwss", "healpix"],
)
def test_e_does_not_leak_into_b(sky, tolerance):
    """B = 0 gives b = 0 behind any mask, and E = 0 gives e = 0"""
    smooth = SmoothMasks(sky, footprint(sky)).of_width(0.58)
    e_lm, b_lm = random_eb(b_power=0.0)
    limit = 65
    p = np.stack([polarisation(sky, e_lm, b_lm), polarisation(sky, b_lm, e_lm)])
    e, b = spin_to_eb(pure_harmonics(sky, smooth, p, limit))
    assert np.abs(b[0]).max() < tolerance * np.abs(e[0]).max()
    assert np.abs(e[1]).max() < tolerance * np.abs(b[1]).max()
    assert np.abs(e[0]).max() > 0.1


@needs_compiler
@pytest.mark.parametrize("sampling", [MW, MWSS])
def test_a_map_sampled_at_its_own_bandlimit_goes_to_a_finer_grid(sampling):
    """The same to rounding as from a grid that holds the product, for a map known everywhere"""
    coarse, fine = GridSky(sampling(SIGNAL)), GridSky(sampling(L), None, SIGNAL)
    smooth = SmoothMasks(coarse, cap(coarse, 2.0)).of_width(1.2)
    plm = eb_to_spin(*random_eb())
    p = SpinHarmonicTransform(SIGNAL, 2, sampling=coarse.sampling).synthesis(plm)
    found = pure_harmonics(coarse, smooth, p)
    expected = pure_harmonics(fine, smooth.on(fine), fine.polarisation_map(plm))
    assert smooth.bandlimit + SIGNAL <= L
    assert_close(found, expected, ulps=64 * L)


@pytest.mark.parametrize(
    ("sky", "tolerance"),
    [(GridSky(MW(L)), 1e-12), (HealpixSky(32, 33), 1e-9)],
    ids=["mw", "healpix"],
)
@needs_compiler
def test_full_sky_gives_the_coefficients_of_the_map(sky, tolerance):
    """M = 1 has no derivatives: p_lm is P_lm"""
    e_lm, b_lm = random_eb()
    smooth = SmoothMasks(sky, np.ones(sky.map_shape)).of_width(0.5)
    found = pure_harmonics(sky, smooth, polarisation(sky, e_lm, b_lm), SIGNAL)
    assert np.abs(found - eb_to_spin(e_lm, b_lm)).max() < tolerance


@needs_compiler
def test_maps_of_a_stack_and_threads_do_not_see_each_other():
    sky = HealpixSky(16, 33, threads=1)
    smooth = SmoothMasks(sky, cap(sky)).of_width(0.8)
    stack = np.stack([polarisation(sky, *random_eb(seed=seed)) for seed in range(3)])
    found = pure_harmonics(sky, smooth, stack)
    assert found.shape == (3, 33**2)
    for one, p in zip(found, stack, strict=True):
        # Transforms of several maps round in another order.
        assert_close(one, pure_harmonics(sky, smooth, p), ulps=1024)
    two = HealpixSky(16, 33, threads=2)
    assert np.array_equal(found, pure_harmonics(two, smooth, stack))


@needs_compiler
@pytest.mark.parametrize("nside", [1, 2, 3, 16, 32])
def test_pixel_weights_integrate_low_degrees(nside):
    """sum_p w_p Y_lm(p) = sqrt(4 pi) delta_l0 for l <= 2.75 nside"""
    from spinsdw.ring_transform import HealpixTransform

    weights = pixel_weights(nside)
    transform = HealpixTransform(nside, int(2.75 * nside) + 1, real=True)
    sums = transform.adjoint_synthesis(weights)
    sums[0] -= np.sqrt(4 * np.pi)
    assert np.linalg.norm(sums) < 2e-8
    assert weights.min() > 0
