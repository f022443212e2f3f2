"""What users hand to a separation, checked: masks, inverse noise, beams, stacks of Q and U."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.healpix import check_mask, clean_polarisation, nested_to_ring, nside_of
from spinsdw.sampling import MW, MWSS
from spinsdw.separation.skies import GridSky, HealpixSky, sky_of
from spinsdw.signals import refuse_masked
from spinsdw.simulation import gaussian_beam

__all__ = [
    "check_beam",
    "check_inverse_noise",
    "check_largest_share",
    "check_spectrum",
    "combine_masks",
    "observed_stack",
    "sky_of_stack",
]

Array = np.ndarray[Any, Any]
AnySky = HealpixSky | GridSky


def combine_masks(mask: object) -> Array:
    """Return one mask, in [0, 1] and read-only: a tuple or list of masks is multiplied.

    Raises
    ------
    ShapeError
        If the masks differ in shape.
    DataError
        If a mask has entries outside [0, 1], or together they leave nothing.
    """
    many = isinstance(mask, list | tuple) and any(np.ndim(one) > 0 for one in mask)
    masks: Sequence[object] = mask if many else (mask,)  # type: ignore[assignment]
    product = np.ones(())
    for one in masks:
        refuse_masked(one, "mask")
        values = np.asarray(one)
        if product.ndim > 0 and values.shape != product.shape:
            msg = f"mask holds masks of shapes {product.shape} and {values.shape}; make them alike."
            raise ShapeError(msg)
        product = product * check_mask(values, values.shape)
    product = check_mask(product, product.shape)
    product.setflags(write=False)
    return product


def check_largest_share(value: object) -> float:
    """Return the share of a wavelet's energy in the hole from which its coefficient is dropped."""
    if not isinstance(value, int | float | np.number) or not 0 < value <= 1:
        msg = f"largest_share={value!r} must be a share of energy in (0, 1]; 0.2 is usual."
        raise ParameterError(msg)
    return float(value)


def check_inverse_noise(values: object, shape: tuple[int, ...] | None) -> Array:
    """Return inverse noise variances, not negative and read-only."""
    refuse_masked(values, "inverse_noise")
    weights = np.array(values, dtype=np.float64)
    if shape is not None and weights.shape != shape:
        msg = f"inverse_noise has shape {weights.shape} but the mask {shape}; make them alike."
        raise ShapeError(msg)
    bad = np.count_nonzero(~(np.isfinite(weights) & (weights >= 0)))
    if bad or not weights.any():
        found = f"{bad} values that are negative or not finite" if bad else "only zeros"
        msg = f"inverse_noise holds {found}; give 1 / sigma^2, and 0 where nothing was observed."
        raise DataError(msg)
    weights.setflags(write=False)
    return weights


def check_beam(beam: object, bandlimit: int) -> Array:
    """Return the window function b_l, shape (bandlimit,), of a width or of a window function."""
    if beam is None:
        return np.ones(bandlimit)
    if np.ndim(beam) == 0:  # type: ignore[arg-type]
        return gaussian_beam(float(beam), bandlimit)  # type: ignore[arg-type]
    window = np.array(beam, dtype=np.float64)
    if window.ndim != 1 or window.size < bandlimit:
        msg = f"beam has shape {window.shape}; it must hold b_l for l = 0 to {bandlimit - 1}."
        raise ShapeError(msg)
    window = window[:bandlimit]
    if not np.all(np.isfinite(window) & (window >= 0)):
        msg = "beam holds values that are negative or not finite; a window function is neither."
        raise DataError(msg)
    return window


def check_spectrum(values: object, bandlimit: int) -> Array:
    """Return C_l for l = 0 to bandlimit - 1 of a power spectrum that may be longer."""
    spectrum = np.array(values, dtype=np.float64)
    if spectrum.ndim != 1 or spectrum.size < bandlimit:
        msg = f"spectrum has shape {spectrum.shape}; it must hold C_l for l = 0 to {bandlimit - 1}."
        raise ShapeError(msg)
    return spectrum[:bandlimit]


def _map_axes(values: Array, shape: tuple[int, ...] | None, bandlimit: int | None) -> int:
    """Return how many of the last axes are those of one map: 1 on HEALPix, 2 on a grid."""
    if shape is not None:
        return len(shape)
    if values.ndim >= 2:
        rings, phis = values.shape[-2:]
        for sampling, limit in ((MW, rings), (MWSS, rings - 1)):
            fits = limit >= 1 and sampling(limit).shape == (rings, phis)
            is_finer = bandlimit is not None and bandlimit < limit and not _is_healpix(phis)
            if fits and (bandlimit in {None, limit} or is_finer):
                return 2
    # A stack of HEALPix maps, or a shape that no sky has: told by the check of the sky.
    return 1 if values.ndim >= 2 and _is_healpix(values.shape[-1]) else min(values.ndim, 2)


def _is_healpix(pixels: int) -> bool:
    try:
        nside_of(np.empty(pixels))
    except ShapeError:
        return False
    return True


def sky_of_stack(
    q: Array, mask: Array | None, bandlimit: int | None, threads: int | None
) -> AnySky:
    """Return the sky a stack of maps is on; the mask's, if there is one."""
    if mask is not None and q.shape[-mask.ndim :] != mask.shape:
        msg = f"q has shape {q.shape} but the mask {mask.shape}; they must be alike."
        raise ShapeError(msg)
    axes = _map_axes(q, None if mask is None else mask.shape, bandlimit)
    one = np.broadcast_to(0.0, q.shape[q.ndim - axes :])
    return sky_of(one, bandlimit, name="q", threads=threads)


def observed_stack(q: Array, u: Array, mask: Array | None, *, nest: bool) -> Array:
    """Return P = Q + iU of a stack in ring order, shape (batch, *map), zero where masked.

    Raises
    ------
    DataError
        If a pixel where the mask is not 0 is UNSEEN, NaN or infinite, or Q or U is complex.
    """
    maps = [_one_map(one_q, one_u, mask, nest=nest) for one_q, one_u in zip(q, u, strict=True)]
    return np.array(maps)


def _one_map(q: Array, u: Array, mask: Array | None, *, nest: bool) -> Array:
    if nest and q.ndim == 1:
        q, u = nested_to_ring(q), nested_to_ring(u)
    cleaned_q, cleaned_u, found = clean_polarisation(q, u, mask)
    given = np.ones(q.shape) if mask is None else mask
    lost = np.count_nonzero((found == 0) & (given > 0))
    if lost:
        msg = (
            f"q and u are not observed at {lost} pixels where the mask is not 0; set the mask to 0 "
            "there and make a separator with it."
        )
        raise DataError(msg)
    return cleaned_q + 1j * cleaned_u
