"""The laws of the samplings of the sphere."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, dataclass
from fractions import Fraction
from typing import ClassVar

import numpy as np
import pytest
from scipy.special import eval_legendre

from spinsdw.errors import ParameterError, ShapeError
from spinsdw.sampling import (
    MW,
    MWSS,
    SAMPLINGS,
    ClenshawCurtis,
    DriscollHealy,
    Fejer1,
    GaussLegendre,
    HealpixRings,
    Sampling,
    WeightedRings,
    resolve_sampling,
)
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform
from tests.helpers import (
    assert_close,
    direct_map,
    needs_compiler,
    random_flm,
    random_like,
    sizes,
    small_d,
)

GRIDS = list(SAMPLINGS.values())
BANDLIMITS = [1, 2, 3, 4, 9]


def weigh(sampling, columns, orders, threads=1):
    """Apply the quadrature to one row of columns for each order, in place."""
    mixing = np.eye(len(orders), dtype=complex)
    sampling.weigh_columns(columns, orders, mixing=mixing, threads=threads)


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_mw_rings_are_odd_multiples_of_half_a_step(bandlimit):
    """theta_t = (2t + 1) pi / (2L - 1), t < L; phi_p = 2 pi p / (2L - 1)."""
    grid = MW(bandlimit)
    step = 2 * np.pi / (2 * bandlimit - 1)
    assert grid.shape == (grid.n_rings, grid.n_phi) == (bandlimit, 2 * bandlimit - 1)
    assert_close(grid.colatitudes, (np.arange(bandlimit) + 0.5) * step, ulps=2)
    assert_close(grid.longitudes, np.arange(2 * bandlimit - 1) * step, ulps=2)
    assert grid.colatitudes[-1] == np.pi


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_mwss_rings_are_multiples_of_a_step_from_pole_to_pole(bandlimit):
    """theta_t = 2 pi t / 2L, t <= L; phi_p = 2 pi p / 2L."""
    grid = MWSS(bandlimit)
    step = np.pi / bandlimit
    assert grid.shape == (grid.n_rings, grid.n_phi) == (bandlimit + 1, 2 * bandlimit)
    assert_close(grid.colatitudes, np.arange(bandlimit + 1) * step, ulps=2)
    assert_close(grid.longitudes, np.arange(2 * bandlimit) * step, ulps=2)
    assert grid.colatitudes[0] == 0
    assert grid.colatitudes[-1] == np.pi


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_other_uniform_rings_stand_where_their_rules_say(bandlimit):
    """DH (2t + 1) pi / 4L, Fejer (2t + 1) pi / (4L - 2), Clenshaw-Curtis pi t / (2L - 2)."""
    size = 2 * bandlimit - 1
    for grid, rings, step, start in (
        (DriscollHealy, 2 * bandlimit, np.pi / (2 * bandlimit), 0.5),
        (Fejer1, size, np.pi / size, 0.5),
        (ClenshawCurtis, max(size, 2), np.pi / max(size - 1, 1), 0.0),
    ):
        assert grid(bandlimit).shape == (rings, size)
        assert_close(grid(bandlimit).colatitudes, (np.arange(rings) + start) * step, ulps=2)


@pytest.mark.parametrize("bandlimit", [1, 2, 3, 10, 65])
def test_gauss_legendre_rings_are_zeros_of_the_legendre_polynomial(bandlimit):
    """cos(theta_t) and the weights are those of numpy, found as eigenvalues."""
    grid = GaussLegendre(bandlimit)
    nodes, weights = np.polynomial.legendre.leggauss(bandlimit)
    assert grid.shape == (bandlimit, 2 * bandlimit - 1)
    np.testing.assert_allclose(np.cos(grid.colatitudes), nodes[::-1], rtol=0, atol=4e-16)
    assert_close(grid.weights * grid.n_phi / (2 * np.pi), weights[::-1], ulps=8 * bandlimit)


@needs_compiler
@pytest.mark.parametrize("bandlimit", [1024, 4096])
def test_gauss_legendre_rings_near_a_pole_keep_their_digits(bandlimit):
    """theta_t = j_t / (L + 1/2) (1 - (1 - j_t cot j_t ..) ..): Bessel zeros, to O(L^-4)."""
    first = GaussLegendre(bandlimit).colatitudes[0]
    zero, scale = 2.404825557695773, bandlimit + 0.5
    rough = zero / scale
    desired = rough + (rough / np.tan(rough) - 1) / (8 * rough * scale**2)
    assert abs(first - desired) < rough * (1e-15 + bandlimit**-4.0)


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("bandlimit", sizes(*BANDLIMITS, 64, 515))
def test_weighted_sums_are_integrals(grid, bandlimit):
    """sum_t w_t P sum P_l(cos theta_t) = 4 pi delta_l0 for l < integral_bandlimit."""
    sampling = grid(bandlimit)
    cosine = np.cos(sampling.colatitudes)
    weights = sampling.weights * sampling.n_phi
    before, now = np.zeros_like(cosine), np.ones_like(cosine)
    sums = []
    for el in range(sampling.integral_bandlimit):
        sums.append(weights @ now)
        before, now = now, ((2 * el + 1) * cosine * now - el * before) / (el + 1)
    desired = np.zeros(sampling.integral_bandlimit)
    desired[0] = 4 * np.pi
    assert_close(sums, desired, ulps=4 * bandlimit)
    assert np.all(weights > 0) or not isinstance(sampling, WeightedRings)
    assert not sampling.weights.flags.writeable


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("bandlimit", [2, 3, 6, 9])
def test_integral_bandlimit_is_the_largest(grid, bandlimit):
    """One degree more, in theta or in phi, and a weighted sum is no integral."""
    sampling = grid(bandlimit)
    degree = sampling.integral_bandlimit
    theta, phi = sampling.points
    if degree == sampling.n_phi:
        values = np.cos(degree * phi) * np.sin(theta) ** degree
    else:
        values = np.polynomial.Legendre.basis(degree)(np.cos(theta))
    assert abs(sampling.integrate(values)) > 1e-3


@pytest.mark.parametrize("bandlimit", BANDLIMITS)
def test_driscoll_healy_weights_are_those_of_the_paper(bandlimit):
    """w_t = (2 / L) sin(theta_t) sum_{k < L} sin((2k + 1) theta_t) / (2k + 1)."""
    grid = DriscollHealy(bandlimit)
    odd = 2 * np.arange(bandlimit) + 1
    theta = grid.colatitudes
    sums = np.sin(np.outer(theta, odd)) @ (1 / odd)
    desired = 2 / bandlimit * np.sin(theta) * sums * 2 * np.pi / grid.n_phi
    assert_close(grid.weights, desired, ulps=16)


def test_simpson_is_the_clenshaw_curtis_rule_of_three_rings():
    """1/3, 4/3, 1/3."""
    weights = ClenshawCurtis(2).weights * 3 / (2 * np.pi)
    assert_close(weights, [float(Fraction(k, 3)) for k in (1, 4, 1)], ulps=4)


@pytest.mark.parametrize("grid", GRIDS)
def test_points_are_the_colatitude_and_longitude_of_each_sample(grid):
    sampling = grid(5)
    theta, phi = sampling.points
    assert theta.shape == phi.shape == sampling.shape
    assert np.array_equal(theta[:, 0], sampling.colatitudes)
    assert np.array_equal(phi[0], sampling.longitudes)


@pytest.mark.parametrize("grid", GRIDS)
def test_integrals_take_a_batch(grid):
    """int Y_00 sqrt(4 pi) = 4 pi."""
    sampling = grid(4)
    values = np.multiply.outer([1.0, 2.0], np.ones(sampling.shape))
    assert_close(sampling.integrate(values), [4 * np.pi, 8 * np.pi], ulps=8)
    with pytest.raises(ShapeError, match="its last two axes must be"):
        sampling.integrate(np.ones(sampling.n_rings))


@pytest.mark.parametrize("grid", GRIDS)
def test_symmetric_grids_mirror_their_rings(grid):
    theta = grid(9).colatitudes
    if grid.is_symmetric:
        assert_close(np.pi - theta[::-1], theta, ulps=2)
    else:
        assert abs(np.pi - theta[-1] - theta[0]) > 0.1


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("n", [-3, 0, 1, 2])
def test_quadrature_makes_wigner_functions_orthogonal(grid, n):
    """2 pi sum_t d^l_mn(t) [d^l'_mn](t) = 4 pi / (2l + 1) delta_ll', every l, l' < L."""
    sampling, n_m = grid(9), grid(9).n_phi
    for m in (0, 1, -1, 4, -8):
        lowest = max(abs(m), abs(n))
        rows = [small_d(el, n, sampling.colatitudes)[:, el + m] for el in range(lowest, 9)]
        for i, row in enumerate(rows):
            columns = np.zeros((1, n_m, sampling.n_rings), dtype=complex)
            columns[0, m] = n_m * row
            weigh(sampling, columns, (n,))
            found = np.array(rows) @ columns[0, m]
            desired = np.zeros(len(rows))
            desired[i] = 4 * np.pi / (2 * (lowest + i) + 1)
            np.testing.assert_allclose(found, desired, rtol=0, atol=1e-14)


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("n", [0, 1])
def test_quadrature_is_a_real_symmetric_matrix(grid, n):
    """The adjoints rest on it: Q = Q^T = conj(Q), for even and for odd m."""
    sampling = grid(6)
    matrices = []
    for row in np.eye(sampling.n_rings):
        columns = np.zeros((1, sampling.n_phi, sampling.n_rings), dtype=complex)
        columns[0, :2] = row
        weigh(sampling, columns, (n,))
        matrices.append(columns[0, :2])
    for matrix in np.moveaxis(np.array(matrices), 1, 0):
        assert_close(matrix, matrix.real, ulps=2)
        assert_close(matrix, matrix.T, ulps=8)


@pytest.mark.parametrize("grid", GRIDS)
def test_quadrature_of_a_half_series_is_that_of_its_columns(grid):
    """Columns of real maps hold m >= 0 alone."""
    sampling = grid(9)
    full = random_like(np.empty((2, sampling.n_phi, sampling.n_rings), dtype=complex))
    half = np.ascontiguousarray(full[:, : sampling.n_phi // 2 + 1])
    weigh(sampling, full, (-1, 1))
    weigh(sampling, half, (-1, 1))
    assert_close(half[:, :9], full[:, :9], ulps=16)


@pytest.mark.parametrize("grid", GRIDS)
def test_quadrature_mixes_columns_into_orders_first(grid):
    """Row i becomes the quadrature, for order n_i, of sum_k mixing_ik columns_k."""
    sampling, orders = grid(7), (-2, 1)
    mixing = random_like(np.empty((2, 3), dtype=complex), seed=1)
    columns = random_like(np.empty((3, sampling.n_phi, sampling.n_rings), dtype=complex))
    mixed = np.tensordot(mixing, columns, axes=1)
    weigh(sampling, mixed, orders)
    sampling.weigh_columns(columns, orders, mixing=mixing, threads=1)
    assert_close(columns[:2], mixed, ulps=32)


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("threads", [2, 3, 5])
def test_quadrature_has_the_same_bits_on_any_number_of_threads(grid, threads):
    sampling = grid(40)
    one = random_like(np.empty((2, sampling.n_phi, sampling.n_rings), dtype=complex))
    several = one.copy()
    weigh(sampling, one, (0, 3))
    weigh(sampling, several, (0, 3), threads)
    assert np.array_equal(one, several)


@pytest.mark.parametrize(
    ("name", "grid"), [*SAMPLINGS.items(), ("MW", MW), ("MwSS", MWSS), ("GL", GaussLegendre)]
)
def test_name_means_its_grid(name, grid):
    assert resolve_sampling(name, 5) == grid(5)
    assert resolve_sampling(grid(5), 5) == grid(5)


@pytest.mark.parametrize("grid", GRIDS)
def test_grids_are_equal_by_value_and_frozen(grid):
    assert grid(4) == grid(4)
    assert grid(4) != grid(5)
    assert hash(grid(4)) == hash(grid(4))
    with pytest.raises(FrozenInstanceError):
        grid(4).bandlimit = 5


def test_kinds_of_grid_differ():
    assert len({grid(4) for grid in GRIDS}) == len(GRIDS)
    assert list(SAMPLINGS) == ["mw", "mwss", "dh", "gl", "cc", "fejer1"]


@pytest.mark.parametrize("name", ["hpx", "", "mw ", None, 3, MW])
def test_unknown_name_lists_those_known(name):
    with pytest.raises(ParameterError, match=r"sampling=.* is not known; use one of 'mw', 'mwss'"):
        resolve_sampling(name, 4)


def test_grid_of_another_bandlimit_is_refused():
    with pytest.raises(ParameterError, match="sampling has bandlimit 5 but the transform has 4"):
        resolve_sampling(MW(5), 4)


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("bandlimit", [0, -1, 2.5, 4.0, True, "4", None, np.float64(4)])
def test_bandlimit_is_a_positive_integer(grid, bandlimit):
    with pytest.raises(ParameterError, match=r"bandlimit=.* must be an integer of at least 1"):
        grid(bandlimit)


@pytest.mark.parametrize("grid", GRIDS)
def test_bandlimit_may_be_an_integer_of_numpy(grid):
    sampling = grid(np.int32(4))
    assert type(sampling.bandlimit) is int
    assert sampling == grid(4)


def test_sampling_itself_is_abstract():
    with pytest.raises(TypeError, match="abstract"):
        Sampling(4)


@pytest.mark.parametrize("nside", [1, 2, 3, 8])
def test_healpix_rings_share_out_all_pixels(nside):
    """12 nside^2 pixels on 4 nside - 1 rings, symmetric about the equator."""
    rings = HealpixRings(nside)
    assert rings.n_rings == 4 * nside - 1
    assert rings.n_phi.sum() == rings.n_pixels == 12 * nside**2
    assert np.array_equal(rings.starts, np.cumsum(rings.n_phi) - rings.n_phi)
    assert np.array_equal(rings.n_phi, rings.n_phi[::-1])
    assert_close(rings.colatitudes[::-1], np.pi - rings.colatitudes, ulps=1)


@pytest.mark.parametrize("nside", [1, 2, 3, 8])
def test_healpix_pixels_have_equal_areas(nside):
    """The rings above one of cap ring i hold 2 i (i - 1) pixels, and z = 1 - i^2 / (3 nside^2)."""
    rings = HealpixRings(nside)
    i = np.arange(1, nside + 1)
    assert_close(np.cos(rings.colatitudes[:nside]), 1 - i**2 / (3 * nside**2), ulps=4)
    belt = np.arange(nside, 3 * nside + 1)
    z = np.cos(rings.colatitudes[nside - 1 : 3 * nside])
    np.testing.assert_allclose(z, 4 / 3 - 2 * belt / (3 * nside), rtol=0, atol=4e-16)


@pytest.mark.parametrize("nside", [0, -2, 2.5, True, None, "a", [1], np.nan, np.inf])
def test_nside_is_a_positive_integer(nside):
    with pytest.raises(ParameterError, match=r"nside=.* must be an integer of at least 1"):
        HealpixRings(nside)


@dataclass(frozen=True)
class Uneven(WeightedRings):
    """Any rings, with the weights that integrate all polynomials which so many can."""

    name: ClassVar[str] = "uneven"
    is_symmetric: ClassVar[bool] = False

    @property
    def n_rings(self):
        return 2 * self.bandlimit - 1

    @property
    def colatitudes(self):
        t = (np.arange(self.n_rings) + 0.5) / self.n_rings
        return np.pi * (t + 0.02 * np.sin(3 * np.pi * t))

    @property
    def rule(self):
        degree = np.arange(self.n_rings)[:, None]
        polynomials = eval_legendre(degree, np.cos(self.colatitudes))
        return np.linalg.solve(polynomials, np.where(degree[:, 0] == 0, 2.0, 0.0))


@pytest.mark.parametrize("bandlimit", [1, 2, 3, 8])
def test_rings_of_ones_own_are_a_sampling_of_everything(bandlimit):
    """On the sphere, on the rotation group and of wavelets, synthesis undoes analysis"""
    grid, spin = Uneven(bandlimit), min(1, bandlimit - 1)
    flm = random_flm(bandlimit, spin)
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=grid)
    maps = transform.synthesis(flm)
    assert_close(
        maps, direct_map(flm, spin, grid.colatitudes, grid.longitudes), ulps=64 * bandlimit
    )
    assert_close(transform.analysis(maps), flm, ulps=256 * bandlimit)
    wavelets = SpinWaveletTransform(bandlimit, spin, min(2, bandlimit), sampling=grid)
    assert_close(wavelets.synthesis(wavelets.analysis(maps)), maps, ulps=512 * bandlimit)
    wigner = WignerTransform(bandlimit, (0,), sampling=grid)
    function = random_flm(bandlimit)[None]
    assert_close(wigner.analysis(wigner.synthesis(function)), function, ulps=256 * bandlimit)
