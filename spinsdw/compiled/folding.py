"""Fourier columns on rings that have fewer points than the series has terms, and a first longitude.

On a ring of P points starting at phi_0, F_m e^{i m phi} is seen as mode m modulo P with the factor
e^{i m phi_0}. Columns are complex arrays [m, ring], -m at place n_m - m; folded rings lie one after
the other, with modes 0 .. P - 1, or 0 .. P / 2 for real maps, whose mode -k is the conjugate of k.
"""

from __future__ import annotations

import math

import numpy as np

from spinsdw.compiled.jit import kernel

__all__ = ["fill_folded", "fill_unfolded"]

_STRIDE = 32


@kernel
def _fill_phases(phi, phases):
    """phases[m] = e^{i m phi}, one product away from sine and cosine: no error grows with m."""
    steps = np.empty(_STRIDE, dtype=np.complex128)
    for t in range(_STRIDE):
        steps[t] = complex(math.cos(t * phi), math.sin(t * phi))
    for first in range(0, phases.size, _STRIDE):
        base = complex(math.cos(first * phi), math.sin(first * phi))
        for t in range(min(_STRIDE, phases.size - first)):
            phases[first + t] = base * steps[t]


@kernel
def _fill_ring_phases(phis, phases):
    for r in range(phis.size):
        if r > 1 and phis[r] == phis[r - 2]:
            phases[r] = phases[r - 2]
        else:
            _fill_phases(phis[r], phases[r])


@kernel
def _add_mode(value, k, points, is_real, out):
    """Add F e^{i k phi}, 0 <= k < points; of a real map also its conjugate, once."""
    if not is_real:
        out[k] += value
    elif k in (0, points // 2):
        out[k] += 2.0 * value.real
    elif k < points // 2:
        out[k] += value
    else:
        out[points - k] += value.conjugate()


@kernel
def fill_folded(L, columns, first_ring, sizes, phis, starts, is_real, folded):
    """Fold the columns of sizes.size rings from first_ring on; ring r begins at starts[r]."""
    n_m, n_rings = columns.shape[0], sizes.size
    phases = np.empty((n_rings, L), dtype=np.complex128)
    _fill_ring_phases(phis, phases)
    folded[:] = 0.0
    for m in range(L):
        for r in range(n_rings):
            points = sizes[r]
            out = folded[starts[r] :]
            value = columns[m, first_ring + r]
            if m == 0:
                out[0] += value.real if is_real else value
            else:
                _add_mode(phases[r, m] * value, m % points, points, is_real, out)
                if not is_real:
                    value = phases[r, m].conjugate() * columns[n_m - m, first_ring + r]
                    _add_mode(value, (points - m % points) % points, points, is_real, out)


@kernel
def _mode(k, points, is_real, values):
    if is_real and k > points // 2:
        return values[points - k].conjugate()
    return values[k]


@kernel
def fill_unfolded(L, folded, first_ring, sizes, phis, starts, is_real, columns):
    """Adjoint of `fill_folded`, the conjugate half of a real map left out."""
    n_m, n_rings = columns.shape[0], sizes.size
    phases = np.empty((n_rings, L), dtype=np.complex128)
    _fill_ring_phases(phis, phases)
    for m in range(L):
        for r in range(n_rings):
            points, phase = sizes[r], phases[r, m]
            values = folded[starts[r] :]
            k = m % points
            columns[m, first_ring + r] = phase.conjugate() * _mode(k, points, is_real, values)
            if m > 0 and not is_real:
                columns[n_m - m, first_ring + r] = phase * values[(points - k) % points]
