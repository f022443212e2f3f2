"""Wavelet coefficients in the layouts of S2LET and s2wav.

Both store 2 N_j - 1 orientations 2 pi g / (2 N_j - 1) of every scale, where N_j is N, or at a
scale with L_j < N the first number from L_j on that has the parity of N. This package stores N,
from which the others follow by steering. S2LET joins the scales to one array, with zeros at its
end where some N_j < N. s2wav keeps a list, samples scale 0 at the bandlimit of scale 1, and keeps
the scaling part as a field of the signal's spin where S2LET and this package keep a scalar.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.directionality import SteerableDirectionality
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.sampling import Sampling
from spinsdw.signals import check_map
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.tiling import s2let
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform

__all__ = [
    "coefficients_to_s2let",
    "coefficients_to_s2wav",
    "s2let_to_coefficients",
    "s2wav_to_coefficients",
]

Array = np.ndarray[Any, Any]

# Of a real signal's peer coefficients, what rounding may leave in the imaginary part.
_IMAGINARY = 1e-9


def _turn(values: Array, orders: Sequence[int], source: Array, target: Array) -> Array:
    """Take maps at angles that tell the orders apart to other angles; axis 0 is the angle."""
    apart = np.exp(-1j * np.outer(orders, source)) / source.size
    # The orders are symmetric about 0, so the matrix is real.
    weights = (np.exp(1j * np.outer(target, orders)) @ apart).real
    return np.einsum("gk,ktp->gtp", weights, values)


@dataclass(frozen=True)
class _Layout:
    """How a peer lays out the scales of a transform.

    ``first`` is the scale whose bandlimit all scales below it have as well.
    """

    transform: SpinWaveletTransform
    first: int

    def __post_init__(self) -> None:
        transform, tiling = self.transform, self.transform.wavelets.tiling
        directionality = transform.wavelets.directionality
        if not isinstance(directionality, SteerableDirectionality):
            msg = f"directionality={directionality!r} is none that the peer has; use directions=N."
            raise ParameterError(msg)
        highest = s2let.highest_scale(transform.bandlimit, transform.dilation)
        expected = {j: self._bandlimit(j) for j in range(transform.lowest_scale, highest + 1)}
        if {j: tiling.scale_bandlimit(j) for j in transform.scales} != expected:
            msg = (
                f"tiling has the scales {transform.scales} where the peer has {tuple(expected)}, "
                "or other bandlimits; use ScaleDiscretisedTiling(..., quadrature='s2let')."
            )
            raise ParameterError(msg)

    def _bandlimit(self, scale: int) -> int:
        transform = self.transform
        return min(math.ceil(transform.dilation ** (scale + 1)), transform.bandlimit)

    def own_grid(self, scale: int) -> Sampling:
        return self.transform.grid_of(self._bandlimit(scale))

    def grid(self, scale: int) -> Sampling:
        return self.transform.grid_of(self._bandlimit(max(scale, self.first)))

    def directions(self, scale: int) -> int:
        """N_j of the peer."""
        own = self.transform.directions
        found = min(own, self.grid(scale).bandlimit)
        return found + (found + own) % 2

    def shape(self, scale: int) -> tuple[int, int, int]:
        return (2 * self.directions(scale) - 1, *self.grid(scale).shape)

    def gammas(self, scale: int) -> Array:
        size = 2 * self.directions(scale) - 1
        return 2 * np.pi * np.arange(size) / size

    def orders(self, limit: int) -> tuple[int, ...]:
        """Return the orders of the wavelets that are below a limit."""
        directions = self.transform.directions
        return tuple(n for n in range(1 - directions, directions, 2) if abs(n) < limit)

    def export(self, values: Array, scale: int) -> Array:
        """Return one scale as the peer has it."""
        moved = self._regrid(values, self.own_grid(scale), self.grid(scale))
        orders = self.orders(self.transform.directions)
        ours = np.asarray(self.transform.orientations)
        turned = _turn(moved, orders, ours, self.gammas(scale))
        return np.ascontiguousarray(turned, dtype=np.complex128)

    def restore(self, values: Array, scale: int) -> Array:
        """Return one scale of the peer as we have it, dropping orders that no synthesis sees."""
        checked = check_map(values, self.shape(scale), real=False, name=f"scale {scale}")
        orders = self.orders(self.directions(scale))
        ours = np.asarray(self.transform.orientations)
        turned = _turn(self.real_part(checked), orders, self.gammas(scale), ours)
        return self._regrid(turned, self.grid(scale), self.own_grid(scale))

    def _regrid(self, values: Array, source: Sampling, target: Sampling) -> Array:
        """Take maps at our orientations from one grid to another, exactly for what both hold."""
        if source == target:
            return values
        orders = self.orders(min(source.bandlimit, target.bandlimit))
        if not orders:
            return np.zeros((len(values), *target.shape), dtype=values.dtype)
        first, second = (
            WignerTransform(grid.bandlimit, orders, sampling=grid, real=self.transform.real)
            for grid in (source, target)
        )
        ours = np.asarray(self.transform.orientations)
        wigner = first.analysis(_turn(values, orders, ours, first.gammas))
        resized = np.zeros((len(orders), target.bandlimit**2), dtype=np.complex128)
        size = min(resized.shape[-1], wigner.shape[-1])
        resized[:, :size] = wigner[:, :size]
        return _turn(second.synthesis(resized), orders, second.gammas, ours)

    def respin(self, values: Array, source: int, target: int) -> Array:
        """Return a scaling part of one spin as a field of another with the same coefficients."""
        if source == target:
            return values
        grid = self.transform.part_grid("scaling")
        if max(abs(source), abs(target)) >= grid.bandlimit:
            return np.zeros(grid.shape, dtype=np.complex128)
        first, second = (
            SpinHarmonicTransform(grid.bandlimit, spin, sampling=grid) for spin in (source, target)
        )
        return second.synthesis(first.analysis(values))

    def arrays(self, coefficients: WaveletCoefficients) -> dict[int | str, Array]:
        found = self.transform.arrays(coefficients)
        if found["scaling"].ndim != 2:
            msg = (
                f"coefficients have the batch {found['scaling'].shape[:-2]} but the peer takes "
                "one signal; convert each apart."
            )
            raise ShapeError(msg)
        return found

    def real_part(self, values: Array) -> Array:
        if not self.transform.real:
            return values
        largest = np.max(np.abs(values), initial=0.0)
        if np.max(np.abs(values.imag), initial=0.0) > _IMAGINARY * largest:
            msg = "values have imaginary parts but the transform has real=True; use real=False."
            raise DataError(msg)
        return np.ascontiguousarray(values.real)

    def coefficients(self, scaling: Array, scales: Sequence[Array]) -> WaveletCoefficients:
        transform = self.transform
        shape = transform.shapes["scaling"]
        checked = self.real_part(check_map(scaling, shape, real=False, name="f_scal"))
        arrays: dict[int | str, Array] = {"scaling": checked}
        for j, values in zip(transform.scales, scales, strict=True):
            arrays[j] = self.restore(values, j)
        return transform.from_arrays(arrays)


def _s2let_layout(transform: SpinWaveletTransform) -> _Layout:
    grid = transform.grid_of(transform.bandlimit)
    if grid.name != "mw":
        msg = f"sampling={grid.name!r} must be 'mw', which is all that pys2let has; use it."
        raise ParameterError(msg)
    return _Layout(transform, first=0)


def coefficients_to_s2let(
    transform: SpinWaveletTransform, coefficients: WaveletCoefficients
) -> tuple[Array, Array]:
    """Return coefficients as pys2let's ``analysis_px2wav`` does.

    Parameters
    ----------
    transform : SpinWaveletTransform
        What made them, on the MW grid, with the scales of S2LET:
        ``ScaleDiscretisedTiling(..., quadrature="s2let")`` has them always, and its kernels too.
    coefficients : WaveletCoefficients
        Of one signal.

    Returns
    -------
    f_wav : ndarray, shape (size,), complex128
        The scales one after the other, each (2 N_j - 1 gammas, rings, phi) flattened. Zeros fill it
        to the size that pys2let allocates, which forgets that N_j < N at small scales. Its
        ``wav_ind`` forgets that too, and is then wrong.
    f_scal : ndarray, shape (rings * phi,), complex128
        The scaling part, a scalar for any spin.

    Raises
    ------
    ParameterError
        If the tiling has other scales than S2LET, or the sampling is another.
    ShapeError
        If the coefficients are a batch, or not the transform's.

    See Also
    --------
    s2let_to_coefficients : The inverse.

    Examples
    --------
    >>> transform = SpinWaveletTransform(16, spin=2, directions=3, lowest_scale=1)
    >>> f_wav, f_scal = coefficients_to_s2let(transform, transform.analysis_harmonic(np.ones(256)))
    >>> f_wav.shape, f_scal.shape
    ((5700,), (6,))
    """
    layout = _s2let_layout(transform)
    arrays = layout.arrays(coefficients)
    scales = [layout.export(arrays[j], j).ravel() for j in transform.scales]
    padding = np.zeros(_s2let_size(layout) - sum(one.size for one in scales), dtype=complex)
    return np.concatenate([*scales, padding]), arrays["scaling"].ravel().astype(np.complex128)


def _s2let_size(layout: _Layout) -> int:
    """Return what pys2let allocates: N orders at every scale."""
    transform = layout.transform
    pixels = sum(math.prod(layout.grid(j).shape) for j in transform.scales)
    return (2 * transform.directions - 1) * pixels


def s2let_to_coefficients(
    transform: SpinWaveletTransform, f_wav: Array, f_scal: Array
) -> WaveletCoefficients:
    """Return pys2let's coefficients as ours.

    Parameters
    ----------
    transform : SpinWaveletTransform
        As in `coefficients_to_s2let`.
    f_wav, f_scal : ndarray, complex128
        As `coefficients_to_s2let` and pys2let return them; the zeros at the end may be missing.

    Returns
    -------
    WaveletCoefficients
        What gives the same synthesis. Orders that the wavelets do not hold, which pys2let can
        store and its synthesis does not see, are dropped.

    Raises
    ------
    ParameterError
        If the tiling has other scales than S2LET, or the sampling is another.
    ShapeError
        If an array has another size.
    DataError
        If a value is not finite, or not real for ``transform.real``.

    Examples
    --------
    >>> transform = SpinWaveletTransform(16, spin=2, directions=3, lowest_scale=1)
    >>> coefficients = transform.analysis_harmonic(np.ones(256))
    >>> again = s2let_to_coefficients(transform, *coefficients_to_s2let(transform, coefficients))
    >>> (again - coefficients).norm() < 1e-13 * coefficients.norm()
    True
    """
    layout = _s2let_layout(transform)
    shapes = [layout.shape(j) for j in transform.scales]
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    flat = np.asarray(f_wav)
    if flat.ndim != 1 or flat.size not in {int(ends[-1]), _s2let_size(layout)}:
        msg = f"f_wav has shape {flat.shape}; it must be ({_s2let_size(layout)},)."
        raise ShapeError(msg)
    parts = np.split(flat, ends)[: len(shapes)]
    scales = [part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)]
    shape = transform.shapes["scaling"]
    scaling = np.asarray(f_scal)
    if scaling.size != math.prod(shape):
        msg = f"f_scal has {scaling.size} values; it must have {math.prod(shape)}."
        raise ShapeError(msg)
    return layout.coefficients(scaling.reshape(shape), scales)


def coefficients_to_s2wav(
    transform: SpinWaveletTransform, coefficients: WaveletCoefficients
) -> tuple[list[Array], Array]:
    """Return coefficients as s2wav's ``analysis`` does.

    Parameters
    ----------
    transform : SpinWaveletTransform
        What made them, with the scales of s2wav, as in `coefficients_to_s2let`. The grid may be
        any that s2wav has, and multiresolution off as in its ``base`` module.
    coefficients : WaveletCoefficients
        Of one signal.

    Returns
    -------
    f_wav : list of ndarray, shape (2 N_j - 1 gammas, rings, phi), complex128
        One for each scale. Scale 0 has the bandlimit of scale 1.
    f_scal : ndarray, shape (rings, phi), complex128
        The scaling part as a field of the transform's spin.

    Raises
    ------
    ParameterError
        If the tiling has other scales than s2wav.
    ShapeError
        If the coefficients are a batch, or not the transform's.

    See Also
    --------
    s2wav_to_coefficients : The inverse.

    Examples
    --------
    >>> transform = SpinWaveletTransform(16, directions=3, lowest_scale=0)
    >>> f_wav, _ = coefficients_to_s2wav(transform, transform.analysis_harmonic(np.ones(256)))
    >>> [maps.shape for maps in f_wav[:3]]
    [(5, 4, 7), (5, 4, 7), (5, 8, 15)]
    """
    layout = _Layout(transform, first=1)
    arrays = layout.arrays(coefficients)
    scaling = layout.respin(arrays["scaling"], 0, transform.spin)
    scales = [layout.export(arrays[j], j) for j in transform.scales]
    return scales, np.asarray(scaling, dtype=np.complex128)


def s2wav_to_coefficients(
    transform: SpinWaveletTransform, f_wav: Sequence[Array], f_scal: Array
) -> WaveletCoefficients:
    """Return s2wav's coefficients as ours.

    Parameters
    ----------
    transform : SpinWaveletTransform
        As in `coefficients_to_s2wav`.
    f_wav, f_scal : sequence of ndarray, ndarray
        As `coefficients_to_s2wav` and s2wav return them.

    Returns
    -------
    WaveletCoefficients
        What gives the same synthesis, as for `s2let_to_coefficients`.

    Raises
    ------
    ParameterError
        If the tiling has other scales than s2wav.
    ShapeError
        If there are more or fewer scales, or one has another shape.
    DataError
        If a value is not finite, or not real for ``transform.real``.

    Examples
    --------
    >>> transform = SpinWaveletTransform(16, spin=2, directions=3, lowest_scale=2)
    >>> coefficients = transform.analysis_harmonic(np.ones(256))
    >>> again = s2wav_to_coefficients(transform, *coefficients_to_s2wav(transform, coefficients))
    >>> (again - coefficients).norm() < 1e-13 * coefficients.norm()
    True
    """
    layout = _Layout(transform, first=1)
    if len(f_wav) != len(transform.scales):
        msg = f"f_wav has {len(f_wav)} scales; it must have {len(transform.scales)}."
        raise ShapeError(msg)
    shape = transform.shapes["scaling"]
    scaling = check_map(f_scal, shape, real=False, name="f_scal")
    return layout.coefficients(layout.respin(scaling, transform.spin, 0), f_wav)
