"""The methods to compare with: the plain transform, recycling and spin needlets."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from spinsdw.errors import ParameterError
from spinsdw.harmonics import eb_to_spin, multiply_by_degree, resize, spin_to_eb
from spinsdw.polarisation import EBSeparator
from spinsdw.sampling import MW, MWSS
from spinsdw.separation import Masked, Recycling, SpinNeedlets
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.separation.survey import Survey
from spinsdw.simulation import simulate_eb
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.tiling import CustomTiling, ScaleDiscretisedTiling
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import EPS, assert_close

L = 16
SKIES = {"mw": GridSky(MW(L)), "mwss": GridSky(MWSS(L)), "healpix": HealpixSky(8, L)}
METHODS = (Masked(), Recycling(), Recycling(1), SpinNeedlets(), SpinNeedlets(0.05))
each_sky = pytest.mark.parametrize("kind", list(SKIES))
each_method = pytest.mark.parametrize("method", METHODS, ids=str)


def ulps(kind):
    """Rounding on grids; on HEALPix ten times the tolerance of the fit, 1e-10."""
    return 1e-9 / EPS if kind == "healpix" else 256 * L


def random_p(kind, seeds=(0,), powers=(1.0, 1.0)):
    """P of random E and B with the given powers, shape (seeds, *map), and their p_lm."""
    ee, bb = (power * np.ones(L) for power in powers)
    plm = np.array([eb_to_spin(*simulate_eb(ee, bb, L, seed=seed)) for seed in seeds])
    return SKIES[kind].polarisation_map(plm), plm


def cap(kind, colatitude=1.8):
    return (SKIES[kind].points[0] < colatitude).astype(float)


def survey_of(kind, mask=None, directions=1, tiling=None):
    """A survey with wavelets of the sky's kind of grid."""
    sky = SKIES[kind]
    tiling = tiling or ScaleDiscretisedTiling(L, lowest_scale=1)
    transform = SpinWaveletTransform(L, 2, directions, tiling=tiling, sampling=sky.sampling_name)
    return Survey(transform, sky, mask, None, np.ones(L))


def spin_coefficients(survey, method, p):
    """p_lm of what a method makes of maps."""
    found = method.prepare(survey).estimate(p)
    return survey.transform.synthesis_harmonic(found.coefficients)


@each_method
@each_sky
@pytest.mark.parametrize("ones", [False, True])
def test_full_sky_is_separated_exactly(method, kind, ones):
    """Without a hole the coefficients are those of the sky, whatever its E and B"""
    survey = survey_of(kind, cap(kind, 4.0) if ones else None, directions=2)
    for powers in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1e-8)):
        p, plm = random_p(kind, (1, 2), powers)
        assert_close(spin_coefficients(survey, method, p), plm, ulps(kind))


@each_method
@pytest.mark.parametrize("bandlimit", [3, 4, 5])
def test_smallest_bandlimits_are_separated_exactly(method, bandlimit):
    e_lm, b_lm = simulate_eb(np.ones(bandlimit), np.ones(bandlimit), bandlimit, seed=1)
    p = SpinHarmonicTransform(bandlimit, 2).synthesis(eb_to_spin(e_lm, b_lm))
    maps = EBSeparator(bandlimit, method=method).separate(p.real, p.imag)
    assert_close(maps.B, SpinHarmonicTransform(bandlimit, real=True).synthesis(b_lm), 64 * L)


@each_method
@each_sky
def test_stack_is_separated_map_by_map(method, kind):
    survey = survey_of(kind, cap(kind))
    p, _ = random_p(kind, (1, 2, 3))
    together = spin_coefficients(survey, method, p)
    alone = [spin_coefficients(survey, method, one[None])[0] for one in p]
    assert_close(together, np.array(alone), ulps(kind))


@each_method
@each_sky
def test_weights_have_the_shapes_of_the_coefficients(method, kind):
    survey = survey_of(kind, cap(kind), directions=3)
    weights = method.prepare(survey).weights
    assert {key: values.shape for key, values in weights.items()} == survey.transform.shapes
    for values in weights.values():
        assert set(np.unique(values)) <= {0.0, 1.0}


@pytest.mark.parametrize("method", [Masked(), SpinNeedlets()], ids=str)
@each_sky
def test_masked_and_needlets_are_linear_and_blind_to_the_frame(method, kind):
    """sep(a P + P') = a sep(P) + sep(P'), and U, -Q for Q, U turns (E, B) into (B, -E)"""
    survey = survey_of(kind, cap(kind))
    one, other = random_p(kind, (1, 2))[0][:, None]
    parts = [spin_coefficients(survey, method, p) for p in (one, other, 3 * one + other)]
    assert_close(parts[2], 3 * parts[0] + parts[1], ulps(kind))
    assert_close(spin_coefficients(survey, method, -1j * one), -1j * parts[0], ulps(kind))


@each_sky
def test_masked_is_the_transform_of_the_masked_map(kind):
    survey, (p, _) = survey_of(kind, cap(kind)), random_p(kind)
    expected, _ = SKIES[kind].polarisation_coefficients(cap(kind) * p)
    # Degrees 0 and 1 hold no spin-2 field.
    assert_close(spin_coefficients(survey, Masked(), p), expected, ulps(kind))


def observed_b(survey, plm):
    """The B map where the sky is observed, each pixel with the root of its area."""
    sky = survey.sky
    areas = 1.0 if isinstance(sky, HealpixSky) else np.sin(sky.points[0])
    values = sky.scalar_map(spin_to_eb(plm)[1]).real
    return (np.sqrt(areas * survey.footprint) * values).ravel()


@each_sky
def test_one_recycling_leaves_b_orthogonal_to_its_template(kind):
    """B(M P - a M Y e) with <B, T> = 0, T = B(M Y e), e the E of M P; E keeps what was removed"""
    survey, (p, _) = survey_of(kind, cap(kind)), random_p(kind, powers=(1.0, 0.01))
    sky, mask = survey.sky, survey.footprint
    masked = sky.polarisation_coefficients(mask * p)[0]
    e_only = eb_to_spin(spin_to_eb(masked)[0], np.zeros((1, L * L)))
    template = sky.polarisation_coefficients(mask * sky.polarisation_map(e_only))[0]
    before, shape = observed_b(survey, masked), observed_b(survey, template)
    share = before @ shape / (shape @ shape)
    assert 0.5 < share < 2
    found = spin_coefficients(survey, Recycling(1), p)
    assert_close(found, masked - share * template + share * e_only, ulps(kind))
    after = observed_b(survey, found)
    assert abs(after @ shape) < ulps(kind) * EPS * np.linalg.norm(shape) * np.linalg.norm(before)


@each_sky
def test_recycling_again_leaves_less_b_where_the_sky_is_observed(kind):
    """A fit never raises the sum of squares; of E alone, whose B is all leakage, most goes."""
    survey, (p, _) = survey_of(kind, cap(kind)), random_p(kind, powers=(1.0, 0.0))
    left = [
        np.linalg.norm(observed_b(survey, spin_coefficients(survey, method, p)))
        for method in (Masked(), Recycling(1), Recycling(2), Recycling(5))
    ]
    assert left[0] > left[1] > left[2] > left[3]
    assert left[3] < 0.3 * left[0]


@pytest.mark.parametrize("scale", [1, 2, 3])
def test_share_of_a_needlet_is_that_of_its_square(scale):
    """f(x) = int (1 - M) |psi|^2 / int |psi|^2, psi = sum_lm kappa(l) conj(2Ylm(x)) 2Ylm"""
    shares = np.linspace(0.02, 0.98, 9)
    kept = [SpinNeedlets(share).prepare(survey_of("mw", cap("mw"))).kept[scale] for share in shares]
    estimator = SpinNeedlets().prepare(survey_of("mw", cap("mw")))
    kernel = estimator.tiling.kernel(scale)
    size = estimator.tiling.scale_bandlimit(scale)
    fine = SpinHarmonicTransform(4 * L, 2)
    squares = SpinHarmonicTransform(4 * L, real=True)
    hole_lm = SpinHarmonicTransform(L, real=True).analysis(1 - cap("mw"))
    for ring in range(0, size, 3):
        # conj(2Ylm(x)) is the adjoint synthesis of a unit at x.
        at = SpinHarmonicTransform(size, 2).adjoint_synthesis(_unit(MW(size).shape, ring))
        flm = resize(multiply_by_degree(at, kernel[:size]), 4 * L)
        energy = squares.analysis(np.abs(fine.synthesis(flm)) ** 2)
        share = np.vdot(hole_lm, energy[: L * L]).real / (energy[0].real * np.sqrt(4 * np.pi))
        for limit, mask in zip(shares, kept, strict=True):
            if abs(share - limit) > 1e-10:
                assert mask[ring, 0] == (share <= limit)


def _unit(shape, ring):
    values = np.zeros(shape, complex)
    values[ring, 0] = 1
    return values


def test_needlets_far_from_the_hole_are_those_of_the_whole_sky():
    """The needlet coefficients kept are those of M P; those dropped are 0: P_lm by direct sums."""
    survey, (p, _) = survey_of("mw", cap("mw")), random_p("mw")
    estimator = SpinNeedlets().prepare(survey)
    masked = SKIES["mw"].polarisation_coefficients(survey.footprint * p)[0]
    expected, tiling = np.zeros_like(masked), estimator.tiling
    parts = {"scaling": (tiling.scaling_kernel, tiling.scaling_bandlimit)}
    parts |= {j: (tiling.kernel(j), tiling.scale_bandlimit(j)) for j in tiling.scales}
    for key, (kernel, size) in parts.items():
        if size <= 2:
            continue
        field = SpinHarmonicTransform(size, 2)
        part = field.synthesis(multiply_by_degree(masked, kernel)[..., : size**2])
        part = field.analysis(estimator.kept[key] * part)
        expected[..., : size**2] += multiply_by_degree(part, kernel[:size])
    assert_close(spin_coefficients(survey, SpinNeedlets(), p), expected, 64 * L)
    assert 0 < np.mean(estimator.kept[2]) < 1


def test_larger_share_keeps_more_needlets():
    survey = survey_of("healpix", cap("healpix"))
    kept = [SpinNeedlets(share).prepare(survey).kept for share in (0.01, 0.2, 1.0)]
    for key in (2, 3):
        means = [one[key].mean() for one in kept]
        assert means == sorted(means)
        assert means[0] < means[2] == 1


def test_needlets_need_one_dilation():
    tiling = CustomTiling(np.eye(L)[0], np.ones((1, L)) - np.eye(L)[:1])
    method = SpinNeedlets().prepare(survey_of("mw", cap("mw"), tiling=tiling))
    with pytest.raises(ParameterError, match="dilation"):
        method.estimate(random_p("mw")[0])


@pytest.mark.parametrize("share", [0, -0.1, 1.1, np.nan, "a"])
def test_largest_share_must_be_a_share(share):
    with pytest.raises(ParameterError, match="largest_share"):
        SpinNeedlets(share)


@pytest.mark.parametrize("iterations", [0, -1, 1.5, "a"])
def test_iterations_are_counted(iterations):
    with pytest.raises(ParameterError, match="iterations"):
        Recycling(iterations)


def test_methods_are_known_by_name():
    for method in METHODS:
        separator = EBSeparator(L, method=method.name)
        assert separator.method == type(method)()
        assert dataclasses.is_dataclass(separator.method)
