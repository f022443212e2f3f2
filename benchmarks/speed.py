"""The timed jobs: each yields one row of results for each thing it compares.

A row is a flat dictionary that says what was done, then ``seconds`` (best), ``median`` and
``rounds``. Signals are random, with harmonic coefficients of unit variance.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from plans import Plan
from timing import best_of

import peers
from spinsdw.ring_transform import HealpixTransform
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = [
    "batch",
    "compare",
    "growth",
    "harmonic",
    "healpix",
    "healpix_batch",
    "pys2let",
    "random_flm",
    "threads",
    "wavelets",
]

Array = np.ndarray[Any, Any]
Row = dict[str, Any]
Calls = dict[str, Callable[[], object]]

# What is transformed: name, spin, whether it is real.
SIGNALS = (("spin 2", 2, False), ("real scalar", 0, True))
# The peer's arrays are at fault where N exceeds the bandlimit of a scale.
S2LET_LOWEST_SCALE = 2
S2LET_DIRECTIONS = 3


def random_flm(bandlimit: int, spin: int, *, real: bool = False, seed: int = 0) -> Array:
    """Draw coefficients of unit variance; of a real field for ``real``."""
    rng = np.random.default_rng(seed)
    flm = rng.standard_normal(2 * bandlimit**2).view(np.complex128)
    flm[: spin**2] = 0.0
    if real:
        el, m = peers.m_major(bandlimit)
        here, there = el**2 + el + m, el**2 + el - m
        flm[here[m == 0]] = flm[here[m == 0]].real
        flm[there] = (-1.0) ** m * flm[here].conj()
    return flm


def compare(calls: Calls, plan: Plan, fewest: int | None = None, **what: Any) -> Row:
    """Time calls in turn; ``what`` they do comes first in the row."""
    found = best_of(calls, fewest=fewest or plan.fewest, budget=plan.budget)
    return {**what, "seconds": found.best, "median": found.median, "rounds": found.rounds}


def wavelets(plan: Plan) -> Iterator[Row]:
    """Harmonic to wavelet and back, against a composition of ducc0's spin transforms."""
    for bandlimit in plan.bandlimits:
        for signal, spin, real in SIGNALS:
            for directions in plan.directions:
                for count in plan.threads:
                    transform = SpinWaveletTransform(
                        bandlimit, spin, directions, real=real, threads=count
                    )
                    flm = random_flm(bandlimit, spin, real=real)
                    yield from _wavelet_rows(transform, flm, plan, signal=signal)


def _wavelet_rows(
    transform: SpinWaveletTransform, flm: Array, plan: Plan, *, signal: str
) -> Iterator[Row]:
    threads = int(transform.threads or 1)
    coefficients = transform.analysis_harmonic(flm)
    what = {"signal": signal, "L": transform.bandlimit, "N": transform.directions}
    what["threads"] = threads
    calls: Calls = {
        "spinsdw": partial(transform.analysis_harmonic, flm),
        "ducc0": peers.ducc0_wavelet_analysis(transform, flm, threads=threads),
    }
    yield compare(calls, plan, direction="harmonic to wavelet", **what)
    calls = {
        "spinsdw": partial(transform.synthesis_harmonic, coefficients),
        "ducc0": peers.ducc0_wavelet_synthesis(transform, coefficients, threads=threads),
    }
    yield compare(calls, plan, direction="wavelet to harmonic", **what)


def harmonic(plan: Plan) -> Iterator[Row]:
    """Synthesis and analysis of one map on the McEwen-Wiaux grid, against ducc0."""
    for bandlimit in plan.bandlimits:
        for signal, spin, real in SIGNALS:
            for count in plan.threads:
                transform = SpinHarmonicTransform(bandlimit, spin, real=real, threads=count)
                flm = random_flm(bandlimit, spin, real=real)
                yield from _harmonic_rows(transform, flm, plan, signal=signal)


def _harmonic_rows(
    transform: SpinHarmonicTransform, flm: Array, plan: Plan, *, signal: str
) -> Iterator[Row]:
    threads = int(transform.threads or 1)
    maps = transform.synthesis(flm)
    what = {"signal": signal, "L": transform.bandlimit, "threads": threads}
    calls: Calls = {
        "spinsdw": partial(transform.synthesis, flm),
        "ducc0": peers.ducc0_synthesis(transform, flm, threads=threads),
    }
    yield compare(calls, plan, direction="synthesis", **what)
    calls = {
        "spinsdw": partial(transform.analysis, maps),
        "ducc0": peers.ducc0_analysis(transform, maps, threads=threads),
    }
    yield compare(calls, plan, direction="analysis", **what)


def healpix(plan: Plan) -> Iterator[Row]:
    """Synthesis on HEALPix rings and its adjoint, against ducc0; L = 2 nside + 1."""
    for nside in plan.nsides:
        for signal, spin, real in SIGNALS:
            for count in plan.threads:
                transform = HealpixTransform(nside, 2 * nside + 1, spin, real=real, threads=count)
                flm = random_flm(transform.bandlimit, spin, real=real)
                yield from _healpix_rows(transform, flm, plan, signal=signal)


def _healpix_rows(
    transform: HealpixTransform, flm: Array, plan: Plan, *, signal: str
) -> Iterator[Row]:
    threads = int(transform.threads or 1)
    maps = transform.synthesis(flm)
    what = {"signal": signal, "nside": transform.nside, "L": transform.bandlimit}
    what["threads"] = threads
    calls: Calls = {
        "spinsdw": partial(transform.synthesis, flm),
        "ducc0": peers.ducc0_healpix(transform, flm, threads=threads),
    }
    yield compare(calls, plan, direction="synthesis", **what)
    calls = {
        "spinsdw": partial(transform.adjoint_synthesis, maps),
        "ducc0": peers.ducc0_adjoint_healpix(transform, maps, threads=threads),
    }
    yield compare(calls, plan, direction="adjoint synthesis", **what)


def pys2let(plan: Plan) -> Iterator[Row]:
    """Map to wavelet and back, against pys2let where it is installed; one thread, spin 2."""
    if importlib.util.find_spec("pys2let") is None:
        return
    for bandlimit in plan.s2let_bandlimits:
        transform = SpinWaveletTransform(
            bandlimit, 2, S2LET_DIRECTIONS, lowest_scale=S2LET_LOWEST_SCALE, threads=1
        )
        maps = transform.harmonic.synthesis(random_flm(bandlimit, 2))
        yield from _pys2let_rows(transform, maps, plan)


def _pys2let_rows(transform: SpinWaveletTransform, maps: Array, plan: Plan) -> Iterator[Row]:
    coefficients = transform.analysis(maps)
    what = {"signal": "spin 2", "L": transform.bandlimit, "N": transform.directions, "threads": 1}
    # The peer takes seconds to minutes: two rounds tell enough.
    fewest = min(2, plan.fewest)
    calls: Calls = {
        "spinsdw": partial(transform.analysis, maps),
        "pys2let": peers.pys2let_analysis(transform, maps),
    }
    yield compare(calls, plan, fewest, direction="map to wavelet", **what)
    calls = {
        "spinsdw": partial(transform.synthesis, coefficients),
        "pys2let": peers.pys2let_synthesis(transform, maps),
    }
    yield compare(calls, plan, fewest, direction="wavelet to map", **what)


def healpix_batch(plan: Plan) -> Iterator[Row]:
    """Many HEALPix maps in one call, against as many calls; L = 2 nside + 1."""
    for nside in plan.batch_nsides:
        for signal, spin, real in SIGNALS:
            for count in plan.threads:
                transform = HealpixTransform(nside, 2 * nside + 1, spin, real=real, threads=count)
                flms = np.stack(
                    [random_flm(2 * nside + 1, spin, real=real, seed=i) for i in range(plan.batch)]
                )
                maps = transform.synthesis(flms)
                what = {"signal": signal, "nside": nside, "L": transform.bandlimit}
                what |= {"threads": count, "maps": len(flms)}
                for direction, call, given in (
                    ("synthesis", transform.synthesis, flms),
                    ("adjoint synthesis", transform.adjoint_synthesis, maps),
                ):
                    calls: Calls = {
                        "spinsdw": partial(call, given),
                        "single calls": partial(_one_by_one, call, given),
                    }
                    yield compare(calls, plan, direction=direction, **what)


def _one_by_one(call: Callable[[Array], Array], batch: Array) -> None:
    for one in batch:
        call(one)


def batch(plan: Plan) -> Iterator[Row]:
    """Many maps in one call, against as many calls; spin 2, N = 3."""
    for bandlimit in plan.batch_bandlimits:
        for count in plan.threads:
            transform = SpinWaveletTransform(bandlimit, 2, 3, threads=count)
            flms = np.stack([random_flm(bandlimit, 2, seed=i) for i in range(plan.batch)])
            yield from _batch_rows(transform, flms, plan)


def _batch_rows(transform: SpinWaveletTransform, flms: Array, plan: Plan) -> Iterator[Row]:
    together = transform.analysis_harmonic(flms)
    apart = [transform.analysis_harmonic(flm) for flm in flms]
    what = {"signal": "spin 2", "L": transform.bandlimit, "N": transform.directions}
    what |= {"threads": transform.threads, "maps": len(flms)}
    calls: Calls = {
        "one call": partial(transform.analysis_harmonic, flms),
        "single calls": lambda: [transform.analysis_harmonic(flm) for flm in flms],
    }
    yield compare(calls, plan, direction="harmonic to wavelet", **what)
    calls = {
        "one call": partial(transform.synthesis_harmonic, together),
        "single calls": lambda: [transform.synthesis_harmonic(one) for one in apart],
    }
    yield compare(calls, plan, direction="wavelet to harmonic", **what)


def threads(plan: Plan) -> Iterator[Row]:
    """Each number of threads against the others, for us and for ducc0; spin 2, N = 3."""
    for bandlimit in plan.bandlimits:
        flm = random_flm(bandlimit, 2)
        coefficients = SpinWaveletTransform(bandlimit, 2, 3).analysis_harmonic(flm)
        forward: Calls = {}
        backward: Calls = {}
        for count in plan.threads:
            transform = SpinWaveletTransform(bandlimit, 2, 3, threads=count)
            ours, peer = f"spinsdw {count}", f"ducc0 {count}"
            forward[ours] = partial(transform.analysis_harmonic, flm)
            backward[ours] = partial(transform.synthesis_harmonic, coefficients)
            forward[peer] = peers.ducc0_wavelet_analysis(transform, flm, threads=count)
            backward[peer] = peers.ducc0_wavelet_synthesis(transform, coefficients, threads=count)
        what = {"signal": "spin 2", "L": bandlimit, "N": 3}
        yield compare(forward, plan, direction="harmonic to wavelet", **what)
        yield compare(backward, plan, direction="wavelet to harmonic", **what)


def growth(plan: Plan) -> Iterator[Row]:
    """Our own time over L at N = 3, and over N at one L; spin 2, one thread."""
    sizes = {
        "L": [(bandlimit, 3) for bandlimit in plan.bandlimits],
        "N": [(plan.growth_bandlimit, directions) for directions in plan.growth_directions],
    }
    for over, pairs in sizes.items():
        forward: Calls = {}
        backward: Calls = {}
        for bandlimit, directions in pairs:
            transform = SpinWaveletTransform(bandlimit, 2, directions, threads=1)
            flm = random_flm(bandlimit, 2)
            coefficients = transform.analysis_harmonic(flm)
            name = str(bandlimit if over == "L" else directions)
            forward[name] = partial(transform.analysis_harmonic, flm)
            backward[name] = partial(transform.synthesis_harmonic, coefficients)
        what = {"over": over, "L": pairs[0][0], "N": pairs[0][1], "threads": 1}
        yield compare(forward, plan, direction="harmonic to wavelet", **what)
        yield compare(backward, plan, direction="wavelet to harmonic", **what)
