r"""From HEALPix maps to coefficients, by least squares.

HEALPix has no exact quadrature, so a map's coefficients are those whose synthesis Y f fits the
map d best, the minimum over f of

.. math:: \sum_p w_p \, |d_p - (Y f)_p|^2,

with w the mask, or 1.  Conjugate gradients solve the normal equations
:math:`Y^\dagger w Y f = Y^\dagger w d` from a zero start; each step costs one synthesis and one
adjoint.  Nothing is downloaded and no quadrature weights enter.

On the whole sky :math:`(4\pi/n_{pix}) Y^\dagger Y` is nearly the identity, so that no further
preconditioning is needed; steps to a residual of 1e-10, at spins 0, 1 and 2, nside 16 to 128:

=========================  =====================
bandlimit                  steps
=========================  =====================
1.5 nside + 1              5 or 6
2 nside + 1 (the default)  6 or 7
2.5 nside + 1              11 or 12
3 nside                    50 to more than 500
=========================  =====================

A mask leaves modes that the observed pixels hardly see.  They converge slowly, a residual of
1e-3 takes tens of steps and 1e-10 is out of reach; stopping early keeps them near zero, and the
limit is the solution of smallest norm.  Ask for ``tolerance=1e-3`` or so there.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinsdw.errors import (
    ConvergenceWarning,
    DataError,
    ParameterError,
    PrecisionWarning,
)
from spinsdw.harmonics import check_integer, spin_to_eb
from spinsdw.healpix.pixels import check_nside, nested_to_ring, nside_of
from spinsdw.healpix.values import bad_pixel_mask, check_mask, clean_polarisation
from spinsdw.signals import refuse_masked

__all__ = [
    "FitOptions",
    "HealpixFit",
    "default_bandlimit",
    "map_to_flm",
    "qu_to_eb_flm",
]

FloatArray: TypeAlias = NDArray[np.float64]
ComplexArray: TypeAlias = NDArray[np.complex128]


class _LinearTransform(Protocol):
    """What the solver asks of a transform."""

    def synthesis(self, flm: ComplexArray) -> NDArray[Any]: ...

    def adjoint_synthesis(self, maps: NDArray[Any]) -> ComplexArray: ...


class FitOptions(TypedDict, total=False):
    """Keyword arguments of `map_to_flm` that other functions hand on."""

    tolerance: float
    max_iterations: int
    threads: int | None
    nest: bool


@dataclass(frozen=True)
class HealpixFit:
    """How well coefficients fit the maps they were made from; the worst map of a stack.

    Attributes
    ----------
    iterations : int
        Steps of conjugate gradients taken.
    residual : float
        Norm of the normal-equation residual ``Y^H w (d - Y f)`` relative to its start; what the
        tolerance bounds.
    map_residual : float
        Norm of ``sqrt(w) (d - Y f)`` relative to that of ``sqrt(w) d``: the share of the map that
        no coefficients below the bandlimit describe, such as noise at small scales.

    Raises
    ------
    ParameterError
        If a number is negative or not finite.
    """

    iterations: int
    residual: float
    map_residual: float

    def __post_init__(self) -> None:
        for name in ("iterations", "residual", "map_residual"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                msg = f"{name}={value} must be finite and not negative; check the map's values."
                raise ParameterError(msg)


def default_bandlimit(nside: int) -> int:
    """Return the bandlimit that suits a HEALPix map: 2 nside + 1, lmax = 2 nside.

    Parameters
    ----------
    nside : int
        HEALPix resolution.

    Returns
    -------
    int
        The bandlimit.

    Raises
    ------
    ParameterError
        If ``nside`` is not a HEALPix resolution.

    Examples
    --------
    >>> default_bandlimit(256)
    513
    """
    return 2 * check_nside(nside) + 1


def _check_bandlimit(bandlimit: int, nside: int) -> int:
    """Return the bandlimit of an analysis after comparing it with the map's resolution."""
    remedy = f"{2 * nside + 1} suits nside={nside}"
    bandlimit = check_integer(bandlimit, "bandlimit", minimum=1, remedy=remedy)
    if bandlimit > 3 * nside:
        msg = f"bandlimit={bandlimit} must not exceed 3 nside = {3 * nside}; {remedy}."
        raise ParameterError(msg)
    if bandlimit > 2.5 * nside + 1:
        msg = f"bandlimit={bandlimit} is above 2.5 nside + 1, where a fit is poor; {remedy}."
        warnings.warn(msg, PrecisionWarning, stacklevel=3)
    return bandlimit


def map_to_flm(  # noqa: PLR0913 - the map, what to fit, and the few choices of one solver
    maps: ArrayLike,
    bandlimit: int,
    spin: int = 0,
    *,
    tolerance: float = 1e-10,
    max_iterations: int = 100,
    mask: ArrayLike | None = None,
    threads: int | None = None,
    nest: bool = False,
) -> tuple[ComplexArray, HealpixFit]:
    """Fit coefficients to HEALPix maps by least squares.

    `flm_to_map` is the inverse for maps that hold no more than the bandlimit.

    Parameters
    ----------
    maps : array_like, shape (..., npix)
        Real or complex for spin 0, complex (P = Q + iU for spin 2) for other spins; any unit.
        A real map is fitted with the coefficients of a real field.
    bandlimit : int
        One more than the largest degree, up to 3 nside; see `default_bandlimit`.
    spin : int
        Spin weight of the maps.
    tolerance : float
        The fit stops when the residual of the normal equations has fallen by this factor.
    max_iterations : int
        The most steps to take.
    mask : array_like, shape (npix,), optional
        Weights in [0, 1], common to all maps.
    threads : int, optional
        Threads of the transforms.
    nest : bool
        True if maps and mask are in NESTED order.

    Returns
    -------
    flm : ndarray, shape (..., bandlimit**2), complex128
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)], unit of the maps.
    fit : HealpixFit
        Steps taken and residuals left.

    Raises
    ------
    ShapeError
        If the maps are not whole-sky maps, or the mask has another size.
    DataError
        If an observed pixel is bad, a map of spin not 0 is real, or the mask is invalid.
    ParameterError
        If bandlimit, tolerance or max_iterations are out of range.

    Warns
    -----
    ConvergenceWarning
        If max_iterations is reached before the tolerance.
    PrecisionWarning
        If the bandlimit is above ``2.5 nside + 1``.

    Examples
    --------
    >>> flm, fit = map_to_flm(np.ones(12 * 8**2), 17)
    >>> bool(abs(flm[0] - np.sqrt(4 * np.pi)) < 1e-9), fit.iterations < 10
    (True, True)
    """
    from spinsdw.ring_transform import HealpixTransform

    nside = nside_of(maps)
    bandlimit = _check_bandlimit(bandlimit, nside)
    _check_stopping(tolerance, max_iterations)
    refuse_masked(maps, "maps")
    values, weights = _observed(np.asarray(maps), mask, spin)
    if nest:
        values, weights = nested_to_ring(values), nested_to_ring(weights)
    is_real = not np.iscomplexobj(values)
    transform = HealpixTransform(nside, bandlimit, spin, real=is_real, threads=threads)
    flm, fit = _fit(transform, values, weights, tolerance, max_iterations)
    if fit.residual > tolerance:
        msg = (
            f"the fit stopped at max_iterations={max_iterations} with a residual of "
            f"{fit.residual:.1e}, above tolerance={tolerance:.1e}; change one of the two."
        )
        warnings.warn(msg, ConvergenceWarning, stacklevel=2)
    return flm, fit


def _check_stopping(tolerance: float, max_iterations: int) -> None:
    """Raise ParameterError unless the solver can stop."""
    if not 0 < tolerance < 1:
        msg = f"tolerance={tolerance} must be between 0 and 1; 1e-10 suits a map of the whole sky."
        raise ParameterError(msg)
    check_integer(max_iterations, "max_iterations", minimum=1, remedy="100 is the default")


def _observed(
    maps: NDArray[Any], mask: ArrayLike | None, spin: int
) -> tuple[NDArray[Any], FloatArray]:
    """Return maps that are zero outside the mask, and the weights; refuse bad observed pixels."""
    if maps.dtype.kind not in ("c" if spin else "buifc"):
        msg = f"maps of spin={spin} have dtype {maps.dtype} but must be complex; give Q + iU."
        raise DataError(msg)
    shape = maps.shape[-1:]
    weights = check_mask(np.ones(shape) if mask is None else mask, shape)
    count = np.count_nonzero(bad_pixel_mask(maps) & (weights > 0))
    if count:
        msg = f"maps hold {count} bad values at observed pixels, where none may be; mask them."
        raise DataError(msg)
    dtype = np.complex128 if np.iscomplexobj(maps) else np.float64
    return np.where(weights > 0, maps, 0).astype(dtype), weights


def _fit(
    transform: _LinearTransform,
    maps: NDArray[Any],
    weights: FloatArray,
    tolerance: float,
    max_iterations: int,
) -> tuple[ComplexArray, HealpixFit]:
    """Solve the weighted normal equations by conjugate gradients (CGLS), each map on its own.

    The residual is carried in the map, not in the normal equations: the condition number enters
    once instead of squared.
    """
    remainder = maps.copy()
    direction = gradient = transform.adjoint_synthesis(weights * remainder)
    flm = np.zeros_like(gradient)
    start = power = _power(gradient)
    iterations = 0
    while iterations < max_iterations and np.any(power > tolerance**2 * start):
        # A map that has converged stands still, so that its result is the same in any stack.
        active = power > tolerance**2 * start
        change = transform.synthesis(direction)
        step = np.where(active, _ratio(power, _power(change, weights)), 0)[..., None]
        flm += step * direction
        remainder -= step * change
        gradient = transform.adjoint_synthesis(weights * remainder)
        previous, power = power, np.where(active, _power(gradient), power)
        direction = gradient + _ratio(power, previous)[..., None] * direction
        iterations += 1
    residual = np.sqrt(np.max(_ratio(power, start)))
    left = np.sqrt(np.max(_ratio(_power(remainder, weights), _power(maps, weights))))
    return flm, HealpixFit(iterations, float(residual), float(left))


def _power(values: NDArray[Any], weights: FloatArray | float = 1.0) -> FloatArray:
    """Return the weighted sum of |values|**2 along the last axis."""
    squares = values.real**2 + values.imag**2
    return np.asarray(np.sum(weights * squares, axis=-1))


def _ratio(above: FloatArray, below: FloatArray) -> FloatArray:
    """Divide, taking 0 / 0 as 0: a map of zeros has nothing left to fit."""
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0)


def qu_to_eb_flm(
    q: ArrayLike,
    u: ArrayLike,
    bandlimit: int,
    *,
    mask: ArrayLike | None = None,
    **options: Unpack[FitOptions],
) -> tuple[ComplexArray, ComplexArray, HealpixFit]:
    """Fit the coefficients of E and B to Stokes Q and U on HEALPix.

    `spinsdw.healpix.clean_polarisation` is applied first: UNSEEN pixels are masked, NaN values
    are an error.  On a masked sky this fit does not separate E from B.

    Parameters
    ----------
    q, u : array_like, shape (npix,)
        Stokes parameters, COSMO frame, any unit.
    bandlimit : int
        One more than the largest degree; see `default_bandlimit`.
    mask : array_like, shape (npix,), optional
        Weights in [0, 1].
    **options
        The other keyword arguments of `map_to_flm`.

    Returns
    -------
    e_flm, b_flm : ndarray, shape (bandlimit**2,), complex128
        Coefficients of the real fields E and B, healpy's sign.
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]
    fit : HealpixFit
        Steps taken and residuals left.

    Raises
    ------
    ShapeError, DataError, ParameterError
        As `map_to_flm` and `spinsdw.healpix.clean_polarisation` do.

    Examples
    --------
    >>> from spinsdw.healpix import pixel_directions
    >>> colatitudes, _ = pixel_directions(8)
    >>> q, u = np.sin(colatitudes) ** 2, np.zeros(12 * 8**2)
    >>> e_flm, b_flm, fit = qu_to_eb_flm(q, u, 17)
    >>> bool(np.isclose(e_flm[6], -np.sqrt(32 * np.pi / 15))), bool(np.allclose(b_flm, 0))
    (True, True)
    """
    q_clean, u_clean, weights = clean_polarisation(q, u, mask)
    polarisation = q_clean + 1j * u_clean
    flm, fit = map_to_flm(polarisation, bandlimit, 2, mask=weights, **options)
    e_flm, b_flm = spin_to_eb(flm)
    return e_flm, b_flm, fit
