"""Maps and wavelet coefficients in files: the only part of the package that opens FITS and Zarr.

`guard` holds a file's promises against its length, `layout` the header of a HEALPix table,
`reading` and `writing` go between files and arrays in RING order, `coefficients` keeps wavelet
coefficients, `store` is their Zarr form, `grid_maps` has the maps of exact grids,
`harmonics` coefficients as healpy keeps them.
"""

from __future__ import annotations

from spinsdw.maps_io.coefficients import read_coefficients, write_coefficients
from spinsdw.maps_io.grid_maps import read_grid_map, write_grid_map
from spinsdw.maps_io.harmonics import read_flm, write_flm
from spinsdw.maps_io.reading import (
    HealpixMap,
    PolarisationMaps,
    read_map,
    read_mask,
    read_polarisation,
)
from spinsdw.maps_io.writing import write_maps

__all__ = [
    "HealpixMap",
    "PolarisationMaps",
    "read_coefficients",
    "read_flm",
    "read_grid_map",
    "read_map",
    "read_mask",
    "read_polarisation",
    "write_coefficients",
    "write_flm",
    "write_grid_map",
    "write_maps",
]
