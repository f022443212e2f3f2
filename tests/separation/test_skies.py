"""The pixelisations a separation works on."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import ParameterError, ShapeError
from spinsdw.harmonics import is_real_field, resize
from spinsdw.healpix import flm_to_map
from spinsdw.sampling import MW, MWSS
from spinsdw.separation.skies import GridSky, HealpixSky, finer_grid, position_map, sky_of
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import EPS, assert_close, random_flm, random_like

NSIDE, L = 8, 16
SKIES = [
    GridSky(MW(L)),
    GridSky(MWSS(L)),
    HealpixSky(NSIDE, L),
    GridSky(MW(20), None, L),
    GridSky(MWSS(20), None, L),
]
names = ["mw", "mwss", "healpix", "finer mw", "finer mwss"]
each_sky = pytest.mark.parametrize("sky", SKIES, ids=names)


def real_flm(bandlimit, seed=0):
    field = SpinHarmonicTransform(bandlimit).synthesis(random_flm(bandlimit, seed=seed)).real
    return SpinHarmonicTransform(bandlimit, real=True).analysis(field)


@pytest.mark.parametrize(
    ("shape", "bandlimit", "expected"),
    [
        ((12 * 8**2,), 11, HealpixSky(8, 11)),
        ((12 * 8**2,), None, HealpixSky(8, 17)),
        ((12 * 3**2,), None, HealpixSky(3, 7)),
        ((16, 31), None, GridSky(MW(16))),
        ((16, 31), 16, GridSky(MW(16))),
        ((17, 32), 16, GridSky(MWSS(16))),
        ((16, 31), 12, GridSky(MW(16), None, 12)),
        ((17, 32), 12, GridSky(MWSS(16), None, 12)),
        ((1, 1), None, GridSky(MW(1))),
        ((2, 2), None, GridSky(MWSS(1))),
    ],
)
def test_shape_of_a_map_says_where_its_pixels_are(shape, bandlimit, expected):
    """(12 nside^2,) is HEALPix, (L, 2 L - 1) is MW, (L + 1, 2 L) is MWSS"""
    sky = sky_of(np.zeros(shape), bandlimit, name="q", threads=None)
    assert sky == expected
    assert sky.bandlimit == expected.bandlimit


@pytest.mark.parametrize("shape", [(), (16, 29), (16, 16), (0, 0), (1, 16, 31), (2, 12 * 8**2)])
def test_other_shapes_are_refused_with_the_three_allowed(shape):
    message = r"q has shape \(.*\); it must be a HEALPix map \(12 nside\^2,\), an MW map"
    with pytest.raises(ShapeError, match=message):
        sky_of(np.zeros(shape), None, name="q", threads=None)


def test_wrong_number_of_pixels_is_refused():
    with pytest.raises(ShapeError, match="last axis has 767 pixels but must have 12 nside"):
        sky_of(np.zeros(767), None, name="q", threads=None)


@pytest.mark.parametrize("shape", [(16, 31), (17, 32)])
def test_grids_too_coarse_for_the_bandlimit_are_refused(shape):
    message = r"mask has the shape \(.*\) of bandlimit 16, below bandlimit=18; lower it"
    with pytest.raises(ParameterError, match=message):
        sky_of(np.zeros(shape), 18, name="mask", threads=None)


@each_sky
def test_scalar_map_is_the_synthesis_at_the_points_of_the_sky(sky):
    """f(p) = sum_lm f_lm Y_lm(p) for coefficients of a smaller bandlimit as well"""
    flm = random_flm(9, seed=1)
    if isinstance(sky, HealpixSky):
        expected = flm_to_map(resize(flm, L), NSIDE)
    else:
        size = sky.sampling.bandlimit
        expected = SpinHarmonicTransform(size, sampling=sky.sampling).synthesis(resize(flm, size))
    assert_close(sky.scalar_map(flm), expected, ulps=16 * L)


@each_sky
def test_polarisation_coefficients_are_those_of_the_map(sky):
    """P = sum_lm P_lm 2Y_lm is undone: to rounding on grids, to the tolerance on HEALPix"""
    plm = random_flm(L, 2, seed=2)
    if isinstance(sky, HealpixSky):
        found, fit = sky.polarisation_coefficients(flm_to_map(plm, NSIDE, 2))
        assert fit.residual < sky.tolerance
        assert np.max(np.abs(found - plm)) < 10 * sky.tolerance * np.max(np.abs(plm))
    else:
        size = sky.sampling.bandlimit
        transform = SpinHarmonicTransform(size, 2, sampling=sky.sampling)
        p = transform.synthesis(resize(plm, size))
        found, fit = sky.polarisation_coefficients(p)
        assert fit is None
        assert_close(found, plm, ulps=16 * L)


@pytest.mark.parametrize("bandlimit", [5, 16, 31])
@pytest.mark.parametrize("sampling", [MW, MWSS])
def test_integrals_on_a_grid_are_those_of_the_function_its_samples_define(sampling, bandlimit):
    """<Y_lm, w> for l below the bandlimit, 0 from L on"""
    flm = real_flm(L)
    weights = SpinHarmonicTransform(L, sampling=sampling(L), real=True).synthesis(flm)
    found = GridSky(sampling(L)).integrals(weights, bandlimit)
    assert_close(found, resize(flm, bandlimit), ulps=16 * L)


@pytest.mark.parametrize("bandlimit", [5, 16, 4 * NSIDE + 1])
def test_integrals_on_healpix_are_sums_over_pixels(bandlimit):
    """(4 pi / npix) sum_p conj(Y_lm(p)) w_p, at any bandlimit"""
    weights = np.random.default_rng(0).random(12 * NSIDE**2)
    found = HealpixSky(NSIDE, L).integrals(weights, bandlimit)
    assert is_real_field(found)
    probe = real_flm(bandlimit, seed=5)
    expected = np.mean(weights * flm_to_map(probe, NSIDE).real) * 4 * np.pi
    scale = np.linalg.norm(found) * np.linalg.norm(probe)
    assert abs(np.vdot(probe, found) - expected) < 1e-14 * scale
    assert_close(found[0], np.sqrt(4 * np.pi) * weights.mean(), ulps=64)


@each_sky
@pytest.mark.parametrize("scale", [2, 3, 4])
def test_position_map_of_a_constant_is_the_constant(sky, scale):
    transform = SpinWaveletTransform(L, 2, 3, sampling=sky.sampling_name)
    shape = transform.shapes[scale][1:]
    for value in (0.0, 0.25, 1.0):
        found = position_map(np.full(shape, value), transform, scale, sky)
        assert found.dtype == np.float64
        assert_close(found, np.full(found.shape, value), ulps=16 * L)


@each_sky
def test_position_map_stays_in_the_unit_interval(sky):
    """A step rings when it is interpolated, a weight must not"""
    transform = SpinWaveletTransform(L, 2, sampling=sky.sampling_name)
    values = (np.random.default_rng(0).random(transform.shapes[3][1:]) > 0.5).astype(float)
    found = position_map(values, transform, 3, sky)
    assert found.min() == 0
    assert found.max() == 1


@pytest.mark.parametrize("sampling", [MW, MWSS])
def test_position_map_keeps_a_band_limited_weight(sampling):
    """The finest scale lives on the grid of the sky itself, where its weights come back"""
    transform = SpinWaveletTransform(L, 2, sampling=sampling(L))
    flm = 0.05 * real_flm(4)
    flm[0] = 0.5 * np.sqrt(4 * np.pi)
    values = SpinHarmonicTransform(L, sampling=sampling(L), real=True).synthesis(resize(flm, L))
    assert values.min() > 0
    assert values.max() < 1
    scale = transform.scales[-1]
    assert_close(position_map(values, transform, scale, GridSky(sampling(L))), values, ulps=16 * L)


@pytest.mark.parametrize("sky", [sky for sky in SKIES if isinstance(sky, GridSky)])
def test_maps_and_their_adjoint_keep_to_the_bandlimit(sky):
    """<Y a, p> = <a, Y^H p> for coefficients of the sky's bandlimit, whatever that of its grid"""
    plm, p = random_flm(L, 2, seed=3), random_like(np.zeros(sky.map_shape, complex), seed=4)
    left = np.vdot(p, sky.polarisation_map(plm))
    assert sky.adjoint_polarisation_map(p).shape == plm.shape
    right = np.vdot(sky.adjoint_polarisation_map(p), plm)
    assert abs(left - right) < 64 * L * EPS * np.linalg.norm(p) * np.linalg.norm(plm)


@pytest.mark.parametrize("sampling", [MW, MWSS])
@pytest.mark.parametrize(("bandlimit", "least"), [(5, 5), (5, 6), (8, 40), (1, 7), (7, 3)])
def test_finer_grid_holds_the_samples(sampling, bandlimit, least):
    coarse = sampling(bandlimit)
    fine, (rings, places) = finer_grid(coarse, least)
    assert fine.bandlimit >= max(least, bandlimit)
    assert_close(fine.colatitudes[rings], coarse.colatitudes, ulps=8)
    assert_close(fine.longitudes[places], coarse.longitudes, ulps=8)


@each_sky
def test_nearest_sample_is_the_nearest(sky):
    """The map of the samples' own numbers, looked up near them, gives the numbers"""
    rng = np.random.default_rng(1)
    numbers = np.arange(np.prod(sky.map_shape)).reshape(sky.map_shape)
    theta, phi = (angle.copy() for angle in sky.points)
    theta = np.clip(theta + rng.uniform(-0.01, 0.01, theta.shape), 0, np.pi)
    found = sky.nearest(numbers, (theta, phi))
    assert np.array_equal(found, numbers)


@each_sky
def test_spacing_is_that_of_neighbours(sky):
    theta = np.unique(sky.points[0])
    assert 0.5 < sky.spacing / np.median(np.diff(theta)) < 2
