"""The pseudo estimator: weigh each wavelet coefficient of the masked map by what it can see.

The three steps of McEwen et al. 2014 (arXiv:1412.1340): a spin wavelet transform of M (Q + iU); a
mitigation of the mask in wavelet space; a scalar synthesis of minus the real and imaginary parts.
The weights depend on scale, position and orientation through the share of each wavelet's energy
that falls where the sky is not observed.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.masks import taper
from spinsdw.separation.energy_share import energy_shares
from spinsdw.separation.skies import GridSky, HealpixSky
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["PseudoMethod"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False)
class PseudoMethod:
    """Weights of the pseudo estimator for one mask, computed once.

    Parameters
    ----------
    transform : SpinWaveletTransform
        Spin-2 wavelets.
    sky : HealpixSky or GridSky
        Where the mask lives.
    mask : ndarray or None
        Mask in [0, 1]; None for the full sky.
    largest_share : float
        Share of energy in the hole at which a coefficient is dropped.
    """

    transform: SpinWaveletTransform
    sky: HealpixSky | GridSky
    mask: Array | None
    largest_share: float

    @functools.cached_property
    def shares(self) -> dict[int | str, Array]:
        """Share of each wavelet's energy in the holes; shapes of the coefficients."""
        if self.mask is None:
            return {key: np.zeros(shape) for key, shape in self.transform.shapes.items()}
        holes = 1.0 - self.mask
        return energy_shares(self.transform, lambda size: self.sky.integrals(holes, size))

    @functools.cached_property
    def weights(self) -> dict[int | str, Array]:
        """1 where a wavelet sees no hole, falling smoothly to 0 at ``largest_share``."""
        return {key: 1.0 - taper(share / self.largest_share) for key, share in self.shares.items()}

    @property
    def sky_fraction(self) -> float:
        """Mean of the mask over the sphere."""
        if self.mask is None:
            return 1.0
        return float(self.sky.integrals(self.mask, 1)[0].real / np.sqrt(4 * np.pi))

    @functools.cached_property
    def kept_fraction(self) -> dict[int | str, float]:
        """Mean of the weights over the sphere and the orientations, for each scale."""
        if self.mask is None:
            return dict.fromkeys(self.weights, 1.0)
        return {
            key: self.sphere_mean(values.reshape(-1, *values.shape[-2:]).mean(axis=0))
            for key, values in self.weights.items()
        }

    def sphere_mean(self, values: Array) -> float:
        """Return the mean over the sphere of non-negative values at the positions of a scale."""
        # Samples crowd at the poles: a plain mean would be one of the poles.
        bandlimit = values.shape[1] // 2 if self.sky.sampling_name == "mwss" else values.shape[0]
        transform = SpinHarmonicTransform(
            bandlimit, sampling=self.sky.sampling_name, real=True, threads=self.transform.threads
        )
        mean = transform.analysis(values)[0].real / np.sqrt(4 * np.pi)
        # A mean lies between the extremes; the quadrature of rough values may miss that a little.
        return float(np.clip(mean, values.min(), values.max()))

    def apply(self, coefficients: WaveletCoefficients) -> WaveletCoefficients:
        """Weigh the coefficients of the masked map."""
        return coefficients if self.mask is None else coefficients * self.weights
