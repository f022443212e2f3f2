"""What the user asked for: plain descriptions, filled by the commands, that load nothing heavy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

__all__ = ["Column", "MapRequest", "MaskRequest", "OutputRequest", "SeparationRequest", "shown"]

Column: TypeAlias = str | int


def shown(text: object) -> str:
    r"""Return a text for the terminal; one with control characters is escaped, lest they act.

    Examples
    --------
    >>> shown("maps.fits"), shown(chr(27) + "[2J")
    ('maps.fits', "'\\x1b[2J'")
    """
    words = str(text)
    return words if words.isprintable() else ascii(words)


@dataclass(frozen=True)
class MapRequest:
    """Which Stokes maps to read, and what their headers leave out; as `read_polarisation`."""

    paths: tuple[str, ...]
    columns: Column | tuple[Column, ...] | None = None
    ordering: str | None = None
    polconv: str | None = None
    unit: str | None = None
    coordinates: str | None = None
    bad_pixels: Literal["raise", "mask"] = "raise"


@dataclass(frozen=True)
class MaskRequest:
    """Which sky to use: a mask's file, a cut in degrees of galactic latitude, or all of it.

    ``fill_holes`` is the area in square degrees up to which holes of the file's mask are filled.
    """

    path: str | None = None
    column: Column = 0
    ordering: str | None = None
    galactic_cut: float | None = None
    fill_holes: float | None = None


@dataclass(frozen=True)
class OutputRequest:
    """Which files to write, and where."""

    directory: Path
    ordering: Literal["RING", "NESTED"] = "RING"
    coefficients: bool = False
    pictures: bool = True
    overwrite: bool = False


@dataclass(frozen=True)
class SeparationRequest:
    """One separation: what to read, how to separate, what to write.

    Attributes
    ----------
    maps, mask, output
        See their classes.
    settings : mapping
        Keyword arguments of `spinsdw.polarisation.EBSeparator`.
    max_memory : int or None
        Bytes that reading one file may take; 4 GiB when None.
    remark : str
        One line that goes into the summary and into every file.
    """

    maps: MapRequest
    mask: MaskRequest
    output: OutputRequest
    settings: Mapping[str, Any] = field(default_factory=dict)
    max_memory: int | None = None
    remark: str = ""
