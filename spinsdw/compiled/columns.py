"""Fourier columns F_m(theta): mixed from one set to another, and laid on the full circle in theta.

Columns are complex arrays [k, m, ring].
"""

from __future__ import annotations

import numpy as np

from spinsdw.compiled.jit import inner, kernel

__all__ = ["fill_circles", "fold_circles", "join_circles", "mix_columns", "split_circles"]


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


@inner
def _mix_column(mixing, i, columns, m, mixed):
    """Fill mixed = sum_k mixing[i, k] columns[k, m]; zero for m = -1."""
    mixed[:] = 0.0
    if m >= 0:
        for k in range(mixing.shape[1]):
            factor = mixing[i, k]
            source = columns[k, m]
            for t in range(mixed.size):
                mixed[t] += factor * source[t]


@kernel
def fill_circles(columns, mixing, even, odd, parities, offset, circles):
    """Put an even-m and an odd-m column on one full circle: they have opposite parity in theta.

    circles[i, j] holds sum_k mixing[i, k] of columns even[j] and odd[j] (-1: none) of row k. On it
    F_m(-theta) = (-1)^(m + n) F_m(theta); parities[i] is that sign for even m. Ring t mirrors to
    ``size - offset - t``: offset 1 on MW, whose last ring is a pole, 0 on MWSS, whose first is too.
    """
    size, n_rings = circles.shape[2], columns.shape[2]
    first = np.empty(n_rings, dtype=np.complex128)
    second = np.empty(n_rings, dtype=np.complex128)
    for i in range(circles.shape[0]):
        parity = parities[i]
        for j in range(circles.shape[1]):
            out = circles[i, j]
            _mix_column(mixing, i, columns, even[j], first)
            _mix_column(mixing, i, columns, odd[j], second)
            for t in range(1 - offset, n_rings - 1):
                out[t] = first[t] + second[t]
                out[size - offset - t] = parity * (first[t] - second[t])
            # At a pole the odd-parity function vanishes.
            pole = first if parity > 0 else second
            out[n_rings - 1] = pole[n_rings - 1]
            if offset == 0:
                out[0] = pole[0]


@kernel
def fold_circles(circles, weights, shifted, even, odd, parities, offset, columns):
    """Transpose of `fill_circles` without mixing, of weights * circles + shifted.

    Circles of index i go to row i of the columns; what is left in ``circles`` is of no use.
    """
    size, n_rings = circles.shape[2], columns.shape[2]
    spare = np.empty(n_rings, dtype=columns.dtype)
    for i in range(circles.shape[0]):
        parity = parities[i]
        for j in range(circles.shape[1]):
            values, more = circles[i, j], shifted[i, j]
            for t in range(size):
                values[t] = weights[t] * values[t] + more[t]
            first = columns[i, even[j]] if even[j] >= 0 else spare
            for t in range(1 - offset, n_rings - 1):
                first[t] = values[t] + parity * values[size - offset - t]
            second = columns[i, odd[j]] if odd[j] >= 0 else spare
            for t in range(1 - offset, n_rings - 1):
                second[t] = values[t] - parity * values[size - offset - t]
            for t in (0, n_rings - 1) if offset == 0 else (n_rings - 1, n_rings - 1):
                if even[j] >= 0:
                    columns[i, even[j], t] = values[t] if parity > 0 else 0.0j
                if odd[j] >= 0:
                    columns[i, odd[j], t] = 0.0j if parity > 0 else values[t]


@kernel
def split_circles(circles, weights, rows, parities, offset, shift, fine):
    """Give every second ring of the fine rows its weighted value: the others are half a step on.

    fine[i] has the columns of even m in rows[0] and of odd m in rows[1] (-1: none), which a circle
    holds together (`fill_circles`). ``shift`` is 1 for circles half a step on. Ring 2 t + offset +
    shift is point t, and point size - offset - shift - t is at minus its colatitude.
    """
    size = circles.shape[2]
    spare = np.empty(size + 1, dtype=np.complex128)
    start = offset + shift
    for i in range(circles.shape[0]):
        parity = parities[i]
        for j in range(circles.shape[1]):
            values = circles[i, j]
            even = fine[i, rows[0, j]] if rows[0, j] >= 0 else spare
            odd = fine[i, rows[1, j]] if rows[1, j] >= 0 else spare
            for t in range(1 if start == 0 else 0, (size - start + 1) // 2):
                here, opposite = values[t], parity * values[size - start - t]
                even[2 * t + start] = weights[t] * (here + opposite)
                odd[2 * t + start] = weights[t] * (here - opposite)
            # At a pole the odd-parity function vanishes.
            for ring in (0, size):
                if (ring - start) % 2 == 0:
                    t = (ring - start) // 2 % size
                    value = weights[t] * values[t]
                    even[ring] = value if parity > 0 else 0.0j
                    odd[ring] = 0.0j if parity > 0 else value


@kernel
def join_circles(fine, weights, rows, parities, offset, shift, circles):
    """Transpose of `split_circles`."""
    size = circles.shape[2]
    nothing = np.zeros(size + 1, dtype=np.complex128)
    start = offset + shift
    for i in range(circles.shape[0]):
        parity = parities[i]
        for j in range(circles.shape[1]):
            values = circles[i, j]
            even = fine[i, rows[0, j]] if rows[0, j] >= 0 else nothing
            odd = fine[i, rows[1, j]] if rows[1, j] >= 0 else nothing
            for t in range(1 if start == 0 else 0, (size - start + 1) // 2):
                here, other = even[2 * t + start], odd[2 * t + start]
                values[t] = weights[t] * (here + other)
                values[size - start - t] = parity * weights[t] * (here - other)
            for ring in (0, size):
                if (ring - start) % 2 == 0:
                    t = (ring - start) // 2 % size
                    values[t] = weights[t] * (even[ring] if parity > 0 else odd[ring])
