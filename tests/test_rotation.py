"""The laws of rotation."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.compiled import rotation_tile
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import is_real_field, orders
from spinsdw.rotation import check_rotation, rotate_flm
from tests.helpers import (
    EPS,
    assert_close,
    direct_map,
    needs_compiler,
    random_flm,
    random_real_flm,
    relative_error,
    sizes,
    small_d,
)

# Generic, both hemispheres, no turn, half a turn, close to either, out of [0, pi], negative.
ROTATIONS = [
    (0.3, 1.1, 0.7),
    (-4.0, 2.5, 9.0),
    (0.0, 0.0, 0.0),
    (1.0, np.pi, 2.0),
    (0.1, 1e-9, 0.2),
    (0.1, 0.02, 0.2),
    (0.1, np.pi - 0.02, 0.2),
    (1.0, np.pi / 2, 2.0),
    (0.5, -0.4, 1.0),
    (0.1, 7.0, 0.2),
]


def tolerance(bandlimit):
    """Ulps: an angle, rounded, moves degree L by L eps, and the recursion has as many steps."""
    return 16 * bandlimit + 16


def direct_rotation(flm, rotation):
    """g_lm = sum_n e^{-i m alpha} d^l_mn(beta) e^{-i n gamma} f_ln."""
    alpha, beta, gamma = rotation
    found = np.zeros_like(flm)
    for el in range(int(np.sqrt(flm.size))):
        m = np.arange(-el, el + 1)
        d = np.array([small_d(el, n, np.array(beta)) for n in m]).T
        row = slice(el**2, (el + 1) ** 2)
        found[row] = np.exp(-1j * m * alpha) * (d @ (np.exp(-1j * m * gamma) * flm[row]))
    return found


def matrix(rotation):
    """R_z(alpha) R_y(beta) R_z(gamma)."""

    def about_z(angle):
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    c, s = np.cos(rotation[1]), np.sin(rotation[1])
    about_y = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return about_z(rotation[0]) @ about_y @ about_z(rotation[2])


@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("bandlimit", sizes(1, 2, 3, 5, 16, 17, 40))
def test_rotation_is_the_sum_over_wigner_functions(bandlimit, rotation):
    flm = random_flm(bandlimit)
    desired = direct_rotation(flm, rotation)
    assert_close(rotate_flm(flm, rotation), desired, ulps=tolerance(bandlimit))


@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("bandlimit", sizes(1, 2, 3, 16, 33))
def test_real_fields_take_half_the_work(bandlimit, rotation):
    flm = random_real_flm(bandlimit)
    found = rotate_flm(flm, rotation, real=True)
    assert_close(found, rotate_flm(flm, rotation), ulps=tolerance(bandlimit))
    assert is_real_field(found)


@pytest.mark.parametrize("spin", [0, 1, -1, 2, -3])
@pytest.mark.parametrize("rotation", [ROTATIONS[0], ROTATIONS[1], ROTATIONS[8]])
def test_rotated_field_is_the_field_at_points_turned_back(spin, rotation):
    """(R f)(R x) = e^{i s chi} f(x), chi from e_theta at R x to the turned e_theta of x."""
    flm, turn = random_flm(8, spin), matrix(rotation)
    turned = rotate_flm(flm, rotation)
    for theta, phi in ((0.4, 0.3), (1.3, 5.0), (2.9, 2.0)):
        c, s = np.cos(theta), np.sin(theta)
        point = turn @ [s * np.cos(phi), s * np.sin(phi), c]
        south = turn @ [c * np.cos(phi), c * np.sin(phi), -s]
        there = np.arccos(point[2]), np.arctan2(point[1], point[0])
        c, s = np.cos(there[0]), np.sin(there[0])
        e_theta = [c * np.cos(there[1]), c * np.sin(there[1]), -s]
        e_phi = [-np.sin(there[1]), np.cos(there[1]), 0]
        chi = np.arctan2(south @ e_phi, south @ e_theta)
        found = direct_map(turned, spin, np.array([there[0]]), np.array([there[1]]))
        desired = direct_map(flm, spin, np.array([theta]), np.array([phi]))
        np.testing.assert_allclose(found, np.exp(1j * spin * chi) * desired, rtol=0, atol=1e-12)


def test_a_turn_about_the_pole_is_a_phase():
    """beta = 0: e^{-i m (alpha + gamma)}."""
    flm = random_flm(20)
    desired = flm * np.exp(-1j * orders(20) * 1.7)
    assert_close(rotate_flm(flm, (1.0, 0.0, 0.7)), desired, ulps=tolerance(20))


@pytest.mark.parametrize("bandlimit", sizes(9, 70))
def test_inverse_is_the_adjoint(bandlimit):
    """R(-gamma, -beta, -alpha) R = 1 and <R f, g> = <f, R^-1 g>."""
    alpha, beta, gamma = rotation = (0.3, 1.9, -0.7)
    f, g = random_flm(bandlimit), random_flm(bandlimit, seed=1)
    turned, back = rotate_flm(f, rotation), (-gamma, -beta, -alpha)
    assert_close(rotate_flm(turned, back), f, ulps=2 * tolerance(bandlimit))
    difference = np.vdot(turned, g) - np.vdot(f, rotate_flm(g, back))
    scale = np.linalg.norm(f) * np.linalg.norm(g)
    assert abs(difference) <= tolerance(bandlimit) * EPS * scale


def test_rotations_compose_as_matrices_do():
    """R(a) R(b) = R(ab), the Euler angles of the product read off its matrix."""
    first, second = (0.3, 1.1, 0.7), (2.0, 0.6, -1.0)
    product = matrix(second) @ matrix(first)
    joint = (
        np.arctan2(product[1, 2], product[0, 2]),
        np.arccos(product[2, 2]),
        np.arctan2(product[2, 1], -product[2, 0]),
    )
    flm = random_flm(12)
    found = rotate_flm(rotate_flm(flm, first), second)
    assert_close(found, rotate_flm(flm, joint), ulps=2 * tolerance(12))


@needs_compiler
@pytest.mark.parametrize("beta", [1e-3, 0.05, 0.9, np.pi / 2, 2.6, np.pi - 1e-3])
def test_energy_of_every_degree_stays_at_size(beta):
    """d^l is orthogonal, also where its start is far below the range of doubles."""
    bandlimit = 400
    flm = random_flm(bandlimit)
    turned = rotate_flm(flm, (0.2, beta, 0.4))
    starts = np.arange(bandlimit) ** 2
    before = np.add.reduceat(np.abs(flm) ** 2, starts)
    after = np.add.reduceat(np.abs(turned) ** 2, starts)
    np.testing.assert_allclose(after, before, rtol=tolerance(bandlimit) * EPS, atol=0)
    back = rotate_flm(turned, (-0.4, -beta, -0.2))
    # Near a pole an error made k degrees ago is k times as large.
    assert (
        relative_error(back, flm) <= (1 + min(1 / np.sin(beta), bandlimit**0.5)) * bandlimit * EPS
    )


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("beta", [1e-4, 0.3, 1.5, 3.0])
def test_energy_of_every_degree_stays_at_degree_2047(beta):
    flm = random_real_flm(2048)
    turned = rotate_flm(flm, (0.2, beta, 0.4), real=True)
    starts = np.arange(2048) ** 2
    before = np.add.reduceat(np.abs(flm) ** 2, starts)
    after = np.add.reduceat(np.abs(turned) ** 2, starts)
    np.testing.assert_allclose(after, before, rtol=tolerance(2048) * EPS, atol=0)


@needs_compiler
def test_results_have_the_same_bits_on_any_number_of_threads():
    flm = random_flm(210)
    one = rotate_flm(flm, (0.3, 1.1, 0.7), threads=1)
    assert np.array_equal(one, rotate_flm(flm, (0.3, 1.1, 0.7), threads=3))


def test_leading_axes_are_a_batch_and_inputs_are_left_alone():
    flm = random_flm(6, batch=(2, 3))
    flm.flags.writeable = False
    found = rotate_flm(flm, (1, 2, 3))
    assert np.array_equal(found[1, 2], rotate_flm(flm[1, 2], (1, 2, 3)))
    assert rotate_flm(flm[:0], (1, 2, 3)).shape == (0, 3, 36)


@pytest.mark.parametrize("beta", [-9.0, -3.3, -0.1, 0.0, 3.0, 3.3, 6.0, 100.0])
def test_angles_are_brought_to_the_usual_range(beta):
    """0 <= beta <= pi, and the rotation is the same."""
    found = check_rotation((0.4, beta, 0.3))
    assert 0 <= found[1] <= np.pi
    np.testing.assert_allclose(matrix(found), matrix((0.4, beta, 0.3)), rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    "rotation", [(1, 2), 3.0, (1, 2, np.nan), (1, 2, "3"), None, (1, 2, 3j), [[1, 2, 3]]]
)
def test_rotation_is_three_finite_angles(rotation):
    with pytest.raises(ParameterError, match="must be three finite angles"):
        rotate_flm(random_flm(3), rotation)


def test_coefficients_are_checked():
    with pytest.raises(ShapeError, match="bandlimit"):
        rotate_flm(np.zeros(5), (1, 2, 3))
    with pytest.raises(DataError, match="NaN"):
        rotate_flm(np.full(4, np.nan), (1, 2, 3))
    with pytest.raises(ParameterError, match="real=1 must be True or False"):
        rotate_flm(np.zeros(4), (1, 2, 3), real=1)


@needs_compiler
@pytest.mark.parametrize(("columns", "rows"), [(2, 4), (4, 6), (0, 4), (0, 6)])
def test_vectors_compute_what_the_plain_loops_say(columns, rows):
    from spinsdw.compiled.jit import kernel
    from spinsdw.compiled.rotation_tile import CHUNK, LANES
    from spinsdw.compiled.vectors import WIDTH

    names = {(2, 4): "add_to_orders_2", (4, 6): "add_to_orders_4"}
    fast = getattr(rotation_tile, names.get((columns, rows), f"advance_orders_{rows - 2}"))
    plain = rotation_tile._make_plain_tile(columns, rows)
    rng = np.random.default_rng(0)
    blocks, factors = rng.uniform(-1, 1, 2 * CHUNK * rows * LANES), rng.uniform(-1, 1, 5 * CHUNK)
    results = []

    @kernel
    def call(blocks, factors, state, sums):
        fast(blocks, 3, factors, 2, 5.0, state, 1, sums, 4)

    for run in (call, lambda b, f, s, t: plain(b, 3, f, 2, 5.0, s, 1, t, 4)):
        state, sums = np.linspace(-1, 1, 6 * LANES), np.ones(CHUNK * max(columns, 1) * WIDTH + 8)
        run(blocks, factors, state, sums)
        results.append((state, sums))
    for one, other in zip(*results, strict=True):
        assert_close(one, other, ulps=2**14)
