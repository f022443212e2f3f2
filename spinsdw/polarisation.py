"""`EBSeparator`: E and B maps from Q and U on the full or the masked sky."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, get_args

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import check_bandlimit, multiply_by_degree, polarisation_factor
from spinsdw.healpix import (
    HealpixFit,
    check_mask,
    check_nside,
    clean_polarisation,
    nested_to_ring,
    ring_to_nested,
)
from spinsdw.separation.pseudo import PseudoMethod
from spinsdw.separation.report import Clock, check_choice
from spinsdw.separation.skies import GridSky, HealpixSky, position_map, sky_of
from spinsdw.signals import check_flag, refuse_masked
from spinsdw.tiling import ScaleDiscretisedTiling
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["EBMaps", "EBSeparator", "SeparationInfo"]

Array = np.ndarray[Any, Any]
Output = Literal["fields", "derivatives", "potentials"]

# Every method is one file of spinsdw.separation; it turns the wavelet coefficients of the masked
# map into those that are synthesised, and says how far each was kept.
_METHODS = {"pseudo": PseudoMethod}
_DEFAULT_LOWEST_SCALE = 2


@dataclass(frozen=True)
class SeparationInfo:
    """What a separation did and how well it went.

    Attributes
    ----------
    method : str
        Name of the estimator.
    bandlimit : int
        Degrees used are below it.
    scales : tuple of int
        The wavelet scales.
    sky_fraction : float
        Mean of the mask over the sphere.
    kept_fraction : dict
        Mean weight over the sphere of the coefficients of each scale, and of the scaling part.
    fit : HealpixFit or None
        How well harmonic coefficients fit a HEALPix map; None on grids, where they are exact.
    seconds : dict of str to float
        Wall time of each step.
    """

    method: str
    bandlimit: int
    scales: tuple[int, ...]
    sky_fraction: float
    kept_fraction: Mapping[int | str, float]
    fit: HealpixFit | None
    seconds: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class EBMaps:
    """E and B maps with their weights.

    Attributes
    ----------
    E, B : ndarray, float64
        The maps, pixelised as Q and U, in their unit (for ``output="fields"``).
    weight : ndarray, float64
        Where to trust the maps, from 0 to 1: the weights of all scales, each counted with the
        power its weighted coefficients have left. A scale dropped everywhere does not count.
    weights : mapping of int to ndarray
        The same for every scale.
    coefficients : WaveletCoefficients
        The weighted spin-2 wavelet coefficients: -Re is E, -Im is B.
    info : SeparationInfo
        What was done.
    """

    E: Array
    B: Array
    weight: Array
    weights: Mapping[int, Array]
    coefficients: WaveletCoefficients = field(repr=False)
    info: SeparationInfo


@dataclass(frozen=True, eq=False)
class EBSeparator:
    """Separate Q and U into E and B with spin wavelets.

    Parameters
    ----------
    bandlimit : int or None, optional
        L: degrees are l < L. None takes it from the mask: 2 nside + 1 on HEALPix, the grid's own
        on MW and MWSS.
    mask : ndarray, optional
        1 where observed, 0 where not: HEALPix (1-D) or an MW or MWSS map (2-D). None: full sky.
    method : str, default "pseudo"
        The estimator; "pseudo" weighs wavelet coefficients by the share of their energy in holes.
    directions : int, default 1
        N of the wavelets.
    dilation : float, default 2.0
        Ratio of neighbouring scales.
    lowest_scale : int, default 2, or the highest scale if that is lower
        Structures larger than scale J0 belong to the scaling part.
    taper : float, default 0.2
        Share of its energy in the hole, in (0, 1], at which a coefficient is dropped.
    output : {"fields", "derivatives", "potentials"}, default "fields"
        E and B; or N_l E_lm and N_l B_lm, second derivatives of Q and U; or E_lm / N_l and
        B_lm / N_l; N_l = sqrt((l+2)! / (l-2)!).
    nest : bool, default False
        Whether HEALPix maps and mask are in nested order.
    threads : int, optional
        Threads to use; all cores when None.

    Notes
    -----
    Q and U are in the COSMO frame (HEALPix's own). What depends on the mask only is computed at the
    first separation and kept.

    Examples
    --------
    >>> import numpy as np
    >>> from spinsdw.sampling import MW
    >>> q = np.sin(MW(16).colatitudes)[:, None] ** 2 * np.ones(31)
    >>> maps = EBSeparator(16).separate(q, 0 * q)
    >>> maps.E.shape
    (16, 31)
    >>> bool(np.abs(maps.B).max() < 1e-13 * np.abs(maps.E).max())
    True
    """

    bandlimit: int | None = None
    mask: Array | None = None
    method: str = "pseudo"
    directions: int = 1
    dilation: float = 2.0
    lowest_scale: int = 2
    taper: float = 0.2
    output: Output = "fields"
    nest: bool = False
    threads: int | None = None

    def __init__(  # noqa: PLR0913 - the choices of an analysis, each with its default
        self,
        bandlimit: int | None = None,
        mask: Array | None = None,
        *,
        method: str = "pseudo",
        directions: int = 1,
        dilation: float = 2.0,
        lowest_scale: int | None = None,
        taper: float = 0.2,
        output: Output = "fields",
        nest: bool = False,
        threads: int | None = None,
    ) -> None:
        if bandlimit is None and mask is None:
            msg = "bandlimit=None needs a mask to take the resolution from; give one of the two."
            raise ParameterError(msg)
        check_choice("method", method, tuple(_METHODS))
        check_choice("output", output, get_args(Output))
        if not isinstance(taper, int | float | np.number) or not 0 < taper <= 1:
            msg = f"taper={taper!r} must be a share of energy in (0, 1]; 0.2 suits most masks."
            raise ParameterError(msg)
        weights = None
        if mask is not None:
            refuse_masked(mask, "mask")
            values = np.asarray(mask)
            sky = sky_of(values, bandlimit, name="mask", threads=threads)
            weights = check_mask(values, values.shape)
            weights.setflags(write=False)
            bandlimit = sky.bandlimit
            if nest and isinstance(sky, HealpixSky):
                check_nside(sky.nside, nested=True)
        bandlimit = check_bandlimit(bandlimit)
        if lowest_scale is None:
            lowest_scale = min(
                _DEFAULT_LOWEST_SCALE,
                ScaleDiscretisedTiling(bandlimit, dilation=dilation).highest_scale,
            )
        settings = (bandlimit, weights, method, directions, dilation, lowest_scale)
        parameters = (*settings, float(taper), output, check_flag(nest, "nest"), threads)
        for item, value in zip(fields(self), parameters, strict=True):
            object.__setattr__(self, item.name, value)
        # What each sky costs to prepare, kept with the separator.
        object.__setattr__(self, "_methods", {})
        # Checks directions, dilation, lowest_scale and threads now rather than at the first map.
        self._transform("mw")

    def _transform(self, sampling: str) -> SpinWaveletTransform:
        return SpinWaveletTransform(
            check_bandlimit(self.bandlimit),
            2,
            self.directions,
            dilation=self.dilation,
            lowest_scale=self.lowest_scale,
            sampling=sampling,
            threads=self.threads,
        )

    @functools.cached_property
    def _ring_mask(self) -> Array | None:
        """The mask in ring order, as everything inside works."""
        return None if self.mask is None else self._in_rings(self.mask)

    def _prepared(self, sky: HealpixSky | GridSky) -> PseudoMethod:
        methods: dict[HealpixSky | GridSky, PseudoMethod] = self._methods  # type: ignore[attr-defined]
        if sky not in methods:
            transform = self._transform(sky.sampling_name)
            methods[sky] = _METHODS[self.method](transform, sky, self._ring_mask, self.taper)
        return methods[sky]

    def _sky_of(self, q: Array) -> HealpixSky | GridSky:
        if self.mask is not None and q.shape != self.mask.shape:
            msg = f"q has shape {q.shape} but the mask {self.mask.shape}; they must be alike."
            raise ShapeError(msg)
        return sky_of(q, self.bandlimit, name="q", threads=self.threads)

    def _observed(self, q: Array, u: Array) -> tuple[Array, Array]:
        """Return Q and U in ring order, zero and finite where masked."""
        q, u = self._in_rings(q), self._in_rings(u)
        cleaned_q, cleaned_u, found = clean_polarisation(q, u, self._ring_mask)
        given = np.ones(q.shape) if self._ring_mask is None else self._ring_mask
        lost = np.count_nonzero((found == 0) & (given > 0))
        if lost:
            msg = (
                f"q and u are not observed at {lost} pixels where the mask is not 0; set the mask "
                "to 0 there and make a separator with it."
            )
            raise DataError(msg)
        return cleaned_q, cleaned_u

    def separate(self, q: Array, u: Array) -> EBMaps:
        """Separate Stokes Q and U into E and B.

        Parameters
        ----------
        q, u : ndarray, real
            Stokes parameters, COSMO frame, any unit: HEALPix maps (12 nside^2,), MW maps
            (L, 2 L - 1) or MWSS maps (L + 1, 2 L), pixelised as the mask is. Pixels where the mask
            is 0 may hold anything.

        Returns
        -------
        EBMaps
            E, B, weights, wavelet coefficients and a report, in the order and unit of Q and U.

        Raises
        ------
        ShapeError
            If the shape is no HEALPix, MW or MWSS map, or not the mask's.
        DataError
            If an observed pixel is NaN, infinite or UNSEEN, or Q or U is complex.
        ParameterError
            If the shape does not fit the bandlimit.
        """
        clock = Clock()
        refuse_masked(q, "q")
        refuse_masked(u, "u")
        q, u = np.asarray(q), np.asarray(u)
        if q.shape != u.shape:
            msg = f"q has shape {q.shape} and u {u.shape}, which must be the same."
            raise ShapeError(msg)
        sky = self._sky_of(q)
        cleaned_q, cleaned_u = self._observed(q, u)
        prepared = self._prepared(sky)
        kept = prepared.kept_fraction
        clock.stop("mask preparation")
        p = cleaned_q + 1j * cleaned_u
        masked = p if self._ring_mask is None else self._ring_mask * p
        plm, fit = sky.polarisation_coefficients(masked)
        clock.stop("harmonic analysis")
        coefficients = prepared.apply(prepared.transform.analysis_harmonic(plm))
        clock.stop("wavelet analysis")
        eb_flm = self._fields(prepared.transform.synthesis_harmonic(coefficients))
        eb = sky.scalar_map(eb_flm)
        clock.stop("synthesis")
        weights, weight = self._weight_maps(prepared, coefficients, q.shape)
        clock.stop("weight maps")
        info = SeparationInfo(
            method=self.method,
            bandlimit=sky.bandlimit,
            scales=prepared.transform.scales,
            sky_fraction=prepared.sky_fraction,
            kept_fraction=kept,
            fit=fit,
            seconds=clock.seconds,
        )
        return EBMaps(
            E=self._reordered(eb.real),
            B=self._reordered(eb.imag),
            weight=self._reordered(weight),
            weights={j: self._reordered(values) for j, values in weights.items()},
            coefficients=coefficients,
            info=info,
        )

    def bands(self, maps: EBMaps) -> dict[int | str, tuple[Array, Array]]:
        """Compute the E and B maps of each scale alone; they add up to E and B.

        Parameters
        ----------
        maps : EBMaps
            What `separate` of this separator returned.

        Returns
        -------
        dict of (int or "scaling") to (ndarray, ndarray)
            E and B of every scale and of the scaling part.

        Raises
        ------
        ShapeError, ParameterError
            If the coefficients are those of another transform. Maps of a separator that differs
            in mask, taper or output only are not told apart: their bands do not add up.
        """
        sky = self._sky_of(maps.E)
        transform = self._prepared(sky).transform
        found: dict[int | str, tuple[Array, Array]] = {}
        for key in transform.shapes:
            flm = transform.synthesis_harmonic(maps.coefficients, parts=(key,))
            eb = sky.scalar_map(self._fields(flm))
            found[key] = self._reordered(eb.real), self._reordered(eb.imag)
        return found

    def _in_rings(self, values: Array) -> Array:
        return nested_to_ring(values) if self.nest and values.ndim == 1 else values

    def _reordered(self, values: Array) -> Array:
        if self.nest and values.ndim == 1:
            return ring_to_nested(values)
        return np.ascontiguousarray(values)

    def _fields(self, plm: Array) -> Array:
        """E_lm + i B_lm = -P_lm, with the factor of the output asked for."""
        factor = polarisation_factor(check_bandlimit(self.bandlimit))
        if self.output == "fields":
            return -plm
        if self.output == "derivatives":
            return multiply_by_degree(-plm, factor)
        inverse = np.divide(1.0, factor, out=np.zeros_like(factor), where=factor > 0)
        return multiply_by_degree(-plm, inverse)

    def _weight_maps(
        self, prepared: PseudoMethod, coefficients: WaveletCoefficients, shape: tuple[int, ...]
    ) -> tuple[dict[int, Array], Array]:
        transform, sky = prepared.transform, prepared.sky
        if self._ring_mask is None:
            ones = np.ones(shape)
            return {j: ones.copy() for j in transform.scales}, ones
        weights, weight, total = {}, np.zeros(shape), 0.0
        for j in transform.scales:
            weights[j] = position_map(prepared.weights[j].mean(axis=0), transform, j, sky)
            weights[j] *= self._ring_mask > 0
            power = prepared.sphere_mean((np.abs(coefficients[j]) ** 2).mean(axis=0))
            weight += power * weights[j]
            total += power
        # A map without any power is trusted where its mask is.
        return weights, weight / total if total > 0 else np.mean(list(weights.values()), axis=0)
