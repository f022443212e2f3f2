"""Keep wavelet coefficients in a FITS file: one image per scale, the parameters in the header.

====================  =======================================================================
unit                  holds
====================  =======================================================================
primary header        PARAMS, the parameters as JSON text; NSCALES, the number of scales
extension SCALING     the scaling coefficients
extension SCALE_j     the coefficients of scale j, for every j
====================  =======================================================================

An array of complex numbers is an image with one more axis in front, of length two: real parts,
then imaginary parts; the card PARTS says ``COMPLEX`` or ``REAL``.
"""

from __future__ import annotations

import json
import os
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import DataError, ParameterError
from spinsdw.maps_io.guard import GuardedFile, open_guarded, refuse
from spinsdw.maps_io.writing import Cards, provenance, write_hdus

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["read_coefficients", "write_coefficients"]

_SCALE = re.compile(r"SCALE_(\d+)")


def write_coefficients(
    path: str | os.PathLike[str], coefficients: WaveletCoefficients, *, overwrite: bool = False
) -> Path:
    """Write wavelet coefficients to a FITS file, complete or not at all, in full precision.

    Parameters
    ----------
    path : str or path-like
        A local file in an existing directory.
    coefficients : WaveletCoefficients
        Their parameters must be numbers, texts, booleans, None, and lists of these.
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
    ParameterError
        A parameter cannot be written.
    DataError
        An array is neither float64 nor complex128.

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
    images = [_image(name, np.asarray(values)) for name, values in arrays.items()]
    cards: Cards = [
        ("NSCALES", len(coefficients.scales), "number of wavelet scales"),
        ("PARAMS", _json(coefficients.parameters), ""),
    ]
    return write_hdus(path, images, overwrite=overwrite, cards=[*cards, *provenance()])


def read_coefficients(
    path: str | os.PathLike[str], *, max_memory: int | None = None
) -> WaveletCoefficients:
    """Read wavelet coefficients that `write_coefficients` wrote, bit for bit.

    Parameters
    ----------
    path : str or path-like
        A local file, plain or gzip.
    max_memory : int, optional
        Bytes the reading may take, 4 GiB by default; checked before any is taken.

    Returns
    -------
    WaveletCoefficients
        Equal to those written.

    Raises
    ------
    FileFormatError
        The file holds no wavelet coefficients, or is truncated or damaged.
    MemoryBudgetError
        The coefficients need more than `max_memory`.
    ParameterError
        An argument breaks its rule, or `path` is a URL.

    See Also
    --------
    write_coefficients : The inverse, with an example.
    """
    with open_guarded(path, None) as file:
        parameters = _parameters(file)
        file.check_memory(2 * sum(unit.size for unit in file.units), max_memory)
        with file.opened("ImageHDU") as images:
            arrays = {image.name: _array(file, image) for image in images}
        scales = file.keyword("NSCALES", 0)
        # A file cut between two extensions is still valid FITS: only the count tells.
        if "SCALING" not in arrays or len(arrays) - 1 != scales:
            found = f"has the extensions {list(arrays)} where NSCALES = {scales!r}"
            raise refuse(file.path, found, "give a file that write_coefficients wrote")
        scaling = arrays.pop("SCALING")
        wavelets = {_scale(file, name): values for name, values in arrays.items()}
        return WaveletCoefficients(scaling, wavelets, parameters)


def _json(parameters: Mapping[str, Any]) -> str:
    try:
        return json.dumps(dict(parameters), allow_nan=False, default=_plain_number)
    except (TypeError, ValueError) as error:
        msg = f"parameters={dict(parameters)!r} must be numbers, texts or lists of them ({error})."
        raise ParameterError(msg) from error


def _plain_number(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    msg = f"{type(value).__name__} has no JSON form"
    raise TypeError(msg)


def _image(name: str, values: NDArray[Any]) -> Any:
    from astropy.io import fits

    if values.dtype not in (np.float64, np.complex128):
        msg = f"{name.lower()} has dtype {values.dtype} but must be float64 or complex128."
        raise DataError(msg)
    is_complex = values.dtype.kind == "c"
    image = fits.ImageHDU(np.stack([values.real, values.imag]) if is_complex else values, name=name)
    image.header["PARTS"] = ("COMPLEX" if is_complex else "REAL", "real and imaginary on axis 0")
    return image


def _parameters(file: GuardedFile) -> dict[str, Any]:
    text = file.keyword("PARAMS", 0)
    # json raises ValueError on damaged text, which the guard turns into our error.
    parameters = json.loads(text) if isinstance(text, str) else None
    if not isinstance(parameters, dict):
        remedy = "give a file that write_coefficients wrote"
        raise refuse(file.path, "has no card PARAMS with parameters", remedy)
    return parameters


def _array(file: GuardedFile, hdu: Any) -> NDArray[Any]:
    if hdu.verify_datasum() != 1 or hdu.verify_checksum() != 1:
        raise refuse(file.path, f"fails the checksum of {hdu.name!r}", "fetch the file again")
    values = np.array(hdu.data, dtype=np.float64)
    if hdu.header.get("PARTS") == "REAL":
        return values
    if hdu.header.get("PARTS") != "COMPLEX" or values.shape[:1] != (2,):
        found = f"has no real and imaginary parts in {hdu.name!r}"
        raise refuse(file.path, found, "give a file that write_coefficients wrote")
    joined = np.empty(values.shape[1:], dtype=np.complex128)
    joined.real, joined.imag = values
    return joined


def _scale(file: GuardedFile, name: str) -> int:
    match = _SCALE.fullmatch(name)
    if match is None:
        found = f"has an extension {name!r} where SCALE_j is expected"
        raise refuse(file.path, found, "give a file that write_coefficients wrote")
    return int(match[1])
