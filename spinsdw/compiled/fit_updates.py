"""Steps of conjugate gradients on stacks of maps and coefficients, each in one pass.

They are bound by memory: from plain array expressions each would read and write its arrays several
times, on one core. Maps and coefficients are arrays [i, k]; a call does a range of k of every i,
so that ranges can be shared among threads.
"""

from __future__ import annotations

import numpy as np

from spinsdw.compiled.jit import kernel

__all__ = ["add_multiples", "split_degrees", "subtract_weighted", "sum_products", "sum_weighted"]

# Sums run side by side: one would wait for each addition.
_LANES = 8


@kernel
def sum_weighted(first, stop, weights, values, sums):
    """sums[i] <- sum_k weights[k] |values[i, k]|^2, first <= k < stop."""
    lanes = np.empty(_LANES)
    even = first + (stop - first) // _LANES * _LANES
    for i in range(values.shape[0]):
        lanes[:] = 0.0
        for start in range(first, even, _LANES):
            for lane in range(_LANES):
                value = values[i, start + lane]
                power = value.real * value.real + value.imag * value.imag
                lanes[lane] += weights[start + lane] * power
        for k in range(even, stop):
            value = values[i, k]
            lanes[0] += weights[k] * (value.real * value.real + value.imag * value.imag)
        sums[i] = lanes.sum()


@kernel
def sum_products(first, stop, left, right, sums):
    """sums[i] <- Re sum_k left[i, k]* right[i, k], first <= k < stop."""
    lanes = np.empty(_LANES)
    even = first + (stop - first) // _LANES * _LANES
    for i in range(left.shape[0]):
        lanes[:] = 0.0
        for start in range(first, even, _LANES):
            for lane in range(_LANES):
                one, other = left[i, start + lane], right[i, start + lane]
                lanes[lane] += one.real * other.real + one.imag * other.imag
        for k in range(even, stop):
            one, other = left[i, k], right[i, k]
            lanes[0] += one.real * other.real + one.imag * other.imag
        sums[i] = lanes.sum()


@kernel
def subtract_weighted(first, stop, factors, weights, values, remainder):
    """remainder[i, k] <- remainder[i, k] - factors[i] weights[k] values[i, k]."""
    for i in range(values.shape[0]):
        factor = factors[i]
        for k in range(first, stop):
            remainder[i, k] -= factor * weights[k] * values[i, k]


@kernel
def add_multiples(first, stop, scales, factors, values, out):
    """out[i, k] <- scales[i] out[i, k] + factors[i] values[i, k]."""
    for i in range(values.shape[0]):
        scale, factor = scales[i], factors[i]
        for k in range(first, stop):
            out[i, k] = scale * out[i, k] + factor * values[i, k]


@kernel
def split_degrees(first, stop, own, mirrored, plm, out):
    """out_lm <- own_l p_lm + mirrored_l (-1)^m p*_{l,-m}, first <= l < stop; in place if wanted."""
    for i in range(plm.shape[0]):
        for el in range(first, stop):
            straight, crossed = own[el], mirrored[el]
            centre = el * el + el
            out[i, centre] = straight * plm[i, centre] + crossed * plm[i, centre].conjugate()
            for m in range(1, el + 1):
                sign = -crossed if m & 1 else crossed
                right, left = plm[i, centre + m], plm[i, centre - m]
                out[i, centre + m] = straight * right + sign * left.conjugate()
                out[i, centre - m] = straight * left + sign * right.conjugate()
