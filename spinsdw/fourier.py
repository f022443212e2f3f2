"""Fourier transforms along rings: the only file that knows the FFT library."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["from_half_series", "from_series", "to_half_series", "to_series"]

Array = np.ndarray[Any, Any]


def from_series(series: Array, out: Array) -> None:
    """Fill ``out[..., p] = sum_m series[..., m] exp(2 pi i m p / P)``, m counted modulo P."""
    import ducc0

    ducc0.fft.c2c(series, axes=(series.ndim - 1,), forward=False, out=out, nthreads=1)


def to_series(values: Array, out: Array) -> None:
    """Fill ``out[..., m] = sum_p values[..., p] exp(-2 pi i m p / P)``."""
    import ducc0

    ducc0.fft.c2c(values, axes=(values.ndim - 1,), forward=True, out=out, nthreads=1)


def from_half_series(series: Array, out: Array) -> None:
    """As `from_series` for real ``out``: ``series`` holds m = 0 .. P // 2."""
    import ducc0

    ducc0.fft.c2r(
        series,
        axes=(series.ndim - 1,),
        forward=False,
        lastsize=out.shape[-1],
        out=out,
        nthreads=1,
    )


def to_half_series(values: Array, out: Array) -> None:
    """As `to_series` for real ``values``: ``out`` holds m = 0 .. P // 2."""
    import ducc0

    ducc0.fft.r2c(values, axes=(values.ndim - 1,), forward=True, out=out, nthreads=1)
