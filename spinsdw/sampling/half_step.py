"""`HalfStep`: the shift of a periodic band-limited function by half a sampling step, and back.

On C points the shift multiplies mode k by exp(i k pi / C): two Fourier transforms of length C. If
C has a large prime factor those are slow (2047 = 23 x 89 takes four times as long as 2048), and the
same circular convolution is done by transforms of a smooth length M >= 2 C - 1.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.fourier import from_series, to_series

__all__ = ["HalfStep", "modes"]

Array = np.ndarray[Any, Any]

# The longer transforms must be cheaper by this factor, in the estimate below, to be used.
_GAIN = 1.6


def _cost(size: int) -> float:
    """Estimate the work of a transform: size times the sum of its prime factors."""
    total, rest, factor = 0.0, size, 2
    while rest > 1:
        if rest % factor == 0:
            total += factor if factor <= 5 else 1.1 * factor
            rest //= factor
        else:
            factor += 1 if factor * factor <= rest else rest - factor
    return total * size


def _smooth_size(least: int) -> int:
    """Return the cheapest of the lengths just above ``least``."""
    return min(range(least, least + least // 8 + 2), key=lambda size: (_cost(size), size))


def modes(size: int) -> Array:
    """Return 0, 1, .., -1: the mode of each place of a Fourier series."""
    k = np.arange(size)
    return np.where(2 * k < size, k, k - size)


@dataclass(frozen=True)
class HalfStep:
    """Shift circles of ``size`` points by half a step.

    Parameters
    ----------
    size : int
        C, the points of a circle.

    Examples
    --------
    >>> import numpy as np
    >>> circle = np.cos(2 * np.pi * np.arange(7) / 7) + 0j
    >>> shifted = HalfStep(7).shift(circle[None])[0]
    >>> bool(np.allclose(shifted, np.cos(2 * np.pi * (np.arange(7) + 0.5) / 7), rtol=0, atol=1e-15))
    True
    """

    size: int

    @functools.cached_property
    def _length(self) -> int:
        smooth = _smooth_size(2 * self.size - 1)
        return smooth if _cost(self.size) > _GAIN * _cost(smooth) else self.size

    @functools.cached_property
    def _factors(self) -> Array:
        """What multiplies each mode of the transforms in use, their norm included."""
        phases = np.exp(1j * np.pi * modes(self.size) / self.size)
        if self.size % 2 == 0:
            # The Nyquist term has no half-step: it carries nothing.
            phases[self.size // 2] = 0.0
        if self._length == self.size:
            return phases / self.size
        kernel = np.zeros(self._length, dtype=np.complex128)
        kernel[: self.size] = np.fft.ifft(phases)
        kernel[1 - self.size :] = kernel[1 : self.size]
        return np.fft.fft(kernel) / self._length

    def _apply(self, circles: Array, factors: Array) -> Array:
        if self._length == self.size:
            values = np.empty_like(circles)
            to_series(circles, values)
        else:
            values = np.zeros((*circles.shape[:-1], self._length), dtype=np.complex128)
            values[..., : self.size] = circles
            to_series(values, values)
        values *= factors
        from_series(values, values)
        return values[..., : self.size]

    def shift(self, circles: Array) -> Array:
        """Return values half a step further on; shape (..., size), complex128."""
        return self._apply(circles, self._factors)

    def shift_back(self, circles: Array) -> Array:
        """Apply the transpose of `shift`, which is its inverse on band-limited circles."""
        return self._apply(circles, self._factors.conj())
