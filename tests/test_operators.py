"""Operators are the transforms on vectors, and solvers can use them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, aslinearoperator, eigsh, lsmr

from spinsdw.directionality import CurveletDirectionality, RidgeletDirectionality
from spinsdw.errors import ParameterError
from spinsdw.harmonics import is_real_field
from spinsdw.operators import analysis_operator, frame_operator, synthesis_operator
from spinsdw.ring_transform import HealpixTransform
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.vector_spaces import harmonic_space, wigner_space
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform
from tests.helpers import EPS, assert_close, needs_compiler, random_flm, random_real_flm

DOORS = ["pixel", "harmonic", "wigner"]
WAVELETS = [
    SpinWaveletTransform(1),
    SpinWaveletTransform(3, 1, 2, sampling="mwss"),
    SpinWaveletTransform(7, 2, 3, lowest_scale=1),
    SpinWaveletTransform(6, 0, 2, real=True),
    SpinWaveletTransform(6, 0, 5, real=True, multiresolution=False, sampling="gl"),
    SpinWaveletTransform(6, -1, 2, original_spin=1),
    SpinWaveletTransform(5, 1, directionality=CurveletDirectionality()),
    SpinWaveletTransform(5, 0, directionality=CurveletDirectionality(centred=True), real=True),
]
OTHERS = [
    SpinHarmonicTransform(6, -2),
    SpinHarmonicTransform(6, real=True, sampling="mwss"),
    WignerTransform(5, (-2, 0, 2)),
    WignerTransform(5, (-1, 1), real=True),
    WignerTransform(5, (0, 1, 3)),
]
PAIRS = [(transform, door) for transform in WAVELETS for door in DOORS]
PAIRS += [(transform, None) for transform in OTHERS]
each_pair = pytest.mark.parametrize(("transform", "door"), PAIRS)


def operators(transform, door):
    return analysis_operator(transform, door), synthesis_operator(transform, door)


def random_vector(size, dtype, seed=0):
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(size)
    return values + 1j * rng.standard_normal(size) if np.dtype(dtype).kind == "c" else values


def random_signal(transform, door, seed=0):
    """Draw a band-limited signal that the wavelets hold, and its vector."""
    space = analysis_operator(transform, door).domain
    flm = (random_real_flm if transform.real else random_flm)(transform.bandlimit, seed=seed)
    el = np.repeat(np.arange(transform.bandlimit), 2 * np.arange(transform.bandlimit) + 1)
    flm[(el < abs(transform.spin)) | transform.wavelets.lost_degrees[el]] = 0
    return space.to_vector(transform.harmonic.synthesis(flm) if door == "pixel" else flm)


@each_pair
@pytest.mark.filterwarnings("ignore::spinsdw.errors.PrecisionWarning")
def test_adjoint_is_that_of_the_dot_product(transform, door):
    """<A x, y> = <x, A^H y> for any vectors, and of A^H the adjoint is A."""
    for operator in operators(transform, door):
        x = random_vector(operator.shape[1], operator.dtype)
        y = random_vector(operator.shape[0], operator.dtype, seed=1)
        image, back = operator @ x, operator.H @ y
        size = np.linalg.norm(image) * np.linalg.norm(y) + np.linalg.norm(back) * np.linalg.norm(x)
        assert abs(np.vdot(y, image) - np.vdot(back, x)) <= 64 * transform.bandlimit * EPS * size
        assert np.array_equal(operator.H.H @ x, image)


@each_pair
@pytest.mark.filterwarnings("ignore::spinsdw.errors.PrecisionWarning")
def test_shapes_and_dtypes_are_those_of_vectors(transform, door):
    expected = np.float64 if transform.real else np.complex128
    for operator in operators(transform, door):
        assert isinstance(operator, LinearOperator)
        assert operator.shape == (operator.range.size, operator.domain.size)
        assert operator.dtype == operator.H.dtype == expected
        assert operator.H.shape == operator.shape[::-1]
        x = random_vector(operator.shape[1], operator.dtype)
        assert (operator @ x).shape == (operator.shape[0],)
        assert (operator @ x).dtype == expected
        assert (operator @ x[:, None]).shape == (operator.shape[0], 1)
        assert (operator @ np.zeros((x.size, 0))).shape == (operator.shape[0], 0)


@each_pair
@pytest.mark.filterwarnings("ignore::spinsdw.errors.PrecisionWarning")
def test_columns_are_transformed_one_by_one(transform, door):
    for operator in operators(transform, door):
        columns = random_vector((operator.shape[1], 3), operator.dtype)
        found = operator @ columns
        for k in range(3):
            assert_close(found[:, k], operator @ columns[:, k], ulps=16)


@each_pair
@pytest.mark.filterwarnings("ignore::spinsdw.errors.PrecisionWarning")
def test_operators_are_linear_over_complex_numbers(transform, door):
    """A (x + i y) = A x + i A y, for real transforms too."""
    for operator in operators(transform, door):
        x, y = (random_vector(operator.shape[1], float, seed=seed) for seed in (0, 1))
        assert_close(operator @ (x + 1j * y), operator @ x + 1j * (operator @ y), ulps=512)


@each_pair
@pytest.mark.filterwarnings("ignore::spinsdw.errors.PrecisionWarning")
def test_spaces_turn_vectors_into_objects_and_back(transform, door):
    """from_vector and to_vector are inverse, also of batches, and keep the dot product."""
    for space in (
        analysis_operator(transform, door).domain,
        analysis_operator(transform, door).range,
    ):
        vectors = random_vector((2, 3, space.size), space.dtype)
        assert_close(space.to_vector(space.from_vector(vectors)), vectors, ulps=4)


@pytest.mark.parametrize("bandlimit", [1, 2, 7])
def test_vectors_of_real_fields_keep_dot_products(bandlimit):
    """<x, y> = sum f_lm conj(g_lm), and every vector is a real field."""
    space = harmonic_space(bandlimit, real=True)
    one, other = (random_real_flm(bandlimit, seed=seed) for seed in (0, 1))
    product = space.to_vector(one) @ space.to_vector(other)
    assert_close(product, np.vdot(other, one).real, ulps=64 * bandlimit)
    flm = space.from_vector(random_vector(bandlimit**2, float))
    assert is_real_field(flm)
    assert_close(np.linalg.norm(flm), np.linalg.norm(random_vector(bandlimit**2, float)), 16)


@pytest.mark.parametrize("orders", [(0,), (-1, 1), (-2, 0, 2), (-3, -1, 1, 3), (-1, 0, 1)])
def test_vectors_of_real_functions_keep_dot_products(orders):
    transform = WignerTransform(5, orders, real=True)
    space = wigner_space(5, orders, real=True)
    found = space.from_vector(random_vector(space.size, float))
    functions = transform.synthesis(found)
    rng = np.random.default_rng(3)
    other = transform.analysis(rng.standard_normal(functions.shape))
    product = space.to_vector(found) @ space.to_vector(other)
    assert_close(product, np.vdot(other, found), ulps=2048)
    el = np.repeat(np.arange(5), 2 * np.arange(5) + 1)
    held = np.abs(orders)[:, None] <= el
    assert_close(transform.analysis(functions)[held], found[held], ulps=512)


@needs_compiler
@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize("transform", WAVELETS)
def test_least_squares_recover_a_signal_from_its_coefficients(transform, door):
    """lsmr finds x with A x = W, and W with S W = x; of maps, which have more samples than a
    band-limited signal has numbers, their harmonic coefficients.
    """
    signal = random_signal(transform, door)
    operator = analysis_operator(transform, door)
    solution = lsmr(operator, operator @ signal, atol=1e-13, btol=1e-13, conlim=0, maxiter=2000)[0]
    size = np.linalg.norm(signal)
    assert np.linalg.norm(operator @ (solution - signal)) <= 1e-10 * size
    difference = operator.domain.from_vector(solution - signal)
    if door == "pixel":
        difference = transform.harmonic.analysis(difference)
    assert np.linalg.norm(difference) <= 1e-9 * size
    synthesis = synthesis_operator(transform, door)
    found = lsmr(synthesis, signal, atol=1e-13, btol=1e-13, conlim=0, maxiter=2000)[0]
    assert np.linalg.norm(synthesis @ found - signal) <= 1e-9 * size


@pytest.mark.parametrize("directions", [1, 3])
def test_wigner_analysis_is_an_isometry_in_the_right_weights(directions):
    """<W, V> = sum (2l+1)/(8 pi^2) W conj(V): the frame operator is the identity."""
    transform = SpinWaveletTransform(9, 2, directions)
    operator = analysis_operator(transform, "wigner")
    weights = {}
    for key, part in operator.range.from_vector(np.zeros(operator.shape[0])).items():
        el = np.sqrt(np.arange(part.shape[-1])).astype(int)
        weights[key] = np.ones(part.shape) if key == "scaling" else 0 * part.real + 2 * el + 1
        weights[key] /= 1 if key == "scaling" else 8 * np.pi**2
    scaled = aslinearoperator(np.diag(operator.range.to_vector(weights).real))
    flm = random_flm(9, 2)
    assert_close(operator.H @ (scaled @ (operator @ flm)), flm, ulps=64)
    assert_close(frame_operator(transform) @ flm, flm, ulps=64)


@pytest.mark.parametrize(
    "transform",
    [
        SpinWaveletTransform(8, 2, 3),
        SpinWaveletTransform(8, 0, 2, original_spin=1, lowest_scale=2),
        SpinWaveletTransform(8, 0, 3, real=True, original_spin=-2),
        SpinWaveletTransform(8, 1, directionality=RidgeletDirectionality(1)),
        SpinWaveletTransform(6, directionality=CurveletDirectionality()),
    ],
)
def test_frame_bounds_are_the_extreme_eigenvalues(transform):
    """Of the degrees held, and sum |W|^2 with integrals lies between them."""
    operator = frame_operator(transform)
    matrix = operator @ np.eye(operator.shape[0])
    assert_close(matrix, matrix.conj().T, ulps=0)
    el = np.repeat(np.arange(transform.bandlimit), 2 * np.arange(transform.bandlimit) + 1)
    wavelets = transform.wavelets
    held = (el >= wavelets.lowest_degree) & ~wavelets.lost_degrees[el]
    eigenvalues = np.linalg.eigvalsh(matrix[np.ix_(held, held)])
    lower, upper = wavelets.frame_bounds
    assert_close([lower, upper], [eigenvalues[0], eigenvalues[-1]], ulps=64)
    largest = eigsh(operator, k=1, return_eigenvectors=False)[0]
    assert_close(largest, upper, ulps=4096)
    signal = random_signal(transform, "harmonic", seed=5)
    parts = transform.analysis_wigner(operator.domain.from_vector(signal))
    energy = np.sum(np.abs(parts.pop("scaling")) ** 2)
    for part in parts.values():
        degree = np.sqrt(np.arange(part.shape[-1])).astype(int)
        energy += np.sum((2 * degree + 1) / (8 * np.pi**2) * np.abs(part) ** 2)
    power = np.sum(np.abs(signal) ** 2)
    assert lower * power * (1 - 1e-14) <= energy <= upper * power * (1 + 1e-14)
    assert_close(np.vdot(signal, operator @ signal).real, energy, ulps=512)


@needs_compiler
@pytest.mark.parametrize(("spin", "real"), [(0, True), (2, False)])
def test_healpix_maps_are_fitted_by_least_squares(spin, real):
    transform = HealpixTransform(8, 12, spin, real=real)
    operator = synthesis_operator(transform)
    flm = random_real_flm(12) if real else random_flm(12, spin)
    vector = operator.domain.to_vector(flm)
    solution = lsmr(operator, operator @ vector, atol=1e-14, btol=1e-14)[0]
    assert np.linalg.norm(solution - vector) < 1e-12 * np.linalg.norm(vector)
    with pytest.raises(ParameterError, match="has no analysis; take the adjoint of its synthesis"):
        analysis_operator(transform)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: analysis_operator(3), "transform=3 must be a SpinWaveletTransform, SpinHarm"),
        (lambda: synthesis_operator(WAVELETS[2], "map"), "door='map' must be one of pixel, harm"),
        (lambda: synthesis_operator(OTHERS[0], "pixel"), "door='pixel' is for wavelet transforms"),
        (lambda: frame_operator(OTHERS[0]), r"transform=.* must be a SpinWaveletTransform"),
    ],
)
def test_operators_name_the_bad_parameter(make, message):
    with pytest.raises(ParameterError, match=message):
        make()
