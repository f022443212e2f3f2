"""The laws of the directional spin wavelet transform."""

from __future__ import annotations

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError, dataclass

import numpy as np
import pytest

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.compiled import order_sums
from spinsdw.directionality import (
    CurveletDirectionality,
    RidgeletDirectionality,
    SteerableDirectionality,
)
from spinsdw.directionality.ridgelet import radon_factors
from spinsdw.errors import DataError, ParameterError, PrecisionWarning, ShapeError
from spinsdw.maps_io import read_coefficients, write_coefficients
from spinsdw.ring_transform import HealpixTransform
from spinsdw.sampling import MW, MWSS, SAMPLINGS
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.tiling import (
    CustomTiling,
    HybridTiling,
    NeedletTiling,
    ScaleDiscretisedTiling,
    SplineTiling,
    Tiling,
)
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform
from tests.helpers import (
    EPS,
    IS_UNCOMPILED,
    assert_close,
    direct_function,
    direct_map,
    euler_grid,
    needs_compiler,
    random_flm,
    random_like,
    random_real_flm,
    relative_error,
    wavelet_wigner,
)

# Small enough to sum directly and to run uncompiled; odd and even N, N > L_j, N = L, every option.
SMALL = [
    (1, 0, 1, {}),
    (2, 0, 2, {}),
    (3, 2, 1, {}),
    (8, 0, 1, {}),
    (8, 0, 2, {"sampling": "mwss"}),
    (8, 2, 3, {}),
    (8, -3, 4, {"lowest_scale": 2}),
    (8, 5, 5, {"sampling": "mwss"}),
    (8, 2, 8, {}),
    (7, -1, 7, {"sampling": "mwss"}),
    (8, 2, 3, {"multiresolution": False}),
    (8, -2, 2, {"multiresolution": False, "sampling": "mwss", "lowest_scale": 2}),
    (8, 2, 2, {"dilation": 1.5}),
    (8, 1, 3, {"dilation": 3, "lowest_scale": 1}),
    (8, 7, 2, {}),
    (8, 0, 1, {"real": True}),
    (8, 0, 4, {"real": True, "sampling": "mwss"}),
    (8, 0, 8, {"real": True}),
    (8, 0, 3, {"real": True, "multiresolution": False}),
    (1, 0, None, {"directionality": CurveletDirectionality()}),
    (2, 0, None, {"directionality": CurveletDirectionality(centred=True)}),
    (3, 1, None, {"directionality": CurveletDirectionality(), "sampling": "mwss"}),
    (6, 2, None, {"directionality": CurveletDirectionality(), "lowest_scale": 1}),
    (7, -3, None, {"directionality": CurveletDirectionality(centred=True)}),
    (6, 0, None, {"directionality": CurveletDirectionality(), "real": True}),
    (7, 0, None, {"directionality": CurveletDirectionality(centred=True), "real": True}),
    (5, 1, None, {"directionality": CurveletDirectionality(), "multiresolution": False}),
    (8, 7, None, {"directionality": CurveletDirectionality(), "sampling": "gl"}),
    (1, 0, None, {"directionality": RidgeletDirectionality()}),
    (2, 0, None, {"directionality": RidgeletDirectionality()}),
    (3, -2, None, {"directionality": RidgeletDirectionality(), "sampling": "mwss"}),
    (8, 0, None, {"directionality": RidgeletDirectionality(), "real": True}),
    (8, 2, None, {"directionality": RidgeletDirectionality(power=1)}),
    (7, -1, None, {"directionality": RidgeletDirectionality(power=-1), "lowest_scale": 1}),
    (8, 2, 3, {"original_spin": 2}),
    (8, -1, 2, {"original_spin": -3, "lowest_scale": 1}),
    (8, 0, 3, {"original_spin": 2, "real": True}),
    (2, 0, 1, {"original_spin": 1}),
    (8, 3, 2, {"original_spin": 7}),
]
SMALL += [
    (8, spin, directions, {"sampling": sampling, "real": spin == 0})
    for sampling in SAMPLINGS
    for spin, directions in ((0, 2), (-2, 3))
]
LARGE = [
    (64, spin, directions, {"lowest_scale": lowest_scale})
    for spin in (0, 2, -3, 5)
    for directions in (1, 2, 3, 4, 5)
    for lowest_scale in (0, 2)
]
LARGE += [
    (50, 2, 3, {"dilation": dilation, "sampling": sampling})
    for dilation in (1.5, 2, 3)
    for sampling in ("mw", "mwss")
]
LARGE += [
    (65, 2, 20, {}),
    (33, 0, 33, {}),
    (33, -4, 33, {"sampling": "mwss", "lowest_scale": 1}),
    (64, 2, 2, {"multiresolution": False}),
    (64, -3, 5, {"multiresolution": False, "sampling": "mwss"}),
    (65, 2, 3, {"sampling": "gl"}),
    (64, 0, 1, {"real": True}),
    (64, 0, 4, {"real": True, "sampling": "mwss"}),
    (64, 0, 5, {"real": True, "multiresolution": False, "lowest_scale": 2}),
    # More orders than a matrix mixes.
    (40, 0, None, {"directionality": CurveletDirectionality(), "real": True}),
    (40, 2, None, {"directionality": CurveletDirectionality(), "sampling": "mwss"}),
    (50, -1, None, {"directionality": CurveletDirectionality(centred=True), "lowest_scale": 2}),
    (70, 0, None, {"directionality": CurveletDirectionality(centred=True), "real": True}),
    (64, 2, None, {"directionality": RidgeletDirectionality()}),
    (64, 2, 3, {"original_spin": 2}),
    # Scales of bandlimits 26, 39, 58, 87, 130 and 195: sizes that no power of 2 leads to.
    (200, 2, 3, {"dilation": 1.5}),
]
CASES = SMALL + [pytest.param(*case, marks=needs_compiler) for case in LARGE]
any_case = pytest.mark.parametrize(("bandlimit", "spin", "directions", "options"), CASES)
small_case = pytest.mark.parametrize(("bandlimit", "spin", "directions", "options"), SMALL)


def tolerance(bandlimit):
    """Ulps of a transform, as for the harmonic one, and a few for the sum over scales."""
    return 4 * bandlimit + 32


def random_signal(transform, **options):
    """Draw a signal without the degrees that the wavelets do not hold."""
    if transform.real:
        flm = random_real_flm(transform.bandlimit, **options)
    else:
        flm = random_flm(transform.bandlimit, transform.spin, **options)
    el = np.arange(transform.bandlimit)
    flm[..., np.repeat(transform.wavelets.lost_degrees, 2 * el + 1)] = 0
    return flm


def random_coefficients(transform, seed=0):
    """Draw every stored number: what no signal has as its coefficients."""
    found = transform.analysis_harmonic(np.zeros(transform.bandlimit**2))
    seeds = iter(range(seed, seed + 100))
    return found.map(lambda values: random_like(values, seed=next(seeds)))


def items(coefficients):
    yield "scaling", coefficients.scaling
    for scale in coefficients.scales:
        yield scale, coefficients[scale]


def dot(one, other):
    return sum(np.vdot(a, b) for (_, a), (_, b) in zip(items(one), items(other), strict=True))


def assert_equal(one, other):
    for (key, a), (_, b) in zip(items(one), items(other), strict=True):
        assert np.array_equal(a, b), key


def assert_all_close(one, other, ulps):
    """Against the largest value of any scale: scales without signal hold rounding alone."""
    size = max(np.max(np.abs(values)) for _, values in items(other))
    for (key, a), (_, b) in zip(items(one), items(other), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=ulps * EPS * size, err_msg=str(key))


@any_case
def test_synthesis_undoes_analysis_in_harmonic_space(bandlimit, spin, directions, options):
    transform = SpinWaveletTransform(bandlimit, spin, directions, **options)
    flm = random_signal(transform)
    found = transform.synthesis_harmonic(transform.analysis_harmonic(flm))
    assert_close(found, flm, ulps=tolerance(bandlimit))
    assert relative_error(found, flm) <= (2 * bandlimit + 8) * EPS
    assert not np.any(found[: spin**2])


@any_case
def test_synthesis_undoes_analysis_of_maps(bandlimit, spin, directions, options):
    transform = SpinWaveletTransform(bandlimit, spin, directions, **options)
    signal = transform.harmonic.synthesis(random_signal(transform))
    coefficients = transform.analysis(signal)
    assert {key: values.shape for key, values in items(coefficients)} == transform.shapes
    assert all(v.dtype == signal.dtype for _, v in items(coefficients))
    assert_close(transform.synthesis(coefficients), signal, ulps=2 * tolerance(bandlimit))


@small_case
def test_coefficients_are_the_projections_on_rotated_wavelets(bandlimit, spin, directions, options):
    """W^j(rho) = <f, R_rho psi^j> = sum_lmn f_lm conj(psi_ln) e^{i m a} d^l_mn(b) e^{i n g}."""
    transform = SpinWaveletTransform(bandlimit, spin, directions, **options)
    flm = random_signal(transform)
    coefficients = transform.analysis_harmonic(flm)
    for scale in transform.scales:
        grid = transform.grid_of(transform.bandlimits[scale])
        orientations = transform.wavelets.orientations_of(scale)
        angles = euler_grid(grid, orientations.angles)
        wigner = wavelet_wigner(flm, transform.wavelets, scale)
        desired = direct_function(wigner, orientations.orders, angles)
        desired = desired.reshape(transform.shapes[scale])
        gain = max(1.0, np.sqrt(np.max(transform.wavelets.frame_response)))
        atol = tolerance(bandlimit) * EPS * gain * np.linalg.norm(flm)
        np.testing.assert_allclose(coefficients[scale], desired, rtol=0, atol=atol)


@pytest.mark.parametrize("spin", [0, 2, -1])
def test_centred_curvelets_are_curvelets_turned_to_the_pole(spin):
    """W'(alpha, beta, gamma) = W of R_(alpha, beta, gamma) R_y(pi / 2) psi, at every sample."""
    spherical = pytest.importorskip("spherical")
    quaternionic = pytest.importorskip("quaternionic")
    flm, wigner = random_flm(6, spin), spherical.Wigner(5)
    kinds = {is_centred: CurveletDirectionality(is_centred) for is_centred in (False, True)}
    there, here = (
        SpinWaveletTransform(6, spin, directionality=kinds[is_centred])
        for is_centred in (False, True)
    )
    turn = quaternionic.array.from_euler_angles(0, np.pi / 2, 0)
    for scale in here.scales:
        size = here.bandlimits[scale]
        plain, centred = (one.wavelets.wavelet_harmonics(scale) for one in (there, here))
        for el in range(size):
            first = wigner.Dindex(el, -el, -el)
            # (R psi)_ln = sum_m D^l_nm psi_lm; that package's D is the conjugate of ours.
            matrix = wigner.D(turn).conj()[first : first + (2 * el + 1) ** 2]
            turned = matrix.reshape(2 * el + 1, -1) @ plain[size - 1 - el : size + el, el]
            desired = np.zeros(2 * size - 1, dtype=complex)
            desired[size - 1 - el : size + el] = turned
            assert_close(desired[size % 2 == 0 :: 2][: len(centred)], centred[:, el], ulps=64)
            assert not np.any(np.abs(desired[size % 2 :: 2]) > 64 * EPS)
        found = here.analysis_harmonic(flm)
        assert found[scale].shape[0] == 2 * ((size - 1) // 2) + 1


@pytest.mark.parametrize("spin", [0, 1, 2, -3])
@pytest.mark.parametrize("sampling", ["mw", "mwss"])
def test_ridgelets_of_power_one_are_wavelets_of_integrals_along_great_circles(spin, sampling):
    """W(alpha, beta) = <R f, R_rho psi>, R f = int f along the circle around (alpha, beta)."""
    flm = random_flm(10, spin)
    radon = radon_factors(10, spin)[np.repeat(np.arange(10), 2 * np.arange(10) + 1)] * flm
    ridgelets = SpinWaveletTransform(
        10, spin, directionality=RidgeletDirectionality(1), sampling=sampling, lowest_scale=1
    )
    plain = SpinWaveletTransform(10, sampling=sampling, lowest_scale=1)
    with pytest.warns(PrecisionWarning, match=r"of the signal's power is in degrees that Ridgelet"):
        found = ridgelets.analysis_harmonic(flm)
    desired = plain.analysis_harmonic(radon)
    for scale in ridgelets.scales:
        atol = tolerance(10) * EPS * np.linalg.norm(radon)
        np.testing.assert_allclose(found[scale], desired[scale], rtol=0, atol=atol)


@pytest.mark.parametrize("spin", [0, 3])
def test_ridgelets_give_back_the_degrees_that_they_hold(spin):
    """Of a signal with every degree, those with l + s even return; the scaling function's too."""
    transform = SpinWaveletTransform(
        16, spin, directionality=RidgeletDirectionality(), lowest_scale=2
    )
    flm = random_flm(16, spin)
    with pytest.warns(PrecisionWarning, match=r"will not come back; wavelets\.lost_degrees tells"):
        found = transform.synthesis_harmonic(transform.analysis_harmonic(flm))
    el = np.repeat(np.arange(16), 2 * np.arange(16) + 1)
    eta = transform.tiling.scaling_kernel[el]
    desired = np.where((el + spin) % 2 == 0, flm, eta**2 * flm)
    assert_close(found, desired, ulps=tolerance(16))
    assert np.array_equal(
        np.flatnonzero(transform.wavelets.lost_degrees),
        [n for n in range(3, 16) if (n + spin) % 2],
    )


def test_warnings_point_to_the_call():
    """Through every door to the line that analysed, where a filter can find it."""
    transform = SpinWaveletTransform(8, directionality=RidgeletDirectionality())
    flm = random_flm(8)
    maps = transform.harmonic.synthesis(flm)
    for name, signal in (("analysis", maps), ("analysis_harmonic", flm), ("analysis_wigner", flm)):
        with pytest.warns(PrecisionWarning) as caught:
            getattr(transform, name)(signal)
        assert [one.filename for one in caught] == [__file__]


def test_degrees_below_the_original_spin_are_lost():
    transform = SpinWaveletTransform(8, 1, 2, original_spin=3)
    flm = random_flm(8, 1)
    with pytest.warns(PrecisionWarning, match="spin=1 and original_spin=3 do not hold"):
        found = transform.synthesis_harmonic(transform.analysis_harmonic(flm))
    flm[:9] = 0
    assert_close(found, flm, ulps=8 * tolerance(8))


@pytest.mark.parametrize("directionality", [3, "curvelet", CurveletDirectionality])
def test_directionality_is_a_directionality(directionality):
    with pytest.raises(ParameterError, match=r"directionality=.* must be a Directionality"):
        SpinWaveletTransform(8, directionality=directionality)


def test_a_directionality_has_its_own_directions():
    with pytest.raises(ParameterError, match="directions=3 cannot be given with a directionality"):
        SpinWaveletTransform(8, 0, 3, directionality=RidgeletDirectionality())


def test_steerable_directionality_may_be_given():
    given = SpinWaveletTransform(8, 2, directionality=SteerableDirectionality(3))
    named = SpinWaveletTransform(8, 2, 3)
    flm = random_flm(8, 2)
    assert_equal(given.analysis_harmonic(flm), named.analysis_harmonic(flm))
    assert_close(given.synthesis_harmonic(named.analysis_harmonic(flm)), flm, tolerance(8))


def test_coefficients_of_other_wavelets_of_one_shape_are_refused():
    """Of ridgelets and axisymmetric wavelets, and of other original spins."""
    kinds = [
        SpinWaveletTransform(8, 2),
        SpinWaveletTransform(8, 2, directionality=RidgeletDirectionality()),
        SpinWaveletTransform(8, 2, directionality=RidgeletDirectionality(1)),
        SpinWaveletTransform(8, 2, original_spin=2),
        SpinWaveletTransform(8, 2, original_spin=-2),
    ]
    for one in kinds:
        for other in kinds:
            if other is not one:
                coefficients = one.analysis_harmonic(random_signal(one))
                with pytest.raises(ParameterError, match=r"coefficients have (direction|original)"):
                    other.synthesis_harmonic(coefficients)


@pytest.mark.parametrize(
    "options",
    [
        {"directionality": CurveletDirectionality()},
        {"directionality": CurveletDirectionality(centred=True), "real": True},
        {"directionality": RidgeletDirectionality(1)},
        {"directions": 3, "original_spin": 2},
    ],
)
def test_coefficients_of_every_kind_are_kept_in_files(options, tmp_path):
    """With their parameters, by which synthesis knows them and steering their orders."""
    transform = SpinWaveletTransform(8, **options)
    flm = random_signal(transform)
    coefficients = transform.analysis_harmonic(flm)
    found = read_coefficients(write_coefficients(tmp_path / "w.fits", coefficients))
    assert dict(found.parameters) == dict(coefficients.parameters)
    assert_equal(found, coefficients)
    assert np.array_equal(found.steer(0.4)[2], coefficients.steer(0.4)[2])
    assert_close(transform.synthesis_harmonic(found), flm, ulps=8 * tolerance(8))


@pytest.mark.parametrize("directions", [2, 3])
def test_scales_without_orders_are_zero(directions):
    """An empty scale of a tiling of one's own has bandlimit 1 and no order of either parity."""
    tiling = CustomTiling([1, 0, 0], [[0, 0, 0], [0, 1, 1]])
    transform = SpinWaveletTransform(3, 0, directions, tiling=tiling)
    flm = random_flm(3)
    coefficients = transform.analysis_harmonic(flm)
    assert not np.any(coefficients[0])
    assert_close(transform.synthesis_harmonic(coefficients), flm, ulps=tolerance(3))


@small_case
def test_scaling_part_is_a_scalar_map(bandlimit, spin, directions, options):
    """W^phi_lm = sqrt(4 pi / (2l+1)) f_lm phi_l0, at spin 0 whatever the signal's."""
    transform = SpinWaveletTransform(bandlimit, spin, directions, **options)
    flm = random_signal(transform)
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    part = np.sqrt(4 * np.pi / (2 * el + 1)) * flm * transform.wavelets.scaling_harmonics[el]
    grid = transform.grid_of(transform.tiling.scaling_bandlimit)
    desired = direct_map(part, 0, grid.colatitudes, grid.longitudes)
    found = transform.analysis_harmonic(flm).scaling
    assert_close(found, desired + 0 * found, ulps=tolerance(bandlimit))


@any_case
def test_adjoints_are_those_of_the_plain_dot_product(bandlimit, spin, directions, options):
    """<A f, w> = <f, A* w> and <S w, f> = <w, S* f>, for any stored numbers w."""
    transform = SpinWaveletTransform(bandlimit, spin, directions, **options)
    flm, noise = random_signal(transform), random_coefficients(transform)
    signal = transform.harmonic.synthesis(flm)
    pairs = [
        (transform.analysis_harmonic(flm), flm, transform.adjoint_analysis_harmonic(noise)),
        (transform.adjoint_synthesis_harmonic(flm), flm, transform.synthesis_harmonic(noise)),
        (transform.analysis(signal), signal, transform.adjoint_analysis(noise)),
        (transform.adjoint_synthesis(signal), signal, transform.synthesis(noise)),
    ]
    for coefficients, source, found in pairs:
        scale = coefficients.norm() * noise.norm()
        difference = dot(coefficients, noise) - np.vdot(source, found)
        assert abs(difference) <= tolerance(bandlimit) * EPS * scale


@pytest.mark.parametrize("sampling", ["mw", "mwss"])
@pytest.mark.parametrize("directions", [1, 2, 5, 8])
def test_real_signals_take_the_same_way(directions, sampling):
    half, full = (
        SpinWaveletTransform(12, 0, directions, sampling=sampling, real=real)
        for real in (True, False)
    )
    flm = random_real_flm(12)
    coefficients = half.analysis_harmonic(flm)
    assert_all_close(coefficients, full.analysis_harmonic(flm), ulps=tolerance(12))
    noise = random_coefficients(half)
    for name in ("synthesis_harmonic", "adjoint_analysis_harmonic"):
        desired = getattr(full, name)(noise)
        assert_close(getattr(half, name)(noise), desired, ulps=tolerance(12))
    desired = full.adjoint_synthesis_harmonic(flm)
    assert_all_close(half.adjoint_synthesis_harmonic(flm), desired, ulps=tolerance(12))


@pytest.mark.parametrize("directions", [1, 2, 3])
@pytest.mark.parametrize("sampling", list(SAMPLINGS))
def test_real_signals_take_half_the_memory(sampling, directions):
    """Maps, coefficients and Fourier columns; harmonic coefficients stay L * L."""
    options = {"directions": directions, "sampling": sampling, "threads": 1}
    real, both = (SpinWaveletTransform(16, real=one, **options) for one in (True, False))
    flm = random_real_flm(16)
    maps = [one.harmonic.synthesis(flm) for one in (real, both)]
    assert 2 * maps[0].nbytes == maps[1].nbytes
    assert 2 * real.analysis(maps[0]).nbytes == both.analysis(maps[1]).nbytes
    estimates = [one.memory_estimate()["synthesis_harmonic"] for one in (real, both)]
    assert 2 * estimates[0].input == estimates[1].input
    assert estimates[0].output == estimates[1].output == flm.nbytes


@pytest.mark.parametrize("sampling", ["mw", "mwss"])
@pytest.mark.parametrize(("spin", "directions"), [(0, 3), (2, 2), (-3, 5)])
def test_a_scale_on_its_own_grid_holds_what_the_full_grid_holds(spin, directions, sampling):
    """Both are samples of one function W^j(rho) of bandlimit L_j."""
    coarse, fine = (
        SpinWaveletTransform(16, spin, directions, sampling=sampling, multiresolution=multi)
        for multi in (True, False)
    )
    flm = random_flm(16, spin)
    small, large = coarse.analysis_harmonic(flm), fine.analysis_harmonic(flm)
    orders = coarse.wavelets.directionality.orders
    for scale in coarse.scales:
        bandlimit = coarse.bandlimits[scale]
        if directions > bandlimit:
            continue
        found = WignerTransform(bandlimit, orders, sampling=sampling).analysis(small[scale])
        desired = WignerTransform(16, orders, sampling=sampling).analysis(large[scale])
        norm = tolerance(16) * EPS * np.linalg.norm(flm) * 8 * np.pi**2
        atol = norm
        np.testing.assert_allclose(found, desired[:, : bandlimit**2], rtol=0, atol=atol)
        np.testing.assert_allclose(desired[:, bandlimit**2 :], 0, rtol=0, atol=atol)


@pytest.mark.parametrize(("spin", "directions"), [(0, 1), (2, 3), (-1, 4)])
def test_energy_of_all_scales_is_that_of_the_signal(spin, directions):
    """sum |W^phi_lm|^2 + sum_j (2l+1)/(8 pi^2) |W^j_lmn|^2 = sum |f_lm|^2."""
    transform = SpinWaveletTransform(32, spin, directions, lowest_scale=2)
    flm = random_flm(32, spin)
    coefficients = transform.analysis_harmonic(flm)
    scaling = SpinHarmonicTransform(coefficients.scaling.shape[0]).analysis(coefficients.scaling)
    energy = np.sum(np.abs(scaling) ** 2)
    orders = transform.wavelets.directionality.orders
    for scale, bandlimit in transform.bandlimits.items():
        found = WignerTransform(bandlimit, orders).analysis(coefficients[scale])
        el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
        energy += np.sum((2 * el + 1) / (8 * np.pi**2) * np.abs(found) ** 2)
    assert_close(energy, np.sum(np.abs(flm) ** 2), ulps=tolerance(32))


@small_case
def test_wavelets_share_out_every_degree(bandlimit, spin, directions, options):
    """(4 pi/(2l+1)) |phi_l0|^2 + (8 pi^2/(2l+1)) sum_jm |psi^j_lm|^2 = 1, l >= |s|."""
    transform = SpinWaveletTransform(bandlimit, spin, directions, **options)
    assert transform.admissibility_error <= 16 * EPS


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi, -7.3])
@pytest.mark.parametrize(
    "directionality",
    [
        *(SteerableDirectionality(directions) for directions in (1, 2, 3, 6)),
        CurveletDirectionality(),
        CurveletDirectionality(centred=True),
    ],
    ids=repr,
)
def test_steering_gives_the_coefficients_at_any_angle(directionality, angle):
    """W(g) = sum_k z(g - g_k) W(g_k) equals the direct sum at g."""
    transform = SpinWaveletTransform(8, 2, directionality=directionality)
    flm = random_flm(8, 2)
    steered = transform.analysis_harmonic(flm).steer(angle)
    for scale in transform.scales:
        grid = transform.grid_of(transform.bandlimits[scale])
        orders = transform.wavelets.orientations_of(scale).orders
        angles = euler_grid(grid, np.array([angle]))
        desired = direct_function(wavelet_wigner(flm, transform.wavelets, scale), orders, angles)
        atol = tolerance(8) * EPS * np.linalg.norm(flm)
        np.testing.assert_allclose(
            steered[scale], desired.reshape(grid.shape), rtol=0, atol=atol, err_msg=str(scale)
        )


@pytest.mark.parametrize("directions", [1, 2, 3, 4, 7])
def test_half_a_turn_of_a_wavelet_is_a_sign(directions):
    """W(g + pi) = (-1)^(N-1) W(g)."""
    coefficients = SpinWaveletTransform(16, -2, directions).analysis_harmonic(random_flm(16, 2))
    here, there = coefficients.steer(0.3), coefficients.steer(0.3 + np.pi)
    for scale in coefficients.scales:
        sign = (-1) ** (directions - 1)
        assert_close(there[scale], sign * here[scale], ulps=64 * directions)


@pytest.mark.parametrize("directions", [1, 2, 3, 4])
@pytest.mark.parametrize("spin", [0, 2, -3])
def test_point_inversion_mirrors_positions_and_orientations(spin, directions):
    """f_lm (-1)^l has W(a, b, g) of f at (a + pi, pi - b, -g)."""
    transform = SpinWaveletTransform(8, spin, directions, sampling="mwss", multiresolution=False)
    flm = random_flm(8, spin)
    signs = np.repeat((-1.0) ** np.arange(8), 2 * np.arange(8) + 1)
    plain, inverted = (transform.analysis_harmonic(f) for f in (flm, signs * flm))
    for k, gamma in enumerate(transform.orientations):
        mirrored = plain.steer(-gamma)
        for scale in transform.scales:
            desired = np.roll(mirrored[scale][::-1], 8, axis=-1)
            assert_close(inverted[scale][k], desired, ulps=16 * tolerance(8))


@pytest.mark.parametrize("directions", [1, 2, 3, 4])
def test_real_signals_have_real_coefficients(directions):
    """Spin 0: the wavelets are real whether N is odd or even."""
    coefficients = SpinWaveletTransform(16, 0, directions).analysis_harmonic(random_real_flm(16))
    for _, values in items(coefficients):
        assert np.max(np.abs(values.imag)) <= tolerance(16) * EPS * np.max(np.abs(values))


@pytest.mark.parametrize("sampling", ["mw", "mwss"])
@pytest.mark.parametrize(("spin", "directions"), [(0, 2), (2, 3)])
def test_rotation_about_the_pole_shifts_positions(spin, directions, sampling):
    """f(theta, phi - a) has W^j(alpha - a, beta, gamma), for a step a of any scale's grid."""
    transform = SpinWaveletTransform(16, spin, directions, sampling=sampling)
    flm = random_flm(16, spin)
    m = np.concatenate([np.arange(-el, el + 1) for el in range(16)])
    plain = transform.analysis_harmonic(flm)
    for scale, bandlimit in transform.bandlimits.items():
        step = transform.grid_of(bandlimit).longitudes[3 % plain[scale].shape[-1]]
        turned = transform.analysis_harmonic(flm * np.exp(-1j * m * step))
        desired = np.roll(plain[scale], 3, axis=-1)
        assert_close(turned[scale], desired, ulps=16 * tolerance(16))


@pytest.mark.parametrize(("spin", "directions"), [(0, 2), (2, 3), (-3, 4)])
def test_any_rotation_moves_position_and_orientation(spin, directions):
    """<R f, R_rho psi> = <f, R^-1 R_rho psi>: the coefficients of the turned signal at rho."""
    spherical = pytest.importorskip("spherical")
    quaternionic = pytest.importorskip("quaternionic")
    bandlimit = 6
    flm = random_flm(bandlimit, spin)
    turn = quaternionic.array.from_euler_angles(0.7, 1.2, -0.4)
    wigner = spherical.Wigner(bandlimit - 1)
    # (R f)_lm = sum_n D^l_mn(R) f_ln; that package's D is the conjugate of ours.
    matrix, turned = wigner.D(turn).conj(), np.zeros_like(flm)
    for el in range(bandlimit):
        for m in range(-el, el + 1):
            first = wigner.Dindex(el, m, -el)
            row = matrix[first : first + 2 * el + 1]
            turned[el * el + el + m] = row @ flm[el**2 : (el + 1) ** 2]
    transform = SpinWaveletTransform(bandlimit, spin, directions)
    coefficients = transform.analysis_harmonic(turned)
    orders = transform.wavelets.directionality.orders
    for scale, size in transform.bandlimits.items():
        angles = euler_grid(transform.grid_of(size), transform.orientations)
        points = quaternionic.array(
            [quaternionic.array.from_euler_angles(*a) for a in zip(*angles, strict=True)]
        )
        moved = np.moveaxis((turn.inverse * points).to_euler_angles, -1, 0)
        desired = direct_function(wavelet_wigner(flm, transform.wavelets, scale), orders, moved)
        found = coefficients[scale].ravel()
        # Angles recovered near a pole are good to the root of eps, in sums of them better.
        np.testing.assert_allclose(found, desired, rtol=0, atol=1e-12 * np.linalg.norm(flm))


@pytest.mark.parametrize("part", ["scaling", 0, 3, 4])
def test_parts_of_a_synthesis_add_up(part):
    """Synthesis of some parts is that of coefficients zero in the others."""
    transform = SpinWaveletTransform(16, 2, 3)
    coefficients = transform.analysis_harmonic(random_flm(16, 2))
    others = {"scaling", *transform.scales} - {part}
    alone = transform.synthesis_harmonic(coefficients, parts=[part])
    rest = transform.synthesis_harmonic(coefficients, parts=others)
    zeroed = transform.synthesis_harmonic(coefficients * dict.fromkeys(others, 0.0))
    assert_close(alone, zeroed, ulps=0)
    assert_close(alone + rest, transform.synthesis_harmonic(coefficients), ulps=8)
    assert not np.any(transform.synthesis_harmonic(coefficients, parts=()))


@pytest.mark.parametrize("parts", [3, "scaling", 0.5, [[1]], [np.arange(2)]])
def test_parts_are_a_collection_of_parts(parts):
    transform = SpinWaveletTransform(8)
    coefficients = transform.analysis_harmonic(random_flm(8))
    with pytest.raises(ParameterError, match=r"parts=.* must be among 'scaling' and the scales"):
        transform.synthesis_harmonic(coefficients, parts=parts)


@pytest.mark.parametrize("part", ["wavelets", 99, -1, None])
def test_parts_are_those_of_the_transform(part):
    transform = SpinWaveletTransform(8)
    coefficients = transform.analysis_harmonic(random_flm(8))
    with pytest.raises(ParameterError, match=r"must be among 'scaling' and the scales \(0, 1, 2"):
        transform.synthesis_harmonic(coefficients, parts=[part])


@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("batch", [(3,), (2, 2), (1,), (0,)])
def test_leading_axes_are_a_batch(batch, real):
    transform = SpinWaveletTransform(8, 0 if real else 2, 3, real=real)
    flm = random_signal(transform, batch=batch)
    coefficients = transform.analysis_harmonic(flm)
    for key, values in items(coefficients):
        assert values.shape == (*batch, *transform.shapes[key])
    back = transform.synthesis_harmonic(coefficients)
    assert back.shape == flm.shape
    assert transform.analysis(transform.harmonic.synthesis(flm)).shapes == coefficients.shapes
    for place in np.ndindex(*batch):
        alone = transform.analysis_harmonic(flm[place])
        for key, values in items(alone):
            stored = coefficients.scaling if key == "scaling" else coefficients[key]
            assert np.array_equal(stored[place], values)
        # Sums over rings are in another order for one map than for more.
        assert_close(back[place], transform.synthesis_harmonic(alone), ulps=16)


@pytest.mark.parametrize(("spin", "real"), [(0, True), (2, False)])
def test_results_have_the_same_bits_on_any_number_of_threads(spin, real):
    flm = None
    bandlimit = 20 if IS_UNCOMPILED else 40
    for threads in (1, 2, 3, 5):
        transform = SpinWaveletTransform(bandlimit, spin, 3, real=real, threads=threads)
        if flm is None:
            flm = random_signal(transform)
            noise = random_coefficients(transform)
            first = transform
        for name in ("analysis_harmonic", "adjoint_synthesis_harmonic"):
            assert_equal(getattr(transform, name)(flm), getattr(first, name)(flm))
        for name in ("synthesis_harmonic", "adjoint_analysis_harmonic"):
            assert np.array_equal(getattr(transform, name)(noise), getattr(first, name)(noise))


def test_one_transform_serves_many_threads():
    transform = SpinWaveletTransform(24, 2, 3, threads=2)
    signals = random_flm(24, 2, batch=(6,))

    def work(flm):
        return transform.synthesis_harmonic(transform.analysis_harmonic(flm))

    alone = [work(flm) for flm in signals]
    with ThreadPoolExecutor(3) as pool:
        assert np.array_equal(alone, list(pool.map(work, signals)))


def test_inputs_are_left_alone():
    transform = SpinWaveletTransform(8, 2, 2)
    flm = random_flm(8)
    before = flm.copy()
    flm.flags.writeable = False
    coefficients = transform.analysis_harmonic(flm)
    kept = coefficients.copy()
    transform.synthesis_harmonic(coefficients)
    transform.adjoint_analysis_harmonic(coefficients)
    assert np.array_equal(flm, before)
    assert_equal(coefficients, kept)


def test_degrees_below_the_spin_do_not_contribute():
    transform = SpinWaveletTransform(8, 3, 2)
    flm = random_flm(8)
    cleared = flm.copy()
    cleared[:9] = 0
    assert_equal(transform.analysis_harmonic(flm), transform.analysis_harmonic(cleared))


def test_dtypes_and_layouts_do_not_matter():
    transform = SpinWaveletTransform(8, 2, 2)
    signal = random_like(np.empty((15, 8)), seed=3).astype(">f4").T
    plain = np.ascontiguousarray(signal, dtype=complex)
    assert_equal(transform.analysis(signal), transform.analysis(plain))


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    ("bandlimit", "spin", "directions"),
    [(1024, 2, 3), (1024, 2, 9), (1024, -8, 8), (2048, 2, 1), (4096, 2, 1)],
)
def test_synthesis_undoes_analysis_at_high_degree(bandlimit, spin, directions):
    transform = SpinWaveletTransform(bandlimit, spin, directions)
    flm = random_flm(bandlimit, spin)
    found = transform.synthesis_harmonic(transform.analysis_harmonic(flm))
    assert relative_error(found, flm) <= bandlimit * EPS
    assert np.max(np.abs(found - flm)) < 1e-11


def test_objects_describe_themselves_and_are_frozen():
    transform = SpinWaveletTransform(np.int64(16), 2, 3, lowest_scale=1, sampling="mwss")
    assert type(transform.bandlimit) is int
    assert transform.sampling == MWSS(16)
    assert transform.scales == (1, 2, 3, 4)
    assert transform.bandlimits == {1: 4, 2: 8, 3: 16, 4: 16}
    assert transform.shapes["scaling"] == (3, 4)
    assert transform.shapes[2] == (3, 9, 16)
    assert_close(transform.orientations, np.arange(3) * np.pi / 3, ulps=1)
    with pytest.raises(FrozenInstanceError):
        transform.spin = 0


@pytest.mark.parametrize("make_copy", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_copies_and_pickles_transform_alike(make_copy):
    """So that other processes can have them, before their first use and after."""
    transform, flm = SpinWaveletTransform(8, 2, 3), random_flm(8, 2)
    unused = make_copy(transform)
    desired = transform.analysis_harmonic(flm)
    for one in (unused, make_copy(transform)):
        assert_equal(one.analysis_harmonic(flm), desired)


def test_coefficients_know_what_made_them():
    transform = SpinWaveletTransform(16, 2, 3, dilation=3, lowest_scale=1, sampling="mwss")
    found = transform.analysis_harmonic(random_flm(16)).parameters
    assert found == {
        "bandlimit": 16,
        "spin": 2,
        "directions": 3,
        "dilation": 3.0,
        "lowest_scale": 1,
        "sampling": "mwss",
        "multiresolution": True,
        "real": False,
    }


def test_tiling_may_be_given():
    tiling = ScaleDiscretisedTiling(16, dilation=3.0, lowest_scale=1)
    given = SpinWaveletTransform(16, 2, 3, tiling=tiling)
    named = SpinWaveletTransform(16, 2, 3, dilation=3.0, lowest_scale=1)
    flm = random_flm(16, 2)
    assert_equal(given.analysis_harmonic(flm), named.analysis_harmonic(flm))
    assert (given.dilation, given.lowest_scale) == (3.0, 1)


@pytest.mark.parametrize("tiling", ["s2let", 3, ScaleDiscretisedTiling])
def test_tiling_is_a_tiling(tiling):
    with pytest.raises(ParameterError, match=r"tiling=.* must be a Tiling"):
        SpinWaveletTransform(8, tiling=tiling)


@pytest.mark.parametrize("option", [{"dilation": 2.0}, {"lowest_scale": 0}])
def test_a_tiling_has_its_own_dilation_and_lowest_scale(option):
    """They were ignored without a word."""
    with pytest.raises(ParameterError, match="cannot be given with a tiling, which has its own"):
        SpinWaveletTransform(8, tiling=ScaleDiscretisedTiling(8), **option)


@pytest.mark.parametrize("value", ["no", 1, 0, None])
@pytest.mark.parametrize("name", ["real", "multiresolution"])
def test_flags_are_true_or_false(name, value):
    """The text "no" counted as true."""
    with pytest.raises(ParameterError, match=rf"{name}=.* must be True or False"):
        SpinWaveletTransform(8, **{name: value})


def test_tiling_of_another_bandlimit_is_refused():
    with pytest.raises(ParameterError, match="tiling has bandlimit 8 but the transform has 16"):
        SpinWaveletTransform(16, tiling=ScaleDiscretisedTiling(8))


@pytest.mark.parametrize("bandlimit", [0, -1, 2.5, True, "8", None])
def test_bandlimit_is_a_positive_integer(bandlimit):
    with pytest.raises(ParameterError, match=r"bandlimit=.* must be an integer of at least 1"):
        SpinWaveletTransform(bandlimit)


@pytest.mark.parametrize("spin", [8, -8, 1.0, True, "2", None])
def test_spin_is_an_integer_below_the_bandlimit(spin):
    with pytest.raises(ParameterError, match=r"spin=.* must be"):
        SpinWaveletTransform(8, spin)


@pytest.mark.parametrize("directions", [0, -1, 9, 2.0, True, "2"])
def test_directions_are_an_integer_up_to_the_bandlimit(directions):
    with pytest.raises(ParameterError, match=r"directions=.* must"):
        SpinWaveletTransform(8, 0, directions)


@pytest.mark.parametrize("dilation", [1, 0.5, -2, np.nan, np.inf, "2", True])
def test_dilation_exceeds_one(dilation):
    with pytest.raises(ParameterError, match=r"dilation=.* must"):
        SpinWaveletTransform(8, dilation=dilation)


@pytest.mark.parametrize("lowest_scale", [-1, 1.5, True, "0", 20])
def test_lowest_scale_is_an_integer_with_a_scale_above(lowest_scale):
    with pytest.raises(ParameterError, match=r"lowest_scale=.* must"):
        SpinWaveletTransform(8, lowest_scale=lowest_scale)


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "a", "2", [1], np.nan, np.inf])
def test_threads_are_a_positive_integer(threads):
    with pytest.raises(ParameterError, match=r"threads=.* must be a positive integer, or None"):
        SpinWaveletTransform(8, threads=threads)


def test_signals_with_spin_are_not_real():
    with pytest.raises(ParameterError, match="real=True needs spin 0, not spin=2"):
        SpinWaveletTransform(8, 2, real=True)


@pytest.mark.parametrize("sampling", ["hpx", 3, MW(9)])
def test_sampling_is_known_and_has_the_same_bandlimit(sampling):
    with pytest.raises(ParameterError, match="sampling"):
        SpinWaveletTransform(8, sampling=sampling)


@pytest.mark.parametrize("name", ["analysis_harmonic", "adjoint_synthesis_harmonic"])
@pytest.mark.parametrize(
    ("flm", "error", "message"),
    [
        (np.zeros(63), ShapeError, r"bandlimit\*\*2 = 64 long"),
        (np.full(64, "a"), DataError, "must hold numbers"),
        (np.full(64, None), DataError, "dtype object"),
        (np.full(64, np.nan), DataError, "NaN or infinite"),
    ],
)
@pytest.mark.parametrize("spin", [0, 2])
def test_coefficients_that_cannot_be_used_are_refused(name, flm, error, message, spin):
    with pytest.raises(error, match=message):
        getattr(SpinWaveletTransform(8, spin), name)(flm)


@pytest.mark.parametrize("name", ["analysis", "adjoint_synthesis"])
@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        (np.zeros((15, 8)), ShapeError, r"shape \(15, 8\); it must be \(\.\.\., 8, 15\)"),
        (np.full((8, 15), None), DataError, "dtype object"),
        (np.full((8, 15), np.nan), DataError, "120 values that are not finite"),
        (np.zeros((8, 15), dtype=complex), DataError, "complex but real=True was asked for"),
    ],
)
def test_maps_that_cannot_be_used_are_refused(name, values, error, message):
    with pytest.raises(error, match=message):
        getattr(SpinWaveletTransform(8, real=True), name)(values)


SYNTHESES = ["synthesis", "synthesis_harmonic", "adjoint_analysis", "adjoint_analysis_harmonic"]


@pytest.mark.parametrize("name", SYNTHESES)
@pytest.mark.parametrize("value", [None, np.zeros(64), {"scaling": 0}])
def test_synthesis_takes_coefficients_alone(name, value):
    with pytest.raises(ParameterError, match="pass the WaveletCoefficients that analysis returns"):
        getattr(SpinWaveletTransform(8), name)(value)


@pytest.mark.parametrize("name", SYNTHESES)
@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((16,), {}, r"have scales \(0, 1, 2, 3, 4\) but the transform has \(0, 1, 2, 3\)"),
        ((8,), {"lowest_scale": 1}, r"have scales \(1, 2, 3\)"),
        ((8, 0, 2), {}, "scale 0 has shape"),
        ((8,), {"sampling": "mwss"}, "scaling part has shape"),
        ((8,), {"multiresolution": False}, "scaling part has shape"),
    ],
)
def test_coefficients_of_another_shape_are_refused(name, arguments, options, message):
    other = SpinWaveletTransform(*arguments, **options)
    coefficients = other.analysis_harmonic(np.zeros(other.bandlimit**2))
    with pytest.raises(ShapeError, match=message):
        getattr(SpinWaveletTransform(8), name)(coefficients)


@pytest.mark.parametrize("name", SYNTHESES)
def test_coefficients_that_are_not_finite_are_refused(name):
    transform = SpinWaveletTransform(8)
    coefficients = transform.analysis_harmonic(random_flm(8))
    wavelets = {j: coefficients[j].copy() for j in coefficients.scales}
    wavelets[2][0, 1, 1] = np.nan
    broken = WaveletCoefficients(coefficients.scaling, wavelets, coefficients.parameters)
    with pytest.raises(DataError, match="scale 2 has 1 value that is not finite"):
        getattr(transform, name)(broken)


@pytest.mark.parametrize("name", SYNTHESES)
def test_complex_coefficients_are_not_real(name):
    coefficients = SpinWaveletTransform(8).analysis_harmonic(random_flm(8))
    with pytest.raises(DataError, match="scaling part is complex but real=True was asked for"):
        getattr(SpinWaveletTransform(8, real=True), name)(coefficients)


@pytest.mark.parametrize("name", SYNTHESES)
def test_coefficients_of_another_dilation_are_refused(name):
    """Scales and shapes are the same, the wavelets are not: synthesis was off by 7e-4."""
    coefficients = SpinWaveletTransform(8, 2, 3).analysis_harmonic(random_flm(8, 2))
    other = SpinWaveletTransform(8, 2, 3, dilation=1.99)
    with pytest.raises(ParameterError, match=r"have dilation=2\.0 but the transform has 1\.99"):
        getattr(other, name)(coefficients)


@dataclass(frozen=True)
class Halves(Tiling):
    """Everything in one scale: a tiling such as a user may write."""

    bandlimit: int
    lowest_scale: int = 0
    highest_scale = 0
    scaling_bandlimit = 1

    def scale_bandlimit(self, scale):  # noqa: ARG002
        return self.bandlimit

    def scale_lowest_degree(self, scale):  # noqa: ARG002
        return 1

    def _profiles(self):
        scaling, wavelets = np.zeros(self.bandlimit), np.ones((1, self.bandlimit))
        scaling[0], wavelets[0, 0] = 1, 0
        return scaling, wavelets


def custom_tiling(share):
    """One scale of degrees 1 to 7, and a share of degree 1 left to the scaling function."""
    scaling, wavelets = np.zeros(8), np.ones((1, 8))
    scaling[:2], wavelets[0, :2] = (1, share), (0, np.sqrt(1 - share**2))
    return CustomTiling(scaling, wavelets)


TILINGS = [
    ScaleDiscretisedTiling(8),
    ScaleDiscretisedTiling(8, dilation=1.99),
    ScaleDiscretisedTiling(8, quadrature="s2let"),
    NeedletTiling(8),
    SplineTiling(8),
    HybridTiling(8, dilations=(2.0,)),
    HybridTiling(8, dilations=(2.0, 1.9), transitions=(4,)),
    custom_tiling(0.6),
    custom_tiling(0.61),
    Halves(8),
]


def test_coefficients_know_the_tiling_that_made_them():
    """Of each tiling the parameters are its own, and the same every time."""
    kept = []
    for tiling in TILINGS:
        one = SpinWaveletTransform(8, tiling=tiling).analysis_harmonic(random_flm(8))
        again = SpinWaveletTransform(8, tiling=copy.deepcopy(tiling))
        assert_close(again.synthesis_harmonic(one), random_flm(8), ulps=tolerance(8))
        assert dict(one.parameters) not in kept
        kept.append(dict(one.parameters))


@pytest.mark.parametrize("tiling", TILINGS)
def test_coefficients_of_another_tiling_are_refused_from_a_file_too(tiling, tmp_path):
    transform = SpinWaveletTransform(8, 2, 3, tiling=tiling)
    flm = random_flm(8, 2)
    path = write_coefficients(tmp_path / "w.fits", transform.analysis_harmonic(flm))
    found = read_coefficients(path)
    assert_close(transform.synthesis_harmonic(found), flm, ulps=tolerance(8))
    for other in TILINGS:
        if other is not tiling:
            with pytest.raises((ParameterError, ShapeError), match=r"coefficients have|has shape"):
                SpinWaveletTransform(8, 2, 3, tiling=other).synthesis_harmonic(found)


def test_the_tiling_by_default_may_be_given():
    """What dilation and lowest_scale say needs no name of its own."""
    named = SpinWaveletTransform(8, 2, dilation=1.9, lowest_scale=1)
    given = SpinWaveletTransform(
        8, 2, tiling=ScaleDiscretisedTiling(8, dilation=1.9, lowest_scale=1)
    )
    flm = random_flm(8, 2)
    found = given.synthesis_harmonic(named.analysis_harmonic(flm))
    assert np.array_equal(found, named.synthesis_harmonic(named.analysis_harmonic(flm)))


@pytest.mark.parametrize("part", [np.real, np.imag])
def test_parts_of_a_spin_analysis_may_be_synthesised_as_real_scalars(part):
    """E and B: the coefficients of another spin, and real, are taken."""
    coefficients = SpinWaveletTransform(8, 2, 3).analysis_harmonic(random_flm(8, 2)).map(part)
    real = SpinWaveletTransform(8, 0, 3, real=True).synthesis_harmonic(coefficients)
    full = SpinWaveletTransform(8, 0, 3).synthesis_harmonic(coefficients)
    assert_close(real, full, ulps=tolerance(8))


@needs_compiler
@pytest.mark.parametrize("spin", [0, 2])
def test_read_only_arrays_are_not_compiled_for(spin):
    """To the compiler a read-only array is another type: it took seconds at the first of them."""
    kernels = (order_sums.fill_columns, order_sums.add_columns_to_harmonics)
    flm = random_flm(8, spin)
    unaligned = np.frombuffer(b"1" + flm.tobytes(), dtype=complex, offset=1)
    flm.flags.writeable = False
    kinds = (flm.copy(), flm, np.broadcast_to(flm, (2, 64)), unaligned)
    counts = []
    for given in kinds:
        for transform in (
            SpinHarmonicTransform(8, spin),
            HealpixTransform(4, 8, spin),
            SpinWaveletTransform(8, spin, 2),
        ):
            found = (
                transform.synthesis(transform.analysis_harmonic(given))
                if isinstance(transform, SpinWaveletTransform)
                else transform.synthesis(given)
            )
            found.flags.writeable = False
            transform.adjoint_synthesis(found)
        functions = WignerTransform(8, (spin,)).synthesis(given[..., None, :])
        functions.flags.writeable = False
        WignerTransform(8, (spin,)).analysis(functions)
        counts.append([len(kernel.signatures) for kernel in kernels])
    assert counts[1:] == counts[:-1]


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("directions", [1, 2, 3, 5])
@pytest.mark.parametrize("spin", [0, 2, -3])
def test_round_trips_at_bandlimit_512_reach_1e_12(spin, directions):
    """||synthesis(analysis(f)) - f|| <= 1e-12 ||f||, in harmonic space and on maps."""
    transform = SpinWaveletTransform(512, spin, directions)
    flm = random_flm(512, spin, seed=3)
    found = transform.synthesis_harmonic(transform.analysis_harmonic(flm))
    assert relative_error(found, flm) <= 1e-12
    maps = transform.harmonic.synthesis(flm)
    assert relative_error(transform.synthesis(transform.analysis(maps)), maps) <= 1e-12


def test_analysis_by_part_takes_each_part_from_its_own_coefficients():
    transform = SpinWaveletTransform(16, 2, 2)
    flms = {key: random_flm(16, 2, seed=i) for i, key in enumerate(transform.shapes)}
    found = transform.analysis_by_part(flms)
    for key, flm in flms.items():
        alone = transform.analysis_harmonic(flm)
        of = [c.scaling if key == "scaling" else c[key] for c in (found, alone)]
        assert np.array_equal(*of)
    with pytest.raises(ParameterError, match=r"flms has the parts \['scaling'\]; it must have"):
        transform.analysis_by_part({"scaling": flms["scaling"]})
