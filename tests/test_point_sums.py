"""The laws of synthesis at arbitrary points, and of what else a transform does to maps."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import DataError, MemoryBudgetError, ParameterError, ShapeError
from spinsdw.harmonics import lower_spin, raise_spin, resize
from spinsdw.rotation import rotate_flm
from spinsdw.sampling import MW, SAMPLINGS
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import (
    EPS,
    assert_close,
    direct_map,
    needs_compiler,
    random_flm,
    random_like,
    random_real_flm,
    relative_error,
    sizes_and_spins,
)

# More points than this are summed by a non-uniform transform.
FEW, MANY = 1, 3


def tolerance(bandlimit):
    """Ulps of a transform: rounding of a colatitude moves degree L by L pi eps / 2."""
    return 8 * bandlimit + 16


def random_points(size, seed=0):
    """Points all over the sphere; the poles, the equator and a repeated one among them."""
    rng = np.random.default_rng(seed)
    theta = np.arccos(rng.uniform(-1, 1, size))
    special = np.array([0, np.pi, np.pi / 2, 1e-9, np.pi - 1e-9])[: min(5, size // 2)]
    theta[: special.size] = special
    phi = rng.uniform(-8, 8, size)
    theta[-1], phi[-1] = theta[0], phi[0]
    return theta, phi


def direct_values(flm, spin, theta, phi):
    """sum_lm f_lm sYlm, point by point."""
    pairs = zip(theta, phi, strict=True)
    return np.array([direct_map(flm, spin, np.array([t]), np.array([p]))[0, 0] for t, p in pairs])


def signal_and_error(values, found):
    """The largest error, relative to the root of the mean square."""
    return np.max(np.abs(found - values)) / np.sqrt(np.mean(np.abs(values) ** 2))


@pytest.mark.parametrize(
    ("bandlimit", "spin"), sizes_and_spins([1, 2, 3, 8, 33], [0, 1, -1, 2, -3, 31])
)
def test_values_are_the_sum_of_harmonics(bandlimit, spin):
    """Directly to rounding, by the non-uniform transform to its accuracy."""
    flm = random_flm(bandlimit)
    transform = SpinHarmonicTransform(bandlimit, spin)
    theta, phi = random_points(3 * bandlimit)
    flm[: spin**2] = 0
    desired = direct_values(flm, spin, theta, phi)
    found = transform.synthesis_at(flm, theta[:bandlimit], phi[:bandlimit])
    assert_close(found, desired[:bandlimit], ulps=tolerance(bandlimit))
    assert signal_and_error(desired, transform.synthesis_at(flm, theta, phi)) < 1e-11


@pytest.mark.parametrize("bandlimit", [1, 2, 9])
@pytest.mark.parametrize("factor", [FEW, MANY])
def test_real_signals_have_real_values(bandlimit, factor):
    flm = random_real_flm(bandlimit)
    theta, phi = random_points(factor * bandlimit)
    half = SpinHarmonicTransform(bandlimit, real=True)
    found = half.synthesis_at(flm, theta, phi)
    assert found.dtype == np.float64
    desired = SpinHarmonicTransform(bandlimit).synthesis_at(flm, theta, phi)
    assert signal_and_error(desired, found) < 1e-11
    noise = random_like(found)
    back = SpinHarmonicTransform(bandlimit).adjoint_synthesis_at(noise, theta, phi)
    assert_close(half.adjoint_synthesis_at(noise, theta, phi), back, ulps=1e-11 / EPS)


@pytest.mark.parametrize("factor", [FEW, MANY])
@pytest.mark.parametrize(("bandlimit", "spin"), sizes_and_spins([1, 2, 8, 33], [0, 2, -3]))
def test_adjoint_is_that_of_the_plain_dot_product(bandlimit, spin, factor):
    """<S f, g> = <f, S* g>; the transform of a rounded exponential is that of a matrix."""
    transform, flm = SpinHarmonicTransform(bandlimit, spin), random_flm(bandlimit, spin)
    theta, phi = random_points(factor * bandlimit)
    values = transform.synthesis_at(flm, theta, phi)
    noise = random_like(values, seed=1)
    found = transform.adjoint_synthesis_at(noise, theta, phi)
    scale = np.linalg.norm(values) * np.linalg.norm(noise)
    assert abs(np.vdot(values, noise) - np.vdot(flm, found)) <= 1e-12 * scale
    assert not np.any(found[: spin**2])


@needs_compiler
@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("spin", [0, -2])
def test_values_at_the_points_of_a_grid_are_the_map(sampling, spin):
    transform = SpinHarmonicTransform(40, spin, sampling=sampling)
    flm = random_flm(40, spin)
    maps = transform.synthesis(flm)
    found = transform.synthesis_at(flm, *transform.sampling.points)
    assert found.shape == maps.shape
    assert signal_and_error(maps, found) < 1e-11


@needs_compiler
@pytest.mark.parametrize("accuracy", [1e-12, 1e-8, 1e-4])
@pytest.mark.parametrize("real", [False, True])
def test_error_keeps_to_the_accuracy_asked_for(accuracy, real):
    flm = random_real_flm(64)
    transform = SpinHarmonicTransform(64, real=real)
    theta, phi = random_points(4000)
    found = transform.synthesis_at(flm, theta, phi, accuracy=accuracy)
    parts = [
        transform.synthesis_at(flm, theta[i : i + 64], phi[i : i + 64]) for i in range(0, 640, 64)
    ]
    assert relative_error(found[:640], np.concatenate(parts)) <= 2 * accuracy + 64 * EPS


def test_points_and_signals_may_have_any_shape():
    transform = SpinHarmonicTransform(6, 1)
    flm = random_flm(6, 1, batch=(2, 3))
    theta, phi = np.linspace(0.1, 3, 4)[:, None], np.linspace(0, 6, 5)
    values = transform.synthesis_at(flm, theta, phi)
    assert values.shape == (2, 3, 4, 5)
    one = transform.synthesis_at(flm[1, 2], theta[3, 0], phi[4])
    assert one.shape == ()
    assert abs(values[1, 2, 3, 4] - one) < 1e-11
    assert transform.adjoint_synthesis_at(values, theta, phi).shape == flm.shape
    assert transform.adjoint_synthesis_at(one, theta[3, 0], phi[4]).shape == (36,)
    assert transform.synthesis_at(flm, theta[:0], phi).shape == (2, 3, 0, 5)
    assert not np.any(transform.adjoint_synthesis_at(np.zeros((2, 0)), phi[:0], phi[:0]))


@pytest.mark.parametrize(
    ("theta", "phi", "error", "message"),
    [
        ([1.0, 2.0], [1.0, 2.0, 3.0], ShapeError, "which do not broadcast"),
        ([1.0, 3.2], 0.0, DataError, "colatitudes run from 1 to 3.2 and must stay within 0 and pi"),
        ([-0.1], 0.0, DataError, "must stay within 0 and pi"),
        ([np.nan], 0.0, DataError, "colatitudes has 1 value that is not finite"),
        ([1.0], np.inf, DataError, "longitudes has 1 value that is not finite"),
        ([1j], 0.0, DataError, "must hold real angles in radians"),
        (["a"], 0.0, DataError, "must hold real angles in radians"),
    ],
)
def test_points_are_checked(theta, phi, error, message):
    transform = SpinHarmonicTransform(4)
    with pytest.raises(error, match=message):
        transform.synthesis_at(random_flm(4), theta, phi)
    with pytest.raises(error, match=message):
        transform.adjoint_synthesis_at(np.zeros(2), theta, phi)


@pytest.mark.parametrize("accuracy", [0.0, 1e-13, 0.1, np.nan, 1, "fine", None])
def test_accuracy_is_one_that_can_be_had(accuracy):
    with pytest.raises(ParameterError, match=r"accuracy=.* must be a float from 1e-12 to 0\.01"):
        SpinHarmonicTransform(4).synthesis_at(random_flm(4), 1.0, 1.0, accuracy=accuracy)


def test_values_have_the_shape_of_the_points():
    with pytest.raises(ShapeError, match=r"values has shape \(3,\)"):
        SpinHarmonicTransform(4).adjoint_synthesis_at(np.zeros(3), [1.0, 2.0], 0.0)


@pytest.mark.parametrize("source", SAMPLINGS)
@pytest.mark.parametrize("target", SAMPLINGS)
def test_resampling_is_synthesis_on_the_other_grid(source, target):
    """At the same bandlimit and at a larger one; and there and back changes nothing."""
    flm = random_flm(9, -2)
    start = SpinHarmonicTransform(9, -2, sampling=source)
    maps = start.synthesis(flm)
    end = SpinHarmonicTransform(9, -2, sampling=target)
    assert_close(start.resample(maps, target), end.synthesis(flm), ulps=2 * tolerance(9))
    larger = SpinHarmonicTransform(12, -2, sampling=target)
    found = start.resample(maps, SAMPLINGS[target](12))
    assert_close(found, larger.synthesis(resize(flm, 12)), ulps=2 * tolerance(12))
    back = resize(larger.analysis(found), 9)
    assert_close(start.synthesis(back), maps, ulps=4 * tolerance(12))


def test_resampled_real_maps_stay_real():
    transform = SpinHarmonicTransform(6, real=True)
    maps = transform.synthesis(random_real_flm(6, batch=(2,)))
    found = transform.resample(maps, "gl")
    assert found.shape == (2, 6, 11)
    assert found.dtype == np.float64


def test_grids_that_are_too_coarse_are_refused():
    transform = SpinHarmonicTransform(6)
    with pytest.raises(
        ParameterError, match="target has bandlimit 5, which cannot hold signals of"
    ):
        transform.resample(np.zeros((6, 11)), MW(5))
    with pytest.raises(ParameterError, match="is not known; use one of"):
        transform.resample(np.zeros((6, 11)), "ring")


@pytest.mark.parametrize("sampling", ["mw", "gl"])
@pytest.mark.parametrize("spin", [0, 2])
def test_rotated_maps_have_the_rotated_coefficients(sampling, spin):
    transform = SpinHarmonicTransform(9, spin, sampling=sampling)
    flm, rotation = random_flm(9, spin), (0.3, 1.1, -0.7)
    found = transform.rotate(transform.synthesis(flm), rotation)
    desired = transform.synthesis(rotate_flm(flm, rotation))
    assert_close(found, desired, ulps=4 * tolerance(9))


def test_rotation_about_the_pole_shifts_longitudes():
    transform = SpinHarmonicTransform(9, real=True)
    maps = transform.synthesis(random_real_flm(9))
    found = transform.rotate(maps, (2 * np.pi * 3 / 17, 0, 0))
    assert found.dtype == np.float64
    assert_close(found, np.roll(maps, 3, axis=1), ulps=4 * tolerance(9))


@pytest.mark.parametrize("spin", [-2, -1, 0, 1, 2])
def test_maps_of_raised_and_lowered_spin(spin):
    """eth and eth-bar of the map are the maps of eth and eth-bar of the coefficients."""
    transform, flm = SpinHarmonicTransform(9, spin), random_flm(9, spin)
    maps = transform.synthesis(flm)
    up, down = (SpinHarmonicTransform(9, spin + step) for step in (1, -1))
    scale = 4 * 9 * tolerance(9)
    assert_close(transform.raise_spin(maps), up.synthesis(raise_spin(flm, spin)), ulps=scale)
    assert_close(transform.lower_spin(maps), down.synthesis(lower_spin(flm, spin)), ulps=scale)


def test_real_maps_are_raised_to_complex_ones():
    """eth-bar of a real field is the conjugate of eth."""
    transform = SpinHarmonicTransform(9, real=True)
    maps = transform.synthesis(random_real_flm(9))
    up, down = transform.raise_spin(maps), transform.lower_spin(maps)
    assert_close(up, down.conj(), ulps=4 * 9 * tolerance(9))


def test_spin_cannot_be_raised_to_the_bandlimit():
    with pytest.raises(ParameterError, match="spin=3 must be smaller in size than bandlimit=3"):
        SpinHarmonicTransform(3, 2).raise_spin(np.zeros((3, 5)))


@pytest.mark.parametrize("points", [4, 4000])
def test_a_call_that_would_take_too_much_memory_is_refused(points):
    theta = np.linspace(0, 3, points)
    roomy = SpinHarmonicTransform(8, max_memory=10**7)
    values = roomy.synthesis_at(random_flm(8), theta, 0.0)
    tight = SpinHarmonicTransform(8, max_memory=1500)
    with pytest.raises(MemoryBudgetError, match="bytes that synthesis_at takes"):
        tight.synthesis_at(random_flm(8), theta, 0.0)
    with pytest.raises(MemoryBudgetError, match="bytes that adjoint_synthesis_at takes"):
        tight.adjoint_synthesis_at(values, theta, 0.0)
