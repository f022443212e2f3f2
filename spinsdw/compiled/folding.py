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
def _fill_ring_phases(phis, row, phases):
    """phases[m, r] = e^{i m phis[r]}; neighbouring rings of the belt share theirs."""
    for r in range(phis.size):
        if r > 1 and phis[r] == phis[r - 2]:
            for m in range(row.size):
                phases[m, r] = phases[m, r - 2]
        else:
            _fill_phases(phis[r], row)
            for m in range(row.size):
                phases[m, r] = row[m]


@kernel
def _next_modes(sizes, modes):
    """Count m modulo the points of each ring: a division for each would cost more than the sum."""
    for r in range(sizes.size):
        modes[r] += 1
        if modes[r] == sizes[r]:
            modes[r] = 0


@kernel
def _add_real_mode(value, k, points, out, start):
    """Add F e^{i k phi} and its conjugate to a half series, 0 <= k < points."""
    if k == 0 or 2 * k == points:
        out[start + k] += 2.0 * value.real
    elif 2 * k < points:
        out[start + k] += value
    else:
        out[start + points - k] += value.conjugate()


@kernel
def fill_folded(L, columns, first_ring, sizes, phis, starts, is_real, folded):
    """Fold the columns of sizes.size rings from first_ring on; ring r begins at starts[r]."""
    n_m, n_rings = columns.shape[0], sizes.size
    phases = np.empty((L, n_rings), dtype=np.complex128)
    _fill_ring_phases(phis, np.empty(L, dtype=np.complex128), phases)
    modes = np.zeros(n_rings, dtype=np.int64)
    folded[:] = 0.0
    for r in range(n_rings):
        value = columns[0, first_ring + r]
        folded[starts[r]] += value.real if is_real else value
    for m in range(1, L):
        _next_modes(sizes, modes)
        for r in range(n_rings):
            k, phase = modes[r], phases[m, r]
            value = phase * columns[m, first_ring + r]
            if is_real:
                _add_real_mode(value, k, sizes[r], folded, starts[r])
            else:
                opposite = sizes[r] - k if k > 0 else 0
                folded[starts[r] + k] += value
                value = phase.conjugate() * columns[n_m - m, first_ring + r]
                folded[starts[r] + opposite] += value


@kernel
def fill_unfolded(L, folded, first_ring, sizes, phis, starts, is_real, columns):
    """Adjoint of `fill_folded`, the conjugate half of a real map left out."""
    n_m, n_rings = columns.shape[0], sizes.size
    phases = np.empty((L, n_rings), dtype=np.complex128)
    _fill_ring_phases(phis, np.empty(L, dtype=np.complex128), phases)
    modes = np.zeros(n_rings, dtype=np.int64)
    for r in range(n_rings):
        columns[0, first_ring + r] = folded[starts[r]]
    for m in range(1, L):
        _next_modes(sizes, modes)
        for r in range(n_rings):
            k, phase = modes[r], phases[m, r]
            opposite = sizes[r] - k if k > 0 else 0
            if is_real and 2 * k > sizes[r]:
                value = folded[starts[r] + opposite].conjugate()
            else:
                value = folded[starts[r] + k]
            columns[m, first_ring + r] = phase.conjugate() * value
            if not is_real:
                columns[n_m - m, first_ring + r] = phase * folded[starts[r] + opposite]
