"""Fourier transforms: the only file that knows the FFT library.

Maps are [..., ring, phi], Fourier columns [..., m, ring], m counted modulo the number of points, or
m = 0 .. P // 2 for real maps. The change of layout is part of the transform. Arrays of single
precision are transformed in double.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

__all__ = [
    "fill_maps",
    "fill_maps_columns",
    "fill_orders",
    "fill_rings",
    "from_modes",
    "from_orders",
    "from_series",
    "to_modes",
    "to_orders",
    "to_series",
]

Array = np.ndarray[Any, Any]


def from_series(series: Array, out: Array) -> None:
    """Fill ``out[..., p] = sum_m series[..., m] exp(2 pi i m p / P)``.

    For a real ``out`` the series holds m = 0 .. P // 2.
    """
    _backward(series, out, series.ndim - 1)


def to_series(values: Array, out: Array) -> None:
    """Fill ``out[..., m] = sum_p values[..., p] exp(-2 pi i m p / P)``, the adjoint.

    For real ``values`` it fills m = 0 .. P // 2.
    """
    _forward(values, out, values.ndim - 1)


def fill_maps(columns: Array, maps: Array) -> None:
    """Fill ``maps[..., ring, p] = sum_m columns[..., m, ring] exp(2 pi i m p / P)``."""
    _backward(columns, np.swapaxes(maps, -1, -2), columns.ndim - 2)


def fill_maps_columns(maps: Array, columns: Array) -> None:
    """Fill ``columns[..., m, ring] = sum_p maps[..., ring, p] exp(-2 pi i m p / P)``."""
    _forward(np.swapaxes(maps, -1, -2), columns, maps.ndim - 2)


def from_orders(spectrum: Array, out: Array) -> None:
    """Fill ``out[k, ...] = sum_n spectrum[n, ...] exp(2 pi i n k / K)``; as `from_series`."""
    _backward(spectrum, out, 0)


def to_orders(values: Array, out: Array) -> None:
    """Fill ``out[n, ...] = sum_k values[k, ...] exp(-2 pi i n k / K)``; as `to_series`."""
    _forward(values, out, 0)


def fill_rings(orders: Array, pixels: Array, sizes: Array, phis: Array, starts: Array) -> None:
    """Fill rings of any lengths of real maps, many in one call.

    ``pixels[c, starts[r] + p] = sum_m orders[c, r, m] exp(i m (phis[r] + 2 pi p / sizes[r]))``,
    over m and -m with conjugates there; sizes and starts: uint64.
    """
    import ducc0

    ducc0.sht.leg2map(leg=orders, map=pixels, nphi=sizes, phi0=phis, ringstart=starts)


def fill_orders(pixels: Array, orders: Array, sizes: Array, phis: Array, starts: Array) -> None:
    """Fill ``orders[c, r, m]`` with the adjoint of `fill_rings`, conjugates left out."""
    import ducc0

    geometry = {"nphi": sizes, "phi0": phis, "ringstart": starts}
    ducc0.sht.map2leg(map=pixels, leg=orders, mmax=orders.shape[2] - 1, **geometry)


def from_modes(modes: Array, points: Array, accuracy: float, threads: int) -> Array:
    """Return ``sum_jk modes[j, k] exp(i (j x_p + k y_p))`` at any points, by a non-uniform FFT.

    modes: complex128, j and k counted modulo the sizes, the larger half negative; points: float64,
    shape (n, 2); the error relative to the root of the sum of squares is about ``accuracy``.
    """
    import ducc0

    found: Array = ducc0.nufft.u2nu(
        grid=modes,
        coord=points,
        forward=False,
        epsilon=accuracy,
        nthreads=threads,
        fft_order=True,
    )
    return found


def to_modes(values: Array, points: Array, out: Array, accuracy: float, threads: int) -> None:
    """Fill ``out[j, k] = sum_p values[p] exp(-i (j x_p + k y_p))``, the adjoint of `from_modes`."""
    import ducc0

    ducc0.nufft.nu2u(
        points=values,
        coord=points,
        forward=True,
        epsilon=accuracy,
        nthreads=threads,
        out=out,
        fft_order=True,
    )


@functools.cache
def _library() -> ModuleType:
    # Imported when first needed, and once: rings of a cap are thousands of calls.
    import ducc0

    return ducc0.fft


def _is_single(values: Array) -> bool:
    return values.dtype.char in "fF"


def _wide(values: Array) -> type[np.generic]:
    return np.complex128 if np.iscomplexobj(values) else np.float64


def _in_double(
    call: Callable[[Array, Array, int], None], given: Array, out: Array, axis: int
) -> None:
    """Transform arrays of which at least one is of single precision: rounded once, at the end."""
    wide = np.empty_like(out, dtype=_wide(out))
    call(given.astype(_wide(given)), wide, axis)
    out[...] = wide


def _backward(series: Array, out: Array, axis: int) -> None:
    fft = _library()
    if _is_single(series) or _is_single(out):
        _in_double(_backward, series, out, axis)
    elif out.dtype.kind == "c":
        fft.c2c(series, axes=(axis,), forward=False, out=out, nthreads=1)
    else:
        size = out.shape[axis]
        fft.c2r(series, axes=(axis,), forward=False, lastsize=size, out=out, nthreads=1)


def _forward(values: Array, out: Array, axis: int) -> None:
    if _is_single(values) or _is_single(out):
        _in_double(_forward, values, out, axis)
        return
    fft = _library()
    transform = fft.c2c if values.dtype.kind == "c" else fft.r2c
    transform(values, axes=(axis,), forward=True, out=out, nthreads=1)
