"""The pure estimators through `EBSeparator`: no E in B, and what their weights say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spinsdw.datasets import planck2018_spectra
from spinsdw.errors import ParameterError
from spinsdw.harmonics import degrees, eb_to_spin, resize
from spinsdw.healpix import (
    alm_to_flm,
    eb_alm_to_spin_flm,
    flm_to_map,
    pixel_directions,
    ring_to_nested,
)
from spinsdw.masks import cap_mask
from spinsdw.polarisation import EBSeparator
from spinsdw.sampling import MW
from spinsdw.separation import HarmonicPure, Pure
from spinsdw.separation.pure_harmonics import pure_harmonics
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.separation.smooth_masks import SmoothMask, SmoothMasks, profile_mask
from spinsdw.simulation import simulate_eb
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import EPS, assert_close, needs_compiler

NSIDE, L = 32, 65
FIXTURE = Path(__file__).parents[1] / "data" / "namaster_pure.npz"

pytestmark = needs_compiler


def cap(theta, phi, radius=1.0):
    return cap_mask(theta, phi, centre=(0.9, 1.0), radius=radius)


def healpix_cap(nside=NSIDE, radius=1.0):
    return cap(*pixel_directions(nside), radius)


def simulate(kind, seed=0, bandlimit=L, beam=0.07):
    """P_lm of a sky with E alone or with the B of tensors alone."""
    spectra = planck2018_spectra()
    ee, bb = spectra["EE_unlensed"], spectra["BB_tensor"]
    pair = (ee, 0 * bb) if kind == "E" else (0 * ee, bb)
    return eb_to_spin(*simulate_eb(*pair, bandlimit, seed=seed, beam_fwhm=beam))


def healpix_stack(kinds):
    p = np.stack([flm_to_map(simulate(kind, seed), NSIDE, 2) for seed, kind in enumerate(kinds)])
    return p.real, p.imag


def leakage(coefficients, scales):
    """Power of B from E alone over that from B alone, for a stack of the two."""
    return {
        j: np.sum(coefficients[j][0].imag ** 2) / np.sum(coefficients[j][1].imag ** 2)
        for j in scales
    }


@pytest.fixture(scope="module")
def pure_maps():
    separator = EBSeparator(L, healpix_cap(), method="pure", directions=2, threads=1)
    return separator, separator.separate(*healpix_stack("EB"))


def test_e_leaks_less_than_a_hundredth_of_what_the_pseudo_estimator_lets_through(pure_maps):
    """r_leak < 1e-4 for l = 4 to 32 at nside 32, where the pseudo estimator has 5e-3 and more"""
    _, maps = pure_maps
    scales = (2, 3, 4, 5)
    found = leakage(maps.coefficients, scales)
    pseudo = EBSeparator(L, healpix_cap(), method="pseudo", directions=2).separate(
        *healpix_stack("EB")
    )
    other = leakage(pseudo.coefficients, scales)
    assert max(found.values()) < 1e-4
    assert all(found[j] < 0.01 * other[j] for j in scales)


def test_weights_are_the_masks_of_the_scales(pure_maps):
    """0 outside, 1 a width inside, the same for every orientation, narrower for finer scales"""
    separator, maps = pure_maps
    theta, phi = pixel_directions(NSIDE)
    depth = 1.0 - np.arccos(
        np.clip(np.cos(theta) * np.cos(0.9) + np.sin(theta) * np.sin(0.9) * np.cos(phi - 1), -1, 1)
    )
    spacing = np.sqrt(np.pi / 3) / NSIDE
    for j in (3, 4, 5):
        width = min(max(2.0 / 2**j, 6.0 * spacing), 0.8)
        weights = maps.weights[j]
        assert weights.min() >= 0
        assert weights.max() <= 1
        assert np.all(weights[healpix_cap() == 0] == 0)
        # Shown by interpolation between the points of the scale's own grid.
        inside = depth > width + 3 * np.pi / 2**j
        assert np.all(weights[inside] > 0.99)
    kept = maps.info.kept_fraction
    assert kept[2] < kept[3] < kept[4] < separator.mask.mean()
    # The least width that the pixels allow is that of both.
    assert abs(kept[4] - kept[5]) < 1e-3


def test_coefficients_are_those_of_the_masked_derivatives():
    """W^j is the analysis of the pure coefficients of M_j, for every part"""
    separator = EBSeparator(L, healpix_cap(), method=Pure(taper=3.0), directions=3)
    q, u = healpix_stack("E")
    maps = separator.separate(q[0], u[0])
    sky = HealpixSky(NSIDE, L)
    masks = SmoothMasks(sky, healpix_cap())
    transform = separator._transform("mw")
    p = healpix_cap() * (q[0] + 1j * u[0])
    for j, degree in ((3, 8), (4, 16)):
        width = max(3.0 / degree, 6.0 * sky.spacing)
        plm = pure_harmonics(sky, masks.of_width(width), p, L)
        expected = transform.analysis_harmonic(plm)[j]
        # Low degrees are summed without the iteration that all degrees together get.
        assert np.abs(maps.coefficients[j] - expected).max() < 1e-6 * np.abs(expected).max()


def test_maps_of_a_stack_are_those_of_each(pure_maps):
    separator, maps = pure_maps
    q, u = healpix_stack("EB")
    one = separator.separate(q[1], u[1])
    # Stacks are summed together, in another order.
    assert_close(one.B, maps.B[1], ulps=64 * L)
    assert_close(one.coefficients[4], maps.coefficients[4][1], ulps=64 * L)


def test_nested_maps_and_threads_change_nothing(pure_maps):
    _, maps = pure_maps
    q, u = healpix_stack("EB")
    mask = ring_to_nested(healpix_cap())
    other = EBSeparator(L, mask, method="pure", directions=2, nest=True, threads=2)
    found = other.separate(ring_to_nested(q), ring_to_nested(u))
    assert np.array_equal(found.B, ring_to_nested(maps.B))


@pytest.mark.parametrize("method", ["pure", "harmonic-pure"])
@pytest.mark.parametrize("mask", [None, np.ones(12 * NSIDE**2)], ids=["no mask", "ones"])
def test_full_sky_is_separated_exactly(method, mask):
    plm = simulate("E") + simulate("B", 1)
    p = flm_to_map(plm, NSIDE, 2)
    maps = EBSeparator(L, mask, method=method).separate(p.real, p.imag)
    plain = EBSeparator(L).separate(p.real, p.imag)
    assert np.abs(maps.B - plain.B).max() < 1e-9 * np.abs(plain.E).max()
    assert_close(maps.weight, np.ones(12 * NSIDE**2), ulps=64)


@pytest.mark.parametrize("bandlimit", [3, 4, 5])
def test_smallest_bandlimits(bandlimit):
    """Scales without any degree of spin 2 are zero, the others pure"""
    grid = MW(72)
    mask = cap(grid.colatitudes[:, None], grid.longitudes, 1.5)
    plm = eb_to_spin(*simulate_eb(np.ones(5), np.zeros(5), bandlimit, seed=1))
    p = GridSky(grid, None, bandlimit).polarisation_map(plm)
    maps = EBSeparator(bandlimit, mask, method=HarmonicPure(1.2)).separate(p.real, p.imag)
    assert np.abs(maps.B).max() < 1e-12 * np.abs(maps.E).max()
    assert np.abs(maps.E).max() > 0.01


@pytest.mark.parametrize(
    ("width", "size"), [(20, 384), pytest.param(10, 576, marks=pytest.mark.slow)]
)
def test_leakage_on_a_grid_that_holds_the_product_is_rounding(width, size):
    """L = 128: r_leak is below 1e-24 in every band, for tapers of 20 and of 10 degrees"""
    bandlimit, grid = 128, MW(size)
    mask = cap(grid.colatitudes[:, None], grid.longitudes)
    transform = SpinHarmonicTransform(size, 2)
    widths = dict.fromkeys(["scaling", *range(2, 8)], np.radians(width))
    separator = EBSeparator(bandlimit, mask, method=Pure(widths=widths))
    flms = [resize(simulate(kind, seed, bandlimit, 0.0), size) for seed, kind in enumerate("EB")]
    p = transform.synthesis(np.stack(flms))
    found = leakage(separator.separate(p.real, p.imag).coefficients, range(2, 8))
    assert max(found.values()) < 1e-24


def test_coefficients_are_those_of_namaster():
    """For one band-limited mask, NaMaster's purified E and B with its iterations converged

    To rounding where pixel weights are exact, l + 32 <= 2.75 nside; to 1e-5 up to l = 2 nside.
    """
    nside, stored = 16, np.load(FIXTURE)
    mask = SmoothMask(0.5, HealpixSky(nside, 33), alm_to_flm(stored["mask_alm"], 21))
    p = flm_to_map(eb_alm_to_spin_flm(*stored["sky_alm"]), nside, 2)
    found = pure_harmonics(mask.sky, mask, p)
    expected = eb_alm_to_spin_flm(*stored["pure_alm"])
    error = np.abs(found - expected)[4:] / np.abs(expected).max()
    low = degrees(33)[4:] + 32 <= 2.75 * nside
    assert error[low].max() < 2**12 * EPS
    assert error.max() < 1e-5


def test_tapers_differentiated_in_harmonic_space_are_those_of_namaster():
    """With its C1 taper and its own three iterations the root mean square differs by 1 per cent:
    both differentiate a mask that has no bandlimit, by different fits
    """
    nside, stored = 16, np.load(FIXTURE)
    theta, phi = pixel_directions(nside)
    cosine = np.cos(theta) * np.cos(1.1) + np.sin(theta) * np.sin(1.1) * np.cos(phi - 0.7)
    footprint = (cosine > 0.2).astype(float)
    sky = HealpixSky(nside, 33)
    mask = profile_mask(sky, footprint, np.radians(20), "C1")
    p = footprint * flm_to_map(eb_alm_to_spin_flm(*stored["sky_alm"]), nside, 2)
    expected = eb_alm_to_spin_flm(*stored["c1_pure_alm"])
    expected[:4] = 0
    error = np.linalg.norm(pure_harmonics(sky, mask, p) - expected)
    assert error < 0.02 * np.linalg.norm(expected)


@pytest.mark.parametrize("profile", ["smooth", "C1", "C2"])
def test_one_mask_for_all_scales(profile):
    """Weights of all parts are one mask, and r_leak is below 1e-2 where a plain taper's is not"""
    method = HarmonicPure(np.radians(15), profile)
    separator = EBSeparator(L, healpix_cap(), method=method)
    maps = separator.separate(*healpix_stack("EB"))
    assert (
        len(
            {
                id(mask)
                for mask in separator._prepared(HealpixSky(NSIDE, L)).estimator.masks.values()
            }
        )
        == 1
    )
    assert max(leakage(maps.coefficients, (3, 4)).values()) < 1e-2


def test_widths_of_single_scales_are_taken():
    method = Pure(widths={4: 0.4, "scaling": 0.7})
    separator = EBSeparator(L, healpix_cap(), method=method)
    q, u = healpix_stack("E")
    separator.separate(q[0], u[0])
    masks = separator._prepared(HealpixSky(NSIDE, L)).estimator.masks
    assert masks[4].width == 0.4
    assert masks["scaling"].width == 0.7
    assert masks[3].width == 0.25
    assert masks[2].width == 0.5


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pure(taper=0), r"taper=0 must be positive and finite; 2.0 keeps"),
        (lambda: Pure(samples=np.nan), r"samples=nan must be positive"),
        (lambda: Pure(taper=True), r"taper=True must be positive"),
        (lambda: Pure(widths={3: -1.0}), r"widths\[3\]=-1.0 must be positive"),
        (lambda: Pure(largest_share=1.0), r"largest_share=1.0 must be below 1"),
        (lambda: HarmonicPure(width="5"), r"width='5' must be positive"),
        (lambda: HarmonicPure(profile="C3"), r"profile='C3' is not known; use one of 'smooth'"),
    ],
)
def test_bad_choices_are_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_footprints_and_scales_that_do_not_suit_are_refused():
    q = np.zeros(12 * NSIDE**2)
    with pytest.raises(ParameterError, match=r"widths has the part 9; the parts of these"):
        EBSeparator(L, healpix_cap(), method=Pure(widths={9: 0.1})).separate(q, q)
    tiny = healpix_cap(radius=0.03)
    for method in ("pure", "harmonic-pure"):
        with pytest.raises(ParameterError, match=r"mask holds no disc larger than 0.0.* radians"):
            EBSeparator(L, tiny, method=method).separate(q, q)
    grid = MW(16)
    mask = cap(grid.colatitudes[:, None], grid.longitudes, 1.5)
    with pytest.raises(ParameterError, match=r"profile='C1' needs HEALPix maps; use"):
        EBSeparator(16, mask, method=HarmonicPure(0.5, "C1")).separate(0 * mask, 0 * mask)
