"""Smooth masks: where they are 0 and 1, and that their derivatives are theirs."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import ParameterError
from spinsdw.harmonics import lower_spin
from spinsdw.healpix import pixel_directions
from spinsdw.sampling import MW, MWSS
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.separation.smooth_masks import SmoothMasks, concentrated_kernel
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import EPS, assert_close, needs_compiler

NSIDE = 32
SKIES = [HealpixSky(NSIDE, 65), GridSky(MW(96)), GridSky(MWSS(96), None, 2)]
each_sky = pytest.mark.parametrize("sky", SKIES, ids=["healpix", "mw", "mwss"])


def vectors(theta, phi):
    parts = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    return np.stack(parts, axis=-1)


def footprint(sky):
    """A cap with a hole in it and a corner cut out."""
    theta, phi = sky.points
    seen = theta < 1.6
    seen &= vectors(theta, phi) @ vectors(np.array(0.7), np.array(2.0)) < np.cos(0.15)
    seen &= ~((theta > 1.1) & (phi < 0.8))
    return seen.astype(float)


def cap(sky, radius=1.4):
    return (sky.points[0] < radius).astype(float)


@pytest.mark.parametrize(("bandlimit", "radius"), [(2, 0.5), (3, 1.0), (12, 0.7), (40, 0.1)])
def test_kernel_is_the_one_a_cap_holds_best(bandlimit, radius):
    """g_l = sqrt(2l+1) b_l is the first eigenvector of int_cap Y_l0 Y_l'0"""
    kernel = concentrated_kernel(bandlimit, radius)
    nodes, weights = np.polynomial.legendre.leggauss(2 * bandlimit)
    half = (1 - np.cos(radius)) / 2
    basis = np.polynomial.legendre.legvander(1 - half * (1 - nodes), bandlimit - 1)
    basis = basis * np.sqrt(np.arange(bandlimit) + 0.5)
    energy = (basis * (weights * half)[:, None]).T @ basis
    best = np.linalg.eigh(energy)[1][:, -1] / np.sqrt(2 * np.arange(bandlimit) + 1)
    assert kernel[0] == 1
    assert_close(kernel, best / best[0], ulps=2**12 * bandlimit)


@needs_compiler
@each_sky
@pytest.mark.parametrize("width", [0.25, 0.5])
def test_mask_is_zero_outside_and_one_a_width_inside(sky, width):
    """M = 0 where not observed, 1 where d > w, between 0 and 1 else, but for exp(-L_M w / 2)"""
    mask = footprint(sky)
    smooth = SmoothMasks(sky, mask).of_width(width)
    some = np.random.default_rng(0).choice(mask.size, 1000, replace=False)
    points = vectors(*sky.points).reshape(-1, 3)
    hidden = points[mask.ravel() == 0]
    depth = np.arccos(np.clip((points[some] @ hidden.T).max(axis=1), -1, 1))
    inside = some[depth > smooth.width]
    assert smooth.width == width
    assert inside.size > 10
    assert np.all(smooth.values[mask == 0] == 0)
    assert np.all(smooth.first[mask == 0] == 0)
    assert np.all(smooth.second[mask == 0] == 0)
    concentration = (smooth.bandlimit * width - np.pi) / 2
    bound = 100 * np.exp(-concentration) + 1e4 * EPS
    assert smooth.ringing < bound
    assert np.abs(smooth.values.ravel()[inside] - 1).max() < bound
    assert smooth.values.min() > -bound
    assert smooth.values.max() < 1 + bound


@needs_compiler
@pytest.mark.parametrize("sampling", [MW, MWSS])
def test_derivatives_are_those_of_the_mask(sampling):
    """(eth-bar M)_lm = -sqrt(l(l+1)) M_lm for spin -1, and once more for spin -2"""
    sky = GridSky(sampling(160), None, 16)
    smooth = SmoothMasks(sky, footprint(sky)).of_width(0.55)
    assert smooth.bandlimit <= 160
    flm, first, second = (
        SpinHarmonicTransform(160, spin, sampling=sky.sampling).analysis(values.astype(complex))
        for spin, values in ((0, smooth.values), (-1, smooth.first), (-2, smooth.second))
    )
    assert_close(first, lower_spin(flm, 0), ulps=2**14 * 160)
    assert_close(second, lower_spin(lower_spin(flm, 0), -1), ulps=2**14 * 160)


@needs_compiler
@each_sky
def test_derivatives_are_limits_of_differences(sky):
    """eth-bar M = -M', eth-bar^2 M = M'' - M' cot(theta) for an M of theta alone"""
    smooth = SmoothMasks(sky, cap(sky)).of_width(0.9)
    theta = sky.points[0].reshape(len(smooth.values), -1)[:, 0]
    values, first, second = (
        np.asarray(array).reshape(theta.size, -1)[:, 0]
        for array in (smooth.values, smooth.first, smooth.second)
    )
    ring = np.unique(np.round(theta, 12), return_index=True)[1]
    ring = ring[(theta[ring] > 0.2) & (theta[ring] < 1.35)]
    slope = np.gradient(values[ring], theta[ring], edge_order=2)
    curve = np.gradient(-first[ring].real, theta[ring], edge_order=2)
    step = np.diff(theta[ring]).max()
    # M changes over width / sqrt(concentration); differences are right to its square.
    tolerance = 6 * (step * 6 / 0.9) ** 2
    assert np.abs(first[ring].real + slope).max() < tolerance * np.abs(first).max()
    found = second[ring].real
    expected = curve + first[ring].real / np.tan(theta[ring])
    assert np.abs(found - expected)[1:-1].max() < tolerance * np.abs(second).max()


@needs_compiler
@each_sky
def test_partial_weights_are_smoothed(sky):
    """Where all weights are alike M is their value, where they vary it stays between them"""
    mask = footprint(sky)
    half = SmoothMasks(sky, 0.5 * mask).of_width(0.4)
    full = SmoothMasks(sky, mask).of_width(0.4)
    assert_close(half.values, 0.5 * full.values, ulps=64)
    rng = np.random.default_rng(0)
    rough = SmoothMasks(sky, mask * rng.uniform(0.4, 0.6, mask.shape)).of_width(0.4)
    bound = 1e-5
    assert np.all(rough.values >= 0.4 * full.values - bound)
    assert np.all(rough.values <= 0.6 * full.values + bound)
    assert np.ptp(rough.values[full.values > 0.999]) < 0.1


@each_sky
def test_full_sky_has_the_mask_one(sky):
    smooth = SmoothMasks(sky, np.ones(sky.map_shape)).of_width(0.3)
    assert_close(smooth.values, np.ones(sky.map_shape), ulps=64)
    assert not smooth.first.any()
    assert not smooth.second.any()


@needs_compiler
def test_each_width_is_made_once_and_wide_ones_are_clipped():
    sky = HealpixSky(NSIDE, 65)
    masks = SmoothMasks(sky, cap(sky, 0.6), largest_share=0.5)
    assert abs(masks.inradius - 0.6) < 2 / NSIDE
    assert masks.of_width(1.0) is masks.of_width(2.0)
    assert masks.of_width(1.0).width == 0.5 * masks.inradius
    assert not masks.of_width(0.2).values.flags.writeable


def test_widths_that_samples_do_not_resolve_are_refused():
    sky = HealpixSky(4, 9)
    with pytest.raises(ParameterError, match=r"width=0.1 must be at least 0.45 radians"):
        SmoothMasks(sky, cap(sky)).of_width(0.1)
    with pytest.raises(ParameterError, match=r"width=nan must be"):
        SmoothMasks(sky, cap(sky)).of_width(np.nan)


def test_footprint_without_room_for_a_taper_is_refused():
    sky = HealpixSky(8, 17)
    mask = np.zeros(sky.map_shape)
    mask[300:303] = 1
    with pytest.raises(ParameterError, match=r"mask holds no disc larger than 0.1"):
        SmoothMasks(sky, mask).of_width(0.3)


@pytest.mark.parametrize("nside", [1, 2, 3, 8])
def test_no_point_is_farther_from_a_sample_than_narrowest_says(nside):
    for sky in (HealpixSky(nside, 2), GridSky(MW(nside + 1)), GridSky(MWSS(nside + 1))):
        points = vectors(*pixel_directions(32))
        samples = vectors(*sky.points).reshape(-1, 3)
        farthest = np.arccos(np.clip((points @ samples.T).max(axis=1), -1, 1)).max()
        assert 2 * farthest < SmoothMasks(sky, cap(sky)).narrowest
