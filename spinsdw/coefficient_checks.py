"""Whether coefficients handed to a wavelet transform are its own."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping
from typing import Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import ParameterError, ShapeError
from spinsdw.signals import check_map

__all__ = ["check_coefficients", "check_wanted"]

Array = np.ndarray[Any, Any]
Shapes = Mapping[int | str, tuple[int, ...]]

# What coefficients may differ in from the transform that takes them: E and B are the parts of a
# spin-2 analysis, and a scalar, maybe real, synthesis follows. Values are checked for being real.
_FREE = {"spin", "real"}


def check_wanted(parts: Collection[int | str], shapes: Shapes) -> set[int | str]:
    """Return the parts that a synthesis shall add up, all of them among those of the shapes."""
    is_list = isinstance(parts, Collection) and not isinstance(parts, str)
    if not is_list or not all(isinstance(part, Hashable) and part in shapes for part in parts):
        msg = (
            f"parts={parts!r} must be among 'scaling' and the scales {_scales(shapes)}; "
            "pass a tuple of them."
        )
        raise ParameterError(msg)
    return set(parts)


def check_coefficients(
    coefficients: WaveletCoefficients, shapes: Shapes, parameters: Mapping[str, Any]
) -> dict[int | str, Array]:
    """Return the arrays of coefficients, of the shapes and parameters of a transform."""
    if not isinstance(coefficients, WaveletCoefficients):
        msg = (
            f"coefficients is a {type(coefficients).__name__}; pass the WaveletCoefficients "
            "that analysis returns."
        )
        raise ParameterError(msg)
    if coefficients.scales != _scales(shapes):
        msg = (
            f"coefficients have scales {coefficients.scales} but the transform has "
            f"{_scales(shapes)}; use the transform that made them."
        )
        raise ShapeError(msg)
    found: dict[int | str, Array] = {}
    for key, shape in shapes.items():
        values = coefficients.scaling if key == "scaling" else coefficients[int(key)]
        name = "scaling part" if key == "scaling" else f"scale {key}"
        real = parameters["real"]
        found[key] = check_map(values, shape, real=real, name=name, may_be_single=True)
    _check_parameters(coefficients.parameters, parameters)
    return found


def _scales(shapes: Shapes) -> tuple[int | str, ...]:
    return tuple(key for key in shapes if key != "scaling")


def _check_parameters(theirs: Mapping[str, Any], ours: Mapping[str, Any]) -> None:
    """Refuse coefficients of other wavelets that happen to have the same shapes."""
    for name in sorted((set(ours) | set(theirs)) - _FREE):
        if ours.get(name) != theirs.get(name):
            msg = (
                f"coefficients have {name}={theirs.get(name)!r} but the transform has "
                f"{ours.get(name)!r}; use the transform that made them."
            )
            raise ParameterError(msg)
