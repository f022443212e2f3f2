"""The share of a wavelet's energy in the hole, against a direct sum over rotated wavelets."""

from __future__ import annotations

from math import factorial

import numpy as np
import pytest

from spinsdw.harmonics import degrees, orders, resize
from spinsdw.healpix import pixel_directions
from spinsdw.sampling import MW, MWSS
from spinsdw.separation.energy_share import energy_shares, wavelet_energy
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import EPS, assert_close, needs_compiler, random_flm

L = 8


def wigner_d(el, m, n, beta):
    """d^l_mn(beta) by its finite sum (Varshalovich 4.3.1); d^1_10 = -sin(beta)/sqrt(2)."""
    root = np.sqrt(1.0 * factorial(el + m) * factorial(el - m) * factorial(el + n))
    root *= np.sqrt(1.0 * factorial(el - n))
    total = np.zeros_like(beta)
    for k in range(max(0, n - m), min(el + n, el - m) + 1):
        below = factorial(el + n - k) * factorial(k) * factorial(m - n + k) * factorial(el - m - k)
        powers = np.cos(beta / 2) ** (2 * el + n - m - 2 * k) * np.sin(beta / 2) ** (m - n + 2 * k)
        total += (-1.0) ** (m - n + k) * powers / below
    return root * total


def wigner_column(bandlimit, n, beta):
    """d^l_mn(beta) at every (l, m), zero below |n|; shape (angles, L^2)."""
    table = np.zeros((beta.size, bandlimit**2))
    for el in range(abs(n), bandlimit):
        for m in range(-el, el + 1):
            table[:, el * el + el + m] = wigner_d(el, m, n, beta)
    return table


def spin_harmonics(bandlimit, spin, theta, phi):
    """sYlm = (-1)^s sqrt((2l+1)/4pi) d^l_{m,-s}(theta) e^{im phi}; shape (points, L^2)."""
    norm = (-1) ** spin * np.sqrt((2 * degrees(bandlimit) + 1) / (4 * np.pi))
    phases = np.exp(1j * np.outer(phi, orders(bandlimit)))
    return norm * wigner_column(bandlimit, -spin, theta) * phases


def wavelet_of(transform, key):
    """Return psi_ln with its orders n and orientations, or phi_l0 with order and angle 0."""
    if key == "scaling":
        size = transform.tiling.scaling_bandlimit
        return transform.wavelets.scaling_harmonics[None, :size], (0,), np.zeros(1)
    psi = transform.wavelets.wavelet_harmonics(key)
    return psi, transform.wavelets.directionality.orders, transform.orientations


def direct_shares(transform, key, holes, points):
    """sum_p w_p h_p |R_rho psi(p)|^2 / <psi, psi> with h and the area w given at points p,
    (R_rho psi)_lm = sum_n e^{-i m alpha} d^l_mn(beta) e^{-i n gamma} psi_ln
    """
    theta, phi, area = points
    psi, psi_orders, gammas = wavelet_of(transform, key)
    size = psi.shape[1]
    grid = transform.grid_of(size)
    table = spin_harmonics(size, transform.spin, theta, phi)
    columns = [wigner_column(size, n, grid.colatitudes) for n in psi_orders]
    turns = np.exp(-1j * np.outer(orders(size), grid.longitudes))
    shares = np.empty((gammas.size, *grid.shape))
    for k, t in np.ndindex(shares.shape[:2]):
        at_pole = sum(
            column[t] * row[degrees(size)] * np.exp(-1j * n * gammas[k])
            for column, row, n in zip(columns, psi, psi_orders, strict=True)
        )
        values = table @ (at_pole[:, None] * turns)
        shares[k, t] = (area * holes) @ np.abs(values) ** 2
    return shares.reshape(transform.shapes[key]) / np.sum(np.abs(psi) ** 2)


def gauss_legendre_points(degree):
    """Points and areas of a quadrature of the sphere that is exact up to a degree."""
    nodes, weights = np.polynomial.legendre.leggauss(degree // 2 + 1)
    longitudes = 2 * np.pi * np.arange(degree + 1) / (degree + 1)
    theta, phi = np.meshgrid(np.arccos(nodes), longitudes, indexing="ij")
    area = np.broadcast_to(weights[:, None] * 2 * np.pi / (degree + 1), theta.shape)
    return theta.ravel(), phi.ravel(), area.ravel()


def smooth_holes(bandlimit):
    """Coefficients of a real field between 0.2 and 0.8 that has no symmetry."""
    field = SpinHarmonicTransform(bandlimit).synthesis(random_flm(bandlimit, seed=3)).real
    transform = SpinHarmonicTransform(bandlimit, real=True)
    dense = SpinHarmonicTransform(32, real=True).synthesis(resize(transform.analysis(field), 32))
    return transform.analysis(0.5 + 0.3 * field / np.abs(dense).max())


def shares_on_grid(transform, holes):
    sky = GridSky(transform.sampling)
    return energy_shares(transform, lambda bandlimit: sky.integrals(holes, bandlimit))


@pytest.mark.parametrize(
    ("spin", "directions", "sampling"),
    [(2, 1, "mw"), (2, 2, "mw"), (2, 3, "mw"), (2, 3, "mwss"), (0, 4, "mw"), (-1, 3, "mwss")],
)
def test_share_is_the_direct_sum_over_the_rotated_wavelet(spin, directions, sampling):
    """f_j(rho) = <1 - M, R_rho |psi^j|^2> / <1, |psi^j|^2> for a band-limited mask M"""
    transform = SpinWaveletTransform(
        L, spin, directions, lowest_scale=2, sampling=sampling, threads=1
    )
    flm = smooth_holes(5)
    points = gauss_legendre_points(4 + 2 * (L - 1))
    at_points = (spin_harmonics(5, 0, *points[:2]) @ flm).real
    on_grid = SpinHarmonicTransform(L, sampling=sampling, real=True).synthesis(resize(flm, L))
    shares = shares_on_grid(transform, on_grid)
    assert list(shares) == ["scaling", 2, 3]
    for key, share in shares.items():
        expected = direct_shares(transform, key, at_points, points)
        assert np.ptp(expected) > 0.01
        assert_close(share, expected, ulps=64 * L)


def test_share_on_healpix_takes_the_sum_over_pixels_as_the_integral():
    """f_j(rho) = (4 pi / npix) sum_p h_p |R_rho psi(p)|^2 / <psi, psi>"""
    nside, transform = 4, SpinWaveletTransform(L, 2, 2, lowest_scale=2, threads=1)
    holes = np.random.default_rng(1).random(12 * nside**2)
    theta, phi = pixel_directions(nside)
    sky, area = HealpixSky(nside, L), 4 * np.pi / theta.size
    shares = energy_shares(transform, lambda bandlimit: sky.integrals(holes, bandlimit))
    for key in ("scaling", 2):
        expected = direct_shares(transform, key, holes, (theta, phi, area))
        # Divided by the integral of |psi|^2, not by its sum over pixels, it may pass 1.
        assert_close(shares[key], np.minimum(expected, 1), ulps=64 * L)


@pytest.mark.parametrize("spin", [-2, 0, 1, 2])
def test_energy_is_the_squared_modulus(spin):
    """|psi(p)|^2 = sum_lm e_lm Y_lm(p) at every point p"""
    psi, psi_orders, _ = wavelet_of(SpinWaveletTransform(L, spin, 3, threads=1), 2)
    energy = wavelet_energy(psi, psi_orders, spin, threads=1)
    flm = np.zeros(L**2, dtype=complex)
    for row, n in zip(psi, psi_orders, strict=True):
        kept = orders(L) == n
        flm[kept] = row[degrees(L)[kept]]
    theta, phi, _ = gauss_legendre_points(6)
    values = spin_harmonics(L, spin, theta, phi) @ flm
    found = spin_harmonics(2 * L - 1, 0, theta, phi) @ energy
    assert_close(found, np.abs(values) ** 2, ulps=64 * L)


@needs_compiler
@pytest.mark.parametrize("scale", [4, 5, 6])
def test_energy_is_the_squared_modulus_at_bandlimits_that_round(scale):
    """|psi|^2 again, at D = 2 L_j - 1 = 63, 127 and 255

    A transform that took a frequency for n * (1 / n) was wrong by more than the energy at
    127 and 255, and right at the sizes above and below.
    """
    psi, _, _ = wavelet_of(SpinWaveletTransform(128, 2), scale)
    size = psi.shape[1]
    energy = wavelet_energy(psi, (0,), 2, threads=None)
    # Two values that need no transform: the integral, and the pole, where spin 2 vanishes.
    assert_close(energy[0] * np.sqrt(4 * np.pi), np.sum(np.abs(psi) ** 2), ulps=64 * size)
    el = np.arange(2 * size - 1)
    at_pole = np.sum(np.sqrt((2 * el + 1) / (4 * np.pi)) * energy[el**2 + el])
    assert abs(at_pole) < 64 * size * EPS * abs(energy[0]) * size
    # Order 0 is all there is.
    assert np.max(np.abs(np.delete(energy, el**2 + el))) < 64 * size * EPS * abs(energy[0])


@pytest.mark.parametrize("directions", [1, 2, 3, 4, 5])
def test_energy_has_even_orders_below_twice_the_directions(directions):
    """e_lq = 0 unless q is even and |q| <= 2 (N - 1), for odd and for even N"""
    psi, psi_orders, _ = wavelet_of(SpinWaveletTransform(16, 2, directions, threads=1), 3)
    energy = wavelet_energy(psi, psi_orders, 2, threads=1)
    q = orders(2 * 16 - 1)
    absent = (q % 2 != 0) | (np.abs(q) > 2 * (directions - 1))
    assert np.max(np.abs(energy[absent])) < 16 * EPS * energy[0].real
    for order in range(0, 2 * directions, 2):
        assert np.max(np.abs(energy[q == order])) > 1e-3 * energy[0].real


@pytest.mark.parametrize("directions", [1, 2, 3])
@pytest.mark.parametrize("sampling", ["mw", "mwss"])
def test_share_is_0_without_a_hole_and_1_without_a_sky(directions, sampling):
    """f = 0 for M = 1, f = 1 for M = 0"""
    transform = SpinWaveletTransform(L, 2, directions, lowest_scale=1, sampling=sampling)
    for value in (0.0, 1.0):
        shares = shares_on_grid(transform, np.full(transform.sampling.shape, value))
        for key, share in shares.items():
            is_empty = not np.any(wavelet_of(transform, key)[0])
            assert_close(share, np.full(transform.shapes[key], 0 if is_empty else value), ulps=64)
            assert_close(share.max(), 0.0 if is_empty else value, ulps=64)


@pytest.mark.parametrize("directions", [1, 3])
def test_share_is_linear_in_the_hole(directions):
    """f[a h] = a f[h], and the shares of a hole and of its complement add up to 1"""
    transform = SpinWaveletTransform(L, 2, directions, lowest_scale=2, threads=1)
    on_grid = SpinHarmonicTransform(L, real=True).synthesis(resize(smooth_holes(5), L))
    whole, half, rest = (shares_on_grid(transform, h) for h in (on_grid, on_grid / 2, 1 - on_grid))
    for key, share in whole.items():
        assert_close(half[key], share / 2, ulps=64)
        assert_close(rest[key], 1 - share, ulps=64)


@pytest.mark.parametrize("sampling", [MW, MWSS])
@pytest.mark.parametrize("directions", [2, 3])
def test_share_is_in_the_unit_interval_for_any_mask(sampling, directions):
    """0 <= f <= 1, although a mask of zeros and ones rings between its samples"""
    grid = sampling(16)
    holes = (np.random.default_rng(2).random(grid.shape) < 0.4).astype(float)
    transform = SpinWaveletTransform(16, 2, directions, sampling=grid)
    shares = shares_on_grid(transform, holes)
    assert {key: share.shape for key, share in shares.items()} == transform.shapes
    for share in shares.values():
        assert share.dtype == np.float64
        assert share.min() >= 0
        assert share.max() <= 1


@pytest.mark.parametrize("spin", [0, 2, -3])
def test_scales_below_the_spin_have_no_share(spin):
    """psi^j = 0 for L_j <= |s|, and then f_j = 0 rather than 0 / 0"""
    transform = SpinWaveletTransform(16, spin, 3, threads=1)
    shares = shares_on_grid(transform, np.full(transform.sampling.shape, 0.5))
    for j, bandlimit in transform.bandlimits.items():
        expected = 0.0 if bandlimit <= abs(spin) else 0.5
        assert_close(shares[j], np.full(transform.shapes[j], expected), ulps=64)


def test_more_directions_than_a_scale_has_orders_do_no_harm():
    """N > L_j: orders |n| >= L_j are not there"""
    transform = SpinWaveletTransform(16, 0, 9, lowest_scale=1, threads=1)
    assert min(transform.bandlimits.values()) < 9
    shares = shares_on_grid(transform, np.full(transform.sampling.shape, 0.25))
    for j in transform.scales:
        assert_close(shares[j], np.full(transform.shapes[j], 0.25), ulps=64)


def polar_hole(bandlimit, edge):
    """A hole around the north pole, as far as the colatitude of the edge."""
    grid = MW(bandlimit)
    return np.where(grid.colatitudes[:, None] < edge, 1.0, 0.0) * np.ones(grid.n_phi)


@pytest.mark.parametrize("directions", [2, 3])
def test_share_near_an_edge_depends_on_the_orientation(directions):
    """gamma = 0 has its lobes east and west, along the edge: f is smallest for it outside"""
    transform = SpinWaveletTransform(32, 2, directions, threads=1)
    share = shares_on_grid(transform, polar_hole(32, 1.0))[4]
    ring = np.argmin(np.abs(transform.grid_of(32).colatitudes - 1.25))
    along, *across = share[:, ring, 0]
    assert min(across) > 0.02
    assert along < 0.3 * min(across)
    assert share[:, ring + 14].max() < 1e-3


@pytest.mark.parametrize("directions", [2, 3, 4])
def test_share_of_a_round_hole_knows_no_left_and_right(directions):
    """f(alpha, beta, gamma) = f(0, beta, gamma) = f(0, beta, pi - gamma) for a hole at the pole"""
    transform = SpinWaveletTransform(16, 2, directions, threads=1)
    share = shares_on_grid(transform, polar_hole(16, 1.0))[3]
    assert_close(share, np.broadcast_to(share[..., :1], share.shape), ulps=64 * 16)
    assert_close(share[1:], share[:0:-1], ulps=64 * 16)


def test_shares_do_not_depend_on_threads():
    holes = (np.random.default_rng(2).random(MW(16).shape) < 0.4).astype(float)
    one, two = (
        shares_on_grid(SpinWaveletTransform(16, 2, 3, threads=threads), holes) for threads in (1, 2)
    )
    for key, share in one.items():
        assert np.array_equal(share, two[key])
