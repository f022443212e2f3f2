"""The directionality of ridgelets, after McEwen and Price (2015)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spinsdw.directionality.base import ComplexArray, Directionality
from spinsdw.directionality.orientations import Orientations
from spinsdw.harmonics import check_bandlimit, check_integer

__all__ = ["RidgeletDirectionality", "radon_factors"]


def radon_factors(bandlimit: int, spin: int = 0) -> NDArray[np.float64]:
    """Return what integration along great circles multiplies each degree with (eq-radon).

    The spherical Radon transform S f (rho) is the integral of f along the great circle whose pole
    is the z axis turned by rho, in the frame whose y axis runs along the circle. It is a scalar
    field of the pole, with coefficients ``(S f)_lm = g_l f_lm``.

    Parameters
    ----------
    bandlimit : int
    spin : int
        The spin of f.

    Returns
    -------
    ndarray, shape (bandlimit,), float64
        ``2 pi (-1)**spin d^l_{0,-spin}(pi/2)``: zero where l + spin is odd, and below the size of
        ``spin``.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is not an integer of at least 1, or ``spin`` not an integer.

    Examples
    --------
    >>> (radon_factors(5) / (2 * np.pi)).round(12).tolist()
    [1.0, 0.0, -0.5, 0.0, 0.375]
    """
    bandlimit, size = check_bandlimit(bandlimit), abs(check_integer(spin, "spin"))
    factors = np.zeros(bandlimit)
    if size >= bandlimit:
        return factors
    # sqrt((l-s)!/(l+s)!) P_l^s(0): at l = s the product (2k-1)/(2k), then in steps of two.
    k = np.arange(1, size + 1)
    start = np.sqrt(np.prod((2 * k - 1) / (2 * k)))
    el = np.arange(size, bandlimit - 2, 2)
    steps = -np.sqrt((el + 1 + size) * (el + 1 - size) / ((el + 2 + size) * (el + 2.0 - size)))
    sign = -1.0 if spin < 0 and size % 2 else 1.0
    factors[size::2] = 2 * np.pi * sign * start * np.cumprod(np.concatenate([[1.0], steps]))
    return factors


@dataclass(frozen=True)
class RidgeletDirectionality(Directionality):
    """Wavelets stretched along whole great circles: ridgelets (eq-ridgelet).

    A ridgelet is axisymmetric, a wavelet across the great circle around its own axis, so its
    coefficients are those of straight lines as long as the sphere is round. They see half of a
    signal: degrees with l + spin odd integrate to zero along every great circle. Synthesis is
    exact for signals that have no such degrees (of a scalar: that are equal at opposite points),
    and gives the part with l + spin even, and what the scaling function holds, of any other;
    `SpinWaveletTransform` warns of them.

    Parameters
    ----------
    power : int
        The power of the size of eq-radon that the ridgelets carry. 0: none, at every degree held
        their squares add up to 1 and energy is kept. 1: the whole of it, and the coefficients are
        those of axisymmetric wavelets on the spherical Radon transform, as in the paper; -1
        synthesises these, and blows noise up by ``sqrt(l)``.

    Raises
    ------
    ParameterError
        If ``power`` is not an integer.

    References
    ----------
    J. D. McEwen, M. A. Price, "Ridgelet transform on the sphere", arXiv:1510.01595 (2015).

    Examples
    --------
    >>> RidgeletDirectionality().coefficients(5).real.tolist()
    [[0.0, 0.0, -1.0, 0.0, 1.0]]
    """

    power: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "power", check_integer(self.power, "power"))

    @property
    def dual(self) -> RidgeletDirectionality:
        """The directionality that synthesises what this one analyses: of the opposite power."""
        return replace(self, power=-self.power)

    def orientations_at(self, bandlimit: int) -> Orientations:
        """Return the one order 0 and the one orientation that an axisymmetric wavelet has.

        Parameters
        ----------
        bandlimit : int

        Returns
        -------
        Orientations

        Raises
        ------
        ParameterError
            If ``bandlimit`` is not an integer of at least 1.

        Examples
        --------
        >>> RidgeletDirectionality().orientations_at(16).orders
        (0,)
        """
        check_bandlimit(bandlimit)
        return Orientations(1)

    def coefficients(self, bandlimit: int, spin: int = 0) -> ComplexArray:
        """Return zeta_l0 for every degree below a bandlimit (eq-ridgelet).

        Parameters
        ----------
        bandlimit : int
        spin : int
            The spin of the wavelet.

        Returns
        -------
        ndarray, shape (1, bandlimit), complex128
            Zero where l + spin is odd, below the size of ``spin``, and at degree 0.

        Raises
        ------
        ParameterError
            If ``bandlimit`` is not an integer of at least 1, or ``spin`` not an integer.

        Examples
        --------
        >>> (RidgeletDirectionality(1).coefficients(3) / np.pi).real.round(12).tolist()
        [[0.0, 0.0, -1.0]]
        """
        factors = radon_factors(bandlimit, spin)
        held = factors != 0
        held[0] = False
        zeta = np.zeros((1, bandlimit), dtype=np.complex128)
        zeta[0, held] = np.sign(factors[held]) * np.abs(factors[held]) ** self.power
        return zeta
