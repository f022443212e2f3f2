"""Wavelets and the scaling function turned to any place and orientation, in harmonic space."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinsdw.ring_engine import OrderSums, RingEngine
from spinsdw.rotation import check_rotation
from spinsdw.wavelets import Wavelets

__all__ = ["rotated_harmonics"]


def _unrotated(wavelets: Wavelets, scale: int | str) -> tuple[tuple[int, ...], Any]:
    """Return the orders that are not zero, and their coefficients, shape (orders, L_j)."""
    if isinstance(scale, str) and scale == "scaling":
        size = wavelets.tiling.scaling_bandlimit
        return (0,), wavelets.scaling_harmonics[None, :size].astype(np.complex128)
    psi = wavelets.wavelet_harmonics(scale)  # type: ignore[arg-type]
    kept = np.flatnonzero(np.any(psi, axis=1))
    orders = wavelets.orientations_of(scale).orders  # type: ignore[arg-type]
    return tuple(orders[i] for i in kept), psi[kept]


def rotated_harmonics(
    wavelets: Wavelets, scale: int | str, rotation: tuple[float, float, float]
) -> NDArray[np.complex128]:
    """Compute the harmonic coefficients of a wavelet turned to a place and an orientation.

    They are ``sum_n D^l_mn(rotation) psi_ln`` (eq-rotation). The signal's wavelet coefficient
    there is ``sum_lm f_lm conj(.)``. Cost O(L^2) for each order.

    Parameters
    ----------
    wavelets : Wavelets
        With `Wavelets.dual` it is what a coefficient adds to the synthesis, for each volume
        d alpha sin(beta) d beta d gamma of rotations.
    scale : int or "scaling"
        One of the scales, or the scaling function, whatever its orientation.
    rotation : tuple of float
        The Euler angles alpha, beta, gamma in radians: longitude and colatitude of the centre,
        and the orientation, as of coefficients.

    Returns
    -------
    ndarray, shape (scale_bandlimit**2,), complex128
        [(el, m) for el in range(scale_bandlimit) for m in range(-el, el + 1)], of the wavelets'
        spin; `harmonics.resize` pads them to the signal's bandlimit.

    Raises
    ------
    ParameterError
        If there is no such scale, or ``rotation`` is not three finite angles.

    Examples
    --------
    >>> from spinsdw.directionality import SteerableDirectionality
    >>> from spinsdw.tiling import ScaleDiscretisedTiling
    >>> wavelets = Wavelets(ScaleDiscretisedTiling(16), SteerableDirectionality(3), spin=2)
    >>> turned = rotated_harmonics(wavelets, 2, (0.3, 1.2, -0.5))
    >>> psi = wavelets.wavelet_harmonics(2)
    >>> bool(np.isclose(np.linalg.norm(turned), np.linalg.norm(psi), rtol=1e-14))
    True
    """
    alpha, beta, gamma = check_rotation(rotation)
    orders, psi = _unrotated(wavelets, scale)
    size = psi.shape[1]
    flm = np.zeros((1, size**2), dtype=np.complex128)
    if orders:
        m = np.fft.ifftshift(np.arange(1 - size, size))
        phases = np.exp(-1j * np.add.outer(np.array(orders) * gamma, m * alpha))
        engine = RingEngine(size, np.array([beta]))
        engine.add_to_harmonics(phases[:, :, None].copy(), OrderSums(orders, psi), flm)
    return flm[0]
