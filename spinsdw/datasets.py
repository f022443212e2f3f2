"""The small public data sets that come with the package: where they are, and the theory spectra.

The files, their origin and their traps are described in ``spinsdw/data/README.md``.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from spinsdw.errors import FileFormatError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["planck2018_spectra", "wmap_mask_path", "wmap_synchrotron_paths"]

_SYNCHROTRON = "wmap_mcmc_base_k_synch_stk_{stokes}_9yr_v5.fits"
_MASK = "wmap_temperature_analysis_mask_r9_7yr_v4_udgraded32.fits"
_SPECTRA = "planck2018_cls.txt"


def _data_path(name: str) -> Path:
    path = Path(str(files("spinsdw").joinpath("data", name)))
    if not path.is_file():
        msg = (
            f"data file {str(path)!r} must be a plain file of the installed package; "
            "install spinsdw unpacked, not as a zip archive."
        )
        raise FileFormatError(msg)
    return path


def wmap_synchrotron_paths() -> tuple[Path, Path]:
    """Return the paths of the WMAP nine-year synchrotron Stokes Q and U maps at K band.

    Each is a HEALPix map, nside 64, NESTED, galactic, smoothed to one degree. It is a foreground,
    not the CMB. The headers state neither the unit nor the polarisation convention, so a
    reader has to be told, as below.

    Returns
    -------
    tuple of Path
        The file of Q and the file of U.

    Raises
    ------
    FileFormatError
        The package data are not there as plain files.

    See Also
    --------
    spinsdw.maps_io.read_polarisation : Reads the pair.

    Examples
    --------
    >>> from spinsdw.maps_io import read_polarisation
    >>> stated = {"unit": "mK_RJ", "polconv": "COSMO"}
    >>> maps = read_polarisation(wmap_synchrotron_paths(), columns="BESTFIT", **stated)
    >>> maps.nside
    64
    """
    return _data_path(_SYNCHROTRON.format(stokes="q")), _data_path(_SYNCHROTRON.format(stokes="u"))


def wmap_mask_path() -> Path:
    """Return the path of the WMAP seven-year temperature analysis mask.

    A HEALPix map, nside 32, RING, of zeros (masked) and ones (kept).

    Returns
    -------
    Path
        The file of the mask.

    Raises
    ------
    FileFormatError
        The package data are not there as a plain file.

    Examples
    --------
    >>> from spinsdw.maps_io import read_mask
    >>> round(float(read_mask(wmap_mask_path()).mean()), 4)
    0.6187
    """
    return _data_path(_MASK)


@cache
def planck2018_spectra() -> Mapping[str, NDArray[np.float64]]:
    """Return the angular power spectra of the Planck 2018 LCDM model.

    ``TT_lensed``, ``EE_lensed``, ``BB_lensed`` and ``TE_lensed`` are the lensed scalar spectra,
    ``TT_unlensed``, ``EE_unlensed`` and ``TE_unlensed`` those before lensing (their B is zero), and
    ``TT_tensor``, ``EE_tensor``, ``BB_tensor`` and ``TE_tensor`` the tensor spectra for r = 1.

    Returns
    -------
    mapping of str to ndarray, shape (2049,), float64
        C_l in uK^2 (not l (l + 1) C_l / 2 pi) for the degrees 0 to 2048; zero at degrees 0 and 1.
        Neither the mapping nor its arrays can be changed.

    Raises
    ------
    FileFormatError
        The package data are not there as a plain file.

    Examples
    --------
    The power l (l + 1) C_l / 2 pi of E at l = 1000, in uK^2:

    >>> spectra = planck2018_spectra()
    >>> degree = 1000
    >>> round(float(degree * (degree + 1) * spectra["EE_lensed"][degree] / (2 * np.pi)), 2)
    42.11
    """
    path = _data_path(_SPECTRA)
    with path.open(encoding="ascii") as lines:
        next(lines)
        names = next(lines).removeprefix("#").split()
        table = np.loadtxt(lines, unpack=True)
    table.flags.writeable = False
    return MappingProxyType(dict(zip(names[1:], table[1:], strict=True)))
