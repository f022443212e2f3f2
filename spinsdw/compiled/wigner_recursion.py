"""The Wigner functions d^l_mn(theta) upwards in degree l at fixed m >= 0 and n.

With w_l = sqrt((l^2 - m^2)(l^2 - n^2)) / l the three-term recursion in l reads

    w_{l+1} d^{l+1} = (2l + 1) (cos(theta) - m n / (l (l + 1))) d^l - w_l d^{l-1}.

Written for u_l = d^l / scale_l with scale_{l+1} = scale_{l-1} w_l / w_{l+1} it becomes

    u_{l+1} = (a_l cos(theta) + b_l) u_l - u_{l-1},

two multiply-adds a step; the scale is absorbed by the coefficients that multiply d. It starts from

    d^M_mn = +-sqrt(binom(2M, M+K) / 4^M) sin(theta)^(M-|K|) (1 +- cos(theta))^|K|,

M = max(m, |n|), K the other order. Near a pole the start underflows for large m, so a ring carries
``scale``: its true values are u * 2**(800 scale) with scale = 0 (in range) or below.
"""

from __future__ import annotations

import math

import numpy as np

from spinsdw.compiled.jit import inner

__all__ = [
    "PADDING",
    "advance_start",
    "fill_powers",
    "fill_recursion",
    "fill_start",
    "load_start",
    "prepare_start",
    "rescale",
    "signed_norm",
    "start_norm",
]

# Degrees advanced between two looks at the exponents; arrays over degree are padded by as much.
PADDING = 16
# A ring whose values are below 2**-160 is "out of range". 16 steps grow it by less than 2**90 for
# |n| <= 8; the most measured is 2**143, at |n| about 1500. No loss was seen up to spin 1300 at
# L = 1400.
_STEP = 800
_FLOOR = -160
_SHRINK = 2.0**-_STEP
_GROW = 2.0**_STEP
_SMALLEST = 2.0**_FLOOR
_POWERS_OF_TWO = 2.0 ** np.arange(_FLOOR, _STEP + _FLOOR + 1)
_LIMIT = 2.0 ** (_STEP + _FLOOR)
_RENORM = 2.0**256
_UNRENORM = 2.0**-256


@inner
def fill_recursion(m, n, L, root, inverse, a, b, scale):
    """Fill a_l, b_l, scale_l, max(m, |n|) <= l < L, from root[k] = sqrt(k), inverse[k] = 1 / k."""
    n_abs = abs(n)
    first = max(m, n_abs)
    mn, count = float(m) * float(n), L - first
    # Loops count from 0 on slices, for then the compiler sees that no index is negative, and takes
    # vectors. All do but the one that cannot; b holds w_{l+1} until the last.
    a, b, scale = a[first:], b[first:], scale[first:]
    below, above, here = root[first + 1 - m :], root[first + 1 + m :], inverse[first:]
    left, right, after = root[first + 1 - n_abs :], root[first + 1 + n_abs :], inverse[first + 1 :]
    for i in range(count):
        b[i] = (below[i] * above[i]) * (left[i] * right[i]) * after[i]
    upper, ratios = b[1:], a[1:]
    for i in range(count - 1):
        ratios[i] = b[i] / upper[i]
    before, now = 1.0, 1.0
    scale[0] = before
    scale[1] = now
    later = scale[2:]
    for i in range(count - 1):
        before, now = now, before * ratios[i]
        later[i] = now
    later = scale[1:]
    for i in range(count):
        # From the scales as they were rounded: so their errors are no errors of the recursion.
        value = (2.0 * (first + i) + 1.0) * scale[i] / (b[i] * later[i])
        a[i] = value
        b[i] = -value * mn * here[i] * after[i]


@inner
def fill_powers(base, exponent, mantissa, power):
    """Fill mantissa * 2**power = base**exponent, element by element; base in [0, 2]."""
    for r in range(base.size):
        mantissa[r] = 1.0
        power[r] = 0.0
        square, square_power = base[r], 0.0
        k = exponent
        while k > 0:
            if k & 1:
                mantissa[r] *= square
                power[r] += square_power
                if mantissa[r] < _UNRENORM:
                    mantissa[r] *= _RENORM
                    power[r] -= 256.0
                elif mantissa[r] > _RENORM:
                    mantissa[r] *= _UNRENORM
                    power[r] += 256.0
            square *= square
            square_power *= 2.0
            if square < _UNRENORM:
                square *= _RENORM
                square_power -= 256.0
            elif square > _RENORM:
                square *= _UNRENORM
                square_power += 256.0
            k >>= 1


@inner
def start_norm(M, K, central):
    """Return (v, e): v 2**e = sqrt(binom(2M, M + K) / 4**M), central[M] = binom(2M, M) / 4**M."""
    value, power = central[M], 0.0
    for i in range(1, abs(K) + 1):
        value *= (M - i + 1.0) / (M + i)
        if value < 2.0**-512:
            value *= 2.0**512
            power -= 256.0
    return math.sqrt(value), power


@inner
def signed_norm(m, n, central):
    """Return the factor of the closed form of d^M_mn that does not depend on theta."""
    n_abs = abs(n)
    if m >= n_abs:
        value, power = start_norm(m, n, central)
        odd = (m - n) & 1
    else:
        value, power = start_norm(n_abs, m, central)
        odd = ((n_abs - m) & 1) if n < 0 else 0
    return (-value if odd else value), power


@inner
def _fill_small_start(power, now, scale):
    """Give rings their exponents: now holds the mantissas, the true values are now 2**power.

    Powers are multiples of 256. A mantissa is brought below 1 first: then a negative power means a
    value below 2**-256, out of range, and the others are in range.
    """
    inside = 0
    for r in range(now.size):
        is_large = abs(now[r]) > 1.0
        value = now[r] * (_UNRENORM if is_large else 1.0)
        exponent = power[r] + (256.0 if is_large else 0.0)
        # A pole, where d^l0 is exactly zero, stays zero at every later degree.
        exponent = exponent if value != 0.0 else 0.0
        steps = math.floor((exponent - _FLOOR) / _STEP) if exponent < 0.0 else 0.0
        now[r] = value * _POWERS_OF_TWO[int(exponent - _STEP * steps) - _FLOOR]
        scale[r] = steps
        inside += 1 if steps == 0.0 else 0
    return inside


@inner
def fill_start(norm, norm_power, powers, first, before, now, scale, power):
    """Set u_{l0-1} = 0, u_{l0} and the exponents of the rings from ``first`` on.

    powers: mantissas and exponents of sin(theta)^(M - |K|), then of (1 +- cos(theta))^|K|.
    Returns how many rings are in range.
    """
    # Short loops: each is one the compiler turns into vectors.
    stop = first + now.size
    mantissa, factor = powers[0, first:stop], powers[2, first:stop]
    for r in range(now.size):
        now[r] = norm * mantissa[r] * factor[r]
    exponent, more = powers[1, first:stop], powers[3, first:stop]
    for r in range(now.size):
        power[r] = norm_power + exponent[r] + more[r]
    for r in range(now.size):
        before[r] = 0.0
        scale[r] = 0.0
    small = 0
    for r in range(now.size):
        small += int(abs(now[r]) < _SMALLEST) + int(power[r] != 0.0)
    return _fill_small_start(power, now, scale) if small > 0 else now.size


@inner
def advance_start(factor, base, now, scale):
    """Multiply now 2**(800 scale) by factor * base, and bring it back into range."""
    for r in range(now.size):
        value = now[r] * (factor * base[r])
        size = abs(value)
        # The zeros of a pole stay in range.
        is_small = 0.0 < size < _SMALLEST
        is_large = scale[r] < 0.0 and size > _LIMIT
        now[r] = value * (_GROW if is_small else (_SHRINK if is_large else 1.0))
        scale[r] += (1.0 if is_large else 0.0) - (1.0 if is_small else 0.0)


@inner
def prepare_start(m, n, is_new, central, rings, first, stop, powers, start):
    """Bring u_M and the exponents, start[0] and start[1], of some rings to m.

    From m - 1, where they must be those of at least these rings, unless ``is_new``; ``powers`` is
    room for 6 numbers a ring.
    """
    sine, plus, minus = rings[0][first:stop], rings[1][first:stop], rings[2][first:stop]
    now, scale, part = start[0, first:stop], start[1, first:stop], powers[:, first:stop]
    if is_new or m <= abs(n):
        n_abs = abs(n)
        fill_powers(sine, abs(m - n_abs), part[0], part[1])
        fill_powers(plus if n >= 0 else minus, min(m, n_abs), part[2], part[3])
        norm, norm_power = signed_norm(m, n, central)
        fill_start(norm, norm_power, part, 0, part[4], now, scale, part[5])
    else:
        ratio = 0.5 * math.sqrt(2.0 * m / (m + n) * ((2.0 * m - 1.0) / (m - n)))
        advance_start(-ratio, sine, now, scale)


@inner
def load_start(start, first, factor, before, now, scale):
    """Copy the start of a block of rings, times a factor; return how many rings are in range."""
    values, exponents = start[0, first:], start[1, first:]
    inside = 0
    for r in range(now.size):
        now[r] = factor * values[r]
        before[r] = 0.0
        scale[r] = exponents[r]
        inside += 1 if exponents[r] == 0.0 else 0
    return inside


@inner
def rescale(before, now, scale):
    """Bring rings that have grown back into range; return how many are in range."""
    inside = 0
    for r in range(now.size):
        grown = scale[r] < 0.0 and max(abs(before[r]), abs(now[r])) > _LIMIT
        factor = _SHRINK if grown else 1.0
        before[r] *= factor
        now[r] *= factor
        scale[r] += 1.0 if grown else 0.0
        inside += 1 if scale[r] == 0.0 else 0
    return inside
