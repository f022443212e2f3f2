"""The timed jobs beyond the grids of the wavelets: rotations, arbitrary points, other samplings."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from plans import Plan
from speed import SIGNALS, Calls, Row, compare, random_flm

import peers
from spinsdw.rotation import rotate_flm
from spinsdw.spin_transform import SpinHarmonicTransform

__all__ = ["geometry"]

Array = np.ndarray[Any, Any]

ROTATION = (0.3, 1.1, 0.7)
ACCURACY = 1e-12
# Points all over the sphere, twice as many as a grid has.
POINTS = 4
# More points than those of this take minutes.
MOST_BANDLIMIT = 1024


def geometry(plan: Plan) -> Iterator[Row]:
    """Rotations, synthesis at 4 L^2 random points and its adjoint, and Gauss-Legendre rings."""
    for bandlimit in (one for one in plan.bandlimits if one <= MOST_BANDLIMIT):
        for signal, spin, real in SIGNALS:
            for count in plan.threads:
                transform = SpinHarmonicTransform(
                    bandlimit, spin, sampling="gl", real=real, threads=count
                )
                yield from _rows(transform, plan, signal=signal, L=bandlimit, threads=count)


def _rows(transform: SpinHarmonicTransform, plan: Plan, **what: Any) -> Iterator[Row]:
    flm = random_flm(transform.bandlimit, transform.spin, real=transform.real)
    for direction, calls in {
        "rotation": _rotations(transform, flm, what["threads"]),
        **_points(transform, flm, what["threads"]),
        "synthesis, Gauss-Legendre": {
            "spinsdw": partial(transform.synthesis, flm),
            "ducc0": peers.ducc0_synthesis(transform, flm, threads=what["threads"]),
        },
        "analysis, Gauss-Legendre": _analyses(transform, flm, what["threads"]),
    }.items():
        yield compare(calls, plan, direction=direction, **what)


def _rotations(transform: SpinHarmonicTransform, flm: Array, threads: int) -> Calls:
    return {
        "spinsdw": partial(rotate_flm, flm, ROTATION, real=transform.real, threads=threads),
        "ducc0": peers.ducc0_rotation(transform, flm, ROTATION, threads=threads),
    }


def _points(transform: SpinHarmonicTransform, flm: Array, threads: int) -> dict[str, Calls]:
    rng = np.random.default_rng(0)
    size = POINTS * transform.bandlimit**2
    theta, phi = np.arccos(rng.uniform(-1, 1, size)), rng.uniform(0, 2 * np.pi, size)
    values = transform.synthesis_at(flm, theta, phi, accuracy=ACCURACY)
    there = partial(transform.synthesis_at, flm, theta, phi, accuracy=ACCURACY)
    back = partial(transform.adjoint_synthesis_at, values, theta, phi, accuracy=ACCURACY)
    points = np.stack([theta, phi], axis=-1)
    where = (points, ACCURACY)
    return {
        "synthesis at points": {
            "spinsdw": there,
            "ducc0": peers.ducc0_points(transform, flm, *where, threads=threads),
        },
        "adjoint synthesis at points": {
            "spinsdw": back,
            "ducc0": peers.ducc0_adjoint_points(transform, values, *where, threads=threads),
        },
    }


def _analyses(transform: SpinHarmonicTransform, flm: Array, threads: int) -> Calls:
    maps = transform.synthesis(flm)
    return {
        "spinsdw": partial(transform.analysis, maps),
        "ducc0": peers.ducc0_analysis(transform, maps, threads=threads),
    }
