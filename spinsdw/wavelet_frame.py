"""`WaveletFrame`: a wavelet transform in harmonic space, where nothing is sampled."""

from __future__ import annotations

import functools
import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from spinsdw.errors import PrecisionWarning
from spinsdw.harmonics import check_flm
from spinsdw.wavelets import Wavelets
from spinsdw.wigner_parts import check_parts, flm_to_parts, parts_to_flm

__all__ = ["WaveletFrame"]

Array = np.ndarray[Any, Any]


class WaveletFrame(ABC):
    """What a wavelet transform can do without a grid: its Wigner door, and what it cannot hold."""

    @property
    @abstractmethod
    def wavelets(self) -> Wavelets:
        """The wavelets and scaling function in harmonic space."""

    @functools.cached_property
    def _dual(self) -> Wavelets:
        """The wavelets of the synthesis."""
        return self.wavelets.dual

    @property
    def admissibility_error(self) -> float:
        """Largest deviation from 1 of the sum that makes synthesis exact."""
        return self.wavelets.admissibility_error

    def analysis_wigner(self, flm: Array) -> dict[int | str, Array]:
        """Compute the Wigner coefficients of every scale from harmonic coefficients.

        They are the harmonic form of what `analysis_harmonic` samples (eq-analysis), a product at
        each degree. Whether the transform is real, or multiresolution, makes no difference.

        Parameters
        ----------
        flm : ndarray, shape (..., bandlimit**2), complex
            As for `analysis_harmonic`.

        Returns
        -------
        dict
            "scaling" -> W^phi_lm, shape (..., L_phi**2), and j -> W^j_lmn, shape (..., orders,
            L_j**2), complex128, one row for each order n of ``wavelets.orientations_of(j)``. L_j
            and L_phi are ``tiling.scale_bandlimit(j)`` and ``tiling.scaling_bandlimit``.

        Raises
        ------
        ShapeError, DataError
            As `analysis_harmonic`.

        Examples
        --------
        >>> from spinsdw.wavelet_transform import SpinWaveletTransform
        >>> transform = SpinWaveletTransform(16, spin=2, directions=3)
        >>> parts = transform.analysis_wigner(np.ones(256))
        >>> parts[2].shape, parts["scaling"].shape
        ((3, 64), (1,))
        >>> bool(np.allclose(transform.synthesis_wigner(parts)[4:], 1, rtol=0, atol=1e-14))
        True
        """
        flm = check_flm(flm, self.wavelets.bandlimit)
        self._warn_of_lost_degrees(flm)
        return flm_to_parts(self.wavelets, flm, is_analysis=True)

    def synthesis_wigner(self, parts: Mapping[int | str, Array]) -> Array:
        """Compute harmonic coefficients from the Wigner coefficients of every scale.

        The inverse of `analysis_wigner` (eq-synthesis).

        Parameters
        ----------
        parts : mapping
            As `analysis_wigner` returns them, or changed.

        Returns
        -------
        ndarray, shape (..., bandlimit**2), complex128
            The coefficients, zero for el < abs(spin).

        Raises
        ------
        ParameterError
            If a part is missing or not known.
        ShapeError
            If a part has another shape.
        DataError
            If a value is not a finite number.
        """
        checked = check_parts(self.wavelets, parts)
        return parts_to_flm(self._dual, checked, is_analysis=False)

    def adjoint_analysis_wigner(self, parts: Mapping[int | str, Array]) -> Array:
        """Apply the adjoint of `analysis_wigner`; shapes and errors of `synthesis_wigner`."""
        checked = check_parts(self.wavelets, parts)
        return parts_to_flm(self.wavelets, checked, is_analysis=True)

    def adjoint_synthesis_wigner(self, flm: Array) -> dict[int | str, Array]:
        """Apply the adjoint of `synthesis_wigner`; shapes and errors of `analysis_wigner`."""
        flm = check_flm(flm, self.wavelets.bandlimit)
        return flm_to_parts(self._dual, flm, is_analysis=False)

    @functools.cached_property
    def _lost_places(self) -> Array:
        """Where the coefficients of a signal's lost degrees stand."""
        degrees = np.arange(self.wavelets.bandlimit)
        return np.flatnonzero(np.repeat(self.wavelets.lost_degrees, 2 * degrees + 1))

    def _warn_of_lost_degrees(self, flm: Array) -> None:
        """Warn of a signal that does not come back from its coefficients."""
        if not self._lost_places.size:
            return
        wavelets = self.wavelets
        power = np.sum(np.abs(flm[..., self._lost_places]) ** 2)
        all_power = np.sum(np.abs(flm[..., wavelets.spin**2 :]) ** 2)
        if power > (64 * wavelets.bandlimit * np.finfo(float).eps) ** 2 * all_power:
            msg = (
                f"{power / all_power:.3g} of the signal's power is in degrees that "
                f"{wavelets.directionality} with spin={wavelets.spin} and "
                f"original_spin={wavelets.original_spin} do not hold, and will not come back; "
                "wavelets.lost_degrees tells them."
            )
            warnings.warn(msg, PrecisionWarning, stacklevel=3)
