"""All code that numba compiles, and nothing else.

Functions here take raw arrays, fill the arrays they are given, check nothing and return None or
a scalar. Callers own every promise: native float64 or complex128, C order, shapes as documented.
"""
