"""Inner loops of the ring sums with explicit vectors, and their plain-loop twins.

One tile handles ``RINGS = VECTORS * WIDTH`` rings at one (m, n): it runs the recursion
``u[l+1] = (a[l] x + b[l]) u[l] - u[l-1]`` in vector registers and, in the same pass over l,

- ``add_to_rings_*``    adds ``c[l, k] u[l, r]`` to the sums of the rings (synthesis);
- ``add_to_degrees_*``  adds ``g[k, r] u[l, r]`` to the sums of the degrees (adjoint);
- ``advance``           does neither.

``sum_lanes`` adds up the lanes of one vector of the sums of the degrees.

Numba's own vectoriser keeps the sums in memory and uses half the vector width of the machine; the
explicit form keeps them in registers, which is worth a factor of three. ``docs/engine`` explains.
The plain loops below define what the vector forms compute; they run where numba is switched off.
"""

from __future__ import annotations

import os
from typing import Any

from llvmlite import binding, ir
from numba.core import config, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

__all__ = [
    "RINGS",
    "WIDTH",
    "add_to_degrees_2",
    "add_to_degrees_4",
    "add_to_rings_2",
    "add_to_rings_4",
    "advance",
    "sum_lanes",
]


def _host_width() -> int:
    """Doubles per vector register: 8 (AVX-512), 4 (AVX), 2 (SSE2, NEON)."""
    setting = os.environ.get("SPINSDW_VECTOR_WIDTH")
    if setting in {"2", "4", "8"}:
        return int(setting)
    if config.CPU_NAME not in {None, "host"}:
        features = config.CPU_FEATURES or ""
    else:
        features = config.CPU_FEATURES or binding.get_host_cpu_features().flatten()
    if "+avx512f" in features:
        return 8
    return 4 if "+avx" in features else 2


WIDTH = _host_width()
# Vectors of rings that a tile of four columns keeps in registers with all it needs.
VECTORS = {8: 4, 4: 2, 2: 2}[WIDTH]
RINGS = VECTORS * WIDTH

_INDEX = ir.IntType(64)


class _Emitter:
    """The few vector instructions the tiles need, on one LLVM builder."""

    def __init__(self, builder: Any, width: int) -> None:
        self.builder = builder
        self.width = width
        self.type = ir.VectorType(ir.DoubleType(), width)
        name = f"llvm.fmuladd.v{width}f64"
        declared = builder.module.globals.get(name)
        self._fma = declared or ir.Function(
            builder.module, ir.FunctionType(self.type, [self.type] * 3), name=name
        )

    def load(self, pointer: Any, index: Any) -> Any:
        place = self.builder.gep(pointer, [index])
        value = self.builder.load(self.builder.bitcast(place, self.type.as_pointer()))
        value.align = 8
        return value

    def store(self, value: Any, pointer: Any, index: Any) -> None:
        place = self.builder.gep(pointer, [index])
        stored = self.builder.store(value, self.builder.bitcast(place, self.type.as_pointer()))
        stored.align = 8

    def shuffle(self, one: Any, other: Any, lanes: list[int]) -> Any:
        """Return lanes of two vectors; those of ``other`` count from the width on."""
        index = ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), lanes)
        return self.builder.shuffle_vector(one, other, index)

    def broadcast(self, pointer: Any, index: Any) -> Any:
        scalar = self.builder.load(self.builder.gep(pointer, [index]))
        undefined = ir.Constant(self.type, ir.Undefined)
        first = self.builder.insert_element(undefined, scalar, ir.Constant(ir.IntType(32), 0))
        return self.shuffle(first, undefined, [0] * self.width)

    def fma(self, x: Any, y: Any, z: Any) -> Any:
        return self.builder.call(self._fma, [x, y, z])

    def phi(self, start: Any, block: Any) -> Any:
        node = self.builder.phi(start.type)
        node.add_incoming(start, block)
        return node


def _constant(value: int) -> Any:
    return ir.Constant(_INDEX, value)


def _degree_loop(
    emit: _Emitter, first: Any, pairs: Any, carried: list[Any], step: Any
) -> list[Any]:
    """Emit ``for l in range(first, first + 2 pairs)``, two degrees a pass.

    ``carried`` are the vectors that live in registers; ``step(l, carried) -> carried`` emits the
    body for one degree.
    """

    def both(el: Any, state: list[Any]) -> list[Any]:
        for offset in range(2):
            state = step(emit.builder.add(el, _constant(offset)), state)
        return state

    return _pair_loop(emit, first, pairs, carried, both)


def _pair_loop(emit: _Emitter, first: Any, pairs: Any, carried: list[Any], step: Any) -> list[Any]:
    """Emit what `_degree_loop` does, with ``step`` the body for l and l + 1."""
    builder = emit.builder
    before = builder.block
    loop = builder.append_basic_block("degrees")
    done = builder.append_basic_block("done")
    builder.cbranch(builder.icmp_signed(">", pairs, _constant(0)), loop, done)
    builder.position_at_end(loop)
    count = emit.phi(_constant(0), before)
    el = emit.phi(first, before)
    nodes = [emit.phi(vector, before) for vector in carried]
    state = step(el, list(nodes))
    count_next = builder.add(count, _constant(1))
    count.add_incoming(count_next, loop)
    el.add_incoming(builder.add(el, _constant(2)), loop)
    for node, value in zip(nodes, state, strict=True):
        node.add_incoming(value, loop)
    builder.cbranch(builder.icmp_signed("<", count_next, pairs), loop, done)
    builder.position_at_end(done)
    final = [emit.phi(vector, before) for vector in carried]
    for node, value in zip(final, state, strict=True):
        node.add_incoming(value, loop)
    return final


def _pointers(context: Any, builder: Any, sig: Any, args: Any, count: int) -> list[Any]:
    arrays = zip(sig.args[:count], args[:count], strict=True)
    return [make_array(kind)(context, builder, value).data for kind, value in arrays]


def _advance(emit: _Emitter, a: Any, b: Any, el: Any, x: list[Any], before: Any, now: Any) -> Any:
    """u[l+1] = (a[l] x + b[l]) u[l] - u[l-1], for every vector of rings."""
    a_el, b_el = emit.broadcast(a, el), emit.broadcast(b, el)
    after = []
    for v, x_v in enumerate(x):
        factor = emit.fma(a_el, x_v, b_el)
        after.append(emit.fma(factor, now[v], emit.builder.fneg(before[v])))
    return now, after


def _make_ring_tile(vectors: int, columns: int, width: int) -> Any:
    """Build tile(a, b, c, x, before, now, sums, first, pairs); columns = 0 only advances."""

    @intrinsic
    def tile(typing, a, b, c, x, before, now, sums, first, pairs):  # noqa: ARG001
        sig = types.void(a, b, c, x, before, now, sums, first, pairs)

        def codegen(context, builder, sig, args):
            p_a, p_b, p_c, p_x, p_0, p_1, p_sums = _pointers(context, builder, sig, args, 7)
            emit = _Emitter(builder, width)
            rows = range(vectors)
            x_v = [emit.load(p_x, _constant(v * width)) for v in rows]
            carried = [emit.load(p, _constant(v * width)) for p in (p_0, p_1) for v in rows]
            places = [_constant(i * width) for i in range(columns * vectors)]
            carried += [emit.load(p_sums, place) for place in places]

            def step(el, state):
                u0, u1 = state[:vectors], state[vectors : 2 * vectors]
                acc = state[2 * vectors :]
                base = builder.mul(el, _constant(columns))
                for k in range(columns):
                    c_k = emit.broadcast(p_c, builder.add(base, _constant(k)))
                    for v in rows:
                        acc[k * vectors + v] = emit.fma(c_k, u1[v], acc[k * vectors + v])
                u0, u1 = _advance(emit, p_a, p_b, el, x_v, u0, u1)
                return [*u0, *u1, *acc]

            final = _degree_loop(emit, args[7], args[8], carried, step)
            for v in rows:
                emit.store(final[v], p_0, _constant(v * width))
                emit.store(final[vectors + v], p_1, _constant(v * width))
            for value, place in zip(final[2 * vectors :], places, strict=True):
                emit.store(value, p_sums, place)
            return context.get_dummy_value()

        return sig, codegen

    return tile


def _make_degree_tile(vectors: int, columns: int, width: int) -> Any:
    """Build tile(a, b, g, x, before, now, sums, first, pairs): the map's columns stay in registers.

    ``sums[(l columns + k) width + lane]`` collects lanes; the caller adds the lanes up once per m.
    """

    @intrinsic
    def tile(typing, a, b, g, x, before, now, sums, first, pairs):  # noqa: ARG001
        sig = types.void(a, b, g, x, before, now, sums, first, pairs)

        def codegen(context, builder, sig, args):
            p_a, p_b, p_g, p_x, p_0, p_1, p_sums = _pointers(context, builder, sig, args, 7)
            emit = _Emitter(builder, width)
            rows = range(vectors)
            x_v = [emit.load(p_x, _constant(v * width)) for v in rows]
            carried = [emit.load(p, _constant(v * width)) for p in (p_0, p_1) for v in rows]
            g_kv = [emit.load(p_g, _constant(i * width)) for i in range(columns * vectors)]

            def step(el, state):
                u0, u1 = state[:vectors], state[vectors:]
                base = builder.mul(el, _constant(columns * width))
                for k in range(columns):
                    place = builder.add(base, _constant(k * width))
                    acc = emit.load(p_sums, place)
                    for v in rows:
                        acc = emit.fma(g_kv[k * vectors + v], u1[v], acc)
                    emit.store(acc, p_sums, place)
                u0, u1 = _advance(emit, p_a, p_b, el, x_v, u0, u1)
                return [*u0, *u1]

            final = _degree_loop(emit, args[7], args[8], carried, step)
            for v in rows:
                emit.store(final[v], p_0, _constant(v * width))
                emit.store(final[vectors + v], p_1, _constant(v * width))
            return context.get_dummy_value()

        return sig, codegen

    return tile


def _make_plain_ring_tile(rings: int, columns: int) -> Any:
    """Build the sum over degrees as plain loops: what `_make_ring_tile` computes."""

    def tile(a, b, c, x, before, now, sums, first, pairs):
        for el in range(first, first + 2 * pairs):
            for r in range(rings):
                for k in range(columns):
                    sums[k * rings + r] += c[el * columns + k] * now[r]
                after = (a[el] * x[r] + b[el]) * now[r] - before[r]
                before[r] = now[r]
                now[r] = after

    return tile


def _make_plain_degree_tile(rings: int, columns: int, width: int) -> Any:
    """Build the sum over rings as plain loops: what `_make_degree_tile` computes."""

    def tile(a, b, g, x, before, now, sums, first, pairs):
        for el in range(first, first + 2 * pairs):
            for r in range(rings):
                for k in range(columns):
                    sums[(el * columns + k) * width + r % width] += g[k * rings + r] * now[r]
                after = (a[el] * x[r] + b[el]) * now[r] - before[r]
                before[r] = now[r]
                now[r] = after

    return tile


def _make_lane_sum(width: int) -> Any:
    """Build sum_lanes(sums, place): the sum of ``width`` values from ``place`` on, by halves."""

    @intrinsic
    def lane_sum(typing, sums, place):  # noqa: ARG001
        sig = types.float64(sums, place)

        def codegen(context, builder, sig, args):
            (pointer,) = _pointers(context, builder, sig, args, 1)
            value = _Emitter(builder, width).load(pointer, args[1])
            size = width
            while size > 1:
                size //= 2
                halves = []
                for first in (0, size):
                    lanes = list(range(first, first + size))
                    index = ir.Constant(ir.VectorType(ir.IntType(32), size), lanes)
                    undefined = ir.Constant(value.type, ir.Undefined)
                    halves.append(builder.shuffle_vector(value, undefined, index))
                value = builder.fadd(*halves)
            return builder.extract_element(value, ir.Constant(ir.IntType(32), 0))

        return sig, codegen

    return lane_sum


def _make_plain_lane_sum(width: int) -> Any:
    """Build what `_make_lane_sum` computes, in the same order."""

    def lane_sum(sums, place):
        values = [sums[place + lane] for lane in range(width)]
        while len(values) > 1:
            half = len(values) // 2
            values = [values[i] + values[half + i] for i in range(half)]
        return values[0]

    return lane_sum


if config.DISABLE_JIT:
    sum_lanes = _make_plain_lane_sum(WIDTH)
    add_to_rings_4 = _make_plain_ring_tile(RINGS, 4)
    add_to_rings_2 = _make_plain_ring_tile(RINGS, 2)
    advance = _make_plain_ring_tile(RINGS, 0)
    add_to_degrees_4 = _make_plain_degree_tile(RINGS, 4, WIDTH)
    add_to_degrees_2 = _make_plain_degree_tile(RINGS, 2, WIDTH)
else:
    sum_lanes = _make_lane_sum(WIDTH)
    add_to_rings_4 = _make_ring_tile(VECTORS, 4, WIDTH)
    add_to_rings_2 = _make_ring_tile(VECTORS, 2, WIDTH)
    advance = _make_ring_tile(VECTORS, 0, WIDTH)
    add_to_degrees_4 = _make_degree_tile(VECTORS, 4, WIDTH)
    add_to_degrees_2 = _make_degree_tile(VECTORS, 2, WIDTH)
