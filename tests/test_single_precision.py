"""Maps and wavelet coefficients stored in single precision: what it costs in accuracy.

u = 2**-24 is the unit roundoff of what is stored; every sum is of double precision.
"""

from __future__ import annotations

import pickle
import re

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.directionality import CurveletDirectionality
from spinsdw.errors import ParameterError
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import (
    assert_close,
    needs_compiler,
    random_flm,
    random_like,
    random_real_flm,
    relative_error,
    sizes,
)

U = 2.0**-24
SIGNALS = [(0, True), (0, False), (2, False), (-3, False)]
GRIDS = ["mw", "mwss", "gl", "cc"]


def signal(bandlimit, spin, *, real, batch=()):
    if real:
        return random_real_flm(bandlimit, batch=batch)
    return random_flm(bandlimit, spin, batch=batch)


def assert_near(found, desired, roundings):
    """||found - desired|| <= roundings u ||desired||, in single precision."""
    assert found.dtype in (np.complex64, np.float32)
    assert np.iscomplexobj(found) == np.iscomplexobj(desired)
    assert relative_error(found, desired) <= roundings * U


def assert_coefficients_near(found, desired, roundings):
    """As `assert_near` over all scales together; scales are weighed as their numbers."""
    assert {found.scaling.dtype, *(found[j].dtype for j in found)} == {found.scaling.dtype}
    assert found.scaling.dtype in (np.complex64, np.float32)
    assert (found - desired).norm() <= roundings * U * desired.norm()


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("spin", "real"), SIGNALS)
@pytest.mark.parametrize("bandlimit", sizes(4, 11, 64))
def test_maps_are_rounded_twice(bandlimit, spin, real, sampling):
    """Once as Fourier columns, once as maps; the transform between them is unitary."""
    options = {"sampling": sampling, "real": real}
    single = SpinHarmonicTransform(bandlimit, spin, dtype="complex64", **options)
    double = SpinHarmonicTransform(bandlimit, spin, **options)
    flm = signal(bandlimit, spin, real=real)
    assert_near(single.synthesis(flm), double.synthesis(flm), 2)
    # The quadrature between columns and columns: another two.
    assert_near(single.adjoint_analysis(flm), double.adjoint_analysis(flm), 6)


@pytest.mark.parametrize("sampling", GRIDS)
@pytest.mark.parametrize(("spin", "real"), SIGNALS)
@pytest.mark.parametrize("bandlimit", sizes(4, 11, 64))
def test_harmonic_coefficients_stay_double_and_come_back(bandlimit, spin, real, sampling):
    options = {"sampling": sampling, "real": real}
    single = SpinHarmonicTransform(bandlimit, spin, dtype="complex64", **options)
    double = SpinHarmonicTransform(bandlimit, spin, **options)
    flm = signal(bandlimit, spin, real=real)
    found = single.analysis(single.synthesis(flm))
    assert found.dtype == np.complex128
    assert relative_error(found, flm) <= 6 * U
    maps = double.synthesis(flm)
    assert relative_error(single.adjoint_synthesis(maps), double.adjoint_synthesis(maps)) <= 2 * U


@pytest.mark.parametrize("directions", [1, 2, 3])
@pytest.mark.parametrize(("spin", "real"), SIGNALS)
@pytest.mark.parametrize("bandlimit", sizes(6, 48))
def test_wavelet_coefficients_are_rounded_a_few_times(bandlimit, spin, real, directions):
    options = {"directions": directions, "real": real}
    single = SpinWaveletTransform(bandlimit, spin, dtype="complex64", **options)
    double = SpinWaveletTransform(bandlimit, spin, **options)
    flm = signal(bandlimit, spin, real=real)
    maps = double.harmonic.synthesis(flm)
    coefficients = double.analysis(maps)
    assert_coefficients_near(single.analysis_harmonic(flm), coefficients, 2)
    assert_coefficients_near(single.analysis(maps), coefficients, 6)
    assert_coefficients_near(
        single.adjoint_synthesis_harmonic(flm), double.adjoint_synthesis_harmonic(flm), 6
    )
    assert relative_error(single.synthesis_harmonic(single.analysis_harmonic(flm)), flm) <= 6 * U
    assert_near(single.synthesis(single.analysis(maps)), maps, 10)
    assert_near(single.adjoint_analysis(coefficients), double.adjoint_analysis(coefficients), 10)


@needs_compiler
@pytest.mark.parametrize(("spin", "real"), [(0, True), (2, False)])
def test_curvelets_are_stored_in_single_precision_too(spin, real):
    options = {"real": real, "directionality": CurveletDirectionality()}
    single = SpinWaveletTransform(40, spin, dtype="complex64", **options)
    double = SpinWaveletTransform(40, spin, **options)
    coefficients = double.analysis_harmonic(signal(40, spin, real=real))
    flm = double.synthesis_harmonic(coefficients)
    assert_coefficients_near(single.analysis_harmonic(flm), coefficients, 4)
    assert relative_error(single.synthesis_harmonic(coefficients), flm) <= 10 * U


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("bandlimit", [64, 128, 256, 512, 1024])
@pytest.mark.parametrize(("spin", "real"), [(0, True), (2, False)])
def test_round_trips_do_not_lose_more_at_higher_degree(bandlimit, spin, real):
    """Largest error of a map, relative to its largest value, and the root mean square."""
    transform = SpinWaveletTransform(bandlimit, spin, 3, real=real, dtype="complex64")
    flm = signal(bandlimit, spin, real=real)
    maps = transform.harmonic.synthesis(flm)
    assert relative_error(transform.harmonic.analysis(maps), flm) <= U
    found = transform.synthesis(transform.analysis(maps))
    assert np.max(np.abs(found - maps)) <= 3 * U * np.max(np.abs(maps))
    assert relative_error(found, maps) <= 1.5 * U


@pytest.mark.parametrize(("spin", "real"), [(0, True), (2, False)])
def test_adjoints_agree_to_the_roundings(spin, real):
    """<A f, g> = <f, A* g> for A = analysis and synthesis."""
    transform = SpinWaveletTransform(16, spin, 3, real=real, dtype="complex64")
    flm = signal(16, spin, real=real)
    coefficients = transform.analysis_harmonic(flm).map(random_like)
    pairs = (
        (transform.analysis_harmonic, transform.adjoint_analysis_harmonic),
        (transform.adjoint_synthesis_harmonic, transform.synthesis_harmonic),
    )
    for there, back in pairs:
        made = there(flm)
        left = sum(
            np.vdot(ours.astype(complex), theirs)
            for ours, theirs in (
                (made.scaling, coefficients.scaling),
                *((made[j], coefficients[j]) for j in made),
            )
        )
        right = np.vdot(flm, back(coefficients))
        scale = made.norm() * coefficients.norm()
        assert abs(left.real - right.real) <= 10 * U * scale


@pytest.mark.parametrize("real", [False, True])
def test_batches_and_threads_change_no_bit(real):
    make = SpinWaveletTransform
    one, two = (make(16, 0, 2, real=real, dtype="complex64", threads=n) for n in (1, 2))
    flm = signal(16, 0, real=real, batch=(3,))
    together = two.analysis_harmonic(flm)
    back = two.synthesis(together)
    assert back.dtype == (np.float32 if real else np.complex64)
    for i, row in enumerate(flm):
        alone = one.analysis_harmonic(row)
        for j in alone:
            assert_array_equal(together[j][i], alone[j])
        assert_array_equal(back[i], one.synthesis(alone))


@pytest.mark.parametrize("dtype", ["complex64", "complex128"])
def test_maps_of_any_type_are_analysed(dtype):
    """Single precision is exact in double, so nothing but sums can differ."""
    transform = SpinHarmonicTransform(8, 0, dtype=dtype)
    maps = random_like(np.empty((8, 15), dtype=complex)).astype(np.complex64)
    desired = SpinHarmonicTransform(8, 0).analysis(maps.astype(complex))
    for given in (maps, maps.astype(">c8"), maps.astype(complex), np.asfortranarray(maps)):
        assert_close(
            transform.analysis(given), desired, ulps=64 if dtype == "complex128" else 2**32
        )
    whole = np.round(4 * maps.real)
    for kind in (np.int16, np.int64, np.float16, np.float32, ">f4", np.longdouble):
        assert_array_equal(transform.analysis(whole.astype(kind)), transform.analysis(whole))


def test_coefficients_of_one_precision_are_taken_by_a_transform_of_the_other():
    single, double = (SpinWaveletTransform(8, 2, dtype=d) for d in ("complex64", "complex128"))
    flm = random_flm(8, 2)
    assert relative_error(double.synthesis_harmonic(single.analysis_harmonic(flm)), flm) <= 6 * U
    assert relative_error(single.synthesis_harmonic(double.analysis_harmonic(flm)), flm) <= 6 * U


def single_coefficients(*, real=False):
    transform = SpinWaveletTransform(8, 0, 2, real=real, dtype="complex64")
    return transform.analysis_harmonic(signal(8, 0, real=real))


@pytest.mark.parametrize("real", [False, True])
def test_arithmetic_keeps_single_precision(real):
    a = single_coefficients(real=real)
    stored = a.scaling.dtype
    weights = {"scaling": np.float64(2), 1: np.linspace(0, 1, 7), 2: 3}
    for found in (
        a + a,
        a - a,
        -a,
        2 * a,
        2.5 * a,
        np.float64(2.5) * a,
        a * np.array(2.5),
        a / 3,
        a / np.float64(3),
        a * weights,
        a.copy(),
        a.threshold(0.1),
        a.reshape_batch((1,)),
        pickle.loads(pickle.dumps(a)),
    ):
        assert {found.scaling.dtype, *(found[j].dtype for j in found)} == {stored}
    assert (1j * a).scaling.dtype == np.complex64
    assert {values.dtype for values in a.steer(0.3).values()} == {stored}
    double = a.map(lambda values: np.asarray(values, dtype=float if real else complex))
    assert_near(a.steer(0.3)[2], double.steer(0.3)[2], 4)


def test_arithmetic_with_double_precision_is_double():
    a = single_coefficients()
    double = a.map(lambda values: values.astype(complex))
    assert (a + double).scaling.dtype == (double - a).scaling.dtype == np.complex128


def test_norm_of_single_precision_is_summed_in_double():
    """A sum of 2**24 ones and more in single precision would stand still."""
    ones = np.ones((1, 4200, 4200), dtype=np.float32)
    a = WaveletCoefficients(np.zeros((1, 1), np.float32), {0: ones}, {"directions": 1})
    assert a.norm() == 4200.0


@pytest.mark.parametrize("wrong", ["float32", "single", None, 64, np.float64])
def test_type_must_be_one_of_two(wrong):
    msg = (
        f"dtype={wrong!r} must be 'complex128' or 'complex64'; real maps are then stored as "
        "float64 or float32."
    )
    for make in (SpinHarmonicTransform, SpinWaveletTransform):
        with pytest.raises(ParameterError, match=f"^{re.escape(msg)}$"):
            make(8, dtype=wrong)


@pytest.mark.parametrize("dtype", ["complex64", np.complex64, np.dtype("complex64"), "c8"])
def test_type_may_be_a_name_or_numpy_s(dtype):
    assert SpinHarmonicTransform(8, dtype=dtype).dtype == "complex64"
    assert SpinWaveletTransform(8, dtype=dtype).dtype == "complex64"
    assert SpinHarmonicTransform(8).dtype == "complex128"


def test_derived_maps_keep_the_type():
    transform = SpinHarmonicTransform(8, real=True, dtype="complex64")
    maps = transform.synthesis(random_real_flm(8))
    assert transform.rotate(maps, (0.1, 0.2, 0.3)).dtype == np.float32
    assert transform.resample(maps, "mwss").dtype == np.float32
    assert transform.raise_spin(maps).dtype == np.complex64
