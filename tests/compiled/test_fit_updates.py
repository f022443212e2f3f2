"""The passes of a fit are what array expressions say, whatever ranges they are split in."""

import numpy as np
import pytest

from spinsdw.harmonics import conjugate_field, multiply_by_degree
from spinsdw.separation.stacks import SplitFilter, Stacks
from tests.helpers import assert_close, random_flm, random_like

SIZES = [1, 7, 8, 2**15 - 1, 2**15 + 9]


def rows(size, seed):
    return random_like(np.zeros((3, size), complex), seed=seed)


@pytest.mark.parametrize("size", SIZES)
def test_sums(size):
    """sum w |v|^2 and Re <u, v> of each row"""
    left, right = rows(size, 1), rows(size, 2)
    weights = np.abs(left[0])
    found = Stacks(1).weighted_power(weights, right)
    assert_close(found, np.sum(weights * np.abs(right) ** 2, axis=1), ulps=4 * np.sqrt(size) + 8)
    expected = [np.vdot(one, other).real for one, other in zip(left, right, strict=True)]
    scale = np.sum(np.abs(left) * np.abs(right), axis=1).max()
    found = Stacks(1).product(left, right)
    assert np.max(np.abs(found - expected)) <= 16 * np.finfo(float).eps * scale


@pytest.mark.parametrize("size", SIZES)
def test_updates(size):
    """r - a w v and a u + b v"""
    values, out = rows(size, 3), rows(size, 4)
    weights, factors = np.abs(values[1]), np.array([0.5, 0.0, -2.0])
    found = out.copy()
    Stacks(1).subtract(factors, weights, values, found)
    assert_close(found, out - factors[:, None] * weights * values, ulps=4)
    found = out.copy()
    Stacks(1).add(factors, factors + 1, values, found)
    assert_close(found, factors[:, None] * out + (factors + 1)[:, None] * values, ulps=4)


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("bandlimit", [1, 2, 3, 20])
def test_split_filter(bandlimit, threads):
    """(e + b) / 2 p_lm + (e - b) / 2 (-1)^m p*_{l,-m}"""
    e, b = np.random.default_rng(0).random((2, bandlimit))
    plm = np.array([random_flm(bandlimit, seed=seed) for seed in (1, 2)])
    expected = multiply_by_degree(plm, (e + b) / 2)
    expected = expected + multiply_by_degree(conjugate_field(plm), (e - b) / 2)
    assert_close(SplitFilter(e, b, threads)(plm), expected, ulps=4)
    assert_close(SplitFilter(e, b, threads)(plm[0]), expected[0], ulps=4)


def test_threads_change_no_bit():
    values, weights = rows(100_000, 5), np.abs(rows(100_000, 6)[0])
    one, other = (Stacks(threads).weighted_power(weights, values) for threads in (1, 4))
    assert np.array_equal(one, other)
