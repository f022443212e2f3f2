"""Normalised integrals of the bump ``exp(-c / (1 - y**2))``, to the last digits."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from spinsdw.tiling.base import FloatArray, read_only

__all__ = ["bump_integrals"]

# Panels halve towards both ends, where the bump has essential singularities and the weight of a
# large dilation a pole close by.
_DISTANCES = 2.0 ** np.arange(-8, 1)
_PANELS = np.concatenate([[-1.0], _DISTANCES - 1.0, 1.0 - _DISTANCES[-2::-1], [1.0]])
_NODES = 24


@lru_cache(maxsize=1)
def _gauss_legendre() -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return read_only(0.5 * (nodes + 1)), read_only(0.5 * weights)


def _integrate(
    lower: FloatArray, upper: FloatArray, *, sharpness: float, slope: float
) -> FloatArray:
    """Integrate the weighted bump over intervals that each lie in one panel."""
    nodes, weights = _gauss_legendre()
    width = (upper - lower)[:, None]
    y = lower[:, None] + width * nodes
    # The floor only keeps an empty interval at an end from dividing by zero.
    distance = np.maximum((1 - y) * (1 + y), np.finfo(float).tiny)
    values = np.exp(-sharpness / distance) / (1 + slope * (1 + y))
    return np.asarray((width * values) @ weights)


def bump_integrals(
    x: FloatArray, *, sharpness: float, slope: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return the share of the bump that lies above each point, and the share below.

    Above is ``int_x^1 w(y) dy / int_{-1}^1 w(y) dy`` with
    ``w(y) = exp(-sharpness / (1 - y**2)) / (1 + slope * (1 + y))``; below is the rest. Composite
    Gauss-Legendre with errors near 1e-16. Each share keeps its leading digits where it is small,
    and the two add up to 1 to rounding.

    Parameters
    ----------
    x : ndarray, shape (n,), float64
        The points; the bump lives on (-1, 1), and a point outside has all of it on one side.
    sharpness : float
        Positive.
    slope : float
        Non-negative; 0 leaves the weight out.

    Returns
    -------
    above, below : ndarray, shape (n,), float64

    Examples
    --------
    >>> above, below = bump_integrals(np.array([-1.0, 0.0, 2.0]), sharpness=1.0)
    >>> above.round(12).tolist()
    [1.0, 0.5, 0.0]
    """
    inside = np.abs(x) < 1
    points = x[inside]
    whole = _integrate(_PANELS[:-1], _PANELS[1:], sharpness=sharpness, slope=slope)
    panel = np.searchsorted(_PANELS, points, side="right") - 1
    lower, upper = _PANELS[panel], _PANELS[panel + 1]
    part_below = np.concatenate([[0.0], np.cumsum(whole)])[panel]
    part_below += _integrate(lower, points, sharpness=sharpness, slope=slope)
    part_above = np.concatenate([np.cumsum(whole[::-1])[::-1], [0.0]])[panel + 1]
    part_above += _integrate(points, upper, sharpness=sharpness, slope=slope)
    above = np.where(x < 0, 1.0, 0.0)
    # The sum at this very point, so that quadrature errors do not break the partition of unity.
    above[inside] = part_above / (part_above + part_below)
    below = 1 - above
    below[inside] = part_below / (part_above + part_below)
    return above, below
