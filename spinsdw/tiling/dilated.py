"""Tilings whose scales are one profile, dilated by a constant factor from scale to scale."""

from __future__ import annotations

import math
import numbers
from abc import abstractmethod
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.tiling.base import FloatArray, LowpassTiling

__all__ = ["DilatedTiling", "check_dilation", "powers_up_to"]

# A stop for dilations so near to 1 that the exact powers would never end.
_MOST_SCALES = 1024


def check_dilation(dilation: object, name: str = "dilation") -> float:
    """Return a dilation as a float, or say what is wrong with it.

    Parameters
    ----------
    dilation : object
        A real number.
    name : str
        What the message calls it.

    Returns
    -------
    float
        Finite and above 1.

    Raises
    ------
    ParameterError
        If it is not a number, not finite, or not above 1.

    Examples
    --------
    >>> check_dilation(2)
    2.0
    """
    if isinstance(dilation, bool) or not isinstance(dilation, numbers.Real):
        msg = f"{name}={dilation!r} must be a number above 1; 2.0 halves the angular scale."
        raise ParameterError(msg)
    value = float(dilation)
    if not (math.isfinite(value) and value > 1):
        msg = f"{name}={value} must exceed 1; 2.0 halves the angular scale each step."
        raise ParameterError(msg)
    return value


def powers_up_to(dilation: float, degree: int | Fraction) -> tuple[Fraction, ...]:
    """Return 1, dilation, dilation**2, ... up to the first that is at least ``degree``, exactly.

    Parameters
    ----------
    dilation : float
        Above 1, and taken at its exact binary value.
    degree : int or Fraction

    Returns
    -------
    tuple of Fraction

    Raises
    ------
    ParameterError
        If more than 1024 powers would be needed.

    Examples
    --------
    >>> [int(power) for power in powers_up_to(5.0, 125)]
    [1, 5, 25, 125]
    """
    base, powers = Fraction(dilation), [Fraction(1)]
    while powers[-1] < degree:
        if len(powers) > _MOST_SCALES:
            msg = (
                f"dilation={dilation} makes more than {_MOST_SCALES} scales up to degree {degree}, "
                "and must make fewer; take it further from 1."
            )
            raise ParameterError(msg)
        # A power costs no gcd, a product of Fractions does.
        powers.append(base ** len(powers))
    return tuple(powers)


@dataclass(frozen=True)
class DilatedTiling(LowpassTiling):
    """A tiling whose filters are one low-pass profile of ``l / dilation**j``.

    A subclass says that profile and nothing else. The highest scale J is the smallest integer
    with ``dilation**J >= bandlimit - 1``, in exact arithmetic: no logarithm is rounded.

    Parameters
    ----------
    bandlimit : int
        Degrees run from 0 to ``bandlimit - 1``.
    lowest_scale : int
        The first scale that has wavelets, keyword only.
    dilation : float
        The step from a scale to the next, above 1, keyword only.

    Raises
    ------
    ParameterError
        If ``bandlimit`` is below 1, ``dilation`` not above 1, or ``lowest_scale`` outside
        ``0..highest_scale``.
    """

    dilation: float = field(default=2.0, kw_only=True)

    def _check_steps(self) -> None:
        object.__setattr__(self, "dilation", check_dilation(self.dilation))

    @cached_property
    def edges(self) -> tuple[Fraction, ...]:
        """``dilation**j`` for every scale j from 0 to the highest, exactly."""
        return powers_up_to(self.dilation, self.bandlimit - 1)

    @abstractmethod
    def _profile(self, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what the filter passes and stops at ``ratio = l / edge``.

        It passes all at 0 and nothing from 1 upwards, falls between, and the two add up to 1.
        """

    def _lowpass(self, scale: int) -> tuple[FloatArray, FloatArray]:
        return self._profile(np.arange(self.bandlimit) / float(self.edges[scale]))
