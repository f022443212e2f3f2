"""The laws of the sums over degree on rings symmetric about the equator, order by order."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.mirror_engine import MirrorEngine
from spinsdw.ring_engine import OrderSums, RingEngine
from spinsdw.sampling import HealpixRings
from tests.helpers import (
    EPS,
    IS_UNCOMPILED,
    assert_close,
    direct_columns,
    needs_compiler,
    random_flm,
    random_like,
)

ORDERS = [0, 1, -1, 2, -2, 3, -4, 8, -9]
# A pole, rings next to it and to the equator, and the equator.
NORTH = np.array([0.0, 1e-6, 0.01, 0.1, 0.2, 0.3, 0.5, 0.9, 1.2, 1.5, np.pi / 2 - 1e-4, np.pi / 2])


def tolerance(bandlimit):
    """Ulps of a sum over degree: an error made k degrees ago is k times as large at the equator."""
    return 8 * bandlimit**1.5 + 64


def every_colatitude(north):
    has_equator = north[-1] == np.pi / 2
    return np.concatenate([north, np.pi - north[::-1][1 if has_equator else 0 :]])


def order_sums(bandlimit, order, sides=2, threads=1):
    """Weights that make the sum a synthesis of spin -order."""
    el = np.arange(bandlimit)
    weights = (-1.0) ** order * np.sqrt((2 * el + 1) / (4 * np.pi)) * (el >= abs(order))
    return OrderSums((order,), weights.astype(complex)[None], 0, sides, threads)


def fill(engine, flm, sums):
    """Columns with zeros where an order does not matter."""
    rings = every_colatitude(engine.colatitudes).size
    n_m = engine.bandlimit if sums.sides == 1 else 2 * engine.bandlimit - 1
    columns = np.zeros((len(flm), n_m, rings), dtype=complex)
    engine.fill_columns(flm, sums, columns)
    return columns


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("has_equator", [True, False])
@pytest.mark.parametrize("bandlimit", [1, 2, 3, 10, 11] if not IS_UNCOMPILED else [3, 10])
def test_columns_are_the_sums_over_degree(bandlimit, has_equator, order):
    """F_m(theta) = sum_l weight_l f_lm d^l_mn(theta) on both hemispheres, for each of a batch."""
    north = NORTH if has_equator else NORTH[:-1]
    flm = np.stack([random_flm(bandlimit, seed=i) for i in range(2)])
    found = fill(MirrorEngine(bandlimit, north, order), flm, order_sums(bandlimit, order))
    for one, row in zip(flm, found, strict=True):
        desired = direct_columns(one, -order, every_colatitude(north)).T
        desired = np.roll(desired, -(bandlimit - 1), axis=0)
        assert_close(row, desired, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("sides", [1, 2])
def test_the_other_direction_is_the_adjoint(order, sides):
    """<F f, g> = <f, F* g>; it adds to its output."""
    bandlimit = 12
    engine, sums = MirrorEngine(bandlimit, NORTH, order), order_sums(bandlimit, order, sides)
    flm = np.stack([random_flm(bandlimit, seed=i) for i in range(2)])
    columns = fill(engine, flm, sums)
    noise = random_like(columns, seed=5)
    found = np.zeros_like(flm)
    engine.add_to_harmonics(noise, sums, found)
    scale = np.linalg.norm(columns) * np.linalg.norm(noise)
    difference = np.vdot(columns, noise) - np.vdot(flm, found)
    assert abs(difference) <= tolerance(bandlimit) * EPS * scale
    twice = found.copy()
    engine.add_to_harmonics(noise, sums, twice)
    assert_close(twice, 2 * found, ulps=4)


@needs_compiler
@pytest.mark.parametrize("order", [0, -2, 1, 5, -8])
@pytest.mark.parametrize(("nside", "bandlimit"), [(64, 129), (60, 150), (256, 513)])
def test_parities_lose_nothing_against_the_general_sums(order, nside, bandlimit):
    """The same sums by d^l_mn itself: m close to l, rings next to a pole and to the equator."""
    north = HealpixRings(nside).colatitudes[: 2 * nside]
    sums, flm = order_sums(bandlimit, order), random_flm(bandlimit, order)[None]
    found = fill(MirrorEngine(bandlimit, north, order), flm, sums)
    desired = np.empty_like(found)
    general = RingEngine(bandlimit, north, symmetric=True)
    general.fill_columns(flm, sums, np.ones((1, 1), dtype=complex), desired)
    # Next to a pole an error made k degrees ago is k times as large.
    assert_close(found, desired, ulps=bandlimit**1.5)
    noise = random_like(found)
    results = []
    for engine in (MirrorEngine(bandlimit, north, order), general):
        out = np.zeros_like(flm)
        engine.add_to_harmonics(noise, sums, out)
        results.append(out)
    assert_close(*results, ulps=bandlimit**1.5)


@pytest.mark.parametrize("order", [0, -2])
def test_columns_have_the_same_bits_on_any_number_of_threads_and_in_any_batch(order):
    bandlimit = 40 if not IS_UNCOMPILED else 18
    engine = MirrorEngine(bandlimit, NORTH, order)
    flm = np.stack([random_flm(bandlimit, seed=i) for i in range(3)])
    desired = fill(engine, flm, order_sums(bandlimit, order))
    noise = random_like(desired)
    sums_of = []
    for threads in (1, 2, 5):
        sums = order_sums(bandlimit, order, threads=threads)
        assert np.array_equal(fill(engine, flm, sums), desired)
        out = np.zeros_like(flm)
        engine.add_to_harmonics(noise, sums, out)
        sums_of.append(out)
    assert all(np.array_equal(one, sums_of[0]) for one in sums_of)
    for i in range(3):
        single = fill(engine, flm[i : i + 1], order_sums(bandlimit, order))
        assert np.array_equal(single[0], desired[i])


@needs_compiler
@pytest.mark.parametrize("order", [0, -2])
def test_places_beyond_the_last_ring_stay_within_range_at_high_degree(order):
    """<F f, g> = <f, F* g> on a few rings: a place to spare grew to infinity, and 0 * inf is NaN

    At L = 1024 it did not yet, and at L = 2048 it did from degree 1467 on.
    """
    bandlimit, north = 2048, np.pi / 2 - np.array([0.3, 0.02, 0.01, 0.0])
    engine, sums = MirrorEngine(bandlimit, north, order), order_sums(bandlimit, order, sides=1)
    flm = random_flm(bandlimit, order)[None]
    columns = fill(engine, flm, sums)
    noise = random_like(columns, seed=1)
    found = np.zeros_like(flm)
    engine.add_to_harmonics(noise, sums, found)
    assert np.isfinite(found).all()
    scale = np.linalg.norm(columns) * np.linalg.norm(noise)
    difference = np.vdot(columns, noise) - np.vdot(flm, found)
    assert abs(difference) <= tolerance(bandlimit) * EPS * scale
