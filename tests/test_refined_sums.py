"""The quadrature on refined rings is that of the grid's own rings, and its adjoint."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.refined_sums import RefinedSums
from spinsdw.ring_engine import OrderSums, RingEngine
from spinsdw.sampling import MW, MWSS
from tests.helpers import EPS, IS_UNCOMPILED, assert_close, random_like

ORDERS = [(0,), (-2,), (3, -1), (-2, 0, 2)]
BANDLIMIT = 40 if not IS_UNCOMPILED else 18


def random_columns(grid, maps, outputs, real):
    n_m = grid.bandlimit if real else grid.n_phi
    return random_like(np.empty((maps, outputs, n_m, grid.n_rings), dtype=complex), seed=2)


def make_sums(orders, real, bandlimit=BANDLIMIT):
    weights = random_like(np.empty((len(orders), bandlimit), dtype=complex), seed=3)
    weights *= np.arange(bandlimit) >= np.abs(orders)[:, None]
    return OrderSums(orders, weights, 0, 1 if real else 2, 1)


def tolerance(bandlimit=BANDLIMIT):
    return 8 * bandlimit**1.5 + 64


@pytest.mark.parametrize("orders", ORDERS)
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("bandlimit", [BANDLIMIT, BANDLIMIT - 1])
def test_integrals_are_those_of_the_quadrature_on_the_grid(bandlimit, real, orders):
    """sum over refined rings = weigh_columns and the sum over the grid's rings, for any columns."""
    grid, sums = MW(bandlimit), make_sums(orders, real, bandlimit)
    mixing = random_like(np.empty((2, len(orders)), dtype=complex), seed=4)
    columns = random_columns(grid, 2, max(mixing.shape), real)
    found = np.zeros((2, 1, bandlimit**2), dtype=complex)
    RefinedSums(grid, orders, mixing, real, 1).add_to_harmonics(columns, sums, found)
    desired = np.zeros_like(found)
    for one in columns:
        grid.weigh_columns(one, orders, mixing=mixing.conj().T.copy(), threads=1)
    RingEngine(bandlimit, grid.colatitudes).add_to_harmonics(columns, sums, desired)
    assert_close(found, desired, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("orders", ORDERS)
@pytest.mark.parametrize("real", [False, True])
def test_filling_is_the_adjoint_of_integrating(real, orders):
    """<columns, fill(flm)> = <add(columns), flm>; weights are conjugated, m < 0 counts if there."""
    grid, sums = MW(BANDLIMIT), make_sums(orders, real)
    mixing = random_like(np.empty((2, len(orders)), dtype=complex), seed=4)
    columns = random_columns(grid, 2, max(mixing.shape), real)
    columns[:, len(mixing) :] = 0.0
    refined = RefinedSums(grid, orders, mixing, real, 1)
    flm = random_like(np.empty((2, 1, BANDLIMIT**2), dtype=complex), seed=5)
    filled = np.full_like(columns, np.nan)
    refined.fill_columns(flm, sums, filled)
    conjugated = OrderSums(orders, sums.weights.conj(), 0, sums.sides, 1)
    added = np.zeros_like(flm)
    refined.add_to_harmonics(columns, conjugated, added)
    left, right = (
        np.vdot(columns[:, : len(mixing)], filled[:, : len(mixing)]),
        np.vdot(added, flm),
    )
    scale = np.linalg.norm(added) * np.linalg.norm(flm)
    assert abs(left - right) <= tolerance() * EPS * scale


@pytest.mark.parametrize("threads", [2, 3])
def test_results_have_the_same_bits_on_any_number_of_threads(threads):
    """Those of a map in a batch are equal but for rounding."""
    grid, orders = MW(BANDLIMIT), (-2, 0, 2)
    sums, mixing = make_sums(orders, False), np.eye(3, dtype=complex)
    columns = random_columns(grid, 3, 3, False)
    results = []
    for count, maps in ((1, columns), (threads, columns), (threads, columns[1:2])):
        out = np.zeros((len(maps), 1, BANDLIMIT**2), dtype=complex)
        RefinedSums(grid, orders, mixing, False, count).add_to_harmonics(maps, sums, out)
        results.append(out)
    assert np.array_equal(results[0], results[1])
    assert_close(results[0][1:2], results[2], ulps=16)


@pytest.mark.parametrize("grid", [MW(9), MW(10), MWSS(9), MWSS(10)])
def test_refined_columns_hold_the_values_between_rings(grid):
    """Of cos(theta)^k and sin(theta) cos(theta)^k: even and odd in theta, with the weights."""
    refinement, theta = grid.refinement, grid.refinement.colatitudes
    columns = np.zeros((1, grid.n_phi, grid.n_rings), dtype=complex)
    columns[0, 0] = np.cos(grid.colatitudes) ** 3
    columns[0, 1] = np.sin(grid.colatitudes) * np.cos(grid.colatitudes) ** 2
    span, identity = range(2), np.ones((1, 1), dtype=complex)
    fine = np.zeros((1, 4, theta.size), dtype=complex)
    refinement.refine(columns, (0,), identity, span, fine)
    ones = np.zeros_like(fine)
    columns[0, 0] = 1.0
    refinement.refine(columns, (0,), identity, span, ones)
    assert_close(fine[0, 0], ones[0, 0] * np.cos(theta) ** 3, ulps=64)
    assert_close(fine[0, 1], ones[0, 0] * np.sin(theta) * np.cos(theta) ** 2, ulps=64)
