"""First and second moments of the modulus of wavelet coefficients, as in a scattering transform."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import ParameterError
from spinsdw.harmonics import resize
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.statistics.spectra import sphere_mean
from spinsdw.tiling import LowpassTiling
from spinsdw.wavelet_transform import SpinWaveletTransform

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Scattering", "scattering"]

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Scattering:
    """The summary that `scattering` returns.

    Attributes
    ----------
    first : mapping of int to ndarray, shape (..., directions)
        Mean of ``|W^j|`` at each orientation; the unit of the signal.
    second : mapping of (int, int) to ndarray, shape (..., directions, directions)
        Under (j1, j2), j2 < j1: mean of ``||W^j1| * psi^j2|``, first the orientation of j1, then
        that of j2; the unit of the signal. At small scales that have fewer degrees than there are
        directions, the last axis is shorter.
    """

    first: Mapping[int, Array]
    second: Mapping[tuple[int, int], Array]


def scattering(transform: SpinWaveletTransform, coefficients: WaveletCoefficients) -> Scattering:
    """Summarise a signal by the means of moduli, to second order.

    ``S1(j, k) = mean |W^j_k|`` and ``S2(j1, k1, j2, k2) = mean ||W^j1_k1| * psi^j2_k2|`` over the
    sphere (eq-scattering): how strong structures of a scale are, and how their strength itself
    varies at every larger scale. A Gaussian field has nearly none of the latter.

    Parameters
    ----------
    transform : SpinWaveletTransform
        What made the coefficients; steerable, with a tiling that exists at every bandlimit.
    coefficients : WaveletCoefficients
        Of any spin, single or a batch.

    Returns
    -------
    Scattering
        The means, by scale and orientation.

    Raises
    ------
    ShapeError, DataError
        If the coefficients are not the transform's.
    ParameterError
        If the tiling is made for one bandlimit only, or the wavelets are not steerable.

    Notes
    -----
    ``|W|`` is a real scalar with no finite bandlimit: its mean, and its transform with the spin-0
    wavelets of the same kind, are those of its samples on the scale's grid. Cost O(N^2 L^3).

    Examples
    --------
    >>> from spinsdw.simulation import gaussian_flm
    >>> transform = SpinWaveletTransform(16, directions=2)
    >>> found = scattering(transform, transform.analysis_harmonic(gaussian_flm(np.ones(16), 16,
    ...                                                                        seed=1)))
    >>> found.first[3].shape, found.second[3, 1].shape
    ((2,), (2, 2))
    """
    _check(transform)
    arrays = transform.arrays(coefficients)
    first: dict[int, Array] = {}
    second: dict[tuple[int, int], Array] = {}
    for j in transform.scales:
        modulus = np.abs(arrays[j])
        first[j] = sphere_mean(modulus, transform.part_grid(j))
        if j > transform.scales[0]:
            second |= _second(transform, modulus, j)
    return Scattering(MappingProxyType(first), MappingProxyType(second))


def _check(transform: SpinWaveletTransform) -> None:
    tiling, orientations = transform.wavelets.tiling, transform.wavelets.orientations_of
    if not isinstance(tiling, LowpassTiling) or not hasattr(tiling, "dilation"):
        msg = f"tiling={tiling!r} must be one that a dilation makes, at any bandlimit."
        raise ParameterError(msg)
    if any(orientations(j).count != transform.directions for j in transform.scales):
        msg = "directionality must be steerable, with the same orientations at every scale."
        raise ParameterError(msg)


def _second(
    transform: SpinWaveletTransform, modulus: Array, scale: int
) -> dict[tuple[int, int], Array]:
    """Return the second order of one scale with every larger one."""
    grid = transform.part_grid(scale)
    harmonic = SpinHarmonicTransform(
        grid.bandlimit, sampling=grid, real=True, threads=transform.threads
    )
    inner = _larger_scales(transform, scale)
    # Larger scales see nothing above their own bandlimit.
    found = inner.analysis_harmonic(resize(harmonic.analysis(modulus), inner.bandlimit))
    return {
        (scale, j): sphere_mean(np.abs(found[j]), inner.part_grid(j))
        for j in inner.scales
        if j < scale
    }


def _larger_scales(transform: SpinWaveletTransform, scale: int) -> SpinWaveletTransform:
    """Return scalar wavelets of the same kind, whose kernels below a scale are the same."""
    tiling, grid = transform.wavelets.tiling, transform.part_grid(scale)
    # The last scale of a tiling takes all that is left, so there must be one more.
    beyond = math.floor(tiling.edges[scale - 1]) + 2  # type: ignore[attr-defined]
    size = min(max(tiling.scale_bandlimit(scale - 1), beyond), transform.bandlimit)
    return SpinWaveletTransform(
        size,
        0,
        min(transform.directions, size),
        tiling=replace(tiling, bandlimit=size),  # type: ignore[type-var]
        sampling=type(grid)(size),
        real=True,
        threads=transform.threads,
    )
