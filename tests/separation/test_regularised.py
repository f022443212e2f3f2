"""Projection and hybrid: exact without a mask, blind to E, scale-free, steered by variances."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import ParameterError
from spinsdw.harmonics import eb_to_spin, spin_to_eb
from spinsdw.masks import distance_to_edge, sky_fraction
from spinsdw.polarisation import EBSeparator
from spinsdw.sampling import MW
from spinsdw.separation import Hybrid, Projection
from spinsdw.separation.ensemble import ShareBins, draw_fields, draw_white, position_areas
from spinsdw.separation.hybrid import _bounded_fit
from spinsdw.separation.least_squares import EBPrior, LeastSquares, Observation
from spinsdw.separation.low_degrees import LowDegreeBlock
from spinsdw.separation.regularised import FitChoices, RegularisedFit, flat_spectrum
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.separation.survey import Survey
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import EPS, assert_close, needs_compiler, random_flm, random_real_flm

NSIDE, L = 16, 33
METHODS = [Projection(max_iterations=40), Hybrid(draws=2, max_iterations=40)]
each_method = pytest.mark.parametrize("method", METHODS, ids=["projection", "hybrid"])


def cap(sky, degrees=70.0):
    return (sky.points[0] < np.radians(degrees)).astype(float)


def survey_of(sky, mask=None, directions=1, **options):
    transform = SpinWaveletTransform(
        sky.bandlimit, 2, directions, lowest_scale=2, sampling=sky.sampling_name
    )
    options = {"inverse_noise": None, "beam": np.ones(sky.bandlimit)} | options
    return Survey(transform, sky, mask, **options)


def steep_eb(seed, size=L):
    """E and B with flat l (l + 1) C_l, of which maps are made that look like real ones."""
    el = np.arange(size)
    spectrum = np.where(el > 1, 2 * np.pi / np.maximum(el * (el + 1.0), 1), 0)
    prior = EBPrior(spectrum, spectrum)
    return draw_fields(prior, 1, seed)


# The full sky


@each_method
@pytest.mark.parametrize("shape", ["mw", "healpix"])
def test_full_sky_separation_is_exact(method, shape):
    """Without a mask nothing is assumed: no prior takes part"""
    e_lm, b_lm = random_real_flm(16, seed=1), random_real_flm(16, seed=2)
    e_lm[:4] = b_lm[:4] = 0
    sky = GridSky(MW(16)) if shape == "mw" else HealpixSky(NSIDE, 16)
    p = sky.polarisation_map(eb_to_spin(e_lm, b_lm))
    maps = EBSeparator(16, method=method).separate(p.real, p.imag)
    # On HEALPix coefficients are fitted, to ten times the tolerance of 1e-10.
    ulps = 1e-9 / EPS if shape == "healpix" else 64 * 16
    assert_close(maps.E, sky.scalar_map(e_lm).real, ulps)
    assert_close(maps.B, sky.scalar_map(b_lm).real, ulps)
    assert maps.info.kept_fraction[2] == 1


# The masked sky


@needs_compiler
@each_method
@pytest.mark.parametrize("grid", ["mw", "healpix"])
def test_e_leaks_far_less_than_in_the_pseudo_estimator(method, grid):
    """sum B^2 over the middle of a cap, of a sky of E alone"""
    # An MW grid of bandlimit L has no sample to spare behind a mask.
    sky = GridSky(MW(2 * L), limit=L) if grid == "mw" else HealpixSky(NSIDE, L)
    mask, (e_only, _) = cap(sky), steep_eb(3)
    p = sky.polarisation_map(e_only[0])
    middle = sky.points[0] < np.radians(55)
    leaked = [
        np.sum(EBSeparator(L, mask, method=one).separate(p.real, p.imag).B[middle] ** 2)
        for one in (method, "pseudo", "masked")
    ]
    assert leaked[0] < 1e-3 * min(leaked[1:])


@needs_compiler
@each_method
def test_b_is_found_where_the_sky_is_seen(method):
    """correlation with the true B farther than 15 degrees from the edge, of B alone"""
    sky = HealpixSky(NSIDE, L)
    mask, (_, b_only) = cap(sky), steep_eb(4)
    p = sky.polarisation_map(b_only[0])
    maps = EBSeparator(L, mask, method=method).separate(p.real, p.imag)
    middle = distance_to_edge(mask) > np.radians(15)
    truth = sky.scalar_map(spin_to_eb(b_only[0])[1]).real[middle]
    error = maps.B[middle] - truth
    assert np.corrcoef(maps.B[middle], truth)[0, 1] > 0.9
    assert np.std(error) < 0.45 * np.std(truth)


@each_method
def test_result_scales_with_the_map(method):
    """sep(c P) = c sep(P): nothing given sets a scale"""
    sky = HealpixSky(8, 17)
    p = sky.polarisation_map(random_flm(17, 2, seed=5))
    separator = EBSeparator(17, cap(sky), method=method)
    one, two = (separator.separate(c * p.real, c * p.imag) for c in (1.0, 1e-6))
    # Conjugate gradients blow rounding up by the condition of the fit, 1e6 or so.
    assert_close(1e6 * two.B, one.B, ulps=1e6)
    assert_close(1e6 * two.E, one.E, ulps=1e6)


@each_method
def test_what_is_masked_does_not_matter_and_stacks_are_separated_map_by_map(method):
    sky = HealpixSky(8, 17)
    mask, p = cap(sky), sky.polarisation_map(random_flm(17, 2, seed=6, batch=(2,)))
    separator = EBSeparator(17, mask, method=method)
    maps = separator.separate(p.real, p.imag)
    alone = separator.separate(p[1].real + 7 * (mask == 0), p[1].imag)
    assert_close(maps.B[1], alone.B, ulps=1e6)
    assert len(maps.info.convergence) == 2
    assert maps.info.convergence[1].iterations == alone.info.convergence[0].iterations


@each_method
def test_directions_and_grids_of_coefficients_are_the_transforms(method):
    sky = GridSky(MW(16))
    p = sky.polarisation_map(random_flm(16, 2, seed=7))
    separator = EBSeparator(16, cap(sky, 100.0), method=method, directions=3)
    maps = separator.separate(p.real, p.imag)
    assert maps.coefficients.shapes == SpinWaveletTransform(16, 2, 3, lowest_scale=2).shapes
    assert all(np.all((w >= 0) & (w <= 1)) for w in maps.weights.values())


@needs_compiler
def test_retained_sky_of_the_hybrid_falls_towards_the_hole():
    sky = HealpixSky(NSIDE, L)
    maps = EBSeparator(L, cap(sky), method=Hybrid(draws=3)).separate(*np.zeros((2, 12 * NSIDE**2)))
    middle, edge = sky.points[0] < np.radians(30), np.abs(sky.points[0] - np.radians(68)) < 0.02
    for j in (3, 4):
        assert maps.weights[j][middle].mean() > 0.8
        assert maps.weights[j][edge].mean() < maps.weights[j][middle].mean() - 0.2
    assert maps.info.kept_fraction[4] < sky_fraction(cap(sky))


def test_inverse_noise_is_relative():
    """c / sigma^2 for any c gives the same separation"""
    sky = HealpixSky(8, 17)
    p = sky.polarisation_map(random_flm(17, 2, seed=8))
    noise = np.random.default_rng(0).uniform(0.5, 2.0, p.size)
    found = [
        EBSeparator(17, cap(sky), method="projection", inverse_noise=c * noise).separate(
            p.real, p.imag
        )
        for c in (1.0, 2.0**27)  # rounding is the same for a power of two
    ]
    assert_close(found[1].B, found[0].B, ulps=1)


def test_noise_level_sets_the_scale_by_the_power_of_the_maps():
    """The flat prior has the variance of P, rounded to a tenth of a decade"""
    survey = survey_of(HealpixSky(8, 17))
    fit = RegularisedFit(survey, FitChoices(noise_level=1e-3))
    p = np.ones((1, 768)) * (3 + 4j)
    el = np.arange(17)
    one = np.sum((2 * el + 1) * flat_spectrum(survey)) / (4 * np.pi)
    ratio = fit.solver_for(p).prior.e_spectrum[2:] / flat_spectrum(survey)[2:]
    assert np.ptp(ratio) < 1e-12 * ratio[0]
    assert abs(np.log10(ratio[0] / (25 / one))) <= 0.05 + 1e-9


@needs_compiler
def test_noise_level_in_any_unit_gives_the_same_regimes():
    """A map in K with its noise in K is separated as the same map in uK"""
    sky = HealpixSky(NSIDE, L)
    mask, p = cap(sky), sky.polarisation_map(steep_eb(9)[0][0])
    found = []
    for unit in (1.0, 1e-6):
        method = Hybrid(noise_level=1e-3 * unit, draws=2, max_iterations=20)
        maps = EBSeparator(L, mask, method=method).separate(unit * p.real, unit * p.imag)
        found.append((maps.E / unit, maps.weights[3]))
    assert np.max(np.abs(found[1][0] - found[0][0])) < 1e-4 * np.max(np.abs(found[0][0]))
    assert_close(found[1][1], found[0][1], ulps=1e6)


def test_given_spectra_are_smoothed_by_the_beam():
    beam = np.exp(-0.01 * np.arange(17.0))
    survey = survey_of(HealpixSky(8, 17), beam=beam)
    spectra = np.arange(20.0) + 1
    prior = RegularisedFit(survey, FitChoices(spectra, 2 * spectra, 0.1)).prior()
    assert_close(prior.e_spectrum[2:], (spectra[:17] * beam**2)[2:], ulps=4)
    assert_close(prior.b_spectrum[2:], (2 * spectra[:17] * beam**2)[2:], ulps=4)


# The block of low degrees


def test_block_of_all_degrees_is_nearly_the_inverse():
    """With L0 = L few steps are enough: as many as sums over pixels differ from integrals"""
    sky = HealpixSky(16, 12)
    spectrum = 1.0 / np.arange(1.0, 13.0) ** 2
    observation = Observation(sky, np.ones(sky.map_shape), 0.05)
    prior = EBPrior(spectrum, 0.1 * spectrum)
    block = LowDegreeBlock(observation, prior, 12)
    p = sky.polarisation_map(random_flm(12, 2, seed=1, batch=(2,)))
    _, histories = LeastSquares(observation, prior, 40, 1e-8, block).solve(p)
    assert all(history.iterations <= 6 for history in histories)


def test_block_is_symmetric_and_positive():
    sky = HealpixSky(16, 20)
    spectrum = 1.0 / np.arange(1.0, 21.0) ** 2
    observation = Observation(sky, cap(sky, 100.0), 1e-3)
    block = LowDegreeBlock(observation, EBPrior(spectrum, 1e-3 * spectrum), 10)
    x, y = random_flm(20, 2, seed=1, batch=(1,)), random_flm(20, 2, seed=2, batch=(1,))
    left, right = np.vdot(block(x), y).real, np.vdot(x, block(y)).real
    assert abs(left - right) < 1e-9 * np.linalg.norm(block(x)) * np.linalg.norm(y)
    assert np.vdot(x, block(x)).real > 0


@needs_compiler
def test_block_speeds_up_the_largest_scales():
    """B of E alone at l <= 8 after ten steps, with and without"""
    sky = HealpixSky(NSIDE, L)
    mask, (e_only, _) = 1 - cap(sky, 40.0), steep_eb(5)
    observation = Observation(sky, mask, 2 * np.pi / 10800)
    flat = flat_spectrum(survey_of(sky))
    prior = EBPrior(flat, 1e-3 * flat)
    p = sky.polarisation_map(e_only) * mask
    leaked = []
    for block in (None, LowDegreeBlock(observation, prior)):
        plm, _ = LeastSquares(observation, prior, 10, 0.0, block).solve(p)
        leaked.append(np.sum(np.abs(spin_to_eb(plm[0])[1][:81]) ** 2))
    assert leaked[1] < 0.1 * leaked[0]


# The skies drawn and their bins


def test_skies_drawn_have_the_spectra_asked_for():
    """<|E_lm|^2> = C^E_l, no B; and the other way round; within five standard deviations"""
    el = np.arange(24)
    prior = EBPrior(1.0 / (el + 1.0), 3.0 / (el + 1.0))
    for kind, (fields, spectrum) in enumerate(
        zip(draw_fields(prior, 6, 1), (prior.e_spectrum, prior.b_spectrum), strict=True)
    ):
        eb = spin_to_eb(fields)
        assert not np.any(eb[1 - kind])
        ratio = np.sum(np.abs(eb[kind][:, 4:]) ** 2 / np.repeat(spectrum, 2 * el + 1)[4:])
        count = 6 * (24**2 - 4)
        assert abs(ratio / count - 1) < 5 * np.sqrt(2 / count)


def test_white_noise_drawn_is_white_and_another_sky():
    survey = survey_of(HealpixSky(8, 17))
    white = draw_white(survey, 3, 1)
    power = np.mean(np.abs(white[:, 4:]) ** 2)
    # E and B have unit variance each.
    assert abs(power / 2 - 1) < 5 * np.sqrt(1 / white[:, 4:].size)
    assert not np.array_equal(white[0], draw_white(survey, 3, 2)[0])


def test_bins_hold_every_coefficient_once():
    share = np.random.default_rng(1).uniform(size=(3, 16, 31)) ** 3
    for modes in (1e6, 300.0, 3.0):
        bins = ShareBins(share, position_areas(MW(16)), modes)
        total = np.sum([inside.astype(int) for inside in bins], axis=0)
        assert np.all(total == 1)
    assert len(list(bins)) == 1


@pytest.mark.parametrize("seed", range(6))
def test_bounded_fit_is_the_best_point_of_the_box(seed):
    """No point of a fine grid over [0, 1]^2 has a smaller x M x / 2 - v x"""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((2, 2))
    matrix, vector = root @ root.T, 2 * rng.standard_normal(2)
    found = _bounded_fit(matrix, vector)
    points = np.stack(np.meshgrid(*[np.linspace(0, 1, 101)] * 2), axis=-1).reshape(-1, 2)
    cost = lambda x: np.einsum("...i,ij,...j", x, matrix, x) / 2 - x @ vector  # noqa: E731
    assert np.all((found >= 0) & (found <= 1))
    assert cost(found) <= cost(points).min() + 1e-4


# What is refused


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Projection(max_iterations=0), "max_iterations=0 must be"),
        (lambda: Projection(tolerance=1.0), r"tolerance=1.0 must be in \[0, 1\); 1e-4 is usual"),
        (lambda: Projection(noise_level=0.0), "noise_level=0.0 must be positive and finite"),
        (lambda: Projection(np.ones(9)), "noise_level=None leaves spectra without a scale"),
        (lambda: Hybrid(np.ones(9), noise_level=1.0), "e_spectrum and b_spectrum must both be"),
        (lambda: Hybrid(b_share=-1.0), "b_share=-1.0 must be finite and at least 0"),
        (lambda: Hybrid(draws=1), "draws=1 must be"),
        (lambda: Hybrid(pure_width=-1.0), "pure_width=-1.0 must be finite and at least 0"),
        (lambda: Hybrid(seed=-1), "seed=-1 must be"),
    ],
)
def test_choices_are_checked(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


@each_method
def test_choices_are_told(method):
    text = repr(method)
    assert text.startswith(type(method).__name__)
    assert "flat" in text
    assert "max_iterations=40" in text
