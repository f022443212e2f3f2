"""The inner loop of rotations with explicit vectors, and its plain-loop twin.

A tile has `LANES` orders k at one order m and `CHUNK` degrees. It carries v = u_{m,k} and
w = (-1)^k u_{m,-k} in registers through the recursion

    v[l+1] = rho[l] (P[l] - Q[l] (k - m)) v[l] - v[l-1] ,
    w[l+1] = rho[l] (R[l] + Q[l] (k - m)) w[l] - w[l-1]

and adds (v + w) and (v - w) times the coefficients, each half of the columns, to sums over k. The
lanes of the sums are kept apart: (degree, column, WIDTH).
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import config, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from spinsdw.compiled.vectors import WIDTH, _constant, _degree_loop, _Emitter

__all__ = [
    "CHUNK",
    "LANES",
    "add_to_orders_2",
    "add_to_orders_4",
    "advance_orders_2",
    "advance_orders_4",
]

CHUNK = 16
_VECTORS = 2
LANES = _VECTORS * WIDTH


def _make_tile(columns: int, rows_of_block: int) -> Any:
    """Build tile(blocks, block, factors, factor, first_k, state, now, sums, total).

    Arrays are flat and an integer after each says where it begins, for a view costs more than the
    tile. blocks: (CHUNK, rows_of_block, LANES), rho then coefficients; factors: (CHUNK, 3), P, R
    and Q; first_k: k - m of the first lane, a float; state: (4, LANES), v[l-1], v[l], w[l-1], w[l];
    sums: (CHUNK, columns, WIDTH). Without columns it only advances.
    """

    @intrinsic
    def tile(typing, blocks, block, factors, factor, first_k, state, now, sums, total):  # noqa: ARG001
        sig = types.void(blocks, block, factors, factor, first_k, state, now, sums, total)

        def codegen(context, builder, sig, args):
            pointers = []
            for i in (0, 2, 5, 7):
                data = make_array(sig.args[i])(context, builder, args[i]).data
                pointers.append(builder.gep(data, [args[i + 1]]))
            p_block, p_factors, p_state, p_sums = pointers
            emit = _Emitter(builder, WIDTH)
            rows = range(_VECTORS)
            orders = [_add_lanes(emit, args[4], i * WIDTH) for i in rows]
            places = [_constant(i * WIDTH) for i in range(4 * _VECTORS)]
            carried = [emit.load(p_state, place) for place in places]

            def step(el, registers):
                pairs = [registers[i : i + _VECTORS] for i in range(0, 4 * _VECTORS, _VECTORS)]
                base = builder.mul(el, _constant(rows_of_block * LANES))
                for column in range(columns):
                    at = builder.add(
                        builder.mul(el, _constant(columns * WIDTH)), _constant(column * WIDTH)
                    )
                    value = emit.load(p_sums, at)
                    for i in rows:
                        v, w = pairs[1][i], pairs[3][i]
                        both = builder.fadd(v, w) if 2 * column < columns else builder.fsub(v, w)
                        place = builder.add(base, _constant((1 + column) * LANES + i * WIDTH))
                        value = emit.fma(both, emit.load(p_block, place), value)
                    emit.store(value, p_sums, at)
                place = builder.mul(el, _constant(3))
                p, r, q = (
                    emit.broadcast(p_factors, builder.add(place, _constant(i))) for i in range(3)
                )
                after = ([], [])
                for i in rows:
                    rho = emit.load(p_block, builder.add(base, _constant(i * WIDTH)))
                    for side, (start, slope) in enumerate(((p, builder.fneg(q)), (r, q))):
                        ratio = builder.fmul(rho, emit.fma(slope, orders[i], start))
                        before, here = pairs[2 * side][i], pairs[2 * side + 1][i]
                        after[side].append(emit.fma(ratio, here, builder.fneg(before)))
                return [*pairs[1], *after[0], *pairs[3], *after[1]]

            final = _degree_loop(emit, _constant(0), _constant(CHUNK // 2), carried, step)
            for value, place in zip(final, places, strict=True):
                emit.store(value, p_state, place)
            return context.get_dummy_value()

        return sig, codegen

    return tile


def _add_lanes(emit: _Emitter, scalar: Any, first: int) -> Any:
    """Return scalar + first, scalar + first + 1, ... in one vector."""
    builder, width = emit.builder, emit.width
    undefined = ir.Constant(emit.type, ir.Undefined)
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    one = builder.insert_element(undefined, scalar, ir.Constant(ir.IntType(32), 0))
    lanes = ir.Constant(emit.type, [float(first + i) for i in range(width)])
    return builder.fadd(builder.shuffle_vector(one, undefined, zeros), lanes)


def _make_plain_tile(columns: int, rows_of_block: int) -> Any:
    """Build what `_make_tile` computes."""

    def tile(blocks, block, factors, factor, first_k, state, now, sums, total):
        for i in range(CHUNK):
            row = block + i * rows_of_block * LANES
            p, other, q = factors[factor + 3 * i : factor + 3 * i + 3]
            for r in range(LANES):
                here = (now + LANES + r, now + 3 * LANES + r)
                v, w = state[here[0]], state[here[1]]
                for column in range(columns):
                    both = v + w if 2 * column < columns else v - w
                    at = total + (i * columns + column) * WIDTH + r % WIDTH
                    sums[at] += both * blocks[row + (1 + column) * LANES + r]
                for place, start, slope in ((here[0], p, -q), (here[1], other, q)):
                    ratio = blocks[row + r] * (start + slope * (first_k + r))
                    after = ratio * state[place] - state[place - LANES]
                    state[place - LANES] = state[place]
                    state[place] = after

    return tile


_make = _make_plain_tile if config.DISABLE_JIT else _make_tile
add_to_orders_2 = _make(2, 4)
add_to_orders_4 = _make(4, 6)
advance_orders_2 = _make(0, 4)
advance_orders_4 = _make(0, 6)
