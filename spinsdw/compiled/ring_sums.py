"""Sums over degrees for every ring, and their adjoints, for one block of rings at one (m, n).

A block passes three stages. While all its rings are out of range, the degree only advances; while
some are, the sums of the others are formed, a few degrees at a time; once none is, one call
runs to the end. The columns c or g hold two real numbers for each complex series. Each tile is
called from one place only: every call is another copy of its machine code.

More columns than four share a block by quartets (`products`): the values of up to `CHUNK` degrees
are made once, and then multiplied with each quartet.
"""

from __future__ import annotations

from spinsdw.compiled.jit import inner
from spinsdw.compiled.products import (
    add_products_to_degrees,
    add_products_to_rings,
    fill_values,
)
from spinsdw.compiled.vectors import (
    RINGS,
    WIDTH,
    add_to_degrees_2,
    add_to_degrees_4,
    add_to_rings_2,
    add_to_rings_4,
    advance,
    sum_lanes,
)
from spinsdw.compiled.wigner_recursion import rescale

__all__ = [
    "CHUNK",
    "add_block_to_degrees",
    "add_quartets_to_degrees",
    "add_up_lanes",
    "copy_rows",
    "copy_sums",
    "sum_block",
    "sum_quartets",
]

# Degrees whose values are kept: those of 32 rings take 16 KiB of the first-level cache.
CHUNK = 64


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


@inner
def add_up_lanes(lanes, first, stop, sums):
    """sums[i] = sum of lanes[i, lane], first <= i < stop: after the last `add_block_to_degrees`."""
    for i in range(first, stop):
        sums[i] = sum_lanes(lanes, i * WIDTH)


@inner
def copy_sums(sums, columns, start, places, stride, rows):
    """Copy what `sum_block` found to its rows, which begin at places[0]; rows has one axis."""
    for k in range(columns):
        first = places[0, k // 2] + (k & 1) * stride + start
        for r in range(RINGS):
            rows[first + r] = sums[k * RINGS + r]


@inner
def copy_rows(rows, columns, start, places, stride, g):
    """Copy a block of rows to the columns of `add_block_to_degrees`."""
    for k in range(columns):
        first = places[0, k // 2] + (k & 1) * stride + start
        for r in range(RINGS):
            g[k * RINGS + r] = rows[first + r]


@inner
def _rescale(work):
    return rescale(work[:RINGS], work[RINGS : 2 * RINGS], work[2 * RINGS : 3 * RINGS])


@inner
def _pass_silent(first, lowest, L, look, inside, a, b, work, values):
    """Move the recursion to where a ring is in range and coefficients begin.

    Returns the degree, and how many rings are in range.
    """
    el = first
    x = work[3 * RINGS : 4 * RINGS]
    while el < L and (inside == 0 or el + look <= lowest):
        pairs = _next_pairs(el, lowest, L, look, inside == RINGS, True)
        advance(a, b, x, x, work[:RINGS], work[RINGS : 2 * RINGS], values, el, pairs)
        if inside < RINGS:
            inside = _rescale(work)
        el += 2 * pairs
    return el, inside


@inner
def _fill_chunk(first, L, look, inside, a, b, work, values):
    """values[j, r] = u_l(x_r) for l = first + j, zero out of range, of up to `CHUNK` degrees.

    Returns how many degrees, and how many rings are in range after them.
    """
    made = 0
    while made < CHUNK and first + made < L:
        pairs = look // 2
        if inside == RINGS:
            pairs = min(CHUNK - made, L - first - made + 1) // 2
        for r in range(RINGS):
            work[4 * RINGS + r] = 1.0 if work[2 * RINGS + r] == 0.0 else 0.0
        fill_values(a, b, work, values, first, first + made, pairs)
        if inside < RINGS:
            inside = _rescale(work)
        made += 2 * pairs
    return made, inside


@inner
def sum_quartets(
    first, lowest, L, look, inside, start, places, stride, a, b, c, work, values, rows
):
    """Add sum_{l=first}^{L-1} c[i, l, k] u_l(x_r) to the rows of each quartet, r from ``start`` on.

    places: where the rows of quartet i begin, in pairs; work: rows u_{l0-1}, u_{l0}, exponents, x
    and room for a mask; the rest as in `sum_block`.
    """
    el = first
    if inside == 0 or first < lowest:
        el, inside = _pass_silent(first, lowest, L, look, inside, a, b, work, values)
    while el < L:
        made, inside = _fill_chunk(el, L, look, inside, a, b, work, values)
        for i in range(places.shape[0]):
            one, other = places[i, 0] + start, places[i, 1] + start
            place = i * c.shape[1]
            add_products_to_rings(c, values, rows, el, made // 2, place, one, other, stride)
        el += made


@inner
def add_quartets_to_degrees(
    first, lowest, L, look, inside, start, places, stride, a, b, rows, work, values, sums
):
    """sums[i, l, k] += sum_r rows[i, k, r] u_l(x_r): the adjoint of `sum_quartets`."""
    el = first
    if inside == 0 or first < lowest:
        el, inside = _pass_silent(first, lowest, L, look, inside, a, b, work, values)
    while el < L:
        made, inside = _fill_chunk(el, L, look, inside, a, b, work, values)
        for i in range(places.shape[0]):
            one, other = places[i, 0] + start, places[i, 1] + start
            place = i * sums.shape[1]
            add_products_to_degrees(rows, values, sums, el, made // 2, place, one, other, stride)
        el += made
