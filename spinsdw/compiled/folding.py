"""Fourier columns on rings that have fewer points than the series has terms, and a first longitude.

On a ring of P points starting at phi_0, F_m e^{i m phi} is seen as mode m modulo P with the factor
e^{i m phi_0}. Columns are complex arrays [map, m, ring], -m at place n_m - m; of folded rings ring
r of map i has its modes from ``starts[i, r]`` on, 0 .. P - 1, or 0 .. P / 2 for real maps, whose
mode -k is the conjugate of k.

Orders are taken a few at a time: columns are read along rings and folded rings written along
orders, and both stay in the first-level cache. Orders from ``limits[r]`` on are none of the ring's:
they are neither read nor written.

Rings that are all of different lengths are not folded here: `split_orders` hands their orders to a
Fourier transform that folds them itself.
"""

from __future__ import annotations

import math

import numpy as np

from spinsdw.compiled.jit import inner, kernel

__all__ = ["fill_folded", "fill_unfolded", "join_orders", "split_orders"]

_STRIDE = 64


@inner
def _largest(values):
    found = 0
    for value in values:
        found = max(found, value)
    return found


@inner
def _fill_steps(phis, steps):
    """steps[r, t] = e^{i t phis[r]}; rings next but one, or neighbours, may share theirs."""
    for r in range(phis.size):
        like = -1
        for other in range(max(r - 2, 0), r):
            if phis[other] == phis[r]:
                like = other
        for t in range(_STRIDE):
            if like >= 0:
                steps[r, t] = steps[like, t]
            else:
                steps[r, t] = complex(math.cos(t * phis[r]), math.sin(t * phis[r]))


@inner
def _prepare_phases(m, r, phis, steps, held, phases):
    """Return where phases[., t] = e^{i (m + t) phis[r]}, one product away from sine and cosine.

    The last two longitudes are held: every other ring of the belt has the same.
    """
    phi = phis[r]
    if held[0] == phi:
        return 0
    if held[1] == phi:
        return 1
    place = int(held[2])
    base = complex(math.cos(m * phi), math.sin(m * phi))
    for t in range(_STRIDE):
        phases[place, t] = base * steps[r, t]
    held[place] = phi
    held[2] = 1 - place
    return place


@inner
def _add_modes(first, stop, i, ring, points, phases, place, columns, start, folded):
    """Add orders first <= m < stop and -m of one ring to its modes."""
    n_m = columns.shape[1]
    k = first % points
    for m in range(first, stop):
        phase = phases[place, m - first]
        opposite = points - k if k > 0 else 0
        folded[start + k] += phase * columns[i, m, ring]
        folded[start + opposite] += phase.conjugate() * columns[i, n_m - m, ring]
        k = k + 1 if k + 1 < points else 0


@inner
def _add_real_modes(first, stop, i, ring, points, phases, place, columns, start, folded):
    """Add F e^{i k phi} and its conjugate to the half series of one ring."""
    if 2 * stop <= points:
        for m in range(first, stop):
            folded[start + m] = phases[place, m - first] * columns[i, m, ring]
        return
    k = first % points
    for m in range(first, stop):
        value = phases[place, m - first] * columns[i, m, ring]
        if k == 0 or 2 * k == points:
            folded[start + k] += 2.0 * value.real
        elif 2 * k < points:
            folded[start + k] += value
        else:
            folded[start + points - k] += value.conjugate()
        k = k + 1 if k + 1 < points else 0


@kernel
def fill_folded(columns, rings, sizes, phis, limits, starts, is_real, folded):
    """Fold the columns of some rings."""
    steps = np.empty((rings.size, _STRIDE), dtype=np.complex128)
    phases = np.empty((2, _STRIDE), dtype=np.complex128)
    held = np.zeros(3)
    _fill_steps(phis, steps)
    folded[:] = 0.0
    for r in range(rings.size):
        for i in range(columns.shape[0]):
            value = columns[i, 0, rings[r]]
            folded[starts[i, r]] += value.real if is_real else value
    for first in range(1, _largest(limits), _STRIDE):
        held[0] = held[1] = np.nan
        for r in range(rings.size):
            stop, ring, points = min(first + _STRIDE, limits[r]), rings[r], sizes[r]
            place = _prepare_phases(first, r, phis, steps, held, phases) if stop > first else 0
            for i in range(columns.shape[0]):
                start = starts[i, r]
                if is_real:
                    _add_real_modes(
                        first, stop, i, ring, points, phases, place, columns, start, folded
                    )
                else:
                    _add_modes(first, stop, i, ring, points, phases, place, columns, start, folded)


@inner
def _take_modes(first, stop, i, ring, points, phases, place, start, folded, columns):
    n_m = columns.shape[1]
    k = first % points
    for m in range(first, stop):
        phase = phases[place, m - first]
        opposite = points - k if k > 0 else 0
        columns[i, m, ring] = phase.conjugate() * folded[start + k]
        columns[i, n_m - m, ring] = phase * folded[start + opposite]
        k = k + 1 if k + 1 < points else 0


@inner
def _take_real_modes(first, stop, i, ring, points, phases, place, start, folded, columns):
    k = first % points
    for m in range(first, stop):
        value = folded[start + points - k].conjugate() if 2 * k > points else folded[start + k]
        columns[i, m, ring] = phases[place, m - first].conjugate() * value
        k = k + 1 if k + 1 < points else 0


@kernel
def fill_unfolded(folded, rings, sizes, phis, limits, starts, is_real, columns):
    """Adjoint of `fill_folded`, the conjugate half of a real map left out."""
    steps = np.empty((rings.size, _STRIDE), dtype=np.complex128)
    phases = np.empty((2, _STRIDE), dtype=np.complex128)
    held = np.zeros(3)
    _fill_steps(phis, steps)
    for r in range(rings.size):
        for i in range(columns.shape[0]):
            columns[i, 0, rings[r]] = folded[starts[i, r]]
    for first in range(1, _largest(limits), _STRIDE):
        held[0] = held[1] = np.nan
        for r in range(rings.size):
            stop, ring, points = min(first + _STRIDE, limits[r]), rings[r], sizes[r]
            place = _prepare_phases(first, r, phis, steps, held, phases) if stop > first else 0
            for i in range(columns.shape[0]):
                start = starts[i, r]
                if is_real:
                    _take_real_modes(
                        first, stop, i, ring, points, phases, place, start, folded, columns
                    )
                else:
                    _take_modes(first, stop, i, ring, points, phases, place, start, folded, columns)


@kernel
def split_orders(columns, rings, limits, is_real, orders):
    """Fill orders[., r, m] of the real maps that some rings of columns hold.

    A real map is one of them; a complex one two, its real and its imaginary part.
    """
    n_m = columns.shape[1]
    for i in range(columns.shape[0]):
        for m in range(orders.shape[2]):
            for r in range(rings.size):
                value, opposite = 0.0j, 0.0j
                if m < limits[r]:
                    value = columns[i, m, rings[r]]
                    opposite = columns[i, (n_m - m) % n_m, rings[r]].conjugate()
                if is_real:
                    orders[i, r, m] = value if m > 0 else complex(value.real, 0.0)
                else:
                    orders[2 * i, r, m] = 0.5 * (value + opposite)
                    orders[2 * i + 1, r, m] = -0.5j * (value - opposite)


@kernel
def join_orders(orders, rings, limits, is_real, columns):
    """Fill some rings of columns from the orders of their real maps: adjoint of `split_orders`."""
    n_m = columns.shape[1]
    for i in range(columns.shape[0]):
        for m in range(orders.shape[2]):
            for r in range(rings.size):
                if m >= limits[r]:
                    continue
                if is_real:
                    columns[i, m, rings[r]] = orders[i, r, m]
                else:
                    value, other = orders[2 * i, r, m], 1j * orders[2 * i + 1, r, m]
                    columns[i, m, rings[r]] = value + other
                    if m > 0:
                        columns[i, n_m - m, rings[r]] = (value - other).conjugate()
