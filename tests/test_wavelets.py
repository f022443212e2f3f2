"""The laws of wavelets in harmonic space."""

from __future__ import annotations

import subprocess
import sys
from math import factorial

import numpy as np
import pytest

from spinsdw.directionality import (
    CurveletDirectionality,
    RidgeletDirectionality,
    SteerableDirectionality,
)
from spinsdw.errors import ParameterError
from spinsdw.harmonics import degrees
from spinsdw.tiling import (
    CustomTiling,
    HybridTiling,
    NeedletTiling,
    ScaleDiscretisedTiling,
    SplineTiling,
)
from spinsdw.wavelets import Wavelets
from tests.helpers import assert_close, random_flm

TILINGS = [
    ScaleDiscretisedTiling(3),
    ScaleDiscretisedTiling(5),
    ScaleDiscretisedTiling(513),
    ScaleDiscretisedTiling(125, dilation=5),
    ScaleDiscretisedTiling(64, dilation=1.5, lowest_scale=2),
    ScaleDiscretisedTiling(64, dilation=3),
    NeedletTiling(40),
    SplineTiling(40, lowest_scale=2),
    HybridTiling(100, dilations=(3, 1.4), transitions=(30,)),
]
each_tiling = pytest.mark.parametrize("tiling", TILINGS, ids=lambda tiling: repr(tiling)[:90])


def make(bandlimit=32, directions=3, spin=0, **more):
    tiling = ScaleDiscretisedTiling(bandlimit)
    return Wavelets(tiling, SteerableDirectionality(directions), spin, **more)


def analyse(wavelets, flm):
    """W_lmn = 8pi^2/(2l+1) f_lm conj(psi_ln) and sqrt(4pi/(2l+1)) f_lm phi_l0, order by order."""
    el = degrees(wavelets.bandlimit)
    smooth = np.sqrt(4 * np.pi / (2 * el + 1)) * flm * wavelets.scaling_harmonics[el]
    detail = {}
    for scale in wavelets.scales:
        psi = wavelets.wavelet_harmonics(scale)
        held = el[el < psi.shape[1]]
        detail[scale] = 8 * np.pi**2 / (2 * held + 1) * flm[: held.size] * psi[:, held].conj()
    return smooth, detail


def synthesise(wavelets, smooth, detail):
    """f_lm = sqrt(4pi/(2l+1)) W_lm phi_l0 + sum_jn W^j_lmn psi^j_ln."""
    el = degrees(wavelets.bandlimit)
    flm = np.sqrt(4 * np.pi / (2 * el + 1)) * smooth * wavelets.scaling_harmonics[el]
    for scale, values in detail.items():
        psi = wavelets.wavelet_harmonics(scale)
        held = el[el < psi.shape[1]]
        flm[: held.size] += np.sum(values * psi[:, held], axis=0)
    return flm


@each_tiling
@pytest.mark.parametrize("directions", [1, 2, 3])
@pytest.mark.parametrize("spin", [0, 1, 2, -2])
def test_wavelets_lose_nothing_and_count_nothing_twice(tiling, directions, spin):
    """4pi/(2l+1) |phi_l|**2 + 8pi^2/(2l+1) sum_jm |psi_lm|**2 = 1 for l >= |s|, 0 below."""
    wavelets = Wavelets(tiling, SteerableDirectionality(directions), spin)
    expected = (np.arange(tiling.bandlimit) >= abs(spin)).astype(float)
    assert_close(wavelets.admissibility, expected, ulps=16)
    assert wavelets.admissibility_error == np.max(np.abs(wavelets.admissibility[abs(spin) :] - 1))


@pytest.mark.parametrize(
    ("directions", "spin"), [(32, 0), (31, 2), (17, -31), (6, 31), (5, -8), (4, 3)]
)
def test_directions_and_spins_reach_up_to_the_bandlimit(directions, spin):
    """N > L_j at small scales, and scales with L_j <= |s| that are zero throughout."""
    wavelets = make(directions=directions, spin=spin)
    assert wavelets.admissibility_error < 16 * np.finfo(float).eps
    for scale in wavelets.scales:
        psi = wavelets.wavelet_harmonics(scale)
        assert psi.shape == (directions, wavelets.tiling.scale_bandlimit(scale))
        assert not np.any(psi[:, : abs(spin)])


def test_smallest_bandlimits_have_wavelets():
    """L = 1 holds degree 0 in the scaling function, L = 2 degree 1 in scale 0."""
    one, two = make(1, 1), make(2, 1)
    assert one.scaling_harmonics.tolist() == [np.sqrt(1 / (4 * np.pi))]
    assert not np.any(one.wavelet_harmonics(0))
    assert two.scaling_harmonics[1] == 0
    assert_close(two.wavelet_harmonics(0), [[0, np.sqrt(3 / (8 * np.pi**2))]], ulps=4)


@pytest.mark.parametrize("directions", [1, 4, 5])
def test_wavelet_is_tiling_times_directionality(directions):
    """psi_ln = sqrt((2l+1)/8pi^2) kappa_j(l) zeta_ln and phi_l = sqrt((2l+1)/4pi) eta(l)."""
    wavelets = make(directions=directions, spin=2)
    zeta, el = wavelets.directionality.coefficients(32), np.arange(32)
    held = el >= 2
    for scale in wavelets.scales:
        psi = np.zeros((directions, 32), dtype=complex)
        rows = wavelets.wavelet_harmonics(scale)
        psi[:, : rows.shape[1]] = rows
        kappa = wavelets.tiling.kernel(scale)
        assert_close(psi, held * np.sqrt((2 * el + 1) / (8 * np.pi**2)) * kappa * zeta, ulps=4)
    phi = held * np.sqrt((2 * el + 1) / (4 * np.pi)) * wavelets.tiling.scaling_kernel
    assert_close(wavelets.scaling_harmonics, phi, ulps=4)


@pytest.mark.parametrize("directions", [1, 2, 3, 4, 5])
def test_scalar_wavelets_are_real_functions(directions):
    """psi_{l,-n} = (-1)**n conj(psi_ln), for odd and even N."""
    wavelets = make(directions=directions)
    signs = np.array([(-1) ** n for n in wavelets.directionality.orders])[:, None]
    psi = wavelets.wavelet_harmonics(4)
    assert np.array_equal(psi[::-1], signs * psi.conj())


@pytest.mark.parametrize("original_spin", [0, 2, -2, 3, -1])
@pytest.mark.parametrize(("directions", "spin"), [(1, 0), (2, 2), (3, -2), (20, 1)])
def test_dual_synthesises_what_was_analysed(directions, spin, original_spin):
    """Synthesis with -r undoes analysis with r, from the larger of |r| and |s| upwards."""
    wavelets = make(16, min(directions, 16), spin, original_spin=original_spin)
    flm = random_flm(16, wavelets.lowest_degree)
    # Factors up to 18!/12! come and go again.
    assert_close(synthesise(wavelets.dual, *analyse(wavelets, flm)), flm, ulps=64)
    assert wavelets.dual.dual == wavelets
    assert wavelets.admissibility_error < 32 * np.finfo(float).eps


@pytest.mark.parametrize("spin", [0, 3, -2])
@pytest.mark.parametrize(
    "directionality",
    [
        CurveletDirectionality(),
        CurveletDirectionality(centred=True),
        RidgeletDirectionality(),
        RidgeletDirectionality(1),
    ],
    ids=repr,
)
@pytest.mark.parametrize("original_spin", [0, 1, -4])
def test_other_directionalities_lose_their_lost_degrees_alone(directionality, spin, original_spin):
    """The sum of admissibility is 1 at every degree from |s| and |r| that is not lost."""
    tiling = ScaleDiscretisedTiling(20, lowest_scale=2)
    wavelets = Wavelets(tiling, directionality, spin, original_spin=original_spin)
    el, lost = np.arange(20), wavelets.lost_degrees
    below = (el >= abs(spin)) & (el < abs(original_spin))
    ridge = isinstance(directionality, RidgeletDirectionality)
    # The scaling function holds degrees up to half its bandlimit, 4, without help.
    assert np.array_equal(
        lost, below | ((el >= max(abs(spin), 3)) & ((el + spin) % 2 == 1) & ridge)
    )
    kept = ~lost & (el >= wavelets.lowest_degree)
    assert_close(wavelets.admissibility[kept], np.ones(np.sum(kept)), ulps=64)
    assert np.all(wavelets.admissibility[lost] < 0.9)
    assert wavelets.admissibility_error < 64 * np.finfo(float).eps


def test_measured_tilings_lose_no_degree():
    """With a tolerance the scaling function may hold a little less than all of degree 0."""
    tiling = CustomTiling([0.9995, 0.6, 0], [[0, 0.8, 0.9995]], tolerance=1e-2)
    for directionality in (SteerableDirectionality(2), RidgeletDirectionality()):
        wavelets = Wavelets(tiling, directionality)
        assert not wavelets.lost_degrees[[0, 2]].any()


def test_frame_response_is_one_for_tight_frames_and_the_square_of_the_factor_for_others():
    assert_close(make(16, 3, 2).frame_response[2:], np.ones(14), ulps=16)
    lowered = [factorial(el + 2) // factorial(el - 2) for el in range(2, 16)]
    found = make(16, 3, original_spin=2).frame_response
    assert_close(found[2:] / lowered, np.ones(14), ulps=32)
    assert not np.any(found[:2])


def test_energy_is_kept():
    """sum |f|**2 = sum |W^phi|**2 + sum_jlmn (2l+1)/8pi^2 |W^j_lmn|**2."""
    wavelets = make(16, 4, spin=2)
    flm, el = random_flm(16, 2), degrees(16)
    smooth, detail = analyse(wavelets, flm)
    energy = np.sum(np.abs(smooth) ** 2)
    for values in detail.values():
        weights = (2 * el[: values.shape[1]] + 1) / (8 * np.pi**2)
        energy += np.sum(weights * np.abs(values) ** 2)
    assert_close(energy, np.sum(np.abs(flm) ** 2), ulps=256)


@pytest.mark.parametrize("r", [1, 2, 3])
def test_spin_lowered_wavelets_carry_the_ratio_of_factorials(r):
    """(-1)**r sqrt((l+r)!/(l-r)!) for r > 0, and its inverse for r < 0."""
    plain, up, down = make(), make(original_spin=r), make(original_spin=-r)
    ratio = [factorial(el + r) // factorial(el - r) for el in range(r, 32)]
    factor = (-1) ** r * np.sqrt(np.array(ratio, dtype=float))
    for scale in (3, 5):
        psi = plain.wavelet_harmonics(scale)[:, r:]
        used = factor[: psi.shape[1]]
        assert_close(up.wavelet_harmonics(scale)[:, r:], psi * used, ulps=16)
        assert_close(down.wavelet_harmonics(scale)[:, r:], psi / used, ulps=16)
        assert not np.any(up.wavelet_harmonics(scale)[:, :r])
        assert not np.any(down.wavelet_harmonics(scale)[:, :r])


def test_parts_are_shown():
    wavelets = make(32, 3, 2, original_spin=-3)
    assert wavelets.bandlimit == 32
    assert wavelets.scales == range(6)
    assert wavelets.lowest_degree == 3
    assert wavelets == make(32, 3, 2, original_spin=-3)
    assert wavelets != make(32, 3, 2)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"directions": 9}, "directions=9 must not exceed bandlimit=8"),
        ({"spin": 8}, "spin=8 must be smaller in size than bandlimit=8"),
        ({"spin": -8}, "spin=-8 must be smaller"),
        ({"spin": 1.0}, r"spin=1\.0 must be an integer"),
        ({"original_spin": 8}, "original_spin=8 must be smaller"),
        ({"original_spin": "2"}, "original_spin='2' must be an integer"),
        ({"bandlimit": 1, "directions": 2}, "directions=2 must not exceed bandlimit=1"),
        ({"bandlimit": 1, "directions": 1, "spin": 1}, "spin=1 must be smaller"),
        ({"bandlimit": 300, "original_spin": 200}, "must keep .* below 1e300"),
        ({"bandlimit": 300, "original_spin": -200}, "must keep .* below 1e300"),
    ],
)
def test_wavelets_name_the_bad_parameter(parameters, message):
    with pytest.raises(ParameterError, match=message):
        make(**{"bandlimit": 8, **parameters})


@pytest.mark.parametrize(
    ("tiling", "directionality", "message"),
    [
        (8, SteerableDirectionality(1), "tiling=8 must be a Tiling"),
        (ScaleDiscretisedTiling(8), 3, "directionality=3 must be a Directionality"),
    ],
)
def test_parts_have_their_types(tiling, directionality, message):
    with pytest.raises(ParameterError, match=message):
        Wavelets(tiling, directionality)


def test_wavelets_load_nothing_heavy():
    code = "import sys, spinsdw.wavelets; print(*{name.split('.')[0] for name in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
    heavy = {"numba", "healpy", "astropy", "matplotlib", "ducc0"}
    assert not heavy & set(loaded.decode().split())
