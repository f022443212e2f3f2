"""What every tiling offers, and the tilings made of differences of low-pass filters."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinsdw.errors import ParameterError
from spinsdw.harmonics import check_bandlimit, check_integer

__all__ = ["LowpassTiling", "Tiling", "read_only"]

FloatArray = NDArray[np.float64]


def read_only(values: FloatArray) -> FloatArray:
    """Return the array after making it read-only.

    Parameters
    ----------
    values : ndarray
        Changed in place: no copy is made.

    Returns
    -------
    ndarray

    Examples
    --------
    >>> read_only(np.zeros(3)).flags.writeable
    False
    """
    values.flags.writeable = False
    return values


def _rebuild(kind: type[Tiling], parameters: dict[str, Any]) -> Tiling:
    return kind(**parameters)


class Tiling(ABC):
    """One scaling function and one wavelet profile for each scale, as functions of degree.

    The squares add up to 1 at every degree: ``eta**2 + sum_j kappa_j**2 = 1``. Degree 0 belongs
    to the scaling function alone. A subclass is a frozen dataclass that has ``bandlimit`` and
    ``lowest_scale`` and says `highest_scale`, `scale_bandlimit`, `scale_lowest_degree`,
    `scaling_bandlimit` and the values (``_profiles``).

    Attributes
    ----------
    bandlimit : int
        Degrees run from 0 to ``bandlimit - 1``.
    lowest_scale : int
        The first scale that has wavelets; the scaling function holds what is below.
    """

    bandlimit: int
    lowest_scale: int

    @property
    @abstractmethod
    def highest_scale(self) -> int:
        """The last scale."""

    @property
    @abstractmethod
    def scaling_bandlimit(self) -> int:
        """The bandlimit of the scaling function, from 1 to ``bandlimit``."""

    @abstractmethod
    def scale_bandlimit(self, scale: int) -> int:
        """Return the bandlimit of the wavelets of a scale, from 1 to ``bandlimit``."""

    @abstractmethod
    def scale_lowest_degree(self, scale: int) -> int:
        """Return the lowest degree at which the wavelets of a scale may be non-zero.

        It is at least 1. An empty scale has it no lower than its bandlimit.
        """

    @abstractmethod
    def _profiles(self) -> tuple[FloatArray, FloatArray]:
        """Return eta, shape (bandlimit,), and kappa_j, shape (number of scales, bandlimit)."""

    @cached_property
    def _held_profiles(self) -> tuple[FloatArray, FloatArray]:
        scaling, wavelets = self._profiles()
        return read_only(scaling), read_only(wavelets)

    @property
    def scales(self) -> range:
        """Every scale from the lowest to the highest."""
        return range(self.lowest_scale, self.highest_scale + 1)

    @property
    def scaling_kernel(self) -> FloatArray:
        """The scaling function's eta(l), shape (bandlimit,), read-only."""
        return self._held_profiles[0]

    def kernel(self, scale: int) -> FloatArray:
        """Return kappa_j(l) of one scale.

        Parameters
        ----------
        scale : int
            One of ``scales``.

        Returns
        -------
        ndarray, shape (bandlimit,), float64
            Indexed by degree, read-only.

        Raises
        ------
        ParameterError
            If there is no such scale.

        Examples
        --------
        >>> from spinsdw.tiling import ScaleDiscretisedTiling
        >>> ScaleDiscretisedTiling(8).kernel(1).round(3).tolist()
        [0.0, 0.0, 1.0, 0.673, 0.0, 0.0, 0.0, 0.0]
        """
        values: FloatArray = self._held_profiles[1][self._check_scale(scale) - self.lowest_scale]
        return values

    @property
    def partition_error(self) -> float:
        """The largest ``|eta**2 + sum_j kappa_j**2 - 1|`` over the degrees."""
        scaling, wavelets = self._held_profiles
        return float(np.max(np.abs(scaling**2 + np.sum(wavelets**2, axis=0) - 1)))

    def plot(self, axes: Any = None) -> Any:
        """Draw the scaling function and the wavelets against the degree; see `plot_tiling`.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Ordinary axes, of pyplot or of a figure; those of a new figure by default.

        Returns
        -------
        matplotlib.axes.Axes
            Their ``figure`` can be kept with `plotting.save_figure`.

        Raises
        ------
        MissingPackageError
            matplotlib is not installed.

        Examples
        --------
        >>> from spinsdw.tiling import NeedletTiling
        >>> len(NeedletTiling(64).plot().lines)
        7
        """
        from spinsdw.plotting import plot_tiling, tiling_figure

        if axes is None:
            return tiling_figure(self).axes[0]
        plot_tiling(axes, self)
        return axes

    def _check_scale(self, scale: int) -> int:
        scale = check_integer(scale, "scale")
        if scale not in self.scales:
            msg = (
                f"scale={scale} must be from {self.lowest_scale} to {self.highest_scale}; "
                "the tiling's scales lists them."
            )
            raise ParameterError(msg)
        return scale

    def _check_lowest_scale(self) -> None:
        remedy = "0 gives every degree above 0 to wavelets"
        lowest = check_integer(self.lowest_scale, "lowest_scale", minimum=0, remedy=remedy)
        object.__setattr__(self, "lowest_scale", lowest)
        if lowest > self.highest_scale:
            msg = (
                f"lowest_scale={lowest} must not exceed the highest scale, {self.highest_scale} "
                f"for bandlimit={self.bandlimit}; lower it."
            )
            raise ParameterError(msg)

    # Built anew from its parameters: a pickle is small, is checked, and keeps arrays read-only.
    def __reduce__(self) -> tuple[Any, ...]:
        parameters = {item.name: getattr(self, item.name) for item in fields(self)}  # type: ignore[arg-type]
        return _rebuild, (type(self), parameters)


@dataclass(frozen=True)
class LowpassTiling(Tiling):
    """A tiling made of differences between low-pass filters of rising cut-off degree.

    Filter j passes ``p_j(l)``, which is 0 from ``edges[j]`` upwards, and above the last there is
    one that passes all. Then ``kappa_j**2 = p_{j+1} - p_j`` and ``eta**2 = p_lowest``, whose sum
    is 1 whatever the filters are. A subclass says ``edges`` and ``_lowpass``.

    Parameters
    ----------
    bandlimit : int
        Degrees run from 0 to ``bandlimit - 1``.
    lowest_scale : int
        The first scale that has wavelets, keyword only.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is below 1, or ``lowest_scale`` outside ``0..highest_scale``.
    """

    bandlimit: int
    lowest_scale: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "bandlimit", check_bandlimit(self.bandlimit))
        self._check_steps()
        self._check_lowest_scale()

    def _check_steps(self) -> None:
        """Check what the edges follow from; called between bandlimit and lowest_scale."""

    @property
    @abstractmethod
    def edges(self) -> tuple[Fraction, ...]:
        """The cut-off degree of each filter, exactly: 1 first, rising to at least L - 1."""

    @abstractmethod
    def _lowpass(self, scale: int) -> tuple[FloatArray, FloatArray]:
        """Return what filter ``scale`` passes and what it stops at each degree; their sum is 1.

        Both are asked for, since ``1 - p`` keeps no digit of a small remainder.
        """

    @property
    def highest_scale(self) -> int:
        """The last scale: the first whose cut-off reaches the highest degree."""
        return len(self.edges) - 1

    @property
    def scaling_bandlimit(self) -> int:
        """The cut-off of the scaling function, no more than ``bandlimit`` (eq-scale-bandlimit)."""
        return min(self.bandlimit, math.ceil(self.edges[self.lowest_scale]))

    def scale_bandlimit(self, scale: int) -> int:
        """Return the bandlimit of the wavelets of a scale (eq-scale-bandlimit).

        Parameters
        ----------
        scale : int
            One of ``scales``.

        Returns
        -------
        int
            From 1 to ``bandlimit``.

        Raises
        ------
        ParameterError
            If there is no such scale.

        Examples
        --------
        >>> from spinsdw.tiling import ScaleDiscretisedTiling
        >>> tiling = ScaleDiscretisedTiling(13)
        >>> [tiling.scale_bandlimit(scale) for scale in tiling.scales]
        [2, 4, 8, 13, 13]
        """
        scale = self._check_scale(scale)
        if scale == self.highest_scale:
            return self.bandlimit
        return min(self.bandlimit, math.ceil(self.edges[scale + 1]))

    def scale_lowest_degree(self, scale: int) -> int:
        """Return the lowest degree at which the wavelets of a scale may be non-zero.

        Parameters
        ----------
        scale : int
            One of ``scales``.

        Returns
        -------
        int
            At least 1.

        Raises
        ------
        ParameterError
            If there is no such scale.

        Examples
        --------
        >>> from spinsdw.tiling import ScaleDiscretisedTiling
        >>> tiling = ScaleDiscretisedTiling(13)
        >>> [tiling.scale_lowest_degree(scale) for scale in tiling.scales]
        [1, 2, 3, 5, 9]
        """
        scale = self._check_scale(scale)
        return 1 if scale == 0 else math.floor(self.edges[scale - 1]) + 1

    def _profiles(self) -> tuple[FloatArray, FloatArray]:
        wavelets = np.empty((len(self.scales), self.bandlimit))
        passed, stopped = self._lowpass(self.lowest_scale)
        scaling = np.sqrt(passed)
        for row, scale in enumerate(self.scales):
            if scale == self.highest_scale:
                passes_more, stops_less = np.ones_like(passed), np.zeros_like(stopped)
            else:
                passes_more, stops_less = self._lowpass(scale + 1)
            # Of two equal differences, the one between the smaller numbers loses no digits.
            squares = np.where(passed > 0.5, stopped - stops_less, passes_more - passed)
            wavelets[row] = self._roots(squares)
            passed, stopped = passes_more, stops_less
        return scaling, wavelets

    def _roots(self, squares: FloatArray) -> FloatArray:
        """Return the square roots, where rounding may have left a square below zero."""
        return np.sqrt(np.maximum(squares, 0.0))
