"""The benchmark of separation measures what it says: laws of its sums, bands and masks."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from benchmarks.purity import DISTANCES, SETTINGS, SURVEYS, Result, SeparatorBands, Skies, judge
from benchmarks.purity.bands import evaluated_bands, synthesised_bands
from benchmarks.purity.measures import Regions
from benchmarks.purity.ratio import Powers, RatioTest, estimate_ratio, measure_ratio
from benchmarks.purity.skies import KINDS
from benchmarks.purity.surveys import survey_mask
from spinsdw.masks import distance_to_edge, fill_holes
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, random_real_flm

TINY = SETTINGS["tiny"]


@pytest.fixture(scope="module")
def skies(tmp_path_factory):
    return Skies("cmb", TINY, tmp_path_factory.mktemp("skies"))


@pytest.fixture(autouse=True)
def _skies_in_a_folder_of_the_tests(monkeypatch, skies):
    monkeypatch.setattr("tempfile.tempdir", str(skies.folder))


def fold(scale):
    """A method that sees the true sky, for it is given none of the mask; times ``scale``."""
    whole = SeparatorBands.of_method("pseudo", np.ones(12 * TINY.nside**2), TINY)
    return lambda q, u: scale * whole(q, u)


@pytest.mark.parametrize("directions", [1, 2, 3])
def test_full_sky_bands_are_the_true_ones(skies, directions):
    """sqrt(2 pi) (-Im W^j) of one direction, and the synthesis without kappa_j, are kappa_j B."""
    method = SeparatorBands.of_method(
        "pseudo", np.ones(12 * TINY.nside**2), TINY, directions=directions
    )
    found = method(*skies.stack("full", [200]))[0]
    truth = skies.truth("full", 200)
    # The fit of a HEALPix map stops at 1e-10, the truth is kept in singles.
    assert np.abs(found - truth).max() < 1e-6 * np.abs(truth).max()


def test_both_ways_to_a_band_agree():
    """Evaluated and synthesised bands of the same coefficients, to rounding over the floor 1e-6."""
    transform = SpinWaveletTransform(TINY.bandlimit, 2, lowest_scale=2)
    e_lm, b_lm = random_real_flm(TINY.bandlimit, seed=1), random_real_flm(TINY.bandlimit, seed=2)
    plm = -(e_lm + 1j * b_lm)[None]
    plm[:, :4] = 0
    coefficients = transform.analysis_harmonic(plm)
    one = evaluated_bands(coefficients, TINY)
    other = synthesised_bands(coefficients, transform, TINY)
    assert np.abs(one - other).max() < 1e-6 * np.abs(one).max()


def test_a_perfect_method_is_perfect():
    """No mask in sight: no leakage beyond the fit's, correlation 1, error 0, noise as it is."""
    found = judge(fold(1.0), "B", TINY, batch=1, label="perfect")
    kept = found.shares > 0
    assert np.all(found.r_leak[:, kept] < 1e-12)
    assert np.all(np.abs(found.rho_b[:, kept] - 1) < 1e-9)
    assert np.all(found.eps[:, kept] < 1e-6)
    assert np.all(np.abs(found.nz[:, kept] - 1) < 1e-6)
    np.testing.assert_allclose(found.f_ret(1e-4), found.shares[0], rtol=0, atol=1e-9)
    assert found.separations == len(KINDS) * len(TINY.test_seeds)


def test_rescaling_a_method_changes_its_error_only():
    """r_leak, f_eff and nz are blind to a factor; eps of a method that gives B/2 is 1/2."""
    one, half = (judge(fold(scale), "A", TINY, (200,)) for scale in (1.0, 0.5))
    for measure in ("r_leak", "f_eff", "nz", "rho"):
        assert_close(getattr(half, measure), getattr(one, measure), ulps=2**10)
    kept = half.shares > 0
    np.testing.assert_allclose(half.eps[:, kept], 0.5, rtol=0, atol=1e-6)


def test_leakage_from_the_difference_is_that_of_e_alone_for_a_linear_method():
    """sep(E + X) - sep(X) = sep(E)."""
    found = judge("pseudo", "A", TINY, (200,), linearity=True)
    kept = np.isfinite(found.r_leak)
    assert kept.any()
    np.testing.assert_allclose(found.r_leak_linear[kept], found.r_leak[kept], rtol=1e-6, atol=0)


def test_runs_on_different_seeds_add_up():
    """The sums of two runs are those of one run on all the seeds, to rounding."""
    both = judge("pseudo", "C", TINY, (200, 201))
    one, other = (judge("pseudo", "C", TINY, (seed,)) for seed in (200, 201))
    total = one + other
    assert total.seeds == both.seeds
    for name, values in both.sums.items():
        assert_close(total.sums[name], values, ulps=2**12)
    with pytest.raises(ValueError, match="seeds"):
        one + one
    with pytest.raises(ValueError, match="survey"):
        one + dataclasses.replace(other, survey="A")


def test_results_survive_json():
    found = judge("pseudo", "B", TINY, (200,))
    again = Result.from_json(json.loads(json.dumps(found.to_json())))
    assert (again.method, again.seeds, again.scales) == ("pseudo", (200,), TINY.scales)
    for name, values in found.sums.items():
        np.testing.assert_allclose(again.sums[name], values, rtol=1e-6, atol=0)
    np.testing.assert_allclose(again.f_ret(1e-2), found.f_ret(1e-2), rtol=0, atol=1e-5)


def test_a_method_that_keeps_nothing_retains_nothing():
    empty = judge(lambda q, _: np.zeros((len(q), len(TINY.scales), q.shape[1])), "A", TINY, (200,))
    assert np.all(np.isnan(empty.r_leak))
    assert np.all(empty.f_ret(1.0) == 0)


def test_regions_are_nested_sums():
    """The sum over R(d) is that over depth > d, for every d."""
    depth = np.radians([0.0, 0.2, 0.5, 0.7, 3.0, 30.0])
    values = np.array([[1.0, 2, 4, 8, 16, 32]])
    found = Regions(depth).sums(values)[0]
    np.testing.assert_array_equal(
        found, [values[0][depth > np.radians(d)].sum() for d in DISTANCES]
    )
    assert Regions(depth).shares[0] == 1


@pytest.mark.parametrize(
    ("survey", "fraction"), [("A", 0.65), ("B", 0.10), ("C", 0.02), ("D", 0.138)]
)
def test_masks_have_their_sky_fraction_at_every_resolution(survey, fraction):
    for nside in (64, 128):
        mask = survey_mask(survey, nside)
        assert abs(mask.mean() - fraction) < 0.05 * fraction
        assert set(np.unique(mask)) == {0.0, 1.0}
    assert survey in SURVEYS


@pytest.mark.parametrize(("survey", "least"), [("A", 90), ("D", 100)])
def test_masks_have_their_holes(survey, least):
    """The holes hide the area of so many discs of half the largest radius."""
    mask = survey_mask(survey, 128)
    filled = fill_holes(mask, np.pi * np.radians(2) ** 2)
    area = np.count_nonzero(filled != mask) * 4 * np.pi / mask.size
    largest = np.pi * np.radians({"A": 1.0, "D": 0.8}[survey]) ** 2
    assert area > least * largest / 4


def test_a_square_degree_of_a_shear_survey_is_near_a_hole():
    depth = np.degrees(distance_to_edge(survey_mask("D", 128)))
    assert 1 < np.median(depth[depth > 0]) < 3


def test_skies_of_one_kind_hold_what_they_say(skies):
    """E alone has no B; B alone is all B; noise has the deviation of its level."""
    whole = fold(1.0)
    bands = {kind: whole(*skies.stack(kind, [200])) for kind in ("E", "B")}
    assert np.abs(bands["E"]).max() < 1e-6 * np.abs(bands["B"]).max()
    assert np.abs(bands["B"] - skies.truth("B", 200)).max() < 1e-6 * np.abs(bands["B"]).max()
    q, _ = skies.qu("noise", 200)
    pixel = np.degrees(np.sqrt(4 * np.pi / q.size)) * 60
    assert abs(q.std() * pixel / 2.0 - 1) < 5 / np.sqrt(2 * q.size)


def test_seeds_of_tuning_and_test_are_disjoint():
    for setting in SETTINGS.values():
        assert not set(setting.tuning_seeds) & set(setting.test_seeds)


def test_skies_are_kept_and_the_same(skies):
    q, u = skies.qu("E", 200)
    again = Skies("cmb", TINY, skies.folder / "other")
    np.testing.assert_array_equal(again.qu("E", 200), (q, u))
    assert len(list((skies.folder / "other").iterdir())) == 1


def random_powers(scales=3):
    """Band powers of skies whose mean, response and scatter differ from band to band."""
    rng = np.random.default_rng(0)
    sizes = np.geomspace(1, 100, scales)
    rest, tensors = (sizes * (3 + rng.standard_normal((n, scales))) for n in (40, 20))
    return rest, tensors


@pytest.mark.parametrize("truth", [0.0, 0.01, 0.3])
def test_ratio_is_exact_where_powers_follow_the_model(truth):
    """p = m + (r - 0.01) D gives r, whatever the covariance"""
    rest, tensors = random_powers()
    data = rest.mean(axis=0) + (truth - 0.01) * tensors.mean(axis=0)
    found = estimate_ratio(Powers(data[None], rest, tensors))
    assert abs(found[0] - truth) < 1e-12


def test_ratio_is_blind_to_the_scale_of_a_band_and_to_bands_without_power():
    rest, tensors = random_powers()
    data = rest[:5]
    scales = np.array([0.1, 7.0, 3.0])
    one = estimate_ratio(Powers(data, rest, tensors))
    other = estimate_ratio(Powers(data * scales, rest * scales, tensors * scales))
    assert_close(other, one, ulps=2**14)
    padded = (np.pad(values, [(0, 0), (0, 1)]) for values in (data, rest, tensors))
    assert_close(estimate_ratio(Powers(*padded)), one, ulps=2**14)


def test_shift_of_the_true_b_is_zero():
    """A method that sees the whole sky finds the r of the true B, sky by sky."""
    found = measure_ratio(fold(1.0), "A", TINY, label="perfect", share=0.1)
    np.testing.assert_allclose(found.found, found.true, rtol=0, atol=1e-4 * found.true_sigma)
    assert found.found.size == 10
    again = RatioTest.from_json(json.loads(json.dumps(found.to_json())))
    assert abs(again.sigma - found.sigma) < 1e-5
