"""The laws of the syntheses on HEALPix rings and their adjoints."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.ring_transform import HealpixTransform
from spinsdw.sampling import HealpixRings
from tests.helpers import (
    EPS,
    assert_close,
    direct_columns,
    needs_compiler,
    random_flm,
    random_like,
    random_real_flm,
)

# Bandlimits up to and beyond what the rings can tell apart: 2 points a cap ring is 4 at nside 1.
SIZES = [(1, 1), (1, 2), (1, 9), (2, 4), (2, 7), (3, 8), (4, 16), (5, 3)]
LARGE = [pytest.param(8, 40, marks=needs_compiler), pytest.param(7, 33, marks=needs_compiler)]
every_size = pytest.mark.parametrize(("nside", "bandlimit"), SIZES + LARGE)


def tolerance(bandlimit):
    """Ulps of a sum over degree: a colatitude, rounded, moves degree L by L pi eps / 2."""
    return 8 * bandlimit + 16


def direct_healpix(flm, nside, spin):
    rings = HealpixRings(nside)
    columns = direct_columns(flm, spin, rings.colatitudes)
    m = np.arange(columns.shape[-1]) - columns.shape[-1] // 2
    parts = []
    for column, first, points in zip(columns, rings.first_longitudes, rings.n_phi, strict=True):
        longitudes = first + 2 * np.pi * np.arange(points) / points
        parts.append(column @ np.exp(1j * np.outer(m, longitudes)))
    return np.concatenate(parts)


@every_size
@pytest.mark.parametrize("spin", [0, 1, -2, 3])
def test_synthesis_is_the_sum_of_harmonics(nside, bandlimit, spin):
    """f = sum_lm f_lm sYlm at every pixel, aliased rings included."""
    spin = max(min(spin, bandlimit - 1), 1 - bandlimit)
    flm = random_flm(bandlimit)
    found = HealpixTransform(nside, bandlimit, spin).synthesis(flm)
    assert_close(found, direct_healpix(flm, nside, spin), ulps=tolerance(bandlimit))


@every_size
def test_real_signals_take_the_same_way(nside, bandlimit):
    half = HealpixTransform(nside, bandlimit, real=True)
    full = HealpixTransform(nside, bandlimit)
    flm = random_real_flm(bandlimit)
    values = half.synthesis(flm)
    assert values.dtype == np.float64
    assert_close(values, full.synthesis(flm), ulps=tolerance(bandlimit))
    noise = random_like(values)
    desired = full.adjoint_synthesis(noise)
    assert_close(half.adjoint_synthesis(noise), desired, ulps=tolerance(bandlimit))


def check_adjoint(transform, flm):
    """<S f, g> = <f, S* g> in the plain dot product."""
    values = transform.synthesis(flm)
    noise = random_like(values, seed=1)
    difference = np.vdot(values, noise) - np.vdot(flm, transform.adjoint_synthesis(noise))
    scale = np.linalg.norm(values) * np.linalg.norm(noise)
    assert abs(difference) <= tolerance(transform.bandlimit) * EPS * scale


@every_size
@pytest.mark.parametrize("spin", [0, 1, -2, 3])
def test_adjoint_is_that_of_the_plain_dot_product(nside, bandlimit, spin):
    spin = max(min(spin, bandlimit - 1), 1 - bandlimit)
    check_adjoint(HealpixTransform(nside, bandlimit, spin), random_flm(bandlimit))


@every_size
def test_adjoint_is_that_of_the_plain_dot_product_for_real_signals(nside, bandlimit):
    transform = HealpixTransform(nside, bandlimit, real=True)
    check_adjoint(transform, random_real_flm(bandlimit))


@pytest.mark.parametrize("real", [False, True])
def test_the_imaginary_part_of_order_zero_is_no_part_of_a_real_field(real):
    """With real=True coefficients of m >= 0 alone are read, and of m = 0 the real part."""
    flm = random_real_flm(5)
    spoilt = flm.copy()
    for el in range(5):
        spoilt[el * el : el * el + el] = 9.0
        spoilt[el * el + el] += 3j
    transform = HealpixTransform(4, 5, real=real)
    same = np.allclose(transform.synthesis(spoilt), transform.synthesis(flm), rtol=0, atol=1e-14)
    assert same == real


@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("batch", [(3,), (2, 2), (1,), (0,), (2, 0)])
def test_leading_axes_are_a_batch(batch, real):
    spin = 0 if real else 2
    transform = HealpixTransform(2, 5, spin, real=real)
    flm = random_real_flm(5, batch=batch) if real else random_flm(5, 2, batch=batch)
    maps = transform.synthesis(flm)
    back = transform.adjoint_synthesis(maps)
    assert maps.shape == (*batch, 48)
    assert back.shape == (*batch, 25)
    for place in np.ndindex(*batch):
        assert np.array_equal(maps[place], transform.synthesis(flm[place]))
        # Sums over rings are in another order for one series than for more.
        assert_close(back[place], transform.adjoint_synthesis(maps[place]), ulps=16)


@pytest.mark.parametrize(("spin", "real"), [(0, True), (2, False)])
def test_results_have_the_same_bits_on_any_number_of_threads(spin, real):
    flm = random_real_flm(40) if real else random_flm(40, 2)
    first = HealpixTransform(16, 40, spin, real=real, threads=1)
    maps = first.synthesis(flm)
    for threads in (2, 3, 5):
        transform = HealpixTransform(16, 40, spin, real=real, threads=threads)
        assert np.array_equal(transform.synthesis(flm), maps)
        assert np.array_equal(transform.adjoint_synthesis(maps), first.adjoint_synthesis(maps))


def test_one_transform_serves_many_threads():
    transform = HealpixTransform(8, 20, 2, threads=2)
    signals = random_flm(20, 2, batch=(6,))

    def work(flm):
        return transform.adjoint_synthesis(transform.synthesis(flm))

    alone = [work(flm) for flm in signals]
    with ThreadPoolExecutor(3) as pool:
        assert np.array_equal(alone, list(pool.map(work, signals)))


def test_inputs_are_left_alone():
    transform = HealpixTransform(2, 5, 2)
    flm = random_flm(5)
    flm.flags.writeable = False
    maps = transform.synthesis(flm)
    kept = maps.copy()
    maps.flags.writeable = False
    transform.adjoint_synthesis(maps)
    assert np.array_equal(maps, kept)


def test_objects_describe_themselves_and_are_frozen():
    transform = HealpixTransform(np.int64(4), np.int64(8), np.int8(-2))
    assert (transform.nside, transform.bandlimit, transform.spin) == (4, 8, -2)
    assert transform.shape == (192,)
    assert transform.rings == HealpixRings(4)
    with pytest.raises(FrozenInstanceError):
        transform.nside = 2


@pytest.mark.parametrize("nside", [0, -1, 2.5, True, None, "a", [1], np.nan, np.inf])
def test_nside_is_a_positive_integer(nside):
    with pytest.raises(ParameterError, match=r"nside=.* must be an integer of at least 1"):
        HealpixTransform(nside, 4)


@pytest.mark.parametrize("bandlimit", [0, -1, 2.5, True, "8", None])
def test_bandlimit_is_a_positive_integer(bandlimit):
    with pytest.raises(ParameterError, match=r"bandlimit=.* must be an integer of at least 1"):
        HealpixTransform(2, bandlimit)


@pytest.mark.parametrize("spin", [4, -4, 1.0, True, "2"])
def test_spin_is_an_integer_below_the_bandlimit(spin):
    with pytest.raises(ParameterError, match=r"spin=.* must be"):
        HealpixTransform(2, 4, spin)


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "a", "2", [1], np.nan, np.inf])
def test_threads_are_a_positive_integer(threads):
    with pytest.raises(ParameterError, match=r"threads=.* must be a positive integer, or None"):
        HealpixTransform(2, 4, threads=threads)


def test_signals_with_spin_are_not_real():
    with pytest.raises(ParameterError, match="real=True needs spin 0, not spin=2"):
        HealpixTransform(2, 4, 2, real=True)


@pytest.mark.parametrize("real", ["no", 1, 0, None])
def test_real_is_true_or_false(real):
    """The text "no" counted as true."""
    with pytest.raises(ParameterError, match=r"real=.* must be True or False"):
        HealpixTransform(2, 4, real=real)


@pytest.mark.parametrize(
    ("flm", "error", "message"),
    [
        (np.zeros(15), ShapeError, r"bandlimit\*\*2 = 16 long"),
        (np.full(16, "a"), DataError, "must hold numbers"),
        (np.full(16, None), DataError, "dtype object"),
        (np.full(16, np.nan), DataError, "NaN or infinite"),
    ],
)
def test_coefficients_that_cannot_be_used_are_refused(flm, error, message):
    with pytest.raises(error, match=message):
        HealpixTransform(2, 4).synthesis(flm)


@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        (np.zeros(47), ShapeError, r"shape \(47,\); it must be \(\.\.\., 48\)"),
        (np.zeros((48, 1)), ShapeError, r"shape \(48, 1\)"),
        (np.full(48, "a"), DataError, "must hold real or complex numbers"),
        (np.full(48, None), DataError, "dtype object"),
        (np.full(48, np.nan), DataError, "48 values that are not finite"),
        (np.zeros(48, dtype=complex), DataError, "complex but real=True was asked for"),
    ],
)
def test_maps_that_cannot_be_used_are_refused(values, error, message):
    with pytest.raises(error, match=message):
        HealpixTransform(2, 4, real=True).adjoint_synthesis(values)
