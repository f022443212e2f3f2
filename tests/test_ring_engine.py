"""The laws of the sums over degree on any set of rings."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from spinsdw.compiled.vectors import RINGS
from spinsdw.ring_engine import OrderSums, RingEngine, make_runs
from tests.helpers import (
    EPS,
    IS_UNCOMPILED,
    assert_close,
    needs_compiler,
    random_like,
    sizes,
    small_d,
)

ORDERS = [(0,), (2,), (-1,), (-2, 0, 2), (-3, -1, 1, 3), (-1, 4), (0, 1, 2)]


def tolerance(bandlimit):
    """Ulps of a sum over degree: a colatitude, rounded, moves degree L by L pi eps / 2."""
    return 8 * bandlimit + 32


def random_complex(*shape, seed=0):
    return random_like(np.empty(shape, dtype=complex), seed=seed)


def mixed_colatitudes(count):
    """Rings of no regular grid: both poles, some next to them, the equator, and others."""
    special = np.array([0.0, 1e-9, 1e-3, np.pi / 2, 3.1, np.pi - 1e-6, np.pi])
    others = np.random.default_rng(count).uniform(0, np.pi, max(count - special.size, 0))
    return np.sort(np.concatenate([special, others])[:count])


def direct_columns(flm, orders, weights, mixing, colatitudes):
    """sum_i mixing_ki sum_l weight_il f_lm d^l_{m, n_i}, shape (k, m, ring), -m counted back."""
    bandlimit = weights.shape[1]
    columns = np.zeros((mixing.shape[0], 2 * bandlimit - 1, colatitudes.size), dtype=complex)
    for i, n in enumerate(orders):
        row = flm[i if len(flm) > 1 else 0]
        for el in range(abs(n), bandlimit):
            d = small_d(el, n, colatitudes)
            for m in range(-el, el + 1):
                value = weights[i, el] * row[el * el + el + m] * d[:, m + el]
                columns[:, m] += mixing[:, i, None] * value
    return columns


def problem(bandlimit, orders, outputs=None, sources=1):
    """Draw coefficients, weights (zero where l < |n|) and mixing."""
    weights = random_complex(len(orders), bandlimit, seed=1)
    for row, n in zip(weights, orders, strict=True):
        row[: abs(n)] = 0
    flm = random_complex(sources, bandlimit**2, seed=2)
    mixing = random_complex(outputs or len(orders), len(orders), seed=3)
    return flm, weights, mixing


def fill(engine, flm, sums, mixing, rings=None):
    n_m = 2 * engine.bandlimit - 1 if sums.sides == 2 else engine.bandlimit
    shape = (mixing.shape[0], n_m, rings or engine.colatitudes.size)
    out = np.full(shape, np.nan, dtype=complex)
    engine.fill_columns(flm, sums, mixing, out)
    return out


@pytest.mark.parametrize("orders", ORDERS)
@pytest.mark.parametrize("bandlimit", sizes(5, 9, 20))
def test_columns_are_the_sums_over_degree(bandlimit, orders):
    """F_k,m(theta) = sum_i mixing_ki sum_l weight_il f_lm d^l_{m, n_i}(theta), any rings."""
    colatitudes = mixed_colatitudes(11)
    for sources in {1, len(orders)}:
        flm, weights, mixing = problem(bandlimit, orders, 2, sources)
        found = fill(RingEngine(bandlimit, colatitudes), flm, OrderSums(orders, weights), mixing)
        desired = direct_columns(flm, orders, weights, mixing, colatitudes)
        assert_close(found, desired, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("count", sorted({1, 2, RINGS - 1, RINGS, RINGS + 1, 3 * RINGS}))
def test_any_number_of_rings_fills_whole_blocks(count):
    orders, colatitudes = (-1, 1), mixed_colatitudes(count)
    flm, weights, mixing = problem(6, orders)
    found = fill(RingEngine(6, colatitudes), flm, OrderSums(orders, weights), mixing)
    desired = direct_columns(flm, orders, weights, mixing, colatitudes)
    assert_close(found, desired, ulps=tolerance(6))


@pytest.mark.parametrize("orders", ORDERS)
def test_the_other_direction_is_the_adjoint(orders):
    """<F f, g> = <f, F* g>, with conjugated weights and without mixing; it adds to its output."""
    bandlimit, colatitudes = 9, mixed_colatitudes(13)
    engine = RingEngine(bandlimit, colatitudes)
    for sources in {1, len(orders)}:
        flm, weights, _ = problem(bandlimit, orders, sources=sources)
        identity = np.eye(len(orders), dtype=complex)
        columns = fill(engine, flm, OrderSums(orders, weights), identity)
        noise = random_complex(*columns.shape, seed=5)
        found = np.zeros((sources, bandlimit**2), dtype=complex)
        sums = OrderSums(orders, weights.conj())
        engine.add_to_harmonics(noise, sums, found)
        scale = np.linalg.norm(columns) * np.linalg.norm(noise)
        difference = np.vdot(columns, noise) - np.vdot(flm, found)
        assert abs(difference) <= tolerance(bandlimit) * EPS * scale
        twice = found.copy()
        engine.add_to_harmonics(noise, sums, twice)
        assert_close(twice, 2 * found, ulps=4)


@pytest.mark.parametrize("orders", ORDERS)
def test_degrees_of_weight_zero_may_be_skipped(orders):
    bandlimit = 12 if IS_UNCOMPILED else 40
    engine = RingEngine(bandlimit, mixed_colatitudes(10))
    flm, weights, mixing = problem(bandlimit, orders)
    identity = np.eye(len(orders), dtype=complex)
    noise = random_complex(len(orders), 2 * bandlimit - 1, 10)
    for lowest in range(bandlimit + 1):
        weights[:, :lowest] = 0
        results = []
        for start in (0, lowest):
            sums = OrderSums(orders, weights, start)
            found = np.zeros((1, bandlimit**2), dtype=complex)
            engine.add_to_harmonics(noise, sums, found)
            results.append(
                (fill(engine, flm, sums, mixing), fill(engine, flm, sums, identity), found)
            )
        for one, other in zip(*results, strict=True):
            assert_close(one, other, ulps=64)


@pytest.mark.parametrize("orders", ORDERS)
@pytest.mark.parametrize("count", [2, 7])
@pytest.mark.parametrize("has_equator", [True, False])
def test_mirrored_rings_cost_nothing_and_lose_nothing(orders, count, has_equator):
    """d^l_mn(pi - theta) = (-1)^(l+m) d^l_{m,-n}(theta)."""
    bandlimit = 9
    north = np.linspace(0.0, 1.4, count)
    if has_equator:
        north = np.append(north, np.pi / 2)
    south = np.pi - north[::-1][1 if has_equator else 0 :]
    every = np.concatenate([north, south])
    flm, weights, mixing = problem(bandlimit, orders)
    symmetric = RingEngine(bandlimit, north, symmetric=True)
    plain = RingEngine(bandlimit, every)
    sums = OrderSums(orders, weights)
    found = fill(symmetric, flm, sums, mixing, rings=every.size)
    assert_close(found, fill(plain, flm, sums, mixing), ulps=tolerance(bandlimit))
    noise = random_complex(len(orders), 2 * bandlimit - 1, every.size, seed=4)
    results = []
    for engine in (symmetric, plain):
        out = np.zeros((1, bandlimit**2), dtype=complex)
        engine.add_to_harmonics(noise, sums, out)
        results.append(out)
    assert_close(*results, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("orders", [(0,), (-1, 1), (-2, 0, 2)])
@pytest.mark.parametrize("is_symmetric", [False, True])
def test_one_side_is_half_of_two(orders, is_symmetric):
    bandlimit, north = 9, np.array([0.0, 0.3, 1.0, np.pi / 2])
    engine = RingEngine(bandlimit, north, symmetric=is_symmetric)
    rings = 7 if is_symmetric else 4
    flm, weights, mixing = problem(bandlimit, orders)
    both = fill(engine, flm, OrderSums(orders, weights), mixing, rings)
    half = fill(engine, flm, OrderSums(orders, weights, sides=1), mixing, rings)
    assert_close(half, both[:, :bandlimit], ulps=16)
    noise = random_complex(len(orders), 2 * bandlimit - 1, rings, seed=4)
    noise[:, bandlimit:] = 0
    results = []
    for sides, values in ((2, noise), (1, np.ascontiguousarray(noise[:, :bandlimit]))):
        out = np.zeros((1, bandlimit**2), dtype=complex)
        engine.add_to_harmonics(values, OrderSums(orders, weights, sides=sides), out)
        results.append(out)
    assert_close(*results, ulps=16)


@needs_compiler
@pytest.mark.parametrize("n", [0, -2, 20, 100])
def test_rings_left_out_hold_nothing(n):
    """Beyond its turning point d^l_mn decays faster than any power: no unit is lost."""
    bandlimit, colatitudes = 128, (np.arange(128) + 0.5) * np.pi / 128
    engine = RingEngine(bandlimit, colatitudes)
    for el in (100, 127):
        weights = np.zeros((1, bandlimit), dtype=complex)
        weights[0, el] = 1
        flm = np.ones((1, bandlimit**2), dtype=complex)
        found = fill(engine, flm, OrderSums((n,), weights), np.ones((1, 1), dtype=complex))
        d = small_d(el, n, colatitudes).T
        desired = np.zeros_like(found[0])
        desired[np.arange(-el, el + 1)] = d
        # Next to a pole an error made k degrees ago is k times as large.
        assert_close(found[0], desired, ulps=bandlimit**1.5)


@pytest.mark.parametrize("is_symmetric", [False, True])
def test_columns_have_the_same_bits_on_any_number_of_threads(is_symmetric):
    bandlimit, orders = 50, (-2, 0, 2)
    north = np.linspace(0, np.pi / 2, 9)
    engine = RingEngine(bandlimit, north, symmetric=is_symmetric)
    rings = 17 if is_symmetric else 9
    flm, weights, mixing = problem(bandlimit, orders)
    noise = random_complex(3, 2 * bandlimit - 1, rings, seed=4)
    results = []
    for threads in (1, 2, 3, 5):
        sums = OrderSums(orders, weights, threads=threads)
        out = np.zeros((1, bandlimit**2), dtype=complex)
        engine.add_to_harmonics(noise, sums, out)
        results.append((fill(engine, flm, sums, mixing, rings), out))
    for other in results[1:]:
        assert np.array_equal(other[0], results[0][0])
        assert np.array_equal(other[1], results[0][1])


def test_one_engine_serves_many_threads_from_its_first_use():
    """Its tables are made when first needed, maybe by several threads at once."""
    flm, weights, mixing = problem(24, (0, 1))
    sums = OrderSums((0, 1), weights)
    desired = fill(RingEngine(24, mixed_colatitudes(20)), flm, sums, mixing)
    engine = RingEngine(24, mixed_colatitudes(20))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: fill(engine, flm, sums, mixing), range(8)))
    assert all(np.array_equal(one, desired) for one in found)


@pytest.mark.parametrize("orders", ORDERS)
def test_runs_serve_every_series_once(orders):
    """Rows are n, then (i, sigma, mirrored) twice; a pass at n serves n_i = sigma n, unmirrored."""
    served = []
    for n, *slots in make_runs(orders):
        for i, sigma, mirrored in (slots[:3], slots[3:]):
            if i >= 0:
                assert orders[i] == sigma * n
                assert not mirrored
                served.append((i, sigma))
    assert sorted(served) == sorted((i, s) for i in range(len(orders)) for s in (1, -1))


@pytest.mark.parametrize("orders", ORDERS)
def test_runs_on_a_symmetric_grid_serve_both_hemispheres_once(orders):
    """On the mirrored ring a pass at n serves n_i = -sigma n."""
    served = []
    for n, *slots in make_runs(orders, symmetric=True):
        for i, sigma, mirrored in (slots[:3], slots[3:]):
            assert orders[i] == (-sigma if mirrored else sigma) * n
            served.append((i, sigma, mirrored))
    expected = [(i, s, h) for i in range(len(orders)) for s in (1, -1) for h in (0, 1)]
    assert sorted(served) == sorted(expected)


def test_pairs_of_orders_share_one_pass():
    """d^l_{-m,-n} = (-1)^(m-n) d^l_mn: two passes serve the pair +-n, one pass n = 0."""
    assert len(make_runs((-2, 0, 2))) == 3
    assert len(make_runs((-3, -1, 1, 3))) == 4


@pytest.mark.parametrize("orders", ORDERS)
@pytest.mark.parametrize("is_symmetric", [False, True])
@pytest.mark.parametrize("maps", [2, 3, 4])
def test_maps_of_a_batch_are_those_of_single_ones(maps, is_symmetric, orders):
    """Values shared by all maps, an odd number of series too.

    Sums over degrees have the same order and so the same bits; sums over rings add up lanes before
    blocks or after them, by the number of series.
    """
    bandlimit = 40 if not IS_UNCOMPILED else 7
    engine = RingEngine(bandlimit, np.linspace(0, np.pi / 2, 9), symmetric=is_symmetric)
    rings = 17 if is_symmetric else 9
    _, weights, mixing = problem(bandlimit, orders)
    sums = OrderSums(orders, weights, lowest=3)
    flm = random_complex(maps, 1, bandlimit**2, seed=5)
    columns = np.full((maps, len(orders), 2 * bandlimit - 1, rings), np.nan, dtype=complex)
    engine.fill_columns(flm, sums, mixing, columns)
    noise, out = random_like(columns, seed=6), random_like(flm, seed=7)
    singles = out.copy()
    engine.add_to_harmonics(noise, sums, out)
    for i in range(maps):
        assert np.array_equal(columns[i], fill(engine, flm[i], sums, mixing, rings))
        engine.add_to_harmonics(noise[i], sums, singles[i])
    assert_close(out, singles, ulps=16)
