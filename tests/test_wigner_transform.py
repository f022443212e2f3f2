"""The laws of the transform on the rotation group."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.sampling import MW, MWSS, SAMPLINGS
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wigner_transform import WignerTransform
from tests.helpers import (
    EPS,
    assert_close,
    direct_function,
    euler_grid,
    needs_compiler,
    random_flm,
    random_like,
    relative_error,
)

GRIDS = list(SAMPLINGS)
ORDERS = [
    (1, (0,)),
    (2, (-1, 0, 1)),
    (5, (0,)),
    (5, (3,)),
    (5, (-4,)),
    (5, (-2, 0, 2)),
    (5, (-1, 1)),
    (5, (-4, -3, -2, -1, 0, 1, 2, 3, 4)),
    (6, (-1, 2)),
    (6, (-3, -1, 0)),
    (6, (0, 3, 5)),
    (7, (-6, -3, 6)),
    (9, (1, 3, 5, 7)),
]
SYMMETRIC = [(L, orders) for L, orders in ORDERS if set(orders) == {-n for n in orders}]


def tolerance(bandlimit):
    """Ulps of a transform: rounding of a colatitude moves degree L by L pi eps / 2."""
    return 4 * bandlimit + 16


def random_coefficients(bandlimit, orders, batch=(), seed=0):
    """Draw W_lmn, zero where l < |n|."""
    rows = [random_flm(bandlimit, n, seed=seed + i, batch=batch) for i, n in enumerate(orders)]
    return np.stack(rows, axis=-2)


def make_real(coefficients, orders):
    """W_{l,-m,-n} = (-1)^(m+n) conj(W_lmn): the coefficients of a real function."""
    found = coefficients.copy()
    for el in range(int(np.sqrt(coefficients.shape[-1]))):
        m = np.arange(-el, el + 1)
        signs = (-1.0) ** (m + np.array(orders)[:, None])
        row = coefficients[..., el**2 : (el + 1) ** 2]
        found[..., el**2 : (el + 1) ** 2] = (row + signs * row[..., ::-1, ::-1].conj()) / 2
    return found


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("bandlimit", "orders"), ORDERS)
def test_synthesis_is_the_sum_of_wigner_functions(bandlimit, orders, sampling):
    """W(rho) = sum_lmn (2l+1)/(8 pi^2) W_lmn conj(D^l_mn(rho))."""
    transform = WignerTransform(bandlimit, orders, sampling=sampling)
    coefficients = random_coefficients(bandlimit, orders)
    angles = euler_grid(transform.sampling, transform.gammas)
    desired = direct_function(coefficients, orders, angles).reshape(transform.shape)
    assert_close(transform.synthesis(coefficients), desired, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("bandlimit", "orders"), ORDERS)
def test_analysis_undoes_synthesis(bandlimit, orders, sampling):
    transform = WignerTransform(bandlimit, orders, sampling=sampling)
    coefficients = random_coefficients(bandlimit, orders)
    found = transform.analysis(transform.synthesis(coefficients))
    assert_close(found, coefficients, ulps=tolerance(bandlimit))


@needs_compiler
@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(
    ("bandlimit", "orders"), [(33, range(-32, 33)), (64, (-7, 0, 1)), (256, (-2, 0, 2))]
)
def test_analysis_undoes_synthesis_at_size(bandlimit, orders, sampling):
    transform = WignerTransform(bandlimit, orders, sampling=sampling)
    coefficients = random_coefficients(bandlimit, orders)
    found = transform.analysis(transform.synthesis(coefficients))
    assert_close(found, coefficients, ulps=tolerance(bandlimit))
    assert relative_error(found, coefficients) <= (2 * bandlimit + 8) * EPS


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("bandlimit", "orders"), SYMMETRIC)
def test_real_functions_take_the_same_way(bandlimit, orders, sampling):
    half = WignerTransform(bandlimit, orders, sampling=sampling, real=True)
    full = WignerTransform(bandlimit, orders, sampling=sampling)
    coefficients = make_real(random_coefficients(bandlimit, orders), orders)
    values = half.synthesis(coefficients)
    assert values.dtype == np.float64
    assert_close(values, full.synthesis(coefficients), ulps=tolerance(bandlimit))
    assert_close(half.analysis(values), coefficients, ulps=tolerance(bandlimit))
    noise = random_like(values)
    for name in ("analysis", "adjoint_synthesis"):
        desired = getattr(full, name)(noise)
        assert_close(getattr(half, name)(noise), desired, ulps=tolerance(bandlimit))
    desired = full.adjoint_analysis(coefficients)
    assert_close(half.adjoint_analysis(coefficients), desired, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("bandlimit", "orders"), SYMMETRIC)
def test_real_functions_have_exactly_symmetric_coefficients(bandlimit, orders, sampling):
    """W_{l,-m,-n} = (-1)^(m+n) conj(W_lmn), bit for bit."""
    transform = WignerTransform(bandlimit, orders, sampling=sampling, real=True)
    noise = random_like(np.empty((2, *transform.shape)))
    for found in (transform.analysis(noise), transform.adjoint_synthesis(noise)):
        assert np.array_equal(found, make_real(found, orders))


def check_adjoints(transform, coefficients):
    """<S w, g> = <w, S* g> and <A g, w> = <g, A* w>, for any function g."""
    values = transform.synthesis(coefficients)
    noise = random_like(values, seed=9)
    for one, other in (
        (values, transform.adjoint_synthesis(noise)),
        (transform.adjoint_analysis(coefficients), transform.analysis(noise)),
    ):
        scale = np.linalg.norm(one) * np.linalg.norm(noise)
        difference = np.vdot(one, noise) - np.vdot(coefficients, other)
        assert abs(difference) <= tolerance(transform.bandlimit) * EPS * scale


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("bandlimit", "orders"), ORDERS)
def test_adjoints_are_those_of_the_plain_dot_product(bandlimit, orders, sampling):
    """Below l = |n| nothing contributes, either way."""
    transform = WignerTransform(bandlimit, orders, sampling=sampling)
    coefficients = random_like(np.empty((len(orders), bandlimit**2), dtype=complex))
    check_adjoints(transform, coefficients)


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("bandlimit", "orders"), SYMMETRIC)
def test_adjoints_of_real_functions(bandlimit, orders, sampling):
    transform = WignerTransform(bandlimit, orders, sampling=sampling, real=True)
    check_adjoints(transform, make_real(random_coefficients(bandlimit, orders), orders))


@pytest.mark.parametrize(
    ("orders", "gammas"),
    [
        ((0,), [0]),
        ((3,), [0]),
        ((-1, 1), [0, 1 / 4]),
        ((-2, 0, 2), [0, 1 / 6, 1 / 3]),
        ((-1, 0, 1), [0, 1 / 3, 2 / 3]),
        ((-3, 3), [0, 1 / 12]),
        ((-1, 2), [0, 1 / 6]),
        ((0, 1, 3), [0, 1 / 4, 1 / 2, 3 / 4]),
    ],
)
def test_gammas_are_the_fewest_that_tell_the_orders_apart(orders, gammas):
    """gamma_k = 2 pi k / (q terms), q the greatest common step."""
    transform = WignerTransform(5, orders)
    np.testing.assert_allclose(transform.gammas, 2 * np.pi * np.array(gammas), rtol=0, atol=1e-15)
    assert transform.shape == (len(gammas), 5, 9)


def test_entries_below_the_order_do_not_contribute():
    transform = WignerTransform(6, (-3, 2))
    coefficients = random_coefficients(6, (-3, 2))
    padded = coefficients.copy()
    padded[0, :9] = padded[1, :4] = 7.0
    assert np.array_equal(transform.synthesis(padded), transform.synthesis(coefficients))
    found = transform.analysis(random_like(transform.synthesis(padded)))
    assert not np.any(found[0, :9])
    assert not np.any(found[1, :4])


@pytest.mark.parametrize("spin", [0, 1, -2])
def test_one_order_is_a_spin_transform(spin):
    """SYlm = (-1)^s sqrt((2l+1)/4pi) conj(D^l_{m,-s}(phi, theta, 0))."""
    flm = random_flm(6, spin)
    el = np.repeat(np.arange(6), 2 * np.arange(6) + 1)
    factor = (-1) ** spin * 8 * np.pi**2 / np.sqrt(4 * np.pi * (2 * el + 1))
    found = WignerTransform(6, (-spin,)).synthesis((factor * flm)[None])
    assert_close(found[0], SpinHarmonicTransform(6, spin).synthesis(flm), ulps=tolerance(6))


def test_energy_is_the_weighted_sum_of_squared_coefficients():
    """int |W|^2 = sum (2l+1)/(8 pi^2) |W_lmn|^2: the integral is the (0, 0, 0) of |W|^2."""
    orders = (-1, 0, 2)
    coefficients = random_coefficients(5, orders)
    fine = WignerTransform(9, range(-3, 4))
    angles = euler_grid(fine.sampling, fine.gammas)
    squares = np.abs(direct_function(coefficients, orders, angles)) ** 2
    integral = fine.analysis(squares.reshape(fine.shape))[3, 0]
    el = np.repeat(np.arange(5), 2 * np.arange(5) + 1)
    desired = np.sum((2 * el + 1) / (8 * np.pi**2) * np.abs(coefficients) ** 2)
    assert_close(integral, desired, ulps=256)


def test_direct_sums_take_the_wigner_functions_of_spherical():
    """Our D^l_mn is the complex conjugate of that package's."""
    spherical = pytest.importorskip("spherical")
    quaternionic = pytest.importorskip("quaternionic")
    angles = (0.3, 1.9, -2.2)
    wigner = spherical.Wigner(5)
    peer = wigner.D(quaternionic.array.from_euler_angles(*angles))
    for el in range(6):
        for n in range(-el, el + 1):
            one = np.zeros((1, 36))
            for m in range(-el, el + 1):
                one[:] = 0
                one[0, el * el + el + m] = 8 * np.pi**2 / (2 * el + 1)
                ours = direct_function(one, (n,), [np.array([angle]) for angle in angles])
                assert abs(ours[0] - peer[wigner.Dindex(el, m, n)]) < 1e-14


@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("batch", [(3,), (2, 2), (1,), (0,), (2, 0)])
def test_leading_axes_are_a_batch(batch, real):
    orders = (-2, 0, 2)
    transform = WignerTransform(6, orders, real=real)
    coefficients = random_coefficients(6, orders, batch)
    if real:
        coefficients = make_real(coefficients, orders)
    values = transform.synthesis(coefficients)
    assert values.shape == (*batch, 3, 6, 11)
    back = transform.analysis(values)
    assert back.shape == (*batch, 3, 36)
    for place in np.ndindex(*batch):
        assert np.array_equal(values[place], transform.synthesis(coefficients[place]))
        assert np.array_equal(back[place], transform.analysis(values[place]))


@pytest.mark.parametrize("name", ["synthesis", "adjoint_analysis", "analysis", "adjoint_synthesis"])
@pytest.mark.parametrize("real", [False, True])
def test_results_have_the_same_bits_on_any_number_of_threads(name, real):
    orders = (-3, -1, 1, 3)
    coefficients = make_real(random_coefficients(40, orders), orders)
    results = []
    for threads in (1, 2, 3, 5):
        transform = WignerTransform(40, orders, real=real, threads=threads)
        source = coefficients
        if name in {"analysis", "adjoint_synthesis"}:
            source = transform.synthesis(coefficients)
        results.append(getattr(transform, name)(source))
    for other in results[1:]:
        assert np.array_equal(results[0], other)


def test_one_transform_serves_many_threads():
    transform = WignerTransform(20, (-1, 1), threads=2)
    signals = random_coefficients(20, (-1, 1), batch=(6,))
    alone = [transform.analysis(transform.synthesis(one)) for one in signals]
    with ThreadPoolExecutor(3) as pool:
        together = list(pool.map(lambda f: transform.analysis(transform.synthesis(f)), signals))
    assert np.array_equal(alone, together)


def test_objects_describe_themselves_and_are_frozen():
    transform = WignerTransform(5, np.array([-1, 1]), sampling=MWSS(5))
    assert transform.orders == (-1, 1)
    assert transform.sampling == MWSS(5)
    assert transform.shape == (2, 6, 10)
    with pytest.raises(FrozenInstanceError):
        transform.orders = (0,)


@pytest.mark.parametrize("bandlimit", [0, -1, 2.5, True, "8", None])
def test_bandlimit_is_a_positive_integer(bandlimit):
    with pytest.raises(ParameterError, match=r"bandlimit=.* must be an integer of at least 1"):
        WignerTransform(bandlimit, (0,))


@pytest.mark.parametrize("orders", [(), (1, 0), (0, 0), (-1, 1, 1)])
def test_orders_are_distinct_and_increase(orders):
    with pytest.raises(ParameterError, match="must be distinct integers in increasing order"):
        WignerTransform(4, orders)


@pytest.mark.parametrize("orders", [(0.5,), (1.0,), ("1",), (True,), (None,), "a", None, 3])
def test_orders_are_integers(orders):
    """0.5 became order 0 without a word."""
    with pytest.raises(
        ParameterError, match=r"orders=.* must be an? (integer|sequence of integers)"
    ):
        WignerTransform(4, orders)


def test_orders_may_be_any_sequence_of_integers():
    for orders in (range(-1, 2), [-1, 0, 1], np.arange(-1, 2), (n for n in (-1, 0, 1))):
        found = WignerTransform(4, orders).orders
        assert found == (-1, 0, 1)
        assert all(type(n) is int for n in found)


@pytest.mark.parametrize("orders", [(4,), (-4, 0), (0, 100)])
def test_orders_stay_below_the_bandlimit(orders):
    with pytest.raises(ParameterError, match=r"must stay below bandlimit=4; drop the rest"):
        WignerTransform(4, orders)


@pytest.mark.parametrize("orders", [(1,), (-1, 0), (-2, -1, 1)])
def test_real_functions_have_orders_of_both_signs(orders):
    with pytest.raises(ParameterError, match="real=True needs orders symmetric about 0"):
        WignerTransform(4, orders, real=True)


@pytest.mark.parametrize("real", ["no", 1, 0, None])
def test_real_is_true_or_false(real):
    """The text "no" counted as true."""
    with pytest.raises(ParameterError, match=r"real=.* must be True or False"):
        WignerTransform(4, (0,), real=real)


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "a", "2", [1], np.nan, np.inf])
def test_threads_are_a_positive_integer(threads):
    with pytest.raises(ParameterError, match=r"threads=.* must be a positive integer, or None"):
        WignerTransform(4, (0,), threads=threads)


@pytest.mark.parametrize("sampling", ["hpx", MW(5)])
def test_sampling_is_known_and_has_the_same_bandlimit(sampling):
    with pytest.raises(ParameterError, match="sampling"):
        WignerTransform(4, (0,), sampling=sampling)


@pytest.mark.parametrize("name", ["synthesis", "adjoint_analysis"])
@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        (np.zeros((2, 15)), ShapeError, r"shape \(2, 15\)"),
        (np.zeros((3, 16)), ShapeError, r"shape \(3, 16\); it must be \(\.\.\., 2, 16\)"),
        (np.zeros(16), ShapeError, r"shape \(16,\); it must be \(\.\.\., 2, 16\)"),
        (np.full((2, 16), "a"), DataError, "must hold numbers"),
        (np.full((2, 16), None), DataError, "dtype object"),
        (np.full((2, 16), np.nan), DataError, "NaN or infinite"),
    ],
)
def test_coefficients_that_cannot_be_used_are_refused(name, values, error, message):
    with pytest.raises(error, match=message):
        getattr(WignerTransform(4, (-1, 1)), name)(values)


@pytest.mark.parametrize("name", ["analysis", "adjoint_synthesis"])
@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        (np.zeros((1, 4, 7)), ShapeError, r"function has shape \(1, 4, 7\); it must be"),
        (np.zeros((4, 7)), ShapeError, r"function has shape \(4, 7\)"),
        (np.full((2, 4, 7), "a"), DataError, "must hold real or complex numbers"),
        (np.full((2, 4, 7), None), DataError, "dtype object"),
        (np.full((2, 4, 7), np.inf), DataError, "56 values that are not finite"),
        (np.zeros((2, 4, 7), dtype=complex), DataError, "complex but real=True was asked for"),
    ],
)
def test_functions_that_cannot_be_used_are_refused(name, values, error, message):
    with pytest.raises(error, match=message):
        getattr(WignerTransform(4, (-1, 1), real=True), name)(values)
