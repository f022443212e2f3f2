"""Lanes added up in registers: sums over a block of rings, of two degrees and many columns.

A product of a column with values is spread over the lanes of a vector. To add up the lanes of n
vectors side by side takes a blend and a permutation for each addition. Here the blends are made
beforehand, in the columns: they are *mixed*, so that lane i of vector j is of column j ^ i, with i
modulo n. Then lane i ^ j of product j is of column i, and with a permutation for each addition

    p_0[i] + p_1[i ^ 1] + (p_2[i ^ 2] + p_3[i ^ 2 ^ 1])

is of column i. Two degrees share the lanes that remain.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

__all__ = ["add_degrees", "add_products", "mix_columns"]


def mix_columns(emit: Any, columns: list[Any]) -> list[Any]:
    """Mix a vector of each column: lane i of vector j is that of column j ^ i."""
    width = emit.width
    step = 1
    while step < min(len(columns), width):
        lanes = [lane + (width if lane & step else 0) for lane in range(width)]
        columns = [emit.shuffle(one, columns[j ^ step], lanes) for j, one in enumerate(columns)]
        step *= 2
    return columns


def _dot(emit: Any, column: list[Any], u: list[Any]) -> Any:
    total = emit.builder.fmul(column[0], u[0])
    for factor, value in zip(column[1:], u[1:], strict=True):
        total = emit.fma(factor, value, total)
    return total


def _merge(emit: Any, products: Iterator[Any], count: int) -> Any:
    """Add up the next ``count`` products: lane i of the sum is of column i, modulo ``count``."""
    if count == 1:
        return next(products)
    one, other = (_merge(emit, products, count // 2) for _ in range(2))
    lanes = [lane ^ (count // 2) for lane in range(emit.width)]
    return emit.builder.fadd(one, emit.shuffle(other, other, lanes))


def add_products(emit: Any, mixed: list[list[Any]], u: list[Any]) -> list[Any]:
    """Return the sums of one degree, sum_r g[k, r] u[r], with ``mixed[v][j]`` made of g.

    A vector has as many columns as there are, or as fit. If there are fewer columns than lanes,
    lane i is of column i modulo their number: what belongs to a column is still to be added up.
    """
    columns = [list(column) for column in zip(*mixed, strict=True)]
    products = (_dot(emit, column, u) for column in columns)
    count = min(len(columns), emit.width)
    return [_merge(emit, products, count) for _ in range(len(columns) // count)]


def add_degrees(emit: Any, one: list[Any], other: list[Any], columns: int) -> list[Any]:
    """Return what `add_products` found for two degrees as vectors in the order (degree, column).

    A vector has at most the ``columns`` of two degrees.
    """
    width = emit.width
    if columns >= width:
        return [*one, *other]
    # Lanes with the bit `columns` are for the second degree.
    here = [lane + (width if lane & columns else 0) for lane in range(width)]
    there = [lane ^ columns for lane in here]
    return [emit.builder.fadd(*(emit.shuffle(*one, *other, lanes) for lanes in (here, there)))]
