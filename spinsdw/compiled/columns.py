"""Fourier columns F_m(theta): mixed from one set to another, and laid on the full circle in theta.

Columns are complex arrays [k, m, ring].
"""

from __future__ import annotations

import numpy as np

from spinsdw.compiled.jit import kernel

__all__ = ["fill_circles", "fold_circles", "mix_columns"]


@kernel
def mix_columns(mixing, first_m, stop_m, columns):
    """columns[i, m] <- sum_k mixing[i, k] columns[k, m], in place for first_m <= m < stop_m."""
    n_out, n_in = mixing.shape
    values = np.empty(n_in, dtype=np.complex128)
    for m in range(first_m, stop_m):
        for r in range(columns.shape[2]):
            for k in range(n_in):
                values[k] = columns[k, m, r]
            for i in range(n_out):
                value = 0.0j
                for k in range(n_in):
                    value += mixing[i, k] * values[k]
                columns[i, m, r] = value


@kernel
def fill_circles(columns, mixing, even, odd, parities, offset, circles):
    """Put an even-m and an odd-m column on one full circle: they have opposite parity in theta.

    circles[i, j] holds sum_k mixing[i, k] of columns even[j] and odd[j] (-1: none) of row k. On it
    F_m(-theta) = (-1)^(m + n) F_m(theta); parities[i] is that sign for even m. Ring t mirrors to
    ``size - offset - t`` modulo size: offset 1 on MW, 0 on MWSS.
    """
    size, n_rings = circles.shape[2], columns.shape[2]
    for i in range(circles.shape[0]):
        parity = parities[i]
        for j in range(circles.shape[1]):
            out = circles[i, j]
            for t in range(n_rings):
                first, second = 0.0j, 0.0j
                for k in range(mixing.shape[1]):
                    factor = mixing[i, k]
                    if even[j] >= 0:
                        first += factor * columns[k, even[j], t]
                    if odd[j] >= 0:
                        second += factor * columns[k, odd[j], t]
                mirror = (size - offset - t) % size
                if mirror == t:
                    # A pole: the odd-parity function vanishes there.
                    out[t] = first if parity > 0 else second
                else:
                    out[t] = first + second
                    out[mirror] = parity * (first - second)


@kernel
def fold_circles(circles, even, odd, parities, offset, columns):
    """Transpose of `fill_circles` without mixing: circles[i] goes to row i of the columns."""
    size, n_rings = circles.shape[2], columns.shape[2]
    for i in range(circles.shape[0]):
        parity = parities[i]
        for j in range(circles.shape[1]):
            values = circles[i, j]
            for t in range(n_rings):
                mirror = (size - offset - t) % size
                if mirror == t:
                    first = values[t] if parity > 0 else 0.0j
                    second = 0.0j if parity > 0 else values[t]
                else:
                    first = values[t] + parity * values[mirror]
                    second = values[t] - parity * values[mirror]
                if even[j] >= 0:
                    columns[i, even[j], t] = first
                if odd[j] >= 0:
                    columns[i, odd[j], t] = second
