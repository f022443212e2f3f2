"""Which pixel values can be used: bad pixels, masks, and the frame of the polarisation.

One policy for the whole package.  A mask is an argument of its own, 1 where the sky is observed
and 0 where it is not; it is never inferred from values inside a transform, which would make the
transform nonlinear.  Values that are no measurement are found here, once, before anything else.

==============================  ==========================================================
a pixel of Q or U holds         `clean_polarisation` does
==============================  ==========================================================
UNSEEN or the given sentinel    sets Q, U and the mask to zero there
NaN or infinity, mask is zero   sets Q and U to zero there
NaN or infinity, observed       raises DataError, or as for UNSEEN if ``bad_pixels="mask"``
a finite value, mask is zero    sets Q and U to zero there
==============================  ==========================================================
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.signals import refuse_masked

__all__ = [
    "UNSEEN",
    "bad_pixel_mask",
    "check_mask",
    "clean_polarisation",
    "convert_polconv",
]

FloatArray: TypeAlias = NDArray[np.float64]

UNSEEN = -1.6375e30
"""The value that marks an unobserved pixel in HEALPix files."""

SENTINEL_TOLERANCE = 1e-5  # storage as float32 moves a sentinel by up to 6e-8


def bad_pixel_mask(values: ArrayLike, sentinel: float | None = None) -> NDArray[np.bool_]:
    """Find the pixels whose value is no measurement.

    Bad is: not finite, or within 1e-5 (relative) of `UNSEEN`, or of ``sentinel``.

    Parameters
    ----------
    values : array_like
        Real or complex values of any shape; a complex value is bad if either part is.
    sentinel : float, optional
        A further value that marks bad pixels, such as a file's BAD_DATA.

    Returns
    -------
    ndarray of bool, same shape
        True where the pixel is bad.

    Examples
    --------
    >>> bad_pixel_mask([1.0, np.nan, -1.6375e30, -99.0], sentinel=-99.0).tolist()
    [False, True, True, True]
    """
    array = np.asarray(values)
    if np.iscomplexobj(array):
        return bad_pixel_mask(array.real, sentinel) | bad_pixel_mask(array.imag, sentinel)
    bad: NDArray[np.bool_] = ~np.isfinite(array)
    for marker in (UNSEEN,) if sentinel is None else (UNSEEN, sentinel):
        bad |= _is_near(array, marker)
    return bad


def _is_near(array: NDArray[Any], marker: float) -> NDArray[np.bool_]:
    """Return where ``array`` equals ``marker`` to the tolerance of a sentinel."""
    width = SENTINEL_TOLERANCE * abs(marker)
    return (array >= marker - width) & (array <= marker + width)


def check_mask(mask: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Return a mask as float64 weights after checking it.

    Parameters
    ----------
    mask : array_like of bool or real
        1 where the sky is observed, 0 where it is not, between the two on an apodised edge.
    shape : tuple of int
        The shape the mask must have.

    Returns
    -------
    ndarray, shape ``shape``, float64
        A fresh array.

    Raises
    ------
    ShapeError
        If the shape differs.
    DataError
        If a value is not a number in [0, 1], or all are zero.

    Examples
    --------
    >>> check_mask([True, False], (2,)).tolist()
    [1.0, 0.0]
    """
    refuse_masked(mask, "mask")
    array = np.asarray(mask)
    if array.shape != tuple(shape):
        msg = f"mask has shape {array.shape} but must have {tuple(shape)}, one weight per pixel."
        raise ShapeError(msg)
    if array.dtype.kind not in "buif":
        msg = f"mask has dtype {array.dtype} but must be bool or real, with values in [0, 1]."
        raise DataError(msg)
    weights = np.array(array, dtype=np.float64)
    outside = np.count_nonzero(~((weights >= 0) & (weights <= 1)))
    if outside:
        msg = f"mask has {outside} values outside [0, 1]; 1 means observed and 0 means masked."
        raise DataError(msg)
    if not weights.any():
        msg = f"mask is zero at all {weights.size} pixels and must observe some; is it inverted?"
        raise DataError(msg)
    return weights


def clean_polarisation(
    q: ArrayLike,
    u: ArrayLike,
    mask: ArrayLike | None = None,
    *,
    bad_pixels: Literal["raise", "mask"] = "raise",
    sentinel: float | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Apply the bad-pixel policy of the package to Stokes Q and U, jointly.

    A pixel bad in Q or in U is bad in both.  `UNSEEN` and ``sentinel`` say "not observed": such
    pixels are masked.  NaN and infinities say "something went wrong": they are an error, unless
    the mask hides them already or ``bad_pixels="mask"``.

    Parameters
    ----------
    q, u : array_like, real, one shape
        Stokes parameters, any unit.
    mask : array_like of bool or real in [0, 1], same shape, optional
        1 where observed; everywhere by default.
    bad_pixels : {"raise", "mask"}
        What to do with NaN and infinities at observed pixels.
    sentinel : float, optional
        A further value that means "not observed".

    Returns
    -------
    q, u, mask : ndarray, float64
        Fresh arrays; Q, U and the mask are zero at bad pixels, Q and U also where the mask was.

    Raises
    ------
    ShapeError
        If the shapes differ.
    DataError
        If Q or U is not real, holds NaN or infinities, or no pixel remains.
    ParameterError
        If ``bad_pixels`` is not one of its two values.

    Examples
    --------
    >>> q, u, mask = clean_polarisation([1.0, UNSEEN], [2.0, 3.0])
    >>> q.tolist(), u.tolist(), mask.tolist()
    ([1.0, 0.0], [2.0, 0.0], [1.0, 0.0])
    """
    if bad_pixels not in ("raise", "mask"):
        msg = f"bad_pixels={bad_pixels!r} must be 'raise' or 'mask'; 'raise' stops at NaN values."
        raise ParameterError(msg)
    q_values, u_values = _real_values(q, "q"), _real_values(u, "u")
    if q_values.shape != u_values.shape:
        msg = f"q has shape {q_values.shape} and u {u_values.shape}, which must be the same."
        raise ShapeError(msg)
    given = np.ones(q_values.shape) if mask is None else mask
    weights = check_mask(given, q_values.shape)
    if bad_pixels == "raise":
        _refuse_non_finite(q_values, u_values, weights)
    weights[bad_pixel_mask(q_values, sentinel) | bad_pixel_mask(u_values, sentinel)] = 0
    observed = check_mask(weights, weights.shape) > 0
    return np.where(observed, q_values, 0.0), np.where(observed, u_values, 0.0), weights


def _real_values(values: ArrayLike, name: str) -> FloatArray:
    """Return real input as native float64, or raise DataError."""
    refuse_masked(values, name)
    array = np.asarray(values)
    if array.dtype.kind not in "buif":
        msg = f"{name} has dtype {array.dtype} but must be real; give Q and U as two arrays."
        raise DataError(msg)
    return array.astype(np.float64)


def _refuse_non_finite(q: FloatArray, u: FloatArray, weights: FloatArray) -> None:
    """Raise DataError if an observed pixel is NaN or infinite."""
    count = np.count_nonzero(~(np.isfinite(q) & np.isfinite(u)) & (weights > 0))
    if count:
        msg = (
            f"{count} observed pixels of q or u are NaN or infinite and must be finite; "
            "set the mask to 0 there, or pass bad_pixels='mask' to clean_polarisation."
        )
        raise DataError(msg)


def convert_polconv(
    q: ArrayLike, u: ArrayLike, source: str, target: str
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Convert Stokes Q and U between the COSMO and IAU polarisation frames.

    HEALPix (COSMO) takes x to the south, y to the east and z outwards; the IAU takes x to the
    north, y to the east and z inwards.  Only the sign of U differs.  A bad pixel keeps its value:
    a sentinel with its sign turned would no longer be recognised.

    Parameters
    ----------
    q, u : array_like
        Stokes parameters in the ``source`` frame.
    source, target : {"COSMO", "IAU"}
        Values of the POLCCONV keyword, in either case.

    Returns
    -------
    q, u : ndarray
        Fresh arrays in the ``target`` frame.

    Raises
    ------
    ParameterError
        If a convention is neither COSMO nor IAU.

    Examples
    --------
    >>> q, u = convert_polconv([1.0], [2.0], "IAU", "COSMO")
    >>> float(q[0]), float(u[0])
    (1.0, -2.0)
    """
    names = [str(name).strip().upper() for name in (source, target)]
    for name in names:
        if name not in ("COSMO", "IAU"):
            msg = f"polarisation convention {name!r} must be COSMO or IAU; HEALPix uses COSMO."
            raise ParameterError(msg)
    turned = np.array(u)
    if names[0] != names[1]:
        turned = np.where(bad_pixel_mask(turned), turned, -turned)
    return np.array(q), turned
