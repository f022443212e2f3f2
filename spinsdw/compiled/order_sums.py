"""From harmonic coefficients to the Fourier columns of every ring, and back, for a range of m.

A *run* is one pass of the recursion at (m, n), m >= 0. One value d^l_mn(theta) serves up to two
complex series F_i(sigma m), sigma = +-1, of orders n_i at theta or at the mirrored ring pi - theta:

    sigma  ring      needs     d of the series
    +      theta     n_i =  n  d^l_mn
    -      theta     n_i = -n  (-1)^(m - n) d^l_mn
    +      mirrored  n_i = -n  (-1)^(l + m) d^l_mn
    -      mirrored  n_i =  n  (-1)^(l + n) d^l_mn

``runs`` has one row a run: n, then (i, sigma, mirrored) twice, i = -1 for "no series". Columns are
complex arrays [k, m, ring], -m at place n_m - m.
"""

from __future__ import annotations

import numpy as np

from spinsdw.compiled.jit import inner, kernel
from spinsdw.compiled.ring_sums import add_block_to_degrees, sum_block
from spinsdw.compiled.vectors import RINGS, WIDTH, sum_lanes
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
    """gathered[source, side, l] = f_{l, +-m}, next to each other for neighbouring degrees."""
    for source in range(flm.shape[0]):
        for side in range(gathered.shape[1]):
            signed_m = m if side == 0 else -m
            for el in range(m, L):
                gathered[source, side, el] = flm[source, el * el + el + signed_m]


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
def _store_block(run, slot, k, start, sums, series):
    target = series[run[1 + 3 * slot], 0 if run[2 + 3 * slot] > 0 else 1, run[3 + 3 * slot]]
    for r in range(RINGS):
        target[0, start + r] = sums[k * RINGS + r]
        target[1, start + r] = sums[(k + 1) * RINGS + r]


@inner
def _clear(run, slot, low, high, series):
    """Set to zero what a run does not compute: rings before ``low`` and from ``high`` on."""
    target = series[run[1 + 3 * slot], 0 if run[2 + 3 * slot] > 0 else 1, run[3 + 3 * slot]]
    for part in range(2):
        target[part, :low] = 0.0
        target[part, high:] = 0.0


@inner
def _mix_series(m, n_rings, mixing, series, mixed, columns):
    """columns[k, +-m, ring] = sum_i mixing[k, i] series[i]; a mirrored ring counts from the end."""
    n_out, n_orders = mixing.shape
    n_m, total = columns.shape[1], columns.shape[2]
    for half in range(series.shape[2]):
        for side in range(2 if m > 0 and series.shape[1] > 1 else 1):
            for k in range(n_out):
                out = columns[k, m if side == 0 else n_m - m]
                mixed[:] = 0.0
                for i in range(n_orders):
                    p, q = mixing[k, i].real, mixing[k, i].imag
                    real, imaginary = series[i, side, half, 0], series[i, side, half, 1]
                    for r in range(n_rings):
                        mixed[0, r] += p * real[r] - q * imaginary[r]
                        mixed[1, r] += p * imaginary[r] + q * real[r]
                if half == 0:
                    for r in range(n_rings):
                        out[r] = complex(mixed[0, r], mixed[1, r])
                else:
                    for r in range(n_rings):
                        out[total - 1 - r] = complex(mixed[0, r], mixed[1, r])


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


@kernel
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
    columns,
):
    """Fill the columns of some orders; ``room`` is what `fill_columns` allocates."""
    recursion, c, sums, state, powers, starts, gathered, series, mixed = room
    n_runs, padded = runs.shape[0], rings[0].size
    for m in range(first_m, stop_m):
        _gather(m, L, flm, gathered)
        is_new = m == first_m or m % M_CHUNK == 0
        low, high = windows[0, m], windows[1, m]
        covered = low + (high - low + RINGS - 1) // RINGS * RINGS if high > low else low
        filled = 2 * L
        for j in range(n_runs):
            run = runs[j]
            n = run[0]
            first = max(m, abs(n))
            is_empty = first >= L or high <= low
            if not is_empty:
                # The last block of any later m, too, ends there.
                stop = high + RINGS
                prepare_start(m, n, is_new, tables[1], rings, low, stop, powers, starts[j])
            columns_used = 0
            for slot in range(2):
                if _is_active(run, slot, m, sides):
                    columns_used += 2
                    _clear(run, slot, padded if is_empty else low, covered, series)
            if columns_used == 0 or is_empty:
                continue
            _prepare_recursion(m, n, L, filled == -n and n != 0, tables, recursion)
            filled = n
            a, scale = recursion[0], recursion[2]
            for slot in range(2):
                if _is_active(run, slot, m, sides):
                    k = columns_used - 2 if slot == 1 else 0
                    _fill_coefficients(
                        run, slot, k, columns_used, m, L, lowest, gathered, weights, scale, c
                    )
            for start in range(low, high, RINGS):
                inside = load_start(starts[j], start, 1.0, state[0], state[1], state[2])
                is_north = rings[2][start] < 1.0
                x = (rings[3] if is_north else rings[1])[start : start + RINGS]
                shift = recursion[3] if is_north else recursion[4]
                sum_block(
                    first,
                    lowest,
                    L,
                    columns_used,
                    PADDING,
                    inside,
                    a,
                    shift,
                    c,
                    x,
                    state[0],
                    state[1],
                    state[2],
                    sums,
                )
                for slot in range(2):
                    if _is_active(run, slot, m, sides):
                        k = columns_used - 2 if slot == 1 else 0
                        _store_block(run, slot, k, start, sums, series)
        _mix_series(m, padded - RINGS, mixing, series, mixed, columns)


@kernel
def fill_columns(
    first_m, stop_m, L, lowest, sides, flm, weights, runs, mixing, rings, windows, tables, columns
):
    """Fill columns[k, m, ring] = sum_i mixing[k, i] sum_l weights[i, l] f_lm d^l_{m, n_i}(theta).

    flm: (1 or orders, L*L); weights: (orders, L) complex; mixing: (outputs, orders) complex;
    rings: (sin, 1 + cos, 1 - cos, cos - 1) of the computed rings and RINGS more; windows: (2, L)
    first and last ring that matter at each m; tables: (sqrt(k), central binomials, 1 / k); columns:
    (outputs, n_m, all rings), of m >= 0 only for ``sides`` = 1.
    """
    n_orders, n_runs = weights.shape[0], runs.shape[0]
    mirrored = max(runs[:, 3].max(), runs[:, 6].max())
    padded = rings[0].size
    room = (
        _recursion_room(L),
        np.empty(4 * (L + PADDING)),
        np.empty(4 * RINGS),
        np.empty((3, RINGS)),
        np.empty((6, padded)),
        np.empty((n_runs, 2, padded)),
        np.empty((flm.shape[0], sides, L), dtype=np.complex128),
        np.zeros((n_orders, sides, mirrored + 1, 2, padded)),
        np.empty((2, padded)),
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
        columns,
    )


@inner
def _load_block(run, slot, k, m, start, n_rings, columns, g):
    """Copy one series' rings of order sigma m into g, zero beyond the last ring."""
    i, sigma, mirrored = run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    total = columns.shape[2]
    source = columns[i, m if sigma > 0 or m == 0 else columns.shape[1] - m]
    for r in range(RINGS):
        ring = start + r
        value = 0.0j
        # The equator of a symmetric grid is its own mirror image: it counts once.
        if ring < n_rings and not (mirrored == 1 and 2 * ring + 1 == total):
            value = source[total - 1 - ring if mirrored == 1 else ring]
        g[k * RINGS + r] = value.real
        g[(k + 1) * RINGS + r] = value.imag


@inner
def _collect(run, slot, k, columns_used, m, L, lowest, weights, scale, sums, flm):
    """f_{l, sigma m} += sign_l scale_l weight_l times the summed lanes of one series."""
    n, i, sigma, mirrored = run[0], run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    sign, alternates = _series_sign(sigma, mirrored, m, n)
    target = i if flm.shape[0] > 1 else 0
    for el in range(max(m, abs(n), lowest), L):
        factor = sign * scale[el]
        if alternates and el & 1:
            factor = -factor
        place = (el * columns_used + k) * WIDTH
        value = complex(sum_lanes(sums, place), sum_lanes(sums, place + WIDTH))
        flm[target, el * el + el + sigma * m] += factor * weights[i, el] * value


@inner
def _add_orders(
    first_m, stop_m, L, lowest, sides, columns, weights, runs, rings, windows, tables, room, flm
):
    """Add to the coefficients of some orders; ``room`` is what the caller allocates."""
    recursion, sums, g, masked, state, powers, starts = room
    n_runs, padded = runs.shape[0], rings[0].size
    for m in range(first_m, stop_m):
        is_new = m == first_m or m % M_CHUNK == 0
        low, high = windows[0, m], windows[1, m]
        filled = 2 * L
        for j in range(n_runs):
            run = runs[j]
            n = run[0]
            first = max(m, abs(n))
            is_empty = first >= L or high <= low
            if not is_empty:
                # The last block of any later m, too, ends there.
                stop = high + RINGS
                prepare_start(m, n, is_new, tables[1], rings, low, stop, powers, starts[j])
            columns_used = 0
            for slot in range(2):
                columns_used += 2 if _is_active(run, slot, m, sides) else 0
            if columns_used == 0 or is_empty:
                continue
            _prepare_recursion(m, n, L, filled == -n and n != 0, tables, recursion)
            filled = n
            a, scale = recursion[0], recursion[2]
            sums[first * columns_used * WIDTH : (L + PADDING) * columns_used * WIDTH] = 0.0
            for start in range(low, high, RINGS):
                inside = load_start(starts[j], start, 1.0, state[0], state[1], state[2])
                for slot in range(2):
                    if _is_active(run, slot, m, sides):
                        k = columns_used - 2 if slot == 1 else 0
                        _load_block(run, slot, k, m, start, padded - RINGS, columns, g)
                is_north = rings[2][start] < 1.0
                x = (rings[3] if is_north else rings[1])[start : start + RINGS]
                shift = recursion[3] if is_north else recursion[4]
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
                    x,
                    state[0],
                    state[1],
                    state[2],
                    sums,
                )
            for slot in range(2):
                if _is_active(run, slot, m, sides):
                    k = columns_used - 2 if slot == 1 else 0
                    _collect(run, slot, k, columns_used, m, L, lowest, weights, scale, sums, flm)


@kernel
def add_columns_to_harmonics(
    first_m, stop_m, L, lowest, sides, columns, weights, runs, rings, windows, tables, flm
):
    """f_lm += sum_i weights[i, l] sum_ring d^l_{m, n_i}(theta) columns[i, m, ring].

    columns: (at least orders, n_m, all rings); flm: (1 or orders, L*L); the rest as in
    `fill_columns`, whose adjoint this is for conjugated weights and no mixing.
    """
    room = (
        _recursion_room(L),
        np.empty(4 * WIDTH * (L + PADDING)),
        np.empty(4 * RINGS),
        np.empty(4 * RINGS),
        np.empty((3, RINGS)),
        np.empty((6, rings[0].size)),
        np.empty((runs.shape[0], 2, rings[0].size)),
    )
    _add_orders(
        first_m, stop_m, L, lowest, sides, columns, weights, runs, rings, windows, tables, room, flm
    )
