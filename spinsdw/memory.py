"""`MemoryEstimate`: what a call of a transform takes, told before anything is allocated."""

from __future__ import annotations

import operator
from dataclasses import dataclass

from spinsdw.errors import MemoryBudgetError, ParameterError

__all__ = ["MemoryEstimate", "check_max_memory"]


@dataclass(frozen=True)
class MemoryEstimate:
    """Bytes that one call of a transform takes, `docs/engine` says how near the truth.

    Parameters
    ----------
    input : int
        Bytes of the arrays handed over, in the type the transform stores. Others are converted
        first, which takes as much again.
    output : int
        Bytes of the arrays returned.
    working : int
        Bytes needed beyond those two when most is in use.

    Examples
    --------
    >>> MemoryEstimate(input=100, output=300, working=50).peak
    450
    """

    input: int
    output: int
    working: int

    @property
    def peak(self) -> int:
        """Bytes in use when most are: input, output and working memory."""
        return self.input + self.output + self.working

    def then(self, following: MemoryEstimate) -> MemoryEstimate:
        """Return the estimate of two steps, the output of the first being the input of the other.

        Examples
        --------
        >>> MemoryEstimate(100, 300, 50).then(MemoryEstimate(300, 100, 20))
        MemoryEstimate(input=100, output=100, working=320)
        """
        peak = max(self.peak, self.input + following.peak)
        return MemoryEstimate(self.input, following.output, peak - self.input - following.output)

    def require(self, max_memory: int | None, call: str) -> None:
        """Raise `MemoryBudgetError` if a call would take more than ``max_memory`` bytes."""
        if max_memory is None or self.peak <= max_memory:
            return
        msg = (
            f"max_memory={max_memory} bytes is less than the {self.peak} bytes that {call} takes "
            f"({self.input} of input, {self.output} of output, {self.working} to work in); "
            "raise max_memory or pass fewer signals at once."
        )
        raise MemoryBudgetError(msg)


def check_max_memory(max_memory: object) -> int | None:
    """Return a budget in bytes as an int, None for no budget.

    Raises
    ------
    ParameterError
        If it is not a positive integer.

    Examples
    --------
    >>> check_max_memory(2**30)
    1073741824
    """
    if max_memory is None:
        return None
    try:
        budget = 0 if isinstance(max_memory, bool) else operator.index(max_memory)  # type: ignore[arg-type]
    except TypeError:
        budget = 0
    if budget < 1:
        msg = f"max_memory={max_memory!r} must be a positive number of bytes, or None for no limit."
        raise ParameterError(msg)
    return budget
