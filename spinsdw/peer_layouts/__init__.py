"""Coefficients in the layouts of S2LET, s2wav, s2fft and so3, and back.

`wavelet` has wavelet coefficients in pixel space, `harmonic` those in harmonic space.
"""

from __future__ import annotations

from spinsdw.peer_layouts.harmonic import (
    flm_to_s2fft,
    s2fft_to_flm,
    s2fft_to_wigner,
    so3_to_wigner,
    wigner_to_s2fft,
    wigner_to_so3,
)
from spinsdw.peer_layouts.wavelet import (
    coefficients_to_s2let,
    coefficients_to_s2wav,
    s2let_to_coefficients,
    s2wav_to_coefficients,
)

__all__ = [
    "coefficients_to_s2let",
    "coefficients_to_s2wav",
    "flm_to_s2fft",
    "s2fft_to_flm",
    "s2fft_to_wigner",
    "s2let_to_coefficients",
    "s2wav_to_coefficients",
    "so3_to_wigner",
    "wigner_to_s2fft",
    "wigner_to_so3",
]
