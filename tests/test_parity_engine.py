"""The laws of the sums over degree by parity: several orders, mirrored rings and single ones."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.parity_engine import ParityEngine, interleaved_rings, mirrored_rings
from spinsdw.ring_engine import OrderSums, RingEngine
from spinsdw.sampling import MW, HealpixRings
from tests.helpers import (
    EPS,
    IS_UNCOMPILED,
    assert_close,
    direct_columns,
    needs_compiler,
    random_flm,
    random_like,
)

ORDERS = [(0,), (1,), (-1,), (-2,), (-4, 3), (0, -2, 2), (8, 0), (-9,)]
# A pole, rings next to it and to the equator, and the equator.
NORTH = np.array([0.0, 1e-6, 0.01, 0.1, 0.2, 0.3, 0.5, 0.9, 1.2, 1.5, np.pi / 2 - 1e-4, np.pi / 2])
EVERY = np.concatenate([NORTH, np.pi - NORTH[-2::-1]])
NO_EQUATOR = np.concatenate([NORTH[:-1], np.pi - NORTH[-2::-1]])
# No ring mirrors another, as on the McEwen-Wiaux grid.
SINGLE = np.concatenate([NORTH[::2], np.pi - NORTH[1::2][::-1]])
GRIDS = {"equator": EVERY, "no equator": NO_EQUATOR, "single": SINGLE}


def tolerance(bandlimit):
    """Ulps of a sum over degree: an error made k degrees ago is k times as large at the equator."""
    return 8 * bandlimit**1.5 + 64


def make_engine(bandlimit, grid, orders, **options):
    half = (interleaved_rings if grid == "single" else mirrored_rings)(GRIDS[grid])
    return ParityEngine(bandlimit, half, orders, **options)


def make_sums(bandlimit, orders, sides=2, threads=1, lowest=0):
    """Weights that make the sum of each order n a synthesis of spin -n."""
    el = np.arange(bandlimit)
    weights = [
        (-1.0) ** n * np.sqrt((2 * el + 1) / (4 * np.pi)) * (el >= max(abs(n), lowest))
        for n in orders
    ]
    return OrderSums(orders, np.array(weights, dtype=complex), lowest, sides, threads)


def random_batch(bandlimit, maps=2, sources=1):
    rows = [random_flm(bandlimit, seed=i) for i in range(maps * sources)]
    return np.stack(rows).reshape(maps, sources, -1)


def fill(engine, flm, sums, mixing=None):
    mixing = np.eye(len(sums.orders), dtype=complex) if mixing is None else mixing
    n_m = engine.bandlimit if sums.sides == 1 else 2 * engine.bandlimit - 1
    # What is not filled must be none of a result's.
    columns = np.full((len(flm), len(mixing), n_m, engine_rings(engine)), np.nan + 0j)
    engine.fill_columns(flm, sums, mixing, columns)
    return columns


def engine_rings(engine):
    return int(max(engine.half.places.max(), engine.half.mirrors.max(initial=0))) + 1


def desired_columns(flm, orders, colatitudes):
    """Columns [map, order, m, ring] by direct sums; flm: (maps, 1 or orders, L*L)."""
    bandlimit = int(np.sqrt(flm.shape[-1]))
    given = np.broadcast_to(flm, (len(flm), len(orders), flm.shape[-1]))
    rows = [
        [
            np.roll(direct_columns(one, -n, colatitudes).T, 1 - bandlimit, axis=0)
            for one, n in zip(several, orders, strict=True)
        ]
        for several in given
    ]
    return np.array(rows)


@pytest.mark.parametrize("orders", ORDERS)
@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("bandlimit", [1, 2, 3, 10, 11] if not IS_UNCOMPILED else [3, 10])
def test_columns_are_the_sums_over_degree(bandlimit, grid, orders):
    """F_m(theta) = sum_l weight_l f_lm d^l_mn(theta) on every ring, for each of a batch."""
    flm = random_batch(bandlimit)
    found = fill(make_engine(bandlimit, grid, orders), flm, make_sums(bandlimit, orders))
    assert_close(found, desired_columns(flm, orders, GRIDS[grid]), ulps=tolerance(bandlimit))


@pytest.mark.parametrize("grid", GRIDS)
def test_every_order_may_have_its_own_coefficients_and_outputs_mix_them(grid):
    bandlimit, orders = 12, (0, -2, 2)
    flm = random_batch(bandlimit, sources=len(orders))
    mixing = random_like(np.empty((2, 3), dtype=complex), seed=3)
    found = fill(make_engine(bandlimit, grid, orders), flm, make_sums(bandlimit, orders), mixing)
    desired = desired_columns(flm, orders, GRIDS[grid])
    desired = np.einsum("ki,bimr->bkmr", mixing, desired)
    assert_close(found, desired, ulps=4 * tolerance(bandlimit))


def test_degrees_below_the_lowest_are_skipped():
    """The weights there are zero: sums with and without the hint agree."""
    bandlimit, orders, lowest = 80 if not IS_UNCOMPILED else 40, (-3, 1), 33
    engine, flm = make_engine(bandlimit, "single", orders), random_batch(bandlimit)
    weights = make_sums(bandlimit, orders, lowest=lowest).weights
    found, desired = (fill(engine, flm, OrderSums(orders, weights, given)) for given in (lowest, 0))
    assert_close(found, desired, ulps=tolerance(bandlimit))
    noise, results = random_like(found, seed=4), []
    for given in (lowest, 0):
        out = np.zeros_like(flm)
        engine.add_to_harmonics(noise, OrderSums(orders, weights, given), out)
        results.append(out)
    assert_close(*results, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("orders", ORDERS)
@pytest.mark.parametrize("sides", [1, 2])
@pytest.mark.parametrize("grid", GRIDS)
def test_the_other_direction_is_the_adjoint(grid, orders, sides):
    """<F f, g> = <f, F* g>; it adds to its output."""
    bandlimit = 12
    engine, sums = make_engine(bandlimit, grid, orders), make_sums(bandlimit, orders, sides)
    flm = random_batch(bandlimit)
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


@pytest.mark.parametrize("sides", [1, 2])
def test_rows_of_a_few_orders_are_those_of_all(sides):
    """Orders 16 <= m < 25 alone, m in row m - 16 and -m counted from the last row."""
    bandlimit, orders, span = 30 if not IS_UNCOMPILED else 26, (2, -2), range(16, 25)
    engine, sums = make_engine(bandlimit, "equator", orders), make_sums(bandlimit, orders, sides)
    flm, identity = random_batch(bandlimit), np.eye(2, dtype=complex)
    every = fill(engine, flm, sums)
    rows = len(span) * sides
    places = (span.start, rows - 1 + span.start)
    found = np.full((len(flm), 2, rows, engine_rings(engine)), np.nan + 0j)
    engine.filling(flm, sums, identity, found, places)(span.start, span.stop)
    chosen = [*span, *(every.shape[2] - m for m in reversed(span))][:rows]
    assert np.array_equal(found, every[:, :, chosen])
    only = np.zeros_like(every)
    only[:, :, chosen] = random_like(found, seed=6)
    desired, out = np.zeros_like(flm), np.zeros_like(flm)
    engine.add_to_harmonics(only, sums, desired)
    few = np.ascontiguousarray(only[:, :, chosen])
    engine.adding(few, sums, out, places)(span.start, span.stop)
    assert_close(out, desired, ulps=4)


@needs_compiler
@pytest.mark.parametrize("orders", [(0,), (-2,), (1,), (5,), (-8,), (-2, 0, 2)])
@pytest.mark.parametrize(
    ("grid", "bandlimit"),
    [
        (HealpixRings(64), 129),
        (HealpixRings(60), 150),
        (HealpixRings(256), 513),
        (MW(129), 129),
        (MW(512), 512),
    ],
)
def test_parities_lose_nothing_against_the_general_sums(orders, grid, bandlimit):
    """The same sums by d^l_mn itself: m close to l, rings next to a pole and to the equator."""
    is_single = isinstance(grid, MW)
    half = (interleaved_rings if is_single else mirrored_rings)(grid.colatitudes)
    sums, flm = make_sums(bandlimit, orders), random_flm(bandlimit)[None, None]
    engine = ParityEngine(bandlimit, half, orders)
    found = fill(engine, flm, sums)
    desired = np.empty_like(found)
    rings = grid.colatitudes if is_single else half.colatitudes
    general = RingEngine(bandlimit, rings, symmetric=not is_single)
    general.fill_columns(flm, sums, np.eye(len(orders), dtype=complex), desired)
    # Next to a pole an error made k degrees ago is k times as large.
    assert_close(found, desired, ulps=bandlimit**1.5)
    noise = random_like(found)
    results = []
    for one in (engine, general):
        out = np.zeros_like(flm)
        one.add_to_harmonics(noise, sums, out)
        results.append(out)
    assert_close(*results, ulps=bandlimit**1.5)


def test_columns_that_do_not_matter_may_be_left_alone():
    """They are zero or, without ``clears``, what they were or zero; `limits` tells which."""
    bandlimit = 64 if not IS_UNCOMPILED else 24
    flm, sums = random_batch(bandlimit, 1), make_sums(bandlimit, (0,))
    cleared, kept = (
        fill(make_engine(bandlimit, "equator", (0,), clears=clears), flm, sums)[0, 0]
        for clears in (True, False)
    )
    limits = make_engine(bandlimit, "equator", (0,)).limits
    m = np.minimum(np.arange(len(kept)), len(kept) - np.arange(len(kept)))
    matters = m[:, None] < np.concatenate([limits, limits[-2::-1]])
    assert np.all(cleared[~matters] == 0.0)
    assert np.all(np.isnan(kept[~matters]) | (kept[~matters] == 0.0))
    assert np.isnan(kept).any()
    assert np.array_equal(kept[matters], cleared[matters])


@pytest.mark.parametrize("orders", [(0,), (-2,), (-2, 0, 2)])
@pytest.mark.parametrize("grid", ["equator", "single"])
def test_columns_have_the_same_bits_on_any_number_of_threads_and_in_any_batch(grid, orders):
    bandlimit = 40 if not IS_UNCOMPILED else 18
    engine = make_engine(bandlimit, grid, orders)
    flm = random_batch(bandlimit, 3)
    desired = fill(engine, flm, make_sums(bandlimit, orders))
    noise = random_like(desired)
    sums_of = []
    for threads in (1, 2, 5):
        sums = make_sums(bandlimit, orders, threads=threads)
        assert np.array_equal(fill(engine, flm, sums), desired)
        out = np.zeros_like(flm)
        engine.add_to_harmonics(noise, sums, out)
        sums_of.append(out)
    assert all(np.array_equal(one, sums_of[0]) for one in sums_of)
    for i in range(3):
        single = fill(engine, flm[i : i + 1], make_sums(bandlimit, orders))
        assert np.array_equal(single[0], desired[i])


@needs_compiler
@pytest.mark.parametrize("order", [0, -2])
def test_places_beyond_the_last_ring_stay_within_range_at_high_degree(order):
    """<F f, g> = <f, F* g> on a few rings: a place to spare grew to infinity, and 0 * inf is NaN

    At L = 1024 it did not yet, and at L = 2048 it did from degree 1467 on.
    """
    bandlimit, north = 2048, np.pi / 2 - np.array([0.3, 0.02, 0.01, 0.0])
    half = mirrored_rings(np.concatenate([north, np.pi - north[-2::-1]]))
    engine, sums = ParityEngine(bandlimit, half, (order,)), make_sums(bandlimit, (order,), sides=1)
    flm = random_flm(bandlimit, order)[None, None]
    columns = fill(engine, flm, sums)
    noise = random_like(columns, seed=1)
    found = np.zeros_like(flm)
    engine.add_to_harmonics(noise, sums, found)
    assert np.isfinite(found).all()
    scale = np.linalg.norm(columns) * np.linalg.norm(noise)
    difference = np.vdot(columns, noise) - np.vdot(flm, found)
    assert abs(difference) <= tolerance(bandlimit) * EPS * scale
