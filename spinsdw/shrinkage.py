"""Shrink numbers towards zero where they are small: hard, soft, or by the garrote in between."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from spinsdw.errors import DataError, ParameterError, ShapeError

__all__ = ["check_level", "check_rule", "fitting", "shrink"]

Array = np.ndarray[Any, Any]


def part_name(key: int | str) -> str:
    return "the scaling part" if key == "scaling" else f"scale {key}"


def fitting(given: object, values: Array, key: int | str, name: str) -> Array:
    """Return what was given for a part as an array, after checking that it broadcasts to it."""
    array = np.asarray(given)
    sizes = zip(reversed(array.shape), reversed(values.shape), strict=False)
    if array.ndim > values.ndim or any(one not in {1, other} for one, other in sizes):
        msg = (
            f"{name} for {part_name(key)} has shape {array.shape}; it must be a number or "
            f"broadcast to {values.shape}."
        )
        raise ShapeError(msg)
    return array


# What multiplies a value, from the ratio T / |w| < 1.
_SHRINKAGES: dict[str, Callable[[Array], Array]] = {
    "hard": np.ones_like,
    "soft": lambda ratio: 1 - ratio,
    "garrote": lambda ratio: 1 - ratio**2,
}


def shrink(values: Array, level: Array, rule: str) -> Array:
    """Return values shrunk towards zero by the rule, with their phases."""
    size = np.abs(values)
    if size.dtype.kind != "f":
        size = size.astype(np.float64)
    is_kept = size > level
    ratio = np.divide(level, size, out=np.zeros_like(size), where=is_kept)
    return np.where(is_kept, _SHRINKAGES[rule](ratio) * values, 0)


def check_rule(rule: object) -> None:
    """Raise ParameterError if there is no such rule."""
    if rule not in _SHRINKAGES:
        msg = f"rule={rule!r} must be one of {sorted(_SHRINKAGES)}; 'hard' keeps or drops."
        raise ParameterError(msg)


def check_level(level: Array, key: int | str) -> Array:
    """Return thresholds of a part, or raise DataError."""
    if level.dtype.kind not in "biuf" or not np.all(level >= 0):
        msg = f"threshold for {part_name(key)} must hold real numbers of at least 0."
        raise DataError(msg)
    return level
