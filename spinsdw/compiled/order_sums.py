"""From harmonic coefficients to the Fourier columns of every ring, and back, for a range of m.

A *run* is one pass of the recursion at (m, n), m >= 0. One value d^l_mn(theta) serves up to two
complex series F_i(sigma m), sigma = +-1, of orders n_i at theta or at the mirrored ring pi - theta:

    sigma  ring      needs     d of the series
    +      theta     n_i =  n  d^l_mn
    -      theta     n_i = -n  (-1)^(m - n) d^l_mn
    +      mirrored  n_i = -n  (-1)^(l + m) d^l_mn
    -      mirrored  n_i =  n  (-1)^(l + n) d^l_mn

``runs`` has one row a run: n, then (i, sigma, mirrored) twice, i = -1 for "no series". Columns are
complex arrays [map, k, row, ring], with a row for each of the orders +-m that a caller wants.

The series of a run, of all maps, are taken in pairs: one pair goes through the tiles of four real
columns, and more of them share values as quartets (`ring_sums`). The real and the imaginary part of
a series are neighbouring rows of all rings.
"""

from __future__ import annotations

import numpy as np

from spinsdw.compiled.jit import inner, kernel, room
from spinsdw.compiled.ring_sums import (
    CHUNK,
    add_block_to_degrees,
    add_quartets_to_degrees,
    add_up_lanes,
    copy_rows,
    copy_sums,
    sum_block,
    sum_quartets,
)
from spinsdw.compiled.vectors import RINGS, WIDTH
from spinsdw.compiled.wigner_recursion import (
    PADDING,
    fill_recursion,
    load_start,
    prepare_start,
)

__all__ = ["M_CHUNK", "add_columns_to_harmonics", "fill_columns"]

# Starts of the recursion go from m to m + 1 and are made anew at every multiple of M_CHUNK,
# so that results do not depend on how a caller splits the range of m (at multiples of it).
M_CHUNK = 16


@inner
def _series_sign(sigma, mirrored, m, n):
    """Return (constant sign, whether (-1)^l is a factor) of the table above."""
    direct = 0 if sigma > 0 else m - n
    reflected = m if sigma > 0 else n
    exponent = reflected if mirrored == 1 else direct
    return (-1.0 if exponent & 1 else 1.0), mirrored == 1


@inner
def _is_active(run, slot, m, sides):
    i, sigma = run[1 + 3 * slot], run[2 + 3 * slot]
    return i >= 0 and (sigma > 0 or (m > 0 and sides == 2))


@inner
def _gather(m, L, flm, gathered):
    """gathered[map, source, side, l] = f_{l, +-m}, neighbouring degrees next to each other."""
    for i in range(flm.shape[0]):
        for source in range(flm.shape[1]):
            for side in range(gathered.shape[2]):
                signed_m = m if side == 0 else -m
                for el in range(m, L):
                    gathered[i, source, side, el] = flm[i, source, el * el + el + signed_m]


@inner
def _fill_coefficients(run, slot, k, columns, m, L, lowest, gathered, weights, scale, c):
    """c[l, k] + i c[l, k + 1] = sign_l scale_l weight_l f_{l, sigma m} for one series."""
    n, i, sigma, mirrored = run[0], run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    sign, alternates = _series_sign(sigma, mirrored, m, n)
    source = gathered[i if gathered.shape[0] > 1 else 0, 0 if sigma > 0 else 1]
    weight = weights[i]
    first = max(m, abs(n))
    for el in range(first, min(lowest, L)):
        c[el * columns + k] = 0.0
        c[el * columns + k + 1] = 0.0
    for el in range(max(first, lowest), L):
        factor = -sign * scale[el] if alternates and el & 1 else sign * scale[el]
        value = factor * weight[el] * source[el]
        c[el * columns + k] = value.real
        c[el * columns + k + 1] = value.imag
    for el in range(L, L + PADDING):
        c[el * columns + k] = 0.0
        c[el * columns + k + 1] = 0.0


@inner
def _shift_argument(first, L, a, b, north, south):
    """Rewrite a cos + b as a (cos - 1) + north and a (cos + 1) + south.

    Near a pole cos(theta) is 1 minus something small, and its rounding error would be a wrong
    theta, the same at every degree: a phase error growing with l. The shifted argument is exact.
    """
    plus, minus, slope, offset = north[first:L], south[first:L], a[first:L], b[first:L]
    for i in range(plus.size):
        plus[i] = offset[i] + slope[i]
        minus[i] = offset[i] - slope[i]
    a[L : L + PADDING] = 0.0
    north[L : L + PADDING] = 0.0
    south[L : L + PADDING] = 0.0


@inner
def _count_active(run, m, sides):
    count = 0
    for slot in range(2):
        count += 1 if _is_active(run, slot, m, sides) else 0
    return count


@inner
def _slot_of(run, m, sides, t):
    """Return the slot of the t-th series of a run at m."""
    return t if _is_active(run, 0, m, sides) else 1


@inner
def _place_series(run, m, sides, shape, stride, places, rows):
    """Fill where the rows of all series of a run begin, and clear them; return their number.

    shape: maps, orders, sides and halves of the series.
    """
    active = _count_active(run, m, sides)
    total = shape[0] * active
    for t in range(total):
        slot = _slot_of(run, m, sides, t % active)
        i, side = run[1 + 3 * slot], 0 if run[2 + 3 * slot] > 0 else 1
        place = (t // active * shape[1] + i) * shape[2] + side
        place = (place * shape[3] + run[3 + 3 * slot]) * 2 * stride
        places[t // 2, t % 2] = place
        rows[place : place + 2 * stride] = 0.0
    # The partner of an odd one out: rows that nobody reads.
    if total & 1:
        places[total // 2, 1] = shape[0] * shape[1] * shape[2] * shape[3] * 2 * stride
    return total


@inner
def _clear_partner(first, L, c):
    for el in range(first, L + PADDING):
        c[4 * el + 2] = 0.0
        c[4 * el + 3] = 0.0


@inner
def _load_argument(rings, start, work):
    """Bring a block's argument to ``work``; return whether it is cos - 1."""
    is_north = rings[2][start] < 1.0
    x = rings[3] if is_north else rings[1]
    for r in range(RINGS):
        work[3 * RINGS + r] = x[start + r]
    return is_north


@inner
def _mix_series(m, place, n_rings, mixing, series, mixed, columns):
    """columns[k, +-m, ring] = sum_i mixing[k, i] series[i]; a mirrored ring counts from the end."""
    n_out, n_orders = mixing.shape
    total = columns.shape[2]
    for half in range(series.shape[2]):
        for side in range(2 if m > 0 and series.shape[1] > 1 else 1):
            for k in range(n_out):
                out = columns[k, m - place[0] if side == 0 else place[1] - m]
                mixed[:] = 0.0
                for i in range(n_orders):
                    p, q = mixing[k, i].real, mixing[k, i].imag
                    real, imaginary = series[i, side, half, 0], series[i, side, half, 1]
                    for r in range(n_rings):
                        mixed[0, r] += p * real[r] - q * imaginary[r]
                        mixed[1, r] += p * imaginary[r] + q * real[r]
                if half == 0:
                    here = out[place[2] :]
                    for r in range(n_rings):
                        here[r] = complex(mixed[0, r], mixed[1, r])
                else:
                    for r in range(n_rings):
                        out[total - 1 - r] = complex(mixed[0, r], mixed[1, r])


@inner
def _clear_rings(m, place, n_rings, sides, halves, columns):
    """Set the columns of +-m to zero on the rings."""
    total = columns.shape[3]
    for i in range(columns.shape[0]):
        for k in range(columns.shape[1]):
            for side in range(2 if m > 0 and sides > 1 else 1):
                out = columns[i, k, m - place[0] if side == 0 else place[1] - m]
                out[place[2] : place[2] + n_rings] = 0.0
                if halves > 1:
                    out[total - n_rings :] = 0.0


@inner
def _prepare_recursion(m, n, L, is_opposite, tables, recursion):
    """Fill a, b and both shifted arguments; ``is_opposite`` if -n was the order before."""
    a, b, scale, north, south = recursion
    first = max(m, abs(n))
    if is_opposite:
        for el in range(first, L):
            b[el] = -b[el]
    else:
        fill_recursion(m, n, L, tables[0], tables[2], a, b, scale)
    _shift_argument(first, L, a, b, north, south)


@room
def _recursion_room(L):
    """Return a, b, the scale and both shifted arguments of `_prepare_recursion`, not filled."""
    return (
        np.empty(L + PADDING),
        np.empty(L),
        np.empty(L + 1),
        np.empty(L + PADDING),
        np.empty(L + PADDING),
    )


@inner
def _fill_orders(
    first_m,
    stop_m,
    L,
    lowest,
    sides,
    flm,
    weights,
    runs,
    mixing,
    rings,
    windows,
    tables,
    room,
    place,
    columns,
):
    """Fill the columns of some orders; ``room`` is what `fill_columns` allocates."""
    recursion, blocks, (powers, starts), gathered, series, mixed, c = room
    (before, now, scale, sums, _), work, values, places, rows = blocks
    n_runs, padded = runs.shape[0], rings[0].size
    for m in range(first_m, stop_m):
        is_new = m == first_m or m % M_CHUNK == 0
        low, high = windows[0, m], windows[1, m]
        if high <= low:
            _clear_rings(m, place, padded - RINGS, sides, series.shape[3], columns)
            continue
        _gather(m, L, flm, gathered)
        filled = 2 * L
        for j in range(n_runs):
            run = runs[j]
            n = run[0]
            first = max(m, abs(n))
            if first < L:
                # The last block of any later m, too, ends there.
                stop = high + RINGS
                prepare_start(m, n, is_new, tables[1], rings[:3], low, stop, powers, starts[j])
            total = _place_series(run, m, sides, series.shape, padded, places, rows)
            if total == 0 or first >= L:
                continue
            _prepare_recursion(m, n, L, filled == -n and n != 0, tables, recursion)
            filled = n
            a, exponents = recursion[0], recursion[2]
            active, columns_used = total // flm.shape[0], min(2 * total, 4)
            for t in range(total):
                slot, k = _slot_of(run, m, sides, t % active), 2 * (t % 2)
                source = gathered[t // active]
                _fill_coefficients(
                    run, slot, k, columns_used, m, L, lowest, source, weights, exponents, c[t // 2]
                )
            if total > 2 and total & 1:
                _clear_partner(first, L, c[total // 2])
            used = places[: (total + 1) // 2]
            for start in range(low, high, RINGS):
                inside = load_start(starts[j], start, 1.0, before, now, scale)
                is_north = _load_argument(rings, start, work)
                shift = recursion[3] if is_north else recursion[4]
                if total <= 2:
                    sum_block(
                        first,
                        lowest,
                        L,
                        columns_used,
                        PADDING,
                        inside,
                        a,
                        shift,
                        c[0],
                        work[3 * RINGS : 4 * RINGS],
                        before,
                        now,
                        scale,
                        sums,
                    )
                    copy_sums(sums, columns_used, start, used, padded, rows)
                else:
                    sum_quartets(
                        first,
                        lowest,
                        L,
                        PADDING,
                        inside,
                        start,
                        used,
                        padded,
                        a,
                        shift,
                        c,
                        work,
                        values,
                        rows,
                    )
        for i in range(flm.shape[0]):
            _mix_series(m, place, padded - RINGS, mixing, series[i], mixed, columns[i])


@room
def _block_room(pairs, size):
    """Return room for a block of rings: its start and sums, values, and rows of all series."""
    work = np.empty(5 * RINGS)
    start = work[:RINGS], work[RINGS : 2 * RINGS], work[2 * RINGS : 3 * RINGS]
    places = np.empty((pairs, 2), dtype=np.int64)
    columns = np.empty(4 * RINGS), np.empty(4 * RINGS)
    return (*start, *columns), work, np.empty(CHUNK * RINGS), places, np.zeros(size)


@inner
def _count_halves(runs):
    """Return 2 where a series is on mirrored rings, otherwise 1."""
    halves = 1
    for j in range(runs.shape[0]):
        if runs[j, 3] == 1 or runs[j, 6] == 1:
            halves = 2
    return halves


@kernel
def fill_columns(
    first_m,
    stop_m,
    L,
    lowest,
    sides,
    flm,
    weights,
    runs,
    mixing,
    rings,
    windows,
    tables,
    place,
    columns,
):
    """Fill columns[., k, m, ring] = sum_i mixing[k, i] sum_l weights[i, l] f_lm d^l_{m, n_i}.

    flm: (maps, 1 or orders, at least L*L); weights: (orders, L) complex; mixing: (outputs, orders)
    complex; rings: (sin, 1 + cos, 1 - cos, cos - 1) of the computed rings and RINGS more; windows:
    (2, L) first and last ring that matter at each m; tables: (sqrt(k), central binomials, 1 / k);
    columns: (maps, outputs, rows, all rings), with orders m and -m in rows m - place[0] and
    place[1] - m, of m >= 0 only for ``sides`` = 1, and the computed rings from place[2] on.
    """
    n_maps, n_orders, n_runs = flm.shape[0], weights.shape[0], runs.shape[0]
    halves, padded = _count_halves(runs), rings[0].size
    size = n_maps * n_orders * sides * halves * 2 * padded
    blocks = _block_room(n_maps, size + 2 * padded)
    room = (
        _recursion_room(L),
        blocks,
        (np.empty((6, padded)), np.empty((n_runs, 2, padded))),
        np.empty((n_maps, flm.shape[1], sides, L), dtype=np.complex128),
        blocks[4][:size].reshape((n_maps, n_orders, sides, halves, 2, padded)),
        np.empty((2, padded)),
        np.empty((n_maps, 4 * (L + PADDING))),
    )
    _fill_orders(
        first_m,
        stop_m,
        L,
        lowest,
        sides,
        flm,
        weights,
        runs,
        mixing,
        rings,
        windows,
        tables,
        room,
        place,
        columns,
    )


@inner
def _load_rows(run, slot, m, place, low, high, n_rings, columns, stride, rows):
    """Copy one series' rings of order sigma m into two rows, zero beyond the last ring."""
    i, sigma, mirrored = run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    total, first = columns.shape[2], place[2]
    source = columns[i, m - place[0] if sigma > 0 or m == 0 else place[1] - m]
    last = min(high, n_rings)
    for r in range(low, last):
        value = source[total - 1 - r if mirrored == 1 else first + r]
        rows[r] = value.real
        rows[stride + r] = value.imag
    # The equator of a symmetric grid is its own mirror image: it counts once.
    if mirrored == 1 and 2 * last - 1 == total:
        last -= 1
    rows[last:high] = 0.0
    rows[stride + last : stride + high] = 0.0


@inner
def _load_series(run, m, sides, place, low, high, n_rings, columns, stride, places, rows):
    """Copy all series of a run; return their number."""
    active = _count_active(run, m, sides)
    total = columns.shape[0] * active
    for t in range(total + (total & 1)):
        start = 2 * t * stride
        places[t // 2, t % 2] = start
        if t == total:
            rows[start : start + 2 * stride] = 0.0
        else:
            slot, given = _slot_of(run, m, sides, t % active), columns[t // active]
            _load_rows(run, slot, m, place, low, high, n_rings, given, stride, rows[start:])
    return total


@inner
def _collect(run, slot, k, columns_used, m, L, lowest, weights, scale, sums, flm):
    """f_{l, sigma m} += sign_l scale_l weight_l times the sums of one series."""
    n, i, sigma, mirrored = run[0], run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    sign, alternates = _series_sign(sigma, mirrored, m, n)
    target = i if flm.shape[0] > 1 else 0
    for el in range(max(m, abs(n), lowest), L):
        factor = sign * scale[el]
        if alternates and el & 1:
            factor = -factor
        place = el * columns_used + k
        value = complex(sums[place], sums[place + 1])
        flm[target, el * el + el + sigma * m] += factor * weights[i, el] * value


@inner
def _add_orders(
    first_m,
    stop_m,
    L,
    lowest,
    sides,
    columns,
    weights,
    runs,
    rings,
    windows,
    tables,
    room,
    place,
    flm,
):
    """Add to the coefficients of some orders; ``room`` is what the caller allocates."""
    recursion, (sums, lanes), blocks, (powers, starts) = room
    (before, now, scale, g, masked), work, values, places, rows = blocks
    n_runs, padded = runs.shape[0], rings[0].size
    for m in range(first_m, stop_m):
        filled = 2 * L
        is_new = m == first_m or m % M_CHUNK == 0
        low, high = windows[0, m], windows[1, m]
        covered = low + (high - low + RINGS - 1) // RINGS * RINGS
        for j in range(n_runs):
            run = runs[j]
            n = run[0]
            first = max(m, abs(n))
            is_empty = first >= L or high <= low
            if not is_empty:
                # The last block of any later m, too, ends there.
                stop = high + RINGS
                prepare_start(m, n, is_new, tables[1], rings[:3], low, stop, powers, starts[j])
            if is_empty:
                continue
            total = _load_series(
                run, m, sides, place, low, covered, padded - RINGS, columns, padded, places, rows
            )
            if total == 0:
                continue
            _prepare_recursion(m, n, L, filled == -n and n != 0, tables, recursion)
            filled = n
            a, exponents = recursion[0], recursion[2]
            active, columns_used = total // columns.shape[0], min(2 * total, 4)
            used = places[: (total + 1) // 2]
            from_place, to_place = first * columns_used, (L + PADDING) * columns_used
            sums[: used.shape[0], from_place:to_place] = 0.0
            if total <= 2:
                lanes[from_place * WIDTH : to_place * WIDTH] = 0.0
            for start in range(low, high, RINGS):
                inside = load_start(starts[j], start, 1.0, before, now, scale)
                is_north = _load_argument(rings, start, work)
                shift = recursion[3] if is_north else recursion[4]
                if total <= 2:
                    copy_rows(rows, columns_used, start, used, padded, g)
                    add_block_to_degrees(
                        first,
                        lowest,
                        L,
                        columns_used,
                        PADDING,
                        inside,
                        a,
                        shift,
                        g,
                        masked,
                        work[3 * RINGS : 4 * RINGS],
                        before,
                        now,
                        scale,
                        lanes,
                    )
                else:
                    add_quartets_to_degrees(
                        first,
                        lowest,
                        L,
                        PADDING,
                        inside,
                        start,
                        used,
                        padded,
                        a,
                        shift,
                        rows,
                        work,
                        values,
                        sums,
                    )
            if total <= 2:
                add_up_lanes(lanes, from_place, L * columns_used, sums[0])
            for t in range(total):
                slot, k, target = _slot_of(run, m, sides, t % active), 2 * (t % 2), flm[t // active]
                _collect(
                    run,
                    slot,
                    k,
                    columns_used,
                    m,
                    L,
                    lowest,
                    weights,
                    exponents,
                    sums[t // 2],
                    target,
                )


@kernel
def add_columns_to_harmonics(
    first_m, stop_m, L, lowest, sides, columns, weights, runs, rings, windows, tables, place, flm
):
    """f_lm += sum_i weights[i, l] sum_ring d^l_{m, n_i}(theta) columns[., i, m, ring].

    columns: (maps, at least orders, rows, all rings); flm: (maps, 1 or orders, at least L*L); the
    rest as in `fill_columns`, whose adjoint this is for conjugated weights and no mixing.
    """
    n_maps, padded = flm.shape[0], rings[0].size
    room = (
        _recursion_room(L),
        (np.empty((n_maps, 4 * (L + PADDING))), np.empty(4 * WIDTH * (L + PADDING))),
        _block_room(n_maps, 4 * n_maps * padded),
        (np.empty((6, padded)), np.empty((runs.shape[0], 2, padded))),
    )
    _add_orders(
        first_m,
        stop_m,
        L,
        lowest,
        sides,
        columns,
        weights,
        runs,
        rings,
        windows,
        tables,
        room,
        place,
        flm,
    )
