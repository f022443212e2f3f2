"""Run independent tasks on threads: the compiled kernels and the FFT release the interpreter lock.

Every task writes its own part of an output and is split the same way whatever the number of
threads, so results do not depend on it, bit for bit.
"""

from __future__ import annotations

import functools
import operator
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

from spinsdw.errors import ParameterError

__all__ = ["resolve_threads", "run_tasks", "threads_for"]

# Below this bandlimit handing work to a second thread takes longer than doing it.
_LEAST_BANDLIMIT = 200


def resolve_threads(threads: int | None) -> int:
    """Return the number of threads to use: ``None`` means every core this process may use.

    Examples
    --------
    >>> resolve_threads(3)
    3
    """
    if threads is None:
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    try:
        count = 0 if isinstance(threads, bool) else operator.index(threads)
    except TypeError:
        count = 0
    if count < 1:
        msg = f"threads={threads!r} must be a positive integer, or None for all cores."
        raise ParameterError(msg)
    return count


def threads_for(bandlimit: int, threads: int) -> int:
    """Return how many of the threads to use for one transform: one for a small one.

    Examples
    --------
    >>> threads_for(64, 4), threads_for(512, 4)
    (1, 4)
    """
    return threads if bandlimit >= _LEAST_BANDLIMIT else 1


@functools.cache
def _executor(process: int, threads: int) -> ThreadPoolExecutor:
    # Keyed by process: threads do not survive a fork.
    return ThreadPoolExecutor(threads, thread_name_prefix=f"spinsdw-{process}")


def run_tasks(tasks: Iterable[Callable[[], None]], threads: int) -> None:
    """Call every task, on ``threads`` threads; the first exception is raised here."""
    if threads == 1:
        for task in tasks:
            task()
        return
    pool = _executor(os.getpid(), threads)
    for future in [pool.submit(task) for task in tasks]:
        future.result()
