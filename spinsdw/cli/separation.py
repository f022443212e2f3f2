"""Do one separation from files to files."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from spinsdw.cli.inputs import Inputs, read_inputs
from spinsdw.cli.outputs import SUMMARY, check_output, staged, write_files
from spinsdw.cli.pictures import check_matplotlib, draw_pictures
from spinsdw.cli.progress import progress
from spinsdw.cli.requests import SeparationRequest
from spinsdw.cli.summary import summarise
from spinsdw.compiled.jit import cache_directory
from spinsdw.errors import ConvergenceWarning, PrecisionWarning
from spinsdw.files import atomic_output
from spinsdw.healpix import default_bandlimit
from spinsdw.polarisation import EBSeparator
from spinsdw.separation.pseudo import Pseudo
from spinsdw.warmup import warm_up

__all__ = ["run_separation"]


def run_separation(wanted: SeparationRequest) -> str:
    """Read, separate, draw and write; nothing is written unless all the rest succeeded.

    Parameters
    ----------
    wanted : SeparationRequest
        What to do. The steps are told on stderr.

    Returns
    -------
    str
        The summary, as it was written.

    Raises
    ------
    SpinsdwError, OSError
        As reading, separating and writing do.
    """
    check_output(wanted.output)
    if wanted.output.pictures:
        check_matplotlib()
    is_first = _is_first_run()
    total = 3 + wanted.output.pictures + is_first
    with progress(total) as steps, _noted_warnings() as warned:
        with steps.step("reading"):
            inputs = read_inputs(wanted.maps, wanted.mask, max_memory=wanted.max_memory)
        separator = _separator(wanted, inputs)
        if is_first:
            with steps.step("compiling", remark="up to a minute, once"):
                warm_up(wanted.settings.get("threads"))
        with steps.step("separating"):
            maps = separator.separate(inputs.q, inputs.u)
        with staged(wanted.output) as folder:
            if wanted.output.pictures:
                with steps.step("drawing"):
                    bands = separator.bands(maps)
                    draw_pictures(folder, inputs, maps, bands=bands, remark=wanted.remark)
            with steps.step("writing"):
                write_files(folder, wanted, inputs, maps)
            text = summarise(wanted, inputs, maps, seconds=steps.seconds, warned=warned)
            with atomic_output(folder / SUMMARY) as stream:
                stream.write(text.encode())
    return text


def _separator(wanted: SeparationRequest, inputs: Inputs) -> EBSeparator:
    settings: dict[str, Any] = {"bandlimit": default_bandlimit(inputs.maps.nside)}
    settings |= wanted.settings
    share = settings.pop("largest_share", None)
    if share is not None:
        settings["method"] = Pseudo(share)
    return EBSeparator(**settings, mask=inputs.mask)


def _is_first_run() -> bool:
    """Whether all has to be compiled, so that it is a step of its own with its own seconds."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in {"", "0"}:
        return False
    folder = cache_directory()
    return folder is None or not any(folder.iterdir())


@contextmanager
def _noted_warnings() -> Iterator[list[str]]:
    """Collect the texts of the package's own warnings for the summary."""
    noted: list[str] = []
    with warnings.catch_warnings():
        show = warnings.showwarning

        def note(  # noqa: PLR0913, PLR0917 - the signature of warnings.showwarning
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if issubclass(category, (ConvergenceWarning, PrecisionWarning)):
                noted.append(str(message))
            else:
                show(message, category, filename, lineno, file, line)

        warnings.showwarning = note
        yield noted
