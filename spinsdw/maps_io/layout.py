"""What the header of a HEALPix table says, and what the caller adds to it.

One rule holds for the pixel ordering, the polarisation convention, the unit and the coordinates:
the file's word stands; an argument fills in what the file leaves out, and may repeat but never
contradict what it says.  Ordering and polarisation convention change the numbers, so without
either word they are an error; unit and coordinates are labels, so they become ``"unknown"``.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from spinsdw.errors import ParameterError
from spinsdw.healpix import bad_pixel_mask
from spinsdw.maps_io.guard import GuardedFile, header_count, refuse

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from spinsdw.errors import FileFormatError

__all__ = ["UNKNOWN", "Column", "SkyTable", "Stated"]

Column: TypeAlias = str | int

UNKNOWN = "unknown"
LARGEST_NSIDE = 8192
ORDERINGS = {"RING": "RING", "NESTED": "NESTED", "NEST": "NESTED"}
POLCONVS = {"COSMO": "COSMO", "IAU": "IAU"}
SCHEMES = {"IMPLICIT": "IMPLICIT", "EXPLICIT": "EXPLICIT"}
COORDINATES = {
    **dict.fromkeys(("G", "GALACTIC"), "G"),
    **dict.fromkeys(("E", "ECLIPTIC"), "E"),
    **dict.fromkeys(("C", "Q", "EQUATORIAL", "CELESTIAL"), "C"),
}

INTENSITY_NAMES = ("I_STOKES", "TEMPERATURE", "INTENSITY", "I", "T", "SIGNAL", "KAPPA")
STOKES_NAMES = (
    ("Q_STOKES", "U_STOKES"),
    ("Q_POLARISATION", "U_POLARISATION"),
    ("Q_POLARIZATION", "U_POLARIZATION"),
    ("Q", "U"),
    ("GAMMA1", "GAMMA2"),
    ("G1", "G2"),
    ("E1", "E2"),
)

_FORMAT = re.compile(r"(\d*)([LXBIJKAEDCMPQ])")
_BITS = dict(zip("LXBIJKAEDCMPQ", (8, 1, 8, 16, 32, 64, 8, 32, 64, 64, 128, 64, 128), strict=True))
_REAL = "LBIJKED"


@dataclass(frozen=True)
class Stated:
    """What the caller says about a file; None says nothing."""

    ordering: str | None = None
    polconv: str | None = None
    unit: str | None = None
    coordinates: str | None = None

    def __post_init__(self) -> None:
        """Check the two that change numbers, and write them all as the headers do."""
        ordering = _choice("ordering", self.ordering, ORDERINGS)
        object.__setattr__(self, "ordering", ordering)
        object.__setattr__(self, "polconv", _choice("polconv", self.polconv, POLCONVS))
        if self.coordinates is not None:
            object.__setattr__(self, "coordinates", _coordinates(self.coordinates))


@dataclass(frozen=True)
class TableColumn:
    """One column of a binary table."""

    name: str
    code: str
    repeat: int
    unit: str | None


@dataclass(frozen=True)
class SkyTable:
    """A HEALPix table: its file, its columns, its pixels, and the caller's word."""

    file: GuardedFile
    hdu: int
    columns: tuple[TableColumn, ...]
    stated: Stated

    @classmethod
    def described(cls, file: GuardedFile, hdu: int, stated: Stated) -> SkyTable:
        """Read the description of the table in unit ``hdu`` and check it."""
        header = file.units[hdu].header
        if header.get("XTENSION") != "BINTABLE":
            remedy = "name the extension of the maps with hdu"
            raise refuse(file.path, f"has no binary table in extension {hdu}", remedy)
        table = cls(file, hdu, tuple(_columns(file.path, header)), stated)
        table._known("PIXTYPE", {"HEALPIX": "HEALPIX"})
        if not table.names:
            raise refuse(file.path, "has no column of values", "give a HEALPix map")
        return table

    @property
    def names(self) -> list[str]:
        """Names of the columns that hold maps, in file order; PIXEL is not one."""
        return [column.name for column in self.columns if column.name.upper() != "PIXEL"]

    @property
    def is_partial(self) -> bool:
        """True where a column PIXEL lists the pixel numbers."""
        scheme = self._known("INDXSCHM", SCHEMES)
        return scheme == "EXPLICIT" or (scheme is None and len(self.names) < len(self.columns))

    @property
    def ordering(self) -> str:
        """RING or NESTED; an error where neither the file nor the caller says."""
        return self._needed("ordering", "ORDERING", ORDERINGS)

    @property
    def polconv(self) -> str:
        """COSMO or IAU; an error where neither the file nor the caller says."""
        return self._needed("polconv", "POLCCONV", POLCONVS)

    @property
    def coordinates(self) -> str:
        """G, E or C, another word of the file or the caller, or "unknown"."""
        found = self._text("COORDSYS") or self._text("SKYCOORD")
        known = None if found is None else _coordinates(found)
        return self._agreed("coordinates", known) or UNKNOWN

    @property
    def sentinel(self) -> float | None:
        """The value that marks bad pixels by the header, where it is not UNSEEN."""
        value = self.file.keyword("BAD_DATA", self.hdu)
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return float(value) if is_number and not bad_pixel_mask(value) else None

    @property
    def stokes(self) -> str | None:
        """The Stokes parameter of the whole file, by the header."""
        return self._text("STOKES")

    @property
    def nside(self) -> int:
        """The resolution, checked against the ordering and the number of values."""
        nside, values = self.file.keyword("NSIDE", self.hdu), self.values_in(self.names[0])
        if nside is None and not self.is_partial:
            nside = math.isqrt(values // 12)
        is_nested = self.ordering == "NESTED"
        is_valid = type(nside) is int and 1 <= nside <= LARGEST_NSIDE
        if not is_valid or (is_nested and nside & (nside - 1)):
            found = f"has NSIDE = {nside!r} in {self.ordering} order"
            rule = f"NSIDE must be from 1 to {LARGEST_NSIDE}, and a power of two for NESTED"
            raise refuse(self.file.path, found, rule)
        if not self.is_partial and values != 12 * nside**2:
            found = f"holds {values} pixels where NSIDE = {nside} has {12 * nside**2}"
            raise refuse(self.file.path, found, "fetch the file again, or correct the header")
        return int(nside)

    def check_memory(self, maps: int, max_memory: int | None, *, is_turned: bool = False) -> None:
        """Raise MemoryBudgetError if so many maps, and the work on one of them, need too much."""
        # Reordering, listing pixels and turning the sign of U each hold up to four more arrays.
        is_plain = self.ordering == "RING" and not self.is_partial and not is_turned
        work = 1 if is_plain else 4
        self.file.check_memory(8 * 12 * self.nside**2 * (maps + work), max_memory)

    def unit(self, name: str) -> str:
        """Return the unit of a column, or the caller's word, or "unknown"."""
        return self._agreed("unit", self.column(name).unit) or UNKNOWN

    def column(self, name: str) -> TableColumn:
        """Return the description of a column of real numbers."""
        found = next((column for column in self.columns if column.name == name), None)
        if found is None:
            raise self.no_column(name)
        if found.code not in _REAL:
            text = f"has column {name!r} of format {found.repeat}{found.code}"
            raise refuse(self.file.path, text, "name a column of real numbers")
        return found

    def values_in(self, name: str) -> int:
        """Return how many values a column holds."""
        rows: int = self.file.units[self.hdu].header["NAXIS2"]
        return rows * self.column(name).repeat

    def resolve(self, column: Column) -> str:
        """Return the name of the column given by name, in any case, or by number from 0."""
        if isinstance(column, int) and not isinstance(column, bool):
            if 0 <= column < len(self.names):
                return self.names[column]
        elif isinstance(column, str):
            wanted = column.strip().upper()
            for name in self.names:
                if name.upper() == wanted:
                    return name
        raise self.no_column(column)

    def first_of(self, names: Iterable[str]) -> str | None:
        """Return the first of some well-known names that is a column here, or None."""
        present = {name.upper().replace("-", "_"): name for name in self.names}
        return next((present[name] for name in names if name in present), None)

    def no_column(self, wanted: object) -> FileFormatError:
        """Return the error for a column that is not there."""
        text = f"has no column {wanted!r} among {self.names}"
        return refuse(self.file.path, text, "name one of these, or give its number from 0")

    def _text(self, keyword: str) -> str | None:
        value = self.file.keyword(keyword, self.hdu)
        return (value.strip().upper() or None) if isinstance(value, str) else None

    def _known(self, keyword: str, allowed: Mapping[str, str]) -> str | None:
        value = self.file.keyword(keyword, self.hdu)
        if value is None:
            return None
        if self._text(keyword) not in allowed:
            found = f"has {keyword} = {value!r}, which must be one of {list(allowed)}"
            raise refuse(self.file.path, found, "correct the header or convert the file")
        return allowed[value.strip().upper()]

    def _needed(self, parameter: str, keyword: str, allowed: Mapping[str, str]) -> str:
        word = self._agreed(parameter, self._known(keyword, allowed))
        if word is None:
            choices = dict.fromkeys(allowed.values())
            remedy = "give " + " or ".join(f"{parameter}={choice!r}" for choice in choices)
            raise refuse(self.file.path, f"has no {keyword} in its header", remedy)
        return word

    def _agreed(self, parameter: str, found: str | None) -> str | None:
        given: str | None = getattr(self.stated, parameter)
        if found is not None and given is not None and _plain(found) != _plain(given):
            text = f"states {found!r} against {parameter}={given!r}"
            raise refuse(self.file.path, text, f"leave out {parameter} or correct the header")
        return found or given


def _choice(parameter: str, given: object, allowed: Mapping[str, str]) -> str | None:
    if given is None:
        return None
    found = allowed.get(given.strip().upper()) if isinstance(given, str) else None
    if found is None:
        names = " or ".join(repr(name) for name in dict.fromkeys(allowed.values()))
        msg = f"{parameter}={given!r} must be {names}; leave it out where the file says it."
        raise ParameterError(msg)
    return found


def _coordinates(word: str) -> str:
    name = word.strip().upper()
    return COORDINATES.get(name, name)


def _plain(label: str) -> str:
    # K_CMB and Kcmb are one unit to their authors.
    return re.sub(r"[\s_]", "", label).casefold()


def _columns(path: Path, header: Any) -> list[TableColumn]:
    numbers = range(1, header_count(path, header, "TFIELDS") + 1)
    columns = [_column(path, header, number) for number in numbers]
    width = sum(-(-column.repeat * _BITS[column.code] // 8) for column in columns)
    if width != header["NAXIS1"]:
        found = f"has rows of {header['NAXIS1']} bytes for columns of {width}"
        raise refuse(path, found, "fetch the file again")
    names = [column.name.upper() for column in columns]
    if len(set(names)) < len(names):
        raise refuse(path, f"has two columns of one name among {names}", "rename one of them")
    return columns


def _column(path: Path, header: Any, number: int) -> TableColumn:
    name, form, unit = (header.get(f"{key}{number}") for key in ("TTYPE", "TFORM", "TUNIT"))
    match = _FORMAT.match(form.strip().upper()) if isinstance(form, str) else None
    if match is None:
        found = f"has TFORM{number} = {form!r}, which is no format of a binary table"
        raise refuse(path, found, "fetch the file again")
    label = name.strip() if isinstance(name, str) else ""
    text = unit.strip() if isinstance(unit, str) else ""
    repeat = int(match[1]) if match[1] else 1
    return TableColumn(label or f"COLUMN_{number}", match[2], repeat, text or None)
