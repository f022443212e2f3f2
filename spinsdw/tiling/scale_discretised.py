"""The scale-discretised tiling of Wiaux, McEwen, Vandergheynst and Blanc (2008)."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

from spinsdw.errors import ParameterError
from spinsdw.tiling import s2let
from spinsdw.tiling.base import FloatArray
from spinsdw.tiling.dilated import DilatedTiling, powers_up_to
from spinsdw.tiling.quadrature import bump_integrals

__all__ = ["ScaleDiscretisedTiling", "scale_discretised_profile"]

_QUADRATURES = ("exact", "s2let")


def scale_discretised_profile(ratio: FloatArray, dilation: float) -> tuple[FloatArray, FloatArray]:
    """Return what the low-pass profile k_lambda passes and stops (eq-step).

    Parameters
    ----------
    ratio : ndarray, shape (n,), float64
        Degree over cut-off degree.
    dilation : float
        The profile falls from 1 at ``1 / dilation`` to 0 at 1.

    Returns
    -------
    passed, stopped : ndarray, shape (n,), float64
        Their sum is 1.

    Examples
    --------
    >>> import numpy as np
    >>> passed, stopped = scale_discretised_profile(np.array([0.5, 0.75, 1.0]), 2.0)
    >>> passed.round(5).tolist()
    [1.0, 0.45255, 0.0]
    """
    x = 2 * (dilation * ratio - 1) / (dilation - 1) - 1
    # du/u becomes a weight of y; the squared bump has sharpness 2.
    return bump_integrals(x, sharpness=2.0, slope=(dilation - 1) / 2)


@dataclass(frozen=True)
class ScaleDiscretisedTiling(DilatedTiling):
    """The smooth tiling of scale-discretised wavelets (eq-tiling).

    Scale j lives on ``dilation**(j-1) < l < dilation**(j+1)`` and peaks at ``dilation**j``. Its
    profile has every derivative, so the wavelets fall off faster than any power of the angle.

    Parameters
    ----------
    bandlimit : int
        Degrees run from 0 to ``bandlimit - 1``.
    dilation : float
        The step from a scale to the next, above 1, keyword only.
    lowest_scale : int
        The first scale that has wavelets, from 0 to ``highest_scale``, keyword only.
    quadrature : {"exact", "s2let"}
        "exact" integrates to rounding and takes the smallest J with
        ``dilation**J >= bandlimit - 1``. "s2let" takes the choices of that library: its trapezia
        move the values by up to 5e-5, and its logarithms may add an empty scale of full size.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is below 1, ``dilation`` not above 1, ``lowest_scale`` outside
        ``0..highest_scale``, or ``quadrature`` unknown.

    Examples
    --------
    >>> tiling = ScaleDiscretisedTiling(513, dilation=2.0)
    >>> tiling.highest_scale, tiling.scale_bandlimit(3), tiling.scale_lowest_degree(3)
    (9, 16, 5)
    >>> tiling.partition_error < 1e-15
    True
    """

    quadrature: str = field(default="exact", kw_only=True)

    def _check_steps(self) -> None:
        super()._check_steps()
        if self.quadrature not in _QUADRATURES:
            msg = (
                f"quadrature={self.quadrature!r} must be one of {_QUADRATURES}; exact is the best."
            )
            raise ParameterError(msg)

    @cached_property
    def edges(self) -> tuple[Fraction, ...]:
        """``dilation**j`` for every scale j from 0 to the highest, exactly."""
        exact = powers_up_to(self.dilation, self.bandlimit - 1)
        if self.quadrature == "exact":
            return exact
        highest = s2let.highest_scale(self.bandlimit, self.dilation)
        base = Fraction(self.dilation)
        return exact + tuple(base**scale for scale in range(len(exact), highest + 1))

    def _profile(self, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self.quadrature == "exact":
            return scale_discretised_profile(ratio, self.dilation)
        return s2let.trapezoid_profile(ratio, self.dilation)

    def _roots(self, squares: FloatArray) -> FloatArray:
        if self.quadrature == "exact":
            return super()._roots(squares)
        return s2let.keep_last_real_root(squares)
