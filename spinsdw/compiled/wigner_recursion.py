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
    "fill_powers",
    "fill_recursion",
    "fill_start",
    "multiply_powers",
    "prepare_powers",
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
    mn = float(m) * float(n)
    # Three loops that vectorise around the one that cannot; b holds w_{l+1} until the last.
    for el in range(first, L):
        b[el] = (
            (root[el + 1 - m] * root[el + 1 + m])
            * (root[el + 1 - n_abs] * root[el + 1 + n_abs])
            * inverse[el + 1]
        )
    for el in range(first + 1, L):
        a[el] = b[el - 1] / b[el]
    scale[first] = 1.0
    scale[first + 1] = 1.0
    for el in range(first + 1, L):
        scale[el + 1] = scale[el - 1] * a[el]
    for el in range(first, L):
        # From the scales as they were rounded: so their errors are no errors of the recursion.
        value = (2 * el + 1) * scale[el] / (b[el] * scale[el + 1])
        a[el] = value
        b[el] = -value * mn * inverse[el] * inverse[el + 1]


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
def multiply_powers(base, mantissa, power):
    """Raise the exponent of `fill_powers` by one, for a base in [0, 1]."""
    for r in range(base.size):
        value = mantissa[r] * base[r]
        small = value < _UNRENORM
        mantissa[r] = value * (_RENORM if small else 1.0)
        power[r] -= 256.0 if small else 0.0


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
def _fill_order_powers(m, n, rings, powers):
    """Fill sin(theta)^(M - |K|) and (1 +- cos(theta))^|K|: all of d^M_mn that depends on theta."""
    sine, plus, minus = rings[0], rings[1], rings[2]
    n_abs = abs(n)
    fill_powers(sine, abs(m - n_abs), powers[0], powers[1])
    fill_powers(plus if n >= 0 else minus, min(m, n_abs), powers[2], powers[3])


@inner
def prepare_powers(m, n, is_new, rings, powers):
    """Bring the powers to m, from m - 1 unless ``is_new``."""
    if is_new or m <= abs(n):
        _fill_order_powers(m, n, rings, powers)
    else:
        multiply_powers(rings[0], powers[0], powers[1])


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
