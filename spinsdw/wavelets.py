"""Wavelets: a tiling of the degrees, a directionality in azimuth, and a spin."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from spinsdw.directionality import Directionality, Orientations
from spinsdw.errors import ParameterError
from spinsdw.harmonics import check_integer
from spinsdw.tiling import Tiling

__all__ = ["Wavelets"]

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Wavelets:
    """The harmonic coefficients of wavelets and scaling function (eq-wavelet).

    Parameters
    ----------
    tiling : Tiling
        How degrees are shared out between the scales; it sets the bandlimit.
    directionality : Directionality
        How a wavelet depends on azimuth: steerable, curvelet or ridgelet. It may have more
        directions than the bandlimit of a small scale, but not more than that of the tiling.
    spin : int
        The spin of the signals; below its absolute value all coefficients are zero.
    original_spin : int
        r of eq-spin-lowered, keyword only. 0 for none. For r > 0 wavelets and scaling function are
        multiplied by ``(-1)**r sqrt((l+r)!/(l-r)!)``, and for r < 0 divided by it; they are zero
        below ``|r|`` as well. What r analyses, -r synthesises: see `dual`.

    Raises
    ------
    ParameterError
        If ``tiling`` or ``directionality`` is of another type, there are more directions than
        degrees, a spin is not an integer or leaves no degree below the bandlimit, or
        ``original_spin`` is so large that its factor overflows.

    Examples
    --------
    >>> from spinsdw.directionality import SteerableDirectionality
    >>> from spinsdw.tiling import ScaleDiscretisedTiling
    >>> wavelets = Wavelets(ScaleDiscretisedTiling(32), SteerableDirectionality(3), spin=2)
    >>> wavelets.wavelet_harmonics(3).shape
    (3, 16)
    >>> wavelets.admissibility_error < 1e-14
    True
    """

    tiling: Tiling
    directionality: Directionality
    spin: int = 0
    original_spin: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        self._check_parts()
        for name in ("spin", "original_spin"):
            value = check_integer(getattr(self, name), name)
            object.__setattr__(self, name, value)
            if abs(value) >= self.bandlimit:
                msg = (
                    f"{name}={value} must be smaller in size than bandlimit={self.bandlimit}, "
                    "else no degree is left; raise the bandlimit."
                )
                raise ParameterError(msg)
        self._check_factor()

    def _check_parts(self) -> None:
        if not isinstance(self.tiling, Tiling):
            msg = f"tiling={self.tiling!r} must be a Tiling; make a ScaleDiscretisedTiling."
            raise ParameterError(msg)
        if not isinstance(self.directionality, Directionality):
            msg = (
                f"directionality={self.directionality!r} must be a Directionality, such as "
                "SteerableDirectionality(3)."
            )
            raise ParameterError(msg)
        directions = self.directionality.orientations_at(self.bandlimit).largest_order + 1
        if directions > self.bandlimit:
            msg = (
                f"directions={directions} must not exceed bandlimit={self.bandlimit}, since no "
                "degree has that many orders of one parity; lower it."
            )
            raise ParameterError(msg)

    def _check_factor(self) -> None:
        r = abs(self.original_spin)
        # Of the highest degree, L - 1: the product of L - r, ..., L - 1 + r.
        digits = np.sum(np.log10(np.arange(self.bandlimit - r, self.bandlimit + r))) / 2
        if digits > 300:
            msg = (
                f"original_spin={self.original_spin} must keep sqrt((l+r)!/(l-r)!) below 1e300 "
                f"up to bandlimit={self.bandlimit}; lower either."
            )
            raise ParameterError(msg)

    @property
    def bandlimit(self) -> int:
        """The bandlimit of the tiling."""
        return self.tiling.bandlimit

    @property
    def scales(self) -> range:
        """Every scale of the tiling, from the lowest to the highest."""
        return self.tiling.scales

    @property
    def lowest_degree(self) -> int:
        """The first degree that the wavelets can hold: the larger size of the two spins."""
        return max(abs(self.spin), abs(self.original_spin))

    @property
    def dual(self) -> Wavelets:
        """The wavelets that synthesise what these analyse: ``original_spin`` with its sign turned.

        Without an original spin, and unless the directionality has a `dual` of its own, they are
        the wavelets themselves.
        """
        directionality = self.directionality.dual
        return replace(self, directionality=directionality, original_spin=-self.original_spin)

    def orientations_of(self, scale: int) -> Orientations:
        """Return the orders and orientations of the wavelet of one scale.

        Parameters
        ----------
        scale : int
            One of ``scales``.

        Returns
        -------
        Orientations
            Of curvelets there are more, the finer the scale; else they are the same at all.

        Raises
        ------
        ParameterError
            If there is no such scale.

        Examples
        --------
        >>> from spinsdw.directionality import SteerableDirectionality
        >>> from spinsdw.tiling import ScaleDiscretisedTiling
        >>> wavelets = Wavelets(ScaleDiscretisedTiling(8), SteerableDirectionality(3))
        >>> wavelets.orientations_of(1).orders
        (-2, 0, 2)
        """
        return self.directionality.orientations_at(self.tiling.scale_bandlimit(scale))

    def _lowering_factor(self, bandlimit: int) -> FloatArray:
        """Eq-spin-lowered for each degree below ``bandlimit``, zero below both spins."""
        el, r = np.arange(bandlimit, dtype=np.float64), abs(self.original_spin)
        factor = np.full(bandlimit, -1.0 if r % 2 else 1.0)
        factor[: self.lowest_degree] = 0.0
        held = el[self.lowest_degree :]
        for k in range(1 - r, r + 1):
            root = np.sqrt(held + k)
            factor[self.lowest_degree :] *= root if self.original_spin > 0 else 1 / root
        return factor

    def wavelet_harmonics(self, scale: int) -> ComplexArray:
        """Return the coefficients psi_ln of the wavelet of one scale.

        Parameters
        ----------
        scale : int
            One of ``scales``.

        Returns
        -------
        ndarray, shape (orders, tiling.scale_bandlimit(scale)), complex128
            Row as in the orders of `orientations_of`, column is the degree. Zero below the spins,
            so a small scale may be zero throughout.

        Raises
        ------
        ParameterError
            If there is no such scale.

        Examples
        --------
        >>> from spinsdw.directionality import SteerableDirectionality
        >>> from spinsdw.tiling import ScaleDiscretisedTiling
        >>> wavelets = Wavelets(ScaleDiscretisedTiling(8), SteerableDirectionality(1))
        >>> psi = wavelets.wavelet_harmonics(1)
        >>> float((8 * np.pi**2 / 5 * psi[0, 2] ** 2).real.round(12))
        1.0
        """
        bandlimit = self.tiling.scale_bandlimit(scale)
        el = np.arange(bandlimit)
        profile = np.sqrt((2 * el + 1) / (8 * np.pi**2)) * self.tiling.kernel(scale)[:bandlimit]
        profile = profile * self._lowering_factor(bandlimit)
        return self.directionality.coefficients(bandlimit, self.spin) * profile

    @property
    def scaling_harmonics(self) -> FloatArray:
        """The coefficients phi_l0 of the scaling function, shape (bandlimit,), float64.

        Indexed by degree, zero below the spins and from ``tiling.scaling_bandlimit`` upwards.
        """
        el = np.arange(self.bandlimit)
        profile = np.sqrt((2 * el + 1) / (4 * np.pi)) * self.tiling.scaling_kernel
        return np.asarray(profile * self._lowering_factor(self.bandlimit))

    @property
    def admissibility(self) -> FloatArray:
        """The sum of eq-admissibility at each degree, shape (bandlimit,), float64.

        1 from ``lowest_degree`` upwards, 0 below: then synthesis by `dual` undoes analysis. It is
        less at ``lost_degrees``. Where the `dual` differs each square is a product with it.
        """
        return self._squares(self.dual)

    @property
    def frame_response(self) -> FloatArray:
        """The frame operator's value at each degree (eq-frame-operator).

        Shape (bandlimit,), float64. It is 1 from ``lowest_degree`` upwards where wavelets and
        `dual` are the same.
        """
        return self._squares(self)

    @property
    def frame_bounds(self) -> tuple[float, float]:
        """The bounds of the frame: the least and largest of ``frame_response`` (eq-frame-operator).

        Of the degrees that the wavelets hold: signals with ``lost_degrees`` are left out.
        """
        kept = ~self.lost_degrees
        kept[: self.lowest_degree] = False
        response = self.frame_response[kept]
        return float(np.min(response, initial=np.inf)), float(np.max(response, initial=0.0))

    def _squares(self, dual: Wavelets) -> FloatArray:
        el = np.arange(self.bandlimit)
        total = 4 * np.pi / (2 * el + 1) * self.scaling_harmonics * dual.scaling_harmonics
        for scale in self.scales:
            psi, other = self.wavelet_harmonics(scale), dual.wavelet_harmonics(scale)
            products = np.sum(psi.real * other.real + psi.imag * other.imag, axis=0)
            total[: products.size] += 8 * np.pi**2 / (2 * el[: products.size] + 1) * products
        return np.asarray(total)

    @property
    def lost_degrees(self) -> NDArray[np.bool_]:
        """Which degrees of a signal do not come back, shape (bandlimit,), bool.

        Those of ``l + spin`` odd for ridgelets, where the scaling function does not hold them,
        and those from ``|spin|`` to below ``|original_spin|``.
        """
        held = self.directionality.held_degrees(self.bandlimit, self.spin)
        share = sum(self.tiling.kernel(scale) ** 2 for scale in self.scales)
        held |= share <= 8 * np.finfo(float).eps
        held[: abs(self.original_spin)] = False
        held[: abs(self.spin)] = True
        return ~held

    @property
    def admissibility_error(self) -> float:
        """The largest ``|admissibility - 1|`` of all degrees but the lost ones; 0 without any."""
        kept = ~self.lost_degrees
        kept[: self.lowest_degree] = False
        return float(np.max(np.abs(self.admissibility[kept] - 1), initial=0.0))
