"""`EBSeparator`: E and B maps from Q and U on the full or the masked sky."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, get_args

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.errors import ParameterError, ShapeError
from spinsdw.harmonics import (
    check_bandlimit,
    check_integer,
    multiply_by_degree,
    polarisation_factor,
)
from spinsdw.healpix import HealpixFit, check_nside, nested_to_ring, ring_to_nested
from spinsdw.separation.inputs import (
    check_beam,
    check_inverse_noise,
    check_spectrum,
    combine_masks,
    observed_stack,
    sky_of_stack,
)
from spinsdw.separation.least_squares import Convergence, EBPrior
from spinsdw.separation.method import Estimator, Method
from spinsdw.separation.registry import resolve_method
from spinsdw.separation.report import Clock, check_choice
from spinsdw.separation.skies import GridSky, HealpixSky, position_map, sky_of
from spinsdw.separation.survey import Survey
from spinsdw.separation.uncertainty import draw_errors, estimate_spectra
from spinsdw.signals import check_flag, refuse_masked
from spinsdw.tiling import ScaleDiscretisedTiling
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = ["EBErrors", "EBMaps", "EBSeparator", "SeparationInfo"]

Array = np.ndarray[Any, Any]
AnySky = HealpixSky | GridSky
Output = Literal["fields", "derivatives", "potentials"]

_DEFAULT_LOWEST_SCALE = 2


@dataclass(frozen=True)
class SeparationInfo:
    """What a separation did and how well it went.

    Attributes
    ----------
    method : str
        Name of the method.
    choices : str
        The method with its free choices.
    bandlimit : int
        Degrees used are below it.
    scales : tuple of int
        The wavelet scales.
    sky_fraction : float
        Mean of the mask over the sphere.
    kept_fraction : dict
        Mean weight over the sphere of the coefficients of each scale, and of the scaling part.
    fit : HealpixFit or None
        How well harmonic coefficients fit a HEALPix map, of the worst map of a stack; None where
        no such fit was made, as on grids, where coefficients are exact.
    convergence : tuple of Convergence
        How the regularised fit of each map went; empty where there was none.
    seconds : dict of str to float
        Wall time of each step.
    """

    method: str
    choices: str
    bandlimit: int
    scales: tuple[int, ...]
    sky_fraction: float
    kept_fraction: Mapping[int | str, float]
    fit: HealpixFit | None
    convergence: tuple[Convergence, ...]
    seconds: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class EBMaps:
    """E and B maps with their weights.

    Attributes
    ----------
    E, B : ndarray, shape of Q and U, float64
        The maps, pixelised as Q and U, in their unit (for ``output="fields"``).
    weight : ndarray, shape of one map, float64
        Where to trust the maps, from 0 to 1: the weights of all scales, each counted with the
        power its weighted coefficients have left. A scale dropped everywhere does not count.
    weights : mapping of int to ndarray, shape of one map
        The retained sky of every scale: the mean of its weights over orientations.
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
class EBErrors:
    """Errors of E and B on simulated skies, estimate minus truth; zero where masked.

    Attributes
    ----------
    E_draws, B_draws : ndarray, shape (draws, map), float64
        The errors of each sky.
    """

    E_draws: Array = field(repr=False)
    B_draws: Array = field(repr=False)

    @property
    def E(self) -> Array:
        """Root mean square error of E at each pixel, shape of one map."""
        return np.asarray(np.sqrt(np.mean(self.E_draws**2, axis=0)))

    @property
    def B(self) -> Array:
        """Root mean square error of B at each pixel, shape of one map."""
        return np.asarray(np.sqrt(np.mean(self.B_draws**2, axis=0)))


@dataclass(frozen=True, eq=False)
class _Prepared:
    """A method prepared for a survey, and what of its weights is shown to users."""

    survey: Survey
    estimator: Estimator

    @functools.cached_property
    def kept_fraction(self) -> dict[int | str, float]:
        """Mean of the weights over the sphere and the orientations, for each scale."""
        if self.survey.mask is None:
            return dict.fromkeys(self.estimator.weights, 1.0)
        return {
            key: self.survey.sphere_mean(values.reshape(-1, *values.shape[-2:]).mean(axis=0))
            for key, values in self.estimator.weights.items()
        }

    @functools.cached_property
    def weight_maps(self) -> dict[int, Array]:
        """Mean of the weights over orientations at the points of the maps, for each scale."""
        survey = self.survey
        maps = {}
        for j in survey.transform.scales:
            means = self.estimator.weights[j].mean(axis=0)
            maps[j] = position_map(means, survey.transform, j, survey.sky) * survey.observed
            maps[j].setflags(write=False)
        return maps

    def weight_map(self, coefficients: WaveletCoefficients) -> Array:
        """Weigh `weight_maps` by the power that is left in each scale, over a stack of maps."""
        weight, total = np.zeros(self.survey.map_shape), 0.0
        for j, values in self.weight_maps.items():
            squares = np.abs(coefficients[j]) ** 2
            power = self.survey.sphere_mean(squares.mean(axis=tuple(range(squares.ndim - 2))))
            weight += power * values
            total += power
        # A map without any power is trusted where its mask is.
        return weight / total if total > 0 else np.mean(list(self.weight_maps.values()), axis=0)


@dataclass(frozen=True, eq=False)
class EBSeparator:
    """Separate Q and U into E and B with spin wavelets.

    Parameters
    ----------
    bandlimit : int or None, optional
        L: degrees are l < L. None takes it from the mask: 2 nside + 1 on HEALPix, the grid's own
        on MW and MWSS. Maps on those may be finer than L needs.
    mask : ndarray, or sequence of ndarray, optional
        1 where observed, 0 where not: HEALPix (1-D) or an MW or MWSS map (2-D). Several masks are
        multiplied. None: full sky.
    method : str or object, default "hybrid"
        The estimator: a name, or an object of `spinsdw.separation` that holds its free choices.
    directions : int, default 1
        N of the wavelets.
    dilation : float, default 2.0
        Ratio of neighbouring scales.
    lowest_scale : int, default 2, or the highest scale if that is lower
        Structures larger than scale J0 belong to the scaling part.
    inverse_noise : ndarray, optional
        Inverse noise variance of Q and of U at each pixel, pixelised as the mask, in any unit: how
        methods that fit weigh the pixels. None: uniform.
    beam : float or ndarray, optional
        Beam of the maps: full width at half maximum in radians of a Gaussian, or the window
        function b_l from l = 0 on. Results keep the beam; spectra that are given are smoothed.
    output : {"fields", "derivatives", "potentials"}, default "fields"
        E and B; or N_l E_lm and N_l B_lm, second derivatives of Q and U; or E_lm / N_l and
        B_lm / N_l; N_l = sqrt((l+2)! / (l-2)!).
    nest : bool, default False
        Whether HEALPix maps, mask and inverse noise are in nested order.
    threads : int, optional
        Threads to use; all cores when None.

    Notes
    -----
    Q and U are in the COSMO frame (HEALPix's own). What depends on the mask only is computed at the
    first separation, or by `prepare`, and kept.

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
    method: str | Method = "hybrid"
    directions: int = 1
    dilation: float = 2.0
    lowest_scale: int = 2
    inverse_noise: Array | None = None
    beam: Array | float | None = None
    output: Output = "fields"
    nest: bool = False
    threads: int | None = None

    def __init__(  # noqa: PLR0913 - the choices of an analysis, each with its default
        self,
        bandlimit: int | None = None,
        mask: Array | None = None,
        *,
        method: str | Method = "hybrid",
        directions: int = 1,
        dilation: float = 2.0,
        lowest_scale: int | None = None,
        inverse_noise: Array | None = None,
        beam: Array | float | None = None,
        output: Output = "fields",
        nest: bool = False,
        threads: int | None = None,
    ) -> None:
        if bandlimit is None and mask is None:
            msg = "bandlimit=None needs a mask to take the resolution from; give one of the two."
            raise ParameterError(msg)
        chosen = resolve_method(method)
        check_choice("output", output, get_args(Output))
        weights = None
        if mask is not None:
            weights = combine_masks(mask)
            sky = sky_of(weights, bandlimit, name="mask", threads=threads)
            bandlimit = sky.bandlimit
            if nest and isinstance(sky, HealpixSky):
                check_nside(sky.nside, nested=True)
        bandlimit = check_bandlimit(bandlimit)
        noise = None
        if inverse_noise is not None:
            noise = check_inverse_noise(inverse_noise, None if weights is None else weights.shape)
        if lowest_scale is None:
            highest = ScaleDiscretisedTiling(bandlimit, dilation=dilation).highest_scale
            lowest_scale = min(_DEFAULT_LOWEST_SCALE, highest)
        settings = (bandlimit, weights, chosen, directions, dilation, lowest_scale, noise)
        window = check_beam(beam, bandlimit)
        parameters = (*settings, window, output, check_flag(nest, "nest"), threads)
        for item, value in zip(fields(self), parameters, strict=True):
            object.__setattr__(self, item.name, value)
        # What each sky costs to prepare, kept with the separator.
        object.__setattr__(self, "_estimators", {})
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

    def _prepared(self, sky: AnySky) -> _Prepared:
        held: dict[AnySky, _Prepared] = self._estimators  # type: ignore[attr-defined]
        if sky not in held:
            noise = self.inverse_noise
            if noise is not None and noise.shape != sky.map_shape:
                msg = f"inverse_noise has shape {noise.shape} but the maps {sky.map_shape}."
                raise ShapeError(msg)
            survey = Survey(
                self._transform(sky.sampling_name),
                sky,
                self._ring_mask,
                None if noise is None else self._in_rings(noise),
                np.asarray(self.beam),
            )
            held[sky] = _Prepared(survey, self.method.prepare(survey))  # type: ignore[union-attr]
        return held[sky]

    def prepare(self) -> EBSeparator:
        """Compute now what depends on the mask only, and return the separator itself.

        It is kept, shared by all maps that follow, and pickled with the separator: a pool of
        processes, or a run of tomorrow, takes it from there.

        Returns
        -------
        EBSeparator
            The separator, for ``separator = EBSeparator(...).prepare()``.

        Raises
        ------
        ParameterError
            If there is no mask, so that nothing is to prepare.

        Examples
        --------
        >>> import numpy as np
        >>> from spinsdw.masks import galactic_cut
        >>> separator = EBSeparator(17, galactic_cut(8, 0.3), method="pseudo").prepare()
        >>> separator.separate(*np.ones((2, 768))).info.method
        'pseudo'
        """
        if self.mask is None:
            msg = "mask=None leaves nothing to prepare; give a mask, or separate maps at once."
            raise ParameterError(msg)
        prepared = self._prepared(sky_of_stack(self.mask, self.mask, self.bandlimit, self.threads))
        # A map of zeros goes through every step and asks for all that is computed once.
        prepared.estimator.estimate(np.zeros((1, *prepared.survey.map_shape), np.complex128))
        prepared.kept_fraction, prepared.weight_maps  # noqa: B018
        return self

    def separate(self, q: Array, u: Array) -> EBMaps:
        """Separate Stokes Q and U into E and B.

        Parameters
        ----------
        q, u : ndarray, real, shape (..., map)
            Stokes parameters, COSMO frame, any unit: HEALPix maps (12 nside^2,), MW maps
            (G, 2 G - 1) or MWSS maps (G + 1, 2 G) with G >= L, pixelised as the mask is; leading
            axes are a batch. Pixels where the mask is 0 may hold anything.

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
            If the maps are too coarse for the bandlimit.
        """
        clock = Clock()
        refuse_masked(q, "q")
        refuse_masked(u, "u")
        q, u = np.asarray(q), np.asarray(u)
        if q.shape != u.shape:
            msg = f"q has shape {q.shape} and u {u.shape}, which must be the same."
            raise ShapeError(msg)
        sky = sky_of_stack(q, self.mask, self.bandlimit, self.threads)
        rows = (-1, *sky.map_shape)
        p = observed_stack(q.reshape(rows), u.reshape(rows), self._ring_mask, nest=self.nest)
        prepared = self._prepared(sky)
        survey, kept = prepared.survey, prepared.kept_fraction
        clock.stop("mask preparation")
        estimate = prepared.estimator.estimate(p)
        clock.stop("estimation")
        eb_flm = self._fields(survey.transform.synthesis_harmonic(estimate.coefficients))
        eb = sky.scalar_map(eb_flm).reshape(q.shape)
        clock.stop("synthesis")
        weight = prepared.weight_map(estimate.coefficients)
        clock.stop("weight maps")
        info = SeparationInfo(
            method=self.method.name,  # type: ignore[union-attr]
            choices=str(self.method),
            bandlimit=sky.bandlimit,
            scales=survey.transform.scales,
            sky_fraction=survey.sky_fraction,
            kept_fraction=kept,
            fit=estimate.fit,
            convergence=estimate.convergence,
            seconds=clock.seconds,
        )
        return EBMaps(
            E=self._reordered(eb.real, sky),
            B=self._reordered(eb.imag, sky),
            weight=self._reordered(weight, sky),
            weights={j: self._reordered(w, sky) for j, w in prepared.weight_maps.items()},
            coefficients=estimate.coefficients.reshape_batch(q.shape[: q.ndim - len(rows) + 1]),
            info=info,
        )

    def uncertainty(
        self,
        maps: EBMaps,
        *,
        noise_level: float,
        spectra: tuple[Array, Array] | None = None,
        draws: int = 8,
        seed: int = 0,
    ) -> EBErrors:
        """Simulate the errors of a separation: what it makes of known skies behind the same mask.

        Parameters
        ----------
        maps : EBMaps
            What `separate` of this separator returned, of one map or of maps of one kind.
        noise_level : float
            Noise of Q and of U, in the map's unit times radians, where mask and relative inverse
            noise are 1.
        spectra : pair of ndarray, shape (at least bandlimit,), optional
            C_l of E and of B without beam, the square of the map's unit. None: the band powers of
            ``maps`` where the sky is seen (eq-wavelet-prior).
        draws : int, default 8
            How many skies to separate; the error of an error falls as 1 / sqrt(2 draws).
        seed : int, default 0
            Seed of the skies.

        Returns
        -------
        EBErrors
            Errors of E and B at every pixel: each draw's, and their root mean square.

        Raises
        ------
        ParameterError
            If draws, seed or noise_level is out of range.
        ShapeError, DataError
            If a spectrum is too short or negative, or the maps are those of another sky.

        Notes
        -----
        With `spinsdw.separation.Wiener` and the spectra of its prior, maps minus the error of a
        draw is a constrained realisation: a sky from the posterior.
        """
        check_integer(draws, "draws", minimum=2, remedy="8 tell an error to a quarter")
        check_integer(seed, "seed", minimum=0, remedy="0 is the default")
        if not (math.isfinite(noise_level) and noise_level >= 0):
            msg = f"noise_level={noise_level} must be finite and at least 0, in the map's unit."
            raise ParameterError(msg)
        sky = sky_of_stack(maps.E, self.mask, self.bandlimit, self.threads)
        prepared = self._prepared(sky)
        survey = prepared.survey
        if spectra is None:
            prior = estimate_spectra(survey, maps.coefficients, noise_level)
        else:
            beam = survey.beam**2
            e, b = (check_spectrum(one, sky.bandlimit) for one in spectra)
            prior = EBPrior(e * beam, b * beam)
        plm = draw_errors(survey, prepared.estimator, prior, noise_level, draws, seed)
        errors = sky.scalar_map(self._fields(plm)) * survey.observed
        return EBErrors(self._reordered(errors.real, sky), self._reordered(errors.imag, sky))

    def bands(self, maps: EBMaps) -> dict[int | str, tuple[Array, Array]]:
        """Compute the E and B maps of each scale alone; they add up to E and B.

        Parameters
        ----------
        maps : EBMaps
            What `separate` of this separator returned.

        Returns
        -------
        dict of (int or "scaling") to (ndarray, ndarray)
            E and B of every scale and of the scaling part, of the shape of Q and U.

        Raises
        ------
        ShapeError, ParameterError
            If the coefficients are those of another transform. Maps of a separator that differs
            in mask, method or output only are not told apart: their bands do not add up.
        """
        sky = sky_of_stack(maps.E, self.mask, self.bandlimit, self.threads)
        transform = self._transform(sky.sampling_name)
        found: dict[int | str, tuple[Array, Array]] = {}
        for key in transform.shapes:
            flm = transform.synthesis_harmonic(maps.coefficients, parts=(key,))
            eb = sky.scalar_map(self._fields(flm))
            found[key] = self._reordered(eb.real, sky), self._reordered(eb.imag, sky)
        return found

    def _in_rings(self, values: Array) -> Array:
        return nested_to_ring(values) if self.nest and values.ndim == 1 else values

    def _reordered(self, values: Array, sky: AnySky) -> Array:
        if self.nest and isinstance(sky, HealpixSky):
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
