"""The laws of the azimuthal part of a wavelet."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest

from spinsdw.directionality import Directionality
from spinsdw.errors import DataError, ParameterError
from tests.helpers import assert_close

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
    orders = Directionality(directions).orders
    assert orders == tuple(
        n
        for n in range(-directions, directions + 1)
        if abs(n) < directions and (directions + n) % 2
    )
    assert len(orders) == directions


@each_size
def test_orientations_divide_a_half_turn(directions):
    orientations = Directionality(directions).orientations
    assert_close(orientations, np.arange(directions) * (np.pi / directions), ulps=2)


@each_size
@pytest.mark.parametrize("bandlimit", [1, 2, 5, 40])
def test_coefficients_are_the_binomial_roots_of_the_paper(directions, bandlimit):
    """zeta_lm = nu sqrt(2**-g binom(g, (g-m)/2)), g = min(N-1, l - [1 + (-1)**(N+l)] / 2)."""
    zeta = Directionality(directions).coefficients(bandlimit)
    expected = np.zeros((directions, bandlimit), dtype=complex)
    for el in range(1, bandlimit):
        g = min(directions - 1, el - (1 + (-1) ** (directions + el)) // 2)
        for row, m in enumerate(Directionality(directions).orders):
            if abs(m) <= g:
                phase = 1 if directions % 2 else 1j
                expected[row, el] = phase * np.sqrt(comb(g, (g - m) // 2) / 2**g)
    assert_close(zeta, expected, ulps=16)


@pytest.mark.parametrize("directions", [*DIRECTIONS, 1000, 1501])
def test_every_degree_above_zero_has_unit_power(directions):
    """sum_m |zeta_lm|**2 = 1 for l >= 1, far beyond where a binomial overflows."""
    power = np.sum(np.abs(Directionality(directions).coefficients(directions + 2)) ** 2, axis=0)
    assert power[0] == 0
    assert_close(power[1:], np.ones(directions + 1), ulps=8)


@each_size
def test_wavelets_shape_is_that_of_a_real_function(directions):
    """zeta_{l,-m} = (-1)**m conj(zeta_lm)."""
    directionality = Directionality(directions)
    zeta = directionality.coefficients(40)
    signs = np.array([(-1) ** n for n in directionality.orders])
    assert np.array_equal(zeta[::-1], signs[:, None] * zeta.conj())


@each_size
def test_no_order_exceeds_its_degree(directions):
    directionality = Directionality(directions)
    orders, degrees = np.abs(directionality.orders)[:, None], np.arange(40)
    assert not np.any(directionality.coefficients(40)[orders > degrees])


@each_size
def test_coefficients_do_not_depend_on_the_bandlimit(directions):
    directionality = Directionality(directions)
    assert np.array_equal(directionality.coefficients(40)[:, :3], directionality.coefficients(3))


@each_size
def test_orders_and_orientations_are_a_unitary_pair(directions):
    """M M^H = N, and M W_n = W(gamma_k)."""
    directionality = Directionality(directions)
    matrix, by_order = directionality.orders_to_orientations, random_by_order(directions)
    ulps = 16 * directions
    assert_close(matrix @ matrix.conj().T, directions * np.eye(directions), ulps=ulps)
    expected = [at_angle(directionality, by_order, angle) for angle in directionality.orientations]
    assert_close(matrix @ by_order, expected, ulps=ulps)


@each_size
def test_steering_gives_any_angle_from_the_orientations(directions):
    """W(gamma) = sum_k z(gamma - gamma_k) W(gamma_k)."""
    directionality, by_order = Directionality(directions), random_by_order(directions)
    by_orientation = directionality.orders_to_orientations @ by_order
    angles = np.array([0.0, 0.3, 2.5, np.pi, -7.0])
    steered = directionality.steering_weights(angles) @ by_orientation
    expected = at_angle(directionality, by_order, angles)
    assert_close(steered, expected, ulps=64 * directions)


@each_size
def test_steering_to_an_orientation_picks_it(directions):
    """z(gamma_j - gamma_k) = delta_jk."""
    directionality = Directionality(directions)
    weights = directionality.steering_weights(directionality.orientations)
    assert_close(weights, np.eye(directions), ulps=16 * directions)


@each_size
def test_a_half_turn_is_a_sign(directions):
    """W(gamma + pi) = (-1)**(N-1) W(gamma)."""
    directionality = Directionality(directions)
    turned = directionality.steering_weights(1.1 + np.pi)
    expected = (-1) ** (directions - 1) * directionality.steering_weights(1.1)
    assert_close(turned, expected, ulps=64 * directions)


def test_held_arrays_are_read_only():
    directionality = Directionality(3)
    assert not directionality.orientations.flags.writeable
    assert not directionality.orders_to_orientations.flags.writeable


@pytest.mark.parametrize("directions", [0, -1, 1.0, "3", True, None])
def test_directions_are_counted_from_one(directions):
    with pytest.raises(ParameterError, match=r"directions=.* must be an integer of at least 1"):
        Directionality(directions)


@pytest.mark.parametrize("angle", [np.nan, [0.0, np.inf]])
def test_angle_is_finite(angle):
    with pytest.raises(DataError, match="must be finite; give it in radians"):
        Directionality(2).steering_weights(angle)
