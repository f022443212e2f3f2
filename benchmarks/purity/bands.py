"""What is judged: the B of each band, from whatever a method returns.

Band j is the field with the kernel kappa_j. With one direction it is a separator's own
coefficients, W^j = -(E_j + i B_j) / sqrt(2 pi), evaluated at the pixels; with more directions it is
their synthesis without the second kappa_j.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.purity.settings import LOWEST_SCALE, Setting
from spinsdw import EBSeparator, WaveletCoefficients
from spinsdw.harmonics import multiply_by_degree, resize, spin_to_eb
from spinsdw.healpix import flm_to_map
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["Bands", "SeparatorBands", "synthesised_bands"]

Array = np.ndarray
Bands = Callable[[Array, Array], Array]
"""Q and U of shape (batch, npix) -> B of every band, shape (batch, scales, npix)."""


def evaluated_bands(coefficients: WaveletCoefficients, setting: Setting) -> Array:
    """Evaluate the coefficients of wavelets with one direction, shape (batch, scales, npix)."""
    bands = []
    for j in setting.scales:
        values = -np.sqrt(2 * np.pi) * coefficients[j].imag[:, 0]
        grid = SpinHarmonicTransform(values.shape[-2], real=True)
        bands.append(flm_to_map(grid.analysis(values), setting.nside, real=True))
    return np.stack(bands, axis=1)


def synthesised_bands(
    coefficients: WaveletCoefficients, transform: SpinWaveletTransform, setting: Setting
) -> Array:
    """Synthesise each scale by wavelets without their kernel, shape (batch, scales, npix)."""
    bands = []
    for j in setting.scales:
        kernel = setting.tiling.kernel(j)
        # Below 1e-6 a kernel has no weight in any sum, and rounding would be blown up.
        inverse = np.divide(1.0, kernel, out=np.zeros_like(kernel), where=kernel > 1e-6)
        plm = transform.synthesis_harmonic(coefficients, parts=(j,))
        _, b_lm = spin_to_eb(multiply_by_degree(plm, inverse))
        b_lm = resize(b_lm, transform.bandlimits[j])
        bands.append(flm_to_map(b_lm, setting.nside, real=True))
    return np.stack(bands, axis=1)


@dataclass(frozen=True, eq=False)
class SeparatorBands:
    """The bands of an `EBSeparator` with the wavelets of a setting."""

    separator: EBSeparator
    setting: Setting

    @classmethod
    def of_method(
        cls, method: object, mask: Array, setting: Setting, *, directions: int = 1
    ) -> SeparatorBands:
        """Make the separator of a method: its name, or an object of `spinsdw.separation`."""
        separator = EBSeparator(
            setting.bandlimit,
            mask,
            method=method,
            directions=directions,
            lowest_scale=LOWEST_SCALE,
            beam=setting.beam,
        )
        return cls(separator, setting)

    def separate(self, q: Array, u: Array) -> WaveletCoefficients:
        """Return the coefficients of a separation; what is timed."""
        return self.separator.separate(q, u).coefficients

    def evaluate(self, coefficients: WaveletCoefficients) -> Array:
        """Return the B of every band, shape (batch, scales, npix)."""
        if self.separator.directions == 1:
            return evaluated_bands(coefficients, self.setting)
        transform = SpinWaveletTransform(
            self.setting.bandlimit, 2, self.separator.directions, lowest_scale=LOWEST_SCALE
        )
        return synthesised_bands(coefficients, transform, self.setting)

    def __call__(self, q: Array, u: Array) -> Array:
        """Return the B of every band, shape (batch, scales, npix)."""
        return self.evaluate(self.separate(q, u))
