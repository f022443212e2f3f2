"""The laws of energies: what analysis preserves, against sums over Wigner coefficients."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.directionality import CurveletDirectionality, RidgeletDirectionality
from spinsdw.energy import energies, inner_product, norm
from spinsdw.errors import ParameterError, ShapeError
from spinsdw.tiling import ScaleDiscretisedTiling
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import (
    assert_close,
    direct_function,
    needs_compiler,
    random_flm,
    random_real_flm,
    wavelet_wigner,
)

# bandlimit, spin, directions, lowest scale, sampling, multiresolution
CASES = [
    (1, 0, 1, 0, "mw", True),
    (2, 1, 2, 0, "mwss", True),
    (3, -2, 3, 1, "mw", True),
    (12, 2, 3, 0, "mw", True),
    (12, 0, 4, 1, "mwss", True),
    (13, -3, 2, 2, "mw", False),
    (9, 0, 9, 0, "mwss", False),
    pytest.param(64, 2, 5, 2, "mw", True, marks=needs_compiler),
    pytest.param(64, -2, 4, 2, "mwss", True, marks=needs_compiler),
]
every_case = pytest.mark.parametrize(
    ("bandlimit", "spin", "directions", "lowest", "sampling", "multiresolution"), CASES
)


def make(bandlimit, spin, directions, lowest, sampling, multiresolution):
    return SpinWaveletTransform(
        bandlimit,
        spin,
        directions,
        lowest_scale=lowest,
        sampling=sampling,
        multiresolution=multiresolution,
    )


@every_case
def test_energies_add_up_to_that_of_the_signal(
    bandlimit, spin, directions, lowest, sampling, multiresolution
):
    """eq-parseval: norm^2 = sum |f_lm|^2, for each signal of a batch."""
    transform = make(bandlimit, spin, directions, lowest, sampling, multiresolution)
    flm = random_flm(bandlimit, spin, batch=(2,))
    found = norm(transform, transform.analysis_harmonic(flm)) ** 2
    assert found.shape == (2,)
    assert_close(found, np.sum(np.abs(flm) ** 2, axis=-1), ulps=16 * bandlimit)


@every_case
def test_each_scale_has_the_energy_of_its_wigner_coefficients(
    bandlimit, spin, directions, lowest, sampling, multiresolution
):
    """sum_k energy_jk = sum_lmn (2l+1)/(8 pi^2) |W_lmn|^2."""
    transform = make(bandlimit, spin, directions, lowest, sampling, multiresolution)
    flm = random_flm(bandlimit, spin)
    found = energies(transform, transform.analysis_harmonic(flm))
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    total = np.sum(np.abs(flm) ** 2)
    for scale in transform.scales:
        wigner = wavelet_wigner(flm, transform.wavelets, scale)
        desired = np.sum((2 * el + 1) / (8 * np.pi**2) * np.abs(wigner) ** 2)
        assert found[scale].shape == (directions,)
        assert abs(found[scale].sum() - desired) < 1e-14 * bandlimit * total


@pytest.mark.parametrize(
    "directionality",
    [
        CurveletDirectionality(),
        CurveletDirectionality(centred=True),
        RidgeletDirectionality(),
    ],
    ids=repr,
)
@pytest.mark.parametrize(("spin", "real"), [(0, True), (0, False), (3, False)])
def test_curvelets_and_ridgelets_keep_the_products_of_signals(directionality, spin, real):
    """<W, V> = sum f_lm conj(g_lm), scale by scale sum_lmn (2l+1)/(8 pi^2) |W_lmn|^2."""
    transform = SpinWaveletTransform(9, spin, directionality=directionality, real=real)
    el = np.repeat(np.arange(9), 2 * np.arange(9) + 1)
    one, other = ((random_real_flm if real else random_flm)(9, seed=seed) for seed in (1, 2))
    for flm in (one, other):
        flm[(el < spin) | transform.wavelets.lost_degrees[el]] = 0
    first, second = (transform.analysis_harmonic(flm) for flm in (one, other))
    bound = np.linalg.norm(one) * np.linalg.norm(other)
    assert abs(inner_product(transform, first, second) - np.vdot(other, one)) < 1e-14 * bound
    found = energies(transform, first)
    for scale in transform.scales:
        wigner = wavelet_wigner(one, transform.wavelets, scale)
        desired = np.sum((2 * el + 1) / (8 * np.pi**2) * np.abs(wigner) ** 2)
        assert found[scale].shape == transform.shapes[scale][:1]
        assert abs(found[scale].sum() - desired) < 1e-13 * np.sum(np.abs(one) ** 2)


@pytest.mark.parametrize(("spin", "directions"), [(0, 2), (2, 3), (-1, 4)])
@pytest.mark.parametrize("sampling", ["mw", "mwss"])
def test_energy_at_an_orientation_is_an_integral_over_the_sphere(spin, directions, sampling):
    """2 pi / N integral |W(theta, phi, gamma_k)|^2, on Gauss-Legendre rings of twice the degree."""
    bandlimit = 8
    transform = SpinWaveletTransform(bandlimit, spin, directions, sampling=sampling)
    flm = random_flm(bandlimit, spin)
    found = energies(transform, transform.analysis_harmonic(flm))
    nodes, weights = np.polynomial.legendre.leggauss(bandlimit)
    phi = 2 * np.pi * np.arange(2 * bandlimit - 1) / (2 * bandlimit - 1)
    alpha, beta = (angle.ravel() for angle in np.meshgrid(phi, np.arccos(nodes)))
    area = np.repeat(weights, phi.size) * 2 * np.pi / phi.size
    orders = transform.wavelets.directionality.orders
    for scale in transform.scales[1:]:
        wigner = wavelet_wigner(flm, transform.wavelets, scale)
        for k, gamma in enumerate(transform.orientations):
            values = direct_function(wigner, orders, (alpha, beta, gamma))
            desired = 2 * np.pi / directions * np.sum(area * np.abs(values) ** 2)
            assert abs(found[scale][k] - desired) < 1e-13 * np.sum(np.abs(flm) ** 2)


@pytest.mark.parametrize("sampling", ["mw", "mwss"])
@pytest.mark.parametrize("directions", [1, 2, 3])
def test_real_signals_have_real_products(sampling, directions):
    transform = SpinWaveletTransform(12, 0, directions, sampling=sampling, real=True)
    one, other = random_real_flm(12, seed=1), random_real_flm(12, seed=2)
    found = inner_product(
        transform, transform.analysis_harmonic(one), transform.analysis_harmonic(other)
    )
    assert found.dtype == np.float64
    bound = np.linalg.norm(one) * np.linalg.norm(other)
    assert abs(found - np.vdot(other, one)) < 1e-14 * bound


def test_analysis_preserves_inner_products():
    """<W_f, W_g> = sum f_lm conj(g_lm), place by place in a batch."""
    transform = SpinWaveletTransform(12, 2, 3)
    one, other = random_flm(12, 2, batch=(2, 2)), random_flm(12, 2, batch=(2, 2), seed=1)
    found = inner_product(
        transform, transform.analysis_harmonic(one), transform.analysis_harmonic(other)
    )
    assert_close(found, np.sum(one * other.conj(), axis=-1), ulps=512)


def test_norm_is_zero_for_zero_and_of_empty_batches():
    transform = SpinWaveletTransform(8, 2, 2)
    assert norm(transform, transform.analysis_harmonic(np.zeros(64))) == 0
    assert norm(transform, transform.analysis_harmonic(np.zeros((0, 64)))).shape == (0,)


def test_a_plain_sum_is_no_integral():
    """The pole is one point and a whole ring of samples: the plain norm depends on the frame."""
    transform = SpinWaveletTransform(16, 0, 1)
    flm = np.zeros(256)
    flm[12 * 12 + 12] = 1.0  # zonal: large at the poles
    other = np.zeros(256)
    other[12 * 12 + 24] = 1.0  # sectoral: large on the equator
    pole, equator = (transform.analysis_harmonic(one) for one in (flm, other))
    assert_close(norm(transform, pole), norm(transform, equator), ulps=64)
    assert pole.norm() > 1.2 * equator.norm()


def test_coefficients_must_be_the_transforms():
    transform = SpinWaveletTransform(8, 2, 2)
    found = transform.analysis_harmonic(random_flm(8, 2))
    with pytest.raises(ShapeError, match="use the transform that made them"):
        norm(SpinWaveletTransform(16, 2, 2), found)
    spline = SpinWaveletTransform(8, 2, 2, tiling=ScaleDiscretisedTiling(8, quadrature="s2let"))
    with pytest.raises(ParameterError, match="use the transform that made them"):
        energies(spline, found)
    both = transform.analysis_harmonic(random_flm(8, 2, batch=(2,)))
    with pytest.raises(ShapeError, match=r"have the batches \(\) and \(2,\)"):
        inner_product(transform, found, both)


@pytest.mark.parametrize("real", [False, True])
def test_single_precision_is_summed_in_double(real):
    """|norm - norm of the rounded coefficients| stays at the roundings of single precision."""
    flm = random_real_flm(16)
    single = SpinWaveletTransform(16, 0, 3, real=real, dtype="complex64")
    coefficients = single.analysis_harmonic(flm)
    for found in (norm(single, coefficients), inner_product(single, coefficients, coefficients)):
        assert found.dtype == (np.complex128 if np.iscomplexobj(found) else np.float64)
    assert abs(norm(single, coefficients) / np.linalg.norm(flm) - 1) < 1e-7
