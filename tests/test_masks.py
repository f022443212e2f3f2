"""Masks: cuts, distances, tapers, resolutions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.healpix import degrade_map
from spinsdw.masks import (
    apodise,
    cap_mask,
    check_mask,
    degrade,
    distance_to_edge,
    fill_holes,
    galactic_cut,
    sky_fraction,
    taper,
    upgrade,
)
from spinsdw.sampling import MW, MWSS
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import assert_close

hp = pytest.importorskip("healpy")


def angle_table(nside):
    """Angles between all pixel centres, by healpy's vectors and atan2."""
    vectors = np.array(hp.pix2vec(nside, np.arange(12 * nside**2))).T
    crosses = np.linalg.norm(np.cross(vectors[:, None], vectors[None]), axis=-1)
    return np.arctan2(crosses, vectors @ vectors.T)


def random_mask(nside, *, seed=0, share=0.3):
    return (np.random.default_rng(seed).random(12 * nside**2) > share).astype(float)


@pytest.mark.parametrize("latitude", [0, 0.1, 0.5, 1.2])
def test_galactic_cut_keeps_latitudes_from_the_given_one_on(latitude):
    """m = [ |b| >= latitude ]"""
    colatitudes, _ = hp.pix2ang(16, np.arange(12 * 16**2))
    expected = np.abs(np.pi / 2 - colatitudes) >= latitude
    assert np.array_equal(galactic_cut(16, latitude), expected)


def test_galactic_cut_leaves_the_share_of_the_two_caps():
    """f_sky = 1 - sin(latitude)"""
    assert abs(sky_fraction(galactic_cut(64, np.radians(20))) - (1 - np.sin(np.radians(20)))) < 0.01


@pytest.mark.parametrize("latitude", [-0.1, np.pi / 2, np.nan])
def test_galactic_cut_refuses_latitudes_out_of_range(latitude):
    with pytest.raises(ParameterError, match=r"latitude=.* must be in \[0, pi/2\)"):
        galactic_cut(8, latitude)


def test_galactic_cut_refuses_to_mask_everything():
    with pytest.raises(ParameterError, match=r"latitude=1.5 must leave a pixel of nside=2"):
        galactic_cut(2, 1.5)


@pytest.mark.parametrize(
    ("nside", "mask"),
    [
        (1, random_mask(1, seed=1)),
        (3, random_mask(3, seed=3)),
        (8, random_mask(8, share=0.01)),
        (8, random_mask(8, share=0.99)),
        (8, galactic_cut(8, 0.6)),
        (8, 1 - galactic_cut(8, 0.6)),
        (8, np.arange(768) > 200),
    ],
)
def test_distance_is_to_the_nearest_masked_pixel(nside, mask):
    """min over masked p' of the angle between p and p'"""
    expected = np.min(angle_table(nside)[:, mask == 0], axis=1)
    expected[mask == 0] = 0
    assert_close(distance_to_edge(mask), expected, ulps=64)


def test_distance_to_an_antipodal_edge_is_pi():
    mask = np.ones(192)
    mask[0] = 0
    opposite = hp.vec2pix(4, *-np.array(hp.pix2vec(4, 0)))
    assert_close(distance_to_edge(mask)[opposite], np.pi, ulps=4)


def test_without_masked_pixels_the_edge_is_infinitely_far():
    assert np.all(np.isinf(distance_to_edge(np.ones(48))))
    assert np.array_equal(apodise(np.ones(48), 0.1), np.ones(48))


@given(st.floats(-2, 3))
def test_taper_rises_from_zero_to_one_with_point_symmetry(depth):
    """t(x) + t(1 - x) = 1, t = 0 below 0, t = 1 above 1"""
    left, right = taper([depth, 1 - depth])
    assert abs(left + right - 1) <= 4 * np.finfo(float).eps
    assert depth > 0 or left == 0
    assert depth < 1 or left == 1


def test_taper_is_monotonic_and_flat_to_high_order_at_both_ends():
    """t(x) < x^20 for x <= 0.01: every derivative vanishes there"""
    depths = np.linspace(0, 1, 1001)
    weights = taper(depths)
    assert np.all(np.diff(weights) >= 0)
    assert np.all(weights[1:11] < depths[1:11] ** 20)


def test_c_infinity_taper_has_the_least_power_at_high_degrees():
    """sum of |f_lm|^2 for l >= 160 of a cap with a 30 degree taper: smooth < C1 < C2"""
    transform = SpinHarmonicTransform(257, real=True)
    colatitudes = transform.sampling.colatitudes[:, None] + np.zeros(transform.shape[1])
    x = np.clip((np.radians(60) - colatitudes) / np.radians(30), 0, 1)
    tapers = (taper(x), x - np.sin(2 * np.pi * x) / (2 * np.pi), (1 - np.cos(np.pi * x)) / 2)
    smooth, c1, c2 = (np.sum(np.abs(transform.analysis(t)[160**2 :]) ** 2) for t in tapers)
    assert 5 * smooth < c1 < c2 / 50


@pytest.mark.parametrize(
    ("profile", "formula"),
    [
        ("C1", lambda x: x - np.sin(2 * np.pi * x) / (2 * np.pi)),
        ("C2", lambda x: (1 - np.cos(np.pi * x)) / 2),
        ("smooth", lambda x: 1 / (1 + np.exp(1 / x - 1 / (1 - x)))),
    ],
)
def test_apodised_cut_follows_its_closed_form(profile, formula):
    """f(x), x^2 = (1 - cos d)/(1 - cos w), 1 for d >= w"""
    nside, width = 8, np.radians(30)
    mask = galactic_cut(nside, np.radians(15))
    distances = distance_to_edge(mask)
    x = np.sqrt((1 - np.cos(distances)) / (1 - np.cos(width)))
    inside = (x > 0) & (x < 1)
    expected = mask.copy()
    expected[inside] = formula(x[inside])
    assert_close(apodise(mask, width, profile=profile), expected, ulps=64)


@pytest.mark.parametrize("profile", ["smooth", "C1", "C2"])
def test_apodising_multiplies_the_weights_there_were(profile):
    mask = random_mask(8, share=0.02)
    weighted = 0.5 * mask
    assert_close(
        apodise(weighted, 0.2, profile=profile), 0.5 * apodise(mask, 0.2, profile=profile), ulps=1
    )


@pytest.mark.parametrize(
    ("width", "profile", "message"),
    [
        (0.0, "C1", r"width=0.0 must be in \(0, pi\] radians"),
        (4.0, "C1", r"width=4.0 must be in \(0, pi\] radians"),
        (np.nan, "C1", "width=nan must be"),
        (0.1, "C3", "profile='C3' must be one of smooth, C1, C2"),
    ],
)
def test_apodising_says_what_is_wrong(width, profile, message):
    with pytest.raises(ParameterError, match=message):
        apodise(galactic_cut(4, 0.3), width, profile=profile)


@pytest.mark.parametrize("grid", [MW(9), MWSS(9)])
def test_cap_weighs_grid_points_by_their_depth(grid):
    """w = t((radius - d)/taper), cos d by the scalar product"""
    colatitudes, longitudes = grid.colatitudes[:, None], grid.longitudes
    mask = cap_mask(colatitudes, longitudes, centre=(1.0, 2.0), radius=0.9, taper_width=0.5)
    cosines = np.cos(1) * np.cos(colatitudes) + np.sin(1) * np.sin(colatitudes) * np.cos(
        longitudes - 2
    )
    assert mask.shape == grid.shape
    assert_close(mask, taper((0.9 - np.arccos(cosines)) / 0.5), ulps=1024)


def test_cap_without_taper_is_sharp():
    distances = np.array([0.0, 0.299, 0.301, np.pi])
    assert cap_mask(distances, 1.0, centre=(0, 0), radius=0.3).tolist() == [1, 1, 0, 0]


@pytest.mark.parametrize(
    ("radius", "width", "message"),
    [
        (0.0, 0.0, r"radius=0.0 must be in \(0, pi\]"),
        (3.2, 0.0, r"radius=3.2 must be in \(0, pi\]"),
        (0.2, 0.3, "taper_width=0.3 must be from 0 to radius=0.2"),
        (0.2, -0.1, "taper_width=-0.1 must be from 0 to radius=0.2"),
    ],
)
def test_cap_says_what_is_wrong(radius, width, message):
    with pytest.raises(ParameterError, match=message):
        cap_mask(0.1, 0.1, centre=(0, 0), radius=radius, taper_width=width)


def test_degrading_undoes_upgrading():
    mask = random_mask(4)
    for threshold in (None, 0.5, 1.0):
        assert np.array_equal(degrade(upgrade(mask, 16), 4, threshold=threshold), mask)


@pytest.mark.parametrize("threshold", [0.1, 0.5, 1.0])
def test_degrading_keeps_pixels_whose_mean_weight_reaches_the_threshold(threshold):
    """m = [ mean over the parts >= threshold ]"""
    mask = random_mask(16, share=0.2)
    expected = hp.ud_grade(mask, 4) >= threshold
    assert np.array_equal(degrade(mask, 4, threshold=threshold), expected)


def test_degrading_without_threshold_keeps_the_sky_fraction():
    mask = random_mask(16)
    means = degrade(mask, 4, threshold=None)
    assert_close(means, degrade_map(mask, 4), ulps=1)
    assert_close(sky_fraction(means), sky_fraction(mask), ulps=16)


@pytest.mark.parametrize("threshold", [0, 1.1, np.nan])
def test_degrading_refuses_thresholds_out_of_range(threshold):
    with pytest.raises(ParameterError, match=r"threshold=.* must be in \(0, 1\]"):
        degrade(np.ones(192), 2, threshold=threshold)


def test_degrading_refuses_to_lose_every_pixel():
    mask = np.zeros(192)
    mask[5] = 1
    with pytest.raises(DataError, match="mask is zero at all 12 pixels"):
        degrade(mask, 1, threshold=0.5)


def test_sky_fraction_is_the_mean_weight():
    assert sky_fraction(np.repeat([0.0, 0.5, 1.0], 4)) == 0.5


@pytest.mark.parametrize("function", [distance_to_edge, sky_fraction])
def test_masks_of_other_sizes_are_refused(function):
    with pytest.raises(ShapeError, match=r"must have 12 nside\*\*2"):
        function(np.ones(50))


def test_the_check_of_masks_is_one_function():
    from spinsdw import healpix

    assert check_mask is healpix.check_mask


def test_filling_holes_keeps_the_large_one_and_fills_the_small():
    """fill_holes(cut with small holes) = cut, up to the stated solid angle only."""
    cut = galactic_cut(16, np.radians(15))
    holed = cut.copy()
    one_pixel = 4 * np.pi / cut.size
    holed[[0, 100, 101, 400]] = 0
    np.testing.assert_array_equal(fill_holes(holed, 3 * one_pixel), cut)
    kept = fill_holes(holed, 1.5 * one_pixel)
    np.testing.assert_array_equal(np.flatnonzero(cut - kept), [100, 101])


def test_filling_holes_leaves_an_apodised_edge_alone():
    edge = apodise(galactic_cut(8, np.radians(20)), np.radians(20))
    np.testing.assert_array_equal(fill_holes(edge, 0.1), edge)


@pytest.mark.parametrize("largest", [0.0, -1.0, np.nan, np.inf])
def test_holes_to_fill_have_a_positive_size(largest):
    with pytest.raises(ParameterError, match=r"largest=.* must be a solid angle above 0"):
        fill_holes(np.ones(12), largest)
