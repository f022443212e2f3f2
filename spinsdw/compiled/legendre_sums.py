"""From harmonic coefficients to Fourier columns on rings, by functions of order 0.

A series F_n(+-m) of order n, times sin(theta)^|n|, is one of order 0 and |n| more degrees
(`legendre_recursion`). Those have a parity in x = cos(theta), so that one value r_k serves

    sin^|n| F(theta) = E + x O ,    sin^|n| F(pi - theta) = E - x O ,

with E and O two sums over k: four real columns, a quartet, for every two degrees, of each order,
side (m or -m) and map. Columns are complex arrays [map, k, row, ring], rows as in `order_sums`.

The rings come in order of their distance from the pole that is nearer. ``rings`` holds their sin,
1 + cos, 1 - cos, cos^2, -sin^2 as of the northern hemisphere, the cosine with its sign, all of them
and RINGS more; and where each is in a column, and where the mirror images of the first of them are.
Those are unsigned: for a signed index numba asks every time whether it counts from the end.
"""

from __future__ import annotations

import math

import numpy as np

from spinsdw.compiled.jit import inner, kernel, room
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

__all__ = ["add_parity_columns", "fill_parity_columns"]

# A step is two degrees.
_LOOK = PADDING // 2


@inner
def _prepare_order(m, reach, L, tables, rings, is_new, window, recursion, mixers, factors, start):
    """Fill the recursion of m, and what the start of all rings in the window has of m.

    Return the number of steps of two degrees.
    """
    a, b, shifted, scale, ratios = recursion
    powers, starts = start
    count = (L + reach - m + 1) // 2
    fill_parity_recursion(m, count, ratios, a, b, shifted, scale)
    inverse_roots = tables[3][m:]
    here, above, odd = mixers[0], mixers[1], mixers[2]
    for k in range(count):
        here[k] = scale[k] * (ratios[2 * k + 1] * inverse_roots[2 * k])
        above[k] = scale[k] * (ratios[2 * k + 2] * inverse_roots[2 * k + 2])
        odd[k] = scale[k] * inverse_roots[2 * k + 1]
    for i in range(reach):
        fill_lowering(m, i + 1, L + reach - 1 - i, tables[4][i], factors[i])
    for k in range(count, count + PADDING):
        a[k] = 0.0
        b[k] = 0.0
        shifted[k] = 0.0
    if window[1] > window[0]:
        # The last block of any later m, too, ends there.
        stop = window[1] + RINGS
        prepare_start(m, 0, is_new, tables[1], rings[:3], window[0], stop, powers, starts)
    return count


@inner
def _first_step(m, lowest, reach):
    """Return the first step that degrees from ``lowest`` on have a part in."""
    return max(lowest - reach - m - 2, 0) // 2


@inner
def _order_sign(side, n):
    return 1.0 if (n > 0) == (side == 0) else -1.0


@inner
def _side_sign(m, side, n):
    return -1.0 if side == 1 and (m + n) & 1 else 1.0


@inner
def _gather(m, side, L, flm, gathered):
    """Fill gathered = f_{l, +-m}, m <= l < L, real parts and imaginary parts."""
    place = m * m + m + (m if side == 0 else -m)
    real, imaginary = gathered[0, m:L], gathered[1, m:L]
    for i in range(real.size):
        value = flm[place]
        real[i] = value.real
        imaginary[i] = value.imag
        place += 2 * (m + i + 1)


@inner
def _scatter(m, side, L, gathered, flm):
    """Transpose of `_gather`: add to the coefficients."""
    place = m * m + m + (m if side == 0 else -m)
    real, imaginary = gathered[0, m:L], gathered[1, m:L]
    for i in range(real.size):
        flm[place] += complex(real[i], imaginary[i])
        place += 2 * (m + i + 1)


@inner
def _fill_series(m, side, n, reach, L, factors, gathered, weights, series):
    """Fill c_l of sum_l c_l d^l_m0 = sin^|n| F_n(+-m), m <= l < L + reach; return which series."""
    size = abs(n)
    sign = _side_sign(m, side, n)
    first = max(m, size)
    for part in range(2):
        series[0, part, m:first] = 0.0
        series[0, part, L : L + 3] = 0.0
    weight, real, imaginary = weights[first:L], gathered[0, first:], gathered[1, first:]
    c, d = series[0, 0, first:], series[0, 1, first:]
    for i in range(weight.size):
        p, q = sign * weight[i].real, sign * weight[i].imag
        c[i] = p * real[i] - q * imaginary[i]
        d[i] = p * imaginary[i] + q * real[i]
    for i in range(size):
        lowering = factors[size - 1 - i]
        lower_order(m, _order_sign(side, n), L + i, lowering, series[i & 1], series[1 - (i & 1)])
    last = size & 1
    for part in range(2):
        series[last, part, L + size : L + reach + 3] = 0.0
    return last


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
def _fill_hemispheres(low, stop, is_mirrored, quartet, cosine, divisor, hemispheres):
    """Both hemispheres' real and imaginary parts from the rows of the even and the odd sum."""
    x, factor = cosine[low:stop], divisor[low:stop]
    for part in range(2):
        even, odd = quartet[part, low:stop], quartet[2 + part, low:stop]
        here = hemispheres[part, low:stop]
        for r in range(x.size):
            here[r] = factor[r] * (even[r] + x[r] * odd[r])
        if is_mirrored:
            mirrored = hemispheres[2 + part, low:stop]
            for r in range(x.size):
                mirrored[r] = factor[r] * (even[r] - x[r] * odd[r])


@inner
def _mix_orders(k, low, stop, is_mirrored, mixing, hemispheres, mixed):
    """Fill mixed = sum_i mixing[k, i] hemispheres[i]."""
    for half in range(0, 4 if is_mirrored else 2, 2):
        real, imaginary = mixed[half, low:stop], mixed[half + 1, low:stop]
        real[:] = 0.0
        imaginary[:] = 0.0
        for i in range(mixing.shape[1]):
            p, q = mixing[k, i].real, mixing[k, i].imag
            c, d = hemispheres[i, half, low:stop], hemispheres[i, half + 1, low:stop]
            for r in range(real.size):
                real[r] += p * c[r] - q * d[r]
                imaginary[r] += p * d[r] + q * c[r]


@inner
def _store_rings(low, places, values, column):
    """Put rings from ``low`` on where they belong in a column; values: real, imaginary parts."""
    targets, real, imaginary = places[low:], values[0, low:], values[1, low:]
    for r in range(targets.size):
        column[targets[r]] = complex(real[r], imaginary[r])


@inner
def _row_of(m, side, place):
    return m - place[0] if side == 0 else place[1] - m


@inner
def _clear_rings(row, stop, places, columns):
    """Set a row of the columns of one map to zero on the first rings."""
    targets = places[:stop]
    for k in range(columns.shape[0]):
        for r in range(targets.size):
            columns[k, row, targets[r]] = 0.0


@inner
def _store_orders(m, side, low, mixing, rings, divisors, orders, quartets, room, place, columns):
    """Fill the columns of +m or -m of one map, from ring ``low`` on, from its orders' sums."""
    hemispheres, mixed = room
    stop, is_mirrored = rings[6].size, rings[7].size > 0
    is_single = mixing.size == 1 and mixing[0, 0] == 1.0
    for i in range(orders.size):
        quartet, divisor = quartets[i], divisors[abs(orders[i])]
        _fill_hemispheres(low, stop, is_mirrored, quartet, rings[5], divisor, hemispheres[i])
    row = _row_of(m, side, place)
    for k in range(mixing.shape[0]):
        values = hemispheres[0] if is_single else mixed
        if not is_single:
            _mix_orders(k, low, stop, is_mirrored, mixing, hemispheres, mixed)
        _store_rings(low, rings[6], values, columns[k, row])
        _store_rings(low, rings[7], values[2:], columns[k, row])


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


@inner
def _copy_block(sums, quartet, start):
    """Copy the sums of one block to the rows of a quartet."""
    for k in range(4):
        for r in range(RINGS):
            quartet[k, start + r] = sums[k * RINGS + r]


@inner
def _load_block(quartet, start, g):
    """Copy the rows of a quartet to the columns of one block."""
    for k in range(4):
        for r in range(RINGS):
            g[k * RINGS + r] = quartet[k, start + r]


@room
def _workspace(L, reach, padded):
    """Return room for the recursion and the start of an order, and for series of degrees."""
    size = L + reach + PADDING
    recursion = (np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size))
    start = np.empty((6, padded)), np.empty((2, padded))
    mixers, factors = np.empty((3, size)), np.empty((reach, 3, size))
    return recursion, start, (mixers, factors, np.empty((2, 2, size)), np.empty((2, size)))


@room
def _quartets(count, padded):
    """Return where the rows of each quartet begin, the rows of all, and room for a block."""
    places = np.empty((count, 2), dtype=np.int64)
    for q in range(count):
        places[q, 0] = 4 * q * padded
        places[q, 1] = (4 * q + 2) * padded
    return places, np.zeros((count, 4, padded)), np.empty(5 * RINGS), np.empty(CHUNK * RINGS)


@inner
def _end_of_blocks(low, high):
    """Return one past the last ring of the blocks that cover low <= r < high."""
    return low + max(high - low + RINGS - 1, 0) // RINGS * RINGS


@inner
def _fill_all_coefficients(m, count, L, reach, n_sides, flm, weights, orders, room, c):
    """Fill the coefficients of every map, side and order; c: (quartets, 4 (degrees / 2))."""
    mixers, factors, series, gathered = room
    q = 0
    for i in range(flm.shape[0]):
        for side in range(n_sides):
            for j in range(orders.size):
                if j == 0 or flm.shape[1] > 1:
                    _gather(m, side, L, flm[i, j if flm.shape[1] > 1 else 0], gathered)
                n = orders[j]
                last = _fill_series(m, side, n, reach, L, factors, gathered, weights[j], series)
                _fill_coefficients(m, count, series[last], mixers, c[q])
                q += 1
    return q


@inner
def _fill_orders(
    first_m,
    stop_m,
    L,
    lowest,
    sides,
    flm,
    weights,
    mixing,
    orders,
    rings,
    divisors,
    windows,
    tables,
    clears,
    place,
    room,
    columns,
):
    """Fill the columns of some orders; ``room`` is what `fill_parity_columns` allocates."""
    (recursion, started, series), quartets, mixed, sums, c = room
    places, rows, work, values = quartets
    before, now, scale, x = _rows_of(work)
    n_orders, padded, reach = orders.size, rings[0].size, divisors.shape[0] - 1
    for m in range(first_m, stop_m):
        low, high = windows[0, m], windows[1, m]
        is_new = m == first_m or m % M_CHUNK == 0
        n_sides = sides if m > 0 else 1
        if high > low:
            count = _prepare_order(
                m,
                reach,
                L,
                tables,
                rings,
                is_new,
                windows[:, m],
                recursion,
                series[0],
                series[1],
                started,
            )
            # Of r_0 = p_{m+1} / x, where the start has d^m_m0.
            norm = math.sqrt((2.0 * m + 1.0) * (2.0 * m + 3.0))
            used = _fill_all_coefficients(
                m, count, L, reach, n_sides, flm, weights, orders, series, c
            )
            used_places, first = places[:used], _first_step(m, lowest, reach)
            rows[:used, :, low:] = 0.0
            for start in range(low, high, RINGS):
                is_polar = _load_argument(rings, start, x)
                shift = recursion[2] if is_polar else recursion[1]
                reached = load_start(started[1], start, norm, before, now, scale)
                if used == 1:
                    sum_block(
                        0,
                        first,
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
                    _copy_block(sums, rows[0], start)
                else:
                    sum_quartets(
                        0,
                        first,
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
        for i in range(flm.shape[0]):
            for side in range(n_sides):
                q = (i * n_sides + side) * n_orders
                found, target = rows[q : q + n_orders], columns[i]
                if high > low:
                    _store_orders(
                        m,
                        side,
                        low,
                        mixing,
                        rings,
                        divisors,
                        orders,
                        found,
                        mixed,
                        place,
                        target,
                    )
                if clears:
                    row = _row_of(m, side, place)
                    _clear_rings(row, low, rings[6], target)
                    _clear_rings(row, low, rings[7], target)


@kernel
def fill_parity_columns(
    first_m,
    stop_m,
    L,
    lowest,
    sides,
    flm,
    weights,
    mixing,
    orders,
    rings,
    divisors,
    windows,
    tables,
    clears,
    place,
    columns,
):
    """Fill columns[., k, +-m, ring] = sum_i mixing[k, i] sum_l weights[i, l] f_lm d^l_{m, n_i}.

    flm: (maps, 1 or orders, at least L*L); weights: (orders, L) complex; mixing: (outputs, orders)
    complex; orders: the n_i; divisors: (largest |n| + 1, rings) sin^-k of the rings; windows:
    (2, L) first and last of them that matter at each m, others are left alone unless ``clears``;
    tables: (sqrt(k), central binomials, 1 / k, 1 / sqrt(2k + 1), (|n|, 3, L) the parts of U_l, V_l,
    W_l that depend on l and n); columns: (maps, outputs, rows, all rings), with orders m and -m in
    rows m - place[0] and place[1] - m, of m >= 0 only for ``sides`` = 1.
    """
    reach, padded, n_orders = divisors.shape[0] - 1, rings[0].size, orders.size
    count = sides * flm.shape[0] * n_orders
    room = (
        _workspace(L, reach, padded),
        _quartets(count, padded),
        (np.empty((n_orders, 4, padded)), np.empty((4, padded))),
        np.empty(4 * RINGS),
        np.empty((count, 4 * (L + reach + PADDING))),
    )
    _fill_orders(
        first_m,
        stop_m,
        L,
        lowest,
        sides,
        flm,
        weights,
        mixing,
        orders,
        rings,
        divisors,
        windows,
        tables,
        clears,
        place,
        room,
        columns,
    )


@inner
def _load_rings(low, stop, rings, divisor, column, quartet):
    """Split rings low <= r < stop of a column into even and odd parts, zero beyond the last."""
    last = min(stop, rings[6].size)
    places, mirrors = rings[6][low:last], rings[7][low:last]
    even_real, even_imaginary = quartet[0, low:last], quartet[1, low:last]
    odd_real, odd_imaginary = quartet[2, low:last], quartet[3, low:last]
    one, x = divisor[low:last], rings[5][low:last]
    for r in range(mirrors.size):
        here, there = column[places[r]], column[mirrors[r]]
        even, odd = one[r] * (here + there), (one[r] * x[r]) * (here - there)
        even_real[r] = even.real
        even_imaginary[r] = even.imag
        odd_real[r] = odd.real
        odd_imaginary[r] = odd.imag
    for r in range(mirrors.size, places.size):
        even = one[r] * column[places[r]]
        even_real[r] = even.real
        even_imaginary[r] = even.imag
        odd_real[r] = x[r] * even.real
        odd_imaginary[r] = x[r] * even.imag
    quartet[:, last:stop] = 0.0


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
def _add_series(m, side, n, L, factors, series, weights, gathered):
    """Transpose of `_fill_series`: add what ``series`` holds for order 0 to the coefficients."""
    size = abs(n)
    for i in range(size):
        stop = L + size - 1 - i
        raise_order(m, _order_sign(side, n), stop, factors[i], series[i & 1], series[1 - (i & 1)])
    sign, first = _side_sign(m, side, n), max(m, size)
    weight, real, imaginary = weights[first:L], gathered[0, first:], gathered[1, first:]
    c, d = series[size & 1, 0, first:], series[size & 1, 1, first:]
    for i in range(weight.size):
        p, q = sign * weight[i].real, sign * weight[i].imag
        real[i] += p * c[i] - q * d[i]
        imaginary[i] += p * d[i] + q * c[i]


@inner
def _load_all_rings(
    m, n_sides, low, stop, count, columns, rings, divisors, orders, place, rows, sums
):
    """Load the rows of every map, side and order, and clear their sums; return their number."""
    q = 0
    for i in range(columns.shape[0]):
        for side in range(n_sides):
            row = _row_of(m, side, place)
            for j in range(orders.size):
                divisor = divisors[abs(orders[j])]
                _load_rings(low, stop, rings, divisor, columns[i, j, row], rows[q])
                sums[q, : 4 * (count + PADDING)] = 0.0
                q += 1
    return q


@inner
def _add_all_coefficients(m, count, L, n_sides, weights, orders, sums, room, flm):
    """Add what the sums of every map, side and order hold to the coefficients."""
    mixers, factors, series, gathered = room
    q, targets = 0, flm.shape[1]
    for i in range(flm.shape[0]):
        for side in range(n_sides):
            gathered[:, m:L] = 0.0
            for j in range(orders.size):
                _collect(m, count, sums[q], mixers, series[0])
                _add_series(m, side, orders[j], L, factors, series, weights[j], gathered)
                if targets > 1:
                    _scatter(m, side, L, gathered, flm[i, j])
                    gathered[:, m:L] = 0.0
                q += 1
            if targets == 1:
                _scatter(m, side, L, gathered, flm[i, 0])


@inner
def _add_orders(
    first_m,
    stop_m,
    L,
    lowest,
    sides,
    columns,
    weights,
    orders,
    rings,
    divisors,
    windows,
    tables,
    place,
    room,
    flm,
):
    """Add to the coefficients of some orders; ``room`` is what the caller allocates."""
    (recursion, started, series), quartets, blocks, (sums, lanes) = room
    places, rows, work, values = quartets
    g, masked = blocks[0], blocks[1]
    before, now, scale, x = _rows_of(work)
    padded, reach = rings[0].size, divisors.shape[0] - 1
    for m in range(first_m, stop_m):
        low, high = windows[0, m], windows[1, m]
        is_new = m == first_m or m % M_CHUNK == 0
        n_sides = sides if m > 0 else 1
        if high <= low:
            continue
        count = _prepare_order(
            m,
            reach,
            L,
            tables,
            rings,
            is_new,
            windows[:, m],
            recursion,
            series[0],
            series[1],
            started,
        )
        # Of r_0 = p_{m+1} / x, where the start has d^m_m0.
        norm = math.sqrt((2.0 * m + 1.0) * (2.0 * m + 3.0))
        stop = _end_of_blocks(low, high)
        used = _load_all_rings(
            m, n_sides, low, stop, count, columns, rings, divisors, orders, place, rows, sums
        )
        if used == 1:
            lanes[: 4 * WIDTH * (count + PADDING)] = 0.0
        used_places, first = places[:used], _first_step(m, lowest, reach)
        for start in range(low, high, RINGS):
            is_polar = _load_argument(rings, start, x)
            shift = recursion[2] if is_polar else recursion[1]
            reached = load_start(started[1], start, norm, before, now, scale)
            if used == 1:
                _load_block(rows[0], start, g)
                add_block_to_degrees(
                    0,
                    first,
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
                    first,
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
        _add_all_coefficients(m, count, L, n_sides, weights, orders, sums, series, flm)


@kernel
def add_parity_columns(
    first_m,
    stop_m,
    L,
    lowest,
    sides,
    columns,
    weights,
    orders,
    rings,
    divisors,
    windows,
    tables,
    place,
    flm,
):
    """f_lm += sum_i weights[i, l] sum_ring d^l_{m, n_i}(theta) columns[., i, +-m, ring].

    Shapes as in `fill_parity_columns`, whose adjoint this is for conjugated weights and no mixing;
    columns: (maps, at least orders, rows, all rings).
    """
    reach, padded = divisors.shape[0] - 1, rings[0].size
    count, size = sides * flm.shape[0] * orders.size, 4 * (L + reach + PADDING)
    room = (
        _workspace(L, reach, padded),
        _quartets(count, padded),
        np.empty((2, 4 * RINGS)),
        (np.empty((count, size)), np.empty(WIDTH * size)),
    )
    _add_orders(
        first_m,
        stop_m,
        L,
        lowest,
        sides,
        columns,
        weights,
        orders,
        rings,
        divisors,
        windows,
        tables,
        place,
        room,
        flm,
    )
