"""The laws of coefficient algebra."""

from __future__ import annotations

from math import factorial, prod

import numpy as np
import pytest

from spinsdw import harmonics
from spinsdw.errors import DataError, ParameterError, ShapeError
from tests.helpers import assert_close, random_flm

BANDLIMITS = [1, 2, 3, 9]
SPINS = [-3, -2, -1, 0, 1, 2]


def random_real_field(bandlimit, seed=0):
    flm = random_flm(bandlimit, seed=seed)
    return 0.5 * (flm + harmonics.conjugate_field(flm))


def spin_harmonic(el, m, spin, colatitude, longitude):
    """sYlm = (-1)**s sqrt((2l+1)/4pi) d^l_{m,-s} e^{im phi}, d by Wigner's sum of factorials."""
    n = -spin
    norm = np.sqrt(float(prod(factorial(el + k) for k in (m, -m, n, -n))))
    small_d = 0.0
    for k in range(max(0, n - m), min(el + n, el - m) + 1):
        below = prod(factorial(i) for i in (el + n - k, k, m - n + k, el - m - k))
        cosine = np.cos(colatitude / 2) ** (2 * el + n - m - 2 * k)
        sine = np.sin(colatitude / 2) ** (m - n + 2 * k)
        small_d = small_d + (-1) ** (m - n + k) * cosine * sine / below
    factor = (-1) ** spin * np.sqrt((2 * el + 1) / (4 * np.pi)) * norm
    return factor * small_d * np.exp(1j * m * longitude)


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_index_counts_the_degrees_and_orders(bandlimit):
    """i(l, m) = l**2 + l + m."""
    el, m = harmonics.degrees(bandlimit), harmonics.orders(bandlimit)
    assert np.array_equal(harmonics.index(el, m), np.arange(bandlimit**2))
    assert np.all(np.abs(m) <= el)


@pytest.mark.parametrize(("el", "m"), [(1, 2), (0, -1), ([2, 3], [0, 4]), (-1, 0)])
def test_index_refuses_an_order_above_the_degree(el, m):
    with pytest.raises(ParameterError, match=r"must keep \|m\| <= el"):
        harmonics.index(el, m)


def test_index_refuses_fractions():
    with pytest.raises(ParameterError, match="must be integers"):
        harmonics.index(1.5, 0)


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_bandlimit_is_the_root_of_the_size(bandlimit):
    assert harmonics.bandlimit_of(np.zeros((2, bandlimit**2))) == bandlimit


@pytest.mark.parametrize("shape", [(), (0,), (3,), (4, 5)])
def test_size_that_is_no_square_has_no_bandlimit(shape):
    with pytest.raises(ShapeError, match="must be bandlimit"):
        harmonics.bandlimit_of(np.zeros(shape))


@pytest.mark.parametrize("value", [True, 2.0, "2", None, 0, -1, np.float64(1)])
def test_integer_parameter_takes_integers_alone(value):
    with pytest.raises(ParameterError, match=r"bandlimit=.* must be an integer of at least 1"):
        harmonics.degrees(value)


@pytest.mark.parametrize("dtype", [">c16", "complex64", "float32", "int16", "uint8"])
def test_check_takes_any_numbers_and_any_layout(dtype):
    values = np.arange(32, dtype=dtype).reshape(8, 4)[::2].copy(order="F")
    values.flags.writeable = False
    checked = harmonics.check_flm(values, 2)
    assert checked.dtype == np.complex128
    assert checked.dtype.isnative
    assert checked.flags.c_contiguous
    assert np.array_equal(checked, values)


def test_check_copies_nothing_that_is_right_already():
    flm = random_flm(4)
    assert np.shares_memory(harmonics.check_flm(flm, 4), flm)


@pytest.mark.parametrize(
    ("flm", "error", "message"),
    [
        (np.zeros(5), ShapeError, r"noise has shape \(5,\)"),
        (np.zeros(()), ShapeError, "noise has shape"),
        (["a"] * 4, DataError, "must hold numbers"),
        ([None] * 4, DataError, "must hold numbers"),
        ([True] * 4, DataError, "must hold numbers"),
        ([0, np.nan, 0, 0], DataError, "NaN or infinite"),
        ([0, 0, complex(0, np.inf), 0], DataError, "NaN or infinite"),
        (np.ma.array(np.zeros(4), mask=[0, 1, 0, 0]), DataError, "masked"),
    ],
)
def test_check_names_what_is_wrong(flm, error, message):
    with pytest.raises(error, match=message):
        harmonics.check_flm(flm, 2, "noise")


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_conjugate_field_turns_orders_round(bandlimit):
    """q_lm = (-1)**m conj(f_{l,-m}), an involution."""
    flm = random_flm(bandlimit, batch=(2,))
    conjugate = harmonics.conjugate_field(flm)
    for el in range(bandlimit):
        for m in range(-el, el + 1):
            expected = (-1) ** m * flm[:, harmonics.index(el, -m)].conj()
            assert np.array_equal(conjugate[:, harmonics.index(el, m)], expected)
    assert np.array_equal(harmonics.conjugate_field(conjugate), flm)


def test_conjugate_field_is_the_conjugate_on_the_sphere():
    """sum_lm q_lm Y_lm = conj(sum_lm f_lm Y_lm)."""
    flm, place = random_flm(5), (0.7, 2.1)
    pairs = zip(harmonics.degrees(5), harmonics.orders(5), strict=True)
    columns = np.array([spin_harmonic(int(el), int(m), 0, *place) for el, m in pairs])
    assert_close(harmonics.conjugate_field(flm) @ columns, np.conj(flm @ columns), ulps=256)


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_real_fields_are_told_from_complex_ones(bandlimit):
    real = random_real_field(bandlimit)
    assert harmonics.is_real_field(real)
    assert harmonics.is_real_field(np.zeros(bandlimit**2))
    assert not harmonics.is_real_field(real * np.exp(0.1j))
    assert harmonics.is_real_field(real * np.exp(1e-14j), ulps=1000)


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_splitting_undoes_joining_for_real_fields(bandlimit):
    """E = -(p + q)/2 and B = i(p - q)/2 of P = -(E + iB)."""
    e_lm, b_lm = random_real_field(bandlimit, 1), random_real_field(bandlimit, 2)
    e_back, b_back = harmonics.spin_to_eb(harmonics.eb_to_spin(e_lm, b_lm))
    assert_close(e_back, e_lm, ulps=8)
    assert_close(b_back, b_lm, ulps=8)


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_joining_undoes_splitting_for_any_field(bandlimit):
    p_lm = random_flm(bandlimit, batch=(2, 3))
    e_lm, b_lm = harmonics.spin_to_eb(p_lm)
    assert harmonics.is_real_field(e_lm)
    assert harmonics.is_real_field(b_lm)
    assert_close(harmonics.eb_to_spin(e_lm, b_lm), p_lm, ulps=8)


def test_e_and_b_must_have_one_shape():
    with pytest.raises(ShapeError, match="they must agree"):
        harmonics.eb_to_spin(np.zeros(4), np.zeros(9))


def test_sign_of_e_and_b_is_that_of_healpy():
    """Q + iU = sum_lm -(E_lm + i B_lm) 2Ylm, at every pixel."""
    healpy = pytest.importorskip("healpy")
    bandlimit = 5
    e_lm, b_lm = random_real_field(bandlimit, 3), random_real_field(bandlimit, 4)
    e_lm[:4] = b_lm[:4] = 0
    el, m = healpy.Alm.getlm(bandlimit - 1)
    chosen = harmonics.index(el, m)
    q, u = healpy.alm2map_spin([e_lm[chosen], b_lm[chosen]], 2, 2, bandlimit - 1)
    place = healpy.pix2ang(2, np.arange(48))
    desired = np.zeros(48, dtype=complex)
    p_lm = harmonics.eb_to_spin(e_lm, b_lm)
    for el, m in zip(harmonics.degrees(5)[4:], harmonics.orders(5)[4:], strict=True):
        desired += p_lm[harmonics.index(el, m)] * spin_harmonic(int(el), int(m), 2, *place)
    assert_close(q + 1j * u, desired, ulps=1024)


@pytest.mark.parametrize("bandlimit", [1, 2, 3, 20])
def test_polarisation_factor_is_the_ratio_of_factorials(bandlimit):
    """N_l = sqrt((l+2)!/(l-2)!), zero below 2."""
    exact = [np.sqrt(factorial(el + 2) // factorial(max(el - 2, 0))) for el in range(bandlimit)]
    exact[:2] = [0.0] * min(2, bandlimit)
    assert_close(harmonics.polarisation_factor(bandlimit), exact, ulps=2)


def test_polarisation_factor_is_two_steps_of_spin():
    """eth eth = N_l from spin 0, and so are two steps down from spin 2."""
    flm = random_flm(9, spin=2)
    twice = harmonics.multiply_by_degree(flm, harmonics.polarisation_factor(9))
    assert_close(harmonics.raise_spin(harmonics.raise_spin(flm, 0), 1), twice, ulps=8)
    assert_close(harmonics.lower_spin(harmonics.lower_spin(flm, 2), 1), twice, ulps=8)


@pytest.mark.parametrize("spin", SPINS)
def test_lowering_is_minus_the_adjoint_of_raising(spin):
    """<ethb f, g> = -<f, eth g> for f of spin s + 1 and g of spin s."""
    f, g = random_flm(9, spin + 1, seed=1), random_flm(9, spin, seed=2)
    left = np.vdot(g, harmonics.lower_spin(f, spin + 1))
    right = -np.vdot(harmonics.raise_spin(g, spin), f)
    assert_close(left, right, ulps=256)


@pytest.mark.parametrize("spin", SPINS)
def test_down_and_up_is_the_laplacian_of_spin(spin):
    """ethb eth sYlm = -(l - s)(l + s + 1) sYlm, in integers."""
    flm = random_flm(9, spin)
    el = np.arange(9)
    back = harmonics.lower_spin(harmonics.raise_spin(flm, spin), spin + 1)
    desired = harmonics.multiply_by_degree(flm, -(el - spin) * (el + spin + 1))
    assert_close(back, desired, ulps=8)


@pytest.mark.parametrize("spin", [*SPINS, 12, -12])
def test_steps_leave_nothing_below_either_spin(spin):
    everything = np.ones(81)
    for step, end in ((harmonics.raise_spin, spin + 1), (harmonics.lower_spin, spin - 1)):
        lowest = min(max(abs(spin), abs(end)), 9)
        changed = step(everything, spin)
        assert np.all(changed[: lowest**2] == 0)
        assert np.all(changed[lowest**2 :] != 0)


def test_steps_exchange_under_conjugation():
    """conj(eth f) = ethb conj(f), where conj(f)_lm = (-1)**(s+m) conj(f_{l,-m}) at spin s."""
    flm = random_flm(6)
    up = -harmonics.conjugate_field(harmonics.raise_spin(flm, 0))
    assert_close(harmonics.lower_spin(harmonics.conjugate_field(flm), 0), up, ulps=1)


def test_eth_carries_one_harmonic_to_the_next():
    """eth f = -sin**s (d/dtheta + i/sin d/dphi) sin**-s f, by a central difference."""
    el, m, spin, h = 4, -2, 1, 1e-5
    colatitude, longitude = 1.1, 0.4

    def weighted(theta):
        return spin_harmonic(el, m, spin, theta, longitude) / np.sin(theta) ** spin

    slope = (weighted(colatitude + h) - weighted(colatitude - h)) / (2 * h)
    around = 1j / np.sin(colatitude) * 1j * m * weighted(colatitude)
    derivative = -(np.sin(colatitude) ** spin) * (slope + around)
    factor = harmonics.raise_spin(np.ones(25), spin)[harmonics.index(el, m)]
    expected = factor * spin_harmonic(el, m, spin + 1, colatitude, longitude)
    # A central difference has error h**2 times a third derivative of size l**3.
    assert abs(derivative - expected) < h**2 * el**3


@pytest.mark.parametrize("factor", [1.0, np.ones(4), np.ones((1, 3))])
def test_factor_of_degree_has_one_value_for_each_degree(factor):
    with pytest.raises(ShapeError, match=r"must have shape \(3,\)"):
        harmonics.multiply_by_degree(np.zeros(9), factor)


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_power_spectrum_is_the_mean_square_of_each_degree(bandlimit):
    """C_l = sum_m |f_lm|**2 / (2l + 1)."""
    flm = random_flm(bandlimit, batch=(2,))
    power = harmonics.power_spectrum(flm)
    assert power.shape == (2, bandlimit)
    for el in range(bandlimit):
        desired = np.mean(np.abs(flm[:, el**2 : (el + 1) ** 2]) ** 2, axis=-1)
        assert_close(power[:, el], desired, ulps=4 * bandlimit)


def test_cross_power_is_bilinear_and_symmetric():
    """C[f + g] = C[f] + C[g] + 2 C[f, g]."""
    f, g = random_flm(9, seed=1), random_flm(9, seed=2)
    cross = harmonics.power_spectrum(f, g)
    both = harmonics.power_spectrum(f) + harmonics.power_spectrum(g) + 2 * cross
    assert_close(harmonics.power_spectrum(f + g), both, ulps=64)
    assert np.array_equal(cross, harmonics.power_spectrum(g, f))
    with pytest.raises(ShapeError, match="other has shape"):
        harmonics.power_spectrum(f, g[:-1])


@pytest.mark.parametrize("bandlimit", [1, 4, 9, 12])
def test_resize_keeps_the_degrees_that_both_have(bandlimit):
    flm = random_flm(9, batch=(2,))
    other = harmonics.resize(flm, bandlimit)
    kept = min(9, bandlimit) ** 2
    assert other.shape == (2, bandlimit**2)
    assert not np.shares_memory(other, flm)
    assert np.array_equal(other[:, :kept], flm[:, :kept])
    assert not np.any(other[:, kept:])
