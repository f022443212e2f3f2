"""The laws of wavelet coefficients in harmonic space."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.directionality import CurveletDirectionality, RidgeletDirectionality
from spinsdw.errors import DataError, ParameterError, PrecisionWarning, ShapeError
from spinsdw.tiling import CustomTiling
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import (
    EPS,
    assert_close,
    needs_compiler,
    random_flm,
    random_like,
    random_real_flm,
    wavelet_wigner,
)

CASES = [
    (1, 0, {}),
    (2, 0, {"directions": 2}),
    (3, 1, {"directions": 3}),
    (8, 2, {"directions": 3}),
    (8, -3, {"directions": 4, "lowest_scale": 2, "sampling": "mwss"}),
    (8, 0, {"directions": 8}),
    (9, 0, {"directions": 5, "real": True}),
    (9, 1, {"directions": 2, "multiresolution": False}),
    (8, 0, {"directions": 3, "real": True, "multiresolution": False, "sampling": "gl"}),
    (8, 1, {"directionality": CurveletDirectionality()}),
    (8, 0, {"directionality": CurveletDirectionality(centred=True), "real": True}),
    (9, 2, {"directionality": RidgeletDirectionality(1), "lowest_scale": 1}),
    (9, 2, {"directions": 3, "original_spin": -2}),
    (3, 0, {"directions": 2, "tiling": CustomTiling([1, 0, 0], [[0, 0, 0], [0, 1, 1]])}),
    pytest.param(65, 2, {"directions": 5}, marks=needs_compiler),
]
every_case = pytest.mark.parametrize(("bandlimit", "spin", "options"), CASES)


def make(bandlimit, spin, options, batch=()):
    transform = SpinWaveletTransform(bandlimit, spin, **options)
    draw = random_real_flm if transform.real else random_flm
    flm = draw(bandlimit, batch=batch)
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    flm[..., (el < abs(spin)) | transform.wavelets.lost_degrees[el]] = 0
    return transform, flm


def random_parts(transform, seed=7):
    zeros = transform.analysis_wigner(np.zeros(transform.bandlimit**2))
    return {key: random_like(one, seed=seed + i) for i, (key, one) in enumerate(zeros.items())}


def dot(one, other):
    return sum(np.vdot(other[key], one[key]) for key in one)


@every_case
def test_analysis_is_the_product_with_the_wavelets(bandlimit, spin, options):
    """W^j_lmn = 8 pi^2/(2l+1) f_lm conj(psi_ln), W^phi_lm = sqrt(4 pi/(2l+1)) f_lm phi_l0."""
    transform, flm = make(bandlimit, spin, options)
    parts = transform.analysis_wigner(flm)
    assert list(parts) == ["scaling", *transform.scales]
    for scale in transform.scales:
        size = transform.tiling.scale_bandlimit(scale) ** 2
        desired = wavelet_wigner(flm, transform.wavelets, scale)[:, :size]
        assert parts[scale].shape == desired.shape
        assert_close(parts[scale], desired, ulps=4)
    size = transform.tiling.scaling_bandlimit**2
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)[:size]
    phi = transform.wavelets.scaling_harmonics[el]
    assert_close(parts["scaling"], np.sqrt(4 * np.pi / (2 * el + 1)) * phi * flm[:size], ulps=4)


@every_case
def test_synthesis_undoes_analysis_for_every_signal_of_a_batch(bandlimit, spin, options):
    transform, flm = make(bandlimit, spin, options, batch=(2, 1))
    parts = transform.analysis_wigner(flm)
    assert all(values.shape[:2] == (2, 1) for values in parts.values())
    assert_close(transform.synthesis_wigner(parts), flm, ulps=64)


@every_case
def test_adjoints_are_those_of_the_plain_dot_product(bandlimit, spin, options):
    transform, flm = make(bandlimit, spin, options)
    noise = random_parts(transform)
    pairs = [
        (transform.analysis_wigner(flm), transform.adjoint_analysis_wigner(noise)),
        (transform.adjoint_synthesis_wigner(flm), transform.synthesis_wigner(noise)),
    ]
    for parts, found in pairs:
        size = np.sqrt(dot(parts, parts).real * dot(noise, noise).real)
        assert abs(dot(parts, noise) - np.vdot(found, flm)) <= 64 * EPS * size


@every_case
def test_samples_and_wigner_coefficients_hold_the_same(bandlimit, spin, options):
    """Of an analysis, in both directions: the sums of W_lmn conj(D^l_mn) at every sample."""
    transform, flm = make(bandlimit, spin, options, batch=(2,))
    coefficients, parts = transform.analysis_harmonic(flm), transform.analysis_wigner(flm)
    sampled = transform.wigner_to_coefficients(parts)
    found = transform.coefficients_to_wigner(coefficients)
    gain = max(1.0, np.sqrt(np.max(transform.wavelets.frame_response)))
    atol = (8 * bandlimit + 64) * EPS * gain * np.linalg.norm(flm)
    assert dict(sampled.parameters) == dict(coefficients.parameters)
    np.testing.assert_allclose(sampled.scaling, coefficients.scaling, rtol=0, atol=atol)
    for scale in transform.scales:
        assert sampled[scale].dtype == coefficients[scale].dtype
        np.testing.assert_allclose(sampled[scale], coefficients[scale], rtol=0, atol=atol)
    for key, values in parts.items():
        np.testing.assert_allclose(found[key], values, rtol=0, atol=8 * np.pi**2 * atol)


def test_any_wigner_coefficients_come_back_from_their_samples():
    """Also those that are the analysis of no signal, within |n| <= l."""
    transform = SpinWaveletTransform(8, 2, 3)
    parts = random_parts(transform)
    for scale in transform.scales:
        orders = np.abs(transform.wavelets.orientations_of(scale).orders)
        size = int(np.sqrt(parts[scale].shape[-1]))
        el = np.repeat(np.arange(size), 2 * np.arange(size) + 1)
        parts[scale][orders[:, None] > el] = 0
    found = transform.coefficients_to_wigner(transform.wigner_to_coefficients(parts))
    for key, values in parts.items():
        assert_close(found[key], values, ulps=512)


def test_ridgelets_warn_of_what_they_lose():
    transform = SpinWaveletTransform(8, directionality=RidgeletDirectionality())
    with pytest.warns(PrecisionWarning, match="will not come back"):
        transform.analysis_wigner(random_flm(8))


@pytest.mark.parametrize(
    "name", ["synthesis_wigner", "adjoint_analysis_wigner", "wigner_to_coefficients"]
)
@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({1: np.zeros((3, 9))}, ShapeError, r"scale 1 has shape \(3, 9\)"),
        ({1: np.zeros((2, 16))}, ShapeError, r"scale 1 has shape \(2, 16\); it must be \(3, 16\)"),
        ({1: np.zeros((5, 3, 16))}, ShapeError, r"it must be \(3, 16\), as the others are"),
        ({"scaling": np.zeros((2, 1))}, ShapeError, r"scale 0 has .* must be \(2, 3, 4\)"),
        ({1: np.full((3, 16), np.nan)}, DataError, "scale 1 has NaN"),
        ({9: np.zeros((3, 16))}, ParameterError, "must be a mapping with 'scaling' and the scales"),
    ],
)
def test_parts_that_cannot_be_used_are_refused(name, change, error, message):
    transform = SpinWaveletTransform(8, 0, 3)
    parts = transform.analysis_wigner(random_flm(8))
    with pytest.raises(error, match=message):
        getattr(transform, name)(parts | change)


@pytest.mark.parametrize("parts", [None, np.zeros(64), {}])
def test_parts_are_a_mapping(parts):
    with pytest.raises(ParameterError, match="as analysis_wigner returns it"):
        SpinWaveletTransform(8).synthesis_wigner(parts)
