"""The strongest orientation is the highest maximum of a trigonometric polynomial."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.directionality import CurveletDirectionality, Orientations
from spinsdw.errors import DataError, ParameterError
from spinsdw.steering import strongest_orientations
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import EPS, assert_close, random_flm, random_real_flm

# Orders by their number and distance.
KINDS = [(1, 2), (2, 2), (3, 2), (4, 2), (5, 2), (8, 2), (11, 2), (1, 1), (3, 1), (5, 1), (9, 1)]
each_kind = pytest.mark.parametrize(("count", "step"), KINDS)


def random_values(orientations, *, is_real, places=60, seed=0):
    """Draw W at the orientations from random orders, c_{-n} = conj(c_n) where it is real."""
    rng = np.random.default_rng(seed)
    shape = (orientations.count, 1, places)
    by_order = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    if is_real:
        by_order = by_order + by_order[::-1].conj()
    values = np.einsum("kn,ntp->ktp", orientations.orders_to_orientations, by_order)
    return by_order[:, 0], values.real if is_real else values


def response(by_order, orders, angles, *, modulus):
    phases = np.exp(1j * np.multiply.outer(np.array(orders), angles))
    values = np.einsum("n...,n...->...", by_order, phases)
    return np.abs(values) if modulus else values.real


def highest_by_roots(by_order, orders, *, modulus):
    """Take the largest response at all zeros of the derivative: the roots of sum_q q p_q z^q."""
    last = orders[-1]
    powers = np.zeros(4 * last + 1 if modulus else 2 * last + 1, dtype=complex)
    if modulus:
        for n, c in zip(orders, by_order, strict=True):
            for k, d in zip(orders, by_order, strict=True):
                powers[n - k + 2 * last] += c * np.conj(d)
    else:
        powers[np.array(orders) + last] = by_order
    q = np.arange(powers.size) - powers.size // 2
    angles = np.angle(np.roots((q * powers)[::-1])) if last else np.zeros(1)
    return np.max(response(by_order[:, None], orders, angles, modulus=modulus))


@each_kind
@pytest.mark.parametrize(("is_real", "modulus"), [(True, False), (True, True), (False, True)])
def test_strength_is_the_highest_of_all_stationary_values(count, step, modulus, is_real):
    orientations = Orientations(count, step)
    by_order, values = random_values(orientations, is_real=is_real)
    angles, strengths = strongest_orientations(values, orientations, modulus=modulus)
    assert angles.shape == strengths.shape == (1, 60)
    orders = orientations.orders
    expected = [highest_by_roots(c, orders, modulus=modulus) for c in by_order.T]
    # The oracle's roots are good to the root of eps at worst, its values to their square.
    ulps = 256 * count * np.max(np.sum(np.abs(by_order), axis=0)) / np.max(np.abs(expected))
    assert_close(strengths[0], expected, ulps=ulps)
    found = response(by_order, orders, angles[0], modulus=modulus)
    assert_close(strengths[0], found, ulps=ulps)


@each_kind
@pytest.mark.parametrize("modulus", [False, True])
def test_nothing_on_a_fine_grid_is_stronger(count, step, modulus):
    orientations = Orientations(count, step)
    by_order, values = random_values(orientations, is_real=not modulus, seed=3)
    _, strengths = strongest_orientations(values, orientations, modulus=modulus)
    grid = np.linspace(0, 2 * np.pi, 1501)
    phases = np.exp(1j * np.outer(grid, orientations.orders))
    everywhere = phases @ by_order
    everywhere = np.abs(everywhere) if modulus else everywhere.real
    atol = 64 * count * EPS * np.max(np.sum(np.abs(by_order), axis=0))
    assert np.all(everywhere.max(axis=0) <= strengths[0] + atol)


@pytest.mark.parametrize(("count", "period"), [(2, 2 * np.pi), (3, np.pi), (4, 2 * np.pi)])
@pytest.mark.parametrize("angle", [0.0, 0.3, 1.5, 3.0, 3.3, 6.2])
def test_a_cosine_points_where_it_was_put(count, period, angle):
    """cos(n_max (gamma - a)) plus nothing else has its maximum 1 at a, up to its period."""
    orientations = Orientations(count)
    n = 1 if count % 2 == 0 else 2
    values = np.cos(n * (orientations.angles - angle))[:, None, None]
    angles, strengths = strongest_orientations(values, orientations, modulus=False)
    turn = np.exp(2j * np.pi * (angles[0, 0] - angle) / period)
    assert abs(turn - 1) < 64 * EPS
    assert 0 <= angles[0, 0] < period
    assert_close(strengths, [[1.0]], ulps=16)


@pytest.mark.parametrize("count", [4, 5, 7])
def test_of_two_equal_maxima_either_is_the_highest(count):
    """W and its values turned half a turn tie: the strength is the same, to rounding."""
    orientations = Orientations(count)
    values = np.cos((count - 1) * (orientations.angles - 0.2))[:, None, None]
    angles, strengths = strongest_orientations(values, orientations, modulus=False)
    assert_close(np.cos((count - 1) * (angles - 0.2)), [[1.0]], ulps=64)
    assert_close(strengths, [[1.0]], ulps=64)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_nothing_has_no_strength(count):
    values = np.zeros((count, 2, 3))
    angles, strengths = strongest_orientations(values, Orientations(count), modulus=False)
    assert not np.any(strengths)
    assert np.isfinite(angles).all()


def test_blocks_and_batches_make_no_difference():
    orientations = Orientations(5)
    _, values = random_values(orientations, is_real=True, places=5000)
    whole = strongest_orientations(values, orientations, modulus=False)
    stacked = strongest_orientations(
        np.stack([values[..., :2500], values[..., 2500:]]), orientations, modulus=False
    )
    for one, other in zip(whole, stacked, strict=True):
        assert_close(np.concatenate(list(other), axis=-1), one, ulps=8)


@pytest.mark.parametrize("directions", [1, 2, 3, 4, 6])
def test_coefficients_of_real_signals_have_a_strongest_orientation(directions):
    transform = SpinWaveletTransform(12, 0, directions, real=True)
    coefficients = transform.analysis_harmonic(random_real_flm(12))
    for scale in transform.scales[1:]:
        angles, strengths = coefficients.strongest_orientation(scale)
        sizes, moduli = coefficients.strongest_orientation(scale, modulus=True)
        scatter = [coefficients.steer(angle)[scale] for angle in np.linspace(0, 2 * np.pi, 33)]
        bound = 64 * 12 * EPS * np.max(np.abs(scatter))
        assert np.all(np.max(scatter, axis=0) <= strengths + bound)
        assert np.all(np.max(np.abs(scatter), axis=0) <= moduli + bound)
        assert np.all(moduli >= np.abs(strengths) - bound)
        steered = coefficients.steer(angles[1, 2])[scale][1, 2]
        assert abs(steered - strengths[1, 2]) < bound
        assert np.all(sizes < np.pi)


def test_turning_a_signal_turns_its_strongest_orientation():
    """At the poles of MWSS, longitude alpha is orientation: gamma + alpha stays."""
    transform = SpinWaveletTransform(16, 2, 3, sampling="mwss")
    coefficients = transform.analysis_harmonic(random_flm(16, 2))
    angles, strengths = coefficients.strongest_orientation(3)
    assert_close(strengths[0], np.full(32, strengths[0, 0]), ulps=512)
    alpha = transform.grid_of(16).longitudes
    turned = np.exp(2j * (angles[0] + alpha))
    assert_close(turned, np.full(32, turned[0]), ulps=4096)


@pytest.mark.parametrize("is_centred", [False, True])
def test_curvelets_have_a_strongest_orientation(is_centred):
    transform = SpinWaveletTransform(8, 1, directionality=CurveletDirectionality(is_centred))
    coefficients = transform.analysis_harmonic(random_flm(8, 1))
    angles, strengths = coefficients.strongest_orientation(2)
    scatter = [np.abs(coefficients.steer(angle)[2]) for angle in np.linspace(0, 2 * np.pi, 65)]
    assert np.all(np.max(scatter, axis=0) <= strengths * (1 + 1e-13))
    assert np.all(angles < (np.pi if is_centred else 2 * np.pi))


def test_only_real_values_have_a_largest():
    coefficients = SpinWaveletTransform(8, 2, 3).analysis_harmonic(random_flm(8, 2))
    with pytest.raises(DataError, match="modulus=False needs real coefficients, and scale 2 is"):
        coefficients.strongest_orientation(2, modulus=False)
    with pytest.raises(ParameterError, match="modulus=1 must be True or False"):
        coefficients.strongest_orientation(2, modulus=1)
    with pytest.raises(ParameterError, match="scale=9 is not held"):
        coefficients.strongest_orientation(9)
