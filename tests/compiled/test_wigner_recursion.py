"""The recursion of the Wigner functions in degree, against exact sums and closed forms."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from spinsdw.compiled.wigner_recursion import (
    PADDING,
    fill_powers,
    fill_recursion,
    fill_start,
    prepare_start,
    rescale,
    start_norm,
)
from tests.helpers import EPS, exact_small_d, small_d

PAIRS = [(0, 0), (1, 0), (0, 2), (2, 2), (2, -2), (1, -3), (3, 1), (5, 4), (0, -6), (7, -7)]
# Cosines whose sine is a fraction too.
COSINES = [Fraction(3, 5), Fraction(-4, 5), Fraction(15, 17), Fraction(0), Fraction(-40, 41)]


def roots_and_inverses(bandlimit):
    numbers = np.arange(2.0 * bandlimit + 2)
    return np.sqrt(numbers), np.divide(1.0, numbers, out=np.zeros_like(numbers), where=numbers > 0)


def central_binomials(bandlimit):
    """binom(2M, M) / 4^M, exact to one rounding."""
    return np.array([float(Fraction(math.comb(2 * M, M), 4**M)) for M in range(bandlimit + 1)])


def run(bandlimit, m, n, cosine):
    """Return (d, exponent): d 2^exponent = d^l_mn for l = max(m, |n|) .. L - 1, and the first l."""
    sine, plus, minus = math.sqrt(1 - cosine**2), float(1 + cosine), float(1 - cosine)
    a, b, scale = (np.empty(bandlimit + 1) for _ in range(3))
    fill_recursion(m, n, bandlimit, *roots_and_inverses(bandlimit), a, b, scale)
    ring = {key: np.empty(1) for key in ("s", "s_power", "o", "o_power", "before", "now", "exp")}
    fill_powers(np.array([sine]), abs(m - abs(n)), ring["s"], ring["s_power"])
    one = np.array([plus if n >= 0 else minus])
    fill_powers(one, min(m, abs(n)), ring["o"], ring["o_power"])
    first, other = max(m, abs(n)), n if m >= abs(n) else m
    norm, norm_power = start_norm(first, other, central_binomials(bandlimit))
    powers = np.stack([ring[key] for key in ("s", "s_power", "o", "o_power")])
    state = (ring["before"], ring["now"], ring["exp"], np.empty(1))
    inside = fill_start(norm, norm_power, powers, 0, *state)
    assert inside == (ring["exp"][0] == 0.0)
    # The closed form's sign: (-1)^(m-n) where m leads, else (-1)^(|n|-m) for negative n.
    is_odd = (m - n) % 2 if m >= abs(n) else (abs(n) - m) % 2 * (n < 0)
    values, exponents = [], []
    for el in range(first, bandlimit):
        values.append((-1) ** is_odd * ring["now"][0] * scale[el])
        exponents.append(800 * ring["exp"][0])
        # As the callers do: cos - 1 and cos + 1 are exact near the poles, cos is not.
        factor = b[el] + a[el] - a[el] * minus if cosine > 0 else b[el] - a[el] + a[el] * plus
        after = factor * ring["now"] - ring["before"]
        ring["before"], ring["now"] = ring["now"], after
        rescale(ring["before"], ring["now"], ring["exp"])
    return np.array(values), np.array(exponents), first


@pytest.mark.parametrize("cosine", COSINES)
@pytest.mark.parametrize(("m", "n"), PAIRS)
def test_direct_sums_by_diagonalising_are_wigners_exact_sums(m, n, cosine):
    """The oracle of all other tests: exp(-i theta J_y) against fractions."""
    for el in range(max(m, abs(n)), 14):
        for sign in (1, -1):
            exact = exact_small_d(el, sign * m, n, cosine)
            found = small_d(el, n, np.arccos(float(cosine)))[sign * m + el]
            assert abs(found - exact) < 64 * EPS


@pytest.mark.parametrize("cosine", COSINES)
@pytest.mark.parametrize(("m", "n"), PAIRS)
def test_recursion_gives_the_exact_values(m, n, cosine):
    """d^l_mn from its start M = max(m, |n|) upwards, sign included."""
    values, exponents, first = run(40, m, n, cosine)
    assert not np.any(exponents)
    exact = [exact_small_d(el, m, n, cosine) for el in range(first, 40)]
    # A rounding of each of l steps, with sin(theta) between it and the result.
    np.testing.assert_allclose(values, exact, rtol=0, atol=40 * EPS / math.sqrt(1 - cosine**2))


@pytest.mark.parametrize(("m", "n"), [(150, 0), (150, 2), (100, -90), (3, 120)])
def test_values_out_of_range_come_back_into_it(m, n):
    """Close to a pole sin(theta)^m starts below 2^-300 and grows with l, exactly."""
    cosine = Fraction(9999, 10001)
    values, exponents, first = run(220, m, n, cosine)
    assert exponents[0] < 0
    for el in range(first, 220, 23):
        exact = exact_small_d(el, m, n, cosine)
        found = math.ldexp(values[el - first], int(exponents[el - first]))
        # Relative: a rounding of sin(theta) and of each step, to the power of m.
        assert abs(found - exact) <= 8 * (el + m) * EPS * abs(exact)


@pytest.mark.parametrize("el", [1000, 4095, 20000])
@pytest.mark.parametrize("n", [0, 2, -8])
@pytest.mark.parametrize("theta", [1e-8, 1e-3, 0.1, 1.0])
def test_start_is_right_far_below_the_range_of_floats(el, n, theta):
    """d^l_ln = sqrt(binom(2l, l+n)) cos(theta/2)^(l+n) sin(theta/2)^(l-n), in logarithms."""
    outs = [np.empty(1) for _ in range(4)]
    fill_powers(np.array([math.sin(theta)]), el - abs(n), *outs[:2])
    one = 2 * math.cos(theta / 2) ** 2 if n >= 0 else 2 * math.sin(theta / 2) ** 2
    fill_powers(np.array([one]), abs(n), *outs[2:])
    index = np.arange(1, el + 1)
    central = np.concatenate([[1.0], np.cumprod((2 * index - 1) / (2 * index))])
    before, now, scale, power = (np.empty(1) for _ in range(4))
    powers = np.stack(outs)
    fill_start(*start_norm(el, n, central), powers, 0, before, now, scale, power)
    found = math.log2(now[0]) + 800 * scale[0]
    binomial = math.lgamma(2 * el + 1) - math.lgamma(el + n + 1) - math.lgamma(el - n + 1)
    half = theta / 2
    desired = (
        binomial / 2 + (el + n) * math.log(math.cos(half)) + (el - n) * math.log(math.sin(half))
    )
    # Logarithms lose as many digits as they have before the point, and gammas those of l log l.
    assert abs(found - desired / math.log(2)) <= 8 * EPS * el * math.log(el) * -math.log(half / 2)
    # A normal number with room to grow; out of range only if too small to count.
    assert 2.0**-930 <= now[0] < 2.0**640
    assert scale[0] <= 0
    assert scale[0] == 0 or found < -160
    assert before[0] == 0


@pytest.mark.parametrize("exponent", [0, 1, 2, 3, 63, 64, 1000, 2047, 4095])
@pytest.mark.parametrize("base", [1e-60, 1e-8, 0.1, 0.999, 1.0, 1.5, 2.0])
def test_powers_are_exact_to_the_roundings_of_their_squarings(base, exponent):
    """mantissa 2^power = base^exponent, far beyond the range of floats on either side."""
    mantissa, power = np.empty(1), np.empty(1)
    fill_powers(np.array([base]), exponent, mantissa, power)
    assert 2.0**-256 <= mantissa[0] <= 2.0**256
    ratio = Fraction(mantissa[0]) * Fraction(2) ** int(power[0]) / Fraction(base) ** exponent
    assert abs(float(ratio) - 1) <= 2 * max(exponent, 1) * EPS


def test_powers_of_zero_are_zero_but_for_the_first():
    """0^0 = 1."""
    mantissa, power = np.empty(1), np.empty(1)
    for exponent, desired in ((0, 1.0), (1, 0.0), (5000, 0.0)):
        fill_powers(np.zeros(1), exponent, mantissa, power)
        assert mantissa[0] == desired


@pytest.mark.parametrize("n", [0, 2, -3, 40])
@pytest.mark.parametrize("theta", [1e-3, 0.1, 0.7, 1.5, 3.1])
def test_start_is_carried_from_order_to_order(n, theta):
    """d^m_mn carried over 300 orders m is d^m_mn made anew, exponents included."""
    rings = tuple(np.array([f]) for f in (np.sin(theta), 1 + np.cos(theta), 1 - np.cos(theta)))
    central = central_binomials(400)
    powers, carried, anew = np.empty((6, 1)), np.empty((2, 1)), np.empty((2, 1))
    first = abs(n) + 1
    for m in range(first, first + 300):
        prepare_start(m, n, m == first, central, rings, 0, 1, powers, carried)
        prepare_start(m, n, True, central, rings, 0, 1, powers, anew)
        shift = 800 * (carried[1, 0] - anew[1, 0])
        assert abs(carried[0, 0] * 2.0**shift / anew[0, 0] - 1) <= 4 * m * EPS
        # Whoever is out of range is too small to count, and has room to grow.
        size = abs(carried[0, 0])
        assert size < 2.0**640 if carried[1, 0] < 0 else size >= 2.0**-160


def test_start_at_a_pole_is_zero_and_in_range():
    rings = tuple(np.array([f]) for f in (0.0, 2.0, 0.0))
    powers, start = np.empty((6, 1)), np.empty((2, 1))
    for m in range(5):
        prepare_start(m, 0, m == 0, central_binomials(5), rings, 0, 1, powers, start)
        assert start[:, 0].tolist() == [1.0 if m == 0 else 0.0, 0.0]


@pytest.mark.parametrize(("M", "K"), [(0, 0), (1, 1), (5, -3), (60, 0), (60, 60), (2000, -1990)])
def test_norm_of_the_start_is_a_binomial(M, K):
    """v 2^e = sqrt(binom(2M, M + K) / 4^M)."""
    value, power = start_norm(M, K, central_binomials(M))
    ratio = Fraction(value) ** 2 * Fraction(2) ** int(2 * power)
    exact = Fraction(math.comb(2 * M, M + K), 4**M)
    assert abs(float(ratio / exact) - 1) <= 4 * (abs(K) + 1) * EPS


def test_a_pole_stays_zero():
    """sin(0)^k = 0 is no small number: no exponent, and it counts as in range."""
    before, now, scale, power = (np.empty(2) for _ in range(4))
    powers = np.stack([np.array([0.0, 0.5]), np.zeros(2), np.ones(2), np.zeros(2)])
    assert fill_start(1.0, 0.0, powers, 0, before, now, scale, power) == 2
    assert now.tolist() == [0.0, 0.5]
    assert scale.tolist() == [0.0, 0.0]
    assert rescale(before, now, scale) == 2


def test_rescaling_brings_a_ring_back_one_step_at_a_time():
    """A ring grown beyond 2^640 has its exponent raised by 800; true values do not change."""
    before = np.array([1.0, 2.0**630, 3.0, 5.0])
    now = np.array([2.0**641, 2.0**650, 2.0**639, 2.0**700])
    scale = np.array([-1.0, -3.0, -2.0, 0.0])
    assert rescale(before, now, scale) == 2
    assert scale.tolist() == [0.0, -2.0, -2.0, 0.0]
    assert now.tolist() == [2.0**-159, 2.0**-150, 2.0**639, 2.0**700]
    assert before.tolist() == [2.0**-800, 2.0**-170, 3.0, 5.0]


def test_values_out_of_range_stay_negligible_between_two_looks():
    """PADDING steps multiply u by less than 2^90, |n| <= 8: from 2^-160 no sum could notice it."""
    bandlimit, worst = 3000, 0.0
    a, b, scale = (np.empty(bandlimit + 1) for _ in range(3))
    for m, n in [(0, 0), (1, 0), (0, 1), (8, 8), (100, 2), (1000, -8), (2900, 0), (2900, 8)]:
        fill_recursion(m, n, bandlimit, *roots_and_inverses(bandlimit), a, b, scale)
        first = max(m, abs(n))
        growth = np.abs(a[first:bandlimit]) + np.abs(b[first:bandlimit]) + 1
        logarithms = np.log2(growth)
        window = np.convolve(logarithms, np.ones(PADDING), mode="valid")
        worst = max(worst, window.max())
    assert worst < 90


@pytest.mark.parametrize(("m", "n"), [(0, 0), (2, 2), (5, -3), (40, 0)])
def test_scales_of_neighbouring_degrees_are_those_of_the_recursion(m, n):
    """scale_{l+1} w_{l+1} = scale_{l-1} w_l, w_l = sqrt((l^2 - m^2)(l^2 - n^2)) / l."""
    bandlimit = 60
    a, b, scale = (np.empty(bandlimit + 1) for _ in range(3))
    fill_recursion(m, n, bandlimit, *roots_and_inverses(bandlimit), a, b, scale)
    first = max(m, abs(n))

    def w(el):
        return math.sqrt((el**2 - m**2) * (el**2 - n**2)) / el

    for el in range(first + 1, bandlimit):
        left, right = scale[el + 1] * w(el + 1), scale[el - 1] * w(el)
        assert abs(left - right) <= 16 * EPS * abs(right)
        slope = (2 * el + 1) * scale[el] / (w(el + 1) * scale[el + 1])
        assert abs(a[el] - slope) <= 16 * EPS * slope
        shift = -slope * m * n / (el * (el + 1))
        assert abs(b[el] - shift) <= 16 * EPS * slope
