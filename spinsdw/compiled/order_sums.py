"""From harmonic coefficients to the Fourier series of every ring, and back, for a range of m.

A *run* is one pass of the recursion at (m, n), m >= 0. One value d^l_mn(theta) serves up to two
complex series F_i(sigma m), sigma = +-1, of orders n_i at theta or at the mirrored ring pi - theta:

    sigma  ring      needs     d of the series
    +      theta     n_i =  n  d^l_mn
    -      theta     n_i = -n  (-1)^(m - n) d^l_mn
    +      mirrored  n_i = -n  (-1)^(l + m) d^l_mn
    -      mirrored  n_i =  n  (-1)^(l + n) d^l_mn

``runs`` has one row a run: n, then (i, sigma, mirrored) twice, i = -1 for "no series". Arrays
``series[i, side, mirrored, part, ring]`` hold real and imaginary parts apart, side 1 for -m.
"""

from __future__ import annotations

import numpy as np

from spinsdw.compiled.jit import kernel
from spinsdw.compiled.ring_sums import add_block_to_degrees, sum_block
from spinsdw.compiled.vectors import ADJOINT_RINGS, RINGS, WIDTH
from spinsdw.compiled.wigner_recursion import (
    PADDING,
    fill_powers,
    fill_recursion,
    fill_start,
    multiply_powers,
    start_norm,
)

__all__ = ["M_CHUNK", "add_spectra_to_harmonics", "fill_ring_spectra"]

# Powers of sin(theta) are carried from m to m + 1 and computed anew at every multiple of M_CHUNK,
# so that results do not depend on how a caller splits the range of m (at multiples of it).
M_CHUNK = 16


@kernel
def _fill_order_powers(m, n, rings, sines, sine_powers, ones, one_powers):
    """Fill sin(theta)^(M - |K|) and (1 +- cos(theta))^|K|: all of d^M_mn that depends on theta."""
    sine, plus, minus = rings[0], rings[1], rings[2]
    n_abs = abs(n)
    fill_powers(sine, abs(m - n_abs), sines, sine_powers)
    fill_powers(plus if n >= 0 else minus, min(m, n_abs), ones, one_powers)


@kernel
def _advance_order_powers(m, n, rings, sines, sine_powers, ones, one_powers):
    """Bring the powers from m - 1 to m."""
    if m > abs(n):
        multiply_powers(rings[0], sines, sine_powers)
    else:
        _fill_order_powers(m, n, rings, sines, sine_powers, ones, one_powers)


@kernel
def _signed_norm(m, n, central):
    """Return the factor of the closed form of d^M_mn that does not depend on theta."""
    n_abs = abs(n)
    if m >= n_abs:
        value, power = start_norm(m, n, central)
        odd = (m - n) & 1
    else:
        value, power = start_norm(n_abs, m, central)
        odd = ((n_abs - m) & 1) if n < 0 else 0
    return (-value if odd else value), power


@kernel
def _series_sign(sigma, mirrored, m, n):
    """Return (constant sign, whether (-1)^l is a factor) of the table above."""
    if mirrored == 0:
        exponent = 0 if sigma > 0 else m - n
    else:
        exponent = m if sigma > 0 else n
    return (-1.0 if exponent & 1 else 1.0), mirrored == 1


@kernel
def _is_active(run, slot, m, two_sided):
    i, sigma = run[1 + 3 * slot], run[2 + 3 * slot]
    return i >= 0 and (sigma > 0 or (m > 0 and two_sided))


@kernel
def _fill_column(run, slot, k, columns, m, L, lowest, flm, weights, scale, c):
    """c[l, k] + i c[l, k + 1] = sign_l scale_l weight_l f_{l, sigma m} for one series."""
    n, i, sigma, mirrored = run[0], run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    sign, alternates = _series_sign(sigma, mirrored, m, n)
    source = i if flm.shape[0] > 1 else 0
    first = max(m, abs(n))
    signed_m = sigma * m
    for el in range(first, L):
        factor = sign * scale[el]
        if alternates and el & 1:
            factor = -factor
        value = factor * weights[i, el] * flm[source, el * el + el + signed_m]
        if el < lowest:
            value = 0.0j
        c[el * columns + k] = value.real
        c[el * columns + k + 1] = value.imag
    for place in range(L * columns, (L + PADDING) * columns):
        c[place] = 0.0


@kernel
def _shift_argument(first, L, a, b, north, south):
    """Rewrite a cos + b as a (cos - 1) + north and a (cos + 1) + south.

    Near a pole cos(theta) is 1 minus something small, and its rounding error would be a wrong
    theta, the same at every degree: a phase error growing with l. The shifted argument is exact.
    """
    for el in range(first, L):
        north[el] = b[el] + a[el]
        south[el] = b[el] - a[el]
    for el in range(L, L + PADDING):
        a[el] = 0.0
        north[el] = 0.0
        south[el] = 0.0


@kernel
def _store_block(run, slot, k, start, stop, sums, series):
    i, sigma, mirrored = run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    target = series[i, 0 if sigma > 0 else 1, mirrored]
    for r in range(start, stop):
        target[0, r] = sums[k * RINGS + r - start]
        target[1, r] = sums[(k + 1) * RINGS + r - start]


@kernel
def _mix_into_spectra(m, n_rings, mixing, series, mirrored, spectra):
    """spectra[k, ring, +-m] = sum_i mixing[k, i] series[i]; a mirrored ring counts from the end."""
    n_out, n_orders = mixing.shape
    phis = spectra.shape[2]
    sides = 2 if m > 0 and series.shape[1] > 1 else 1
    for half in range(mirrored + 1):
        for side in range(sides):
            place = m if side == 0 else phis - m
            for k in range(n_out):
                for r in range(n_rings):
                    ring = r if half == 0 else spectra.shape[1] - 1 - r
                    value = 0.0j
                    for i in range(n_orders):
                        part = series[i, side, half]
                        value += mixing[k, i] * complex(part[0, r], part[1, r])
                    spectra[k, ring, place] = value


@kernel
def fill_ring_spectra(
    first_m, stop_m, L, lowest, sides, flm, weights, runs, mixing, rings, windows, tables, spectra
):
    """Fill spectra[k, ring, m] = sum_i mixing[k, i] sum_l weights[i, l] f_lm d^l_{m, n_i}(theta).

    flm: (1 or orders, L*L); weights: (orders, L) complex; mixing: (outputs, orders) complex;
    rings: (sin, 1 + cos, 1 - cos, cos - 1) of the computed rings, padded to whole blocks; windows:
    (2, L) first and last ring that matter at each m; tables: (sqrt(k), central binomials);
    spectra: (outputs, rings, phi), -m at phi - m, for ``sides`` = 2; m >= 0 only for ``sides`` = 1.
    """
    root, central = tables
    n_orders = weights.shape[0]
    n_runs = runs.shape[0]
    two_sided = sides == 2
    mirrored = runs[:, 3].max() if n_runs > 0 else 0
    mirrored = max(mirrored, runs[:, 6].max())
    padded = rings[0].size
    n_rings = padded - RINGS
    a, b = np.empty(L + PADDING), np.empty(L)
    north, south = np.empty(L + PADDING), np.empty(L + PADDING)
    scale = np.empty(L + 1)
    c = np.empty(4 * (L + PADDING))
    before, now, exponents = np.empty(RINGS), np.empty(RINGS), np.empty(RINGS)
    sums = np.empty(4 * RINGS)
    powers = np.empty((n_runs, 4, padded))
    series = np.zeros((n_orders, 2 if two_sided else 1, mirrored + 1, 2, padded))
    for m in range(first_m, stop_m):
        series[:] = 0.0
        low, high = windows[0, m], windows[1, m]
        for j in range(n_runs):
            run, p = runs[j], powers[j]
            n = run[0]
            first = max(m, abs(n))
            if m == first_m or m % M_CHUNK == 0:
                _fill_order_powers(m, n, rings, p[0], p[1], p[2], p[3])
            else:
                _advance_order_powers(m, n, rings, p[0], p[1], p[2], p[3])
            active = (_is_active(run, 0, m, two_sided), _is_active(run, 1, m, two_sided))
            if first >= L or not (active[0] or active[1]):
                continue
            columns = 4 if active[0] and active[1] else 2
            fill_recursion(m, n, L, root, a, b, scale)
            _shift_argument(first, L, a, b, north, south)
            if active[0]:
                _fill_column(run, 0, 0, columns, m, L, lowest, flm, weights, scale, c)
            if active[1]:
                _fill_column(run, 1, columns - 2, columns, m, L, lowest, flm, weights, scale, c)
            norm, norm_power = _signed_norm(m, n, central)
            for start in range(low, high, RINGS):
                stop = start + RINGS
                fill_start(
                    norm,
                    norm_power,
                    p[0, start:stop],
                    p[1, start:stop],
                    p[2, start:stop],
                    p[3, start:stop],
                    before,
                    now,
                    exponents,
                )
                is_north = rings[2][start] < 1.0
                x = (rings[3] if is_north else rings[1])[start:stop]
                shift = north if is_north else south
                sum_block(first, lowest, L, columns, a, shift, c, x, before, now, exponents, sums)
                if active[0]:
                    _store_block(run, 0, 0, start, stop, sums, series)
                if active[1]:
                    _store_block(run, 1, columns - 2, start, stop, sums, series)
        _mix_into_spectra(m, n_rings, mixing, series, mirrored, spectra)


@kernel
def _load_block(run, slot, k, m, start, n_rings, spectra, g):
    """Copy one series' rings of order sigma m into g, zero beyond the last ring."""
    i, sigma, mirrored = run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    total = spectra.shape[2]
    source = spectra[i, m if sigma > 0 or m == 0 else spectra.shape[1] - m]
    for r in range(ADJOINT_RINGS):
        ring = start + r
        value = 0.0j
        if ring < n_rings and not (mirrored == 1 and 2 * ring + 1 == total):
            # The equator of a symmetric grid is its own mirror image: counted once.
            value = source[total - 1 - ring if mirrored == 1 else ring]
        g[k * ADJOINT_RINGS + r] = value.real
        g[(k + 1) * ADJOINT_RINGS + r] = value.imag


@kernel
def _collect_column(run, slot, k, columns, m, L, lowest, weights, scale, sums, flm):
    """f_{l, sigma m} += sign_l scale_l weight_l times the summed lanes of one series."""
    n, i, sigma, mirrored = run[0], run[1 + 3 * slot], run[2 + 3 * slot], run[3 + 3 * slot]
    sign, alternates = _series_sign(sigma, mirrored, m, n)
    target = i if flm.shape[0] > 1 else 0
    for el in range(max(m, abs(n), lowest), L):
        factor = sign * scale[el]
        if alternates and el & 1:
            factor = -factor
        real, imaginary = 0.0, 0.0
        place = (el * columns + k) * WIDTH
        for lane in range(WIDTH):
            real += sums[place + lane]
            imaginary += sums[place + WIDTH + lane]
        flm[target, el * el + el + sigma * m] += (
            factor * weights[i, el] * complex(real, imaginary)
        )


@kernel
def add_spectra_to_harmonics(
    first_m, stop_m, L, lowest, sides, spectra, weights, runs, rings, windows, tables, flm
):
    """f_lm += sum_i weights[i, l] sum_ring d^l_{m, n_i}(theta) spectra[i, m, ring].

    spectra: (orders, phi, rings), -m at phi - m, or m >= 0 only for ``sides`` = 1; flm: (1 or orders, L*L); the rest as in `fill_ring_spectra`, whose adjoint this is
    for conjugated weights.
    """
    root, central = tables
    n_runs = runs.shape[0]
    two_sided = sides == 2
    padded = rings[0].size
    n_rings = padded - ADJOINT_RINGS
    a, b = np.empty(L + PADDING), np.empty(L)
    north, south = np.empty(L + PADDING), np.empty(L + PADDING)
    scale = np.empty(L + 1)
    sums = np.empty(4 * WIDTH * (L + PADDING))
    before, now, exponents = (
        np.empty(ADJOINT_RINGS),
        np.empty(ADJOINT_RINGS),
        np.empty(ADJOINT_RINGS),
    )
    g, masked = np.empty(4 * ADJOINT_RINGS), np.empty(4 * ADJOINT_RINGS)
    powers = np.empty((n_runs, 4, padded))
    for m in range(first_m, stop_m):
        low, high = windows[0, m], windows[1, m]
        for j in range(n_runs):
            run, p = runs[j], powers[j]
            n = run[0]
            first = max(m, abs(n))
            if m == first_m or m % M_CHUNK == 0:
                _fill_order_powers(m, n, rings, p[0], p[1], p[2], p[3])
            else:
                _advance_order_powers(m, n, rings, p[0], p[1], p[2], p[3])
            active = (_is_active(run, 0, m, two_sided), _is_active(run, 1, m, two_sided))
            if first >= L or not (active[0] or active[1]):
                continue
            columns = 4 if active[0] and active[1] else 2
            fill_recursion(m, n, L, root, a, b, scale)
            _shift_argument(first, L, a, b, north, south)
            for place in range(first * columns * WIDTH, (L + PADDING) * columns * WIDTH):
                sums[place] = 0.0
            norm, norm_power = _signed_norm(m, n, central)
            for start in range(low, high, ADJOINT_RINGS):
                stop = start + ADJOINT_RINGS
                fill_start(
                    norm,
                    norm_power,
                    p[0, start:stop],
                    p[1, start:stop],
                    p[2, start:stop],
                    p[3, start:stop],
                    before,
                    now,
                    exponents,
                )
                if active[0]:
                    _load_block(run, 0, 0, m, start, n_rings, spectra, g)
                if active[1]:
                    _load_block(run, 1, columns - 2, m, start, n_rings, spectra, g)
                is_north = rings[2][start] < 1.0
                x = (rings[3] if is_north else rings[1])[start:stop]
                shift = north if is_north else south
                add_block_to_degrees(
                    first, lowest, L, columns, a, shift, g, masked, x, before, now, exponents, sums
                )
            if active[0]:
                _collect_column(run, 0, 0, columns, m, L, lowest, weights, scale, sums, flm)
            if active[1]:
                _collect_column(
                    run, 1, columns - 2, columns, m, L, lowest, weights, scale, sums, flm
                )
