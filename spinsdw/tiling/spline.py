"""The B3-spline tiling, after Starck, Moudden, Abrial and Nguyen (2006)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinsdw.tiling.base import FloatArray
from spinsdw.tiling.dilated import DilatedTiling

__all__ = ["SplineTiling"]


@dataclass(frozen=True)
class SplineTiling(DilatedTiling):
    """The isotropic undecimated wavelets' tiling, in the form whose squares add up to 1.

    The low-pass profile is their cubic spline ``(3/2) B_3(2 t)`` with t = l / cut-off. The paper
    analyses with the difference of two low-pass filters and adds up to synthesise; here the
    square root of that difference serves on either side, so analysis and synthesis together are
    the paper's filter. The profile falls from degree 1 on: every scale reaches down to degree 1,
    and there are two derivatives only, in exchange for wavelets with little ringing.

    Parameters
    ----------
    bandlimit : int
        Degrees run from 0 to ``bandlimit - 1``.
    dilation : float
        The step from a scale to the next, above 1, keyword only; 2 in the paper.
    lowest_scale : int
        The first scale that has wavelets, from 0 to ``highest_scale``, keyword only.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is below 1, ``dilation`` not above 1, or ``lowest_scale`` outside
        ``0..highest_scale``.

    References
    ----------
    J.-L. Starck, Y. Moudden, P. Abrial, M. Nguyen, "Wavelets, ridgelets and curvelets on the
    sphere", A&A 446, 1191 (2006), arXiv:astro-ph/0509883.

    Examples
    --------
    >>> tiling = SplineTiling(64, lowest_scale=3)
    >>> (tiling.scaling_kernel[[0, 2, 4, 6]] ** 2).round(5).tolist()
    [1.0, 0.71875, 0.25, 0.03125]
    """

    def _profile(self, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
        t = np.minimum(ratio, 1.0)
        stopped_low, passed_high = 6 * t**2 * (1 - t), 2 * (1 - t) ** 3
        is_low = t < 0.5
        passed = np.where(is_low, 1 - stopped_low, passed_high)
        stopped = np.where(is_low, stopped_low, 1 - passed_high)
        return passed, stopped

    def scale_lowest_degree(self, scale: int) -> int:
        """Return 1: the spline lets no scale end above it.

        Parameters
        ----------
        scale : int
            One of ``scales``.

        Returns
        -------
        int

        Raises
        ------
        ParameterError
            If there is no such scale.

        Examples
        --------
        >>> SplineTiling(64).scale_lowest_degree(4)
        1
        """
        self._check_scale(scale)
        return 1
