"""`WaveletCoefficients`: the scaling part and one array per scale, with their parameters."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from spinsdw.directionality import Directionality
from spinsdw.errors import ParameterError, ShapeError

__all__ = ["WaveletCoefficients"]

Array = np.ndarray[Any, Any]


class WaveletCoefficients:
    """Wavelet and scaling coefficients of one signal, or of a batch of signals.

    Parameters
    ----------
    scaling : ndarray, shape (..., rings, phi)
        Scaling coefficients, a scalar field.
    wavelets : mapping of int to ndarray, shape (..., directions, rings, phi)
        Coefficients of each scale j at orientations k pi / N.
    parameters : mapping
        What made them: bandlimit, spin, directions, dilation, lowest_scale, sampling,
        multiresolution, real.

    Notes
    -----
    Arithmetic acts on every number: ``a + b``, ``a - b``, ``2 * a``, and ``a * {j: factor}`` scale
    by scale, "scaling" being the key of the scaling part; `map` applies any function.

    Examples
    --------
    >>> import numpy as np
    >>> from spinsdw.wavelet_transform import SpinWaveletTransform
    >>> transform = SpinWaveletTransform(16, spin=2, directions=3)
    >>> coefficients = transform.analysis_harmonic(np.ones(256))
    >>> coefficients[2].shape
    (3, 8, 15)
    >>> (2 * coefficients - coefficients - coefficients).norm()
    0.0
    """

    __slots__ = ("_parameters", "_scaling", "_wavelets")
    # Let numpy scalars and arrays leave multiplication to this class.
    __array_ufunc__ = None

    def __init__(
        self, scaling: Array, wavelets: Mapping[int, Array], parameters: Mapping[str, Any]
    ) -> None:
        self._scaling = np.asarray(scaling)
        self._wavelets = {int(j): np.asarray(wavelets[j]) for j in sorted(wavelets)}
        self._parameters = MappingProxyType(dict(parameters))
        directions = self._parameters.get("directions")
        for j, values in self._wavelets.items():
            batch_agrees = values.shape[:-3] == self._scaling.shape[:-2]
            if values.ndim < 3 or values.shape[-3] != directions or not batch_agrees:
                msg = (
                    f"scale {j} has shape {values.shape}; it must be (..., {directions}, rings, "
                    f"phi) with the batch of the scaling part, {self._scaling.shape[:-2]}."
                )
                raise ShapeError(msg)

    @property
    def scaling(self) -> Array:
        """Scaling coefficients, shape (..., rings, phi)."""
        return self._scaling

    @property
    def scales(self) -> tuple[int, ...]:
        """The scales j held, increasing: from large to small structures."""
        return tuple(self._wavelets)

    @property
    def parameters(self) -> Mapping[str, Any]:
        """What made the coefficients; read-only."""
        return self._parameters

    @property
    def shapes(self) -> dict[int | str, tuple[int, ...]]:
        """Shape of the scaling part and of every scale."""
        return {key: values.shape for key, values in self._items()}

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(values.nbytes for _, values in self._items())

    def _items(self) -> Iterator[tuple[int | str, Array]]:
        yield "scaling", self._scaling
        yield from self._wavelets.items()

    def __getitem__(self, scale: int) -> Array:
        try:
            return self._wavelets[scale]
        except (KeyError, TypeError):
            msg = f"scale={scale!r} is not held; the scales are {self.scales}."
            raise ParameterError(msg) from None

    def __len__(self) -> int:
        return len(self._wavelets)

    def __iter__(self) -> Iterator[int]:
        return iter(self._wavelets)

    def __repr__(self) -> str:
        kept = ("bandlimit", "spin", "directions", "dilation", "lowest_scale", "sampling")
        parameters = ", ".join(
            f"{name}={self._parameters[name]!r}" for name in kept if name in self._parameters
        )
        lines = [f"WaveletCoefficients({parameters}): {self.nbytes / 2**20:.3g} MiB"]
        lines += [
            f"  {'scaling' if key == 'scaling' else f'scale {key}'}: "
            f"{' x '.join(map(str, values.shape))} {values.dtype}"
            for key, values in self._items()
        ]
        return "\n".join(lines)

    def _with(self, function: Callable[[int | str, Array], Array]) -> WaveletCoefficients:
        scaling = function("scaling", self._scaling)
        wavelets = {j: function(j, values) for j, values in self._wavelets.items()}
        return WaveletCoefficients(scaling, wavelets, self._parameters)

    def copy(self) -> WaveletCoefficients:
        """Return coefficients with arrays of their own."""
        return self._with(lambda _, values: values.copy())

    def map(self, function: Callable[[Array], Array]) -> WaveletCoefficients:
        """Apply a function of arrays to the scaling part and to every scale.

        Parameters
        ----------
        function : callable
            Takes an array and returns one of the same shape.

        Returns
        -------
        WaveletCoefficients
            The results.

        Raises
        ------
        ShapeError
            If the function changes a shape.
        """

        def apply(key: int | str, values: Array) -> Array:
            result = np.asarray(function(values))
            if result.shape != values.shape:
                msg = (
                    f"function turned the shape {values.shape} of {key} into {result.shape}; "
                    "it must keep it."
                )
                raise ShapeError(msg)
            return result

        return self._with(apply)

    def norm(self) -> float:
        """Return the root of the sum of squares of all stored numbers (not an integral)."""
        return float(np.sqrt(sum(np.vdot(v, v).real for _, v in self._items())))

    def _combine(
        self, other: WaveletCoefficients, operation: Callable[[Array, Array], Array]
    ) -> WaveletCoefficients:
        if self.shapes != other.shapes:
            msg = f"coefficients with shapes {self.shapes} and {other.shapes} cannot be combined."
            raise ShapeError(msg)
        if dict(self._parameters) != dict(other._parameters):
            msg = (
                f"coefficients of different transforms cannot be combined: "
                f"{dict(self._parameters)} and {dict(other._parameters)}."
            )
            raise ParameterError(msg)
        others = dict(other._items())
        return self._with(lambda key, values: operation(values, others[key]))

    def __add__(self, other: WaveletCoefficients) -> WaveletCoefficients:
        if not isinstance(other, WaveletCoefficients):
            return NotImplemented
        return self._combine(other, operator.add)

    def __sub__(self, other: WaveletCoefficients) -> WaveletCoefficients:
        if not isinstance(other, WaveletCoefficients):
            return NotImplemented
        return self._combine(other, operator.sub)

    def __mul__(self, factor: complex | Mapping[Any, Any]) -> WaveletCoefficients:
        if isinstance(factor, Mapping):
            unknown = set(factor) - {"scaling", *self.scales}
            if unknown:
                msg = f"factors for {sorted(map(str, unknown))} match no scale of {self.scales}."
                raise ParameterError(msg)
            return self._with(lambda key, values: values * np.asarray(factor.get(key, 1.0)))
        if np.ndim(factor) != 0:
            return NotImplemented
        return self._with(lambda _, values: values * factor)

    __rmul__ = __mul__

    def __truediv__(self, divisor: complex) -> WaveletCoefficients:
        if not np.isscalar(divisor):
            return NotImplemented
        return self._with(lambda _, values: values / divisor)

    def __neg__(self) -> WaveletCoefficients:
        return self._with(lambda _, values: -values)

    def steer(self, angle: float) -> dict[int, Array]:
        """Compute every scale's coefficients at one orientation, exactly.

        W(gamma) = sum_k z(gamma - gamma_k) W(gamma_k), z(g) = (1/N) sum_n e^{i n g} over the
        orders of the wavelet.

        Parameters
        ----------
        angle : float
            gamma in radians.

        Returns
        -------
        dict of int to ndarray, shape (..., rings, phi)
            The coefficients of each scale at that orientation.
        """
        weights = Directionality(self._parameters["directions"]).steering_weights(angle)
        return {
            j: np.einsum("k,...ktp->...tp", weights, values) for j, values in self._wavelets.items()
        }
