"""Write the files of a separation: all of them or none, and none over another unasked."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.cli.requests import OutputRequest, SeparationRequest
from spinsdw.errors import OutputExistsError, ParameterError

if TYPE_CHECKING:
    from spinsdw.cli.inputs import Inputs
    from spinsdw.polarisation import EBMaps

__all__ = [
    "PICTURES",
    "SUMMARY",
    "check_output",
    "file_names",
    "left_behind",
    "staged",
    "write_files",
]

EB_MAPS, WEIGHTS, COEFFICIENTS = "eb.fits", "weights.fits", "wavelet_coefficients.fits"
PICTURES = ("q.png", "u.png", "mask.png", "e.png", "b.png", "b_scales.png")
SUMMARY = "summary.txt"


def file_names(wanted: OutputRequest) -> tuple[str, ...]:
    """Return the names of the files that a separation will write, the summary last."""
    return (
        EB_MAPS,
        WEIGHTS,
        *((COEFFICIENTS,) if wanted.coefficients else ()),
        *(PICTURES if wanted.pictures else ()),
        SUMMARY,
    )


def left_behind(wanted: OutputRequest) -> list[str]:
    """Return the files of an earlier separation that this one will not replace."""
    every = (EB_MAPS, WEIGHTS, COEFFICIENTS, *PICTURES, SUMMARY)
    others = [name for name in every if name not in file_names(wanted)]
    return [name for name in others if (wanted.directory / name).exists()]


def check_output(wanted: OutputRequest) -> None:
    """Check, before any work, that the files may be written.

    Raises
    ------
    ParameterError
        If the directory is a file, or cannot be made because a parent of it is one.
    PermissionError
        If the directory, or the one to make it in, is not writable.
    OutputExistsError
        If a file is there already and may not be overwritten.
    """
    directory = wanted.directory
    existing = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    if not existing.is_dir():
        msg = f"directory={str(directory)!r} must be a directory; {str(existing)!r} is a file."
        raise ParameterError(msg)
    if not os.access(existing, os.W_OK | os.X_OK):
        msg = f"directory={str(directory)!r} is not writable; give another one."
        raise PermissionError(msg)
    found = [name for name in file_names(wanted) if os.path.lexists(directory / name)]
    if any((directory / name).is_dir() for name in found):
        msg = f"directory={str(directory)!r} has directories named as outputs; give another one."
        raise ParameterError(msg)
    if found and not wanted.overwrite:
        msg = (
            f"directory={str(directory)!r} holds {', '.join(found)} already; give another one, or "
            "overwrite=True."
        )
        raise OutputExistsError(msg)


@contextmanager
def staged(wanted: OutputRequest) -> Iterator[Path]:
    """Give a hidden folder for the files, which are moved to the output when all are there.

    When the block raises, the folder goes, and so do directories made for it.
    """
    directory = wanted.directory
    made = [path for path in (directory, *directory.parents) if not path.exists()]
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".spinsdw-", dir=directory) as folder:
            yield Path(folder)
            check_output(wanted)
            for name in file_names(wanted):
                (Path(folder) / name).replace(directory / name)
    except BaseException:
        for path in made:
            # Someone else's file in it is a reason to let it stand.
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()
        raise


def write_files(folder: Path, wanted: SeparationRequest, inputs: Inputs, maps: EBMaps) -> None:
    """Write E and B, the weights and, if asked for, the wavelet coefficients to a folder.

    Parameters
    ----------
    folder : Path
        An existing directory without these files.
    wanted : SeparationRequest
        What was asked for.
    inputs : Inputs
        What it was made from.
    maps : EBMaps
        The result, RING order.
    """
    from spinsdw.healpix import UNSEEN
    from spinsdw.maps_io import write_coefficients, write_maps

    mask = np.ones(inputs.q.shape) if inputs.mask is None else inputs.mask
    observed = mask > 0
    eb = {name: np.where(observed, getattr(maps, name), UNSEEN) for name in "EB"}
    weights = {"WEIGHT": maps.weight, "MASK": mask}
    weights |= {f"WEIGHT_{j}": values for j, values in maps.weights.items()}
    labels: dict[str, Any] = {
        "coordinates": inputs.maps.coordinates,
        "ordering": wanted.output.ordering,
    }
    made = _history(wanted, inputs, maps)
    write_maps(folder / EB_MAPS, eb, unit=inputs.maps.unit, polconv="COSMO", history=made, **labels)
    write_maps(folder / WEIGHTS, weights, unit="unknown", history=made, **labels)
    if wanted.output.coefficients:
        write_coefficients(folder / COEFFICIENTS, maps.coefficients)


def _history(wanted: SeparationRequest, inputs: Inputs, maps: EBMaps) -> list[str]:
    """Return in ASCII what the files were made from and how."""
    settings = {"bandlimit": maps.info.bandlimit} | dict(wanted.settings)
    chosen = {"method", "largest_share", "threads"}
    lines = [
        "E and B separated from Q and U by spin wavelets",
        *([wanted.remark] if wanted.remark else []),
        *(f"{name}: {fact}" for name, fact in inputs.facts.items()),
        f"method = {maps.info.choices}",
        *(f"{name} = {value!r}" for name, value in settings.items() if name not in chosen),
    ]
    return [line.encode("ascii", "backslashreplace").decode() for line in lines]
