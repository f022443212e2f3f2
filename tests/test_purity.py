"""The benchmark of separation measures what it says: laws of its sums, bands and masks."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from benchmarks.purity import DISTANCES, SETTINGS, SURVEYS, Result, SeparatorBands, Skies, judge
from benchmarks.purity.__main__ import main as purity_main
from benchmarks.purity.bands import evaluated_bands, synthesised_bands
from benchmarks.purity.catalogue import catalogue
from benchmarks.purity.families import families
from benchmarks.purity.figures import save_figures
from benchmarks.purity.measures import Regions
from benchmarks.purity.pictures import PIXELS, disc_of_sky, maps_figure
from benchmarks.purity.ratio import Powers, RatioTest, estimate_ratio, measure_ratio
from benchmarks.purity.report import all_tables, tables
from benchmarks.purity.results import add_result, read_results
from benchmarks.purity.skies import KINDS
from benchmarks.purity.surveys import survey_mask
from spinsdw.masks import distance_to_edge, fill_holes
from spinsdw.separation import Pseudo
from spinsdw.separation.registry import METHODS
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, random_real_flm

TINY = SETTINGS["tiny"]
ROOT = Path(__file__).parents[1]


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
        np.testing.assert_allclose(again.sums[name], values, rtol=1e-4, atol=0)
    np.testing.assert_allclose(again.f_ret(1e-2), found.f_ret(1e-2), rtol=0, atol=1e-4)


@pytest.mark.parametrize("name", METHODS)
def test_every_method_of_the_package_can_be_judged(name):
    """By its name, in the widest of its variants: B is found somewhere, and E is mostly not."""
    label, make = catalogue(name)[-1]
    found = judge(make(survey_mask("B", TINY.nside), TINY), "B", TINY, (200,), label=label)
    assert found.method == name
    assert np.nanmax(found.f_eff) > 0
    assert np.nanmin(found.r_leak) < 1


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


def test_skies_of_another_beam_are_not_mistaken_for_these(skies):
    narrower = dataclasses.replace(TINY, beam=TINY.beam / 2)
    q, _ = Skies("cmb", narrower, skies.folder).qu("E", 200)
    assert np.any(q != skies.qu("E", 200)[0])


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


# The report


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Results of two methods behind every mask, with a second choice of one of them."""
    folder = tmp_path_factory.mktemp("results")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tempfile.tempdir", str(folder))
        for survey in SURVEYS:
            for method in ("masked", Pseudo(), Pseudo(0.5)):
                add_result(judge(method, survey, TINY, (200,)), folder)
        add_result(judge("masked", "D", TINY, (200,), model="shear"), folder)
    return folder


def test_results_of_other_seeds_join_and_of_the_same_seeds_replace(tmp_path):
    one, other = (judge("masked", "B", TINY, (seed,)) for seed in (200, 201))
    for result in (one, other, one):
        add_result(result, tmp_path)
    (found,) = read_results("tiny", tmp_path)
    assert found.seeds == (200,)
    add_result(other, tmp_path)
    (found,) = read_results("tiny", tmp_path)
    assert found.seeds == (200, 201)


def test_family_takes_the_best_choice_of_each_band(kept):
    family = next(
        family for family in families(read_results("tiny", kept), "A") if family.label == "pseudo"
    )
    one, other = family.results
    np.testing.assert_array_equal(
        family.f_ret(1e-1), np.maximum(one.f_ret(1e-1), other.f_ret(1e-1))
    )
    for row in range(len(family.scales)):
        found = family.at("r_leak", 1)[row]
        assert found in {one.at("r_leak", 1)[row], other.at("r_leak", 1)[row]}


def test_frontier_falls_with_the_sky(kept):
    """No point of a curve is beaten in both: less sky, less leakage."""
    for family in families(read_results("tiny", kept), "A"):
        for scale in family.scales:
            sky, leak = family.frontier(scale)
            assert np.all(np.diff(sky) <= 0)
            assert np.all(np.diff(leak) <= 0)


def test_report_has_every_method_mask_and_quoted_row(kept):
    text = tables(TINY, kept)
    for survey, (description, _) in SURVEYS.items():
        assert f"Mask {survey}, {description}" in text
    assert text.count("NaMaster, quoted") == 6
    assert "Cosmic shear behind mask D" in text
    leak = next(r for r in read_results("tiny", kept) if (r.method, r.survey) == ("masked", "A"))
    row = next(line for line in text.split("Leakage r_leak")[1].splitlines() if "masked" in line)
    assert f"{leak.at('r_leak', 1)[0]:.0e}".replace("e-0", "e-") in row


def test_pictures_are_drawn(kept, tmp_path, skies):
    names = save_figures(read_results("tiny", kept), tmp_path)
    assert {f"purity_leakage_{survey}" for survey in SURVEYS} < set(names)
    assert all((tmp_path / f"{name}.png").stat().st_size > 5000 for name in names)
    figure = maps_figure({"perfect": fold(1.0)}, "A", TINY, 200)
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert titles == ["true B", "perfect: B", "perfect: B - true B"]
    shown = [axes.images[0].get_array() for axes in figure.axes]
    assert np.nanmax(np.abs(shown[2])) < 1e-5 * np.nanmax(np.abs(shown[0]))
    assert skies.folder.is_dir()


def test_survey_lies_within_its_picture():
    """The larger part of every mask is inside, and what is not observed around it."""
    for survey in SURVEYS:
        shown = disc_of_sky(np.asarray(survey_mask(survey, 64)), survey)
        assert shown.shape == (PIXELS, PIXELS)
        assert 0.3 < np.nanmean(shown) < 0.9
        edge = shown[np.isfinite(shown)][[0, -1]]
        assert np.all(edge == 0)


def test_command_judges_and_keeps(monkeypatch, tmp_path, capsys):
    names = ["--setting", "tiny", "--surveys", "B", "--methods", "masked", "pseudo:3"]
    monkeypatch.setattr("sys.argv", ["purity", *names, "--folder", str(tmp_path), "--linearity"])
    purity_main()
    found = read_results("tiny", tmp_path)
    assert [result.method for result in found] == ["masked", "pseudo, N = 3"]
    assert "s per map, 2 seeds" in capsys.readouterr().out
    monkeypatch.setattr("sys.argv", ["purity", "--methods", "magic"])
    with pytest.raises(SystemExit, match="magic"):
        purity_main()


def test_the_page_shows_the_results_that_are_kept():
    """docs/purity_tables.inc is what `report` makes of the results in the repository."""
    page = (ROOT / "docs" / "purity_tables.inc").read_text(encoding="utf-8")
    assert page == all_tables()
