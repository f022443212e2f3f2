"""The laws of the container of wavelet coefficients."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, random_flm

PARAMETERS = {"bandlimit": 8, "spin": 2, "directions": 2, "sampling": "mw"}


COPIES = [
    WaveletCoefficients.copy,
    copy.copy,
    copy.deepcopy,
    lambda one: pickle.loads(pickle.dumps(one)),
]


def random_values(shape, seed):
    rng = np.random.default_rng(seed)
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def make(batch=(), seed=0, **parameters):
    wavelets = {
        3: random_values((*batch, 2, 4, 7), seed + 1),
        1: random_values((*batch, 2, 2, 3), seed + 2),
    }
    scaling = random_values((*batch, 1, 1), seed)
    return WaveletCoefficients(scaling, wavelets, PARAMETERS | parameters)


def assert_equal(found, scaling, wavelets):
    """Assert that every number is that of an array, or a mapping of arrays."""
    assert np.array_equal(found.scaling, scaling)
    for scale in found.scales:
        assert np.array_equal(found[scale], wavelets[scale])


def test_scales_are_held_in_increasing_order():
    coefficients = make()
    assert coefficients.scales == (1, 3)
    assert list(coefficients) == [1, 3]
    assert len(coefficients) == 2
    assert list(coefficients.shapes) == ["scaling", 1, 3]


@pytest.mark.parametrize("batch", [(), (3,), (2, 0)])
def test_shapes_and_bytes_are_those_of_the_arrays(batch):
    coefficients = make(batch)
    assert coefficients.shapes == {
        "scaling": (*batch, 1, 1),
        1: (*batch, 2, 2, 3),
        3: (*batch, 2, 4, 7),
    }
    assert coefficients.nbytes == 16 * int(np.prod(batch)) * (1 + 12 + 56)


def test_sum_and_difference_act_on_every_number():
    """(a + b) - b = a, up to rounding, and a - a = 0."""
    one, other = make(seed=1), make(seed=10)
    total = one + other
    assert_equal(total, one.scaling + other.scaling, {j: one[j] + other[j] for j in one})
    difference = one - other
    assert_equal(difference, one.scaling - other.scaling, {j: one[j] - other[j] for j in one})
    assert (one - one).norm() == 0


@pytest.mark.parametrize("factor", [2, -0.5, 1j, np.float64(3), np.complex128(2j), np.array(2.0)])
def test_numbers_multiply_from_both_sides(factor):
    one = make()
    for product in (factor * one, one * factor):
        assert_equal(product, one.scaling * factor, {j: one[j] * factor for j in one})


@pytest.mark.parametrize("divisor", [2, -0.5, 1j, np.float64(3), np.array(2.0)])
def test_numbers_divide(divisor):
    one = make()
    assert_equal(one / divisor, one.scaling / divisor, {j: one[j] / divisor for j in one})


def test_negation_turns_every_sign():
    one = make()
    assert_equal(-one, -one.scaling, {j: -one[j] for j in one})


def test_factors_scale_by_scale_leave_the_others():
    one = make()
    weights = np.linspace(0, 1, 28).reshape(4, 7)
    found = one * {"scaling": 0.0, 3: weights}
    assert_equal(found, 0 * one.scaling, {1: one[1], 3: one[3] * weights})
    assert_equal({1: 2.0} * one, one.scaling, {1: 2 * one[1], 3: one[3]})


@pytest.mark.parametrize("key", [2, "wavelets", (1, 3)])
def test_factors_name_scales_that_are_held(key):
    with pytest.raises(ParameterError, match=r"factors for .* match no scale of \(1, 3\)"):
        make() * {key: 1.0}


@pytest.mark.parametrize("factor", [np.ones((3, 3)), np.ones(2), np.ones((1, 1, 1, 1))])
@pytest.mark.parametrize("key", ["scaling", 1])
def test_factors_fit_their_scale(key, factor):
    """A factor may not add axes or change their lengths either."""
    name = "the scaling part" if key == "scaling" else "scale 1"
    with pytest.raises(ShapeError, match=f"factor for {name} has shape .*; it must be a number or"):
        make() * {key: factor}


@pytest.mark.parametrize("other", [np.ones(3), [1, 2], np.ones((4, 7)), None, "a", np.array("a")])
def test_arrays_and_lists_do_not_multiply(other):
    with pytest.raises(TypeError):
        make() * other
    with pytest.raises(TypeError):
        other * make()
    with pytest.raises(TypeError):
        make() / other


def test_coefficients_do_not_multiply_each_other():
    with pytest.raises(TypeError):
        make() * make()
    with pytest.raises(TypeError):
        make() / make()


@pytest.mark.parametrize("other", [1, 0.0, np.ones(3), None, {}])
def test_only_coefficients_add(other):
    with pytest.raises(TypeError):
        make() + other
    with pytest.raises(TypeError):
        make() - other
    with pytest.raises(TypeError):
        make() / {1: 2.0}


def test_coefficients_of_other_shapes_do_not_add():
    with pytest.raises(ShapeError, match="cannot be combined"):
        make() + make(batch=(1,))


def test_coefficients_of_other_transforms_do_not_add():
    with pytest.raises(ParameterError, match="of different transforms cannot be combined"):
        make() - make(spin=0)


def test_norm_is_the_root_of_the_sum_of_squares():
    """Norm^2 = sum |w|^2, homogeneous and subadditive."""
    one, other = make(seed=1), make(seed=10)
    arrays = [one.scaling, *(one[j] for j in one)]
    squares = sum(np.sum(np.abs(values) ** 2) for values in arrays)
    assert_close(one.norm(), np.sqrt(squares), ulps=8)
    assert_close((3j * one).norm(), 3 * one.norm(), ulps=8)
    assert (one + other).norm() <= one.norm() + other.norm()


def test_map_applies_a_function_to_every_array():
    one = make()
    found = one.map(np.abs)
    assert_equal(found, np.abs(one.scaling), {j: np.abs(one[j]) for j in one})
    assert found.scaling.dtype == np.float64
    assert found.parameters == one.parameters


def test_map_keeps_shapes():
    with pytest.raises(ShapeError, match=r"turned the shape \(1, 1\) of scaling into \(1,\)"):
        make().map(lambda values: values[..., 0])
    with pytest.raises(ShapeError, match="of 1 into"):
        make().map(lambda values: values if values.size == 1 else values[..., :1])


@pytest.mark.parametrize("make_copy", COPIES)
@pytest.mark.parametrize("batch", [(), (3,), (0,)])
def test_a_copy_has_the_same_numbers_and_parameters(make_copy, batch):
    """A pickle too, so that other processes can have them."""
    one = make(batch)
    other = make_copy(one)
    assert_equal(other, one.scaling, {j: one[j] for j in one})
    assert other.parameters == one.parameters
    assert not other.scaling.flags.writeable
    assert not any(other[j].flags.writeable for j in other)


def test_a_copy_has_arrays_of_its_own():
    one = make()
    other = one.copy()
    assert not np.shares_memory(one.scaling, other.scaling)
    assert not any(np.shares_memory(one[j], other[j]) for j in one)


@pytest.mark.parametrize("scale", [2, -1, "scaling", None, [1], slice(1, 3)])
def test_a_scale_that_is_not_held_is_named(scale):
    with pytest.raises(ParameterError, match=r"scale=.* is not held; the scales are \(1, 3\)"):
        make()[scale]


def test_arrays_are_read_only():
    """Two results may share an array: a change of one would be a change of the other."""
    one = make()
    for values in (one.scaling, one[1], one.map(lambda v: v)[3], (2 * one)[1], one.copy().scaling):
        with pytest.raises(ValueError, match="read-only"):
            values[...] = 0


def test_arrays_of_the_caller_stay_writable_and_are_not_copied():
    scaling, wavelets = np.zeros((1, 1)), {0: np.zeros((2, 1, 1))}
    one = WaveletCoefficients(scaling, wavelets, PARAMETERS)
    assert np.shares_memory(one.scaling, scaling)
    assert np.shares_memory(one[0], wavelets[0])
    assert scaling.flags.writeable
    assert wavelets[0].flags.writeable


def test_masked_arrays_are_refused():
    """Values under a mask would be taken for coefficients."""
    masked = np.ma.array(np.zeros((2, 1, 3)), mask=np.ones((2, 1, 3)))
    with pytest.raises(DataError, match="scale 0 has masked entries"):
        WaveletCoefficients(np.zeros((1, 1)), {0: masked}, PARAMETERS)
    with pytest.raises(DataError, match="scaling part has masked entries"):
        WaveletCoefficients(masked[0], {}, PARAMETERS)


def test_parameters_are_read_only():
    one = make()
    with pytest.raises(TypeError):
        one.parameters["spin"] = 0
    with pytest.raises(AttributeError):
        one.scaling = 0


def test_parameters_are_those_of_the_moment():
    """Changing the mapping that was handed over changes nothing."""
    parameters = dict(PARAMETERS)
    one = WaveletCoefficients(np.zeros((1, 1)), {}, parameters)
    parameters["spin"] = 5
    assert one.parameters["spin"] == 2


@pytest.mark.parametrize(
    ("scaling", "wavelets"),
    [
        ((1, 1), (3, 4, 7)),
        ((1, 1), (4, 7)),
        ((1, 1), (5, 2, 4, 7)),
        ((5, 1, 1), (2, 4, 7)),
        ((5, 1, 1), (4, 2, 4, 7)),
    ],
)
def test_every_scale_has_the_orientations_and_the_batch(scaling, wavelets):
    with pytest.raises(ShapeError, match=r"scale 0 has shape .*it must be \(\.\.\., 2, rings, phi"):
        WaveletCoefficients(np.zeros(scaling), {0: np.zeros(wavelets)}, PARAMETERS)


@pytest.mark.parametrize("directions", [1, 2, 3, 4])
def test_steering_to_an_orientation_held_gives_it(directions):
    """z(gamma_k - gamma_j) = delta_jk."""
    transform = SpinWaveletTransform(8, 2, directions)
    coefficients = transform.analysis_harmonic(random_flm(8, 2))
    for k, angle in enumerate(transform.orientations):
        for scale, values in coefficients.steer(angle).items():
            assert_close(values, coefficients[scale][k], ulps=8 * directions)


def test_steering_keeps_the_batch():
    transform = SpinWaveletTransform(8, 2, 3)
    signals = random_flm(8, 2, batch=(2, 2))
    together = transform.analysis_harmonic(signals).steer(0.7)
    for place in np.ndindex(2, 2):
        alone = transform.analysis_harmonic(signals[place]).steer(0.7)
        for scale, values in alone.items():
            assert_close(together[scale][place], values, ulps=4)


@pytest.mark.parametrize("angle", [np.nan, np.inf])
def test_steering_takes_finite_angles(angle):
    with pytest.raises(DataError, match="must be finite; give it in radians"):
        make().steer(angle)


@pytest.mark.parametrize("angle", ["a", None, 1j, True, np.zeros((2, 2)), [0.1]])
def test_steering_takes_one_angle(angle):
    with pytest.raises(ParameterError, match=r"(?s)angle=.* must be one real number, in radians"):
        make().steer(angle)


def test_text_tells_what_is_held():
    text = repr(make())
    assert text.startswith("WaveletCoefficients(bandlimit=8, spin=2, directions=2, sampling='mw')")
    assert "scaling: 1 x 1 complex128" in text
    assert "scale 3: 2 x 4 x 7 complex128" in text


def test_batch_can_be_laid_out_anew():
    transform = SpinWaveletTransform(8, 1, 2)
    stack = transform.analysis_harmonic(random_flm(8, 1, batch=(6,)))
    again = stack.reshape_batch((2, 3))
    assert again.scaling.shape[:2] == again[2].shape[:2] == (2, 3)
    assert np.array_equal(again[2][1, 0], stack[2][3])
    assert (again.reshape_batch((6,)) - stack).norm() == 0
    with pytest.raises(ShapeError, match=r"shape=\(5,\) holds 5 signals, but the batch \(6,\)"):
        stack.reshape_batch((5,))


def test_map_applies_one_function_to_each_part_named():
    one = make()
    found = one.map({3: np.conj, "scaling": np.negative})
    assert_equal(found, -one.scaling, {1: one[1], 3: one[3].conj()})
    with pytest.raises(ParameterError, match=r"functions for \['2'\] match no scale of \(1, 3\)"):
        one.map({2: np.conj})


RULES = {
    "hard": lambda size, _: size,
    "soft": lambda size, level: size - level,
    "garrote": lambda size, level: size - level**2 / np.where(size > 0, size, 1),
}


def shrunk(values, level, rule):
    """w = |w| e^{i a} becomes rule(|w|, T) e^{i a} where |w| > T, and 0 elsewhere."""
    size = np.abs(values)
    return np.where(size > level, RULES[rule](size, level) * np.exp(1j * np.angle(values)), 0)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("batch", [(), (3,)])
def test_a_number_thresholds_every_scale_and_leaves_the_scaling_part(rule, batch):
    one = make(batch)
    found = one.threshold(1.2, rule=rule)
    assert np.array_equal(found.scaling, one.scaling)
    for j in one:
        assert_close(found[j], shrunk(one[j], 1.2, rule), ulps=8)
        assert np.any(found[j] == 0)
        assert np.any(found[j] != 0)


@pytest.mark.parametrize("rule", RULES)
def test_thresholds_hold_scale_by_scale_and_number_by_number(rule):
    one = make()
    levels = np.random.default_rng(3).uniform(0, 2, one[3].shape)
    found = one.threshold({"scaling": 0.1, 3: levels}, rule=rule)
    assert_close(found.scaling, shrunk(one.scaling, 0.1, rule), ulps=8)
    assert np.array_equal(found[1], one[1])
    assert_close(found[3], shrunk(one[3], levels, rule), ulps=8)


@pytest.mark.parametrize("rule", RULES)
def test_no_threshold_keeps_all_and_an_infinite_one_nothing(rule):
    one = make()
    assert_equal(one.threshold(0, rule=rule), one.scaling, {j: one[j] for j in one})
    nothing = one.threshold({"scaling": np.inf, 1: np.inf, 3: np.inf}, rule=rule)
    assert nothing.norm() == 0


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.complex64, np.complex128])
@pytest.mark.parametrize("rule", RULES)
def test_thresholding_keeps_the_precision(dtype, rule):
    values = make().map(lambda v: v.real.astype(dtype))
    found = values.threshold({1: 1.0, 3: np.full((4, 7), 0.5)}, rule=rule)
    assert {found[j].dtype for j in found} == {np.dtype(dtype)}


def test_thresholds_of_whole_numbers_are_not_rounded():
    one = WaveletCoefficients(np.zeros((1, 1)), {0: np.full((2, 1, 1), 3)}, PARAMETERS)
    assert one.threshold(0.5, rule="soft")[0][0, 0, 0] == 2.5


@pytest.mark.parametrize(
    ("thresholds", "rule", "error", "message"),
    [
        (1.0, "firm", ParameterError, "rule='firm' must be one of"),
        ({2: 1.0}, "hard", ParameterError, r"thresholds for \['2'\] match no scale"),
        (-1.0, "hard", DataError, "threshold for scale 1 must hold real numbers of at least 0"),
        ({3: np.nan}, "soft", DataError, "threshold for scale 3 must hold real numbers"),
        ({1: 1j}, "hard", DataError, "threshold for scale 1 must hold real numbers"),
        ({"scaling": "a"}, "hard", DataError, "threshold for the scaling part must hold real"),
        ({1: np.ones((3, 3))}, "hard", ShapeError, "threshold for scale 1 has shape"),
    ],
)
def test_bad_thresholds_are_refused(thresholds, rule, error, message):
    with pytest.raises(error, match=message):
        make().threshold(thresholds, rule=rule)
