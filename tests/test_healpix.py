"""HEALPix layout, bad-pixel policy, and the least-squares way from maps to coefficients."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinsdw.errors import (
    ConvergenceWarning,
    DataError,
    ParameterError,
    PrecisionWarning,
    ShapeError,
)
from spinsdw.harmonics import conjugate_field, degrees, eb_to_spin, spin_to_eb
from spinsdw.healpix import (
    UNSEEN,
    HealpixFit,
    alm_to_flm,
    bad_pixel_mask,
    check_mask,
    check_nside,
    clean_polarisation,
    convert_polconv,
    default_bandlimit,
    degrade_map,
    eb_alm_to_spin_flm,
    flm_to_alm,
    flm_to_map,
    healpix_to_mw,
    map_to_flm,
    mw_to_healpix,
    nested_to_ring,
    nside_of,
    pixel_directions,
    qu_to_eb_flm,
    ring_to_nested,
    spin_flm_to_eb_alm,
    upgrade_map,
)
from spinsdw.masks import galactic_cut
from spinsdw.sampling import SAMPLINGS
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import EPS, assert_close, random_flm

hp = pytest.importorskip("healpy")


def real_flm(bandlimit, *, seed=0, lowest=0):
    """Coefficients of a random real field, zero below degree ``lowest``."""
    flm = random_flm(bandlimit, lowest, seed=seed)
    return (flm + conjugate_field(flm)) / 2


def random_alm(bandlimit, *, seed=0):
    """Coefficients in healpy's layout, real at m = 0."""
    rng = np.random.default_rng(seed)
    size = bandlimit * (bandlimit + 1) // 2
    alm = rng.standard_normal(size) + 1j * rng.standard_normal(size)
    alm[:bandlimit] = alm[:bandlimit].real
    return alm


def mirrored(values, nside):
    """The values of a map at (theta, -phi), pixel by pixel."""
    pixels = np.arange(12 * nside**2)
    colatitudes, longitudes = hp.pix2ang(nside, pixels)
    return values[hp.ang2pix(nside, colatitudes, -longitudes)]


# ------------------------------------------------------------ pixels


@pytest.mark.parametrize("nside", [1, 2, 3, 16, 37])
def test_number_of_pixels_gives_nside(nside):
    """npix = 12 nside^2"""
    assert nside_of(np.zeros(12 * nside**2)) == nside
    assert nside_of(np.zeros((2, 12 * nside**2))) == nside


@pytest.mark.parametrize("shape", [(), (0,), (11,), (13,), (48, 5)])
def test_other_numbers_of_pixels_are_refused(shape):
    with pytest.raises(ShapeError, match=r"must have 12 nside\*\*2"):
        nside_of(np.zeros(shape))


@pytest.mark.parametrize("nside", [0, -4, 2.0, "8", True, 2**29 + 1])
def test_nside_is_a_positive_integer_up_to_its_limit(nside):
    with pytest.raises(ParameterError, match="nside="):
        check_nside(nside)


def test_nested_order_needs_a_power_of_two():
    with pytest.raises(ParameterError, match="nside=3 must be a power of two for NESTED"):
        nested_to_ring(np.zeros(108))


@pytest.mark.parametrize("nside", [1, 3, 8, 32])
def test_pixel_directions_are_healpy_s(nside):
    colatitudes, longitudes = pixel_directions(nside)
    expected = hp.pix2ang(nside, np.arange(12 * nside**2))
    assert_close(colatitudes, expected[0], ulps=16)
    assert_close(longitudes, expected[1], ulps=16)


@pytest.mark.parametrize("dtype", [np.float32, np.int64, np.complex128, ">f8"])
def test_nested_round_trip_keeps_values_and_dtype(dtype):
    """nested_to_ring(ring_to_nested(d)) = d = ring_to_nested(nested_to_ring(d))"""
    maps = np.arange(2 * 192).reshape(2, 192).astype(dtype)
    for there, back in ((nested_to_ring, ring_to_nested), (ring_to_nested, nested_to_ring)):
        result = back(there(maps))
        assert np.array_equal(result, maps)
        assert result.dtype == maps.dtype


def test_nested_order_is_healpy_s():
    maps = np.random.default_rng(0).standard_normal(768)
    assert np.array_equal(nested_to_ring(maps), hp.reorder(maps, n2r=True))
    assert np.array_equal(ring_to_nested(maps), hp.reorder(maps, r2n=True))


def test_degrading_averages_as_healpy_does_and_undoes_upgrading():
    maps = np.random.default_rng(0).standard_normal((2, 768))
    assert_close(degrade_map(maps, 2), hp.ud_grade(maps, 2), ulps=16)
    assert_close(degrade_map(upgrade_map(maps, 32), 8), maps, ulps=4)


def test_resolution_changes_only_in_the_direction_named():
    maps = np.zeros(192)
    with pytest.raises(ParameterError, match="nside=8 must not exceed the map's nside=4"):
        degrade_map(maps, 8)
    with pytest.raises(ParameterError, match="nside=2 must reach the map's nside=4"):
        upgrade_map(maps, 2)


# ------------------------------------------------------------ values


@pytest.mark.parametrize(
    ("value", "is_bad"),
    [
        (0.0, False),
        (-1e30, False),
        (UNSEEN, True),
        (np.float32(UNSEEN), True),
        (UNSEEN * (1 + 9e-6), True),
        (UNSEEN * (1 + 2e-5), False),
        (-UNSEEN, False),
        (np.nan, True),
        (np.inf, True),
        (-np.inf, True),
        (-32768.0, True),
        (1j * UNSEEN, True),
    ],
)
def test_bad_is_what_no_measurement_can_be(value, is_bad):
    assert bad_pixel_mask([value], sentinel=-32768.0)[0] == is_bad


def test_bad_pixels_agree_with_healpy_where_finite():
    values = UNSEEN * (1 + np.array([0, 1e-7, 3e-7, 5e-6, 2e-5, 1e-3]))
    assert np.array_equal(bad_pixel_mask(values), hp.mask_bad(values))


@pytest.mark.parametrize("bad", [UNSEEN, -99.0])
@pytest.mark.parametrize("policy", ["raise", "mask"])
def test_unseen_pixels_of_q_or_u_are_masked_in_both(bad, policy):
    q, u = np.array([1.0, bad, 3.0, 4.0]), np.array([5.0, 6.0, bad, 8.0])
    result = clean_polarisation(q, u, [1, 1, 1, 0.5], bad_pixels=policy, sentinel=-99.0)
    np.testing.assert_array_equal(result, [[1, 0, 0, 4], [5, 0, 0, 8], [1, 0, 0, 0.5]])


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_non_finite_pixels_raise_or_are_masked_as_asked(bad):
    q, u = np.array([1.0, bad, 3.0]), np.array([4.0, 5.0, bad])
    with pytest.raises(DataError, match=r"^2 observed pixels of q or u are NaN or infinite"):
        clean_polarisation(q, u)
    result = clean_polarisation(q, u, bad_pixels="mask")
    np.testing.assert_array_equal(result, [[1, 0, 0], [4, 0, 0], [1, 0, 0]])


def test_non_finite_pixels_under_the_mask_do_no_harm():
    result = clean_polarisation([1.0, np.nan], [2.0, 2.0], [True, False])
    np.testing.assert_array_equal(result, [[1, 0], [2, 0], [1, 0]])


def test_cleaning_leaves_the_input_alone():
    q, mask = np.array([1.0, UNSEEN]), np.array([1.0, 1.0])
    clean_polarisation(q, q, mask)
    assert q[1] == UNSEEN
    assert mask[1] == 1


def test_cleaning_accepts_foreign_byte_order_and_single_precision():
    q, u, mask = clean_polarisation(np.array([1.0, UNSEEN], ">f4"), np.array([2, 3], ">i2"))
    assert {q.dtype, u.dtype, mask.dtype} == {np.dtype(np.float64)}
    np.testing.assert_array_equal([q, u, mask], [[1, 0], [2, 0], [1, 0]])


@pytest.mark.parametrize(
    ("mask", "error", "message"),
    [
        ([1, 1, 1], ShapeError, r"mask has shape \(3,\) but must have \(2,\)"),
        ([1, 1.5], DataError, r"mask has 1 values outside \[0, 1\]"),
        ([-0.1, 2], DataError, r"mask has 2 values outside \[0, 1\]"),
        ([np.nan, 1], DataError, r"mask has 1 values outside \[0, 1\]"),
        ([0, 0], DataError, "mask is zero at all 2 pixels"),
        ([1j, 1], DataError, "mask has dtype complex128"),
        (["1", "0"], DataError, "mask has dtype <U1"),
    ],
)
def test_a_mask_is_one_weight_per_pixel_in_the_unit_interval(mask, error, message):
    with pytest.raises(error, match=message):
        check_mask(mask, (2,))
    with pytest.raises(error, match=message):
        clean_polarisation([1, 2], [3, 4], mask)


def test_cleaning_refuses_what_is_not_two_real_maps_alike():
    with pytest.raises(ShapeError, match=r"q has shape \(2,\) and u \(3,\)"):
        clean_polarisation([1, 2], [1, 2, 3])
    with pytest.raises(DataError, match="q has dtype complex128 but must be real"):
        clean_polarisation([1j], [1])
    with pytest.raises(ParameterError, match="bad_pixels='drop' must be 'raise' or 'mask'"):
        clean_polarisation([1], [1], bad_pixels="drop")
    with pytest.raises(DataError, match="mask is zero at all 1 pixels"):
        clean_polarisation([UNSEEN], [1])


@pytest.mark.parametrize(("source", "target"), [("IAU", "COSMO"), ("cosmo", "iau")])
def test_changing_the_frame_turns_u_only_and_undoes_itself(source, target):
    """(Q, U) -> (Q, -U)"""
    q, u = np.array([1.0, 2.0]), np.array([3.0, UNSEEN])
    turned = convert_polconv(q, u, source, target)
    np.testing.assert_array_equal(turned, [[1, 2], [-3, UNSEEN]])
    np.testing.assert_array_equal(convert_polconv(*turned, target, source), [q, u])


def test_the_same_frame_changes_nothing():
    np.testing.assert_array_equal(convert_polconv([1.0], [2.0], "IAU", "IAU"), [[1], [2]])


def test_unknown_frames_are_refused():
    with pytest.raises(ParameterError, match="convention 'TREECORR' must be COSMO or IAU"):
        convert_polconv([1.0], [2.0], "treecorr", "COSMO")


def test_the_other_frame_of_a_mirrored_sky_has_the_same_e_and_the_opposite_b():
    """(Q, -U)(theta, -phi): E(theta, -phi), -B(theta, -phi)"""
    nside, bandlimit = 8, 12
    e_flm, b_flm = real_flm(bandlimit, seed=1, lowest=2), real_flm(bandlimit, seed=2, lowest=2)
    maps = flm_to_map(eb_to_spin(e_flm, b_flm), nside, 2)
    q, u = convert_polconv(maps.real, maps.imag, "COSMO", "IAU")
    mirror_e, mirror_b, _ = qu_to_eb_flm(mirrored(q, nside), mirrored(u, nside), bandlimit)
    e_map, b_map = (flm_to_map(flm, nside, real=True) for flm in (e_flm, b_flm))
    mirror_maps = [mirrored(flm_to_map(flm, nside), nside) for flm in (mirror_e, mirror_b)]
    assert_close(mirror_maps[0], e_map, ulps=1e-9 / EPS)
    assert_close(mirror_maps[1], -b_map, ulps=1e-9 / EPS)


# ------------------------------------------------------------ healpy's coefficients


@given(st.integers(1, 40), st.data())
def test_each_healpy_coefficient_lands_on_its_degree_and_order(bandlimit, data):
    """f[l^2 + l + m] = a[Alm.getidx(l, m)] and f[l^2 + l - m] = (-1)^m conj(a), m >= 0"""
    alm = random_alm(bandlimit, seed=bandlimit)
    flm = alm_to_flm(alm, bandlimit)
    el = data.draw(st.integers(0, bandlimit - 1))
    m = data.draw(st.integers(0, el))
    expected = alm[hp.Alm.getidx(bandlimit - 1, el, m)]
    assert flm[el * el + el + m] == expected
    assert flm[el * el + el - m] == (-1) ** m * np.conj(expected)


def test_folding_undoes_unfolding_in_any_batch():
    alm = np.stack([random_alm(9, seed=i) for i in range(6)]).reshape(2, 3, 45)
    assert np.array_equal(flm_to_alm(alm_to_flm(alm, 9)), alm)


@pytest.mark.parametrize("wrong", [8, 10])
def test_lmax_in_place_of_the_bandlimit_is_refused(wrong):
    with pytest.raises(ShapeError, match=rf"bandlimit={wrong} \(lmax={wrong - 1}\) needs"):
        alm_to_flm(random_alm(9), wrong)


def test_folding_refuses_a_complex_field():
    with pytest.raises(DataError, match="would lose half"):
        flm_to_alm(random_flm(4))


def test_spin_zero_maps_are_healpy_s():
    """d = + sum a_lm Y_lm"""
    nside, bandlimit = 8, 17
    alm = random_alm(bandlimit)
    expected = hp.alm2map(alm, nside, lmax=bandlimit - 1)
    maps = flm_to_map(alm_to_flm(alm, bandlimit), nside, real=True)
    assert maps.dtype == np.float64
    assert_close(maps, expected, ulps=64 * bandlimit)


@pytest.mark.parametrize("spin", [1, 2, 3])
def test_spin_maps_have_healpy_s_sign(spin):
    """Q + iU = - sum (E_lm + i B_lm) sY_lm"""
    nside, bandlimit = 8, 17
    alm_e, alm_b = random_alm(bandlimit, seed=1), random_alm(bandlimit, seed=2)
    q, u = hp.alm2map_spin([alm_e, alm_b], nside, spin, bandlimit - 1)
    maps = flm_to_map(eb_alm_to_spin_flm(alm_e, alm_b), nside, spin)
    assert_close(maps, q + 1j * u, ulps=64 * bandlimit)


def test_polarisation_maps_have_healpy_s_sign():
    """alm2map(pol=True) and alm2map_spin(spin=2) agree"""
    nside, bandlimit = 8, 17
    alms = [random_alm(bandlimit, seed=i) for i in range(3)]
    _, q, u = hp.alm2map(alms, nside, lmax=bandlimit - 1, pol=True)
    maps = flm_to_map(eb_alm_to_spin_flm(*alms[1:]), nside, 2)
    assert_close(maps, q + 1j * u, ulps=64 * bandlimit)


def test_splitting_undoes_joining_e_and_b():
    alm_e, alm_b = random_alm(9, seed=1), random_alm(9, seed=2)
    again = spin_flm_to_eb_alm(eb_alm_to_spin_flm(alm_e, alm_b))
    assert_close(np.array(again), np.array([alm_e, alm_b]), ulps=4)


def test_joining_refuses_sizes_that_differ_or_fit_no_bandlimit():
    with pytest.raises(ShapeError, match=r"alm_e has shape \(3,\) and alm_b \(6,\)"):
        eb_alm_to_spin_flm(np.zeros(3), np.zeros(6))
    with pytest.raises(ShapeError, match="alm_e holds 7 coefficients, which fit no bandlimit"):
        eb_alm_to_spin_flm(np.zeros(7), np.zeros(7))


# ------------------------------------------------------------ fits


@pytest.mark.parametrize("spin", [0, 1, 2, 3, -2])
@pytest.mark.parametrize("nside", [6, 8])
def test_fit_recovers_band_limited_complex_maps(nside, spin):
    """argmin |d - Y f| = f for d = Y f, below 2 nside, in few steps"""
    bandlimit = default_bandlimit(nside)
    flm = random_flm(bandlimit, spin, seed=3)
    fitted, fit = map_to_flm(flm_to_map(flm, nside, spin), bandlimit, spin)
    assert_close(fitted, flm, ulps=1e-9 / EPS)
    assert fit.residual <= 1e-10
    assert fit.map_residual <= 1e-9
    assert 1 <= fit.iterations <= 12


def test_fit_of_a_real_map_is_a_real_field():
    """f_l,-m = (-1)^m conj(f_lm), exactly"""
    flm = real_flm(17, seed=4)
    fitted, _ = map_to_flm(flm_to_map(flm, 8, real=True), 17)
    assert np.array_equal(conjugate_field(fitted), fitted)
    assert_close(fitted, flm, ulps=1e-9 / EPS)


@pytest.mark.parametrize("spin", [0, 2])
def test_fit_is_the_least_squares_solution(spin):
    """f = pinv(Y) d for d that is not band-limited, columns of Y one by one"""
    nside, bandlimit = 2, 5
    basis = np.stack([flm_to_map(unit, nside, spin) for unit in np.eye(bandlimit**2)], axis=1)
    rng = np.random.default_rng(5)
    maps = rng.standard_normal(48) + 1j * rng.standard_normal(48)
    desired = np.linalg.lstsq(basis, maps, rcond=None)[0]
    fitted, fit = map_to_flm(maps, bandlimit, spin, tolerance=1e-12)
    assert_close(fitted, desired, ulps=1e-10 / EPS)
    left = np.linalg.norm(maps - basis @ desired) / np.linalg.norm(maps)
    assert_close(fit.map_residual, left, ulps=1e-10 / EPS)


def test_fit_weighs_pixels_by_the_mask():
    """argmin sum_p w_p |d_p - (Y f)_p|^2, an over-determined apodised case"""
    nside, bandlimit = 4, 4
    basis = np.stack([flm_to_map(unit, nside, 2) for unit in np.eye(bandlimit**2)], axis=1)[:, 4:]
    rng = np.random.default_rng(6)
    maps = rng.standard_normal(192) + 1j * rng.standard_normal(192)
    mask = np.where(np.arange(192) < 150, rng.uniform(0.2, 1, 192), 0)
    root = np.sqrt(mask)
    desired = np.linalg.lstsq(root[:, None] * basis, root * maps, rcond=None)[0]
    fitted, _ = map_to_flm(maps, bandlimit, 2, mask=mask, tolerance=1e-13)
    assert_close(fitted[4:], desired, ulps=1e-9 / EPS)


def test_noise_stays_in_the_map_residual():
    """|d - Y f|^2 / |d|^2 = 1 - (L^2 - 4) / npix for white noise"""
    nside, bandlimit = 16, 17
    rng = np.random.default_rng(7)
    maps = rng.standard_normal((2, 12 * nside**2))
    _, fit = map_to_flm(maps[0] + 1j * maps[1], bandlimit, 2)
    expected = 1 - (bandlimit**2 - 4) / (12 * nside**2)
    assert abs(fit.map_residual**2 - expected) < 0.02


def test_masked_fit_reports_its_residuals_and_warns_when_stopped():
    """A cut of 20 degrees leaves modes unseen: the tolerance is out of reach."""
    nside, bandlimit = 8, 17
    flm = random_flm(bandlimit, 2, seed=8)
    mask = galactic_cut(nside, np.radians(20))
    maps = flm_to_map(flm, nside, 2)
    with pytest.warns(ConvergenceWarning, match=r"max_iterations=20 .* tolerance=1.0e-10"):
        fitted, fit = map_to_flm(maps, bandlimit, 2, mask=mask, max_iterations=20)
    assert fit.iterations == 20
    assert fit.residual > 1e-10
    left = mask * (maps - flm_to_map(fitted, nside, 2))
    relative = np.linalg.norm(left) / np.linalg.norm(mask * maps)
    assert_close(fit.map_residual, relative, ulps=1e4)
    assert 0 < fit.map_residual < 0.1
    assert np.linalg.norm(fitted) < np.linalg.norm(flm)


def test_more_steps_never_fit_the_map_worse():
    """The map residual of CGLS falls monotonically."""
    maps = flm_to_map(random_flm(17, 2, seed=9), 8, 2)
    mask = galactic_cut(8, np.radians(30))
    residuals = []
    for steps in (1, 2, 4, 8, 16):
        with pytest.warns(ConvergenceWarning):
            _, fit = map_to_flm(maps, 17, 2, mask=mask, max_iterations=steps)
        residuals.append(fit.map_residual)
    assert residuals == sorted(residuals, reverse=True)


def test_masked_pixels_may_hold_anything():
    maps = flm_to_map(random_flm(9, 2, seed=10), 8, 2)
    mask = galactic_cut(8, np.radians(10))
    spoilt = np.where(mask > 0, maps, np.nan)
    expected, _ = map_to_flm(maps, 9, 2, mask=mask, tolerance=1e-3)
    fitted, _ = map_to_flm(spoilt, 9, 2, mask=mask, tolerance=1e-3)
    assert np.array_equal(fitted, expected)


def test_each_map_of_a_stack_is_fitted_as_if_alone():
    stack = np.stack([flm_to_map(random_flm(13, 2, seed=i), 8, 2) for i in range(2)])
    stack[1] += np.random.default_rng(11).standard_normal(768)
    together, fit = map_to_flm(stack[None], 13, 2)
    alone = [map_to_flm(maps, 13, 2) for maps in stack]
    # Transforms of several maps round in another order; the fit is well conditioned.
    assert_close(together[0], np.stack([flm for flm, _ in alone]), ulps=1024)
    assert fit.iterations == max(one.iterations for _, one in alone)
    assert_close(fit.map_residual, max(one.map_residual for _, one in alone), ulps=1024)


def test_zero_maps_have_zero_coefficients_without_a_step():
    flm, fit = map_to_flm(np.zeros(192), 9)
    assert not flm.any()
    assert fit == HealpixFit(0, 0.0, 0.0)


def test_nested_maps_give_the_same_coefficients_and_back():
    flm = random_flm(9, 2, seed=12)
    mask = galactic_cut(8, np.radians(5))
    ring = flm_to_map(flm, 8, 2)
    nested = flm_to_map(flm, 8, 2, nest=True)
    assert np.array_equal(nested_to_ring(nested), ring)
    expected, _ = map_to_flm(ring, 9, 2, mask=mask, tolerance=1e-3)
    options = {"mask": ring_to_nested(mask), "nest": True, "tolerance": 1e-3}
    assert np.array_equal(map_to_flm(nested, 9, 2, **options)[0], expected)


def test_result_does_not_depend_on_the_threads():
    maps = flm_to_map(random_flm(17, 2, seed=13), 8, 2, threads=1)
    results = [map_to_flm(maps, 17, 2, threads=threads)[0] for threads in (1, 2)]
    assert np.array_equal(*results)


@pytest.mark.parametrize("nside", [8, 16])
def test_bandlimit_is_warned_about_and_then_refused(nside):
    maps = np.zeros(12 * nside**2)
    map_to_flm(maps, int(2.5 * nside) + 1)
    with pytest.warns(PrecisionWarning, match=r"is above 2\.5 nside \+ 1"):
        map_to_flm(maps, 3 * nside)
    with pytest.raises(ParameterError, match="must not exceed 3 nside"):
        map_to_flm(maps, 3 * nside + 1)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"bandlimit": 0}, ParameterError, "bandlimit=0 must be an integer of at least 1"),
        ({"bandlimit": 9.0}, ParameterError, "bandlimit=9.0 must be an integer"),
        ({"tolerance": 0}, ParameterError, "tolerance=0 must be between 0 and 1"),
        ({"tolerance": np.nan}, ParameterError, "tolerance=nan must be between 0 and 1"),
        ({"max_iterations": 0}, ParameterError, "max_iterations=0 must be an integer of at least"),
        ({"mask": np.ones(48)}, ShapeError, r"mask has shape \(48,\) but must have \(192,\)"),
        ({"spin": 2}, DataError, "maps of spin=2 have dtype float64 but must be complex"),
    ],
)
def test_fit_says_what_is_wrong_with_its_parameters(arguments, error, message):
    with pytest.raises(error, match=message):
        map_to_flm(np.ones(192), **{"bandlimit": 9, **arguments})


@pytest.mark.parametrize("bad", [np.nan, np.inf, UNSEEN])
def test_fit_refuses_bad_observed_pixels(bad):
    maps = np.ones(192)
    maps[:3] = bad
    with pytest.raises(DataError, match="maps hold 3 bad values at observed pixels"):
        map_to_flm(maps, 5)


@pytest.mark.parametrize("values", [(-1, 0.0, 0.0), (1, np.nan, 0.0), (1, 0.0, np.inf)])
def test_a_fit_report_checks_itself(values):
    with pytest.raises(ParameterError, match="must be finite and not negative"):
        HealpixFit(*values)


def test_e_and_b_come_back_from_q_and_u():
    """spin_to_eb of the fit of Q + iU, with unseen pixels masked"""
    nside, bandlimit = 8, 9
    flm = random_flm(bandlimit, 2, seed=14)
    maps = flm_to_map(flm, nside, 2)
    e_flm, b_flm, fit = qu_to_eb_flm(maps.real, maps.imag, bandlimit)
    assert_close(np.array([e_flm, b_flm]), np.array(spin_to_eb(flm)), ulps=1e-9 / EPS)
    assert fit.residual <= 1e-10
    q = maps.real.copy()
    q[100] = UNSEEN
    e_again, _, _ = qu_to_eb_flm(q, maps.imag, bandlimit)
    assert_close(e_again, e_flm, ulps=1e-8 / EPS)


# ------------------------------------------------------------ synthesis and exact grids


def test_synthesis_of_real_fields_refuses_others():
    with pytest.raises(DataError, match="which real=True needs"):
        flm_to_map(random_flm(4), 4, real=True)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("spin", [0, 2])
def test_grid_maps_go_to_healpix_and_back(sampling, spin):
    nside, bandlimit = 8, 9
    flm = random_flm(bandlimit, spin, seed=15)
    grid = SpinHarmonicTransform(bandlimit, spin, sampling=sampling).synthesis(flm)
    maps = mw_to_healpix(grid, nside, spin, sampling=sampling)
    assert_close(maps, flm_to_map(flm, nside, spin), ulps=256 * bandlimit)
    again, fit = healpix_to_mw(maps, bandlimit, spin, sampling=sampling)
    assert_close(again, grid, ulps=1e-9 / EPS)
    assert fit.residual <= 1e-10


def test_real_grid_maps_stay_real():
    grid = SpinHarmonicTransform(9, real=True).synthesis(real_flm(9, seed=16))
    maps = mw_to_healpix(grid, 8)
    again, _ = healpix_to_mw(maps, 9)
    assert maps.dtype == again.dtype == np.float64
    assert_close(again, grid, ulps=1e-9 / EPS)


def test_grid_maps_are_checked():
    with pytest.raises(DataError, match="maps of spin=2 have dtype float64"):
        mw_to_healpix(np.ones((4, 7)), 4, 2)
    with pytest.raises(ShapeError, match=r"must have \(\.\.\., rings, phi\)"):
        mw_to_healpix(np.ones(7), 4)


def test_degrees_below_the_spin_do_not_contribute():
    flm = random_flm(6, 0, seed=17)
    expected = np.where(degrees(6) < 2, 0, flm)
    assert np.array_equal(flm_to_map(flm, 4, 2), flm_to_map(expected, 4, 2))
