"""Statistics of wavelet coefficients: what theory expects, what a map has, and what is noise.

`theory` has variances and covariances for given power spectra, `spectra` the powers measured, with
weights, `denoising` the shrinkage of noisy coefficients, `scattering` the moments of their modulus,
`coupling` what a mask does to a power spectrum.
"""

from __future__ import annotations

from spinsdw.statistics.coupling import mode_coupling
from spinsdw.statistics.denoising import denoise, shrinkage_levels
from spinsdw.statistics.scattering import Scattering, scattering
from spinsdw.statistics.spectra import scale_spectra
from spinsdw.statistics.theory import covariance_function, wavelet_covariance, wavelet_variance

__all__ = [
    "Scattering",
    "covariance_function",
    "denoise",
    "mode_coupling",
    "scale_spectra",
    "scattering",
    "shrinkage_levels",
    "wavelet_covariance",
    "wavelet_variance",
]
