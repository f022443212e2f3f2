"""Regularised least squares: against dense linear algebra, and the laws of conjugate gradients."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import eb_to_spin, spin_to_eb
from spinsdw.sampling import MW, MWSS
from spinsdw.separation.least_squares import EBPrior, LeastSquares, Observation
from spinsdw.separation.skies import GridSky, HealpixSky
from tests.helpers import EPS, assert_close, random_flm, random_like, random_real_flm

L = 8
SKIES = [GridSky(MW(L)), GridSky(MWSS(L)), HealpixSky(4, L)]
each_sky = pytest.mark.parametrize("sky", SKIES, ids=["mw", "mwss", "healpix"])
FALLING = 1.0 / np.arange(1.0, L + 1) ** 2
NOISE = 0.03


def cap(sky, degrees=60.0):
    """1 up to a distance from the north pole, 0 beyond."""
    return (sky.points[0] < np.radians(degrees)).astype(float)


def uneven(sky, seed=0):
    """An inverse-noise map: a cap with weights between 1/4 and 1."""
    return cap(sky, 100.0) * np.random.default_rng(seed).uniform(0.25, 1.0, sky.points[0].shape)


def random_p(sky, seed=1):
    """A stack of one map"""
    e_lm, b_lm = random_real_flm(L, seed=seed), random_real_flm(L, seed=seed + 100)
    return sky.polarisation_map(eb_to_spin(e_lm, b_lm))[None]


def as_real(values):
    return np.concatenate([values.real.ravel(), values.imag.ravel()])


def dense(operator, size):
    """The real matrix of a real-linear operator on ``size`` complex numbers."""
    units = np.concatenate([np.eye(size), 1j * np.eye(size)])
    return np.array([as_real(operator(unit)) for unit in units]).T


def dense_fit(observation, prior, p):
    """Solve (1 + S R^T R S) x = S R^T d, p_lm = S x, with R and S written out as matrices."""
    root, seen = dense(prior.root(), L * L), dense(observation.observe, L * L)
    matrix = np.eye(len(root)) + root.T @ seen.T @ seen @ root
    x = np.linalg.solve(matrix, root.T @ seen.T @ as_real(observation.whiten(p)))
    real, imag = np.split(root @ x, 2)
    return real + 1j * imag


@each_sky
def test_adjoints_of_the_sky(sky):
    """<Y f, g> = <f, Y^H g>"""
    g = random_like(np.zeros(sky.map_shape, complex))
    plm = random_flm(L, 2, seed=2)
    left = np.vdot(sky.polarisation_map(plm), g)
    assert_close(np.vdot(plm, sky.adjoint_polarisation_map(g)), left, ulps=64 * L)


@each_sky
def test_areas_add_up_to_the_sphere(sky):
    """sum of areas = 4 pi, all positive; their sums are near the integrals of smooth weights"""
    areas = np.broadcast_to(sky.areas, sky.map_shape)
    assert_close(areas.sum(), 4 * np.pi, ulps=256)
    assert np.all(areas > 0)
    sums = sky.area_sums(2 + np.cos(sky.points[0]), 3)
    expected = np.zeros(9)
    expected[[0, 2]] = 2 * np.sqrt(4 * np.pi), np.sqrt(4 * np.pi / 3)
    assert np.max(np.abs(sums - expected)) < 0.02 * expected[0]


@each_sky
@pytest.mark.parametrize("b_share", [0.0, 1e-2, 1.0], ids=["E only", "small B", "equal"])
@pytest.mark.parametrize("weights", [cap, uneven])
def test_fit_is_the_dense_solution(sky, b_share, weights):
    """p = S (1 + S R^T R S)^{-1} S R^T d as real matrices"""
    observation = Observation(sky, weights(sky), NOISE)
    prior = EBPrior(FALLING, b_share * FALLING)
    p = random_p(sky)
    (found,), (history,) = LeastSquares(observation, prior, 400, 1e-13).solve(p)
    expected = dense_fit(observation, prior, p)
    assert history.converged
    assert np.max(np.abs(found - expected)) < 1e-10 * np.max(np.abs(expected))


@each_sky
def test_operators_are_symmetric_in_the_real_inner_product(sky):
    """S^T = S, and the adjoint of an observation is its transpose, over the reals"""
    root = dense(EBPrior(FALLING, 0.1 * FALLING).root(), L * L)
    assert_close(root, root.T, ulps=1)
    observation = Observation(sky, uneven(sky), NOISE)
    seen = dense(observation.observe, L * L)
    shape = sky.map_shape
    back = dense(lambda v: observation.adjoint_observe(v.reshape(shape)), seen.shape[0] // 2)
    assert_close(back, seen.T, ulps=64 * L)


@each_sky
def test_root_multiplies_e_and_b_by_their_own_factors(sky):
    """E_lm -> sqrt(C^E_l) E_lm, B_lm -> sqrt(C^B_l) B_lm"""
    e_lm, b_lm = random_real_flm(L, seed=5), random_real_flm(L, seed=6)
    e_root, b_root = spin_to_eb(EBPrior(FALLING, 4 * FALLING).root()(eb_to_spin(e_lm, b_lm)))
    factors = np.repeat(np.where(np.arange(L) < 2, 0, np.sqrt(FALLING)), 2 * np.arange(L) + 1)
    assert_close(e_root, factors * e_lm, ulps=8)
    assert_close(b_root, 2 * factors * b_lm, ulps=8)
    assert sky.bandlimit == L


@each_sky
def test_objective_never_rises_and_residual_falls(sky):
    """Each step minimises the sum over one more direction; the gradient goes to zero with it"""
    observation = Observation(sky, cap(sky), NOISE)
    prior = EBPrior(FALLING, 1e-3 * FALLING)
    p = random_p(sky)
    _, (history,) = LeastSquares(observation, prior, 300, 1e-12).solve(p)
    drops = np.diff(history.objective)
    assert np.all(drops <= 64 * EPS * history.objective[0])
    assert history.objective[-1] < 0.9 * history.objective[0]
    assert history.residuals[0] == 1
    assert history.residual <= 1e-12
    assert len(history.residuals) == len(history.objective) == history.iterations + 1


@each_sky
def test_error_falls_in_the_norm_of_the_operator(sky):
    """|x_k - x|_A^2 falls with k, A = 1 + S R^T R S; it is the objective above its minimum"""
    observation = Observation(sky, cap(sky), NOISE)
    prior = EBPrior(FALLING, FALLING)
    p = random_p(sky)
    exact, (long,) = LeastSquares(observation, prior, 400, 1e-13).solve(p)
    inverse = np.repeat(np.where(np.arange(L) < 2, 0, 1 / FALLING), 2 * np.arange(L) + 1)
    norms = []
    for steps in (1, 2, 4, 8):
        found, (short,) = LeastSquares(observation, prior, steps, 0.0).solve(p)
        error = (found - exact)[0]
        seen = observation.observe(error)
        norms.append(np.sum(np.abs(seen) ** 2) + np.sum(inverse * np.abs(error) ** 2))
        above = short.objective[-1] - long.objective[-1]
        assert abs(norms[-1] - above) < 1e-9 * long.objective[0]
    assert np.all(np.diff(norms) < 0)


@each_sky
def test_full_sky_with_little_noise_returns_e_and_b(sky):
    """n -> 0, W = 1: the fit is the field"""
    e_lm, b_lm = random_real_flm(L, seed=7), random_real_flm(L, seed=8)
    e_lm[:4] = b_lm[:4] = 0
    observation = Observation(sky, np.ones(sky.points[0].shape), 1e-7)
    prior = EBPrior(np.ones(L), np.ones(L))
    p = sky.polarisation_map(eb_to_spin(e_lm, b_lm))[None]
    (plm,), (history,) = LeastSquares(observation, prior, 100, 1e-13).solve(p)
    assert history.converged
    for found, truth in zip(spin_to_eb(plm), (e_lm, b_lm), strict=True):
        assert np.max(np.abs(found - truth)) < 1e-11 * np.max(np.abs(truth))


@each_sky
def test_full_sky_fit_takes_few_steps(sky):
    """R^H R is nearly 1 / n^2 on the whole sky: the preconditioner is nearly the inverse"""
    observation = Observation(sky, np.ones(sky.map_shape), NOISE)
    solver = LeastSquares(observation, EBPrior(FALLING, 0.1 * FALLING), 40, 1e-9)
    _, (history,) = solver.solve(random_p(sky))
    assert history.converged
    assert history.iterations <= 20


@each_sky
def test_stack_is_fitted_map_by_map(sky):
    """A map's fit is its own, whatever the others are; one that needs no step waits for them"""
    solver = LeastSquares(Observation(sky, cap(sky), NOISE), EBPrior(FALLING, FALLING), 400, 1e-12)
    easy = sky.polarisation_map(eb_to_spin(random_real_flm(L), 0 * random_real_flm(L)))
    maps = np.array([random_p(sky, 1)[0], 0 * easy, easy, random_p(sky, 2)[0]])
    plm, histories = solver.solve(maps)
    assert plm.shape == (4, L * L)
    assert [history.iterations == 0 for history in histories] == [False, True, False, False]
    for p, row, history in zip(maps, plm, histories, strict=True):
        (alone,), (report,) = solver.solve(p[None])
        # Rounding differs between stacks: a fit may take a step more or less than alone.
        assert np.max(np.abs(row - alone)) <= 1e-9 * np.max(np.abs(alone))
        assert abs(history.iterations - report.iterations) <= 5


@each_sky
def test_map_of_zeros_needs_no_step(sky):
    solver = LeastSquares(Observation(sky, cap(sky), NOISE), EBPrior(FALLING, FALLING))
    plm, (history,) = solver.solve(np.zeros((1, *sky.points[0].shape), complex))
    assert not plm.any()
    assert history.converged
    assert history.iterations == 0


def test_precision_is_the_mean_inverse_noise():
    """<W> / n^2"""
    sky = SKIES[2]
    weights = uneven(sky)
    assert_close(Observation(sky, weights, 0.5).precision, 4 * weights.mean(), ulps=64)


@pytest.mark.parametrize("level", [0.0, -1.0, np.nan, np.inf])
def test_noise_level_must_be_positive(level):
    with pytest.raises(
        ParameterError, match=r"noise_level=.* must be positive and finite; a noise"
    ):
        Observation(SKIES[0], np.ones((8, 15)), level)


@pytest.mark.parametrize(
    ("weights", "found"),
    [(np.zeros((8, 15)), "only zeros"), (np.full((8, 15), -1.0), "120 values that are negative")],
)
def test_weights_must_observe_some_sky(weights, found):
    with pytest.raises(DataError, match=f"weights hold {found}.*; they must be at least 0"):
        Observation(SKIES[0], weights, 1.0)


def test_spectra_are_checked():
    with pytest.raises(DataError, match="b_spectrum holds 8 values that are negative or not"):
        EBPrior(FALLING, -FALLING)
    with pytest.raises(ShapeError, match=r"e_spectrum has shape \(2,\); it must hold C_l from"):
        EBPrior(np.ones(2), np.ones(2))
    with pytest.raises(ShapeError, match="e_spectrum has 8 degrees and b_spectrum 7, and they"):
        EBPrior(FALLING, FALLING[:7])


def test_solver_settings_are_checked():
    observation = Observation(SKIES[0], np.ones((8, 15)), 1.0)
    prior = EBPrior(FALLING, FALLING)
    with pytest.raises(ParameterError, match=r"tolerance=1.0 must be in \[0, 1\); 1e-6 is the"):
        LeastSquares(observation, prior, tolerance=1.0)
    with pytest.raises(ParameterError, match="max_iterations=0 must be"):
        LeastSquares(observation, prior, 0)
    with pytest.raises(ParameterError, match=r"prior has bandlimit=7 and the sky 8, and they must"):
        LeastSquares(observation, EBPrior(FALLING[:7], FALLING[:7]))
