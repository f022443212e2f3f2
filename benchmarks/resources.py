"""The jobs that measure something else than speed: memory, accuracy, start-up."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from plans import Plan
from speed import SIGNALS, random_flm

import peers
from spinsdw.parallel import resolve_threads
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["accuracy", "memory", "startup"]

Array = np.ndarray[Any, Any]
Row = dict[str, Any]

CHILDREN = Path(__file__).with_name("children.py")


def _in_child(name: str, argument: object, **environment: str) -> dict[str, Any]:
    """Run one function of `children` in a process of its own."""
    found = subprocess.run(
        [sys.executable, str(CHILDREN), name, json.dumps(argument)],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    )
    result: dict[str, Any] = json.loads(found.stdout)
    return result


def memory(plan: Plan) -> Iterator[Row]:
    """Peak growth of a process over one transform of a spin-2 signal; all threads of the plan."""
    has_types = hasattr(SpinWaveletTransform, "dtype")
    for dtype in ("complex128", "complex64") if has_types else ("complex128",):
        for bandlimit, directions in plan.memory:
            for direction in ("harmonic to wavelet", "wavelet to harmonic"):
                case = {"L": bandlimit, "N": directions, "threads": max(plan.threads)}
                case["direction"] = direction
                argument = {**case, "dtype": dtype} if has_types else case
                # Once for the machine code alone: a compiler's memory would count as ours.
                _in_child("memory", {**argument, "L": 8})
                yield {**case, "dtype": dtype, **_in_child("memory", argument)}


def _worst(found: Array, desired: Array) -> dict[str, float]:
    """Return the largest and the root-mean-square error, relative to the largest value."""
    error, scale = np.abs(found - desired), float(np.max(np.abs(desired)))
    return {"largest": float(error.max()) / scale, "rms": float(np.sqrt(np.mean(error**2))) / scale}


def _round_trips(bandlimit: int, spin: int, *, real: bool) -> Iterator[tuple[str, Array, Array]]:
    """Yield what was done, what came back and what should have."""
    count = resolve_threads(None)
    flm = random_flm(bandlimit, spin, real=real)
    harmonic = SpinHarmonicTransform(bandlimit, spin, real=real)
    yield "spin transform", harmonic.analysis(harmonic.synthesis(flm)), flm
    maps = peers.ducc0_synthesis(harmonic, flm, threads=count)()
    maps = maps[0] if real else maps[0] + 1j * maps[1]
    back = peers.ducc0_analysis(harmonic, maps, threads=count)()
    yield "spin transform, ducc0", back, peers.pack_flm(flm, spin)[: 1 if real else 2]
    del maps
    wavelet = SpinWaveletTransform(bandlimit, spin, 3, real=real)
    yield "wavelets, N = 3", wavelet.synthesis_harmonic(wavelet.analysis_harmonic(flm)), flm


def accuracy(plan: Plan) -> Iterator[Row]:
    """How far a round trip comes back from where it started."""
    for bandlimit in plan.bandlimits:
        for signal, spin, real in SIGNALS:
            for what, found, desired in _round_trips(bandlimit, spin, real=real):
                errors = _worst(found, desired)
                yield {"what": what, "signal": signal, "L": bandlimit, **errors}


def startup(plan: Plan) -> Iterator[Row]:
    """Seconds to import and to a first transform: cache of machine code empty, then filled."""
    size = min(64, max(plan.bandlimits))
    with tempfile.TemporaryDirectory() as folder:
        for cache in ("empty", "filled"):
            seconds = _in_child("startup", size, SPINSDW_CACHE=folder)
            yield {"cache": cache, "L": size, **seconds}
