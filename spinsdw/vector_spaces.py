"""What transforms take and give, as vectors: maps, coefficients of any kind, and back.

Every space keeps dot products. Harmonic and Wigner coefficients of real functions depend on each
other in pairs, ``v_{-m,-n} = (-1)**(m + n) conj(v_mn)``; their vector is real and holds
``sqrt(2) Re v`` and ``sqrt(2) Im v`` in the places of a pair, and v where it is its own opposite.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.harmonics import degrees, index, orders
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = [
    "ArraySpace",
    "CoefficientSpace",
    "PairedSpace",
    "PartSpace",
    "VectorSpace",
    "harmonic_space",
    "wigner_space",
]

Array = np.ndarray[Any, Any]


class VectorSpace(ABC):
    """A space of objects that can be written as vectors; leading axes are a batch."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Entries of a vector."""

    @property
    @abstractmethod
    def dtype(self) -> np.dtype[Any]:
        """Type of the entries: float64 or complex128."""

    @abstractmethod
    def to_vector(self, values: Any) -> Array:
        """Return an object as a vector, shape (..., size)."""

    @abstractmethod
    def from_vector(self, vector: Array) -> Any:
        """Return the object of a vector, shape (..., size)."""


def _dtype(*, real: bool) -> np.dtype[Any]:
    return np.dtype(np.float64 if real else np.complex128)


@dataclass(frozen=True, eq=False)
class ArraySpace(VectorSpace):
    """Arrays of one shape, entry by entry.

    Parameters
    ----------
    shape : tuple of int
        Of one object.
    real : bool
        Whether the entries are real.

    Examples
    --------
    >>> ArraySpace((2, 3), True).to_vector(np.ones((5, 2, 3))).shape
    (5, 6)
    """

    shape: tuple[int, ...]
    real: bool

    @property
    def size(self) -> int:
        """Entries of an array."""
        return math.prod(self.shape)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the entries."""
        return _dtype(real=self.real)

    def to_vector(self, values: Array) -> Array:
        """Return arrays, of ``shape``, as vectors, shape (..., size)."""
        values = np.asarray(values)
        return values.reshape(*values.shape[: values.ndim - len(self.shape)], self.size)

    def from_vector(self, vector: Array) -> Array:
        """Return vectors, shape (..., size), as arrays of ``shape``."""
        return np.asarray(vector).reshape(*np.shape(vector)[:-1], *self.shape)


@dataclass(frozen=True, eq=False)
class PairedSpace(VectorSpace):
    """Coefficients of real functions, as real vectors of as many entries.

    Parameters
    ----------
    shape : tuple of int
        Of one object.
    opposite : ndarray of int, shape (size,)
        Where the opposite of each entry stands.
    signs : ndarray, shape (size,)
        ``v[opposite] = signs * conj(v)``.
    """

    shape: tuple[int, ...]
    opposite: Array
    signs: Array

    @property
    def size(self) -> int:
        """Entries of an array."""
        return math.prod(self.shape)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the entries, float64."""
        return _dtype(real=True)

    @cached_property
    def _pairs(self) -> tuple[Array, Array, Array]:
        """The latter of each pair, the former, and those that are their own opposite."""
        places = np.arange(self.size)
        latter = np.flatnonzero(places > self.opposite)
        return latter, self.opposite[latter], np.flatnonzero(places == self.opposite)

    def to_vector(self, values: Array) -> Array:
        """Return coefficients, of ``shape``, as vectors; those of m > 0 are read."""
        values = np.asarray(values)
        flat = values.reshape(*values.shape[: values.ndim - len(self.shape)], self.size)
        latter, former, alone = self._pairs
        vector = np.empty(flat.shape)
        vector[..., latter] = math.sqrt(2) * flat[..., latter].real
        vector[..., former] = math.sqrt(2) * flat[..., latter].imag
        vector[..., alone] = flat[..., alone].real
        return vector

    def from_vector(self, vector: Array) -> Array:
        """Return vectors, shape (..., size), as coefficients of real functions."""
        vector = np.asarray(vector)
        latter, former, alone = self._pairs
        flat = np.empty(vector.shape, dtype=np.complex128)
        flat[..., latter] = (vector[..., latter] + 1j * vector[..., former]) / math.sqrt(2)
        flat[..., former] = self.signs[latter] * flat[..., latter].conj()
        flat[..., alone] = vector[..., alone]
        return flat.reshape(*vector.shape[:-1], *self.shape)


def harmonic_space(bandlimit: int, *, real: bool) -> VectorSpace:
    """Return the space of harmonic coefficients, shape (bandlimit**2,).

    Parameters
    ----------
    bandlimit : int
    real : bool
        Whether they are those of real fields: then a vector holds, for m > 0, sqrt(2) Re f_lm at
        the place of m and sqrt(2) Im f_lm at that of -m.

    Returns
    -------
    VectorSpace

    Examples
    --------
    >>> space = harmonic_space(2, real=True)
    >>> space.to_vector(np.array([3, -1 + 2j, 4, 1 + 2j])).round(3).tolist()
    [3.0, 2.828, 4.0, 1.414]
    """
    return _real_harmonics(bandlimit) if real else ArraySpace((bandlimit**2,), False)


def _real_harmonics(bandlimit: int) -> PairedSpace:
    el, m = degrees(bandlimit), orders(bandlimit)
    return PairedSpace((bandlimit**2,), index(el, -m), (-1.0) ** m)


def wigner_space(bandlimit: int, wigner_orders: tuple[int, ...], *, real: bool) -> VectorSpace:
    """Return the space of Wigner coefficients, shape (orders, bandlimit**2).

    Parameters
    ----------
    bandlimit : int
    wigner_orders : tuple of int
        The orders n, increasing; symmetric about 0 if ``real``.
    real : bool
        Whether they are those of real functions.

    Returns
    -------
    VectorSpace

    Examples
    --------
    >>> wigner_space(4, (-1, 1), real=True).size
    32
    """
    count = len(wigner_orders)
    if not real:
        return ArraySpace((count, bandlimit**2), False)
    one = _real_harmonics(bandlimit)
    rows = np.arange(count)[::-1, None] * bandlimit**2
    signs = (-1.0) ** np.array(wigner_orders)[:, None] * one.signs
    return PairedSpace(
        (count, bandlimit**2), (rows + one.opposite).ravel(), np.asarray(signs.ravel())
    )


@dataclass(frozen=True, eq=False)
class _JointSpace(VectorSpace):
    """The parts of coefficients one after the other: "scaling", then the scales upwards."""

    transform: SpinWaveletTransform

    @property
    @abstractmethod
    def _spaces(self) -> dict[int | str, VectorSpace]:
        """The space of each part."""

    @property
    def size(self) -> int:
        """Entries of all parts."""
        return sum(space.size for space in self._spaces.values())

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the entries."""
        return _dtype(real=self.transform.real)

    def _join(self, parts: dict[int | str, Array]) -> Array:
        vectors = [space.to_vector(parts[key]) for key, space in self._spaces.items()]
        return np.concatenate(vectors, axis=-1)

    def _cut(self, vector: Array) -> dict[int | str, Array]:
        ends = np.cumsum([space.size for space in self._spaces.values()])[:-1]
        pieces = np.split(np.asarray(vector), ends, axis=-1)
        spaces = self._spaces.items()
        return {
            key: space.from_vector(piece)
            for (key, space), piece in zip(spaces, pieces, strict=True)
        }


class CoefficientSpace(_JointSpace):
    """Wavelet coefficients of a transform: the samples of all parts.

    Parameters
    ----------
    transform : SpinWaveletTransform

    Examples
    --------
    >>> space = CoefficientSpace(SpinWaveletTransform(8, directions=2, real=True))
    >>> space.size, space.dtype
    (549, dtype('float64'))
    """

    @cached_property
    def _spaces(self) -> dict[int | str, VectorSpace]:
        real = self.transform.real
        return {key: ArraySpace(shape, real) for key, shape in self.transform.shapes.items()}

    def to_vector(self, values: WaveletCoefficients) -> Array:
        """Return coefficients as vectors, shape (..., size)."""
        return self._join(self.transform.arrays(values))

    def from_vector(self, vector: Array) -> WaveletCoefficients:
        """Return vectors, shape (..., size), as coefficients of the transform."""
        return self.transform.from_arrays(self._cut(vector))


class PartSpace(_JointSpace):
    """The Wigner coefficients of all parts, as `SpinWaveletTransform.analysis_wigner` gives them.

    Parameters
    ----------
    transform : SpinWaveletTransform

    Examples
    --------
    >>> PartSpace(SpinWaveletTransform(8, directions=2)).size
    297
    """

    @cached_property
    def _spaces(self) -> dict[int | str, VectorSpace]:
        wavelets, real = self.transform.wavelets, self.transform.real
        scaling = harmonic_space(wavelets.tiling.scaling_bandlimit, real=real)
        found: dict[int | str, VectorSpace] = {"scaling": scaling}
        for scale in wavelets.scales:
            size = wavelets.tiling.scale_bandlimit(scale)
            orders_held = wavelets.orientations_of(scale).orders
            found[scale] = wigner_space(size, orders_held, real=real)
        return found

    def to_vector(self, values: dict[int | str, Array]) -> Array:
        """Return the parts as vectors, shape (..., size)."""
        return self._join(values)

    def from_vector(self, vector: Array) -> dict[int | str, Array]:
        """Return vectors, shape (..., size), as parts."""
        return self._cut(vector)
