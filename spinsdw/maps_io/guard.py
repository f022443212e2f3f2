"""Open a FITS file only as far as its headers agree with its length.

A FITS header can promise more than the file holds, or more than the memory of the machine.  So
the headers are read first, block by block; each promise is held against the size of the file;
only then are data touched.  Plain and gzip files are read, no other compression, no URL.
"""

from __future__ import annotations

import gzip
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from math import prod
from typing import IO, TYPE_CHECKING, Any, cast

from spinsdw.errors import FileFormatError, MemoryBudgetError, ParameterError, SpinsdwError
from spinsdw.files import input_path

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator
    from pathlib import Path

__all__ = [
    "DEFAULT_MEMORY",
    "GuardedFile",
    "HeaderDataUnit",
    "memory_budget",
    "open_guarded",
    "refuse",
]

DEFAULT_MEMORY = 4 * 2**30
"""The memory budget of a reader, in bytes, where the caller gives none."""

BLOCK = 2880
LONGEST_HEADER = 1024 * BLOCK
GZIP_RATIO = 1032  # deflate cannot expand a file by more
GZIP_MAGIC = b"\x1f\x8b"


def refuse(path: object, found: str, remedy: str) -> FileFormatError:
    """Return the error for a file: its name, what was found, what helps."""
    return FileFormatError(f"path={str(path)!r} {found}; {remedy}.")


def memory_budget(max_memory: int | None) -> int:
    """Return the bytes that a reader may take, after checking what the caller gave."""
    budget = DEFAULT_MEMORY if max_memory is None else max_memory
    if not isinstance(budget, int) or budget <= 0:
        msg = f"max_memory={max_memory!r} must be a positive number of bytes, or None for 4 GiB."
        raise ParameterError(msg)
    return budget


@dataclass(frozen=True)
class HeaderDataUnit:
    """One header of a FITS file and where its data lie."""

    header: Any
    start: int
    size: int

    @property
    def end(self) -> int:
        """Where the next header begins."""
        return self.start + -(-self.size // BLOCK) * BLOCK


@dataclass(frozen=True)
class GuardedFile:
    """An open FITS file whose headers were held against its length."""

    path: Path
    stream: IO[bytes]
    compressed: bool
    units: tuple[HeaderDataUnit, ...]

    def keyword(self, name: str, index: int = 1) -> Any:
        """Return a header value of a unit, or else of the primary header, or else None."""
        for unit in (self.units[index], self.units[0]):
            value = unit.header.get(name)
            if isinstance(value, (str, int, float)) and value != "":
                return value
        return None

    def check_memory(self, needed: int, max_memory: int | None) -> None:
        """Raise MemoryBudgetError if ``needed`` bytes and the file expanded exceed the budget."""
        budget = memory_budget(max_memory)
        total = needed + (self.units[-1].end if self.compressed else 0)
        if total > budget:
            msg = (
                f"max_memory={budget} bytes is less than the {total} bytes that reading "
                f"{str(self.path)!r} takes; raise max_memory or degrade the map first."
            )
            raise MemoryBudgetError(msg)

    @contextmanager
    def opened(self, kind: str, first: int = 1) -> Iterator[list[Any]]:
        """Open the units from ``first`` to the last checked as astropy HDUs of one class."""
        from astropy.io import fits

        self.stream.seek(0)
        source: IO[bytes] = self.stream
        if self.compressed:
            expanded = self.stream.read(self.units[-1].end)
            if len(expanded) < self.units[-1].end:
                raise _truncated(self.path, self.units[-1].end, len(expanded))
            source = BytesIO(expanded)
        with fits.open(source, memmap=not self.compressed, lazy_load_hdus=True) as hdus:
            found = [hdus[index] for index in range(first, len(self.units))]
            # astropy has a class of its own for what it thinks corrupt.
            if {type(hdu).__name__ for hdu in found} - {kind}:
                text = f"has units that are not all {kind}: {[type(hdu).__name__ for hdu in found]}"
                raise refuse(self.path, text, "fetch the file again")
            yield found


@contextmanager
def open_guarded(path: str | os.PathLike[str], last: int | None = 1) -> Iterator[GuardedFile]:
    """Open a FITS file and check its units up to number ``last`` (all of them for None).

    Anything that astropy or gzip raises inside the block becomes a FileFormatError.
    """
    local = input_path(path)
    with _translated(local), local.open("rb") as raw:
        compressed = raw.read(2) == GZIP_MAGIC
        raw.seek(0)
        limit = local.stat().st_size * (GZIP_RATIO if compressed else 1)
        stream = cast("IO[bytes]", gzip.GzipFile(fileobj=raw)) if compressed else raw
        units = tuple(_scan(local, stream, limit, last))
        yield GuardedFile(local, stream, compressed, units)


@contextmanager
def _translated(path: Path) -> Iterator[None]:
    try:
        yield
    except (SpinsdwError, MemoryError):
        raise
    # On damaged headers astropy raises nearly any class: UnboundLocalError was seen too.
    except Exception as error:
        # Quoted, because the text may hold whatever stood in the header.
        found = f"cannot be read as FITS ({type(error).__name__}: {str(error)[:200]!r})"
        raise refuse(path, found, "check the file with fitsverify or fetch it again") from error


def _scan(path: Path, stream: IO[bytes], limit: int, last: int | None) -> Iterator[HeaderDataUnit]:
    end, index = 0, 0
    while last is None or index <= last:
        stream.seek(end)
        text = _header_bytes(path, stream, first=index == 0, optional=last is None)
        if text is None:
            return
        unit = _unit(path, text, end)
        if unit.end > limit:
            raise _truncated(path, unit.end, limit)
        yield unit
        end, index = unit.end, index + 1


def _header_bytes(path: Path, stream: IO[bytes], *, first: bool, optional: bool) -> bytes | None:
    text = bytearray()
    while len(text) < LONGEST_HEADER:
        block = stream.read(BLOCK)
        if first and not text and not block.startswith(b"SIMPLE  ="):
            raise refuse(path, "is not a FITS file", "give a plain or gzip FITS file")
        if not block and not text:
            if optional:
                return None
            raise refuse(path, "has too few extensions", "check hdu= or fetch the file again")
        if len(block) < BLOCK:
            raise _truncated(path, BLOCK, len(block))
        text += block
        if any(block[i : i + 80].rstrip() == b"END" for i in range(0, BLOCK, 80)):
            return bytes(text)
    found = f"has a header of more than {LONGEST_HEADER} bytes"
    raise refuse(path, found, "give a HEALPix map or coefficients of this package")


def _unit(path: Path, text: bytes, offset: int) -> HeaderDataUnit:
    from astropy.io import fits

    header = fits.Header.fromstring(text)
    axes = [
        header_count(path, header, f"NAXIS{i + 1}")
        for i in range(header_count(path, header, "NAXIS"))
    ]
    elements = prod(axes) if axes else 0
    groups = header_count(path, header, "GCOUNT", 1)
    heap = header_count(path, header, "PCOUNT", 0)
    width = abs(header["BITPIX"]) // 8
    return HeaderDataUnit(header, offset + len(text), width * groups * (heap + elements))


def header_count(path: Path, header: Any, name: str, default: int | None = None) -> int:
    """Return a header value that must be an integer, zero or more."""
    value = header.get(name, default)
    if type(value) is not int or value < 0:
        found = f"has {name} = {value!r} in its header, where an integer >= 0 must stand"
        raise refuse(path, found, "fetch the file again")
    return value


def _truncated(path: Path, needed: int, found: int) -> FileFormatError:
    text = f"is truncated: its headers promise {needed} bytes where there can be {found}"
    return refuse(path, text, "fetch the file again")
