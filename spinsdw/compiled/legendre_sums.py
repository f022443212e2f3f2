"""From harmonic coefficients to Fourier columns on symmetric rings, by functions of order 0.

A series F_n(+-m) of order n, times sin(theta)^|n|, is one of order 0 and |n| more degrees
(`legendre_recursion`). Those have a parity in x = cos(theta), so that one value r_k serves

    sin^|n| F(theta) = E + x O ,    sin^|n| F(pi - theta) = E - x O ,

with E and O two sums over k: four real columns for every two degrees. The rings given are those of
the northern half, the equator included; columns are complex arrays [map, m, ring] of all rings, -m
at place n_m - m.
"""

from __future__ import annotations

import math

import numpy as np

from spinsdw.compiled.jit import inner, kernel
from spinsdw.compiled.legendre_recursion import (
    fill_lowering,
    fill_parity_recursion,
    lower_order,
    raise_order,
)
from spinsdw.compiled.order_sums import M_CHUNK
from spinsdw.compiled.ring_sums import (
    CHUNK,
    add_block_to_degrees,
    add_quartets_to_degrees,
    add_up_lanes,
    sum_block,
    sum_quartets,
)
from spinsdw.compiled.vectors import RINGS, WIDTH
from spinsdw.compiled.wigner_recursion import PADDING, load_start, prepare_start

__all__ = ["add_mirrored_to_harmonics", "fill_mirrored_columns"]

# A step is two degrees.
_LOOK = PADDING // 2


@inner
def _prepare_order(
    m, n, L, tables, rings, is_new, window, recursion, mixers, factors, powers, start
):
    """Fill the recursion of m, and what the start of all rings in the window has of m."""
    a, b, shifted, scale, ratios = recursion
    size = abs(n)
    count = (L + size - m + 1) // 2
    fill_parity_recursion(m, count, ratios, a, b, shifted, scale)
    inverse_roots = tables[3][m:]
    here, above, odd = mixers[0], mixers[1], mixers[2]
    for k in range(count):
        here[k] = scale[k] * (ratios[2 * k + 1] * inverse_roots[2 * k])
        above[k] = scale[k] * (ratios[2 * k + 2] * inverse_roots[2 * k + 2])
        odd[k] = scale[k] * inverse_roots[2 * k + 1]
    for i in range(size):
        fill_lowering(m, i + 1, L + size - 1 - i, tables[4][i], factors[i])
    for k in range(count, count + PADDING):
        a[k] = 0.0
        b[k] = 0.0
        shifted[k] = 0.0
    if window[1] > window[0]:
        # The last block of any later m, too, ends there.
        stop = window[1] + RINGS
        prepare_start(m, 0, is_new, tables[1], rings, window[0], stop, powers, start)
    return count


@inner
def _fill_series(m, side, n, L, factors, flm, weights, series):
    """Fill c_l of sum_l c_l d^l_m0 = sin^|n| F_n(+-m), m <= l < L + |n|; return which series."""
    size = abs(n)
    order_sign = 1.0 if (n > 0) == (side == 0) else -1.0
    sign = -1.0 if side == 1 and (m + n) & 1 else 1.0
    signed_m = m if side == 0 else -m
    first = max(m, size)
    for part in range(2):
        series[0, part, m:first] = 0.0
        series[0, part, L : L + 3] = 0.0
    values, weight = flm[first * first + first + signed_m :], weights[first:]
    real, imaginary = series[0, 0, first:], series[0, 1, first:]
    place = 0
    for i in range(L - first):
        value = (sign * weight[i]) * values[place]
        real[i] = value.real
        imaginary[i] = value.imag
        place += 2 * (first + i + 1)
    for i in range(size):
        lower_order(m, order_sign, L + i, factors[size - 1 - i], series[i & 1], series[1 - (i & 1)])
    return size & 1


@inner
def _fill_coefficients(m, count, series, mixers, c):
    """c[k] = (even, odd) sums' coefficients of u_k, each as real and imaginary part."""
    here, above, odd = mixers[0], mixers[1], mixers[2]
    real, imaginary = series[0, m:], series[1, m:]
    for k in range(count):
        c[4 * k] = here[k] * real[2 * k] + above[k] * real[2 * k + 2]
        c[4 * k + 1] = here[k] * imaginary[2 * k] + above[k] * imaginary[2 * k + 2]
        c[4 * k + 2] = odd[k] * real[2 * k + 1]
        c[4 * k + 3] = odd[k] * imaginary[2 * k + 1]
    c[4 * count : 4 * (count + PADDING)] = 0.0


@inner
def _store_rows(first, low, stop, part, cosine, factor, column):
    """Write both hemispheres of rings low <= r < stop into a column; part[:, 0] is of ``low``."""
    count = stop - low
    north = column[first + low : first + stop]
    south = column[column.size - first - stop : column.size - first - low]
    x, size = cosine[low:stop], factor[low:stop]
    for r in range(count):
        even = complex(part[0, r], part[1, r])
        odd = x[r] * complex(part[2, r], part[3, r])
        north[r] = size[r] * (even + odd)
        south[count - 1 - r] = size[r] * (even - odd)


@inner
def _rows_of(work):
    """Return the parts of a block's workspace: u_{k-1}, u_k, the exponents and the argument."""
    return (
        work[:RINGS],
        work[RINGS : 2 * RINGS],
        work[2 * RINGS : 3 * RINGS],
        work[3 * RINGS : 4 * RINGS],
    )


@inner
def _load_argument(rings, start, x):
    """Copy the argument that is exact on a block; return whether it is -sin^2."""
    is_polar = rings[0][start] < 0.7
    values = (rings[4] if is_polar else rings[3])[start:]
    for r in range(RINGS):
        x[r] = values[r]
    return is_polar


@kernel
def _workspace(L, n, padded):
    size = L + abs(n) + PADDING
    recursion = (np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size))
    return recursion, np.empty((6, padded)), np.empty((2, padded))


@kernel
def _series_workspace(L, n):
    size = L + abs(n) + 4
    return np.empty((3, size)), np.empty((abs(n), 3, size)), np.empty((2, 2, size))


@kernel
def _quartets(count, padded):
    """Return where the rows of each quartet begin, the rows of all, and room for a block.

    A quartet is the even and the odd sum, both complex, of one side of one map.
    """
    places = np.empty((count, 2), dtype=np.int64)
    for q in range(count):
        places[q, 0] = 4 * q * padded
        places[q, 1] = (4 * q + 2) * padded
    return places, np.empty((count, 4, padded)), np.empty(5 * RINGS), np.empty(CHUNK * RINGS)


@inner
def _end_of_blocks(low, high):
    """Return one past the last ring of the blocks that cover low <= r < high."""
    return low + max(high - low + RINGS - 1, 0) // RINGS * RINGS


@inner
def _fill_orders(
    first_m, stop_m, L, sides, n, first_ring, flm, weights, rings, windows, tables, room, columns
):
    """Fill the columns of some orders; ``room`` is what `fill_mirrored_columns` allocates."""
    (recursion, powers, starts), (mixers, factors, series), quartets, block, sums, c = room
    places, rows, work, values = quartets
    before, now, scale, x = _rows_of(work)
    padded, n_m = rings[0].size, columns.shape[1]
    n_rings = padded - RINGS
    for m in range(first_m, stop_m):
        low, high = windows[0, m], windows[1, m]
        is_new = m == first_m or m % M_CHUNK == 0
        count = _prepare_order(
            m,
            n,
            L,
            tables,
            rings,
            is_new,
            windows[:, m],
            recursion,
            mixers,
            factors,
            powers,
            starts,
        )
        # Of r_0 = p_{m+1} / x, where the start has d^m_m0.
        norm = math.sqrt((2.0 * m + 1.0) * (2.0 * m + 3.0))
        n_sides = sides if m > 0 else 1
        used = n_sides * flm.shape[0]
        for q in range(used):
            last = _fill_series(m, q % n_sides, n, L, factors, flm[q // n_sides], weights, series)
            _fill_coefficients(m, count, series[last], mixers, c[q])
        used_places = places[:used]
        if used > 1:
            rows[:used] = 0.0
        for start in range(low, high, RINGS):
            is_polar = _load_argument(rings, start, x)
            shift = recursion[2] if is_polar else recursion[1]
            reached = load_start(starts, start, norm, before, now, scale)
            if used == 1:
                sum_block(
                    0,
                    0,
                    count,
                    4,
                    _LOOK,
                    reached,
                    recursion[0],
                    shift,
                    c[0],
                    x,
                    before,
                    now,
                    scale,
                    sums,
                )
                stop = min(start + RINGS, n_rings)
                _store_rows(first_ring, start, stop, block, rings[5], rings[6], columns[0, m])
            else:
                sum_quartets(
                    0,
                    0,
                    count,
                    _LOOK,
                    reached,
                    start,
                    used_places,
                    padded,
                    recursion[0],
                    shift,
                    c,
                    work,
                    values,
                    rows,
                )
        if used > 1:
            stop = min(_end_of_blocks(low, high), n_rings)
            for q in range(used):
                column = columns[q // n_sides, m if q % n_sides == 0 else n_m - m]
                part = rows[q][:, low:]
                _store_rows(first_ring, low, stop, part, rings[5], rings[6], column)


@kernel
def fill_mirrored_columns(
    first_m, stop_m, L, sides, n, first_ring, flm, weights, rings, windows, tables, columns
):
    """Fill columns[i, m, ring] = sum_l weights[l] flm[i, lm] d^l_mn(theta), both hemispheres.

    flm: (maps, L*L); weights: (L,) complex; rings: (sin, 1 + cos, 1 - cos, cos^2, -sin^2, cos,
    sin^-|n|) of the northern rings from ``first_ring`` on and RINGS more; windows: (2, L) first
    and last of them that matter at each m, others are left alone; tables: (sqrt(k), central
    binomials, 1 / k, 1 / sqrt(2k + 1), (|n|, 3, L) the parts of U_l, V_l, W_l that depend on l and
    n); columns: (maps, n_m, all rings), of m >= 0 only for ``sides`` = 1.
    """
    quartets, sums = _quartets(sides * flm.shape[0], rings[0].size), np.empty(4 * RINGS)
    room = (
        _workspace(L, n, rings[0].size),
        _series_workspace(L, n),
        quartets,
        sums.reshape(4, RINGS),
        sums,
        np.empty((sides * flm.shape[0], 4 * (L + abs(n) + PADDING))),
    )
    _fill_orders(
        first_m,
        stop_m,
        L,
        sides,
        n,
        first_ring,
        flm,
        weights,
        rings,
        windows,
        tables,
        room,
        columns,
    )


@inner
def _load_rows(first, low, stop, n_rings, column, cosine, factor, part):
    """Split rings low <= r < stop of a column into even and odd parts, zero beyond the last."""
    total, last = column.size, min(stop, n_rings)
    count = last - low
    north = column[first + low : first + last]
    south = column[total - first - last : total - first - low]
    x, size = cosine[low:last], factor[low:last]
    for r in range(count):
        here, mirrored = size[r] * north[r], size[r] * south[count - 1 - r]
        even, odd = here + mirrored, x[r] * (here - mirrored)
        part[0, r] = even.real
        part[1, r] = even.imag
        part[2, r] = odd.real
        part[3, r] = odd.imag
    # The equator is its own mirror image: it counts once.
    if 2 * (first + last) - 1 == total:
        even = size[count - 1] * north[count - 1]
        odd = x[count - 1] * even
        part[0, count - 1] = even.real
        part[1, count - 1] = even.imag
        part[2, count - 1] = odd.real
        part[3, count - 1] = odd.imag
    part[:, count : stop - low] = 0.0


@inner
def _collect(m, count, sums, mixers, series):
    """Fill sum_ring d^l_m0 g, m <= l < m + 2 count, from the sums of u_k g."""
    here, above, odd = mixers[0], mixers[1], mixers[2]
    for part in range(2):
        out = series[part, m:]
        before = 0.0
        for k in range(count):
            place = 4 * k + part
            even = sums[place]
            out[2 * k] = here[k] * even + before
            out[2 * k + 1] = odd[k] * sums[place + 2]
            before = above[k] * even


@inner
def _add_series(m, side, n, L, factors, series, weights, flm):
    """Transpose of `_fill_series`: add what ``series`` holds for order 0 to the coefficients."""
    size = abs(n)
    order_sign = 1.0 if (n > 0) == (side == 0) else -1.0
    sign = -1.0 if side == 1 and (m + n) & 1 else 1.0
    signed_m = m if side == 0 else -m
    for i in range(size):
        raise_order(m, order_sign, L + size - 1 - i, factors[i], series[i & 1], series[1 - (i & 1)])
    first = max(m, size)
    values, weight = flm[first * first + first + signed_m :], weights[first:]
    real, imaginary = series[size & 1, 0, first:], series[size & 1, 1, first:]
    place = 0
    for i in range(L - first):
        values[place] += (sign * weight[i]) * complex(real[i], imaginary[i])
        place += 2 * (first + i + 1)


@inner
def _add_orders(
    first_m, stop_m, L, sides, n, first_ring, columns, weights, rings, windows, tables, room, flm
):
    """Add to the coefficients of some orders; ``room`` is what the caller allocates."""
    (recursion, powers, starts), (mixers, factors, series), quartets, block, blocks, found = room
    places, rows, work, values = quartets
    sums, lanes = found
    g, masked = blocks[0], blocks[1]
    before, now, scale, x = _rows_of(work)
    padded, n_m = rings[0].size, columns.shape[1]
    n_rings = padded - RINGS
    for m in range(first_m, stop_m):
        low, high = windows[0, m], windows[1, m]
        is_new = m == first_m or m % M_CHUNK == 0
        count = _prepare_order(
            m,
            n,
            L,
            tables,
            rings,
            is_new,
            windows[:, m],
            recursion,
            mixers,
            factors,
            powers,
            starts,
        )
        # Of r_0 = p_{m+1} / x, where the start has d^m_m0.
        norm = math.sqrt((2.0 * m + 1.0) * (2.0 * m + 3.0))
        n_sides = sides if m > 0 else 1
        used = n_sides * flm.shape[0]
        stop = _end_of_blocks(low, high)
        for q in range(used):
            sums[q, : 4 * (count + PADDING)] = 0.0
            column = columns[q // n_sides, m if q % n_sides == 0 else n_m - m]
            if used > 1 and high > low:
                part = rows[q][:, low:]
                _load_rows(first_ring, low, stop, n_rings, column, rings[5], rings[6], part)
        if used == 1:
            lanes[: 4 * WIDTH * (count + PADDING)] = 0.0
        used_places = places[:used]
        for start in range(low, high, RINGS):
            is_polar = _load_argument(rings, start, x)
            shift = recursion[2] if is_polar else recursion[1]
            reached = load_start(starts, start, norm, before, now, scale)
            if used == 1:
                last, column = start + RINGS, columns[0, m]
                _load_rows(first_ring, start, last, n_rings, column, rings[5], rings[6], block)
                add_block_to_degrees(
                    0,
                    0,
                    count,
                    4,
                    _LOOK,
                    reached,
                    recursion[0],
                    shift,
                    g,
                    masked,
                    x,
                    before,
                    now,
                    scale,
                    lanes,
                )
            else:
                add_quartets_to_degrees(
                    0,
                    0,
                    count,
                    _LOOK,
                    reached,
                    start,
                    used_places,
                    padded,
                    recursion[0],
                    shift,
                    rows,
                    work,
                    values,
                    sums,
                )
        if used == 1:
            add_up_lanes(lanes, 0, 4 * count, sums[0])
        for q in range(used):
            _collect(m, count, sums[q], mixers, series[0])
            side = q % n_sides
            _add_series(m, side, n, L, factors, series, weights, flm[q // n_sides])


@kernel
def add_mirrored_to_harmonics(
    first_m, stop_m, L, sides, n, first_ring, columns, weights, rings, windows, tables, flm
):
    """flm[i, lm] += weights[l] sum_ring d^l_mn(theta) columns[i, m, ring], both hemispheres.

    Shapes as in `fill_mirrored_columns`, whose adjoint this is for conjugated weights.
    """
    quartets, blocks = _quartets(sides * flm.shape[0], rings[0].size), np.empty((2, 4 * RINGS))
    size = 4 * (L + abs(n) + PADDING)
    room = (
        _workspace(L, n, rings[0].size),
        _series_workspace(L, n),
        quartets,
        blocks[0].reshape(4, RINGS),
        blocks,
        (np.empty((sides * flm.shape[0], size)), np.empty(WIDTH * size)),
    )
    _add_orders(
        first_m,
        stop_m,
        L,
        sides,
        n,
        first_ring,
        columns,
        weights,
        rings,
        windows,
        tables,
        room,
        flm,
    )
