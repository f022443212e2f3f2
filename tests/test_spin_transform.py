"""The laws of the spin harmonic transform."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError
from fractions import Fraction

import numpy as np
import pytest
from scipy.special import eval_legendre, gammaln

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import conjugate_field, index, is_real_field, lower_spin, raise_spin
from spinsdw.sampling import MW, MWSS, SAMPLINGS
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import (
    EPS,
    IS_UNCOMPILED,
    assert_close,
    direct_map,
    exact_small_d,
    needs_compiler,
    random_flm,
    random_like,
    random_real_flm,
    relative_error,
    sizes,
    sizes_and_spins,
)

GRIDS = list(SAMPLINGS)
# Of each quadrature one, for what takes long.
FEW_GRIDS = ["mw", "mwss", "gl"]


def tolerance(bandlimit):
    """Ulps of a transform: a colatitude, rounded by pi eps / 2, moves degree L by L pi eps / 2."""
    return 4 * bandlimit + 8


def harmonic(bandlimit, el, m):
    flm = np.zeros(bandlimit**2, dtype=complex)
    flm[index(el, m)] = 1
    return flm


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(
    ("spin", "el", "m", "value"),
    [
        (0, 0, 0, lambda t, _: np.sqrt(1 / (4 * np.pi)) + 0 * t),
        (0, 1, 0, lambda t, _: np.sqrt(3 / (4 * np.pi)) * np.cos(t)),
        (0, 1, 1, lambda t, p: -np.sqrt(3 / (8 * np.pi)) * np.sin(t) * np.exp(1j * p)),
        (1, 1, 0, lambda t, _: np.sqrt(3 / (8 * np.pi)) * np.sin(t)),
        (1, 1, 1, lambda t, p: -np.sqrt(3 / (16 * np.pi)) * (1 - np.cos(t)) * np.exp(1j * p)),
        (-1, 1, 0, lambda t, _: -np.sqrt(3 / (8 * np.pi)) * np.sin(t)),
        (2, 2, 0, lambda t, _: np.sqrt(15 / (32 * np.pi)) * np.sin(t) ** 2),
        (2, 2, 2, lambda t, p: np.sqrt(5 / np.pi) / 8 * (1 - np.cos(t)) ** 2 * np.exp(2j * p)),
        (2, 2, -2, lambda t, p: np.sqrt(5 / np.pi) / 8 * (1 + np.cos(t)) ** 2 * np.exp(-2j * p)),
    ],
)
def test_low_degrees_are_the_textbook_harmonics(sampling, spin, el, m, value):
    """SYlm of Goldberg et al. 1967 with the Condon-Shortley phase."""
    transform = SpinHarmonicTransform(4, spin, sampling=sampling)
    grid = transform.sampling
    theta, phi = np.meshgrid(grid.colatitudes, grid.longitudes, indexing="ij")
    assert_close(transform.synthesis(harmonic(4, el, m)), value(theta, phi), ulps=16)


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(
    ("bandlimit", "spin"), sizes_and_spins([1, 2, 3, 8, 33], [0, 1, -1, 2, -2, 7, -31])
)
def test_synthesis_is_the_sum_of_harmonics(bandlimit, spin, sampling):
    """f = sum_lm f_lm sYlm; what stands below |s| does not contribute."""
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=sampling)
    flm = random_flm(bandlimit)
    grid = transform.sampling
    desired = direct_map(flm, spin, grid.colatitudes, grid.longitudes)
    assert_close(transform.synthesis(flm), desired, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(
    ("bandlimit", "spin"), sizes_and_spins([1, 2, 3, 5, 33, 64, 513], [0, 1, 2, -3, 7])
)
def test_analysis_undoes_synthesis(bandlimit, spin, sampling):
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=sampling)
    flm = random_flm(bandlimit, spin, seed=1)
    found = transform.analysis(transform.synthesis(flm))
    assert_close(found, flm, ulps=tolerance(bandlimit))
    assert relative_error(found, flm) <= (2 * bandlimit + 8) * EPS
    assert not np.any(found[: spin**2])


@needs_compiler
@pytest.mark.parametrize("sampling", FEW_GRIDS)
@pytest.mark.parametrize("first", [1, 50, 100, 190])
def test_every_bandlimit_round_trips(first, sampling):
    """Once the quadrature took n * (1 / n), which is below 1 for n = 49, 98, 103, ..., for 1.

    It lost the whole analysis at L = 25, 52, 54, ... on MW, and 49, 98, ... on MWSS.
    """
    for bandlimit in range(first, first + 50):
        transform = SpinHarmonicTransform(bandlimit, sampling=sampling, real=True)
        flm = random_real_flm(bandlimit)
        found = transform.analysis(transform.synthesis(flm))
        # Mirrored rings take steps of two degrees, which gather more rounding at the equator.
        assert_close(found, flm, ulps=tolerance(bandlimit) * (1 if sampling == "mw" else 2))


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize("bandlimit", [2, 3, 9])
def test_every_possible_spin_round_trips(bandlimit, sampling):
    for spin in range(1 - bandlimit, bandlimit):
        transform = SpinHarmonicTransform(bandlimit, spin, sampling=sampling)
        flm = random_flm(bandlimit, spin)
        found = transform.analysis(transform.synthesis(flm))
        assert_close(found, flm, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize("bandlimit", sizes(1, 2, 5, 64, 200))
def test_real_signals_take_the_same_way(bandlimit, sampling):
    """real=True gives what the complex transform gives, in real numbers."""
    half = SpinHarmonicTransform(bandlimit, sampling=sampling, real=True)
    full = SpinHarmonicTransform(bandlimit, sampling=sampling)
    flm = random_real_flm(bandlimit)
    values, desired = half.synthesis(flm), full.synthesis(flm)
    assert values.dtype == np.float64
    assert_close(values, desired, ulps=tolerance(bandlimit))
    assert_close(half.analysis(values), flm, ulps=tolerance(bandlimit))
    assert is_real_field(half.analysis(values))
    noise = random_like(values)
    for name in ("analysis", "adjoint_synthesis"):
        desired = getattr(full, name)(noise)
        assert_close(getattr(half, name)(noise), desired, ulps=tolerance(bandlimit))
    desired = full.adjoint_analysis(flm)
    assert_close(half.adjoint_analysis(flm), desired, ulps=tolerance(bandlimit))


def check_adjoints(transform, flm):
    """<S f, g> = <f, S* g> and <A g, f> = <g, A* f>, for any maps g, band-limited or not."""
    signal = transform.synthesis(flm)
    noise = random_like(signal, seed=1)
    for values, found in (
        (signal, transform.adjoint_synthesis(noise)),
        (transform.adjoint_analysis(flm), transform.analysis(noise)),
    ):
        # The sums have as many terms as pixels, of either sign: the terms set the scale.
        scale = np.linalg.norm(values) * np.linalg.norm(noise)
        difference = np.vdot(values, noise) - np.vdot(flm, found)
        assert abs(difference) <= tolerance(transform.bandlimit) * EPS * scale


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("bandlimit", "spin"), sizes_and_spins([1, 2, 8, 33, 100], [0, 1, 2, -3]))
def test_adjoints_are_those_of_the_plain_dot_product(bandlimit, spin, sampling):
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=sampling)
    check_adjoints(transform, random_flm(bandlimit))


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize("bandlimit", sizes(1, 2, 8, 33, 100))
def test_adjoints_are_those_of_the_plain_dot_product_for_real_signals(bandlimit, sampling):
    """The coefficients of a real field, all stored: <f, g> is real."""
    transform = SpinHarmonicTransform(bandlimit, sampling=sampling, real=True)
    check_adjoints(transform, random_real_flm(bandlimit))


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize("spin", [0, 1, 2, -3])
def test_conjugation_turns_the_spin_round(spin, sampling):
    """conj(sYlm) = (-1)^(s+m) -sYl-m."""
    flm = random_flm(9, spin)
    one = SpinHarmonicTransform(9, spin, sampling=sampling).synthesis(flm)
    other = SpinHarmonicTransform(9, -spin, sampling=sampling)
    flipped = (-1) ** spin * conjugate_field(flm)
    assert_close(other.synthesis(flipped), one.conj(), ulps=tolerance(9))


@pytest.mark.parametrize("spin", [0, 1, 2, -3])
def test_point_inversion_turns_the_spin_round(spin):
    """sYlm(pi - theta, phi + pi) = (-1)^l -sYlm(theta, phi)."""
    flm = random_flm(9, spin)
    signs = np.repeat((-1.0) ** np.arange(9), 2 * np.arange(9) + 1)
    one = SpinHarmonicTransform(9, spin, sampling="mwss").synthesis(flm)
    other = SpinHarmonicTransform(9, -spin, sampling="mwss").synthesis(signs * flm)
    assert_close(np.roll(one[::-1], 9, axis=1), other, ulps=tolerance(9))


def eth(values, spin, grid, step):
    """-(d/dtheta +- i/sin d/dphi -+ s cot) f, the derivatives by Fourier series, exact."""
    size = grid.n_phi
    m = np.rint(np.fft.fftfreq(size, 1 / size)).astype(int)
    columns = np.fft.fft(values, axis=1)
    circle = np.zeros((size, size), dtype=complex)
    t = np.arange(grid.n_rings)
    # F_m(-theta) = (-1)^(m + s) F_m(theta); the last ring, the pole, is its own image.
    circle[size - 1 - t] = columns * (-1.0) ** (m + spin)
    circle[t] = columns
    slope = np.fft.ifft(1j * m[:, None] * np.fft.fft(circle, axis=0), axis=0)[t]
    theta = grid.colatitudes[:-1, None]
    around = step * 1j * (1j * m * columns)[:-1] / np.sin(theta)
    turn = -step * spin / np.tan(theta) * columns[:-1]
    return -np.fft.ifft(slope[:-1] + around + turn, axis=1)


@pytest.mark.parametrize("spin", [-2, -1, 0, 1, 2])
@pytest.mark.parametrize(("step", "move"), [(1, raise_spin), (-1, lower_spin)])
def test_eth_moves_a_map_from_one_spin_to_the_next(spin, step, move):
    """eth sYlm = sqrt((l-s)(l+s+1)) s+1Ylm, and eth-bar with the signs of s turned."""
    flm = random_flm(9, spin)
    transform = SpinHarmonicTransform(9, spin)
    found = eth(transform.synthesis(flm), spin, transform.sampling, step)
    moved = SpinHarmonicTransform(9, spin + step).synthesis(move(flm, spin))
    # A derivative and 1 / sin(theta) of the first ring each multiply rounding by L.
    assert_close(found, moved[:-1], ulps=9 * 9 * 9)


@pytest.mark.parametrize("sampling", GRIDS)
def test_rotation_about_the_pole_shifts_pixels(sampling):
    """f(theta, phi - a) has coefficients f_lm e^{-i m a}."""
    transform = SpinHarmonicTransform(9, 2, sampling=sampling)
    flm = random_flm(9, 2)
    m = np.concatenate([np.arange(-el, el + 1) for el in range(9)])
    turned = flm * np.exp(-1j * m * transform.sampling.longitudes[3])
    shifted = np.roll(transform.synthesis(flm), 3, axis=1)
    assert_close(transform.synthesis(turned), shifted, ulps=tolerance(9))


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize("spin", [0, -2])
def test_energy_is_the_sum_of_squared_coefficients(spin, sampling):
    """int |f|^2 = sum_lm |f_lm|^2, the integral being sqrt(4 pi) (|f|^2)_00 at bandlimit 2L."""
    flm = random_flm(8, spin)
    fine = SpinHarmonicTransform(16, spin, sampling=sampling)
    squares = np.abs(fine.synthesis(np.concatenate([flm, np.zeros(192)]))) ** 2
    scalar = SpinHarmonicTransform(16, sampling=sampling, real=True)
    integral = np.sqrt(4 * np.pi) * scalar.analysis(squares)[0]
    assert_close(integral, np.sum(np.abs(flm) ** 2), ulps=64)


@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("batch", [(3,), (2, 3), (1,), (0,), (2, 0)])
def test_leading_axes_are_a_batch(batch, real):
    """Every signal of a batch gets what it gets alone: the same bits, or sums in another order."""
    spin = 0 if real else 2
    transform = SpinHarmonicTransform(9, spin, real=real)
    flm = random_real_flm(9, batch=batch) if real else random_flm(9, 2, batch=batch)
    maps = transform.synthesis(flm)
    assert maps.shape == (*batch, 9, 17)
    assert maps.dtype == (np.float64 if real else np.complex128)
    for name, source in (("analysis", maps), ("adjoint_synthesis", maps), ("synthesis", flm)):
        found = getattr(transform, name)(source)
        assert found.shape[: len(batch)] == batch
        for place in np.ndindex(*batch):
            ulps = 0 if name == "synthesis" else 16
            assert_close(found[place], getattr(transform, name)(source[place]), ulps=ulps)
    assert transform.adjoint_analysis(flm).shape == maps.shape


@pytest.mark.parametrize("name", ["synthesis", "adjoint_analysis", "analysis", "adjoint_synthesis"])
@pytest.mark.parametrize(("spin", "real"), [(0, True), (2, False)])
def test_results_have_the_same_bits_on_any_number_of_threads(name, spin, real):
    bandlimit = 20 if IS_UNCOMPILED else 70
    flm = random_real_flm(bandlimit) if real else random_flm(bandlimit, spin)
    results = []
    for threads in (1, 2, 3, 5, None):
        transform = SpinHarmonicTransform(bandlimit, spin, real=real, threads=threads)
        source = flm if "synthesis" in name else transform.synthesis(flm)
        if name.startswith("adjoint"):
            source = transform.synthesis(flm) if name == "adjoint_synthesis" else flm
        results.append(getattr(transform, name)(source))
    for other in results[1:]:
        assert np.array_equal(results[0], other)


def test_one_transform_serves_many_threads():
    transform = SpinHarmonicTransform(24, 2, threads=2)
    signals = random_flm(24, 2, batch=(8,))
    alone = [transform.analysis(transform.synthesis(flm)) for flm in signals]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda f: transform.analysis(transform.synthesis(f)), signals))
    assert np.array_equal(alone, together)


@pytest.mark.parametrize("name", ["analysis", "adjoint_synthesis"])
def test_real_maps_have_exactly_the_coefficients_of_a_real_field(name):
    """f_{l,-m} = (-1)^m conj(f_lm), m = 0 included: there rounding left an imaginary part."""
    transform = SpinHarmonicTransform(9, real=True)
    maps = transform.synthesis(random_real_flm(9, batch=(2,)))
    flm = getattr(transform, name)(maps)
    assert np.array_equal(flm, conjugate_field(flm))


def test_inputs_are_left_alone_and_results_are_fresh():
    transform = SpinHarmonicTransform(9, 2)
    flm = random_flm(9)
    before = flm.copy()
    flm.flags.writeable = False
    maps = transform.synthesis(flm)
    again = maps.copy()
    maps.flags.writeable = False
    for found in (transform.analysis(maps), transform.adjoint_synthesis(maps)):
        assert found.flags.writeable
        assert not np.shares_memory(found, maps)
    assert np.array_equal(flm, before)
    assert np.array_equal(maps, again)


@pytest.mark.parametrize("dtype", [">c16", "complex64", "float32", ">f8", "int16", "bool"])
def test_any_layout_of_numbers_is_taken(dtype):
    """Strides, byte order, precision and lists do not matter."""
    transform = SpinHarmonicTransform(5, 1)
    source = (10 * random_like(np.empty((9, 5)))).astype(dtype).T
    plain = np.ascontiguousarray(source, dtype=complex)
    assert np.array_equal(transform.analysis(source), transform.analysis(plain))
    assert np.array_equal(transform.analysis(source.tolist()), transform.analysis(plain))


@pytest.mark.parametrize("sampling", FEW_GRIDS)
@pytest.mark.parametrize("spin", [0, 2, -5])
@pytest.mark.parametrize("bandlimit", sizes(16, 1025))
def test_sectoral_harmonics_survive_underflow_near_the_poles(bandlimit, spin, sampling):
    """d^l_{l,n} = sqrt(binom(2l, l+n)) cos^(l+n)(theta/2) (-sin(theta/2))^(l-n), n = -s.

    Its start, sin(theta)^l, is far below the range of floats on most rings.
    """
    el, n = bandlimit - 1, -spin
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=sampling)
    half = transform.sampling.colatitudes / 2
    binomial = gammaln(2 * el + 1) - gammaln(el + n + 1) - gammaln(el - n + 1)
    with np.errstate(divide="ignore"):
        exponent = binomial / 2 + (el + n) * np.log(np.cos(half)) + (el - n) * np.log(np.sin(half))
    column = np.sqrt((2 * el + 1) / (4 * np.pi)) * (-1.0) ** el * np.exp(exponent)
    column[transform.sampling.colatitudes == np.pi] = 0
    desired = column[:, None] * np.exp(1j * el * transform.sampling.longitudes)
    # The oracle's own exponent, of size l log 2, rounds to l eps.
    found = transform.synthesis(harmonic(bandlimit, el, el))
    assert_close(found, desired, ulps=16 * bandlimit)
    assert_close(transform.analysis(found), harmonic(bandlimit, el, el), tolerance(bandlimit))


@pytest.mark.parametrize("sampling", FEW_GRIDS)
@pytest.mark.parametrize("bandlimit", sizes(16, 1025))
def test_zonal_harmonics_are_legendre_polynomials(bandlimit, sampling):
    """Y_l0 = sqrt((2l+1)/4pi) P_l(cos theta), close to the poles too."""
    el = bandlimit - 1
    transform = SpinHarmonicTransform(bandlimit, sampling=sampling, real=True)
    legendre = eval_legendre(el, np.cos(transform.sampling.colatitudes))
    desired = np.sqrt((2 * el + 1) / (4 * np.pi)) * legendre
    found = transform.synthesis(harmonic(bandlimit, el, 0))
    # The oracle takes cos(theta): near a pole its rounding turns the phase by l sqrt(eps) at most.
    away = np.sin(transform.sampling.colatitudes) > 0.05
    assert_close(found[away], np.broadcast_to(desired[away, None], found[away].shape), 64 * el)
    pole = transform.sampling.colatitudes == np.pi
    # There u_{l+1} = -2 u_l - u_{l-1}: an error made k degrees ago is k times as large.
    value = (-1.0) ** el * np.sqrt((2 * el + 1) / (4 * np.pi))
    assert_close(found[pole], np.full_like(found[pole], value), ulps=el**1.5)


@needs_compiler
@pytest.mark.parametrize("spin", [1023, -1023])
def test_the_largest_spin_has_a_closed_form(spin):
    """d^l_{m,l} = sqrt(binom(2l, l+m)) cos^(l+m) sin^(l-m), at every m."""
    bandlimit, el = 1024, 1023
    transform = SpinHarmonicTransform(bandlimit, spin)
    flm = np.zeros(bandlimit**2, dtype=complex)
    m = np.arange(-el, el + 1)
    flm[el**2 :] = random_like(np.empty(2 * el + 1, dtype=complex))
    half = transform.sampling.colatitudes[:-1, None] / 2
    binomial = gammaln(2 * el + 1) - gammaln(el + m + 1) - gammaln(el - m + 1)
    n = 1 if spin < 0 else -1
    cosine, sine = np.log(np.cos(half)), np.log(np.sin(half))
    d = np.exp(binomial / 2 + (el + n * m) * cosine + (el - n * m) * sine)
    signs = 1.0 if n > 0 else (-1.0) ** (el + m)
    columns = (-1.0) ** spin * np.sqrt((2 * el + 1) / (4 * np.pi)) * d * signs * flm[el**2 :]
    desired = np.fft.ifft(np.fft.ifftshift(columns, axes=1), axis=1) * (2 * el + 1)
    assert_close(transform.synthesis(flm)[:-1], desired, ulps=16 * bandlimit)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("sampling", FEW_GRIDS)
@pytest.mark.parametrize("bandlimit", [1024, 2048])
def test_analysis_undoes_synthesis_at_high_degree(bandlimit, sampling):
    transform = SpinHarmonicTransform(bandlimit, 2, sampling=sampling)
    flm = random_flm(bandlimit, 2)
    found = transform.analysis(transform.synthesis(flm))
    assert relative_error(found, flm) <= bandlimit * EPS
    assert np.max(np.abs(found - flm)) < 1e-11


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("spin", [2, 8])
def test_analysis_undoes_synthesis_at_degree_4095(spin):
    transform = SpinHarmonicTransform(4096, spin)
    flm = random_flm(4096, spin)
    found = transform.analysis(transform.synthesis(flm))
    assert relative_error(found, flm) <= 4096 * EPS
    assert np.max(np.abs(found - flm)) < 1e-11


def small_d_near_pole(el, m, n, angle):
    """d^l_mn of a small angle: the sum of `exact_small_d`, whose terms soon fall with k.

    Its first factor is a root of products of |m - n| integers, without factorials.
    """
    if m < n:
        return (-1.0) ** (m - n) * small_d_near_pole(el, n, m, angle)
    sine2 = math.sin(angle / 2) ** 2
    rising = math.prod(range(el + n + 1, el + m + 1)) * math.prod(range(el - m + 1, el - n + 1))
    cosine = math.exp((2 * el + n - m) / 2 * math.log1p(-sine2))
    term = math.sqrt(rising) / math.factorial(m - n) * math.sqrt(sine2) ** (m - n) * cosine
    terms = [(-1.0) ** (m - n) * term]
    for k in range(min(el + n, el - m)):
        ratio = (el + n - k) * (el - m - k) / ((k + 1) * (m - n + k + 1))
        terms.append(-terms[-1] * ratio * sine2 / (1 - sine2))
        if abs(terms[-1]) < EPS**2 * abs(terms[0]):
            break
    return math.fsum(terms)


@needs_compiler
@pytest.mark.parametrize("spin", [2, -8])
@pytest.mark.parametrize("bandlimit", [20, 128, pytest.param(4096, marks=pytest.mark.slow)])
def test_rings_next_to_the_poles_hold_the_highest_degree(bandlimit, spin):
    """F_m = (-1)^s sqrt((2l+1)/4pi) f_lm d^l_{m,-s}; d^l_mn(pi-t) = (-1)^(l+m) d^l_{m,-n}(t)."""
    transform = SpinHarmonicTransform(bandlimit, spin)
    el, orders = bandlimit - 1, np.arange(-9, 10)
    flm = np.zeros(bandlimit**2, dtype=complex)
    chosen = random_like(np.empty(orders.size, dtype=complex))
    flm[el**2 + el + orders] = chosen
    rings = np.array([0, 1, 2, -4, -3, -2])
    columns = np.fft.fft(transform.synthesis(flm)[rings], axis=1)[:, orders] / (2 * el + 1)
    factor = (-1.0) ** spin * np.sqrt((2 * el + 1) / (4 * np.pi)) * chosen
    steps = np.where(rings >= 0, 2 * rings + 1, -2 * (rings + 1)) * (np.pi / (2 * el + 1))
    desired = np.array(
        [
            [
                small_d_near_pole(el, m, -spin, angle)
                if ring >= 0
                else (-1.0) ** (el + m) * small_d_near_pole(el, m, spin, angle)
                for m in orders.tolist()
            ]
            for ring, angle in zip(rings, steps.tolist(), strict=True)
        ]
    )
    # Next to a pole the recursion's own roundings add up twice: a random walk's integral.
    assert_close(columns, factor * desired, ulps=4 * bandlimit**1.5)


def small_d_of_few_terms(el, m, n, cosine):
    """d^l_mn where cos(theta) is a fraction over a power of two: `exact_small_d` in integers.

    At degree 4095 the common divisors of fractions would take hours.
    """
    one, x = cosine.denominator, cosine.numerator
    total = sum(
        (-1) ** (m - n + k)
        * math.comb(el + n, k)
        * math.comb(el - n, el - m - k)
        * (one + x) ** ((2 * el + n - m - 2 * k) // 2)
        * (one - x) ** ((m - n + 2 * k) // 2)
        for k in range(max(0, n - m), min(el + n, el - m) + 1)
    )
    square = total**2 * math.factorial(el + m) * math.factorial(el - m)
    if (m - n) % 2:
        square *= (one + x) * (one - x)
    below = math.factorial(el + n) * math.factorial(el - n) * (2 * one) ** (2 * el)
    shift = max(0, 128 + below.bit_length() - square.bit_length()) // 2
    root = math.sqrt((square << (2 * shift)) // below)
    return math.copysign(math.ldexp(root, -shift), 1 if total > 0 else -1)


@pytest.mark.parametrize(("m", "n"), [(6, 2), (5, -2), (-4, 3), (-6, -1)])
def test_both_exact_sums_agree(m, n):
    found, desired = (
        small_d(6, m, n, Fraction(45, 64)) for small_d in (small_d_of_few_terms, exact_small_d)
    )
    assert_close(found, desired, ulps=4)


@needs_compiler
@pytest.mark.parametrize("spin", [2, -8])
@pytest.mark.parametrize("bandlimit", [20, 128, pytest.param(4096, marks=pytest.mark.slow)])
def test_orders_close_to_the_degree_hold_on_every_ring(bandlimit, spin):
    """As above for m = +-(l - k), k < 5, where d has few terms, and none but near the equator."""
    transform = SpinHarmonicTransform(bandlimit, spin)
    el = bandlimit - 1
    orders = np.concatenate([el - np.arange(5), np.arange(5) - el])
    flm = np.zeros(bandlimit**2, dtype=complex)
    chosen = random_like(np.empty(orders.size, dtype=complex))
    flm[el**2 + el + orders] = chosen
    rings = np.unique(np.linspace(0, bandlimit - 2, 9).astype(int)[[0, 1, 3, 4, 5, 7]])
    columns = np.fft.fft(transform.synthesis(flm)[rings], axis=1)[:, orders] / (2 * el + 1)
    factor = (-1.0) ** spin * np.sqrt((2 * el + 1) / (4 * np.pi)) * chosen
    half = transform.sampling.colatitudes[rings] / 2
    cosines = [
        1 - 2 * Fraction(sine) ** 2 if sine < 0.75 else 2 * Fraction(cosine) ** 2 - 1
        for sine, cosine in zip(np.sin(half).tolist(), np.cos(half).tolist(), strict=True)
    ]
    desired = [[small_d_of_few_terms(el, m, -spin, x) for m in orders.tolist()] for x in cosines]
    assert_close(columns, factor * np.array(desired), ulps=16 * bandlimit)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("el", [4095, 4000])
def test_sectoral_harmonics_survive_underflow_at_degree_4095(el):
    """As above; at el = 4000 the recursion goes on for 95 degrees that carry nothing."""
    transform = SpinHarmonicTransform(4096, 2)
    half = transform.sampling.colatitudes[:-1] / 2
    binomial = gammaln(2 * el + 1) - gammaln(el - 1) - gammaln(el + 3)
    exponent = binomial / 2 + (el - 2) * np.log(np.cos(half)) + (el + 2) * np.log(np.sin(half))
    column = np.sqrt((2 * el + 1) / (4 * np.pi)) * (-1.0) ** el * np.exp(exponent)
    found = transform.synthesis(harmonic(4096, el, el))
    assert_close(found[:-1, 0], column, ulps=16 * 4096)


def test_objects_describe_themselves_and_are_frozen():
    transform = SpinHarmonicTransform(np.int64(5), np.int8(-2), sampling="MWSS", threads=1)
    assert (transform.bandlimit, transform.spin) == (5, -2)
    assert type(transform.bandlimit) is type(transform.spin) is int
    assert transform.sampling == MWSS(5)
    assert transform.shape == (6, 10)
    with pytest.raises(FrozenInstanceError):
        transform.spin = 0


def test_sampling_may_be_an_object():
    flm = random_flm(5)
    by_name, by_object = (SpinHarmonicTransform(5, sampling=s) for s in ("mw", MW(5)))
    assert np.array_equal(by_name.synthesis(flm), by_object.synthesis(flm))


@pytest.mark.parametrize("bandlimit", [0, -1, 2.5, True, "8", None])
def test_bandlimit_is_a_positive_integer(bandlimit):
    with pytest.raises(ParameterError, match=r"bandlimit=.* must be an integer of at least 1"):
        SpinHarmonicTransform(bandlimit)


@pytest.mark.parametrize("spin", [4, -4, 100])
def test_spin_stays_below_the_bandlimit(spin):
    with pytest.raises(
        ParameterError, match=f"spin={spin} must be smaller in size than bandlimit=4"
    ):
        SpinHarmonicTransform(4, spin)


@pytest.mark.parametrize("spin", [1.0, 0.5, True, "2", None])
def test_spin_is_an_integer(spin):
    with pytest.raises(ParameterError, match=r"spin=.* must be an integer"):
        SpinHarmonicTransform(4, spin)


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "a", "2", [1], np.nan, np.inf])
def test_threads_are_a_positive_integer(threads):
    with pytest.raises(ParameterError, match=r"threads=.* must be a positive integer, or None"):
        SpinHarmonicTransform(4, threads=threads)


def test_signals_with_spin_are_not_real():
    with pytest.raises(ParameterError, match="real=True needs spin 0, not spin=2"):
        SpinHarmonicTransform(4, 2, real=True)


@pytest.mark.parametrize("real", ["no", 1, 0, None])
def test_real_is_true_or_false(real):
    """The text "no" counted as true."""
    with pytest.raises(ParameterError, match=r"real=.* must be True or False"):
        SpinHarmonicTransform(4, real=real)


@pytest.mark.parametrize("sampling", ["healpix", 3, MW(5)])
def test_sampling_is_known_and_has_the_same_bandlimit(sampling):
    with pytest.raises(ParameterError, match="sampling"):
        SpinHarmonicTransform(4, sampling=sampling)


@pytest.mark.parametrize("name", ["synthesis", "adjoint_analysis"])
@pytest.mark.parametrize(
    ("flm", "error", "message"),
    [
        (np.zeros(15), ShapeError, r"shape \(15,\), and its last axis must be bandlimit\*\*2 = 16"),
        (np.zeros((16, 1)), ShapeError, r"shape \(16, 1\)"),
        (np.zeros(()), ShapeError, r"shape \(\)"),
        (np.full(16, "a"), DataError, "must hold numbers"),
        (np.full(16, None), DataError, "dtype object"),
        (np.full(16, np.nan), DataError, "NaN or infinite"),
        (np.full(16, complex(0, np.inf)), DataError, "NaN or infinite"),
    ],
)
def test_coefficients_that_cannot_be_used_are_refused(name, flm, error, message):
    with pytest.raises(error, match=message):
        getattr(SpinHarmonicTransform(4), name)(flm)


@pytest.mark.parametrize("name", ["analysis", "adjoint_synthesis"])
@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        (np.zeros((7, 4)), ShapeError, r"shape \(7, 4\); it must be \(\.\.\., 4, 7\)"),
        (np.zeros(28), ShapeError, r"shape \(28,\)"),
        (np.zeros(()), ShapeError, r"shape \(\)"),
        (np.full((4, 7), "a"), DataError, "must hold real or complex numbers"),
        (np.full((4, 7), None), DataError, "dtype object"),
        (np.full((4, 7), np.nan), DataError, "28 values that are not finite"),
        (
            np.full((4, 7), -np.inf),
            DataError,
            "28 values that are not finite; mask or replace them",
        ),
        (
            np.where(np.arange(7) + np.zeros((4, 1)) < 6, 0, [[0], [0], [0], [np.nan]]),
            DataError,
            "map has 1 value that is not finite; mask or replace it first",
        ),
    ],
)
def test_maps_that_cannot_be_used_are_refused(name, values, error, message):
    with pytest.raises(error, match=message):
        getattr(SpinHarmonicTransform(4), name)(values)


@pytest.mark.parametrize("name", ["analysis", "adjoint_synthesis"])
def test_complex_maps_are_not_real(name):
    transform = SpinHarmonicTransform(4, real=True)
    with pytest.raises(DataError, match="complex but real=True was asked for"):
        getattr(transform, name)(np.zeros((4, 7), dtype=complex))


@pytest.mark.parametrize("name", ["analysis", "adjoint_synthesis"])
def test_masked_values_are_refused(name):
    """What lies under a mask is no signal."""
    values = np.ma.array(np.ones((4, 7)), mask=np.eye(4, 7))
    with pytest.raises(DataError, match="has masked entries, and every value must be known"):
        getattr(SpinHarmonicTransform(4), name)(values)


def test_a_mask_without_entries_is_no_mask():
    values = np.ones((4, 7))
    transform = SpinHarmonicTransform(4)
    assert np.array_equal(transform.analysis(np.ma.array(values)), transform.analysis(values))
