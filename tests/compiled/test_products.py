"""Values made once and multiplied with many columns, against the plain loops that define them."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from spinsdw.compiled import products, vectors
from spinsdw.compiled.products import QUARTET
from tests.helpers import assert_close, needs_compiler

# doubles in a vector, vectors of rings: what each kind of processor uses, and one vector alone.
SHAPES = [(2, 2), (4, 2), (8, 4), (2, 1)]
RANGES = [(0, 0), (0, 1), (3, 8), (1, 16)]
BASE, DEGREES = 2, 40


def compiled(tile):
    """Return a function that calls a tile of products, which only compiled code can."""

    @numba.njit
    def call(c, values, sums, base, pairs, place, one, other, stride):
        tile(c, values, sums, base, pairs, place, one, other, stride)

    return call


def draw(*shape, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, shape)


@needs_compiler
@pytest.mark.parametrize(("width", "count"), SHAPES)
def test_values_are_those_of_the_plain_recursion(width, count):
    """values[l - base, r] = mask[r] u_l(x_r), and the recursion moved on."""
    rings = width * count
    tile = products._make_values_tile(count, width)

    @numba.njit
    def compiled_tile(a, b, work, values, base, first, pairs):
        tile(a, b, work, values, base, first, pairs)

    plain = products._make_plain_values_tile(rings)
    a, b, work = 1 + 0.5 * draw(DEGREES), 0.3 * draw(DEGREES, seed=1), draw(5 * rings, seed=2)
    work[4 * rings :] = work[4 * rings :] > 0
    for first, pairs in RANGES:
        results = []
        for call in (compiled_tile, plain):
            moved, values = work.copy(), draw(DEGREES * rings, seed=3)
            call(a, b, moved, values, min(BASE, first), first, pairs)
            results.append((moved, values))
        for found, desired in zip(*results, strict=True):
            assert_close(found, desired, ulps=32 * pairs + 16)


def quartets(rings, seed=0):
    """Draw coefficients, values and rows, with room around what a call may touch."""
    stride = rings + 3
    c = draw(2, QUARTET * DEGREES, seed=seed)
    return c, draw(DEGREES * rings, seed=seed + 1), draw(6, stride, seed=seed + 2), stride


@needs_compiler
@pytest.mark.parametrize(("width", "count"), SHAPES)
def test_products_with_rings_are_the_plain_ones(width, count):
    """Rows of sums, wherever they begin, gain sum_l c[l, k] values[l, r]."""
    rings = width * count
    tile = compiled(products._make_ring_products(count, width))
    plain = products._make_plain_ring_products(rings)
    c, values, rows, stride = quartets(rings)
    for first, pairs in RANGES:
        where = (first, pairs, c.shape[1], 2, 3 * stride + 1, stride)
        results = []
        for call in (tile, plain):
            sums = rows.copy()
            call(c, values, sums, *where)
            results.append(sums)
        assert_close(*results, ulps=32 * pairs + 16)


@needs_compiler
@pytest.mark.parametrize(("width", "count"), SHAPES)
def test_products_with_degrees_are_the_plain_ones(width, count):
    """The sums of a degree, wherever they begin, gain sum_r g[k, r] values[l, r]; others do not."""
    rings = width * count
    tile = compiled(products._make_degree_products(count, width))
    plain = products._make_plain_degree_products(rings)
    _, values, rows, stride = quartets(rings)
    given = draw(2, QUARTET * DEGREES, seed=5)
    for first, pairs in RANGES:
        where = (first, pairs, given.shape[1], 2, 3 * stride + 1, stride)
        results = []
        for call in (tile, plain):
            sums = given.copy()
            call(rows, values, sums, *where)
            results.append(sums)
        assert_close(*results, ulps=64)
        assert np.count_nonzero(results[0] - given) == 2 * pairs * QUARTET


def test_plain_products_are_those_of_one_tile():
    """Values made once and multiplied with a quartet: what a tile of four columns adds."""
    rings, pairs = 4, 10
    a, b, work = 1 + 0.5 * draw(DEGREES), 0.3 * draw(DEGREES, seed=1), draw(5 * rings, seed=2)
    work[4 * rings :] = 1.0
    before, now, x = (work[i * rings : (i + 1) * rings].copy() for i in (0, 1, 3))
    c, values, rows, _ = quartets(rings)
    desired = rows[:4, :rings].copy().ravel()
    vectors._make_plain_ring_tile(rings, QUARTET)(a, b, c[0], x, before, now, desired, 0, pairs)
    products._make_plain_values_tile(rings)(a, b, work, values, 0, 0, pairs)
    sums = np.ascontiguousarray(rows[:4, :rings])
    products._make_plain_ring_products(rings)(c, values, sums, 0, pairs, 0, 0, 2 * rings, rings)
    assert np.array_equal(sums.ravel(), desired)
    assert np.array_equal(work[: 2 * rings], np.concatenate([before, now]))


@pytest.mark.parametrize("seed", [0, 1])
def test_the_two_plain_products_are_adjoint(seed):
    """<sum_l c u, g> over rings = <c, sum_r g u> over degrees."""
    rings, pairs = 8, 20
    c, values, _, _ = quartets(rings, seed=seed)
    g = draw(QUARTET, rings, seed=seed + 7)
    over_degrees = np.zeros((QUARTET, rings))
    where = (0, pairs, 0, 0, 2 * rings, rings)
    products._make_plain_ring_products(rings)(c, values, over_degrees, *where)
    over_rings = np.zeros(DEGREES * QUARTET)
    products._make_plain_degree_products(rings)(g, values, over_rings, *where)
    left = np.vdot(over_degrees, g)
    right = np.vdot(c[0], over_rings)
    assert abs(left - right) <= 1e-14 * np.linalg.norm(over_degrees) * np.linalg.norm(g)
