"""`Survey`: where the sky was observed, how well, and the wavelets it is looked at with."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.separation.energy_share import energy_shares
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["Survey"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False)
class Survey:
    """What every method of separation is prepared for.

    Parameters
    ----------
    transform : SpinWaveletTransform
        Spin-2 wavelets, on grids of the sky's kind.
    sky : HealpixSky or GridSky
        The pixelisation of maps and mask.
    mask : ndarray, shape of a map, float64, or None
        In [0, 1], ring order; None for the full sky.
    inverse_noise : ndarray, shape of a map, float64, or None
        Inverse noise variance in any unit, 0 where not observed; None where it is uniform.
    beam : ndarray, shape (bandlimit,), float64
        Window function b_l of the maps.
    """

    transform: SpinWaveletTransform
    sky: HealpixSky | GridSky
    mask: Array | None
    inverse_noise: Array | None
    beam: Array

    @property
    def bandlimit(self) -> int:
        """Degrees used are below it."""
        return self.sky.bandlimit

    @property
    def threads(self) -> int | None:
        """Threads of the transforms."""
        return self.transform.threads

    @property
    def map_shape(self) -> tuple[int, ...]:
        """Shape of one map."""
        return self.sky.map_shape

    @functools.cached_property
    def footprint(self) -> Array:
        """The mask as an array: ones on the full sky; shape of a map, float64."""
        return np.ones(self.map_shape) if self.mask is None else self.mask

    @functools.cached_property
    def observed(self) -> Array:
        """Where the mask is not zero; shape of a map, bool."""
        return self.footprint > 0

    @functools.cached_property
    def weights(self) -> Array:
        """Mask times inverse noise, with mean 1 where observed; shape of a map, float64."""
        if self.inverse_noise is None:
            return self.footprint
        weights = self.footprint * self.inverse_noise
        return weights / weights[weights > 0].mean()

    @functools.cached_property
    def scalar_transform(self) -> SpinWaveletTransform:
        """The same wavelets for complex scalar fields such as E + iB."""
        two = self.transform
        return SpinWaveletTransform(
            two.bandlimit,
            0,
            two.directions,
            tiling=two.tiling,
            sampling=two.sampling,
            threads=two.threads,
        )

    @functools.cached_property
    def shares(self) -> dict[int | str, Array]:
        """Share of each wavelet's energy where the sky is not observed (eq-energy-share).

        Arrays of the shapes of the coefficients, in [0, 1].
        """
        if self.mask is None:
            return {key: np.zeros(shape) for key, shape in self.transform.shapes.items()}
        holes = 1.0 - self.mask
        return energy_shares(self.transform, lambda size: self.sky.integrals(holes, size))

    @functools.cached_property
    def seen_shares(self) -> dict[int | str, Array]:
        """Share of each wavelet's energy where the sky is observed: 1 minus `shares`."""
        return {key: 1.0 - share for key, share in self.shares.items()}

    @property
    def sky_fraction(self) -> float:
        """Mean of the mask over the sphere."""
        if self.mask is None:
            return 1.0
        return float(self.sky.integrals(self.mask, 1)[0].real / np.sqrt(4 * np.pi))

    def sphere_mean(self, values: Array) -> float:
        """Return the mean over the sphere of non-negative values at the positions of a scale."""
        # Samples crowd at the poles: a plain mean would be one of the poles.
        bandlimit = values.shape[1] // 2 if self.sky.sampling_name == "mwss" else values.shape[0]
        transform = SpinHarmonicTransform(
            bandlimit, sampling=self.sky.sampling_name, real=True, threads=self.threads
        )
        mean = transform.analysis(values)[0].real / np.sqrt(4 * np.pi)
        # A mean lies between the extremes; the quadrature of rough values may miss that a little.
        return float(np.clip(mean, values.min(), values.max()))
