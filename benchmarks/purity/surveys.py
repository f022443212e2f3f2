"""The four masks that every method is judged on, at any resolution."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from spinsdw.footprints import disc_holes, random_discs, rectangle_mask, wavy_cut
from spinsdw.healpix import pixel_directions
from spinsdw.masks import cap_mask

__all__ = ["SURVEYS", "survey_mask"]

Array = np.ndarray

GALACTIC_SEED, HOLES_SEED, SHEAR_SEED = 1, 2, 3


def _radians(first: float, second: float) -> tuple[float, float]:
    return float(np.radians(first)), float(np.radians(second))


def _galactic(theta: Array, phi: Array) -> Array:
    latitude, amplitude = _radians(20, 3)
    cut = wavy_cut(theta, phi, latitude=latitude, amplitude=amplitude, seed=GALACTIC_SEED)
    # 150 on the sphere: about 100 of them on the observed 65 per cent.
    discs = random_discs(150, _radians(0.5, 1), seed=HOLES_SEED)
    return cut * disc_holes(theta, phi, *discs)


def _ground(theta: Array, phi: Array) -> Array:
    centre = _radians(147.5, 0)
    return cap_mask(theta, phi, centre=centre, radius=float(np.arccos(0.8)))


def _deep(theta: Array, phi: Array) -> Array:
    sides = {"longitude": _radians(20, 60), "latitude": _radians(-59.75, -30.25)}
    return rectangle_mask(theta, phi, **sides)


def _shear(theta: Array, phi: Array) -> Array:
    south = {"longitude": _radians(-60, 40), "latitude": _radians(-60, -5)}
    north = {"longitude": _radians(130, 190), "latitude": _radians(10, 40)}
    lost = {"longitude": _radians(-25, -20), "latitude": _radians(-40, -5)}
    one, other, gap = (rectangle_mask(theta, phi, **box) for box in (south, north, lost))
    # 1300 on the sphere: about 190 on the survey.
    discs = random_discs(1300, _radians(0.4, 0.8), seed=SHEAR_SEED)
    return (one + other) * (1 - gap) * disc_holes(theta, phi, *discs)


SURVEYS: dict[str, tuple[str, Callable[[Array, Array], Array]]] = {
    "A": ("galactic cut of 20°, wavy, with holes of 0.5° to 1° radius", _galactic),
    "B": ("ground-based cap", _ground),
    "C": ("deep rectangle with sharp corners", _deep),
    "D": ("cosmic shear: two fields, a gap, holes of 0.4° to 0.8° radius", _shear),
}


@functools.cache
def survey_mask(name: str, nside: int) -> Array:
    """Return mask A, B, C or D: 1 or 0, HEALPix ring order, the same sky at every resolution."""
    mask = SURVEYS[name][1](*pixel_directions(nside))
    mask.setflags(write=False)
    return mask
