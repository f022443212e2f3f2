"""E and B from Q and U: exact on the full sky, weighed by what each wavelet sees if masked."""

from __future__ import annotations

import dataclasses
import functools
import pickle

import numpy as np
import pytest

from spinsdw.datasets import planck2018_spectra
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import eb_to_spin, lower_spin, raise_spin, resize
from spinsdw.healpix import UNSEEN, convert_polconv, flm_to_map, pixel_directions, ring_to_nested
from spinsdw.masks import distance_to_edge, galactic_cut, taper
from spinsdw.polarisation import EBSeparator
from spinsdw.separation import Hybrid, Pseudo
from spinsdw.separation.energy_share import energy_shares
from spinsdw.separation.skies import sky_of
from spinsdw.simulation import simulate_eb, simulate_qu
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import EPS, assert_close, needs_compiler

L, NSIDE, NPIX = 16, 8, 768
SHAPES = {"mw": (16, 31), "mwss": (17, 32), "healpix": (NPIX,)}
each_grid = pytest.mark.parametrize("sampling", ["mw", "mwss"])
each_sampling = pytest.mark.parametrize("sampling", list(SHAPES))
each_directions = pytest.mark.parametrize("directions", [1, 2, 3])


pseudo = functools.partial(EBSeparator, method="pseudo")


def synthesis(flm, sampling, spin=0):
    if sampling == "healpix":
        return flm_to_map(flm, NSIDE, spin)
    return SpinHarmonicTransform(L, spin, sampling=sampling).synthesis(flm)


def random_eb(seed=0):
    """Coefficients of real fields E and B with the same power at every degree from 2 on."""
    return simulate_eb(np.ones(L), np.ones(L), L, seed=seed)


def random_qu(sampling, seed=0):
    p = synthesis(eb_to_spin(*random_eb(seed)), sampling, 2)
    return p.real, p.imag


def colatitudes(sampling):
    """Colatitude of every point of the sky."""
    if sampling == "healpix":
        return pixel_directions(NSIDE)[0]
    rings = SpinHarmonicTransform(L, sampling=sampling).sampling.colatitudes
    return np.broadcast_to(rings[:, None], SHAPES[sampling])


def south(sampling, edge=1.3):
    """Observe what lies south of an edge, which is 0.3 radians wide."""
    return taper((colatitudes(sampling) - edge) / 0.3)


def ulps(sampling):
    """Rounding on grids; on HEALPix ten times the tolerance of the fit, 1e-10."""
    return 1e-9 / EPS if sampling == "healpix" else 64 * L


def assert_same_maps(found, expected, count=0.0):
    """E and B agree to so many ulps of the larger of the two."""
    assert_close(np.array([found.E, found.B]), np.array([expected.E, expected.B]), ulps=count)


# The full sky


@each_sampling
@each_directions
def test_full_sky_separation_is_exact(sampling, directions):
    """E and B are those whose coefficients gave P_lm = -(E_lm + i B_lm)"""
    e_lm, b_lm = random_eb()
    maps = pseudo(L, directions=directions).separate(*random_qu(sampling))
    assert maps.E.shape == maps.B.shape == SHAPES[sampling]
    assert maps.E.dtype == maps.B.dtype == np.float64
    assert_close(maps.E, synthesis(e_lm, sampling).real, ulps(sampling))
    assert_close(maps.B, synthesis(b_lm, sampling).real, ulps(sampling))


def test_e_and_b_are_those_of_healpy():
    """alm2map of (E, B) gives Q and U, and that of E alone and B alone the maps back"""
    hp = pytest.importorskip("healpy")
    rng = np.random.default_rng(0)
    size = hp.Alm.getsize(L - 1)
    alm = rng.standard_normal((2, size)) + 1j * rng.standard_normal((2, size))
    alm[:, :L].imag = 0
    el = hp.Alm.getlm(L - 1)[0]
    alm[:, el < 2] = 0
    _, q, u = hp.alm2map([0 * alm[0], *alm], NSIDE, lmax=L - 1, pol=True)
    maps = pseudo(L, directions=2).separate(q, u)
    for found, one in zip((maps.E, maps.B), alm, strict=True):
        assert_close(found, hp.alm2map(one, NSIDE, lmax=L - 1), ulps("healpix"))


@pytest.mark.parametrize(("dilation", "lowest_scale"), [(2.0, 0), (3.0, 1), (1.5, 3), (2.0, 4)])
def test_full_sky_separation_is_exact_for_every_tiling(dilation, lowest_scale):
    e_lm, b_lm = random_eb()
    separator = pseudo(L, dilation=dilation, lowest_scale=lowest_scale)
    maps = separator.separate(*random_qu("mw"))
    assert maps.info.scales[0] == lowest_scale
    assert_close(maps.E + 1j * maps.B, synthesis(e_lm + 1j * b_lm, "mw"), ulps("mw"))


@pytest.mark.parametrize("bandlimit", [3, 4, 5])
def test_full_sky_separation_is_exact_at_the_smallest_bandlimits(bandlimit):
    """There the default lowest scale is the highest one, and J0 <= J"""
    e_lm, b_lm = simulate_eb(np.ones(5), np.ones(5), bandlimit, seed=1)
    p = SpinHarmonicTransform(bandlimit, 2).synthesis(eb_to_spin(e_lm, b_lm))
    maps = pseudo(bandlimit).separate(p.real, p.imag)
    expected = SpinHarmonicTransform(bandlimit).synthesis(e_lm + 1j * b_lm)
    assert_close(maps.E + 1j * maps.B, expected, ulps("mw"))


@pytest.mark.parametrize("size", [17, 40])
@each_grid
def test_full_sky_separation_is_exact_on_finer_grids(sampling, size):
    """Maps of bandlimit 16 on a grid for more: E and B come back on that grid, one or a stack"""
    e_lm, b_lm = random_eb()
    transform = SpinHarmonicTransform(size, 2, sampling=sampling)
    p = transform.synthesis(resize(eb_to_spin(e_lm, b_lm), size))
    maps = pseudo(L).separate(p.real, p.imag)
    scalar = SpinHarmonicTransform(size, sampling=sampling)
    expected = scalar.synthesis(resize(e_lm + 1j * b_lm, size))
    assert_close(maps.E + 1j * maps.B, expected, ulps("mw"))
    stack = pseudo(L).separate(np.stack([p.real, p.real]), np.stack([p.imag, p.imag]))
    assert_close(stack.B[1], maps.B, ulps=16)


@each_grid
def test_derivatives_are_those_of_q_and_u(sampling):
    """E~ = -Re ethb^2 P, B~ = -Im ethb^2 P"""
    q, u = random_qu(sampling)
    p_lm = SpinHarmonicTransform(L, 2, sampling=sampling).analysis(q + 1j * u)
    lowered = synthesis(lower_spin(lower_spin(p_lm, 2), 1), sampling)
    maps = pseudo(L, output="derivatives").separate(q, u)
    assert_close(maps.E + 1j * maps.B, -lowered, ulps(sampling))


@each_grid
def test_potentials_are_those_q_and_u_are_derivatives_of(sampling):
    """P = -eth^2 (phi_E + i phi_B)"""
    q, u = random_qu(sampling)
    maps = pseudo(L, output="potentials").separate(q, u)
    phi_lm = SpinHarmonicTransform(L, sampling=sampling).analysis(maps.E + 1j * maps.B)
    raised = synthesis(raise_spin(raise_spin(phi_lm, 0), 1), sampling, 2)
    assert_close(-raised, q + 1j * u, ulps(sampling))


def test_one_separator_without_a_mask_takes_every_pixelisation():
    separator = pseudo(L)
    for sampling, shape in SHAPES.items():
        maps = separator.separate(*random_qu(sampling))
        assert maps.E.shape == maps.weight.shape == shape
        assert (maps.info.fit is None) == (sampling != "healpix")
        assert maps.info.sky_fraction == 1


def test_full_sky_is_trusted_everywhere():
    maps = pseudo(L).separate(*random_qu("mw"))
    assert np.all(maps.weight == 1)
    assert list(maps.weights) == [2, 3, 4]
    assert all(np.all(weight == 1) for weight in maps.weights.values())
    assert set(maps.info.kept_fraction.values()) == {1.0}


# Frames, orders, symmetries: they hold on the full and on the masked sky


def full_and_masked(sampling, **choices):
    return [
        pseudo(L, **choices),
        pseudo(L, south(sampling), **choices),
    ]


@each_sampling
@each_directions
def test_turning_the_frame_by_45_degrees_swaps_e_and_b(sampling, directions):
    """Q + iU -> exp(-2 i chi)(Q + iU), chi = 45 degrees: Q -> U, U -> -Q, E -> B, B -> -E"""
    q, u = random_qu(sampling)
    for separator in full_and_masked(sampling, directions=directions):
        before, after = separator.separate(q, u), separator.separate(u, -q)
        turned = dataclasses.replace(before, E=before.B, B=-before.E)
        assert_same_maps(after, turned, ulps(sampling))


@each_sampling
def test_turning_the_frame_by_90_degrees_changes_every_sign(sampling):
    """Q -> -Q, U -> -U: E -> -E, B -> -B"""
    q, u = random_qu(sampling)
    for separator in full_and_masked(sampling):
        before, after = separator.separate(q, u), separator.separate(-q, -u)
        assert_same_maps(after, dataclasses.replace(before, E=-before.E, B=-before.B))


def mirrored(values):
    """f(theta, -phi)"""
    return np.roll(values[:, ::-1], 1, axis=1)


@each_grid
@each_directions
def test_mirror_image_of_the_sky_changes_the_sign_of_b(sampling, directions):
    """Q(phi), U(phi) -> Q(-phi), -U(-phi): E -> E(-phi), B -> -B(-phi)"""
    q, u = random_qu(sampling)
    side = 0.5 + 0.5 * np.cos(np.linspace(0, 2 * np.pi, q.shape[1], endpoint=False) - 1)
    mask = south(sampling) * side
    before = pseudo(L, mask, directions=directions).separate(q, u)
    separator = pseudo(L, mirrored(mask), directions=directions)
    after = separator.separate(mirrored(q), -mirrored(u))
    expected = dataclasses.replace(before, E=mirrored(before.E), B=-mirrored(before.B))
    assert_same_maps(after, expected, 64 * ulps(sampling))
    assert_close(after.weight, mirrored(before.weight), ulps=64 * ulps(sampling))


@each_grid
def test_sign_of_u_is_that_of_b_where_nothing_depends_on_longitude(sampling):
    """U -> -U: E -> E, B -> -B for m = 0; for other orders E and B mix"""
    e_lm, b_lm = random_eb()
    el = np.arange(L)
    zonal = np.zeros(L**2)
    zonal[el * el + el] = 1
    p = synthesis(eb_to_spin(zonal * e_lm, zonal * b_lm), sampling, 2)
    for separator in full_and_masked(sampling):
        before, after = separator.separate(p.real, p.imag), separator.separate(p.real, -p.imag)
        assert_same_maps(after, dataclasses.replace(before, B=-before.B), ulps(sampling))
    q, u = random_qu(sampling)
    before, after = pseudo(L).separate(q, u), pseudo(L).separate(q, -u)
    assert np.abs(after.E - before.E).max() > 0.1 * np.abs(before.E).max()


def test_iau_maps_give_the_same_fields_once_their_frame_is_that_of_healpix():
    q, u = random_qu("healpix")
    iau = convert_polconv(q, u, "COSMO", "IAU")
    expected = pseudo(L).separate(q, u)
    assert_same_maps(pseudo(L).separate(*convert_polconv(*iau, "IAU", "COSMO")), expected)


@pytest.mark.parametrize("masked", [False, True])
def test_nested_maps_give_the_same_maps_in_nested_order(masked):
    q, u = random_qu("healpix")
    mask = south("healpix") if masked else None
    nested_mask = ring_to_nested(mask) if masked else None
    expected = pseudo(L, mask).separate(q, u)
    separator = pseudo(L, nested_mask, nest=True)
    found = separator.separate(ring_to_nested(q), ring_to_nested(u))
    for name in ("E", "B", "weight"):
        assert np.array_equal(getattr(found, name), ring_to_nested(getattr(expected, name)))
    for j, weight in expected.weights.items():
        assert np.array_equal(found.weights[j], ring_to_nested(weight))
    bands, expected_bands = separator.bands(found), pseudo(L, mask).bands(expected)
    for key, band in expected_bands.items():
        assert np.array_equal(bands[key], ring_to_nested(np.array(band)))


@each_sampling
def test_separation_is_linear(sampling):
    """The mask and its weights do not depend on the map"""
    separator = pseudo(L, south(sampling), directions=2)
    (q1, u1), (q2, u2) = random_qu(sampling, 1), random_qu(sampling, 2)
    one, two = separator.separate(q1, u1), separator.separate(q2, u2)
    both = separator.separate(3 * q1 - q2, 3 * u1 - u2)
    expected = dataclasses.replace(one, E=3 * one.E - two.E, B=3 * one.B - two.B)
    assert_same_maps(both, expected, ulps(sampling))


@each_sampling
def test_results_do_not_depend_on_threads(sampling):
    mask = south(sampling)
    one, two = (
        pseudo(L, mask, directions=3, threads=threads).separate(*random_qu(sampling))
        for threads in (1, 2)
    )
    assert_same_maps(one, two)
    assert np.array_equal(one.weight, two.weight)


# The pseudo estimator


@each_grid
@each_directions
def test_coefficients_are_those_of_the_masked_map_times_the_weights(sampling, directions):
    """W^j = M_j <M P, R 2psi^j>, M_j = 1 - t(f_j / f_max)"""
    mask = south(sampling)
    q, u = random_qu(sampling)
    separator = EBSeparator(L, mask, directions=directions, method=Pseudo(0.3))
    transform = SpinWaveletTransform(L, 2, directions, lowest_scale=2, sampling=sampling)
    sky = sky_of(mask, L, name="mask", threads=None)
    shares = energy_shares(transform, lambda size: sky.integrals(1 - mask, size))
    expected = transform.analysis(mask * (q + 1j * u))
    maps = separator.separate(q, u)
    assert maps.coefficients.shapes == transform.shapes
    for key, share in shares.items():
        of = [c.scaling if key == "scaling" else c[key] for c in (maps.coefficients, expected)]
        weights = 1 - taper(share / 0.3)
        assert_close(of[0], weights * of[1], ulps(sampling))
        kept = SpinHarmonicTransform(
            weights.shape[-2] - (sampling == "mwss"), sampling=sampling
        ).analysis(weights.reshape(-1, *weights.shape[-2:]))[:, 0]
        assert_close(maps.info.kept_fraction[key], kept.mean().real / np.sqrt(4 * np.pi), ulps=L**2)


@each_grid
@each_directions
def test_e_and_b_are_scalar_syntheses_of_minus_real_and_imaginary_part(sampling, directions):
    """E = sum_j int drho (-Re W^j) R psi^j with the scalar wavelets of coefficients psi_lm"""
    maps = pseudo(L, south(sampling), directions=directions).separate(*random_qu(sampling))
    scalar = SpinWaveletTransform(
        L, 0, directions, lowest_scale=2, sampling=sampling, real=True, threads=1
    )
    for part, found in ((np.real, maps.E), (np.imag, maps.B)):
        flm = scalar.synthesis_harmonic(maps.coefficients.map(lambda w, part=part: -part(w)))
        flm[:4] = 0  # no wavelet of spin 2 has these degrees
        assert_close(found, synthesis(flm, sampling).real, 4 * ulps(sampling))


@each_sampling
@pytest.mark.parametrize("output", ["fields", "derivatives", "potentials"])
def test_bands_add_up_to_e_and_b(sampling, output):
    separator = pseudo(L, south(sampling), directions=2, output=output)
    maps = separator.separate(*random_qu(sampling))
    bands = separator.bands(maps)
    assert list(bands) == ["scaling", 2, 3, 4]
    total = np.sum(list(bands.values()), axis=0)
    assert_close(total, np.array([maps.E, maps.B]), ulps=64 * L)


def test_band_holds_the_degrees_of_its_scale():
    """Scale j has 2^(j-1) < l < 2^(j+1), the scaling part l < 2^J0"""
    separator = pseudo(L, south("mw"))
    bands = separator.bands(separator.separate(*random_qu("mw")))
    el = np.repeat(np.arange(L), 2 * np.arange(L) + 1)
    for key, (e, b) in bands.items():
        flm = SpinHarmonicTransform(L).analysis(e + 1j * b)
        low, high = (0, 4) if key == "scaling" else (2 ** (key - 1), 2 ** (key + 1))
        outside = (el <= low) | (el >= high)
        assert np.max(np.abs(flm[outside])) < 64 * L * EPS * np.max(np.abs(flm), initial=1)


@each_sampling
@each_directions
def test_weights_are_1_far_from_the_hole_and_0_inside(sampling, directions):
    """f_j = 0 far from the hole and 1 inside it; at most 1 everywhere"""
    q, u = random_qu(sampling)
    mask, theta = south(sampling, edge=0.9), colatitudes(sampling)
    maps = pseudo(L, mask, directions=directions).separate(q, u)
    assert list(maps.weights) == [2, 3, 4]
    for weight in (maps.weight, *maps.weights.values()):
        assert weight.shape == SHAPES[sampling]
        assert weight.min() >= 0
        assert weight.max() <= 1
        assert np.all(weight[mask == 0] == 0)
    # Weights fall steeply, and rings of a few per cent follow the step between their samples.
    for weight in (maps.weight, maps.weights[3], maps.weights[4]):
        assert weight[theta > 2.4].min() > 0.95
        assert weight[theta < 1.0].max() < 0.1


@each_sampling
def test_coarse_scales_lose_more_sky_than_fine_ones(sampling):
    maps = pseudo(L, south(sampling)).separate(*random_qu(sampling))
    kept = maps.info.kept_fraction
    assert kept["scaling"] < kept[2] < kept[3] < maps.info.sky_fraction
    assert maps.weights[2].mean() < maps.weights[3].mean()


def test_larger_share_keeps_more():
    """M_j = 1 - t(f_j / f_max) grows with f_max"""
    kept = [pseudo(L, south("mw"), method=Pseudo(share)) for share in (0.02, 0.1, 0.5, 1.0)]
    fractions = [s.separate(*random_qu("mw")).info.kept_fraction for s in kept]
    for key in ("scaling", 2, 3, 4):
        values = [fraction[key] for fraction in fractions]
        assert values == sorted(values)
    assert fractions[0][3] < 0.8 * fractions[-1][3]


@each_sampling
def test_mask_of_ones_is_the_full_sky(sampling):
    q, u = random_qu(sampling)
    whole = pseudo(L).separate(q, u)
    masked = pseudo(L, np.ones(SHAPES[sampling])).separate(q, u)
    assert_same_maps(masked, whole, ulps(sampling))
    assert_close(masked.weight, whole.weight, ulps(sampling))


def test_almost_empty_mask_keeps_nothing():
    mask = np.zeros(NPIX)
    mask[300] = 0.1
    maps = pseudo(L, mask).separate(*random_qu("healpix"))
    assert max(maps.info.kept_fraction.values()) == 0
    assert not np.any(maps.E)
    assert not np.any(maps.weight)


@each_sampling
@pytest.mark.parametrize("value", [np.nan, np.inf, UNSEEN, 1e300, -1.0])
def test_values_behind_the_mask_do_not_matter(sampling, value):
    """0 * anything is 0, were it NaN"""
    q, u = random_qu(sampling)
    mask = south(sampling)
    separator = pseudo(L, mask)
    expected = separator.separate(q, u)
    q, u = q.copy(), u.copy()
    q[mask == 0] = value
    u[(mask == 0) & (colatitudes(sampling) > 0.3)] = -value
    found = separator.separate(q, u)
    assert_same_maps(found, expected)
    assert np.array_equal(found.weight, expected.weight)


def test_input_arrays_are_not_changed_and_not_kept():
    q, u = random_qu("mw")
    mask = south("mw")
    separator = pseudo(L, mask)
    before = [q.copy(), u.copy(), mask.copy()]
    first = separator.separate(q, u)
    assert all(np.array_equal(*pair) for pair in zip(before, (q, u, mask), strict=True))
    mask[:] = 0
    assert_same_maps(separator.separate(q, u), first)
    with pytest.raises(ValueError, match="read-only"):
        separator.mask[0] = 0


@pytest.mark.parametrize("dtype", [np.float32, np.int64, ">f8", bool])
def test_any_real_dtype_is_taken_at_its_value(dtype):
    q = (10 * random_qu("mw")[0]).astype(dtype)
    mask = (south("mw") > 0.5).astype(dtype)
    expected = pseudo(L, mask.astype(float)).separate(q.astype(float), -q.astype(float))
    zero = np.zeros(q.shape, dtype)
    parts = [pseudo(L, mask).separate(*pair) for pair in ((q, zero), (zero, q))]
    total = dataclasses.replace(expected, E=parts[0].E - parts[1].E, B=parts[0].B - parts[1].B)
    assert_same_maps(total, expected, ulps("mw"))


def test_sky_of_zeros_has_no_e_and_no_b():
    zero = np.zeros(SHAPES["mw"])
    maps = pseudo(L, south("mw")).separate(zero, zero)
    assert not np.any(maps.E)
    assert not np.any(maps.B)


def test_report_says_what_was_done():
    mask = south("healpix")
    info = pseudo(L, mask, directions=3).separate(*random_qu("healpix")).info
    assert (info.method, info.bandlimit, info.scales) == ("pseudo", L, (2, 3, 4))
    assert info.sky_fraction == mask.mean()
    assert info.fit.residual < 1e-10
    assert all(seconds >= 0 for seconds in info.seconds.values())
    assert list(info.seconds) == [
        "mask preparation",
        "estimation",
        "synthesis",
        "weight maps",
    ]


@pytest.mark.parametrize(("sampling", "bandlimit"), [("mw", 16), ("mwss", 16), ("healpix", 17)])
def test_bandlimit_is_the_masks_when_none_is_given(sampling, bandlimit):
    """L of the grid, 2 nside + 1 on HEALPix"""
    separator = pseudo(mask=np.ones(SHAPES[sampling]))
    assert separator.bandlimit == bandlimit
    assert separator.separate(*random_qu(sampling)).info.bandlimit == bandlimit


# What is refused


def spoilt(value, at=500):
    q, _ = random_qu("healpix")
    q[at] = value
    return q


HALF = south("healpix", edge=1.0)  # pixel 500 is observed
GRID = np.ones(SHAPES["mw"])


@pytest.mark.parametrize(
    ("choices", "error", "message"),
    [
        ({}, ParameterError, r"bandlimit=None needs a mask .* give one of the two\."),
        ({"bandlimit": 2.5}, ParameterError, "bandlimit=2.5 must be an? .*integer"),
        ({"bandlimit": 0}, ParameterError, "bandlimit=0 must be an? .*integer"),
        ({"bandlimit": 0, "mask": HALF}, ParameterError, "bandlimit=0 must be an? .*integer"),
        ({"bandlimit": 2}, ParameterError, "spin=2 must be smaller in size than bandlimit=2"),
        ({"bandlimit": 18, "mask": GRID}, ParameterError, "mask has the shape .* of bandlimit 16"),
        ({"mask": np.ones(767)}, ShapeError, "last axis has 767 pixels but must have 12 nside"),
        ({"mask": np.ones((4, 5))}, ShapeError, "mask has shape .*; it must be a HEALPix map"),
        ({"mask": HALF + 1}, DataError, r"mask has \d+ values outside \[0, 1\]"),
        ({"mask": HALF - 1}, DataError, r"mask has \d+ values outside \[0, 1\]"),
        ({"mask": np.full(NPIX, np.nan)}, DataError, r"mask has 768 values outside \[0, 1\]"),
        ({"mask": np.zeros(NPIX)}, DataError, "mask is zero at all 768 pixels"),
        ({"mask": HALF + 0j}, DataError, "mask has dtype complex128 but must be bool or real"),
        ({"bandlimit": L, "method": "magic"}, ParameterError, "method='magic' is not known"),
        ({"bandlimit": L, "output": "both"}, ParameterError, "output='both' is not known"),
        ({"bandlimit": L, "directions": 17}, ParameterError, "directions=17 must not exceed"),
        ({"bandlimit": L, "directions": 0}, ParameterError, "directions=0 must be .*at least 1"),
        ({"bandlimit": L, "dilation": 1.0}, ParameterError, "dilation=1.0 must exceed 1"),
        ({"bandlimit": L, "lowest_scale": 9}, ParameterError, "lowest_scale=9 must"),
        ({"bandlimit": L, "threads": 0}, ParameterError, "threads=0 must"),
    ],
)
def test_separator_that_cannot_be_is_refused(choices, error, message):
    with pytest.raises(error, match=message):
        EBSeparator(**choices)


@pytest.mark.parametrize(
    ("q", "error", "message"),
    [
        (np.zeros(767), ShapeError, r"q has shape \(767,\) and u \(768,\)"),
        (np.zeros(NPIX, complex), DataError, "q has dtype complex128 but must be real"),
        (np.full(NPIX, "1"), DataError, "q has dtype <U1 but must be real"),
        (spoilt(np.nan), DataError, "1 observed pixels of q or u are NaN or infinite"),
        (spoilt(-np.inf), DataError, "1 observed pixels of q or u are NaN or infinite"),
        (spoilt(UNSEEN), DataError, "not observed at 1 pixels where the mask is not 0; set the"),
        (spoilt(np.float32(UNSEEN)), DataError, "not observed at 1 pixels where the mask is not"),
    ],
)
@pytest.mark.parametrize("nest", [False, True])
def test_map_that_cannot_be_separated_is_refused(q, error, message, nest):
    u = random_qu("healpix")[1]
    for separator in (pseudo(L, nest=nest), pseudo(L, np.ones(NPIX), nest=nest)):
        for pair in ((q, u), (u, q)):
            with pytest.raises(error):
                separator.separate(*pair)
        with pytest.raises(error, match=message):
            separator.separate(q, u)


@pytest.mark.parametrize("shape", [(192,), (16, 31), (NPIX, 2), ()])
def test_map_of_another_shape_than_the_mask_is_refused(shape):
    separator = pseudo(L, HALF)
    with pytest.raises(ShapeError, match=r"shape \(.*\) but must have \(.*\)|must be alike"):
        separator.separate(np.zeros(shape), np.zeros(shape))


@pytest.mark.parametrize(
    ("shape", "error", "message"),
    [
        ((15, 29), ParameterError, "q has the shape .* of bandlimit 15, below bandlimit=16"),
        ((16, 30, 1), ShapeError, r"q has shape \(30, 1\); it must be a HEALPix map"),
        ((767,), ShapeError, "last axis has 767 pixels but must have 12 nside"),
        ((12 * 4**2,), ParameterError, "bandlimit=16 must not exceed 3 nside = 12"),
    ],
)
def test_map_that_does_not_fit_the_bandlimit_is_refused(shape, error, message):
    with pytest.raises(error, match=message):
        pseudo(L).separate(np.zeros(shape), np.zeros(shape))


def test_bands_of_another_separators_maps_are_refused():
    separator, q = pseudo(L, south("mw")), np.zeros(SHAPES["mwss"])
    with pytest.raises(ShapeError, match=r"q has shape \(17, 32\) but the mask \(16, 31\)"):
        separator.bands(pseudo(L).separate(q, q))
    other = pseudo(L, south("mw"), lowest_scale=3).separate(*random_qu("mw"))
    with pytest.raises(ShapeError, match=r"coefficients have scales \(3, 4\)"):
        separator.bands(other)


# Leakage


@needs_compiler
def test_less_e_leaks_into_b_than_through_a_transform_of_the_masked_map():
    """rms of B over R, 3 degrees and more inside a galactic cut, of a sky that has E only"""
    hp = pytest.importorskip("healpy")
    nside, bandlimit = 32, 65
    mask = galactic_cut(nside, np.radians(20))
    inside = distance_to_edge(mask) > np.radians(3)
    separator, whole = (
        pseudo(bandlimit, mask, directions=3, method=Pseudo(0.05)),
        pseudo(bandlimit),
    )
    spectrum, beam = planck2018_spectra()["EE_unlensed"], np.radians(4)
    for seed in (1, 2):
        e_lm, b_lm = simulate_eb(spectrum, 0 * spectrum, bandlimit, seed=seed, beam_fwhm=beam)
        q, u = simulate_qu(e_lm, b_lm, nside)
        alm = hp.map2alm([0 * q, mask * q, mask * u], lmax=bandlimit - 1, pol=True, iter=3)
        plain = hp.alm2map(alm[2], nside, lmax=bandlimit - 1)
        maps = separator.separate(q, u)
        # 14 times less was seen, and with less of E below l = 16 or so. At l = 32 E is still E.
        assert np.std(maps.B[inside]) < np.std(plain[inside]) / 10
        e, truth = (s.bands(s.separate(q, u))[5][0][inside] for s in (separator, whole))
        assert np.corrcoef(e, truth)[0, 1] > 0.9


def test_separator_keeps_the_mask_as_it_was_given():
    """A nested mask stays nested: a changed copy of the separator means the same sky."""
    mask = ring_to_nested(south("healpix"))
    separator = pseudo(L, mask, nest=True)
    np.testing.assert_array_equal(separator.mask, mask)
    q, u = random_qu("healpix")
    again = dataclasses.replace(separator, directions=1)
    assert_same_maps(again.separate(q, u), separator.separate(q, u), 0)


@each_sampling
def test_stack_is_separated_map_by_map(sampling):
    """Leading axes of Q and U are a batch, in E, B and the coefficients"""
    pairs = [random_qu(sampling, seed) for seed in range(4)]
    q, u = (np.array(maps).reshape(2, 2, *SHAPES[sampling]) for maps in zip(*pairs, strict=True))
    for separator in (pseudo(L), pseudo(L, south(sampling))):
        maps = separator.separate(q, u)
        bands = separator.bands(maps)
        assert maps.E.shape == maps.B.shape == bands[2][0].shape == q.shape
        assert maps.coefficients[3].shape[:2] == (2, 2)
        assert maps.weight.shape == SHAPES[sampling]
        for place in np.ndindex(2, 2):
            alone = separator.separate(q[place], u[place])
            assert_close(maps.E[place], alone.E, ulps(sampling))
            assert_close(maps.B[place], alone.B, ulps(sampling))
            assert_close(bands[3][1][place], separator.bands(alone)[3][1], ulps(sampling))


def test_several_masks_are_multiplied():
    north, cut = 1 - south("healpix"), galactic_cut(NSIDE, np.radians(20))
    separator = pseudo(L, [north, cut])
    np.testing.assert_array_equal(separator.mask, north * cut)
    with pytest.raises(ShapeError, match=r"mask holds masks of shapes \(768,\) and \(16, 31\)"):
        pseudo(L, [north, south("mw")])


@pytest.mark.parametrize(
    ("choices", "error", "message"),
    [
        ({"inverse_noise": np.ones(192)}, ShapeError, "inverse_noise has shape .*192.* the mask"),
        ({"inverse_noise": -HALF}, DataError, r"inverse_noise holds \d+ values that are negative"),
        ({"inverse_noise": 0 * HALF}, DataError, "inverse_noise holds only zeros; give 1 / sigma"),
        ({"beam": -1.0}, ParameterError, "fwhm=-1.0 must be finite and at least 0"),
        ({"beam": np.ones(15)}, ShapeError, "beam has shape .*; it must hold b_l for l = 0 to 15"),
        ({"beam": -np.ones(16)}, DataError, "beam holds values that are negative or not finite"),
    ],
)
def test_noise_and_beam_are_checked(choices, error, message):
    with pytest.raises(error, match=message):
        pseudo(L, HALF, **choices)


@pytest.mark.parametrize("where", ["q", "u", "mask"])
def test_masked_entries_are_refused(where):
    """The mask of a numpy masked array is not the mask of the sky, and must not be lost."""
    arrays = dict(zip("qu", random_qu("healpix"), strict=True)) | {"mask": south("healpix")}
    arrays[where] = np.ma.masked_less(arrays[where], 0.1)
    with pytest.raises(DataError, match=f"{where} has masked entries"):
        pseudo(L, arrays["mask"]).separate(arrays["q"], arrays["u"])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"nest": "no"}, "nest='no' must be True or False"),
        ({"method": 3}, "method=3 must be a name among .*'pseudo'"),
        ({"method": np.array(["pseudo", "pure"])}, "method=array.* must be a name among"),
    ],
)
def test_parameter_of_another_type_is_refused(options, told):
    with pytest.raises(ParameterError, match=told):
        EBSeparator(L, **options)


@pytest.mark.parametrize("share", [0, -0.1, 1.1, np.nan, "a"])
def test_largest_share_must_be_a_share(share):
    with pytest.raises(ParameterError, match=rf"largest_share={share!r} must be .* in \(0, 1\]"):
        Pseudo(share)


def test_nested_mask_needs_a_power_of_two():
    with pytest.raises(ParameterError, match="nside=3"):
        pseudo(7, np.ones(12 * 3**2), nest=True)


def test_default_is_the_hybrid_method():
    assert EBSeparator(L).method.name == "hybrid"


@pytest.mark.parametrize("method", ["pseudo", "projection", Hybrid(draws=2, max_iterations=8)])
def test_prepared_separator_can_be_sent_elsewhere(method):
    """What was prepared travels with the separator; its results are the same"""
    separator = EBSeparator(17, galactic_cut(8, 0.3), method=method).prepare()
    sent = pickle.loads(pickle.dumps(separator))
    (prepared,) = sent._estimators.values()
    assert {"kept_fraction", "weight_maps"} <= set(vars(prepared))
    if isinstance(method, Hybrid):
        assert "regimes" in vars(prepared.estimator)
    q, u = random_qu("healpix")
    assert_same_maps(sent.separate(q, u), separator.separate(q, u))
    with pytest.raises(ParameterError, match="mask=None leaves nothing to prepare"):
        EBSeparator(L).prepare()
