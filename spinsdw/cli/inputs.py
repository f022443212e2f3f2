"""Read what a separation works on: Stokes maps without bad pixels, and a mask of their size."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spinsdw.cli.requests import MapRequest, MaskRequest, shown
from spinsdw.errors import FileFormatError, ParameterError
from spinsdw.healpix import clean_polarisation, nside_of
from spinsdw.maps_io import PolarisationMaps, read_map, read_mask, read_polarisation
from spinsdw.maps_io.layout import UNKNOWN
from spinsdw.masks import degrade, fill_holes, galactic_cut, sky_fraction, upgrade

__all__ = ["Inputs", "read_inputs"]

Array = np.ndarray[Any, Any]

FRAMES = {"G": "galactic", "E": "ecliptic", "C": "equatorial"}


@dataclass(frozen=True, eq=False)
class Inputs:
    """What a separation works on.

    Attributes
    ----------
    maps : PolarisationMaps
        As read: RING order, COSMO, with their labels.
    q, u : ndarray, shape (12 * nside**2,), float64
        The same with zeros at bad pixels.
    mask : ndarray, same shape, or None
        0 where masked or bad; None if the whole sky is used.
    facts : dict of str to str
        What was read, for the summary.
    """

    maps: PolarisationMaps
    q: Array
    u: Array
    mask: Array | None
    facts: dict[str, str]


def read_inputs(
    wanted: MapRequest, wanted_mask: MaskRequest, *, max_memory: int | None = None
) -> Inputs:
    """Read the maps and the mask, and bring the mask to the maps' size.

    Parameters
    ----------
    wanted : MapRequest
        The maps.
    wanted_mask : MaskRequest
        The mask.
    max_memory : int, optional
        Bytes that reading one file may take.

    Returns
    -------
    Inputs
        In RING order.

    Raises
    ------
    FileFormatError, MemoryBudgetError, DataError
        As the readers of `spinsdw.maps_io` and `spinsdw.healpix.clean_polarisation` do.
    ParameterError
        If the mask, or the cut, is not in the maps' coordinates.
    """
    maps = read_polarisation(
        wanted.paths[0] if len(wanted.paths) == 1 else wanted.paths,
        columns=_columns(wanted.columns),
        ordering=wanted.ordering,
        polconv=wanted.polconv,
        unit=wanted.unit,
        coordinates=wanted.coordinates,
        max_memory=max_memory,
    )
    given, origin = _mask(wanted_mask, maps, max_memory)
    cleaning: dict[str, Any] = {"bad_pixels": wanted.bad_pixels, "sentinel": maps.sentinel}
    q, u, weights = clean_polarisation(maps.q, maps.u, given, **cleaning)
    lost = np.count_nonzero((weights == 0) & (given > 0 if given is not None else True))
    facts = _map_facts(wanted, maps) | {"mask": origin}
    if lost:
        facts["bad pixels"] = f"{lost} pixels of the maps hold no measurement and were masked"
    facts["sky"] = f"{sky_fraction(weights):.1%} observed"
    return Inputs(maps, q, u, None if np.all(weights == 1) else weights, facts)


def _columns(columns: Any) -> Any:
    """Return one column by itself, as the reader wants it for a pair of files."""
    return columns[0] if isinstance(columns, tuple) and len(columns) == 1 else columns


def _file_name(path: object) -> str:
    # The name alone: the facts go into files, where a user's folders are nobody's business.
    return shown(Path(str(path)).name)


def _map_facts(wanted: MapRequest, maps: PolarisationMaps) -> dict[str, str]:
    names = [_file_name(path) for path in wanted.paths]
    q_column, u_column = (shown(name) for name in maps.columns)
    if len(names) == 1:
        facts = {"Q, U": f"{names[0]}, columns {q_column} and {u_column}"}
    else:
        facts = {"Q": f"{names[0]}, column {q_column}", "U": f"{names[1]}, column {u_column}"}
    frame = FRAMES.get(maps.coordinates, shown(maps.coordinates))
    unit = "unit unknown" if maps.unit == UNKNOWN else shown(maps.unit)
    where = "coordinates unknown" if frame == UNKNOWN else f"{frame} coordinates"
    facts["maps"] = f"nside {maps.nside}, {unit}, {where}, {maps.polconv} convention"
    return facts


def _mask(
    wanted: MaskRequest, maps: PolarisationMaps, max_memory: int | None
) -> tuple[Array | None, str]:
    """Return the mask at the maps' nside, or None for the whole sky, and where it comes from."""
    if wanted.galactic_cut is not None:
        if maps.coordinates != "G":
            msg = (
                f"galactic_cut={wanted.galactic_cut} needs maps in galactic coordinates, not in "
                f"{maps.coordinates!r}; give a mask, or coordinates='G' if the header lacks it."
            )
            raise ParameterError(msg)
        cut = galactic_cut(maps.nside, np.radians(wanted.galactic_cut))
        return cut, f"galactic latitudes below {wanted.galactic_cut:g} degrees cut"
    if wanted.path is None:
        return None, "none, the whole sky"
    _check_frame(wanted, maps, max_memory)
    mask = read_mask(
        wanted.path, column=wanted.column, ordering=wanted.ordering, max_memory=max_memory
    )
    name = _file_name(wanted.path)
    if wanted.fill_holes is not None:
        mask = fill_holes(mask, wanted.fill_holes * np.radians(1) ** 2)
        name = f"{name}, holes up to {wanted.fill_holes:g} square degrees filled"
    resized, change = _resized(mask, maps.nside)
    return resized, f"{name}, {change}"


def _check_frame(wanted: MaskRequest, maps: PolarisationMaps, max_memory: int | None) -> None:
    """Raise FileFormatError if maps and mask say that they are in different coordinates."""
    path, stated = str(wanted.path), {"column": wanted.column, "ordering": wanted.ordering}
    found = read_map(path, **stated, max_memory=max_memory).coordinates  # type: ignore[arg-type]
    if UNKNOWN not in {found, maps.coordinates} and found != maps.coordinates:
        msg = (
            f"path={path!r} is a mask in coordinates {found!r} for maps in "
            f"{maps.coordinates!r}; rotate the mask."
        )
        raise FileFormatError(msg)


def _resized(mask: Array, nside: int) -> tuple[Array, str]:
    own = nside_of(mask)
    if own == nside:
        return mask, f"nside {own}"
    if own < nside:
        return upgrade(mask, nside), f"upgraded from nside {own} to {nside}"
    if np.all((mask == 0) | (mask == 1)):
        rule = "a pixel is kept if half of it was"
        return degrade(mask, nside), f"degraded from nside {own} to {nside} ({rule})"
    return degrade(mask, nside, threshold=None), f"averaged from nside {own} to {nside}"
