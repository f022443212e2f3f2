"""Fourier series of rings that have fewer points than the series has terms, and a first longitude.

On a ring of P points starting at phi_0, F_m e^{i m phi} is seen as mode m modulo P with the factor
e^{i m phi_0}. Half series (real maps) hold modes 0 .. P/2: mode -k is the conjugate of mode k.
"""

from __future__ import annotations

import math

import numpy as np

from spinsdw.compiled.jit import kernel

__all__ = ["fill_half_rings", "fill_half_unfolded", "fill_rings", "fill_unfolded"]

_STRIDE = 32


@kernel
def _fill_phases(L, phi, phases):
    """phases[m] = e^{i m phi}, one product away from sine and cosine: no error grows with m."""
    steps = np.empty(_STRIDE, dtype=np.complex128)
    for t in range(_STRIDE):
        steps[t] = complex(math.cos(t * phi), math.sin(t * phi))
    for first in range(0, L, _STRIDE):
        base = complex(math.cos(first * phi), math.sin(first * phi))
        for t in range(min(_STRIDE, L - first)):
            phases[first + t] = base * steps[t]


@kernel
def fill_rings(L, spectra, first_ring, phi, rings):
    """rings[r, k] = sum over m = k modulo P of e^{i m phi} spectra[first_ring + r, m], +-m."""
    phases = np.empty(L, dtype=np.complex128)
    if phi != 0.0:
        _fill_phases(L, phi, phases)
    n_m, points = spectra.shape[1], rings.shape[1]
    for r in range(rings.shape[0]):
        row, out = spectra[first_ring + r], rings[r]
        out[:] = 0.0
        for m in range(L):
            phase = phases[m] if phi != 0.0 else 1.0 + 0.0j
            out[m % points] += phase * row[m]
            if m > 0:
                out[(points - m % points) % points] += phase.conjugate() * row[n_m - m]


@kernel
def fill_half_rings(L, spectra, first_ring, phi, rings):
    """As `fill_rings` for a real map: spectra hold m >= 0, rings modes 0 .. P/2 of ``points``."""
    phases = np.empty(L, dtype=np.complex128)
    if phi != 0.0:
        _fill_phases(L, phi, phases)
    points = 2 * (rings.shape[1] - 1)
    for r in range(rings.shape[0]):
        row, out = spectra[first_ring + r], rings[r]
        out[:] = 0.0
        out[0] = row[0].real
        for m in range(1, L):
            value = phases[m] * row[m] if phi != 0.0 else row[m]
            k = m % points
            if k in (0, points // 2):
                out[k] += 2.0 * value.real
            elif k < points // 2:
                out[k] += value
            else:
                out[points - k] += value.conjugate()


@kernel
def fill_unfolded(L, rings, first_ring, phi, columns):
    """Adjoint of `fill_rings`, into columns[m, first_ring + r]."""
    phases = np.empty(L, dtype=np.complex128)
    if phi != 0.0:
        _fill_phases(L, phi, phases)
    n_m, points = columns.shape[0], rings.shape[1]
    for m in range(L):
        phase = phases[m].conjugate() if phi != 0.0 else 1.0 + 0.0j
        k = m % points
        for r in range(rings.shape[0]):
            columns[m, first_ring + r] = phase * rings[r, k]
            if m > 0:
                value = phase.conjugate() * rings[r, (points - k) % points]
                columns[n_m - m, first_ring + r] = value


@kernel
def fill_half_unfolded(L, rings, first_ring, phi, columns):
    """As `fill_unfolded` for a real map, m >= 0 only."""
    phases = np.empty(L, dtype=np.complex128)
    if phi != 0.0:
        _fill_phases(L, phi, phases)
    points = 2 * (rings.shape[1] - 1)
    for m in range(L):
        phase = phases[m].conjugate() if phi != 0.0 else 1.0 + 0.0j
        k = m % points
        for r in range(rings.shape[0]):
            value = rings[r, k] if k <= points // 2 else rings[r, points - k].conjugate()
            columns[m, first_ring + r] = phase * value
