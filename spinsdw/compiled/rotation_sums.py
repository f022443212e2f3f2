"""Rotation of coefficients about the y axis: g_lm = sum_k d^l_mk(beta) f_lk, row m by row m.

With r_l(k) = sqrt(l^2 - k^2), the recursion of `wigner_recursion` for d^l_mk = s_l u_l has

    s_l = tau_l sigma_l(m) sigma_l(k) ,   tau_l tau_{l-1} = l ,   sigma_l sigma_{l-1} r_l = 1 ,
    u_{l+1} = (2l + 1) tau'_l rho_l(m) rho_l(k) (cos(beta) - m k / (l (l + 1))) u_l - u_{l-1} ,

with rho_l = sigma_l / (r_{l+1} sigma_{l+1}) and tau'_l = (l + 1) tau_l / tau_{l+1}, from the values
as they were rounded. The factor is rho_l(k) times one of (l, m), plus k times another. So orders k
run in vectors, and +-k share a lane: with v = u_{m,k} and w = (-1)^k u_{m,-k}, the rows m and -m
are the sum and the difference of

    sum_k (v + w) (f_k + (-1)^k f_{-k}) / 2   and   sum_k (v - w) (f_k - (-1)^k f_{-k}) / 2 ;

of a real field the first is real and the second imaginary. Degrees are taken `CHUNK` at a time:
block (chunk, tile) holds rho, the coefficients and sigma of LANES orders k. Lanes that start far
below the range of doubles carry an exponent: true values are u 2**(512 scale), in range at scale 0.
A lane out of range is below 2**-256 and in one chunk grows by less than 2**150: it adds nothing.
"""

from __future__ import annotations

import math

import numpy as np

from spinsdw.compiled.jit import inner, kernel
from spinsdw.compiled.rotation_tile import (
    CHUNK,
    LANES,
    add_to_orders_2,
    add_to_orders_4,
    advance_orders_2,
    advance_orders_4,
)
from spinsdw.compiled.vectors import WIDTH, sum_lanes

__all__ = ["CHUNK", "LANES", "fill_blocks", "fill_rotated"]

_SHRINK = 2.0**-512
_LIMIT = 2.0**192
_RENORM = 2.0**256
_UNRENORM = 2.0**-256


@inner
def _fill_scales(m, L, root, sigma, rho):
    """Fill sigma_l(m) and rho_l(m), m <= l < L, zero below; root[k] = sqrt(k)."""
    sigma[:m] = 0.0
    rho[:m] = 0.0
    sigma[m] = 1.0 / math.sqrt(root[2 * m + 1])
    sigma[m + 1] = sigma[m]
    radius = root[2 * m + 1]
    rho[m] = 1.0 / radius
    for el in range(m + 1, L):
        after = root[el + 1 - m] * root[el + 1 + m]
        sigma[el + 1] = sigma[el - 1] * radius / after
        rho[el] = sigma[el] / (after * sigma[el + 1])
        radius = after


@kernel
def fill_blocks(tile, L, is_real, flm, phases, tables, starts, blocks):
    """Fill the blocks (chunk, tile) of every chunk: rho, the coefficients in columns, sigma.

    phases: e^{-i k gamma}, k < L; tables: tau_l, l <= L, and sqrt(k), k <= 2 L; starts: number of
    the first block of each chunk.
    """
    tau, root = tables
    sigma, rho = np.zeros((LANES, L + 1)), np.zeros((LANES, L))
    for r in range(min(LANES, L - tile * LANES)):
        _fill_scales(tile * LANES + r, L, root, sigma[r], rho[r])
    last = blocks.shape[2] - 1
    for chunk in range(tile * LANES // CHUNK, starts.size - 1):
        block = blocks[starts[chunk] + tile]
        block[:] = 0.0
        for i in range(min(CHUNK, L - chunk * CHUNK)):
            el = chunk * CHUNK + i
            centre = el * el + el
            for r in range(min(LANES, el + 1 - tile * LANES)):
                k = tile * LANES + r
                scale = 0.5 * sigma[r, el] * tau[el]
                plus = scale * phases[k] * flm[centre + k]
                minus = scale * phases[k].conjugate() * flm[centre - k]
                minus = -minus if k & 1 else minus
                block[i, 0, r] = rho[r, el]
                block[i, last, r] = sigma[r, el]
                if is_real:
                    block[i, 1, r] = 2.0 * plus.real
                    block[i, 2, r] = 2.0 * plus.imag if k > 0 else 0.0
                else:
                    block[i, 1, r] = plus.real + minus.real
                    block[i, 2, r] = plus.imag + minus.imag
                    block[i, 3, r] = plus.real - minus.real
                    block[i, 4, r] = plus.imag - minus.imag


@inner
def _power(base, exponent):
    """Return (v, e), v 2**e = base**exponent, e a multiple of 256, for a base in [0, 1]."""
    value, power = 1.0, 0.0
    square, square_power = base, 0.0
    while exponent > 0:
        if exponent & 1:
            value *= square
            power += square_power
            if 0.0 < value < _UNRENORM:
                value *= _RENORM
                power -= 256.0
        square *= square
        square_power *= 2.0
        if 0.0 < square < _UNRENORM:
            square *= _RENORM
            square_power -= 256.0
        exponent >>= 1
    return value, power


@inner
def _balance(value, power):
    """Bring the size of a mantissa below 1 and, where it is not zero, above 2**-256."""
    size = abs(value)
    if 0.0 < size < _UNRENORM:
        return value * _RENORM, power - 256.0
    if size > 1.0 and power < 0.0:
        return value * _UNRENORM, power + 256.0
    return value, power


@inner
def _fill_starts(m, L, cosine, sine, tables, sigma, values, powers):
    """Fill the start of every recursion of row m: u = d^M_{m,+-k} / s_M at M = max(m, k).

    cosine, sine: of beta / 2; values, powers: (2, lanes), for k and -k; where k <= m, sigma_m(k) is
    left for later.
    """
    tau, root = tables
    # Along the row, from the end where it is largest: no power of a ratio above 1 is taken.
    side = 0 if cosine >= sine else 1
    large, small = max(cosine, sine), min(cosine, sine)
    ratio = small / large
    value, power = _power(large, 2 * m)
    for i in range(2 * m + 1):
        k = m - i if i <= m else i - m
        # The lane of k = 0 has no partner.
        at = 0 if k == 0 else (side if i <= m else 1 - side)
        values[at, k], powers[at, k] = value, power
        value *= -ratio * root[2 * m - i] / root[i + 1]
        value, power = _balance(value, power)
    for at in range(2):
        value, power = _power(cosine if at == 0 else sine, 2 * m)
        step = cosine * sine if at == 0 else -cosine * sine
        for k in range(m + 1, L):
            value *= step * (root[2 * k] * root[2 * k - 1]) / (root[k + m] * root[k - m])
            value, power = _balance(value, power)
            values[at, k], powers[at, k] = value, power
    for at in range(2):
        for k in range(L):
            el = max(m, k)
            norm = 1.0 if k <= m else math.sqrt(root[2 * k + 1])
            power = math.floor(powers[at, k] / 512.0)
            size = 1.0 if powers[at, k] == 512.0 * power else _RENORM
            sign = -1.0 if at == 1 and k & 1 else 1.0
            value = sign * values[at, k]
            values[at, k] = value * size * norm / (tau[el] * sigma[el])
            powers[at, k] = power if value != 0.0 else 0.0


@inner
def _start_tile(m, first, tile, row_sigma, values, powers, state, scales, row):
    """Set a tile to the degree ``first`` in whose chunk its lanes start; return those in range.

    Below l = max(m, k) the factor of the recursion is zero, which takes (before, now) to
    (now, -before): so a lane that is to be at (0, u) i degrees on begins i quarter turns back.
    row_sigma: sigma_m(k) of the tile's orders, wanted where k <= m.
    """
    inside = 0
    number = row * (values.shape[2] // LANES) + tile
    for r in range(LANES):
        k = tile * LANES + r
        norm = 1.0 / row_sigma[r] if k <= m else 1.0
        turns = (max(m, k) - first) & 3
        is_odd, sign = turns & 1, 1.0 if turns in (0, 3) else -1.0
        for at in range(2):
            value, power = sign * norm * values[row, at, k], powers[row, at, k]
            place = number * 8 * LANES + (0 if power == 0.0 else 4 * LANES) + 2 * at * LANES + r
            state[place] = value if is_odd else 0.0
            state[place + LANES] = 0.0 if is_odd else value
            scales[number * 2 * LANES + at * LANES + r] = power
            inside += 1 if power == 0.0 else 0
    return inside


@inner
def _enter(state, at, scales, inside):
    """Move lanes that have grown into range; return how many are in range.

    Lanes in range and lanes out of it have a state each, with zeros for the others.
    """
    out = at + 4 * LANES
    for side in range(2):
        for r in range(LANES):
            place = out + 2 * side * LANES + r
            if abs(state[place]) > _LIMIT or abs(state[place + LANES]) > _LIMIT:
                number = at // 4 + side * LANES + r
                state[place] *= _SHRINK
                state[place + LANES] *= _SHRINK
                scales[number] += 1.0
                if scales[number] == 0.0:
                    for target in (place, place + LANES):
                        state[target - 4 * LANES] = state[target]
                        state[target] = 0.0
                    inside += 1
    return inside


@inner
def _step(first_m, tile, columns, blocks, block, factors, state, scales, inside, sums):
    """Advance a tile of every row by one chunk and add the lanes that are in range."""
    n_rows, n_tiles = inside.shape
    for row in range(n_rows):
        factor, total = row * CHUNK * 3, row * CHUNK * columns * WIDTH
        at = (row * n_tiles + tile) * 8 * LANES
        out, first_k = at + 4 * LANES, 1.0 * (tile * LANES - first_m - row)
        count = inside[row, tile]
        if count > 0:
            if columns == 4:
                add_to_orders_4(blocks, block, factors, factor, first_k, state, at, sums, total)
            else:
                add_to_orders_2(blocks, block, factors, factor, first_k, state, at, sums, total)
        if count < 2 * LANES:
            if columns == 4:
                advance_orders_4(blocks, block, factors, factor, first_k, state, out, sums, total)
            else:
                advance_orders_2(blocks, block, factors, factor, first_k, state, out, sums, total)
            inside[row, tile] = _enter(state, at, scales, count)


@inner
def _fill_factors(m, first, L, shift, pole, tau, rho, factors):
    """Fill (2l+1) tau'_l rho_l(m) times cos(beta) -+ m^2 / (l (l+1)), and m / (l (l+1)).

    Where cos(beta) and m k / (l (l+1)) all but cancel, near a pole, k is near m: so the orders are
    counted from m, and the difference at m itself is one of whole numbers and a small remainder.
    """
    factors[:] = 0.0
    for i in range(max(0, m - first), min(CHUNK, L - first)):
        el = first + i
        scale = (2.0 * el + 1.0) * (el + 1.0) * tau[el] / tau[el + 1] * rho[el]
        whole = el * (el + 1.0)
        if el == 0:
            factors[i, 0] = scale * (pole + shift)
        else:
            scale /= whole
            factors[i, 0] = scale * ((pole * whole - m * m) + whole * shift)
            factors[i, 1] = scale * ((pole * whole + m * m) + whole * shift)
            factors[i, 2] = scale * m


@inner
def _store_chunk(m, row, first, L, columns, sigma, phase, sums, out):
    """Put the sums of one row and chunk into out[l, +-m]."""
    sign = -1.0 if m & 1 else 1.0
    for i in range(max(0, m - first), min(CHUNK, L - first)):
        el = first + i
        place = (row * CHUNK + i) * columns * WIDTH
        if columns == 2:
            even = complex(sum_lanes(sums, place), 0.0)
            odd = complex(0.0, sum_lanes(sums, place + WIDTH))
        else:
            even = complex(sum_lanes(sums, place), sum_lanes(sums, place + WIDTH))
            place += 2 * WIDTH
            odd = complex(sum_lanes(sums, place), sum_lanes(sums, place + WIDTH))
        centre = el * el + el
        out[centre + m] = sigma[el] * phase * (even + odd)
        if m > 0:
            out[centre - m] = sign * sigma[el] * phase.conjugate() * (even - odd)


@kernel
def fill_rotated(first_m, stop_m, L, angles, tables, phases, starts, blocks, out):
    """Fill out[l, +-m] for rows first_m <= m < stop_m, all in one chunk.

    angles: (cos, sin) of beta / 2; phases: e^{-i m alpha}; the rest as in `fill_blocks`.
    """
    n_rows, n_chunks = stop_m - first_m, starts.size - 1
    n_tiles = starts[n_chunks] - starts[n_chunks - 1]
    tau, root = tables[0], tables[1]
    cosine, sine = angles[0], angles[1]
    # The cosine as +-1 and a small remainder: near a pole its rounding would be an angle's.
    pole = 1.0 if cosine >= sine else -1.0
    shift = -2.0 * sine * sine if cosine >= sine else 2.0 * cosine * cosine
    values = np.zeros((n_rows, 2, n_tiles * LANES))
    powers = np.zeros((n_rows, 2, n_tiles * LANES))
    sigma, rho = np.empty((n_rows, L + 1)), np.empty((n_rows, L))
    for row in range(n_rows):
        m = first_m + row
        _fill_scales(m, L, root, sigma[row], rho[row])
        _fill_starts(m, L, cosine, sine, tables, sigma[row], values[row], powers[row])
    state, scales = np.zeros(n_rows * n_tiles * 8 * LANES), np.zeros(n_rows * n_tiles * 2 * LANES)
    inside = np.zeros((n_rows, n_tiles), dtype=np.int64)
    columns = blocks.shape[2] - 2
    sums = np.empty((n_rows, CHUNK, columns, WIDTH))
    factors = np.empty((n_rows, CHUNK, 3))
    flat_blocks, flat_sums, flat_factors = blocks.ravel(), sums.ravel(), factors.ravel()
    for chunk in range(first_m // CHUNK, n_chunks):
        first = chunk * CHUNK
        sums[:] = 0.0
        for row in range(n_rows):
            _fill_factors(first_m + row, first, L, shift, pole, tau, rho[row], factors[row])
        for tile in range(starts[chunk + 1] - starts[chunk]):
            number = starts[chunk] + tile
            if max(tile * LANES, first_m) >= first:
                for row in range(n_rows):
                    m = first_m + row
                    row_sigma = blocks[number, max(0, m - first), columns + 1]
                    inside[row, tile] = _start_tile(
                        m, first, tile, row_sigma, values, powers, state, scales, row
                    )
            block = number * CHUNK * (columns + 2) * LANES
            _step(
                first_m,
                tile,
                columns,
                flat_blocks,
                block,
                flat_factors,
                state,
                scales,
                inside,
                flat_sums,
            )
        for row in range(n_rows):
            m = first_m + row
            _store_chunk(m, row, first, L, columns, sigma[row], phases[m], flat_sums, out)
