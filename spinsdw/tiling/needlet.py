"""The needlet tiling of Narcowich, Petrushev and Ward (2006)."""

from __future__ import annotations

from dataclasses import dataclass

from spinsdw.tiling.base import FloatArray
from spinsdw.tiling.dilated import DilatedTiling
from spinsdw.tiling.quadrature import bump_integrals

__all__ = ["NeedletTiling"]


@dataclass(frozen=True)
class NeedletTiling(DilatedTiling):
    """The standard needlet tiling, infinitely smooth.

    Following Marinucci et al. (2008), the low-pass profile is 1 up to ``1 / dilation``, then
    ``psi(1 - (2 lam / (lam - 1)) (t - 1 / lam))`` up to 1, with lam the dilation and psi the
    normalised integral of ``exp(-1 / (1 - y**2))`` from -1. It has the same support as the
    scale-discretised tiling, with a bump less sharp and no weight ``1/t``.

    Parameters
    ----------
    bandlimit : int
        Degrees run from 0 to ``bandlimit - 1``.
    dilation : float
        The step from a scale to the next, above 1, keyword only; B in the papers.
    lowest_scale : int
        The first scale that has wavelets, from 0 to ``highest_scale``, keyword only.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is below 1, ``dilation`` not above 1, or ``lowest_scale`` outside
        ``0..highest_scale``.

    References
    ----------
    F. J. Narcowich, P. Petrushev, J. D. Ward, "Localized tight frames on spheres", SIAM J. Math.
    Anal. 38, 574 (2006). D. Marinucci et al., "Spherical needlets for cosmic microwave background
    data analysis", MNRAS 383, 539 (2008), arXiv:0707.0844.

    Examples
    --------
    >>> tiling = NeedletTiling(64)
    >>> tiling.kernel(3)[[5, 6, 8, 12]].round(4).tolist()
    [0.3507, 0.7071, 1.0, 0.7071]
    """

    def _profile(self, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
        x = 2 * (self.dilation * ratio - 1) / (self.dilation - 1) - 1
        return bump_integrals(x, sharpness=1.0)
