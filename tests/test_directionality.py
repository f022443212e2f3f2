"""The laws of the azimuthal part of a wavelet."""

from __future__ import annotations

import pickle
from math import comb

import numpy as np
import pytest

from spinsdw.directionality import (
    CurveletDirectionality,
    Orientations,
    RidgeletDirectionality,
    SteerableDirectionality,
)
from spinsdw.directionality.ridgelet import radon_factors
from spinsdw.errors import DataError, ParameterError
from tests.helpers import assert_close, direct_map, exact_small_d, random_flm

DIRECTIONS = [1, 2, 3, 4, 5, 8, 33]
each_size = pytest.mark.parametrize("directions", DIRECTIONS)


def random_by_order(directions, seed=0):
    rng = np.random.default_rng(seed)
    return rng.standard_normal(directions) + 1j * rng.standard_normal(directions)


def at_angle(directionality, by_order, angle):
    """W(gamma) = sum_n exp(i n gamma) W_n."""
    terms = zip(directionality.orders, by_order, strict=True)
    return sum(value * np.exp(1j * n * angle) for n, value in terms)


@each_size
def test_orders_are_those_of_one_parity_below_the_directions(directions):
    orders = SteerableDirectionality(directions).orders
    assert orders == tuple(
        n
        for n in range(-directions, directions + 1)
        if abs(n) < directions and (directions + n) % 2
    )
    assert len(orders) == directions


@each_size
def test_orientations_divide_a_half_turn(directions):
    orientations = SteerableDirectionality(directions).orientations
    assert_close(orientations, np.arange(directions) * (np.pi / directions), ulps=2)


@each_size
@pytest.mark.parametrize("bandlimit", [1, 2, 5, 40])
def test_coefficients_are_the_binomial_roots_of_the_paper(directions, bandlimit):
    """zeta_lm = nu sqrt(2**-g binom(g, (g-m)/2)), g = min(N-1, l - [1 + (-1)**(N+l)] / 2)."""
    zeta = SteerableDirectionality(directions).coefficients(bandlimit)
    expected = np.zeros((directions, bandlimit), dtype=complex)
    for el in range(1, bandlimit):
        g = min(directions - 1, el - (1 + (-1) ** (directions + el)) // 2)
        for row, m in enumerate(SteerableDirectionality(directions).orders):
            if abs(m) <= g:
                phase = 1 if directions % 2 else 1j
                expected[row, el] = phase * np.sqrt(comb(g, (g - m) // 2) / 2**g)
    assert_close(zeta, expected, ulps=16)


@pytest.mark.parametrize("directions", [*DIRECTIONS, 1000, 1501])
def test_every_degree_above_zero_has_unit_power(directions):
    """sum_m |zeta_lm|**2 = 1 for l >= 1, far beyond where a binomial overflows."""
    power = np.sum(
        np.abs(SteerableDirectionality(directions).coefficients(directions + 2)) ** 2, axis=0
    )
    assert power[0] == 0
    assert_close(power[1:], np.ones(directions + 1), ulps=8)


@each_size
def test_wavelets_shape_is_that_of_a_real_function(directions):
    """zeta_{l,-m} = (-1)**m conj(zeta_lm)."""
    directionality = SteerableDirectionality(directions)
    zeta = directionality.coefficients(40)
    signs = np.array([(-1) ** n for n in directionality.orders])
    assert np.array_equal(zeta[::-1], signs[:, None] * zeta.conj())


@each_size
def test_no_order_exceeds_its_degree(directions):
    directionality = SteerableDirectionality(directions)
    orders, degrees = np.abs(directionality.orders)[:, None], np.arange(40)
    assert not np.any(directionality.coefficients(40)[orders > degrees])


@each_size
def test_coefficients_do_not_depend_on_the_bandlimit(directions):
    directionality = SteerableDirectionality(directions)
    assert np.array_equal(directionality.coefficients(40)[:, :3], directionality.coefficients(3))


@each_size
def test_orders_and_orientations_are_a_unitary_pair(directions):
    """M M^H = N, and M W_n = W(gamma_k)."""
    directionality = SteerableDirectionality(directions)
    matrix, by_order = directionality.orders_to_orientations, random_by_order(directions)
    ulps = 16 * directions
    assert_close(matrix @ matrix.conj().T, directions * np.eye(directions), ulps=ulps)
    expected = [at_angle(directionality, by_order, angle) for angle in directionality.orientations]
    assert_close(matrix @ by_order, expected, ulps=ulps)


@each_size
def test_steering_gives_any_angle_from_the_orientations(directions):
    """W(gamma) = sum_k z(gamma - gamma_k) W(gamma_k)."""
    directionality, by_order = SteerableDirectionality(directions), random_by_order(directions)
    by_orientation = directionality.orders_to_orientations @ by_order
    angles = np.array([0.0, 0.3, 2.5, np.pi, -7.0])
    steered = directionality.steering_weights(angles) @ by_orientation
    expected = at_angle(directionality, by_order, angles)
    assert_close(steered, expected, ulps=64 * directions)


@each_size
def test_steering_to_an_orientation_picks_it(directions):
    """z(gamma_j - gamma_k) = delta_jk."""
    directionality = SteerableDirectionality(directions)
    weights = directionality.steering_weights(directionality.orientations)
    assert_close(weights, np.eye(directions), ulps=16 * directions)


@each_size
def test_a_half_turn_is_a_sign(directions):
    """W(gamma + pi) = (-1)**(N-1) W(gamma)."""
    directionality = SteerableDirectionality(directions)
    turned = directionality.steering_weights(1.1 + np.pi)
    expected = (-1) ** (directions - 1) * directionality.steering_weights(1.1)
    assert_close(turned, expected, ulps=64 * directions)


def test_held_arrays_are_read_only():
    directionality = SteerableDirectionality(3)
    assert not directionality.orientations.flags.writeable
    assert not directionality.orders_to_orientations.flags.writeable


@pytest.mark.parametrize("directions", [0, -1, 1.0, "3", True, None])
def test_directions_are_counted_from_one(directions):
    with pytest.raises(ParameterError, match=r"directions=.* must be an integer of at least 1"):
        SteerableDirectionality(directions)


@pytest.mark.parametrize("angle", [np.nan, [0.0, np.inf]])
def test_angle_is_finite(angle):
    with pytest.raises(DataError, match="must be finite; give it in radians"):
        SteerableDirectionality(2).steering_weights(angle)


FAMILIES = [
    SteerableDirectionality(1),
    SteerableDirectionality(4),
    SteerableDirectionality(5),
    CurveletDirectionality(),
    CurveletDirectionality(centred=True),
    RidgeletDirectionality(),
    RidgeletDirectionality(1),
    RidgeletDirectionality(-2),
]
each_family = pytest.mark.parametrize("family", FAMILIES, ids=repr)
each_bandlimit = pytest.mark.parametrize("bandlimit", [1, 2, 3, 8, 33])
each_spin = pytest.mark.parametrize("spin", [0, 1, 2, -1, -3])


@each_family
@each_bandlimit
@each_spin
def test_every_held_degree_comes_back_once(family, bandlimit, spin):
    """sum_n zeta_ln conj(dual_ln) = 1 where l is held, 0 elsewhere; l = 0 is not."""
    zeta, dual = (one.coefficients(bandlimit, spin) for one in (family, family.dual))
    assert zeta.shape == (family.orientations_at(bandlimit).count, bandlimit)
    held = family.held_degrees(bandlimit, spin)
    assert not held[0]
    assert_close(np.sum(zeta * dual.conj(), axis=0), held.astype(float), ulps=8)


@each_family
@each_bandlimit
def test_orders_are_symmetric_and_within_the_degrees(family, bandlimit):
    """zeta_{l,-n} = (-1)**n conj(zeta_ln), zero for |n| > l; as many angles as orders."""
    orientations, zeta = family.orientations_at(bandlimit), family.coefficients(bandlimit)
    orders = np.array(orientations.orders)
    assert np.array_equal(orders, -orders[::-1])
    assert len(orders) == orientations.count == orientations.angles.size
    assert_close(zeta[::-1], (-1.0) ** orders[:, None] * zeta.conj(), ulps=0)
    assert not np.any(zeta[np.abs(orders)[:, None] > np.arange(bandlimit)])


@each_family
@each_bandlimit
def test_families_steer_to_any_angle(family, bandlimit):
    orientations = family.orientations_at(bandlimit)
    by_order = random_by_order(orientations.count)
    by_orientation = orientations.orders_to_orientations @ by_order
    angles = np.array([0.3, 2.5, -7.0])
    steered = orientations.steering_weights(angles) @ by_orientation
    expected = at_angle(orientations, by_order, angles)
    assert_close(steered, expected, ulps=128 * orientations.count)


@each_family
def test_families_are_values(family):
    copied = pickle.loads(pickle.dumps(family))
    assert copied == family
    assert hash(copied) == hash(family)
    assert family.dual.dual == family


@each_bandlimit
def test_curvelets_have_the_orders_of_their_degree_alone(bandlimit):
    """zeta_ll = 1 / sqrt(2), zeta_{l,-l} = (-1)**l / sqrt(2); 2 L - 1 orders of both parities."""
    orientations = CurveletDirectionality().orientations_at(bandlimit)
    assert orientations.orders == tuple(range(1 - bandlimit, bandlimit))
    assert_close(
        orientations.angles, 2 * np.pi * np.arange(2 * bandlimit - 1) / (2 * bandlimit - 1), 4
    )
    zeta = CurveletDirectionality().coefficients(bandlimit)
    expected = np.zeros_like(zeta)
    for row, n in enumerate(orientations.orders):
        if n:
            expected[row, abs(n)] = np.sqrt(0.5) * (1 if n > 0 else (-1) ** n)
    assert_close(zeta, expected, ulps=1)


@each_spin
@pytest.mark.parametrize("bandlimit", [1, 2, 5, 40])
def test_radon_factors_are_rows_of_the_wigner_matrix(bandlimit, spin):
    """g_l = 2 pi (-1)**s d^l_{0,-s}(pi / 2), zero for l + s odd."""
    expected = [
        2 * np.pi * (-1) ** spin * exact_small_d(el, 0, -spin, 0) if el >= abs(spin) else 0
        for el in range(bandlimit)
    ]
    found = radon_factors(bandlimit, spin)
    assert_close(found, expected, ulps=16)
    assert not np.any(found[(np.arange(bandlimit) + spin) % 2 == 1])


def test_radon_factors_are_integrals_along_the_equator():
    """int sY_lm(pi / 2, phi) d phi = sqrt((2l+1)/4pi) g_l at m = 0, and 0 at any other m."""
    for spin in (0, 2, -1):
        flm = random_flm(7, spin)
        longitudes = 2 * np.pi * np.arange(13) / 13
        total = np.mean(direct_map(flm, spin, np.array([np.pi / 2]), longitudes)) * 2 * np.pi
        el = np.arange(7)
        expected = np.sum(
            np.sqrt((2 * el + 1) / (4 * np.pi)) * radon_factors(7, spin) * flm[el**2 + el]
        )
        assert_close(total, expected, ulps=256)


@pytest.mark.parametrize("power", [0, 1, -1, 3])
def test_ridgelets_carry_a_power_of_the_radon_factors(power):
    factors = radon_factors(12, 1)[1::2]
    zeta = RidgeletDirectionality(power).coefficients(12, 1)
    assert_close(zeta[0, 1::2], np.sign(factors) * np.abs(factors) ** power, ulps=4)
    assert not np.any(zeta[0, ::2])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CurveletDirectionality(1), "centred=1 must be True or False"),
        (lambda: RidgeletDirectionality(0.5), r"power=0\.5 must be an integer"),
        (lambda: CurveletDirectionality().orientations_at(0), "bandlimit=0 must be an integer"),
        (lambda: RidgeletDirectionality().coefficients(4, "2"), "spin='2' must be an integer"),
        (lambda: Orientations(0), "count=0 must be an integer of at least 1"),
        (lambda: Orientations(4, step=1), "step=1 must be 2, or 1 for an odd count, not 4"),
        (lambda: Orientations(5, step=3), "step=3 must be 2, or 1 for an odd count"),
    ],
)
def test_families_name_the_bad_parameter(make, message):
    with pytest.raises(ParameterError, match=message):
        make()
