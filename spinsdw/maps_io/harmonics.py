"""Harmonic coefficients in FITS files, as healpy's ``write_alm`` lays them out.

One binary table for each field, named after it, with the columns INDEX, REAL and IMAG:
index = l^2 + l + m + 1. Of a real field m >= 0 alone is there, which is what healpy has; a table
with any m < 0 holds a complex field, or one with spin, in full.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.harmonics import bandlimit_of, check_flm, degrees, is_real_field, orders
from spinsdw.maps_io.guard import GuardedFile, open_guarded, refuse
from spinsdw.maps_io.writing import provenance, write_hdus

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["read_flm", "write_flm"]

COLUMNS = ("INDEX", "REAL", "IMAG")
LARGEST_BANDLIMIT = 2**15


def write_flm(
    path: str | os.PathLike[str], fields: Mapping[str, NDArray[Any]], *, overwrite: bool = False
) -> Path:
    """Write harmonic coefficients to a FITS file, complete or not at all.

    Parameters
    ----------
    path : str or path-like
        A local file in an existing directory.
    fields : mapping of str to ndarray, shape (bandlimit**2,), complex
        Name to coefficients, such as "E" and "B", or "P" of Q + iU; in double precision.
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]
    overwrite : bool
        Replace a file that is there.

    Returns
    -------
    Path
        The file written. ``healpy.read_alm(path, hdu=i)`` reads the i-th field, from 1, if it is
        a real one: then m < 0 is left out.

    Raises
    ------
    OutputExistsError
        The file exists and `overwrite` is False.
    ShapeError, DataError
        A field has no square number of coefficients, or one that is not finite.
    ParameterError
        There is no field, or a name is no plain word.

    See Also
    --------
    read_flm : The inverse.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = write_flm(f"{directory}/alm.fits", {"P": np.arange(9) * 1j})
    ...     found = read_flm(path)
    >>> found["P"].imag.tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    """
    names = list(fields)
    if not names or not all(
        isinstance(name, str) and name.isascii() and name.isidentifier() for name in names
    ):
        msg = f"fields has the names {names}, which must be plain words, one or more, such as 'E'."
        raise ParameterError(msg)
    if len({name.upper() for name in names}) < len(names):
        msg = f"fields has the names {names}, which must differ by more than upper case."
        raise ParameterError(msg)
    tables = [_table(name, flm) for name, flm in fields.items()]
    return write_hdus(path, tables, overwrite=overwrite, cards=provenance())


def _table(name: str, flm: NDArray[Any]) -> Any:
    from astropy.io import fits

    bandlimit = bandlimit_of(flm)
    values = check_flm(flm, bandlimit, name)
    if values.ndim != 1:
        msg = f"{name} has shape {values.shape}; write each field of a batch under its own name."
        raise ParameterError(msg)
    index = np.arange(bandlimit**2)
    # Only what is symmetric to the last bit comes back from half of it.
    if is_real_field(values, 0):
        index = index[orders(bandlimit) >= 0]
    parts = (index + 1, values[index].real, values[index].imag)
    columns = [
        fits.Column(name=column, format=code, array=part)
        for column, code, part in zip(COLUMNS, "KDD", parts, strict=True)
    ]
    table = fits.BinTableHDU.from_columns(columns, name=name)
    # What healpy writes: the largest degree and order.
    table.header["MAX-LPOL"] = (bandlimit - 1, "largest degree")
    table.header["MAX-MPOL"] = (bandlimit - 1, "largest order")
    return table


def read_flm(
    path: str | os.PathLike[str], *, max_memory: int | None = None
) -> dict[str, NDArray[np.complex128]]:
    """Read harmonic coefficients that `write_flm` or healpy wrote.

    Parameters
    ----------
    path : str or path-like
        A local file, plain or gzip.
    max_memory : int, optional
        Bytes the reading may take, 4 GiB by default; checked before any is taken.

    Returns
    -------
    dict of str to ndarray, shape (bandlimit**2,), complex128
        The fields in the order of the file, by the names of the extensions, or by their numbers
        from 1 where they have none. A field without any m < 0 is a real one.
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]

    Raises
    ------
    FileFormatError
        The file holds no such tables, or is truncated or inconsistent.
    DataError
        A value is not finite.
    MemoryBudgetError
        The coefficients need more than `max_memory`.
    ParameterError
        An argument breaks its rule, or `path` is a URL.

    See Also
    --------
    write_flm : The inverse, with an example.
    """
    with open_guarded(path, None) as file:
        # Small tables can name large indices: what they ask for is counted below, table by table.
        file.check_memory(4 * sum(unit.size for unit in file.units), max_memory)
        with file.opened("BinTableHDU") as tables:
            if not tables:
                raise refuse(file.path, "has no tables", "give coefficients that healpy wrote")
            return {
                table.name or str(number): _field(file, table, max_memory)
                for number, table in enumerate(tables, start=1)
            }


def _field(file: GuardedFile, table: Any, max_memory: int | None) -> NDArray[np.complex128]:
    names = [name.upper() for name in table.columns.names]
    if not set(COLUMNS) <= set(names):
        found = f"has the columns {names} where {COLUMNS} must be"
        raise refuse(file.path, found, "give coefficients that healpy wrote")
    index, real, imag = (np.asarray(table.data[name]).ravel() for name in COLUMNS)
    if index.dtype.kind not in "iu" or not index.size:
        raise refuse(file.path, f"has no indices in {table.name!r}", "fetch the file again")
    index = index.astype(np.int64) - 1
    bandlimit = int(np.sqrt(max(0, int(index.max())))) + 1
    is_distinct = np.unique(index).size == index.size
    if index.min() < 0 or not is_distinct or bandlimit > LARGEST_BANDLIMIT:
        found = f"has indices in {table.name!r} that are not distinct, or from 1 to 2**30"
        raise refuse(file.path, found, "fetch the file again")
    file.check_memory(4 * 16 * bandlimit**2, max_memory)
    flm = np.zeros(bandlimit**2, dtype=np.complex128)
    flm.real[index], flm.imag[index] = real, imag
    el, m = degrees(bandlimit), orders(bandlimit)
    if not np.any(m[index] < 0):
        below = np.flatnonzero(m < 0)
        opposite = el[below] ** 2 + el[below] - m[below]
        flm[below] = (-1.0) ** m[below] * flm[opposite].conj()
    return check_flm(flm, bandlimit, table.name or "field")
