"""Keep wavelet coefficients: in one FITS file, or in a Zarr store of one chunk per orientation.

The FITS file has one image per scale and the parameters in its header:

====================  =======================================================================
unit                  holds
====================  =======================================================================
primary header        PARAMS, the parameters as JSON text; NSCALES, the number of scales
extension SCALING     the scaling coefficients
extension SCALE_j     the coefficients of scale j, for every j
====================  =======================================================================

An array of complex numbers is an image with one more axis in front, of length two: real parts,
then imaginary parts; the card PARTS says ``COMPLEX`` or ``REAL``. `store` says what is in the
other.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.maps_io.guard import GuardedFile, open_guarded, refuse
from spinsdw.maps_io.parameters import parameters_from_json, parameters_to_json
from spinsdw.maps_io.store import read_store, write_store
from spinsdw.maps_io.writing import Cards, provenance, write_hdus

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["read_coefficients", "write_coefficients"]

_SCALE = re.compile(r"SCALE_(\d+)")
_WRITTEN_BY_US = "give a file that write_coefficients wrote"


def write_coefficients(
    path: str | os.PathLike[str], coefficients: WaveletCoefficients, *, overwrite: bool = False
) -> Path:
    """Write wavelet coefficients, complete or not at all, in full precision.

    Parameters
    ----------
    path : str or path-like
        A local place in an existing directory. A name that ends in ".zarr" becomes a Zarr store, a
        directory with one file for each scale and orientation; any other a FITS file.
    coefficients : WaveletCoefficients
        Their parameters must be numbers, texts, booleans, None, and lists of these.
    overwrite : bool
        Replace a file, or a Zarr store, that is there.

    Returns
    -------
    Path
        What was written.

    Raises
    ------
    OutputExistsError
        The name is taken and `overwrite` is False.
    ParameterError
        A parameter cannot be written, or the directory to replace is no Zarr store.
    DataError
        An array is none of float32, float64, complex64 and complex128.
    MissingPackageError
        zarr is not installed and the name ends in ".zarr".

    See Also
    --------
    read_coefficients : The inverse.

    Examples
    --------
    >>> import tempfile
    >>> from spinsdw.coefficients import WaveletCoefficients
    >>> scales = {1: np.ones((3, 2, 3), dtype=complex)}
    >>> coefficients = WaveletCoefficients(np.zeros((1, 1)), scales, {"directions": 3})
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = write_coefficients(f"{directory}/w.fits", coefficients)
    ...     bool(np.all(read_coefficients(path)[1] == coefficients[1]))
    True
    """
    arrays = {"SCALING": coefficients.scaling}
    arrays |= {f"SCALE_{j}": coefficients[j] for j in coefficients.scales}
    text = parameters_to_json(coefficients)
    if _is_store(path):
        return write_store(path, arrays, text, overwrite=overwrite)
    images = [_image(name, np.asarray(values)) for name, values in arrays.items()]
    cards: Cards = [
        ("NSCALES", len(coefficients.scales), "number of wavelet scales"),
        ("PARAMS", text, ""),
    ]
    return write_hdus(path, images, overwrite=overwrite, cards=[*cards, *provenance()])


def read_coefficients(
    path: str | os.PathLike[str], *, max_memory: int | None = None
) -> WaveletCoefficients:
    """Read wavelet coefficients that `write_coefficients` wrote, bit for bit.

    Parameters
    ----------
    path : str or path-like
        A local FITS file, plain or gzip, or a Zarr store.
    max_memory : int, optional
        Bytes the reading may take, 4 GiB by default; checked before any is taken.

    Returns
    -------
    WaveletCoefficients
        Equal to those written.

    Raises
    ------
    FileFormatError
        It holds no wavelet coefficients, or is truncated or damaged.
    MemoryBudgetError
        The coefficients need more than `max_memory`.
    ParameterError
        An argument breaks its rule, or `path` is a URL.
    MissingPackageError
        zarr is not installed and `path` is a Zarr store.

    See Also
    --------
    write_coefficients : The inverse, with an example.
    """
    if _is_store(path):
        text, stored = read_store(path, max_memory)
        parameters = parameters_from_json(Path(path), text)
        return _assembled(Path(path), stored, len(stored) - 1, parameters)
    with open_guarded(path, None) as file:
        parameters = _parameters(file)
        file.check_memory(2 * sum(unit.size for unit in file.units), max_memory)
        with file.opened("ImageHDU") as images:
            arrays = {image.name: _array(file, image) for image in images}
        return _assembled(file.path, arrays, file.keyword("NSCALES", 0), parameters)


def _is_store(path: str | os.PathLike[str]) -> bool:
    return isinstance(path, str | os.PathLike) and os.fspath(path).endswith(".zarr")


def _assembled(
    path: Path, arrays: dict[str, NDArray[Any]], scales: Any, parameters: dict[str, Any]
) -> WaveletCoefficients:
    # A file cut between two extensions is still valid FITS: only the count tells.
    if "SCALING" not in arrays or len(arrays) - 1 != scales:
        found = f"has the extensions {list(arrays)} where NSCALES = {scales!r}"
        raise refuse(path, found, _WRITTEN_BY_US)
    scaling = arrays.pop("SCALING")
    return WaveletCoefficients(
        scaling, {_scale(path, name): values for name, values in arrays.items()}, parameters
    )


def _image(name: str, values: NDArray[Any]) -> Any:
    from astropy.io import fits

    is_complex = values.dtype.kind == "c"
    image = fits.ImageHDU(np.stack([values.real, values.imag]) if is_complex else values, name=name)
    image.header["PARTS"] = ("COMPLEX" if is_complex else "REAL", "real and imaginary on axis 0")
    return image


def _parameters(file: GuardedFile) -> dict[str, Any]:
    text = file.keyword("PARAMS", 0)
    if not isinstance(text, str):
        raise refuse(file.path, "has no card PARAMS with parameters", _WRITTEN_BY_US)
    return parameters_from_json(file.path, text)


def _array(file: GuardedFile, hdu: Any) -> NDArray[Any]:
    if hdu.verify_datasum() != 1 or hdu.verify_checksum() != 1:
        raise refuse(file.path, f"fails the checksum of {hdu.name!r}", "fetch the file again")
    # An empty image has no data at all; float32 stays what it is.
    kind = {-32: np.float32, -64: np.float64}.get(hdu.header["BITPIX"])
    if kind is None:
        found = f"has BITPIX = {hdu.header['BITPIX']} in {hdu.name!r}"
        raise refuse(file.path, found, _WRITTEN_BY_US)
    values = np.zeros(hdu.shape, kind) if hdu.data is None else np.array(hdu.data, dtype=kind)
    if hdu.header.get("PARTS") == "REAL":
        return values
    if hdu.header.get("PARTS") != "COMPLEX" or values.shape[:1] != (2,):
        found = f"has no real and imaginary parts in {hdu.name!r}"
        raise refuse(file.path, found, _WRITTEN_BY_US)
    joined = np.empty(values.shape[1:], dtype=np.result_type(kind, np.complex64))
    joined.real, joined.imag = values
    return joined


def _scale(path: Path, name: str) -> int:
    match = _SCALE.fullmatch(name)
    if match is None:
        found = f"has an extension {name!r} where SCALE_j is expected"
        raise refuse(path, found, _WRITTEN_BY_US)
    return int(match[1])
