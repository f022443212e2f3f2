"""The vector loops, compiled for another processor: what its assembly is made of."""

from __future__ import annotations

import re

import numba
import pytest
from llvmlite import binding
from numba import types

from spinsdw.compiled import products, vectors
from tests.helpers import needs_compiler

TRIPLE = "aarch64-unknown-linux-gnu"
# Doubles in a NEON register, and the vectors of rings that a tile has there.
WIDTH, VECTORS = 2, 2
ARRAY = types.float64[::1]
SIGNATURE = types.void(*[ARRAY] * 7, types.int64, types.int64)
PRODUCTS = types.void(*[ARRAY] * 3, *[types.int64] * 6)
TILES = {
    "sums of four columns": (vectors._make_ring_tile, 4),
    "sums of two columns": (vectors._make_ring_tile, 2),
    "recursion alone": (vectors._make_ring_tile, 0),
    "adjoint of four columns": (vectors._make_degree_tile, 4),
    "adjoint of two columns": (vectors._make_degree_tile, 2),
}


def machine():
    """Return LLVM's compiler for an ARM server, skipping where it was built without."""
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    try:
        target = binding.Target.from_triple(TRIPLE)
    except RuntimeError as error:
        pytest.skip(f"LLVM has no such target: {error}")
    return target.create_target_machine(cpu="neoverse-n1", opt=3)


def native_function(tile, signature):
    """Return the LLVM text of a function that calls a tile, and of what it declares.

    Not the wrappers for Python, which hold instructions of the processor at hand.
    """

    @numba.njit
    def call(a, b, c, x, before, now, sums, first, pairs):
        tile(a, b, c, x, before, now, sums, first, pairs)

    call.compile(signature)
    text = call.inspect_llvm(call.signatures[0])
    pattern = r"^define [^\n]*@_ZN(?!7cpython)[^\n]*\{\n.*?^\}$"
    body = re.search(pattern, text, flags=re.MULTILINE | re.DOTALL)[0]
    declared = [
        line
        for line in re.findall(r"^declare .*$", text, flags=re.MULTILINE)
        if re.search(r"@[\w.]+\(", line)[0] in body
    ]
    whole = "\n".join([*declared, body])
    return re.sub(r", ![\w.]+ !\d+| #\d+", "", whole)


def hottest_block(tile, signature=SIGNATURE):
    """Return the basic block with the most vector multiply-adds: the loop over degrees."""
    compiler = machine()
    head = f'target triple = "{TRIPLE}"\ntarget datalayout = "{compiler.target_data}"\n'
    module = binding.parse_assembly(head + native_function(tile, signature))
    module.verify()
    blocks = re.split(r"^\.L\w+:.*$", compiler.emit_assembly(module), flags=re.MULTILINE)
    return max(blocks, key=count_multiply_adds)


def count_multiply_adds(assembly):
    return len(re.findall(r"\bfml[as]\s+v\d+\.2d", assembly))


@needs_compiler
@pytest.mark.parametrize(("make", "columns"), TILES.values(), ids=TILES)
def test_loops_over_degrees_are_vector_multiply_adds_on_arm(make, columns):
    """2 of recursion and one a column for each vector and degree; two degrees a pass."""
    shape = (VECTORS, columns, WIDTH)
    check_loop(hottest_block(make(*shape)), 2 * VECTORS * (2 + columns))


@needs_compiler
@pytest.mark.parametrize(
    ("make", "added"),
    [(products._make_ring_products, VECTORS), (products._make_degree_products, VECTORS - 1)],
)
def test_products_are_vector_multiply_adds_on_arm(make, added):
    """One a column for each vector and degree; sums over rings begin with a product."""
    block = hottest_block(make(VECTORS, WIDTH), PRODUCTS)
    # Sums over rings add up lanes as well: vectors are added there, but no single numbers.
    check_loop(block, 2 * added * products.QUARTET, r"\s+[sd]\d" if added < VECTORS else r"\b")


def check_loop(block, expected, operands=r"\b"):
    found = count_multiply_adds(block)
    # LLVM may unroll the loop further.
    assert found >= expected
    assert found % expected == 0
    scalar = rf"\bfn?m(add|sub)\b|\bf(mul|add|sub){operands}"
    assert not re.search(scalar, block), "a multiply-add fell apart"
    assert not re.search(r"\bbl\b|\[sp\b", block), "a call, or a register kept in memory"
