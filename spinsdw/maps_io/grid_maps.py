"""Maps on the grids of the package in FITS files, MW and MWSS ones as S2LET writes them.

One binary table, ring by ring: a column SIGNAL of a real map, or Q_POLARISATION and U_POLARISATION
of the real and imaginary part of a complex one. The card L is the bandlimit, MWSS = 1 marks that
grid, and SAMPLING, which S2LET does not look at, names any.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.errors import DataError
from spinsdw.maps_io.guard import GuardedFile, header_count, open_guarded, refuse
from spinsdw.maps_io.writing import Cards, provenance, write_hdus
from spinsdw.sampling import Sampling, resolve_sampling
from spinsdw.signals import check_map

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["read_grid_map", "write_grid_map"]

REAL = ("SIGNAL",)
COMPLEX = ("Q_POLARISATION", "U_POLARISATION")


def write_grid_map(
    path: str | os.PathLike[str],
    values: NDArray[Any],
    sampling: Sampling,
    *,
    unit: str = "",
    overwrite: bool = False,
) -> Path:
    """Write a map on a grid to a FITS file, complete or not at all.

    Parameters
    ----------
    path : str or path-like
        A local file in an existing directory.
    values : ndarray, shape ``sampling.shape``
        A real map, or a complex one such as Q + iU. Nothing is converted: say in your notes which
        polarisation convention it has; this package computes in COSMO.
    sampling : Sampling
        Its grid, such as ``transform.harmonic.sampling``.
    unit : str
        Unit in ASCII; none is written by default.
    overwrite : bool
        Replace a file that is there.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    OutputExistsError
        The file exists and `overwrite` is False.
    ShapeError, DataError
        The map is not on the grid, or holds something that is no finite number.

    See Also
    --------
    read_grid_map : The inverse.

    Examples
    --------
    >>> import tempfile
    >>> from spinsdw.sampling import MW
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = write_grid_map(f"{directory}/f.fits", np.ones((4, 7)), MW(4))
    ...     found, sampling = read_grid_map(path)
    >>> found.shape, sampling
    ((4, 7), MW(bandlimit=4))
    """
    from astropy.io import fits

    array = check_map(values, sampling.shape, real=not np.iscomplexobj(values))
    if array.ndim != 2:
        msg = f"map has shape {array.shape} but a file holds one, {sampling.shape}; write each."
        raise DataError(msg)
    parts = (array.real, array.imag) if np.iscomplexobj(array) else (array,)
    names = COMPLEX if np.iscomplexobj(array) else REAL
    columns = [
        fits.Column(name=name, format="1D", unit=unit or None, array=part.ravel())
        for name, part in zip(names, parts, strict=True)
    ]
    table = fits.BinTableHDU.from_columns(columns, name="BINTABLE")
    cards: Cards = [("L", sampling.bandlimit, "Resolution parameter")]
    if sampling.name == "mwss":
        cards.append(("MWSS", 1, "Sampling scheme parameter"))
    cards.append(("SAMPLING", sampling.name, "name of the grid"))
    table.header.extend([*cards, *provenance()])
    return write_hdus(path, [table], overwrite=overwrite, cards=[])


def read_grid_map(
    path: str | os.PathLike[str], *, max_memory: int | None = None
) -> tuple[NDArray[Any], Sampling]:
    """Read a map on a grid that `write_grid_map` or S2LET wrote.

    Parameters
    ----------
    path : str or path-like
        A local file, plain or gzip.
    max_memory : int, optional
        Bytes the reading may take, 4 GiB by default; checked before any is taken.

    Returns
    -------
    values : ndarray, shape ``sampling.shape``, float64 or complex128
        Complex if the file holds the two columns of a polarised or other complex map.
    sampling : Sampling
        Its grid.

    Raises
    ------
    FileFormatError
        The file holds no such map, is truncated, or its size does not fit its grid.
    DataError
        A value is not finite.
    MemoryBudgetError
        The map needs more than `max_memory`.
    ParameterError
        An argument breaks its rule, or `path` is a URL.

    See Also
    --------
    write_grid_map : The inverse, with an example.
    """
    with open_guarded(path) as file:
        sampling = _sampling(file)
        file.check_memory(6 * file.units[1].size, max_memory)
        with file.opened("BinTableHDU") as tables:
            table = tables[0]
            names = [name.upper() for name in table.columns.names]
            wanted = COMPLEX if COMPLEX[0] in names else REAL
            if not set(wanted) <= set(names):
                found = f"has the columns {names} where {REAL} or {COMPLEX} must be"
                raise refuse(file.path, found, "give a map that S2LET or write_grid_map wrote")
            parts = [_column(file, table, name, sampling) for name in wanted]
    values = parts[0] if len(parts) == 1 else parts[0] + 1j * parts[1]
    return check_map(values, sampling.shape, real=len(parts) == 1), sampling


def _sampling(file: GuardedFile) -> Sampling:
    header = file.units[1].header
    bandlimit = header_count(file.path, header, "L")
    kind = "mwss" if header.get("MWSS") == 1 else "mw"
    name = header.get("SAMPLING", kind)
    try:
        return resolve_sampling(name, bandlimit)
    except ValueError as error:
        found = f"has L = {bandlimit} and SAMPLING = {name!r}"
        raise refuse(file.path, found, "give a map on a grid of this package") from error


def _column(file: GuardedFile, table: Any, name: str, sampling: Sampling) -> NDArray[Any]:
    values = np.asarray(table.data[name])
    rings, points = sampling.shape
    if values.size != rings * points or values.dtype.kind not in "iuf":
        found = f"has {values.size} values in {name!r}, not the {rings} x {points} of its grid"
        raise refuse(file.path, found, "fetch the file again")
    return np.ascontiguousarray(values.reshape(sampling.shape), dtype=np.float64)
