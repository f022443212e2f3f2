"""Tell on stderr how far a job is: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

import click

__all__ = ["Steps", "progress"]


class Steps:
    """The steps of a job, one after the other.

    Parameters
    ----------
    begin : callable
        Told, as a step begins, its name and how many have ended.

    Attributes
    ----------
    seconds : dict of str to float
        Wall time of the steps that have ended.
    """

    def __init__(self, begin: Callable[[str, int], None]) -> None:
        self.seconds: dict[str, float] = {}
        self._begin = begin

    @contextmanager
    def step(self, name: str, *, remark: str = "") -> Iterator[None]:
        """Announce a step and time it."""
        self._begin(f"{name} ({remark})" if remark else name, len(self.seconds))
        start = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - start


@contextmanager
def progress(total: int, stream: TextIO | None = None) -> Iterator[Steps]:
    """Show the steps of a job while the block runs.

    Parameters
    ----------
    total : int
        How many steps there will be.
    stream : text stream, optional
        Where to; stderr by default.

    Yields
    ------
    Steps
        To be told of each step.
    """
    target = sys.stderr if stream is None else stream
    if target.isatty():
        with _bar(total, target) as steps:
            yield steps
    else:
        yield Steps(lambda name, done: click.echo(f"{done + 1}/{total} {name}", file=target))


@contextmanager
def _bar(total: int, target: TextIO) -> Iterator[Steps]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        BarColumn(bar_width=20),
        TextColumn("{task.description}", markup=False),
        TimeElapsedColumn(),
    )
    # Gone when done: the summary follows.
    with Progress(*columns, console=Console(file=target), transient=True) as bar:
        task = bar.add_task("", total=total)
        yield Steps(lambda name, done: bar.update(task, description=name, completed=done))
