"""HEALPix maps: the only part of the package that knows them from the inside.

`pixels` holds resolution and order, `values` the bad-pixel policy, masks' checks and the
polarisation frame, `alm` healpy's coefficient order, `fitting` the way from maps to coefficients
and `quadrature` that of maps without a bandlimit, `grids` the way back and the ways to and from
exact grids, `coefficients` shows wavelet coefficients at the pixels.
"""

from __future__ import annotations

from spinsdw.healpix.alm import (
    alm_to_flm,
    eb_alm_to_spin_flm,
    flm_to_alm,
    spin_flm_to_eb_alm,
)
from spinsdw.healpix.coefficients import coefficients_to_healpix
from spinsdw.healpix.fitting import (
    FitOptions,
    HealpixFit,
    default_bandlimit,
    map_to_flm,
    qu_to_eb_flm,
)
from spinsdw.healpix.grids import flm_to_map, healpix_to_mw, mw_to_healpix
from spinsdw.healpix.pixels import (
    check_nside,
    degrade_map,
    nested_to_ring,
    nside_of,
    pixel_at,
    pixel_directions,
    ring_to_nested,
    upgrade_map,
)
from spinsdw.healpix.quadrature import pixel_weights, quadrature_flm
from spinsdw.healpix.values import (
    UNSEEN,
    bad_pixel_mask,
    check_mask,
    clean_polarisation,
    convert_polconv,
)

__all__ = [
    "UNSEEN",
    "FitOptions",
    "HealpixFit",
    "alm_to_flm",
    "bad_pixel_mask",
    "check_mask",
    "check_nside",
    "clean_polarisation",
    "coefficients_to_healpix",
    "convert_polconv",
    "default_bandlimit",
    "degrade_map",
    "eb_alm_to_spin_flm",
    "flm_to_alm",
    "flm_to_map",
    "healpix_to_mw",
    "map_to_flm",
    "mw_to_healpix",
    "nested_to_ring",
    "nside_of",
    "pixel_at",
    "pixel_directions",
    "pixel_weights",
    "qu_to_eb_flm",
    "quadrature_flm",
    "ring_to_nested",
    "spin_flm_to_eb_alm",
    "upgrade_map",
]
