"""Estimates of memory agree with what is allocated, and budgets are kept before anything is."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from spinsdw.directionality import CurveletDirectionality
from spinsdw.errors import MemoryBudgetError, ParameterError
from spinsdw.memory import MemoryEstimate, check_max_memory
from spinsdw.ring_transform import HealpixTransform
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform
from tests.helpers import needs_compiler

CHILDREN = Path(__file__).parents[1] / "benchmarks" / "children.py"

MAKERS = {
    "spin 2": lambda L, **options: SpinHarmonicTransform(L, 2, **options),
    "real": lambda L, **options: SpinHarmonicTransform(L, real=True, sampling="mwss", **options),
    "rotations": lambda L, **options: WignerTransform(L, (-2, 0, 2), **options),
    "real rotations": lambda L, **options: WignerTransform(L, (-1, 1), real=True, **options),
    "healpix": lambda L, **options: HealpixTransform(L // 2, L, 2, **options),
    "wavelets": lambda L, **options: SpinWaveletTransform(L, 2, 3, **options),
    "one direction": lambda L, **options: SpinWaveletTransform(L, 2, **options),
    "real wavelets": lambda L, **options: SpinWaveletTransform(L, 0, 2, real=True, **options),
    "large scaling part": lambda L, **options: SpinWaveletTransform(
        L, 2, lowest_scale=L.bit_length() - 2, **options
    ),
    "real curvelets": lambda L, **options: SpinWaveletTransform(
        L, real=True, directionality=CurveletDirectionality(), **options
    ),
    "single": lambda L, **options: SpinHarmonicTransform(L, 2, dtype="complex64", **options),
    "single wavelets": lambda L, **options: SpinWaveletTransform(
        L, 2, 3, dtype="complex64", **options
    ),
    "single real wavelets": lambda L, **options: SpinWaveletTransform(
        L, 0, 2, real=True, dtype="complex64", **options
    ),
    "one resolution": lambda L, **options: SpinWaveletTransform(
        L, 2, multiresolution=False, **options
    ),
}


def arguments(transform, batch):
    """Return a call's argument by the name of its method."""
    size = transform.bandlimit**2
    rows = (len(transform.orders),) if isinstance(transform, WignerTransform) else ()
    flm = np.zeros((batch, *rows, size), dtype=complex)
    if not isinstance(transform, SpinWaveletTransform):
        maps = transform.synthesis(flm)
        there = dict.fromkeys(("synthesis", "adjoint_analysis"), flm)
        return there | dict.fromkeys(("analysis", "adjoint_synthesis"), maps)
    maps, coefficients = transform.harmonic.synthesis(flm), transform.analysis_harmonic(flm)
    there = dict.fromkeys(("synthesis", "adjoint_analysis"), coefficients)
    there |= {f"{name}_harmonic": coefficients for name in there}
    back = dict.fromkeys(("analysis", "adjoint_synthesis"), maps)
    return there | back | {f"{name}_harmonic": flm for name in back}


def allocated(call, given):
    """Return the most bytes held during a call beyond those before, and those returned.

    The less of two calls: now and then a table of the interpreter's own grows by megabytes.
    """
    return min(allocated_once(call, given) for _ in range(2))


def allocated_once(call, given):
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        found = call(given)
        return tracemalloc.get_traced_memory()[1] - before, found.nbytes
    finally:
        tracemalloc.stop()


@needs_compiler
@pytest.mark.parametrize(
    ("what", "bandlimit", "batch"),
    [
        *((what, 200, 1) for what in MAKERS if what != "real curvelets"),
        ("real", 200, 4),
        ("wavelets", 200, 2),
    ],
)
def test_estimate_is_what_is_allocated(what, bandlimit, batch):
    """-2 % <= estimate / truth - 1 <= 2 %, and up to 2 MiB more for what threads work in."""
    check_estimates(MAKERS[what](bandlimit, threads=1), batch, above=1.02)


@needs_compiler
def test_estimate_for_dozens_of_orders_is_at_most_half_above():
    """It holds for both ways, and one of them needs a spectrum of all orientations."""
    check_estimates(MAKERS["real curvelets"](40, threads=1), 1, above=1.5)


def check_estimates(transform, batch, above):
    given = arguments(transform, batch)
    for name, estimate in transform.memory_estimate(batch).items():
        grown, returned = allocated(getattr(transform, name), given[name])
        assert (given[name].nbytes, returned) == (estimate.input, estimate.output), name
        peak = estimate.input + grown
        assert 0.98 * peak <= estimate.peak <= above * peak + 2**21, name


@needs_compiler
@pytest.mark.parametrize("make", [SpinHarmonicTransform, SpinWaveletTransform])
def test_maps_of_single_precision_are_taken_as_they_are(make):
    """Converted whole they would take three times their bytes."""
    transform, single = make(200, 2, threads=1), make(200, 2, dtype="complex64", threads=1)
    for name in ("analysis", "adjoint_synthesis"):
        maps = arguments(single, 1)[name]
        grown, returned = allocated(getattr(transform, name), maps)
        estimate = transform.memory_estimate()[name]
        assert grown <= 1.02 * (estimate.working + returned)


@needs_compiler
@pytest.mark.parametrize(("directions", "share"), [(1, 0.7), (3, 0.57)])
def test_single_precision_takes_half_but_for_harmonic_coefficients(directions, share):
    """What is stored takes exactly half; of the peak, flm and what threads work in stay."""
    single = SpinWaveletTransform(256, 2, directions, dtype="complex64", threads=1)
    double = SpinWaveletTransform(256, 2, directions, threads=1)
    for name in ("analysis_harmonic", "synthesis_harmonic"):
        peaks = []
        for transform in (single, double):
            given = arguments(transform, 1)[name]
            peaks.append(given.nbytes + allocated(getattr(transform, name), given)[0])
        assert peaks[0] <= share * peaks[1]
    one, two = (arguments(transform, 1)["synthesis"].nbytes for transform in (single, double))
    assert 2 * one == two


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("direction", ["harmonic to wavelet", "wavelet to harmonic"])
@pytest.mark.parametrize(
    ("bandlimit", "directions", "dtype"),
    [
        (1024, 3, "complex128"),
        (2048, 5, "complex128"),
        (2048, 5, "complex64"),
        (4096, 1, "complex128"),
    ],
)
def test_a_process_grows_by_the_estimate_and_less_than_half_beyond_the_data(
    bandlimit, directions, dtype, direction
):
    """peak < 1.5 (input + output), and within 5 % of the estimate."""
    case = {"L": bandlimit, "N": directions, "threads": 2, "direction": direction, "dtype": dtype}

    def run(bandlimit):
        argument = json.dumps({**case, "L": bandlimit})
        command = [sys.executable, str(CHILDREN), "memory", argument]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)

    # Once for the machine code alone: a compiler's memory would count as the transform's.
    run(256)
    found = run(bandlimit)
    assert found["growth"] < 1.5 * (found["input"] + found["output"])
    assert found["growth"] == pytest.approx(found["estimate"], rel=0.05)


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_budget_of_the_estimate_is_enough_and_one_byte_less_is_not(make):
    bandlimit = 8
    for batch in (1, 2):
        given = arguments(make(bandlimit), batch)
        for name, estimate in make(bandlimit).memory_estimate(batch).items():
            getattr(make(bandlimit, max_memory=estimate.peak), name)(given[name])
            msg = (
                f"max_memory={estimate.peak - 1} bytes is less than the {estimate.peak} bytes that "
                f"{name} takes ({estimate.input} of input, {estimate.output} of output, "
                f"{estimate.working} to work in); raise max_memory or pass fewer signals at once."
            )
            with pytest.raises(MemoryBudgetError, match=f"^{re.escape(msg)}$"):
                getattr(make(bandlimit, max_memory=estimate.peak - 1), name)(given[name])


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_what_exceeds_the_budget_is_refused_before_anything_large_is_allocated(make):
    """Not even the conversion of the input: its bytes are told from its shape."""
    transform = make(64, max_memory=10**5)
    rows = (len(transform.orders),) if isinstance(transform, WignerTransform) else ()
    flm = np.broadcast_to(np.float32(0), (500, *rows, 64**2))
    maps = np.broadcast_to(np.float32(0), (500, *getattr(transform, "harmonic", transform).shape))
    given = {"synthesis": flm, "adjoint_synthesis": maps}
    if isinstance(transform, SpinWaveletTransform):
        given = {"analysis_harmonic": flm, "adjoint_synthesis_harmonic": flm}
        given |= {"analysis": maps, "adjoint_synthesis": maps}
    for name, values in given.items():
        tracemalloc.start()
        try:
            with pytest.raises(MemoryBudgetError, match="max_memory=100000 bytes is less than"):
                getattr(transform, name)(values)
            assert tracemalloc.get_traced_memory()[1] < 2**20, name
        finally:
            tracemalloc.stop()


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_estimates_are_linear_in_the_batch(make):
    transform = make(32)
    for name, none in transform.memory_estimate(0).items():
        assert none.input == none.output == 0
        one, three = (transform.memory_estimate(batch)[name] for batch in (1, 3))
        assert (three.input, three.output) == (3 * one.input, 3 * one.output)
        assert one.peak < three.peak <= 3 * one.peak


def test_two_steps_hold_what_the_first_returned():
    """peak = max(input + first output + first working, input + second's peak)."""
    first, second = MemoryEstimate(1, 5, 2), MemoryEstimate(5, 3, 1)
    assert first.then(second) == MemoryEstimate(1, 3, 6)
    assert MemoryEstimate(1, 5, 20).then(second).peak == 26


@pytest.mark.parametrize("wrong", [0, -1, True, 1e9, "4 GiB"])
def test_budget_must_be_a_number_of_bytes(wrong):
    msg = f"max_memory={wrong!r} must be a positive number of bytes, or None for no limit."
    with pytest.raises(ParameterError, match=f"^{re.escape(msg)}$"):
        check_max_memory(wrong)
    for make in MAKERS.values():
        with pytest.raises(ParameterError, match=f"^{re.escape(msg)}$"):
            make(32, max_memory=wrong)


@pytest.mark.parametrize("wrong", [-1, 1.0, None])
def test_batch_of_an_estimate_must_be_a_count(wrong):
    for make in MAKERS.values():
        with pytest.raises(ParameterError, match="must be an integer of at least 0"):
            make(32).memory_estimate(wrong)
