"""`SpinWaveletTransform`: exact directional spin wavelet transforms."""

from __future__ import annotations

import functools
from collections.abc import Collection
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.directionality import Directionality
from spinsdw.errors import ParameterError, ShapeError
from spinsdw.grid_sums import GridSums, fill_negative_orders
from spinsdw.harmonics import check_bandlimit, check_flm
from spinsdw.parallel import resolve_threads
from spinsdw.sampling import Sampling, resolve_sampling
from spinsdw.signals import check_map
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.tiling import ScaleDiscretisedTiling, Tiling
from spinsdw.wavelets import Wavelets

__all__ = ["SpinWaveletTransform"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False)
class SpinWaveletTransform:
    """Decompose spin-s signals into scale-discretised directional wavelets, and back, exactly.

    W^j(rho) = <f, R_rho psi^j>: scale j, position (theta, phi) = (beta, alpha), orientation gamma
    (McEwen et al. 2015, arXiv:1509.06749; `conventions`). Orientations gamma_k = k pi / N hold
    every other one (see `WaveletCoefficients.steer`).

    Parameters
    ----------
    bandlimit : int
        L: the signal has degrees l < L.
    spin : int, default 0
        s of the signal, |s| < L.
    directions : int, default 1
        N, the azimuthal bandlimit: 1 is axisymmetric; N <= L.
    dilation : float, default 2.0
        lambda > 1: scale j has degrees lambda^(j-1) < l < lambda^(j+1).
    lowest_scale : int, default 0
        J0: larger structures belong to the scaling part.
    sampling : str or Sampling, default "mw"
        Grid of maps; every scale uses the same kind at its own bandlimit.
    multiresolution : bool, default True
        Whether scale j is sampled at its own bandlimit, or at L.
    real : bool, default False
        Whether the signal is real (spin 0): half the work and memory.
    tiling : Tiling, optional
        Kernels to use instead of the scale-discretised ones of ``dilation`` and ``lowest_scale``.
    threads : int, optional
        Threads to use; all cores when None. Results do not depend on it.

    Notes
    -----
    Cost O(N L^3). `synthesis` inverts `analysis` for band-limited signals to rounding. The adjoints
    are those of the plain dot product of the stored arrays.

    Examples
    --------
    >>> import numpy as np
    >>> transform = SpinWaveletTransform(32, spin=2, directions=3)
    >>> flm = np.zeros(32**2, dtype=complex)
    >>> flm[4:] = 1.0
    >>> coefficients = transform.analysis_harmonic(flm)
    >>> found = transform.synthesis_harmonic(coefficients)
    >>> bool(np.allclose(found, flm, rtol=0, atol=1e-13))
    True
    """

    bandlimit: int
    spin: int = 0
    directions: int = 1
    dilation: float = 2.0
    lowest_scale: int = 0
    sampling: Sampling | str = "mw"
    multiresolution: bool = True
    real: bool = False
    tiling: Tiling | None = None
    threads: int | None = None

    def __init__(  # noqa: PLR0913 - the parameters of the wavelets
        self,
        bandlimit: int,
        spin: int = 0,
        directions: int = 1,
        *,
        dilation: float = 2.0,
        lowest_scale: int = 0,
        sampling: str | Sampling = "mw",
        multiresolution: bool = True,
        real: bool = False,
        tiling: Tiling | None = None,
        threads: int | None = None,
    ) -> None:
        bandlimit = check_bandlimit(bandlimit)
        grid = resolve_sampling(sampling, bandlimit)
        if tiling is None:
            tiling = ScaleDiscretisedTiling(bandlimit, dilation=dilation, lowest_scale=lowest_scale)
        elif tiling.bandlimit != bandlimit:
            msg = (
                f"tiling has bandlimit {tiling.bandlimit} but the transform has {bandlimit}; "
                "make the tiling with the transform's bandlimit."
            )
            raise ParameterError(msg)
        wavelets = Wavelets(tiling, Directionality(directions), spin)
        # Checks spin, real and threads.
        harmonic = SpinHarmonicTransform(bandlimit, spin, sampling=grid, real=real, threads=threads)
        values = (
            bandlimit,
            harmonic.spin,
            int(directions),
            float(getattr(tiling, "dilation", dilation)),
            tiling.lowest_scale,
            grid,
            bool(multiresolution),
            bool(real),
            tiling,
            threads,
        )
        for field, value in zip(fields(self), values, strict=True):
            object.__setattr__(self, field.name, value)
        object.__setattr__(self, "_wavelets", wavelets)
        object.__setattr__(self, "_harmonic", harmonic)

    @property
    def wavelets(self) -> Wavelets:
        """The wavelets and scaling function in harmonic space."""
        return self._wavelets  # type: ignore[attr-defined]

    @property
    def harmonic(self) -> SpinHarmonicTransform:
        """The transform between maps and harmonic coefficients."""
        return self._harmonic  # type: ignore[attr-defined]

    @property
    def scales(self) -> tuple[int, ...]:
        """The scales j, from large to small structures."""
        return tuple(self._tiling.scales)

    @property
    def bandlimits(self) -> dict[int, int]:
        """Bandlimit at which each scale is sampled."""
        return {j: self.grid_of(self._tiling.scale_bandlimit(j)).bandlimit for j in self.scales}

    @property
    def orientations(self) -> Array:
        """The orientations gamma_k = k pi / N in radians; float64, shape (directions,)."""
        return self.wavelets.directionality.orientations

    @property
    def shapes(self) -> dict[int | str, tuple[int, ...]]:
        """Shape of the scaling part and of each scale, for one signal."""
        found: dict[int | str, tuple[int, ...]] = {"scaling": self._scaling_transform.shape}
        for j in self.scales:
            grid = self.grid_of(self._tiling.scale_bandlimit(j))
            found[j] = (self.directions, *grid.shape)
        return found

    @property
    def admissibility_error(self) -> float:
        """Largest deviation from 1 of the sum that makes synthesis exact."""
        return self.wavelets.admissibility_error

    @property
    def _tiling(self) -> Tiling:
        return self.tiling  # type: ignore[return-value]

    @property
    def _grid(self) -> Sampling:
        return self.sampling  # type: ignore[return-value]

    @property
    def _parameters(self) -> dict[str, Any]:
        return {
            "bandlimit": self.bandlimit,
            "spin": self.spin,
            "directions": self.directions,
            "dilation": self.dilation,
            "lowest_scale": self.lowest_scale,
            "sampling": self._grid.name,
            "multiresolution": self.multiresolution,
            "real": self.real,
        }

    def grid_of(self, bandlimit: int) -> Sampling:
        """Return the grid for coefficients of a bandlimit: the full one without multiresolution."""
        return type(self._grid)(bandlimit if self.multiresolution else self.bandlimit)

    @functools.cached_property
    def _scaling_transform(self) -> SpinHarmonicTransform:
        grid = self.grid_of(self._tiling.scaling_bandlimit)
        return SpinHarmonicTransform(
            grid.bandlimit, 0, sampling=grid, real=self.real, threads=self.threads
        )

    @functools.cached_property
    def _scaling_factor(self) -> Array:
        """sqrt(4 pi / (2l + 1)) phi_l0, at each (l, m) of the scaling part."""
        size = self._scaling_transform.bandlimit
        el = np.arange(size)
        factor = np.sqrt(4 * np.pi / (2 * el + 1)) * self.wavelets.scaling_harmonics[:size]
        return np.repeat(factor, 2 * el + 1)

    def _sums(self, scale: int) -> tuple[GridSums, Array, int]:
        """Return the sums of one scale, conj(psi) padded to its grid, and its lowest degree."""
        directionality = self.wavelets.directionality
        orders = directionality.orders
        grid = self.grid_of(self._tiling.scale_bandlimit(scale))
        kept = [i for i, n in enumerate(orders) if abs(n) < grid.bandlimit]
        psi = self.wavelets.wavelet_harmonics(scale)
        weights = np.zeros((len(kept), grid.bandlimit), dtype=np.complex128)
        weights[:, : psi.shape[1]] = psi[kept].conj()
        mixing = np.exp(
            1j * np.outer(directionality.orientations, [orders[i] for i in kept])
        ).astype(np.complex128)
        lowest = max(self._tiling.scale_lowest_degree(scale), abs(self.spin))
        sums = GridSums(
            grid,
            tuple(orders[i] for i in kept),
            np.ascontiguousarray(mixing),
            self.real,
            resolve_threads(self.threads),
        )
        return sums, weights, min(lowest, grid.bandlimit)

    def _scale_to_grid(self, flm: Array, scale: int, *, adjoint: bool) -> Array:
        sums, weights, lowest = self._sums(scale)
        size = sums.sampling.bandlimit**2
        batch = flm.reshape(-1, flm.shape[-1])
        factor = 2 * np.pi / self.directions if adjoint else 1.0
        maps = None
        for i, one in enumerate(batch):
            found = sums.to_grid(
                one[None, :size], weights * factor, lowest=lowest, quadrature=adjoint
            )
            if batch.shape[0] == 1:
                maps = found[None]
                break
            if maps is None:
                maps = np.empty((batch.shape[0], *found.shape), dtype=found.dtype)
            maps[i] = found
        shape = self.shapes[scale]
        if maps is None:
            maps = np.empty((0, *shape), dtype=np.float64 if self.real else np.complex128)
        return maps.reshape(*flm.shape[:-1], *shape)

    def _add_scale(self, values: Array, scale: int, flm: Array, *, adjoint: bool) -> None:
        sums, weights, lowest = self._sums(scale)
        factor = 1.0 if adjoint else 2 * np.pi / self.directions
        size = sums.sampling.bandlimit**2
        for one, out in zip(values.reshape(-1, *values.shape[-3:]), flm, strict=True):
            sums.from_grid(
                one,
                weights.conj() * factor,
                out=out[None, :size],
                lowest=lowest,
                quadrature=not adjoint,
            )

    def _decompose(self, flm: Array, *, adjoint: bool) -> WaveletCoefficients:
        flm = check_flm(flm, self.bandlimit)
        part = flm[..., : self._scaling_factor.size] * self._scaling_factor
        transform = self._scaling_transform
        scaling = transform.adjoint_analysis(part) if adjoint else transform.synthesis(part)
        wavelets = {j: self._scale_to_grid(flm, j, adjoint=adjoint) for j in self.scales}
        return WaveletCoefficients(scaling, wavelets, self._parameters)

    def _recompose(
        self,
        coefficients: WaveletCoefficients,
        *,
        adjoint: bool,
        parts: Collection[int | str] | None = None,
    ) -> Array:
        checked = self._checked(coefficients)
        scaling = checked["scaling"]
        wanted = set(self.shapes) if parts is None else self._checked_parts(parts)
        flm = np.zeros((*scaling.shape[:-2], self.bandlimit**2), dtype=np.complex128)
        rows = flm.reshape(-1, self.bandlimit**2)
        for j in self.scales:
            if j in wanted:
                self._add_scale(checked[j], j, rows, adjoint=adjoint)
        if self.real:
            fill_negative_orders(rows)
        if "scaling" in wanted:
            transform = self._scaling_transform
            part = transform.adjoint_synthesis(scaling) if adjoint else transform.analysis(scaling)
            flm[..., : part.shape[-1]] += part * self._scaling_factor
        return flm

    def _checked_parts(self, parts: Collection[int | str]) -> set[int | str]:
        known = set(self.shapes)
        if not set(parts) <= known:
            msg = f"parts={tuple(parts)!r} must be among 'scaling' and the scales {self.scales}."
            raise ParameterError(msg)
        return set(parts)

    def _checked(self, coefficients: WaveletCoefficients) -> dict[int | str, Array]:
        if not isinstance(coefficients, WaveletCoefficients):
            msg = (
                f"coefficients is a {type(coefficients).__name__}; pass the WaveletCoefficients "
                "that analysis returns."
            )
            raise ParameterError(msg)
        if coefficients.scales != self.scales:
            msg = (
                f"coefficients have scales {coefficients.scales} but the transform has "
                f"{self.scales}; use the transform that made them."
            )
            raise ShapeError(msg)
        found: dict[int | str, Array] = {}
        for key, shape in self.shapes.items():
            values = coefficients.scaling if key == "scaling" else coefficients[int(key)]
            name = "scaling part" if key == "scaling" else f"scale {key}"
            found[key] = check_map(values, shape, real=self.real, name=name)
        return found

    def analysis_harmonic(self, flm: Array) -> WaveletCoefficients:
        """Compute wavelet coefficients from harmonic coefficients.

        Parameters
        ----------
        flm : ndarray, shape (..., bandlimit**2), complex
            [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]; entries with
            el < abs(spin) do not contribute.

        Returns
        -------
        WaveletCoefficients
            Scale j has shape (..., directions, rings, phi); leading axes are a batch.

        Raises
        ------
        ShapeError
            If the last axis is not bandlimit**2 long.
        DataError
            If a coefficient is not a finite number.
        """
        return self._decompose(self._spin_part(flm), adjoint=False)

    def synthesis_harmonic(
        self,
        coefficients: WaveletCoefficients,
        *,
        parts: Collection[int | str] | None = None,
    ) -> Array:
        """Compute harmonic coefficients from wavelet coefficients: the inverse of the analysis.

        Parameters
        ----------
        coefficients : WaveletCoefficients
            As `analysis` returns them, or changed.
        parts : collection of int or "scaling", optional
            The scales to add up; all, and the scaling part, when None.

        Returns
        -------
        ndarray, shape (..., bandlimit**2), complex128
            The coefficients, zero for el < abs(spin).

        Raises
        ------
        ShapeError
            If scales or shapes are not the transform's.
        DataError
            If a value is not a finite number.
        """
        return self._spin_part(self._recompose(coefficients, adjoint=False, parts=parts))

    def adjoint_analysis_harmonic(self, coefficients: WaveletCoefficients) -> Array:
        """Apply the adjoint of `analysis_harmonic`; shapes of `synthesis_harmonic`."""
        return self._spin_part(self._recompose(coefficients, adjoint=True))

    def adjoint_synthesis_harmonic(self, flm: Array) -> WaveletCoefficients:
        """Apply the adjoint of `synthesis_harmonic`; shapes of `analysis_harmonic`."""
        return self._decompose(self._spin_part(flm), adjoint=True)

    def _spin_part(self, flm: Array) -> Array:
        """Drop degrees below |s|, which a signal of spin s does not have."""
        lowest = self.spin**2
        if lowest == 0:
            return flm
        flm = np.array(check_flm(flm, self.bandlimit))
        flm[..., :lowest] = 0.0
        return flm

    def analysis(self, maps: Array) -> WaveletCoefficients:
        """Compute coefficients from maps, shape (..., rings, phi); see `analysis_harmonic`."""
        return self.analysis_harmonic(self.harmonic.analysis(maps))

    def synthesis(self, coefficients: WaveletCoefficients) -> Array:
        """Compute maps, shape (..., rings, phi), from wavelet coefficients: inverts `analysis`."""
        return self.harmonic.synthesis(self.synthesis_harmonic(coefficients))

    def adjoint_analysis(self, coefficients: WaveletCoefficients) -> Array:
        """Apply the adjoint of `analysis`: coefficients to maps."""
        return self.harmonic.adjoint_analysis(self.adjoint_analysis_harmonic(coefficients))

    def adjoint_synthesis(self, maps: Array) -> WaveletCoefficients:
        """Apply the adjoint of `synthesis`: maps to coefficients."""
        return self.adjoint_synthesis_harmonic(self.harmonic.adjoint_synthesis(maps))
