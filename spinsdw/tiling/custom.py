"""A tiling given by its values."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.tiling.base import FloatArray, Tiling, read_only

__all__ = ["CustomTiling"]


def _checked_values(values: object, name: str, ndim: int) -> FloatArray:
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        msg = f"{name} has dtype {array.dtype}, and must hold real numbers; take the real part."
        raise DataError(msg)
    if array.ndim != ndim or 0 in array.shape:
        shape = "(bandlimit,)" if ndim == 1 else "(scales, bandlimit)"
        msg = f"{name} has shape {array.shape}, and must have shape {shape} and not be empty."
        raise ShapeError(msg)
    if not np.isfinite(array).all():
        msg = f"{name} has NaN or infinite entries, and all must be finite; mend them first."
        raise DataError(msg)
    return read_only(np.array(array, dtype=np.float64))


@dataclass(frozen=True, eq=False)
class CustomTiling(Tiling):
    """A tiling given by its values, checked to lose nothing and count nothing twice.

    The bandlimit of each scale is where its last non-zero value is: cut a profile off with exact
    zeros to have its scale computed at a low resolution.

    Parameters
    ----------
    scaling : array_like, shape (bandlimit,)
        eta, real.
    wavelets : array_like, shape (scales, bandlimit)
        kappa_j, one row for each scale, real, zero at degree 0.
    lowest_scale : int
        The number of the first row, keyword only.
    tolerance : float
        The largest ``|eta**2 + sum_j kappa_j**2 - 1|`` let pass, keyword only. Synthesis after
        analysis is exact to this relative error.

    Raises
    ------
    ShapeError
        If the shapes are not the ones above.
    DataError
        If the values are not real and finite, a wavelet has degree 0, or the squares do not add
        up to 1.
    ParameterError
        If ``lowest_scale`` or ``tolerance`` is negative.

    Examples
    --------
    >>> tiling = CustomTiling([1, 0.6, 0, 0], [[0, 0.8, 0.6, 0], [0, 0, 0.8, 1]])
    >>> [tiling.scale_bandlimit(scale) for scale in tiling.scales], tiling.scaling_bandlimit
    ([3, 4], 2)
    """

    scaling: FloatArray
    wavelets: FloatArray
    lowest_scale: int = field(default=0, kw_only=True)
    tolerance: float = field(default=1e-12, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "scaling", _checked_values(self.scaling, "scaling", 1))
        object.__setattr__(self, "wavelets", _checked_values(self.wavelets, "wavelets", 2))
        if self.wavelets.shape[1] != self.bandlimit:
            msg = (
                f"wavelets has shape {self.wavelets.shape}, and its rows must be as long as "
                f"scaling, {self.bandlimit}; pad with zeros."
            )
            raise ShapeError(msg)
        self._check_lowest_scale()
        if not self.tolerance >= 0:
            msg = f"tolerance={self.tolerance} must not be negative; 1e-12 is the default."
            raise ParameterError(msg)
        self._check_admissible()

    def _check_admissible(self) -> None:
        if np.any(self.wavelets[:, 0] != 0):
            msg = "wavelets has a value at degree 0, which must be zero; move it to scaling."
            raise DataError(msg)
        excess = np.abs(self.scaling**2 + np.sum(self.wavelets**2, axis=0) - 1)
        worst = int(np.argmax(excess))
        if excess[worst] > self.tolerance:
            msg = (
                f"scaling**2 + sum of wavelets**2 is off 1 by {excess[worst]:.3g} at degree "
                f"{worst}, and must be within {self.tolerance}; divide all by its square root."
            )
            raise DataError(msg)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, CustomTiling)
            and self.lowest_scale == other.lowest_scale
            and np.array_equal(self.scaling, other.scaling)
            and np.array_equal(self.wavelets, other.wavelets)
        )

    def __hash__(self) -> int:
        return hash((self.lowest_scale, self.scaling.tobytes(), self.wavelets.tobytes()))

    @property
    def bandlimit(self) -> int:  # type: ignore[override]
        """The number of degrees."""
        return len(self.scaling)

    @property
    def highest_scale(self) -> int:
        """The last scale."""
        return self.lowest_scale + len(self.wavelets) - 1

    @property
    def scaling_bandlimit(self) -> int:
        """One more than the last degree of the scaling function."""
        return int(np.max(np.flatnonzero(self.scaling), initial=0)) + 1

    def scale_bandlimit(self, scale: int) -> int:
        """Return one more than the last non-zero degree of a scale, and 1 for an empty one.

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
        >>> CustomTiling([1, 0, 1], [[0, 1, 0]]).scale_bandlimit(0)
        2
        """
        return int(np.max(np.flatnonzero(self.kernel(scale)), initial=0)) + 1

    def scale_lowest_degree(self, scale: int) -> int:
        """Return the first non-zero degree of a scale, and ``bandlimit`` for an empty one.

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
        >>> CustomTiling([1, 0, 1], [[0, 1, 0]]).scale_lowest_degree(0)
        1
        """
        return int(np.min(np.flatnonzero(self.kernel(scale)), initial=self.bandlimit))

    def _profiles(self) -> tuple[FloatArray, FloatArray]:
        return self.scaling, self.wavelets
