"""A tiling whose dilation changes with degree: narrow where the data ask for it, wide elsewhere."""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.tiling.base import FloatArray, LowpassTiling
from spinsdw.tiling.dilated import check_dilation, powers_up_to
from spinsdw.tiling.scale_discretised import scale_discretised_profile

__all__ = ["HybridTiling"]


def _as_tuple(values: object, name: str) -> tuple[Any, ...]:
    if isinstance(values, str) or not isinstance(values, Iterable):
        msg = f"{name}={values!r} must be a sequence of numbers; pass a tuple."
        raise ParameterError(msg)
    return tuple(values)


@dataclass(frozen=True)
class HybridTiling(LowpassTiling):
    """Several dilations, joined at transition degrees.

    The cut-off degrees go up in steps of ``dilations[0]`` to ``transitions[0]``, from there in
    steps of ``dilations[1]`` to ``transitions[1]``, and so on; the last dilation goes on to the
    highest degree. So that a transition is a cut-off itself, the range below it is divided into
    equal steps, as many as bring their ratio nearest to the dilation asked for. Each filter is
    the scale-discretised profile (eq-step) between two cut-offs; scale j peaks at ``edges[j]``
    and vanishes at its neighbours.

    Hybrid scale-discretised tilings serve component separation, with fine scales at high degrees
    (Rogers et al. 2016). S2LET's own joins at powers of the dilations instead: its scales differ.

    Parameters
    ----------
    bandlimit : int
        Degrees run from 0 to ``bandlimit - 1``.
    dilations : tuple of float
        Each above 1, keyword only.
    transitions : tuple of float
        One fewer, rising, above 1 and below ``bandlimit``, keyword only.
    lowest_scale : int
        The first scale that has wavelets, from 0 to ``highest_scale``, keyword only.

    Raises
    ------
    ParameterError
        If a parameter breaks its rule.

    References
    ----------
    K. K. Rogers et al., "SILC: a new Planck internal linear combination CMB temperature map using
    directional wavelets", MNRAS 460, 3014 (2016), arXiv:1601.01322.

    Examples
    --------
    >>> tiling = HybridTiling(200, dilations=(2.0, 1.5), transitions=(64,))
    >>> [round(float(edge), 1) for edge in tiling.edges]
    [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 96.0, 144.0, 216.0]
    >>> tiling.partition_error < 1e-15
    True
    """

    dilations: tuple[float, ...] = field(kw_only=True)
    transitions: tuple[float, ...] = field(default=(), kw_only=True)

    def _check_steps(self) -> None:
        dilations = tuple(
            check_dilation(item, "dilations") for item in _as_tuple(self.dilations, "dilations")
        )
        transitions = _as_tuple(self.transitions, "transitions")
        if len(dilations) != len(transitions) + 1:
            msg = (
                f"dilations={dilations} must be one more than transitions={transitions}; "
                "a transition stands between two dilations."
            )
            raise ParameterError(msg)
        object.__setattr__(self, "dilations", dilations)
        object.__setattr__(self, "transitions", self._checked_transitions(transitions))

    def _checked_transitions(self, given: tuple[Any, ...]) -> tuple[float, ...]:
        are_numbers = all(isinstance(item, numbers.Real) for item in given)
        # "Not all rising" and not "some falling": a NaN is neither.
        if not (are_numbers and all(a < b for a, b in pairwise((1, *given, self.bandlimit)))):
            msg = (
                f"transitions={given} must be numbers that rise from above 1 to below "
                f"bandlimit={self.bandlimit}; drop or sort them."
            )
            raise ParameterError(msg)
        return tuple(float(item) for item in given)

    @cached_property
    def edges(self) -> tuple[Fraction, ...]:
        """The cut-off degrees, the transitions among them."""
        edges = [1.0]
        for dilation, end in zip(self.dilations, self.transitions, strict=False):
            start = edges[-1]
            steps = max(1, round(math.log(end / start) / math.log(dilation)))
            between = [start * (end / start) ** (step / steps) for step in range(1, steps)]
            # To 12 digits, so that a whole degree does not become a hair more and is rounded up.
            edges += [*(float(f"{edge:.12g}") for edge in between), end]
        last = Fraction(edges.pop())
        factors = powers_up_to(self.dilations[-1], (self.bandlimit - 1) / last)
        rest = [last * factor for factor in factors]
        return tuple([Fraction(edge) for edge in edges] + rest)

    def _lowpass(self, scale: int) -> tuple[FloatArray, FloatArray]:
        upper = float(self.edges[scale])
        # Below the first cut-off there is degree 0 alone, which any profile passes.
        lower = float(self.edges[scale - 1]) if scale else 0.5
        return scale_discretised_profile(np.arange(self.bandlimit) / upper, upper / lower)
