"""The laws of correlation and convolution on the rotation group."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import DataError, MemoryBudgetError, ParameterError, ShapeError
from spinsdw.harmonics import orders as orders_of
from spinsdw.rotation import rotate_flm
from spinsdw.rotation_group import convolve_functions, correlate_fields, correlate_functions
from spinsdw.sampling import SAMPLINGS, GaussLegendre
from spinsdw.wigner_transform import WignerTransform
from tests.helpers import (
    assert_close,
    direct_function,
    euler_grid,
    random_flm,
    random_like,
    random_real_flm,
)

L = 4
EVERY = tuple(range(1 - L, L))
RHO = (0.7, 1.9, -0.4)


def matrix(alpha, beta, gamma):
    """R_z(alpha) R_y(beta) R_z(gamma), shape (..., 3, 3)."""

    def about(axis, angle):
        c, s = np.cos(angle), np.sin(angle)
        zero, one = np.zeros_like(c), np.ones_like(c)
        rows = [[c, -s, zero], [s, c, zero], [zero, zero, one]]
        if axis == "y":
            rows = [[c, zero, s], [zero, one, zero], [-s, zero, c]]
        return np.moveaxis(np.array(rows), (0, 1), (-2, -1))

    return about("z", alpha) @ about("y", beta) @ about("z", gamma)


def angles_of(rotations):
    """alpha, beta, gamma of matrices none of which is a turn about z alone."""
    return (
        np.arctan2(rotations[..., 1, 2], rotations[..., 0, 2]),
        np.arccos(np.clip(rotations[..., 2, 2], -1, 1)),
        np.arctan2(rotations[..., 2, 1], -rotations[..., 2, 0]),
    )


def random_function(orders, seed=0, bandlimit=L):
    """Draw F_lmn, zero where l < |n|."""
    return np.stack([random_flm(bandlimit, n, seed=seed + i) for i, n in enumerate(orders)])


def quadrature(bandlimit):
    """Points and weights that integrate the product of two functions over the rotation group."""
    grid, size = GaussLegendre(bandlimit), 2 * bandlimit - 1
    gammas = 2 * np.pi * np.arange(size) / size
    weights = np.broadcast_to(grid.weights[:, None], grid.shape).ravel()
    return euler_grid(grid, gammas), np.tile(weights, size) * 2 * np.pi / size


@pytest.mark.parametrize("spin", [0, 1, -2])
def test_correlation_of_fields_is_the_integral_with_the_turned_field(spin):
    """<f, R_rho g> = sum_lm f_lm conj((R_rho g)_lm), any spin."""
    flm, glm = random_flm(L, spin), random_flm(L, spin, seed=1)
    coefficients = correlate_fields(flm, glm, EVERY)
    found = direct_function(coefficients, EVERY, [np.array([angle]) for angle in RHO])
    desired = np.vdot(rotate_flm(glm, RHO), flm)
    assert_close(found, [desired], ulps=256)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize(("spin", "orders"), [(0, EVERY), (2, (-2, 0, 2)), (-1, (1,))])
def test_correlation_is_the_synthesis_of_its_coefficients(sampling, spin, orders):
    """And each sample is an inner product with a turned field."""
    transform = WignerTransform(L, orders, sampling=sampling)
    flm, glm = random_flm(L, spin, batch=(2,)), random_flm(L, spin, seed=1)
    glm[~np.isin(orders_of(L), orders)] = 0
    found = transform.correlate(flm, glm)
    desired = transform.synthesis(correlate_fields(flm, glm, orders))
    assert_close(found, desired, ulps=64)
    alpha, beta, gamma = euler_grid(transform.sampling, transform.gammas)
    for i in (0, 3, alpha.size - 1):
        value = np.vdot(rotate_flm(glm, (alpha[i], beta[i], gamma[i])), flm[1])
        assert abs(found[1].ravel()[i] - value) < 1e-12


def test_correlation_of_real_fields_is_real():
    flm, glm = random_real_flm(L), random_real_flm(L, seed=1)
    half = WignerTransform(L, EVERY, real=True).correlate(flm, glm)
    assert half.dtype == np.float64
    assert_close(half, WignerTransform(L, EVERY).correlate(flm, glm), ulps=64)


def test_correlation_with_itself_peaks_where_it_was_not_turned():
    """<f, R f> <= <f, f>, with equality at rho = 0: the north pole, gamma = -alpha."""
    flm = random_flm(L)
    transform = WignerTransform(L, EVERY, sampling="mwss")
    found = transform.correlate(flm, flm).real
    energy = np.vdot(flm, flm).real
    assert abs(found[0, 0, 0] - energy) < 1e-12 * energy
    assert found.max() <= energy * (1 + 1e-12)


def test_convolution_is_the_integral_over_the_group():
    """(f * g)(rho) = int d rho' f(rho') g(rho'^-1 rho)."""
    orders, others = (-1, 0, 2), (-2, 1)
    first, second = random_function(orders), random_function(others, seed=5)
    points, weights = quadrature(L)
    inverse = np.swapaxes(matrix(*points), -1, -2)
    there = angles_of(inverse @ matrix(*map(np.array, RHO)))
    values = direct_function(first, orders, points) * direct_function(second, others, there)
    found = convolve_functions(first, second, orders)
    assert found.shape == (2, L**2)
    found = direct_function(found, others, [np.array([angle]) for angle in RHO])
    assert_close(found, [weights @ values], ulps=4096)


def test_correlation_of_functions_is_the_integral_over_the_group():
    """int d rho' f(rho') conj(g(rho^-1 rho'))."""
    orders = (-1, 0, 2)
    first, second = random_function(orders), random_function(orders, seed=5)
    points, weights = quadrature(L)
    inverse = np.swapaxes(matrix(*map(np.array, RHO)), -1, -2)
    there = angles_of(inverse @ matrix(*points))
    turned = direct_function(second, orders, there).conj()
    values = direct_function(first, orders, points) * turned
    found = correlate_functions(first, second, orders)
    found = direct_function(found, EVERY, [np.array([angle]) for angle in RHO])
    assert_close(found, [weights @ values], ulps=4096)


def test_products_are_those_of_the_so3_package():
    """Its convolution is h_lmn = sum_k f_lmk conj(g_lnk); with a field, 8 pi^2/(2l+1) f conj(g)."""
    orders = (-3, -1, 0, 2)
    first, second = random_function(orders), random_function(orders, seed=5)
    found = correlate_functions(first, second, orders)
    desired = np.zeros_like(found)
    for el in range(L):
        for m in range(-el, el + 1):
            for n in range(-el, el + 1):
                desired[n + L - 1, el * el + el + m] = sum(
                    first[i, el * el + el + m] * np.conj(second[i, el * el + el + n])
                    for i, k in enumerate(orders)
                    if abs(k) <= el
                )
    assert_close(found, desired, ulps=16)


def test_convolution_is_associative():
    """(f * g) * h = f * (g * h)."""
    orders, others, last = (-1, 2), (0, 1), (-2, 0)
    f, g, h = (random_function(n, seed=i) for i, n in enumerate((orders, others, last)))
    left = convolve_functions(convolve_functions(f, g, orders), h, others)
    right = convolve_functions(f, convolve_functions(g, h, others), orders)
    assert_close(left, right, ulps=64)


def test_correlation_of_functions_of_one_order_is_that_of_fields():
    """f_lm sqrt(8 pi^2/(2l+1)) at order 0: sum_k has one term."""
    flm, glm = random_flm(L), random_flm(L, seed=1)
    root = np.sqrt(8 * np.pi**2 / (2 * np.repeat(np.arange(L), 2 * np.arange(L) + 1) + 1))
    found = correlate_functions((root * flm)[None], (root * glm)[None], (0,))
    assert_close(found, correlate_fields(flm, glm, EVERY), ulps=16)


def test_batches_are_broadcast():
    orders = (-1, 1)
    first = random_like(np.empty((3, 1, 2, L**2), dtype=complex))
    second = random_like(np.empty((5, 2, L**2), dtype=complex), seed=1)
    for product in (convolve_functions, correlate_functions):
        found = product(first, second, orders)
        assert found.shape[:2] == (3, 5)
        assert_close(found[2, 4], product(first[2, 0], second[4], orders), ulps=8)
    fields = correlate_fields(first[:, 0, 0], second[0, 0], orders)
    assert_close(fields[1], correlate_fields(first[1, 0, 0], second[0, 0], orders), ulps=8)


def test_functions_are_checked():
    one = np.zeros((2, 16), dtype=complex)
    for product in (convolve_functions, correlate_functions):
        with pytest.raises(ShapeError, match=r"first has shape \(2, 16\); it must be \(\.\.\., 1,"):
            product(one, one, (0,))
        with pytest.raises(ShapeError, match="second has shape"):
            product(one, one[:, :9], (0, 1))
        with pytest.raises(ShapeError, match="one row for each"):
            product(one, one[0], (0, 1))
        with pytest.raises(ParameterError, match="increasing order"):
            product(one, one, (1, 0))
        with pytest.raises(DataError, match="NaN"):
            product(one, one + np.nan, (0, 1))
    with pytest.raises(ShapeError, match="glm has shape"):
        correlate_fields(one[0], one[0, :9], (0,))


def test_fields_to_correlate_are_checked():
    transform, flm = WignerTransform(L, (-1, 0)), random_flm(L)
    with pytest.raises(DataError, match=r"glm has orders \[-3, -2, 1, 2, 3\] that are not among"):
        transform.correlate(flm, flm)
    with pytest.raises(ShapeError, match="it must be one field"):
        transform.correlate(flm, flm[None])
    tight = WignerTransform(L, EVERY, max_memory=2000)
    with pytest.raises(MemoryBudgetError, match="correlate"):
        tight.correlate(flm, flm)
