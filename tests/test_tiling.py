"""The laws of every tiling, and what is special to each."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError
from fractions import Fraction
from math import ceil, floor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.tiling import (
    CustomTiling,
    HybridTiling,
    NeedletTiling,
    ScaleDiscretisedTiling,
    SplineTiling,
    Tiling,
)
from tests.helpers import EPS, assert_close

DILATED = [ScaleDiscretisedTiling, NeedletTiling, SplineTiling]


def custom(bandlimit, lowest_scale=0):
    """Make a tiling by hand of the values of another."""
    needlets = NeedletTiling(bandlimit, lowest_scale=lowest_scale)
    rows = [needlets.kernel(scale) for scale in needlets.scales]
    return CustomTiling(needlets.scaling_kernel, rows, lowest_scale=lowest_scale)


def every_tiling():
    """One list: a new tiling is tested by all the shared laws when it is added here."""
    for kind in DILATED:
        for bandlimit in (1, 2, 3, 5, 64, 513):
            yield kind(bandlimit)
        for dilation in (1.1, 1.5, 3, 5.0, 1e9):
            yield kind(125, dilation=dilation)
        yield kind(100, dilation=1.5, lowest_scale=3)
        yield kind(64, lowest_scale=2)
        yield kind(64, lowest_scale=6)
    for bandlimit in (2, 5, 125, 513):
        yield ScaleDiscretisedTiling(bandlimit, quadrature="s2let")
    yield HybridTiling(5, dilations=(2.0,))
    yield HybridTiling(200, dilations=(60, 2, 1.3), transitions=(70, 150.5))
    yield HybridTiling(100, dilations=(2, 1.5), transitions=(16,), lowest_scale=2)
    yield custom(1)
    yield custom(40)
    yield custom(40, lowest_scale=2)


TILINGS = list(every_tiling())
each_tiling = pytest.mark.parametrize("tiling", TILINGS, ids=lambda tiling: repr(tiling)[:90])


@each_tiling
def test_squares_add_up_to_one(tiling):
    """eta**2 + sum_j kappa_j**2 = 1; the trapezia of S2LET leave rounding of 300 terms."""
    ulps = 300 if getattr(tiling, "quadrature", "") == "s2let" else 4
    total = tiling.scaling_kernel**2 + sum(tiling.kernel(scale) ** 2 for scale in tiling.scales)
    assert_close(total, np.ones(tiling.bandlimit), ulps=ulps)
    assert tiling.partition_error == np.max(np.abs(total - 1))


@each_tiling
def test_profiles_live_between_their_stated_degrees(tiling):
    assert not np.any(tiling.scaling_kernel[tiling.scaling_bandlimit :])
    for scale in tiling.scales:
        kernel = tiling.kernel(scale)
        assert not np.any(kernel[: tiling.scale_lowest_degree(scale)])
        assert not np.any(kernel[tiling.scale_bandlimit(scale) :])


@each_tiling
def test_degree_zero_belongs_to_the_scaling_function(tiling):
    assert tiling.scaling_kernel[0] == 1
    assert all(tiling.scale_lowest_degree(scale) >= 1 for scale in tiling.scales)


@each_tiling
def test_bandlimits_rise_to_that_of_the_tiling(tiling):
    bandlimits = [tiling.scale_bandlimit(scale) for scale in tiling.scales]
    assert 1 <= tiling.scaling_bandlimit <= tiling.bandlimit
    assert all(1 <= limit <= tiling.bandlimit for limit in bandlimits)
    assert bandlimits == sorted(bandlimits)
    assert bandlimits[-1] == tiling.bandlimit


@each_tiling
def test_profiles_are_read_only_and_never_negative(tiling):
    profiles = [tiling.scaling_kernel, *(tiling.kernel(scale) for scale in tiling.scales)]
    for profile in profiles:
        assert profile.shape == (tiling.bandlimit,)
        assert profile.dtype == np.float64
        assert not profile.flags.writeable
        assert np.all(profile >= 0)


@each_tiling
def test_tiling_is_a_value(tiling):
    """It is frozen, and a pickle is equal, hashes alike and holds read-only arrays."""
    with pytest.raises(FrozenInstanceError):
        tiling.lowest_scale = 1
    copy = pickle.loads(pickle.dumps(tiling))
    assert copy == tiling
    assert hash(copy) == hash(tiling)
    assert np.array_equal(copy.kernel(copy.highest_scale), tiling.kernel(tiling.highest_scale))
    assert not copy.kernel(copy.highest_scale).flags.writeable


@each_tiling
@pytest.mark.parametrize("method", ["kernel", "scale_bandlimit", "scale_lowest_degree"])
def test_scale_outside_is_refused(tiling, method):
    for scale in (tiling.lowest_scale - 1, tiling.highest_scale + 1):
        with pytest.raises(ParameterError, match=rf"scale={scale} must be from"):
            getattr(tiling, method)(scale)
    with pytest.raises(ParameterError, match="must be an integer"):
        getattr(tiling, method)(0.0)


@pytest.mark.parametrize("kind", DILATED)
def test_lowest_scale_hands_the_scales_below_to_the_scaling_function(kind):
    """eta_J0**2 = eta_0**2 + sum_{j < J0} kappa_j**2."""
    whole, upper = kind(100, dilation=1.7), kind(100, dilation=1.7, lowest_scale=4)
    below = sum(whole.kernel(scale) ** 2 for scale in range(4))
    assert_close(upper.scaling_kernel**2, whole.scaling_kernel**2 + below, ulps=8)
    for scale in upper.scales:
        assert np.array_equal(upper.kernel(scale), whole.kernel(scale))


@pytest.mark.parametrize("kind", DILATED)
@pytest.mark.parametrize(
    ("bandlimit", "dilation", "highest"),
    [
        (1, 2, 0),
        (2, 2, 0),
        (3, 2, 1),
        (5, 2, 2),
        (512, 2, 9),
        (513, 2, 9),
        (514, 2, 10),
        (125, 5, 3),
        (126, 5, 3),
        (127, 5, 4),
        (2**29 + 1, 2, 29),
        (244, 3, 5),
        (1001, 10, 3),
        (4, 1e300, 1),
    ],
)
def test_highest_scale_is_exact(kind, bandlimit, dilation, highest):
    """J is the smallest integer with dilation**J >= L - 1."""
    assert kind(bandlimit, dilation=dilation).highest_scale == highest


@given(
    bandlimit=st.integers(1, 10**6),
    dilation=st.floats(1.1, 20, allow_nan=False) | st.integers(2, 20).map(float),
)
def test_edges_are_exact_powers(bandlimit, dilation):
    """L_j = min(L, ceil(lam**(j+1))), lowest degree floor(lam**(j-1)) + 1, in fractions."""
    tiling, exact = ScaleDiscretisedTiling(bandlimit, dilation=dilation), Fraction(dilation)
    highest = tiling.highest_scale
    assert exact**highest >= bandlimit - 1
    assert highest == 0 or exact ** (highest - 1) < bandlimit - 1
    for scale in tiling.scales:
        assert tiling.scale_bandlimit(scale) == min(bandlimit, ceil(exact ** (scale + 1)))
        assert tiling.scale_lowest_degree(scale) == floor(exact ** (scale - 1)) + 1


@pytest.mark.parametrize("kind", DILATED)
@pytest.mark.parametrize(("bandlimit", "dilation"), [(513, 2), (125, 5), (2, 2), (244, 3)])
def test_no_scale_is_empty_at_the_edges_that_others_miss(kind, bandlimit, dilation):
    """Rounded logarithms add an empty scale of full size at L = lam**k + 1."""
    tiling = kind(bandlimit, dilation=dilation)
    assert all(np.any(tiling.kernel(scale)) for scale in tiling.scales)


@pytest.mark.parametrize("kind", [ScaleDiscretisedTiling, NeedletTiling])
def test_scales_peak_at_powers_of_the_dilation(kind):
    """kappa_j(lam**j) = 1 and kappa_j(lam**(j-1)) = kappa_j(lam**(j+1)) = 0."""
    tiling = kind(300, dilation=3)
    for scale in range(1, 5):
        kernel = tiling.kernel(scale)
        assert (kernel[3 ** (scale - 1)], kernel[3**scale], kernel[3 ** (scale + 1)]) == (0, 1, 0)


def scale_discretised_step(t, dilation):
    """k_lambda(t), from its definition and an adaptive quadrature."""

    def integrand(u):
        x = 2 * dilation / (dilation - 1) * (u - 1 / dilation) - 1
        return np.exp(-2 / (1 - x * x)) / u if abs(x) < 1 else 0.0

    return _share(integrand, max(t, 1 / dilation), 1 / dilation)


def needlet_step(t, dilation):
    """psi(1 - 2B/(B-1) (t - 1/B)), from its definition and an adaptive quadrature."""

    def integrand(u):
        return np.exp(-1 / (1 - u * u)) if abs(u) < 1 else 0.0

    lower = 2 * dilation / (dilation - 1) * (t - 1 / dilation) - 1
    return _share(integrand, max(lower, -1.0), -1.0)


def _share(integrand, lower, lowest):
    if lower >= 1:
        return 0.0
    options = {"epsabs": 0, "epsrel": 1e-13, "limit": 200}
    return quad(integrand, lower, 1, **options)[0] / quad(integrand, lowest, 1, **options)[0]


def spline_step(t, dilation):  # noqa: ARG001 - one signature for every step
    """(3/2) B_3(2t), 12 B_3(x) = |x-2|^3 - 4|x-1|^3 + 6|x|^3 - 4|x+1|^3 + |x+2|^3."""
    terms = zip((1, -4, 6, -4, 1), (-2, -1, 0, 1, 2), strict=True)
    return (t < 1) * 1.5 / 12 * sum(factor * abs(2 * t + shift) ** 3 for factor, shift in terms)


@pytest.mark.parametrize("dilation", [1.3, 2.0, 3.0, 40.0])
@pytest.mark.parametrize(
    ("kind", "step"),
    [
        (ScaleDiscretisedTiling, scale_discretised_step),
        (NeedletTiling, needlet_step),
        (SplineTiling, spline_step),
    ],
)
def test_profiles_are_those_of_the_papers(kind, step, dilation):
    """kappa_j(l)**2 = k(l / lam**(j+1)) - k(l / lam**j), with k by adaptive quadrature."""
    tiling = kind(70, dilation=dilation)
    for scale in range(1, tiling.highest_scale):
        for el in range(1, 70, 7):
            upper, lower = step(el / dilation ** (scale + 1), dilation), 0.0
            if el < dilation**scale:
                lower = step(el / dilation**scale, dilation)
            # Adaptive quadrature is asked for 1e-13; the spline's direct sum cancels.
            assert abs(tiling.kernel(scale)[el] ** 2 - (upper - lower)) < 2e-13


@pytest.mark.parametrize("dilation", [1.2, 1.5, 2, 3, 4])
def test_trapezia_of_s2let_are_off_by_half_a_ten_thousandth(dilation):
    exact = ScaleDiscretisedTiling(64, dilation=dilation)
    rough = ScaleDiscretisedTiling(64, dilation=dilation, quadrature="s2let")
    differences = [np.abs(exact.kernel(j) - rough.kernel(j)).max() for j in exact.scales]
    assert 1e-6 < max(differences) < 6e-5


def test_small_tails_keep_their_digits():
    """From 1 - k computed as such kappa_8 would start with noise of 1e-8 at l = 129."""
    tail = ScaleDiscretisedTiling(4096).kernel(8)[129:140]
    assert 0 < tail[0] < 1e-14
    assert np.all(np.diff(tail) > 0)


@pytest.mark.parametrize("kind", DILATED)
@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"bandlimit": 0}, "bandlimit=0 must be an integer of at least 1"),
        ({"bandlimit": 8.0}, r"bandlimit=8\.0 must be an integer"),
        ({"dilation": 1}, r"dilation=1\.0 must exceed 1; 2\.0 halves the angular scale"),
        ({"dilation": -2.0}, "must exceed 1"),
        ({"dilation": np.nan}, "must exceed 1"),
        ({"dilation": np.inf}, "must exceed 1"),
        ({"dilation": "2"}, "must be a number above 1"),
        ({"dilation": True}, "must be a number above 1"),
        ({"dilation": 1 + EPS}, "makes more than 1024 scales"),
        ({"lowest_scale": -1}, "lowest_scale=-1 must be an integer of at least 0"),
        ({"lowest_scale": 4}, "lowest_scale=4 must not exceed the highest scale, 3"),
        ({"lowest_scale": 1.0}, "must be an integer"),
    ],
)
def test_dilated_tiling_names_the_bad_parameter(kind, parameters, message):
    with pytest.raises(ParameterError, match=message):
        kind(**{"bandlimit": 8, **parameters})


def test_quadrature_is_one_of_two():
    with pytest.raises(ParameterError, match="quadrature='simpson' must be one of"):
        ScaleDiscretisedTiling(8, quadrature="simpson")


def test_parameters_are_kept_as_plain_numbers():
    tiling = ScaleDiscretisedTiling(np.int64(8), dilation=np.float32(2), lowest_scale=np.int8(1))
    assert tiling == ScaleDiscretisedTiling(8, lowest_scale=1)
    assert type(tiling.bandlimit) is int
    assert type(tiling.dilation) is float


def test_tiling_alone_is_abstract():
    with pytest.raises(TypeError, match="abstract"):
        Tiling()


@pytest.mark.parametrize("transitions", [(), (16,), (4, 32)])
def test_hybrid_of_one_dilation_is_scale_discretised(transitions):
    hybrid = HybridTiling(100, dilations=(2,) * (len(transitions) + 1), transitions=transitions)
    plain = ScaleDiscretisedTiling(100)
    assert hybrid.edges == plain.edges
    for scale in plain.scales:
        assert_close(hybrid.kernel(scale), plain.kernel(scale), ulps=64)


def test_hybrid_scales_meet_at_the_transitions():
    """A transition is a cut-off, steps below it are equal, and the last dilation goes on above."""
    tiling = HybridTiling(500, dilations=(4, 2, 1.5), transitions=(20, 75))
    edges = np.array([float(edge) for edge in tiling.edges])
    assert {20.0, 75.0} < set(edges)
    steps = [edges[i + 1] / edges[i] for i in range(edges.size - 1)]
    desired = [20**0.5] * 2 + [3.75**0.5] * 2 + [1.5] * 5
    assert_close(steps, desired, ulps=1e-11 / EPS)
    assert tiling.kernel(tiling.edges.index(20))[20] == 1


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"dilations": 2.0}, "dilations=2.0 must be a sequence"),
        ({"dilations": "22"}, "must be a sequence"),
        ({"dilations": ()}, "must be one more than"),
        ({"dilations": (2, 1.5)}, "must be one more than"),
        ({"dilations": (2, 0.5), "transitions": (9,)}, "must exceed 1"),
        ({"dilations": (2, 2, 2), "transitions": (9, 9)}, "must be numbers that rise"),
        ({"dilations": (2, 2, 2), "transitions": (9, 4)}, "must be numbers that rise"),
        ({"dilations": (2, 2), "transitions": (100,)}, "must be numbers that rise"),
        ({"dilations": (2, 2), "transitions": (1,)}, "must be numbers that rise"),
        ({"dilations": (2, 2), "transitions": (np.nan,)}, "must be numbers that rise"),
        ({"dilations": (2, 2), "transitions": ("9",)}, "must be numbers that rise"),
        ({"bandlimit": "100", "dilations": (2,)}, "bandlimit='100' must be an integer"),
    ],
)
def test_hybrid_tiling_names_the_bad_parameter(parameters, message):
    with pytest.raises(ParameterError, match=message):
        HybridTiling(**{"bandlimit": 100, **parameters})


def test_custom_tiling_keeps_a_copy():
    scaling, wavelets = np.array([1.0, 0.0]), np.array([[0.0, 1.0]])
    tiling = CustomTiling(scaling, wavelets)
    scaling[0] = wavelets[0, 1] = 7
    assert tiling == CustomTiling([1, 0], [[0, 1]])
    assert tiling != CustomTiling([1, 0], [[0, -1]])
    assert tiling != ScaleDiscretisedTiling(2)


def test_custom_tiling_finds_its_bandlimits():
    tiling = CustomTiling([1, 0.6, 0, 0], [[0, 0, 0, 0], [0, 0.8, -1, 0], [0, 0, 0, 1]])
    assert [tiling.scale_bandlimit(scale) for scale in tiling.scales] == [1, 3, 4]
    assert [tiling.scale_lowest_degree(scale) for scale in tiling.scales] == [4, 1, 3]
    assert tiling.scaling_bandlimit == 2


@pytest.mark.parametrize(
    ("scaling", "wavelets", "error", "message"),
    [
        ([1, 0], [[0, 0.9]], DataError, "off 1 by 0.19 at degree 1"),
        ([0, 0], [[1, 1]], DataError, "degree 0"),
        ([0, 0], [[0, 1]], DataError, "off 1 by 1 at degree 0"),
        ([1, 0], [[0, np.nan]], DataError, "NaN or infinite"),
        ([1, 0], [[0, 1j]], DataError, "must hold real numbers"),
        ([1, 0], [[0, 1, 0]], ShapeError, "rows must be as long as scaling, 2"),
        ([1, 0], [0, 1], ShapeError, r"must have shape \(scales, bandlimit\)"),
        ([], np.zeros((1, 0)), ShapeError, "not be empty"),
        ([1, 1], np.zeros((0, 2)), ShapeError, "not be empty"),
    ],
)
def test_custom_tiling_says_what_is_wrong(scaling, wavelets, error, message):
    with pytest.raises(error, match=message):
        CustomTiling(scaling, wavelets)


@pytest.mark.parametrize("tolerance", [-1e-3, np.nan])
def test_custom_tolerance_is_not_negative(tolerance):
    with pytest.raises(ParameterError, match="must not be negative"):
        CustomTiling([1, 0], [[0, 1]], tolerance=tolerance)


def test_custom_tolerance_lets_measured_profiles_in():
    assert CustomTiling([1, 0], [[0, 0.9999]], tolerance=1e-3).partition_error > 1e-4
