"""Read HEALPix maps, Stokes pairs and masks into native float64 arrays in RING order."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.healpix import UNSEEN, bad_pixel_mask, convert_polconv, nested_to_ring, nside_of
from spinsdw.maps_io.guard import open_guarded, refuse
from spinsdw.maps_io.layout import (
    INTENSITY_NAMES,
    STOKES_NAMES,
    UNKNOWN,
    Column,
    SkyTable,
    Stated,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["HealpixMap", "PolarisationMaps", "read_map", "read_mask", "read_polarisation"]

FloatArray: TypeAlias = "NDArray[np.float64]"
PathName: TypeAlias = "str | os.PathLike[str]"


def _read_only(values: FloatArray, name: str) -> FloatArray:
    array = np.asarray(values, dtype=np.float64).view()
    if array.ndim != 1:
        msg = f"{name} has shape {array.shape} but must be one map of 12 nside**2 pixels."
        raise ShapeError(msg)
    nside_of(array)
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False)
class HealpixMap:
    """One whole-sky HEALPix map and its labels.

    Parameters
    ----------
    values : ndarray, shape (12 * nside**2,), float64
        RING order.  Bad pixels hold what the file held; pixels that a partial file does not
        list hold `spinsdw.healpix.UNSEEN`.  Held read-only.
    unit, coordinates : str
        Labels, such as "K_CMB" and "G"; "unknown" where nobody said.
    column : str
        The column the values come from.
    sentinel : float, optional
        What marks a bad pixel besides UNSEEN; see `spinsdw.healpix.bad_pixel_mask`.

    Raises
    ------
    ShapeError
        `values` is not one whole-sky map.

    Examples
    --------
    >>> HealpixMap(np.zeros(192), unit="K_CMB").nside
    4
    """

    values: FloatArray
    unit: str = UNKNOWN
    coordinates: str = UNKNOWN
    column: str = ""
    sentinel: float | None = None

    def __post_init__(self) -> None:
        """Check the shape and lock the values."""
        object.__setattr__(self, "values", _read_only(self.values, "values"))

    @property
    def nside(self) -> int:
        """The HEALPix resolution."""
        return nside_of(self.values)


@dataclass(frozen=True, eq=False)
class PolarisationMaps:
    """Stokes Q and U (or a shear field) on the whole HEALPix sky, and their labels.

    Parameters
    ----------
    q, u : ndarray, shape (12 * nside**2,), float64
        RING order, both in the unit `unit` and the convention `polconv`.  Bad pixels hold what
        the file held; pixels that a partial file does not list hold `spinsdw.healpix.UNSEEN`.
        Held read-only.
    unit, coordinates : str
        Labels, such as "K_CMB" and "G"; "unknown" where nobody said.
    polconv : {"COSMO", "IAU"}
        The convention of these arrays. `read_polarisation` always gives "COSMO".
    columns : tuple of str
        The columns of Q and of U.
    sentinel : float, optional
        What marks a bad pixel besides UNSEEN; see `spinsdw.healpix.bad_pixel_mask`.

    Raises
    ------
    ShapeError
        `q` or `u` is not one whole-sky map, or their sizes differ.
    ParameterError
        `polconv` is neither "COSMO" nor "IAU".

    Examples
    --------
    >>> maps = PolarisationMaps(np.zeros(192), np.zeros(192), unit="K_CMB")
    >>> maps.nside, maps.polconv
    (4, 'COSMO')
    """

    q: FloatArray
    u: FloatArray
    unit: str = UNKNOWN
    coordinates: str = UNKNOWN
    polconv: str = "COSMO"
    columns: tuple[str, str] = ("", "")
    sentinel: float | None = None

    def __post_init__(self) -> None:
        """Check the shapes and the convention, and lock the arrays."""
        object.__setattr__(self, "q", _read_only(self.q, "q"))
        object.__setattr__(self, "u", _read_only(self.u, "u"))
        if self.q.shape != self.u.shape:
            msg = f"q has shape {self.q.shape} and u {self.u.shape}; give two maps of one nside."
            raise ShapeError(msg)
        Stated(polconv=self.polconv)

    @property
    def nside(self) -> int:
        """The HEALPix resolution."""
        return nside_of(self.q)


def read_map(  # noqa: PLR0913 - each keyword stands for one card a header may lack
    path: PathName,
    *,
    column: Column | None = None,
    hdu: int = 1,
    ordering: str | None = None,
    unit: str | None = None,
    coordinates: str | None = None,
    max_memory: int | None = None,
) -> HealpixMap:
    """Read one map from a HEALPix FITS file.

    The file's header stands. `ordering`, `unit` and `coordinates` fill in what it leaves out;
    an argument that contradicts it is an error.

    Parameters
    ----------
    path : str or path-like
        A local file, plain or gzip, whole-sky or partial (a column PIXEL).
    column : str or int, optional
        Name, in any case, or number from 0 in file order, PIXEL not counted. By default the only
        column, or else the first that there is of I_STOKES, TEMPERATURE, INTENSITY, I, T, SIGNAL,
        KAPPA.
    hdu : int
        Number of the extension, from 1.
    ordering : {"RING", "NESTED"}, optional
        Needed where the header has no ORDERING.
    unit, coordinates : str, optional
        Labels for a file that has none, such as "K_CMB" and "G".
    max_memory : int, optional
        Bytes the reading may take, 4 GiB by default; checked before any is taken.

    Returns
    -------
    HealpixMap
        Native float64 in RING order; bad pixels as found.

    Raises
    ------
    FileFormatError
        The file is no HEALPix map, is truncated, contradicts itself or an argument, says
        neither RING nor NESTED, or has no such column.
    MemoryBudgetError
        The map needs more than `max_memory`.
    ParameterError
        An argument breaks its rule, or `path` is a URL.

    See Also
    --------
    write_maps : Writes such a file.

    Examples
    --------
    >>> from spinsdw.datasets import wmap_synchrotron_paths
    >>> q_path, u_path = wmap_synchrotron_paths()
    >>> stokes_q = read_map(q_path, column="BESTFIT", unit="mK_RJ")
    >>> stokes_q.coordinates, round(float(stokes_q.values.max()), 4)
    ('G', 1.2187)
    """
    stated = Stated(ordering=ordering, unit=unit, coordinates=coordinates)
    with _table(path, hdu, stated) as table:
        name = _intensity_column(table) if column is None else table.resolve(column)
        table.check_memory(1, max_memory)
        labels = (table.unit(name), table.coordinates, name, table.sentinel)
        with table.file.opened("BinTableHDU", hdu) as (found,):
            return HealpixMap(_sky(table, found.data, name), *labels)


def read_polarisation(  # noqa: PLR0913 - each keyword stands for one card a header may lack
    path_or_pair: PathName | Sequence[PathName],
    *,
    columns: Column | tuple[Column, Column] | None = None,
    ordering: str | None = None,
    polconv: str | None = None,
    unit: str | None = None,
    coordinates: str | None = None,
    max_memory: int | None = None,
) -> PolarisationMaps:
    """Read Stokes Q and U, or the two components of a shear field, from one file or from two.

    The result is always in the COSMO convention (HEALPix: x south, y east): U changes sign where
    the file follows the IAU, except at bad pixels.  The file's header stands; `ordering`,
    `polconv`, `unit` and `coordinates` fill in what it leaves out, and an argument that contradicts
    it is an error.  Shear catalogues mostly follow the IAU: give ``polconv="IAU"`` for those.

    Parameters
    ----------
    path_or_pair : path or pair of paths
        One local file with both columns, or the file of Q and the file of U; plain or gzip,
        whole-sky or partial (a column PIXEL).
    columns : pair of str or int, or one for a pair of files, optional
        Names, in any case, or numbers from 0 in file order, PIXEL not counted. By default the
        first pair that there is of Q_STOKES, Q_POLARISATION, Q_POLARIZATION, Q, GAMMA1, G1, E1
        with its partner.
    ordering : {"RING", "NESTED"}, optional
        Needed where the header has no ORDERING.
    polconv : {"COSMO", "IAU"}, optional
        Needed where the header has no POLCCONV. It is never guessed: other software takes its
        absence as COSMO or as IAU, and a wrong sign of U mixes E and B.
    unit, coordinates : str, optional
        Labels for a file that has none, such as "K_CMB" and "G".
    max_memory : int, optional
        Bytes the reading may take, 4 GiB by default; checked before any is taken.

    Returns
    -------
    PolarisationMaps
        Native float64 in RING order and the COSMO convention; bad pixels as found.

    Raises
    ------
    FileFormatError
        A file is no HEALPix map, is truncated, contradicts itself, its partner or an argument,
        does not say what has to be known, or has no such column.
    MemoryBudgetError
        The maps need more than `max_memory`.
    ParameterError
        An argument breaks its rule, or a path is a URL.

    See Also
    --------
    write_maps : Writes such a file.
    spinsdw.healpix.clean_polarisation : Turns bad pixels into a mask.

    Examples
    --------
    >>> from spinsdw.datasets import wmap_synchrotron_paths
    >>> stated = {"polconv": "COSMO", "unit": "mK_RJ"}
    >>> maps = read_polarisation(wmap_synchrotron_paths(), columns="BESTFIT", **stated)
    >>> round(float(np.hypot(maps.q, maps.u).max()), 4)
    2.4338
    """
    stated = Stated(ordering, polconv, unit, coordinates)
    paths = _paths(path_or_pair)
    wanted = _wanted_columns(columns, len(paths))
    if len(paths) == 1:
        with _table(paths[0], 1, stated) as table:
            q, u = _components(table, _stokes_columns(table, wanted), max_memory)
    else:
        q, u = (
            _one_component(_table(path, 1, stated), stokes, column, max_memory)
            for path, stokes, column in zip(paths, "QU", wanted, strict=True)
        )
    return _joined(q, u)


def read_mask(
    path: PathName,
    *,
    column: Column = 0,
    ordering: str | None = None,
    max_memory: int | None = None,
) -> FloatArray:
    """Read a mask: 0 where the sky is hidden, 1 where it is kept, between the two on an edge.

    Parameters
    ----------
    path : str or path-like
        A local HEALPix FITS file, plain or gzip.
    column : str or int
        Name, in any case, or number from 0 in file order, PIXEL not counted.
    ordering : {"RING", "NESTED"}, optional
        Needed where the header has no ORDERING.
    max_memory : int, optional
        Bytes the reading may take, 4 GiB by default.

    Returns
    -------
    ndarray, shape (12 * nside**2,), float64
        RING order. Pixels that a partial file does not list are 0, and so are those that hold
        the sentinel of bad pixels.

    Raises
    ------
    FileFormatError
        As for `read_map`.
    DataError
        A value is not in [0, 1].
    MemoryBudgetError, ParameterError
        As for `read_map`.

    Examples
    --------
    >>> from spinsdw.datasets import wmap_mask_path
    >>> read_mask(wmap_mask_path()).shape
    (12288,)
    """
    sky = read_map(path, column=column, ordering=ordering, max_memory=max_memory)
    hidden = bad_pixel_mask(sky.values, sky.sentinel) & np.isfinite(sky.values)
    mask = np.where(hidden, 0.0, sky.values)
    outside = np.count_nonzero(~((mask >= 0) & (mask <= 1)))
    if outside:
        msg = (
            f"path={os.fspath(path)!r} has {outside} values outside [0, 1] in column "
            f"{sky.column!r}; a mask is 0 where hidden and 1 where kept, so choose its column."
        )
        raise DataError(msg)
    return mask


@contextmanager
def _table(path: PathName, hdu: int, stated: Stated) -> Iterator[SkyTable]:
    if not isinstance(hdu, int) or isinstance(hdu, bool) or hdu < 1:
        msg = f"hdu={hdu!r} must be an integer >= 1; maps lie in extension 1 of most files."
        raise ParameterError(msg)
    with open_guarded(path, hdu) as file:
        yield SkyTable.described(file, hdu, stated)


def _paths(path_or_pair: PathName | Sequence[PathName]) -> list[PathName]:
    if isinstance(path_or_pair, (str, os.PathLike)):
        return [path_or_pair]
    if isinstance(path_or_pair, Sequence) and len(path_or_pair) == 2:
        return list(path_or_pair)
    msg = f"path_or_pair={path_or_pair!r} must be one path, or the path of Q and the path of U."
    raise ParameterError(msg)


def _wanted_columns(
    columns: Column | tuple[Column, Column] | None, files: int
) -> tuple[Column | None, Column | None]:
    if columns is None:
        return None, None
    if isinstance(columns, (str, int)):
        if files == 2:
            return columns, columns
    elif isinstance(columns, Sequence) and len(columns) == 2:
        return columns[0], columns[1]
    msg = f"columns={columns!r} must be the two columns of Q and U, such as (1, 2)."
    raise ParameterError(msg)


def _intensity_column(table: SkyTable) -> str:
    name = table.names[0] if len(table.names) == 1 else table.first_of(INTENSITY_NAMES)
    if name is None:
        raise table.no_column(INTENSITY_NAMES)
    return name


@dataclass(frozen=True, eq=False)
class _Component:
    """Q or U as its file has it."""

    path: Path
    values: FloatArray
    polconv: str
    column: str
    unit: str
    coordinates: str
    sentinel: float | None


def _stokes_columns(
    table: SkyTable, wanted: tuple[Column | None, Column | None]
) -> tuple[str, str]:
    if wanted[0] is None or wanted[1] is None:
        for pair in STOKES_NAMES:
            q, u = (table.first_of([name]) for name in pair)
            if q is not None and u is not None:
                return q, u
        raise table.no_column(STOKES_NAMES)
    q, u = table.resolve(wanted[0]), table.resolve(wanted[1])
    if q == u:
        msg = f"columns={wanted!r} are one column {q!r}; name the two of Q and U."
        raise ParameterError(msg)
    return q, u


def _one_component(
    opening: AbstractContextManager[SkyTable],
    stokes: str,
    wanted: Column | None,
    max_memory: int | None,
) -> _Component:
    with opening as table:
        if table.stokes in ("I", "Q", "U") and table.stokes != stokes:
            found = f"has STOKES = {table.stokes!r} where {stokes} is wanted"
            raise refuse(table.file.path, found, "give the file of Q first, that of U second")
        known = [pair["QU".index(stokes)] for pair in STOKES_NAMES]
        name = table.first_of(known) if wanted is None else table.resolve(wanted)
        if name is None:
            raise table.no_column(known)
        # Q and U are held together in the end, whichever file is being read.
        return _components(table, (name,), max_memory, maps=2)[0]


def _components(
    table: SkyTable, names: Sequence[str], max_memory: int | None, maps: int = 2
) -> list[_Component]:
    polconv, coordinates, units = table.polconv, table.coordinates, map(table.unit, names)
    table.check_memory(maps, max_memory, is_turned=polconv != "COSMO")
    with table.file.opened("BinTableHDU", table.hdu) as (found,):
        return [
            _Component(
                path=table.file.path,
                values=_sky(table, found.data, name),
                polconv=polconv,
                column=name,
                unit=unit,
                coordinates=coordinates,
                sentinel=table.sentinel,
            )
            for name, unit in zip(names, units, strict=True)
        ]


def _joined(q: _Component, u: _Component) -> PolarisationMaps:
    for name in ("polconv", "unit", "coordinates", "sentinel"):
        if getattr(q, name) != getattr(u, name):
            found = f"has {name} {getattr(u, name)!r} for U where Q has {getattr(q, name)!r}"
            raise refuse(u.path, found, "bring both to one")
    if q.values.shape != u.values.shape:
        found = f"has {u.values.size} pixels for U where Q has {q.values.size}"
        raise refuse(u.path, found, "bring both to one nside")
    u_values = u.values
    if u.polconv != "COSMO":
        turned = convert_polconv(q.values, u_values, u.polconv, "COSMO")[1]
        # A sentinel of the file's own must keep its sign, or it is not known again.
        u_values = np.where(bad_pixel_mask(u_values, u.sentinel), u_values, turned)
    return PolarisationMaps(
        q.values,
        u_values,
        unit=q.unit,
        coordinates=q.coordinates,
        columns=(q.column, u.column),
        sentinel=q.sentinel,
    )


def _sky(table: SkyTable, data: Any, name: str) -> FloatArray:
    """Return a column as a whole-sky map in RING order."""
    values = np.array(data.field(name), dtype=np.float64).reshape(-1)
    if table.is_partial:
        values = _spread(table, data, values)
    if table.ordering == "NESTED":
        values = nested_to_ring(values)
    return values


def _spread(table: SkyTable, data: Any, listed: FloatArray) -> FloatArray:
    """Return the whole sky, UNSEEN where the file lists no pixel."""
    values = np.full(12 * table.nside**2, UNSEEN)
    values[_pixels(table, data, listed.size)] = listed
    return values


def _pixels(table: SkyTable, data: Any, size: int) -> NDArray[np.int64]:
    """Return the pixel numbers of a partial map; they must be valid and distinct."""
    path, npix = table.file.path, 12 * table.nside**2
    names = [column.name for column in table.columns if column.name.upper() == "PIXEL"]
    if not names:
        raise refuse(path, "has INDXSCHM = 'EXPLICIT' but no column PIXEL", "correct the header")
    found = np.asarray(data.field(names[0])).reshape(-1)
    if found.dtype.kind not in "iu" or found.size != size:
        text = f"has {found.size} PIXEL values of type {found.dtype.name} for {size} values"
        raise refuse(path, text, "give one integer pixel number per value")
    pixels = found.astype(np.int64)
    outside = np.count_nonzero((pixels < 0) | (pixels >= npix))
    if outside:
        text = f"has {outside} PIXEL numbers outside 0 to {npix - 1}"
        raise refuse(path, text, "correct NSIDE or the pixel numbers")
    repeated = pixels.size - np.unique(pixels).size
    if repeated:
        raise refuse(path, f"lists {repeated} pixels more than once", "keep one value for each")
    return pixels
