"""Small things every separation needs: a clock for its steps and the check of a named choice."""

from __future__ import annotations

import time

from spinsdw.errors import ParameterError

__all__ = ["Clock", "check_choice"]


class Clock:
    """Wall time of named steps, one after the other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def stop(self, step: str) -> None:
        """Say that a step has ended."""
        now = time.perf_counter()
        self.seconds[step] = now - self._last
        self._last = now


def check_choice(name: str, value: object, allowed: tuple[str, ...]) -> None:
    """Raise `ParameterError` unless a value is one of the names allowed."""
    if not isinstance(value, str) or value not in allowed:
        msg = f"{name}={value!r} is not known; use one of {', '.join(map(repr, allowed))}."
        raise ParameterError(msg)
