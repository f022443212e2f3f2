"""Sums over degrees for every ring, and their adjoints, for one block of rings at one (m, n).

A block passes three stages. While all its rings are out of range, the degree only advances; while
some are, the sums of the others are formed, a few degrees at a time; once none is, one call
runs to the end. The columns c or g hold two real numbers for each complex series. Each tile is
called from one place only: every call is another copy of its machine code.
"""

from __future__ import annotations

from spinsdw.compiled.jit import inner
from spinsdw.compiled.vectors import (
    RINGS,
    add_to_degrees_2,
    add_to_degrees_4,
    add_to_rings_2,
    add_to_rings_4,
    advance,
)
from spinsdw.compiled.wigner_recursion import rescale

__all__ = ["add_block_to_degrees", "sum_block"]


@inner
def _clear_outside(scale, columns, sums):
    """Forget what rings out of range have collected: their u is scaled, so it was no sum."""
    for r in range(RINGS):
        if scale[r] < 0.0:
            for k in range(columns):
                sums[k * RINGS + r] = 0.0


@inner
def _mask_outside(scale, columns, g, masked):
    """Copy the block's columns with zeros where a ring is out of range."""
    for r in range(RINGS):
        factor = 1.0 if scale[r] == 0.0 else 0.0
        for k in range(columns):
            masked[k * RINGS + r] = factor * g[k * RINGS + r]


@inner
def _next_pairs(el, lowest, L, look, is_inside, is_silent):
    """Return how many pairs of degrees the next call takes."""
    if not is_inside:
        return look // 2
    return (lowest - el) // 2 if is_silent else (L - el + 1) // 2


@inner
def sum_block(first, lowest, L, columns, look, inside, a, b, c, x, before, now, scale, sums):
    """sums[k, r] = sum_{l=first}^{L-1} c[l, k] u_l(x_r); c is zero below ``lowest``.

    ``inside`` counts the rings in range at the first degree; ``look``, even and up to `PADDING`,
    is the number of degrees between two looks at the exponents.
    """
    for i in range(columns * RINGS):
        sums[i] = 0.0
    el = first
    while el < L:
        is_inside = inside == RINGS
        is_silent = inside == 0 or el + look <= lowest
        pairs = _next_pairs(el, lowest, L, look, is_inside, is_silent)
        if is_silent:
            advance(a, b, c, x, before, now, sums, el, pairs)
        elif columns == 4:
            add_to_rings_4(a, b, c, x, before, now, sums, el, pairs)
        else:
            add_to_rings_2(a, b, c, x, before, now, sums, el, pairs)
        if not is_inside:
            # Before rescaling: a ring that enters now was still out of range in this step.
            if not is_silent:
                _clear_outside(scale, columns, sums)
            inside = rescale(before, now, scale)
        el += 2 * pairs


@inner
def add_block_to_degrees(
    first, lowest, L, columns, look, inside, a, b, g, masked, x, before, now, scale, sums
):
    """sums[l, k, lane] += sum_r g[k, r] u_l(x_r) over the rings of each lane, lowest <= l < L.

    ``inside`` and ``look`` as in `sum_block`.
    """
    el = first
    _mask_outside(scale, columns, g, masked)
    while el < L:
        is_inside = inside == RINGS
        is_silent = inside == 0 or el + look <= lowest
        pairs = _next_pairs(el, lowest, L, look, is_inside, is_silent)
        if is_silent:
            advance(a, b, g, x, before, now, sums, el, pairs)
        elif columns == 4:
            add_to_degrees_4(a, b, masked, x, before, now, sums, el, pairs)
        else:
            add_to_degrees_2(a, b, masked, x, before, now, sums, el, pairs)
        if not is_inside:
            inside = rescale(before, now, scale)
            _mask_outside(scale, columns, g, masked)
        el += 2 * pairs
