"""Moving Fourier series between rings and columns, and columns onto the full circle in theta."""

from __future__ import annotations

from spinsdw.compiled.jit import kernel

__all__ = ["fill_circles", "fill_columns", "fill_folded"]


@kernel
def fill_columns(series, mixing, first_ring, columns):
    """columns[i, m, first_ring + r] = sum_k mixing[i, k] series[k, r, m]."""
    n_in, n_rings, n_m = series.shape
    n_out = columns.shape[0]
    for m in range(n_m):
        for i in range(n_out):
            for r in range(n_rings):
                value = 0.0j
                for k in range(n_in):
                    value += mixing[i, k] * series[k, r, m]
                columns[i, m, first_ring + r] = value


@kernel
def fill_circles(even, odd, parity, offset, circles):
    """Put an even-m and an odd-m column on one full circle: they have opposite parity in theta.

    F_m(-theta) = (-1)^(m + n) F_m(theta); ``parity`` is that sign for even m. Ring t mirrors to
    ``size - offset - t`` modulo size: offset 1 on MW, 0 on MWSS.
    """
    size = circles.shape[1]
    for j in range(circles.shape[0]):
        for t in range(even.shape[1]):
            mirror = (size - offset - t) % size
            if mirror == t:
                # A pole: the odd-parity function vanishes there.
                circles[j, t] = even[j, t] if parity > 0 else odd[j, t]
            else:
                circles[j, t] = even[j, t] + odd[j, t]
                circles[j, mirror] = parity * (even[j, t] - odd[j, t])


@kernel
def fill_folded(circles, parity, offset, even, odd):
    """Transpose of `fill_circles`."""
    size = circles.shape[1]
    for j in range(circles.shape[0]):
        for t in range(even.shape[1]):
            mirror = (size - offset - t) % size
            if mirror == t:
                even[j, t] = circles[j, t] if parity > 0 else 0.0
                odd[j, t] = 0.0 if parity > 0 else circles[j, t]
            else:
                there = parity * circles[j, mirror]
                even[j, t] = circles[j, t] + there
                odd[j, t] = circles[j, t] - there
