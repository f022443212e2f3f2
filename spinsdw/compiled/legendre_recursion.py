"""The functions d^l_m0(theta) by parity in cos(theta), and the way from order n to order 0.

Write p_l = sqrt(2l + 1) d^l_m0, x = cos(theta), e_l = sqrt((l^2 - m^2) / (4 l^2 - 1)). Then

    x p_l = e_{l+1} p_{l+1} + e_l p_{l-1} .

The functions r_k = p_l / x, l = m + 2k + 1, are even in x but for the factor sin(theta)^m, and give
both parities (Ishioka 2018, J. Meteor. Soc. Japan 96, 241):

    p_{m+2k+1} = x r_k ,    p_{m+2k} = e_{m+2k+1} r_k + e_{m+2k} r_{k-1} .

They obey, with A_k = e_{l+1} e_{l+2} and B_k = e_{l+1}^2 + e_l^2 at l = m + 2k + 1,

    A_k r_{k+1} = (x^2 - B_k) r_k - A_{k-1} r_{k-1} ,

and for u_k = r_k / scale_k with scale_{k+1} = scale_{k-1} A_{k-1} / A_k that is

    u_{k+1} = (a_k x^2 + b_k) u_k - u_{k-1} .

Order n comes down to 0 by products with sin(theta) (Clebsch-Gordan series with d^1_{0,-+1}):

    sin d^l_{m,+-n} = -+U_l d^{l+1}_{m,+-(n-1)} - V_l d^l_{m,+-(n-1)} +- W_l d^{l-1}_{m,+-(n-1)} ,
    U_l = sqrt(((l+1)^2 - m^2) (l-n+1) (l-n+2)) / ((l+1) (2l+1)) ,
    V_l = m sqrt((l+n) (l-n+1)) / (l (l+1)) ,
    W_l = sqrt((l^2 - m^2) (l+n-1) (l+n)) / (l (2l+1)) .
"""

from __future__ import annotations

import math

from spinsdw.compiled.jit import inner

__all__ = ["fill_lowering", "fill_parity_recursion", "lower_order", "raise_order"]


@inner
def fill_parity_recursion(m, count, ratios, a, b, shifted, scale):
    """Fill ratios[i] = e_{m+i}, i < 2 count + 2, and a_k, b_k, b_k + a_k, scale_k for k < count.

    a_k sin^2 has full precision next to a pole, where cos^2 does not: there
    a_k x^2 + b_k = -a_k sin^2 + (b_k + a_k), with ``shifted`` the second term.
    """
    square_m = float(m) * float(m)
    for i in range(2 * count + 2):
        square = float(m + i) * float(m + i)
        ratios[i] = math.sqrt((square - square_m) / abs(4.0 * square - 1.0))
    for k in range(count):
        below, here, above = ratios[2 * k + 1], ratios[2 * k + 2], ratios[2 * k + 3]
        a[k] = here * above
        b[k] = here * here + below * below
    for k in range(1, count):
        shifted[k] = a[k - 1] / a[k]
    scale[0] = 1.0
    scale[1] = 1.0
    for k in range(1, count):
        scale[k + 1] = scale[k - 1] * shifted[k]
    for k in range(count):
        # From the scales as they were rounded: so their errors are no errors of the recursion.
        value = scale[k] / (a[k] * scale[k + 1])
        a[k] = value
        shifted[k] = value * (1.0 - b[k])
        b[k] = -value * b[k]


@inner
def fill_lowering(m, size, stop, order_tables, factors):
    """Fill factors = U_l, V_l, W_l at n = size, for max(m, size) <= l < stop, and zero around.

    order_tables: `fill_order_tables` of this size. Loops count from 0 on slices, for then the
    compiler sees that no index is negative, and takes vectors.
    """
    first = max(m, size)
    for i in range(3):
        factors[i, m:first] = 0.0
        factors[i, stop : stop + 2] = 0.0
    up, here, down = factors[0, first:stop], factors[1, first:stop], factors[2, first:stop]
    above, beside, below = (
        order_tables[0, first:stop],
        order_tables[1, first:stop],
        order_tables[2, first:stop],
    )
    square_m = float(m) * float(m)
    for i in range(up.size):
        el = float(first + i)
        up[i] = math.sqrt((el + 1.0) * (el + 1.0) - square_m) * above[i]
        here[i] = m * beside[i]
        down[i] = math.sqrt(el * el - square_m) * below[i]


@inner
def lower_order(m, sign, stop, factors, series, lowered):
    """From c of sum_l c_l sin d^l_mn, l < stop, to that of sum_l lowered_l d^l_m,n-+1, l <= stop.

    sign: that of n. Series are (real and imaginary part, l), zero at ``stop`` and one further.
    """
    up, here, down = factors[0, m:], factors[1, m:], factors[2, m:]
    count = stop + 1 - m
    for part in range(2):
        c, out = series[part, m:], lowered[part, m:]
        out[0] = sign * down[1] * c[1] - here[0] * c[0]
        up_from, c_from, c_to, down_to = up[: count - 1], c[: count - 1], c[2:], down[2:]
        target, c_here, v_here = out[1:count], c[1:count], here[1:count]
        for i in range(count - 1):
            side = down_to[i] * c_to[i] - up_from[i] * c_from[i]
            target[i] = sign * side - v_here[i] * c_here[i]
        out[count] = 0.0
        out[count + 1] = 0.0


@inner
def raise_order(m, sign, stop, factors, series, raised):
    """Transpose of `lower_order`: from sums with d^l_m,n-+1, l <= stop, to those of sin d^l_mn."""
    up, here, down = factors[0, m:], factors[1, m:], factors[2, m:]
    count = stop - m
    for part in range(2):
        values, out = series[part, m:], raised[part, m:]
        out[0] = -sign * up[0] * values[1] - here[0] * values[0]
        target, after, center = out[1:], values[2:], values[1:]
        u_here, v_here, w_here = up[1:], here[1:], down[1:]
        for i in range(count - 1):
            side = w_here[i] * values[i] - u_here[i] * after[i]
            target[i] = sign * side - v_here[i] * center[i]
