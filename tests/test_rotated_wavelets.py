"""A turned wavelet is sum_n D^l_mn psi_ln, and a coefficient is its product with the signal."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.directionality import (
    CurveletDirectionality,
    RidgeletDirectionality,
    SteerableDirectionality,
)
from spinsdw.errors import ParameterError
from spinsdw.harmonics import bandlimit_of, resize
from spinsdw.ring_transform import HealpixTransform
from spinsdw.rotated_wavelets import rotated_harmonics
from spinsdw.sampling import MW, SAMPLINGS
from spinsdw.tiling import ScaleDiscretisedTiling
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wavelets import Wavelets
from tests.helpers import (
    assert_close,
    direct_map,
    needs_compiler,
    random_flm,
    random_real_flm,
    small_d,
)

ROTATIONS = [(0.0, 0.0, 0.0), (0.7, 1.1, -0.4), (-3.0, np.pi, 9.0), (2.0, np.pi / 2, 0.0)]
each_rotation = pytest.mark.parametrize("rotation", ROTATIONS)
FAMILIES = [
    SteerableDirectionality(1),
    SteerableDirectionality(4),
    SteerableDirectionality(9),
    CurveletDirectionality(),
    CurveletDirectionality(centred=True),
    RidgeletDirectionality(1),
]
each_family = pytest.mark.parametrize("family", FAMILIES, ids=repr)


def direct_rotation(psi, orders, rotation):
    """sum_n e^{-i m alpha} d^l_mn(beta) e^{-i n gamma} psi_ln, psi of shape (orders, L)."""
    alpha, beta, gamma = rotation
    flm = np.zeros(psi.shape[1] ** 2, dtype=complex)
    for el in range(psi.shape[1]):
        m = np.arange(-el, el + 1)
        for n, row in zip(orders, psi, strict=True):
            turned = np.exp(-1j * (m * alpha + n * gamma)) * small_d(el, n, beta)
            flm[el**2 : (el + 1) ** 2] += row[el] * turned
    return flm


@each_rotation
@each_family
@pytest.mark.parametrize(("bandlimit", "spin"), [(9, 0), (9, 2), (12, -3)])
def test_harmonics_are_those_of_the_rotation(bandlimit, spin, family, rotation):
    wavelets = Wavelets(ScaleDiscretisedTiling(bandlimit, lowest_scale=1), family, spin)
    for scale in wavelets.scales:
        psi, orders = wavelets.wavelet_harmonics(scale), wavelets.orientations_of(scale).orders
        found = rotated_harmonics(wavelets, scale, rotation)
        desired = direct_rotation(psi, orders, rotation)
        assert_close(found, desired, ulps=16 * bandlimit * psi.shape[0])
    phi = wavelets.scaling_harmonics[None, : wavelets.tiling.scaling_bandlimit]
    desired = direct_rotation(phi, (0,), rotation)
    assert_close(rotated_harmonics(wavelets, "scaling", rotation), desired, ulps=16 * bandlimit)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("spin", [0, 2, -1])
def test_coefficients_are_products_with_turned_wavelets(spin, sampling):
    """W^j(rho) = sum_lm f_lm conj((R_rho psi)_lm) at every sample that is tried."""
    transform = SpinWaveletTransform(10, spin, 3, sampling=sampling)
    flm = random_flm(10, spin)
    coefficients = transform.analysis_harmonic(flm)
    rng = np.random.default_rng(1)
    for scale, values in ((j, coefficients[j]) for j in transform.scales):
        grid = transform.grid_of(transform.bandlimits[scale])
        for _ in range(5):
            k, ring, point = (int(rng.integers(n)) for n in values.shape)
            gamma = transform.orientations[k]
            rotation = (grid.longitudes[point], grid.colatitudes[ring], gamma)
            turned = rotated_harmonics(transform.wavelets, scale, rotation)
            desired = np.vdot(turned, flm[: turned.size])
            assert abs(values[k, ring, point] - desired) < 1e-14 * np.linalg.norm(flm)


@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("directions", [1, 2, 3])
def test_coefficients_are_integrals_over_the_sphere(directions, real):
    """W^j(rho) = int f conj(R_rho psi), by Gauss-Legendre weights and a plain sum."""
    bandlimit, spin = 12, 0 if real else 2
    transform = SpinWaveletTransform(bandlimit, spin, directions, real=real)
    flm = random_real_flm(bandlimit) if real else random_flm(bandlimit, spin)
    nodes, weights = np.polynomial.legendre.leggauss(bandlimit)
    longitudes = 2 * np.pi * np.arange(2 * bandlimit - 1) / (2 * bandlimit - 1)
    signal = direct_map(flm, spin, np.arccos(nodes[::-1]), longitudes)
    area = weights[::-1, None] * (2 * np.pi / longitudes.size)
    coefficients = transform.analysis_harmonic(flm)
    for scale in transform.scales[1:]:
        grid = transform.grid_of(transform.bandlimits[scale])
        rotation = (grid.longitudes[1], grid.colatitudes[1], transform.orientations[-1])
        wavelet = transform.wavelet_map(scale, rotation, sampling="gl")
        assert wavelet.dtype == (np.float64 if real else np.complex128)
        integral = np.sum(area * signal * wavelet.conj())
        assert abs(integral - coefficients[scale][-1, 1, 1]) < 1e-13 * np.linalg.norm(flm)
    grid = transform.grid_of(transform.tiling.scaling_bandlimit)
    wavelet = transform.wavelet_map("scaling", (0.0, grid.colatitudes[0], 1.0), sampling="gl")
    integral = np.sum(area * signal * wavelet.conj())
    assert abs(integral - coefficients.scaling[0, 0]) < 1e-13 * np.linalg.norm(flm)


@each_family
def test_scalar_wavelets_are_real_in_pixel_space(family):
    transform = SpinWaveletTransform(9, directionality=family)
    half = SpinWaveletTransform(9, directionality=family, real=True)
    for scale in ("scaling", *transform.scales):
        wavelet = transform.wavelet_map(scale, (0.4, 0.8, 0.2), sampling="mwss")
        size = max(np.max(np.abs(wavelet)), 1.0)
        assert np.max(np.abs(wavelet.imag)) < 1e-14 * size
        real = half.wavelet_map(scale, (0.4, 0.8, 0.2), sampling="mwss")
        np.testing.assert_allclose(wavelet.real, real, rtol=0, atol=1e-14 * size)


@needs_compiler
@pytest.mark.parametrize(("spin", "real"), [(0, True), (2, False)])
def test_maps_are_made_on_any_grid(spin, real):
    transform = SpinWaveletTransform(12, spin, 3, real=real)
    flm = rotated_harmonics(transform.wavelets, 2, ROTATIONS[1])
    own = transform.wavelet_map(2, ROTATIONS[1])
    assert_close(own, transform.harmonic.synthesis(resize(flm, 12)), ulps=0)
    pixels = transform.wavelet_map(2, ROTATIONS[1], nside=4)
    healpix = HealpixTransform(4, 12, spin, real=real).synthesis(resize(flm, 12))
    assert_close(pixels, healpix, ulps=0)
    small, large = (transform.wavelet_map(2, ROTATIONS[1], sampling=MW(n)) for n in (8, 40))
    for values, grid in ((small, MW(8)), (large, MW(40))):
        desired = direct_map(flm, spin, grid.colatitudes, grid.longitudes)
        assert_close(values, desired if not real else desired.real, ulps=1024)


@needs_compiler
def test_wavelets_lie_where_they_are_put():
    """The centroid of |psi|^2 is in the direction (alpha, beta) of the rotation."""
    grid = MW(64)
    sine = np.sin(grid.colatitudes)[:, None]
    points = np.stack(
        [
            sine * np.cos(grid.longitudes),
            sine * np.sin(grid.longitudes),
            np.cos(grid.colatitudes)[:, None] + 0 * grid.longitudes,
        ]
    )
    alpha, beta = 0.9, 1.3
    centre = np.array([np.sin(beta) * np.cos(alpha), np.sin(beta) * np.sin(alpha), np.cos(beta)])
    for family in (
        SteerableDirectionality(3),
        SteerableDirectionality(4),
        CurveletDirectionality(centred=True),
    ):
        transform = SpinWaveletTransform(64, directionality=family)
        wavelet = transform.wavelet_map(4, (alpha, beta, 0.6))
        energy = np.abs(wavelet) ** 2 * sine
        centroid = np.sum(points * energy, axis=(1, 2))
        assert centroid @ centre > 0.999 * np.linalg.norm(centroid)


@needs_compiler
def test_curvelets_that_are_not_centred_lie_on_their_circle():
    """At the place that R (-x) gives, a quarter turn from the pole (alpha, beta)."""
    transform = SpinWaveletTransform(64, directionality=CurveletDirectionality())
    wavelet = np.abs(transform.wavelet_map(5, (0.0, 0.0, 0.8), sampling="mwss"))
    ring, point = np.unravel_index(np.argmax(wavelet), wavelet.shape)
    assert ring == 32
    assert abs(2 * np.pi * point / 128 - (np.pi + 0.8)) < np.pi / 64


def test_synthesis_adds_up_turned_dual_wavelets():
    """f = int d rho W(rho) R_rho psi and the scaling part: of one W its volume times R psi."""
    transform = SpinWaveletTransform(6, 1, 2, original_spin=1, sampling="gl")
    scale, place = 2, (1, 2, 3)
    grid = transform.grid_of(transform.bandlimits[scale])

    def put_one(values):
        values = values.copy()
        values[place] = 1.0
        return values

    single = transform.analysis_harmonic(np.zeros(36)).map({scale: put_one})
    _, weights = np.polynomial.legendre.leggauss(grid.n_rings)
    volume = weights[::-1][2] * 2 * np.pi / grid.n_phi * 2 * np.pi / 2
    rotation = (grid.longitudes[3], grid.colatitudes[2], transform.orientations[1])
    turned = rotated_harmonics(transform.wavelets.dual, scale, rotation)
    found = transform.synthesis_harmonic(single)
    assert_close(found, volume * resize(turned, 6), ulps=4096)


@pytest.mark.parametrize(
    "rotation",
    [(0, 0), (0, np.nan, 0), (0, 1, np.inf), "abc", 3, None, (1j, 0, 0)],
)
def test_rotation_is_three_angles(rotation):
    with pytest.raises(ParameterError, match=r"rotation=.* must be three finite angles"):
        SpinWaveletTransform(8).wavelet_map(2, rotation)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scale": 9}, "scale=9 must be from 0 to 3"),
        ({"scale": "phi"}, "scale='phi' must be an integer"),
        ({"scale": 2, "sampling": "mw", "nside": 4}, "cannot be given with nside=4; drop one"),
        ({"scale": 2, "sampling": MW(4)}, "must have a bandlimit of at least that of scale 2, 8"),
        ({"scale": 2, "sampling": "hpx"}, "sampling='hpx'"),
        ({"scale": 2, "nside": 3.5}, "nside=3.5 must"),
    ],
)
def test_maps_name_the_bad_parameter(options, message):
    with pytest.raises(ParameterError, match=message):
        SpinWaveletTransform(8).wavelet_map(**options)


def test_empty_scales_are_zero():
    wavelets = Wavelets(ScaleDiscretisedTiling(16), SteerableDirectionality(3), 8)
    found = rotated_harmonics(wavelets, 1, (0, 1, 0))
    assert bandlimit_of(found) == 4
    assert not np.any(found)
