"""Sums over degrees for every ring, and their adjoints, for one block of rings at one (m, n).

A block passes three stages. While all its rings are out of range, the degree only advances; while
some are, the sums of the others are formed (in steps of `PADDING` degrees); once none is, one call
runs to the end. The columns c or g hold two real numbers for each complex series.
"""

from __future__ import annotations

from spinsdw.compiled.jit import kernel
from spinsdw.compiled.vectors import (
    ADJOINT_RINGS,
    RINGS,
    add_to_degrees_2,
    add_to_degrees_4,
    add_to_rings_2,
    add_to_rings_4,
    advance,
    advance_adjoint,
)
from spinsdw.compiled.wigner_recursion import PADDING, rescale

__all__ = ["add_block_to_degrees", "sum_block"]

_PAIRS = PADDING // 2


@kernel
def _clear_outside(scale, columns, sums):
    """Forget what rings out of range have collected: their u is scaled, so it was no sum."""
    for r in range(RINGS):
        if scale[r] < 0.0:
            for k in range(columns):
                sums[k * RINGS + r] = 0.0


@kernel
def _add_to_rings(columns, a, b, c, x, before, now, sums, first, pairs):
    if columns == 4:
        add_to_rings_4(a, b, c, x, before, now, sums, first, pairs)
    else:
        add_to_rings_2(a, b, c, x, before, now, sums, first, pairs)


@kernel
def sum_block(first, lowest, L, columns, a, b, c, x, before, now, scale, sums):
    """sums[k, r] = sum_{l=first}^{L-1} c[l, k] u_l(x_r); c is zero below ``lowest``."""
    for i in range(columns * RINGS):
        sums[i] = 0.0
    el = first
    inside = rescale(before, now, scale)
    while inside < RINGS and el < L:
        if inside == 0 or el + PADDING <= lowest:
            advance(a, b, c, x, before, now, sums, el, _PAIRS)
            inside = rescale(before, now, scale)
        else:
            _add_to_rings(columns, a, b, c, x, before, now, sums, el, _PAIRS)
            # Before rescaling: a ring that enters now was still out of range in this step.
            _clear_outside(scale, columns, sums)
            inside = rescale(before, now, scale)
        el += PADDING
    if el < lowest:
        pairs = (lowest - el) // 2
        advance(a, b, c, x, before, now, sums, el, pairs)
        el += 2 * pairs
    if el < L:
        _add_to_rings(columns, a, b, c, x, before, now, sums, el, (L - el + 1) // 2)


@kernel
def _mask_outside(scale, columns, g, masked):
    """Copy the block's columns with zeros where a ring is out of range."""
    for r in range(ADJOINT_RINGS):
        factor = 1.0 if scale[r] == 0.0 else 0.0
        for k in range(columns):
            masked[k * ADJOINT_RINGS + r] = factor * g[k * ADJOINT_RINGS + r]


@kernel
def _add_to_degrees(columns, a, b, g, x, before, now, sums, first, pairs):
    if columns == 4:
        add_to_degrees_4(a, b, g, x, before, now, sums, first, pairs)
    else:
        add_to_degrees_2(a, b, g, x, before, now, sums, first, pairs)


@kernel
def add_block_to_degrees(
    first, lowest, L, columns, a, b, g, masked, x, before, now, scale, sums
):
    """sums[l, k, lane] += sum_r g[k, r] u_l(x_r) over the rings of each lane, lowest <= l < L."""
    el = first
    inside = rescale(before, now, scale)
    while inside < ADJOINT_RINGS and el < L:
        if inside == 0 or el + PADDING <= lowest:
            advance_adjoint(a, b, g, x, before, now, sums, el, _PAIRS)
        else:
            _mask_outside(scale, columns, g, masked)
            _add_to_degrees(columns, a, b, masked, x, before, now, sums, el, _PAIRS)
        inside = rescale(before, now, scale)
        el += PADDING
    if el < lowest:
        pairs = (lowest - el) // 2
        advance_adjoint(a, b, g, x, before, now, sums, el, pairs)
        el += 2 * pairs
    if el < L:
        _add_to_degrees(columns, a, b, g, x, before, now, sums, el, (L - el + 1) // 2)
