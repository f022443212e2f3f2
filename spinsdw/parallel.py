"""Run independent tasks on threads: the compiled kernels and the FFT release the interpreter lock.

Every task writes its own part of an output and is split the same way whatever the number of
threads, so results do not depend on it, bit for bit.
"""

from __future__ import annotations

import functools
import operator
import os
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, wait

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
    return ThreadPoolExecutor(threads - 1, thread_name_prefix=f"spinsdw-{process}")


def run_tasks(tasks: Iterable[Callable[[], None]], threads: int) -> None:
    """Call every task, on ``threads`` threads; the first exception is raised here.

    The caller is one of the threads: it does not wait for the others to wake up. Whoever has
    finished a task takes the next, so the first ones should be the longest.
    """
    if threads == 1:
        for task in tasks:
            task()
        return
    queue = deque(tasks)
    helpers = min(threads, len(queue)) - 1
    futures = [_executor(os.getpid(), threads).submit(_work, queue) for _ in range(helpers)]
    try:
        _work(queue)
    finally:
        started = [future for future in futures if not future.cancel()]
        wait(started)
    for future in started:
        future.result()


def _work(queue: deque[Callable[[], None]]) -> None:
    """Take tasks until there are none; after an exception there are none for anybody."""
    while True:
        try:
            task = queue.popleft()
        except IndexError:
            return
        try:
            task()
        except BaseException:
            queue.clear()
            raise
