"""Inner loops for many columns: values of the recursion made once, and their products with columns.

A tile of `vectors` makes a value and uses it for four columns at once. Where there are more of them
the values of a few dozen degrees are kept, in the first-level cache, and every four columns,
a *quartet* of two complex series, are multiplied with them:

- ``fill_values``             ``values[j, r] = mask[r] u_l(x_r)``, l = base + j, and moves on;
- ``add_products_to_rings``   adds ``c[l, k] values[j, r]`` to the sums of the rings (synthesis);
- ``add_products_to_degrees`` adds ``g[k, r] values[j, r]`` to the sums of the degrees (adjoint).

Sums over degrees add what the tiles of four columns do, in the same order: they have the same bits.
Sums over rings add up the lanes of a block of rings first (`lane_sums`), the tiles last.
Arrays are read as if they had one axis, from a place on: a view of a part would cost as much as
a dozen degrees. Sums and columns of rings are rows, ``stride`` apart: a quartet is the rows at
``one``, ``one + stride``, ``other`` and ``other + stride``. Plain loops define each, as in
`vectors`.
"""

from __future__ import annotations

from typing import Any

from numba.core import config, types
from numba.extending import intrinsic

from spinsdw.compiled.lane_sums import add_degrees, add_products, mix_columns
from spinsdw.compiled.vectors import (
    RINGS,
    VECTORS,
    WIDTH,
    _advance,
    _constant,
    _degree_loop,
    _Emitter,
    _pair_loop,
    _pointers,
)

__all__ = ["QUARTET", "add_products_to_degrees", "add_products_to_rings", "fill_values"]

# Real columns that are multiplied with the values at a time.
QUARTET = 4


def _rows(builder: Any, one: Any, other: Any, stride: Any) -> list[Any]:
    """Return where the four rows of a quartet begin."""
    return [place for pair in (one, other) for place in (pair, builder.add(pair, stride))]


def _make_values_tile(vectors: int, width: int) -> Any:
    """Build fill_values(a, b, work, values, base, first, pairs), first <= l < first + 2 pairs.

    work: rows u_{l-1}, u_l, exponents, x and mask of the rings of a tile.
    """

    @intrinsic
    def tile(typing, a, b, work, values, base, first, pairs):  # noqa: ARG001
        sig = types.void(a, b, work, values, base, first, pairs)

        def codegen(context, builder, sig, args):
            p_a, p_b, p_work, p_values = _pointers(context, builder, sig, args, 4)
            emit = _Emitter(builder, width)
            before, now, _, x, mask = (
                [_constant((row * vectors + v) * width) for v in range(vectors)] for row in range(5)
            )
            x_v, mask_v = ([emit.load(p_work, place) for place in row] for row in (x, mask))
            carried = [emit.load(p_work, place) for place in [*before, *now]]

            def step(el, state):
                u0, u1 = state[:vectors], state[vectors:]
                start = builder.mul(builder.sub(el, args[4]), _constant(vectors * width))
                for v, place in enumerate(before):
                    masked = builder.fmul(mask_v[v], u1[v])
                    emit.store(masked, p_values, builder.add(start, place))
                u0, u1 = _advance(emit, p_a, p_b, el, x_v, u0, u1)
                return [*u0, *u1]

            final = _degree_loop(emit, args[5], args[6], carried, step)
            for value, place in zip(final, [*before, *now], strict=True):
                emit.store(value, p_work, place)
            return context.get_dummy_value()

        return sig, codegen

    return tile


def _values_of(emit: _Emitter, values: Any, base: Any, el: Any, vectors: int) -> list[Any]:
    """Load the values of one degree."""
    builder, size = emit.builder, emit.width
    start = builder.mul(builder.sub(el, base), _constant(vectors * size))
    return [emit.load(values, builder.add(start, _constant(v * size))) for v in range(vectors)]


def _make_ring_products(vectors: int, width: int) -> Any:
    """Build add_products_to_rings(c, values, sums, base, pairs, place, one, other, stride).

    c[place + 4 l + k] are the coefficients of base <= l < base + 2 pairs; the sums stay in
    registers.
    """

    @intrinsic
    def tile(typing, c, values, sums, base, pairs, place, one, other, stride):  # noqa: ARG001
        sig = types.void(c, values, sums, base, pairs, place, one, other, stride)

        def codegen(context, builder, sig, args):
            p_c, p_values, p_sums = _pointers(context, builder, sig, args, 3)
            emit = _Emitter(builder, width)
            columns = range(QUARTET)
            places = [
                builder.add(row, _constant(v * width))
                for row in _rows(builder, *args[6:9])
                for v in range(vectors)
            ]

            def step(el, acc):
                u = _values_of(emit, p_values, args[3], el, vectors)
                first = builder.add(args[5], builder.mul(el, _constant(QUARTET)))
                c_k = [emit.broadcast(p_c, builder.add(first, _constant(k))) for k in columns]
                return [
                    emit.fma(c_k[k], u[v], acc[k * vectors + v])
                    for k in columns
                    for v in range(vectors)
                ]

            carried = [emit.load(p_sums, where) for where in places]
            final = _degree_loop(emit, args[3], args[4], carried, step)
            for value, where in zip(final, places, strict=True):
                emit.store(value, p_sums, where)
            return context.get_dummy_value()

        return sig, codegen

    return tile


def _make_degree_products(vectors: int, width: int) -> Any:
    """Build add_products_to_degrees(g, values, sums, base, pairs, place, one, other, stride).

    The rows g stay in registers; sums[place + 4 l + k] are the sums of base <= l < base + 2 pairs.
    """

    @intrinsic
    def tile(typing, g, values, sums, base, pairs, place, one, other, stride):  # noqa: ARG001
        sig = types.void(g, values, sums, base, pairs, place, one, other, stride)

        def codegen(context, builder, sig, args):
            p_g, p_values, p_sums = _pointers(context, builder, sig, args, 3)
            emit = _Emitter(builder, width)
            rows = _rows(builder, *args[6:9])
            mixed = [
                mix_columns(
                    emit, [emit.load(p_g, builder.add(row, _constant(v * width))) for row in rows]
                )
                for v in range(vectors)
            ]

            def step(el, state):
                place = builder.add(args[5], builder.mul(el, _constant(QUARTET)))
                found = []
                for offset in range(2):
                    here = builder.add(el, _constant(offset))
                    u = _values_of(emit, p_values, args[3], here, vectors)
                    found.append(add_products(emit, mixed, u))
                for i, value in enumerate(add_degrees(emit, *found, QUARTET)):
                    where = builder.add(place, _constant(i * width))
                    emit.store(builder.fadd(emit.load(p_sums, where), value), p_sums, where)
                return state

            _pair_loop(emit, args[3], args[4], [], step)
            return context.get_dummy_value()

        return sig, codegen

    return tile


def _make_plain_values_tile(rings: int) -> Any:
    """Build what `_make_values_tile` computes as plain loops."""

    def tile(a, b, work, values, base, first, pairs):
        before, now, _, x, mask = work.reshape(5, rings)
        for el in range(first, first + 2 * pairs):
            for r in range(rings):
                values[(el - base) * rings + r] = mask[r] * now[r]
                after = (a[el] * x[r] + b[el]) * now[r] - before[r]
                before[r] = now[r]
                now[r] = after

    return tile


def _make_plain_ring_products(rings: int) -> Any:
    """Build what `_make_ring_products` computes as plain loops."""

    def tile(c, values, sums, base, pairs, place, one, other, stride):
        c, sums = c.reshape(-1)[place:], sums.reshape(-1)
        for j in range(2 * pairs):
            for k, row in enumerate((one, one + stride, other, other + stride)):
                for r in range(rings):
                    sums[row + r] += c[(base + j) * QUARTET + k] * values[j * rings + r]

    return tile


def _make_plain_degree_products(rings: int) -> Any:
    """Build what `_make_degree_products` computes as plain loops."""

    def tile(g, values, sums, base, pairs, place, one, other, stride):
        g, sums = g.reshape(-1), sums.reshape(-1)[place:]
        for j in range(2 * pairs):
            for k, row in enumerate((one, one + stride, other, other + stride)):
                for r in range(rings):
                    sums[(base + j) * QUARTET + k] += g[row + r] * values[j * rings + r]

    return tile


if config.DISABLE_JIT:
    fill_values = _make_plain_values_tile(RINGS)
    add_products_to_rings = _make_plain_ring_products(RINGS)
    add_products_to_degrees = _make_plain_degree_products(RINGS)
else:
    fill_values = _make_values_tile(VECTORS, WIDTH)
    add_products_to_rings = _make_ring_products(VECTORS, WIDTH)
    add_products_to_degrees = _make_degree_products(VECTORS, WIDTH)
