"""The way from order n to order 0, and the recursion of both parities, against slow sums."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.compiled.legendre_recursion import (
    fill_lowering,
    fill_parity_recursion,
    lower_order,
    raise_order,
)
from spinsdw.parity_engine import _lowering_table
from tests.helpers import assert_close, small_d

THETA = np.array([0.3, 1.1, 1.5, 2.5])


def series(size, first, stop, seed=0):
    """Draw (real and imaginary part, l), zero outside first <= l < stop."""
    values = np.zeros((2, size))
    values[:, first:stop] = np.random.default_rng(seed).standard_normal((2, stop - first))
    return values


def values_of(parts, m, n, first, stop):
    """sum_l c_l d^l_mn(theta), first <= l < stop."""
    c = parts[0] + 1j * parts[1]
    return sum(c[el] * small_d(el, n, THETA)[:, m + el] for el in range(first, stop))


@pytest.mark.parametrize("n", [1, 2, -1, -2, 3, -5])
@pytest.mark.parametrize("m", [0, 1, 2, 4, 7])
def test_a_product_with_the_sine_lowers_the_order(m, n):
    """sin(theta) sum_l c_l d^l_mn = sum_l c'_l d^l_m,n-+1, one degree more; raising transposes."""
    stop, size, sign = 9, 14, float(np.sign(n))
    factors = np.full((3, size), np.nan)
    fill_lowering(m, abs(n), stop, _lowering_table(abs(n), size), factors)
    lowered = np.full((2, size), np.nan)
    given = series(size, max(m, abs(n)), stop)
    lower_order(m, sign, stop, factors, given, lowered)
    first = max(m, abs(n) - 1)
    left = np.sin(THETA) * values_of(given, m, n, max(m, abs(n)), stop)
    right = values_of(lowered, m, n - int(sign), first, stop + 1)
    assert_close(right, left, ulps=256)
    other = series(size, first, stop + 1, seed=1)
    raised = np.full((2, size), np.nan)
    raise_order(m, sign, stop, factors, other, raised)
    kept = slice(max(m, abs(n)), stop)
    forward = np.sum(lowered[:, first : stop + 1] * other[:, first : stop + 1])
    assert_close(np.sum(given[:, kept] * raised[:, kept]), forward, ulps=256)


@pytest.mark.parametrize("m", [0, 1, 2, 5])
def test_the_functions_of_even_steps_give_both_parities(m):
    """p_{m+2k+1} = x r_k and p_{m+2k} = e_{m+2k+1} r_k + e_{m+2k} r_{k-1}."""
    count = 6
    ratios, a, b, shifted, scale = (np.empty(m + 2 * count + 4) for _ in range(5))
    fill_parity_recursion(m, count, ratios, a, b, shifted, scale)
    x = np.cos(THETA)

    def p(el):
        return np.sqrt(2 * el + 1) * small_d(el, 0, THETA)[:, m + el]

    before, now = np.zeros_like(x), p(m + 1) / x
    previous = np.zeros_like(x)
    for k in range(count):
        r = scale[k] * now
        assert_close(x * r, p(m + 2 * k + 1), ulps=4096)
        assert_close(ratios[2 * k + 1] * r + ratios[2 * k] * previous, p(m + 2 * k), ulps=4096)
        previous = r
        factor = a[k] * x**2 + b[k]
        assert_close(-a[k] * np.sin(THETA) ** 2 + shifted[k], factor, ulps=64)
        before, now = now, factor * now - before
