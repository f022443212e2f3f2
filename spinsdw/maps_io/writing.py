"""Write HEALPix maps as FITS files that say everything a reader has to know."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.files import atomic_output, output_path
from spinsdw.healpix import UNSEEN, check_nside, nside_of, ring_to_nested
from spinsdw.maps_io.layout import STOKES_NAMES, UNKNOWN, Stated

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

__all__ = ["provenance", "write_hdus", "write_maps"]

Cards: TypeAlias = list[tuple[str, object, str]]

ROW = 1024  # values in a row of a column, where they divide a map: the habit of HEALPix
DTYPES = {"float32": "E", "float64": "D"}


def write_maps(  # noqa: PLR0913 - each keyword stands for one card of the header
    path: str | os.PathLike[str],
    maps: Mapping[str, ArrayLike],
    *,
    unit: str,
    polconv: str | None = None,
    coordinates: str | None = None,
    ordering: Literal["RING", "NESTED"] = "RING",
    overwrite: bool = False,
    dtype: Literal["float32", "float64"] = "float32",
    history: Sequence[str] = (),
) -> Path:
    """Write whole-sky HEALPix maps to a FITS file, complete or not at all.

    The header states the resolution, the ordering, the unit, the coordinates and the polarisation
    convention, what marks a bad pixel, and which version of the package wrote the file.

    Parameters
    ----------
    path : str or path-like
        A local file in an existing directory, not ending in ``.gz``.
    maps : mapping of str to array_like, shape (12 * nside**2,), real
        Column name to map, all of one size, in RING order. Bad pixels are written as they are.
    unit : str
        Unit of all maps, in ASCII, such as "K_CMB" or "uK"; "unknown" writes none.
    polconv : {"COSMO", "IAU"}, optional
        The convention that the arrays are in: it is stated, not applied. Required where a column
        has a name of Stokes Q or U.
    coordinates : str, optional
        "G", "E" or "C"; None or "unknown" writes none.
    ordering : {"RING", "NESTED"}
        The order in the file; the arrays are converted from RING.
    overwrite : bool
        Replace a file that is there.
    dtype : {"float32", "float64"}
        Precision in the file.
    history : sequence of str
        Further lines of HISTORY, in ASCII.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    OutputExistsError
        The file exists and `overwrite` is False.
    ParameterError
        A name, a label or a choice breaks its rule, or `polconv` is missing.
    ShapeError
        The maps are not whole-sky maps of one size.
    DataError
        A map is complex or masked, or too large for `dtype`.

    See Also
    --------
    read_map, read_polarisation : Read such a file.

    Examples
    --------
    >>> import tempfile
    >>> from spinsdw.maps_io import read_polarisation
    >>> maps = {"Q_STOKES": np.arange(192.0), "U_STOKES": np.ones(192)}
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = write_maps(f"{directory}/qu.fits", maps, unit="K_CMB", polconv="COSMO")
    ...     bool(np.all(read_polarisation(path).q == maps["Q_STOKES"]))
    True
    """
    if os.fspath(path).lower().endswith(".gz"):
        msg = f"path={os.fspath(path)!r} must not end in .gz; compress the file afterwards."
        raise ParameterError(msg)
    output_path(path, overwrite=overwrite)
    _check_words(maps, [unit, coordinates or "", *history])
    stated = Stated(ordering=ordering, polconv=polconv, unit=unit, coordinates=coordinates)
    if stated.polconv is None and _polarised(maps):
        msg = f"polconv=None must be 'COSMO' or 'IAU' for columns {list(maps)}; HEALPix uses COSMO."
        raise ParameterError(msg)
    arrays = _arrays(maps, dtype, is_nested=stated.ordering == "NESTED")
    table = _table(arrays, stated, history)
    return write_hdus(path, [table], overwrite=overwrite, cards=[])


def write_hdus(
    path: str | os.PathLike[str], extensions: Sequence[Any], *, overwrite: bool, cards: Cards
) -> Path:
    """Write a primary header with ``cards`` and some extensions, with checksums, atomically."""
    from astropy.io import fits

    hdus = fits.HDUList([fits.PrimaryHDU(header=fits.Header(cards)), *extensions])
    for hdu in hdus:
        # The comment of astropy holds the time, and then no file could be made twice.
        hdu.add_checksum(when="checksum of this unit")
    with atomic_output(path, overwrite=overwrite) as stream:
        hdus.writeto(stream)
    return output_path(path, overwrite=True)


def provenance(history: Sequence[str] = ()) -> Cards:
    """Return the HISTORY cards of a file: who wrote it, then the caller's lines."""
    try:
        version = metadata.version("spinsdw")
    except metadata.PackageNotFoundError:
        version = "from a source tree that is not installed"
    return [("HISTORY", line, "") for line in (f"Written by spinsdw {version}", *history)]


def _polarised(names: Mapping[str, object]) -> bool:
    known = {name for pair in STOKES_NAMES for name in pair}
    return any(name.upper() in known for name in names)


def _check_words(maps: Mapping[str, object], labels: Sequence[str]) -> None:
    names = [name for name in maps if isinstance(name, str)]
    if not maps or len({name.upper() for name in names}) < len(maps) or "" in names:
        msg = f"maps has the columns {list(maps)}, which must be distinct names, one or more."
        raise ParameterError(msg)
    for word in (*names, *labels):
        if not (isinstance(word, str) and word.isascii() and (word + " ").isprintable()):
            msg = f"text {word!r} must be printable ASCII, as FITS headers are; write uK for µK."
            raise ParameterError(msg)


def _arrays(
    maps: Mapping[str, ArrayLike], dtype: str, *, is_nested: bool
) -> dict[str, NDArray[Any]]:
    if dtype not in DTYPES:
        msg = f"dtype={dtype!r} must be 'float32' or 'float64'; float32 keeps seven digits."
        raise ParameterError(msg)
    arrays = {name: _file_array(name, values, dtype) for name, values in maps.items()}
    shapes = {name: array.shape for name, array in arrays.items()}
    if len(set(shapes.values())) > 1 or any(len(shape) != 1 for shape in shapes.values()):
        msg = f"maps have the shapes {shapes}; give whole-sky maps of one nside."
        raise ShapeError(msg)
    check_nside(nside_of(next(iter(arrays.values()))), nested=is_nested)
    if is_nested:
        return {name: ring_to_nested(array) for name, array in arrays.items()}
    return arrays


def _file_array(name: str, values: ArrayLike, dtype: str) -> NDArray[Any]:
    array = np.asanyarray(values)
    if array.dtype.kind not in "buif" or isinstance(array, np.ma.MaskedArray):
        kind = f"{type(array).__name__} of {array.dtype}"
        msg = f"map {name!r} is a {kind} but must be real; write parts apart, fill masked pixels."
        raise DataError(msg)
    largest = np.finfo(dtype).max
    if np.any(np.isfinite(array) & (np.abs(array) > largest)):
        msg = f"map {name!r} has values beyond {largest:.2g}; pass dtype='float64' or change unit."
        raise DataError(msg)
    return np.array(array, dtype=dtype)


def _table(arrays: Mapping[str, NDArray[Any]], stated: Stated, history: Sequence[str]) -> Any:
    from astropy.io import fits

    first = next(iter(arrays.values()))
    row = ROW if first.size % ROW == 0 else 1
    columns = [
        fits.Column(
            name=name,
            format=f"{row if row > 1 else ''}{DTYPES[array.dtype.name]}",
            unit=None if stated.unit == UNKNOWN else stated.unit,
            array=array.reshape(-1, row) if row > 1 else array,
        )
        for name, array in arrays.items()
    ]
    table = fits.BinTableHDU.from_columns(columns, name="MAPS")
    table.header.extend(_cards(nside_of(first), stated, is_polarised=_polarised(arrays)))
    table.header.extend(provenance(history))
    return table


def _cards(nside: int, stated: Stated, *, is_polarised: bool) -> Cards:
    cards: Cards = [
        ("PIXTYPE", "HEALPIX", "pixelisation"),
        ("ORDERING", stated.ordering, "pixel order, RING or NESTED"),
        ("NSIDE", nside, "resolution"),
        ("FIRSTPIX", 0, "first pixel"),
        ("LASTPIX", 12 * nside**2 - 1, "last pixel"),
        ("INDXSCHM", "IMPLICIT", "every pixel is there, in order"),
        ("OBJECT", "FULLSKY", "the whole sky"),
        ("BAD_DATA", UNSEEN, "marks a bad pixel"),
        ("POLAR", is_polarised, "holds Stokes Q or U"),
    ]
    if stated.polconv is not None:
        cards.append(("POLCCONV", stated.polconv, "polarisation convention, COSMO or IAU"))
    if stated.coordinates not in (None, "", UNKNOWN.upper()):
        cards.append(("COORDSYS", stated.coordinates, "G galactic, E ecliptic, C equatorial"))
    return cards
