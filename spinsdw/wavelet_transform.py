"""`SpinWaveletTransform`: exact directional spin wavelet transforms."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from spinsdw.coefficient_checks import check_coefficients, check_wanted
from spinsdw.coefficients import WaveletCoefficients
from spinsdw.directionality import Directionality, SteerableDirectionality
from spinsdw.errors import ParameterError
from spinsdw.grid_sums import cleared_flm, fill_negative_orders
from spinsdw.harmonics import check_bandlimit, check_flm, check_integer, resize
from spinsdw.memory import MemoryEstimate
from spinsdw.ring_transform import HealpixTransform
from spinsdw.rotated_wavelets import rotated_harmonics
from spinsdw.sampling import Sampling, resolve_sampling
from spinsdw.scale_sums import ScaleSums, ScalingSums, scale_sums
from spinsdw.signals import check_flag, stored_dtype, writable
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.tiling import ScaleDiscretisedTiling, Tiling
from spinsdw.wavelet_frame import WaveletFrame
from spinsdw.wavelet_parameters import resolve_directionality, resolve_tiling, tiling_text
from spinsdw.wavelets import Wavelets
from spinsdw.wigner_parts import check_parts, orders_to_samples, part_shapes, samples_to_orders

__all__ = ["SpinWaveletTransform"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False)
class SpinWaveletTransform(WaveletFrame):
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
        N, the azimuthal bandlimit: 1 is axisymmetric; N <= L. Not with ``directionality``.
    dilation : float, default 2.0
        lambda > 1: scale j has degrees lambda^(j-1) < l < lambda^(j+1). Not with ``tiling``.
    lowest_scale : int, default 0
        J0: larger structures belong to the scaling part. Not with ``tiling``.
    sampling : str or Sampling, default "mw"
        Grid of maps, as in `SpinHarmonicTransform`; every scale uses the same kind at its own
        bandlimit.
    multiresolution : bool, default True
        Whether scale j is sampled at its own bandlimit, or at L.
    real : bool, default False
        Whether the signal is real (spin 0): half the sums, and half the memory of maps and wavelet
        coefficients. The recursion is the same, so that 0.6 to 0.7 of the time are left.
    tiling : Tiling, optional
        Kernels to use instead of the scale-discretised ones of ``dilation`` and ``lowest_scale``,
        which then tell the tiling's own (2.0 where it has no dilation).
    directionality : Directionality, optional
        Curvelets, ridgelets or another azimuthal part, instead of the steerable one of
        ``directions``, which then tells how many orientations the finest scale has.
    original_spin : int, default 0
        r of eq-spin-lowered: `analysis` takes wavelets lowered from spin r, and `synthesis` those
        of -r, its inverse. S2LET synthesises with the same r: that is a transform of -r.
    threads : int, optional
        Threads to use; all cores when None. Results do not depend on it.
    dtype : {"complex128", "complex64"}, default "complex128"
        What maps and wavelet coefficients are stored in; with "complex64" real ones are float32, in
        half the memory. Sums are of double precision and harmonic coefficients complex128 in any
        case; what is stored is rounded to 6e-8 of its size (`docs/engine`).
    max_memory : int, optional
        Bytes that a call may take by `memory_estimate`; one that would take more is refused before
        it allocates anything. No limit when None.

    Notes
    -----
    Cost O(N L^3). `synthesis` inverts `analysis` for band-limited signals to rounding. The adjoints
    are those of the plain dot product of the stored arrays. Degrees that the wavelets do not hold
    (``wavelets.lost_degrees``: of ridgelets every other one) do not come back; an analysis of a
    signal that has some gives a `PrecisionWarning`.

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
    directionality: Directionality | None = None
    original_spin: int = 0
    threads: int | None = None
    dtype: str = "complex128"
    max_memory: int | None = None

    def __init__(  # noqa: PLR0913 - the parameters of the wavelets
        self,
        bandlimit: int,
        spin: int = 0,
        directions: int | None = None,
        *,
        dilation: float | None = None,
        lowest_scale: int | None = None,
        sampling: str | Sampling = "mw",
        multiresolution: bool = True,
        real: bool = False,
        tiling: Tiling | None = None,
        directionality: Directionality | None = None,
        original_spin: int = 0,
        threads: int | None = None,
        dtype: str = "complex128",
        max_memory: int | None = None,
    ) -> None:
        bandlimit = check_bandlimit(bandlimit)
        grid = resolve_sampling(sampling, bandlimit)
        tiling = resolve_tiling(tiling, bandlimit, dilation, lowest_scale)
        wavelets = Wavelets(
            tiling,
            resolve_directionality(directionality, directions),
            spin,
            original_spin=original_spin,
        )
        # Checks spin, real and threads.
        harmonic = SpinHarmonicTransform(
            bandlimit,
            spin,
            sampling=grid,
            real=real,
            threads=threads,
            dtype=dtype,
            max_memory=max_memory,
        )
        values = (
            bandlimit,
            harmonic.spin,
            wavelets.directionality.orientations_at(bandlimit).count,
            float(getattr(tiling, "dilation", 2.0)),
            tiling.lowest_scale,
            grid,
            check_flag(multiresolution, "multiresolution"),
            harmonic.real,
            tiling,
            wavelets.directionality,
            wavelets.original_spin,
            threads,
            harmonic.dtype,
            harmonic.max_memory,
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
        return {j: self.part_grid(j).bandlimit for j in self.scales}

    @property
    def orientations(self) -> Array:
        """The orientations gamma_k, k pi / N, in radians; float64, shape (directions,).

        Of curvelets those of the finest scale, and `Wavelets.orientations_of` tells the others.
        """
        return self.wavelets.directionality.orientations_at(self.bandlimit).angles

    @functools.cached_property
    def shapes(self) -> dict[int | str, tuple[int, ...]]:
        """Shape of the scaling part and of each scale, for one signal."""
        found: dict[int | str, tuple[int, ...]] = {"scaling": self._scaling_transform.shape}
        for j in self.scales:
            grid = self.part_grid(j)
            found[j] = (self.wavelets.orientations_of(j).count, *grid.shape)
        return found

    @property
    def _tiling(self) -> Tiling:
        return self.tiling  # type: ignore[return-value]

    @property
    def _grid(self) -> Sampling:
        return self.sampling  # type: ignore[return-value]

    @property
    def _parameters(self) -> dict[str, Any]:
        found: dict[str, Any] = {
            "bandlimit": self.bandlimit,
            "spin": self.spin,
            "directions": self.directions,
            "dilation": self.dilation,
            "lowest_scale": self.lowest_scale,
            "sampling": self._grid.name,
            "multiresolution": self.multiresolution,
            "real": self.real,
        }
        plain = ScaleDiscretisedTiling
        if type(self._tiling) is not plain or self._tiling.quadrature != "exact":
            found["tiling"] = tiling_text(self._tiling)
        directionality = self.wavelets.directionality
        if not isinstance(directionality, SteerableDirectionality):
            found["directionality"] = repr(directionality)
            found["order_step"] = directionality.orientations_at(self.bandlimit).step
        if self.original_spin:
            found["original_spin"] = self.original_spin
        return found

    def grid_of(self, bandlimit: int) -> Sampling:
        """Return the grid for coefficients of a bandlimit: the full one without multiresolution."""
        return type(self._grid)(bandlimit if self.multiresolution else self.bandlimit)

    def part_grid(self, part: int | str) -> Sampling:
        """Return the grid of the scaling part, "scaling", or of one scale."""
        if part == "scaling":
            return self.grid_of(self._tiling.scaling_bandlimit)
        return self.grid_of(self._tiling.scale_bandlimit(int(part)))

    @functools.cached_property
    def _scaling_sums(self) -> ScalingSums:
        return ScalingSums(self.wavelets, self._dual, self.part_grid("scaling"), self.harmonic)

    @property
    def _scaling_transform(self) -> SpinHarmonicTransform:
        return self._scaling_sums.transform

    @functools.cached_property
    def _scale_sums(self) -> dict[int, ScaleSums]:
        pair, harmonic = (self.wavelets, self._dual), self.harmonic
        return {j: scale_sums(*pair, j, self.part_grid(j), harmonic) for j in self.scales}

    def _workspace(self, batch: int) -> Array:
        """Return room for the Fourier columns of any scale."""
        largest = max(one.sums.workspace_size(batch) for one in self._scale_sums.values())
        return np.empty(largest, dtype=self.dtype)

    def memory_estimate(self, batch: int = 1) -> dict[str, MemoryEstimate]:
        """Return the bytes that one call of each method takes.

        Parameters
        ----------
        batch : int, default 1
            Signals handed over in one call.

        Returns
        -------
        dict of str to MemoryEstimate
            By the name of the method.

        Raises
        ------
        ParameterError
            If ``batch`` is not an integer of at least 0.

        Examples
        --------
        >>> found = SpinWaveletTransform(2048, 2, 5).memory_estimate()["analysis_harmonic"]
        >>> found.peak < 1.5 * (found.input + found.output)
        True
        """
        batch = check_integer(batch, "batch", minimum=0)
        flm = batch * 16 * self.bandlimit**2
        maps = self.harmonic.memory_estimate(batch)
        sums = [one.sums for one in self._scale_sums.values()]
        wavelets = batch * sum(math.prod(one.maps_shape) * one.maps_itemsize for one in sums)
        scaling = self._scaling_transform.memory_estimate(batch)
        values = scaling["synthesis"].output + wavelets
        room = np.dtype(self.dtype).itemsize * max(one.workspace_size(batch) for one in sums)

        def working(name: str, *, before: int) -> int:
            """Of the scales, or of the scaling part while only so much of the output is there."""
            exact = name in {"analysis", "adjoint_analysis"}
            scratch = max(one.scratch_bytes(batch, quadrature=exact) for one in sums)
            # The scaling part has coefficients of its own.
            part = scaling["synthesis"].input + scaling[name].working
            return max(room + scratch, part - before)

        there = {
            name: MemoryEstimate(flm, values, working(name, before=wavelets))
            for name in ("synthesis", "adjoint_analysis")
        }
        back = {
            name: MemoryEstimate(values, flm, working(name, before=0))
            for name in ("analysis", "adjoint_synthesis")
        }
        return {
            "analysis_harmonic": there["synthesis"],
            "synthesis_harmonic": back["analysis"],
            "adjoint_analysis_harmonic": back["adjoint_synthesis"],
            "adjoint_synthesis_harmonic": there["adjoint_analysis"],
            "analysis": maps["analysis"].then(there["synthesis"]),
            "synthesis": back["analysis"].then(maps["synthesis"]),
            "adjoint_analysis": back["adjoint_synthesis"].then(maps["adjoint_analysis"]),
            "adjoint_synthesis": maps["adjoint_synthesis"].then(there["adjoint_analysis"]),
        }

    def _check_memory(self, call: str, batch: tuple[int, ...]) -> None:
        if self.max_memory is not None:
            self.memory_estimate(math.prod(batch))[call].require(self.max_memory, call)

    def _check_coefficients(self, call: str, coefficients: WaveletCoefficients) -> None:
        if isinstance(coefficients, WaveletCoefficients):
            self._check_memory(call, coefficients.scaling.shape[:-2])

    def _decompose(
        self, flm_of: Callable[[int | str], Array], *, adjoint: bool
    ) -> WaveletCoefficients:
        """Analyse every part, each from the harmonic coefficients ``flm_of`` gives for it."""
        scaling = self._scaling_sums.to_grid(flm_of("scaling"), adjoint=adjoint)
        workspace = self._workspace(math.prod(scaling.shape[:-2]))
        wavelets = {
            j: sums.to_grid(flm_of(j), workspace, adjoint=adjoint)
            for j, sums in self._scale_sums.items()
        }
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
        wanted = set(self.shapes) if parts is None else check_wanted(parts, self.shapes)
        flm = cleared_flm((*scaling.shape[:-2], self.bandlimit**2))
        rows = flm.reshape(-1, self.bandlimit**2)
        workspace = self._workspace(len(rows))
        for j, sums in self._scale_sums.items():
            if j in wanted:
                sums.add_to_harmonics(checked[j], rows, workspace, adjoint=adjoint)
        if self.real:
            fill_negative_orders(rows)
        if "scaling" in wanted:
            self._scaling_sums.add_to_harmonics(scaling, flm, adjoint=adjoint)
        # A signal of spin s has no degrees below |s|.
        flm[..., : self.spin**2] = 0.0
        return flm

    def _checked(self, coefficients: WaveletCoefficients) -> dict[int | str, Array]:
        return check_coefficients(coefficients, self.shapes, self._parameters)

    def arrays(self, coefficients: WaveletCoefficients) -> dict[int | str, Array]:
        """Return the arrays of coefficients, "scaling" first, after checking that they are ours.

        Raises
        ------
        ShapeError, ParameterError, DataError
            As `synthesis_harmonic`.
        """
        return self._checked(coefficients)

    def from_arrays(self, arrays: Mapping[int | str, Array]) -> WaveletCoefficients:
        """Return coefficients of this transform made of arrays; the inverse of `arrays`.

        Parameters
        ----------
        arrays : mapping of (int or "scaling") to ndarray
            Of ``shapes``, with one batch before them.

        Raises
        ------
        ShapeError, ParameterError, DataError
            As `synthesis_harmonic`.
        """
        wavelets = {int(key): values for key, values in arrays.items() if key != "scaling"}
        found = WaveletCoefficients(arrays["scaling"], wavelets, self._parameters)
        self._checked(found)
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
        MemoryBudgetError
            If the call would take more than ``max_memory``.
        """
        self._check_memory("analysis_harmonic", np.shape(flm)[:-1])
        flm = writable(check_flm(flm, self.bandlimit))
        self._warn_of_lost_degrees(flm)
        return self._decompose(lambda _: flm, adjoint=False)

    def analysis_by_part(self, flms: Mapping[int | str, Array]) -> WaveletCoefficients:
        """Compute each part's coefficients from harmonic coefficients of its own.

        What `analysis_harmonic` would give for each, of which one part is kept: for signals that
        were estimated scale by scale.

        Parameters
        ----------
        flms : mapping of (int or "scaling") to ndarray, shape (..., bandlimit**2), complex
            The coefficients for every scale and for the scaling part, all of one shape.

        Returns
        -------
        WaveletCoefficients
            As `analysis_harmonic` returns them.

        Raises
        ------
        ParameterError
            If a part is missing or not known.
        ShapeError
            If a last axis is not bandlimit**2 long.
        DataError
            If a coefficient is not a finite number.

        Examples
        --------
        >>> import numpy as np
        >>> transform = SpinWaveletTransform(8)
        >>> parts = dict.fromkeys(transform.shapes, np.ones(64))
        >>> coefficients = transform.analysis_by_part(parts)
        >>> (coefficients - transform.analysis_harmonic(np.ones(64))).norm()
        0.0
        """
        if set(flms) != set(self.shapes):
            msg = (
                f"flms has the parts {sorted(map(str, flms))}; it must have 'scaling' and the "
                f"scales {self.scales}, no more and no less."
            )
            raise ParameterError(msg)
        # Parts that share an array are checked once.
        checked = {id(flm): writable(check_flm(flm, self.bandlimit)) for flm in flms.values()}
        return self._decompose(lambda key: checked[id(flms[key])], adjoint=False)

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
            As `analysis` returns them, or changed. They may come from a transform of another spin,
            or of real signals, and of none that differs in anything else: the real and imaginary
            parts of a spin-2 analysis are scalar coefficients of E and B.
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
            If a value is not a finite number, or is complex with ``real``.
        ParameterError
            If the parameters are those of other wavelets, or a part is not known.
        MemoryBudgetError
            If the call would take more than ``max_memory``.
        """
        self._check_coefficients("synthesis_harmonic", coefficients)
        return self._recompose(coefficients, adjoint=False, parts=parts)

    def adjoint_analysis_harmonic(self, coefficients: WaveletCoefficients) -> Array:
        """Apply the adjoint of `analysis_harmonic`; shapes of `synthesis_harmonic`."""
        self._check_coefficients("adjoint_analysis_harmonic", coefficients)
        return self._recompose(coefficients, adjoint=True)

    def adjoint_synthesis_harmonic(self, flm: Array) -> WaveletCoefficients:
        """Apply the adjoint of `synthesis_harmonic`; shapes of `analysis_harmonic`."""
        self._check_memory("adjoint_synthesis_harmonic", np.shape(flm)[:-1])
        flm = writable(check_flm(flm, self.bandlimit))
        return self._decompose(lambda _: flm, adjoint=True)

    def coefficients_to_wigner(self, coefficients: WaveletCoefficients) -> dict[int | str, Array]:
        """Transform wavelet coefficients to the Wigner coefficients of every scale, exactly.

        Of what an analysis returned it gives what `analysis_wigner` would have; of other
        coefficients it is the part within each scale's bandlimit.

        Parameters
        ----------
        coefficients : WaveletCoefficients
            As for `synthesis_harmonic`.

        Returns
        -------
        dict
            As `analysis_wigner` returns it; `wigner_to_coefficients` is the inverse.

        Raises
        ------
        ShapeError, ParameterError, DataError
            As `synthesis_harmonic`.
        """
        checked, shapes = self._checked(coefficients), part_shapes(self.wavelets)
        scaling = self._scaling_transform.analysis(checked["scaling"])
        parts: dict[int | str, Array] = {"scaling": scaling[..., : shapes["scaling"][0]]}
        for j in self.scales:
            grid = self.part_grid(j)
            orientations = self.wavelets.orientations_of(j)
            rows = samples_to_orders(checked[j], grid, orientations, threads=self.threads)
            parts[j] = rows[..., : shapes[j][1]]
        return parts

    def wigner_to_coefficients(self, parts: Mapping[int | str, Array]) -> WaveletCoefficients:
        """Sample the Wigner coefficients of every scale at its places and orientations.

        Parameters
        ----------
        parts : mapping
            As `analysis_wigner` returns them, or changed. If the transform is real, they must be
            those of a real function, of which only m >= 0 is read.

        Returns
        -------
        WaveletCoefficients
            As `analysis_harmonic` returns them.

        Raises
        ------
        ParameterError, ShapeError, DataError
            As `synthesis_wigner`.
        """
        checked = check_parts(self.wavelets, parts)
        scaling = self._scaling_transform
        part = resize(checked["scaling"], scaling.bandlimit)
        stored, wavelets = stored_dtype(self.dtype, real=self.real), {}
        for j in self.scales:
            grid = self.part_grid(j)
            orientations = self.wavelets.orientations_of(j)
            values = orders_to_samples(
                checked[j], grid, orientations, real=self.real, threads=self.threads
            )
            wavelets[j] = values.astype(stored, copy=False)
        return WaveletCoefficients(scaling.synthesis(part), wavelets, self._parameters)

    def wavelet_map(
        self,
        scale: int | str,
        rotation: tuple[float, float, float] = (0.0, 0.0, 0.0),
        *,
        sampling: str | Sampling | None = None,
        nside: int | None = None,
    ) -> Array:
        """Compute a wavelet, or the scaling function, in pixel space, at any place and orientation.

        The coefficient of the signal there, W(rotation), is the integral of the signal times the
        conjugate of this map.

        Parameters
        ----------
        scale : int or "scaling"
            One of ``scales``, or the scaling function.
        rotation : tuple of float
            Euler angles alpha, beta, gamma in radians: longitude and colatitude of the centre,
            and the orientation. By default at the north pole.
        sampling : str or Sampling, optional
            The grid, whose bandlimit may be any from that of the scale on; the transform's own by
            default.
        nside : int, optional
            Makes a HEALPix map in ring order instead.

        Returns
        -------
        ndarray, shape (rings, phi) or (12 * nside**2,), complex128 (float64 if ``real``)
            Of the signal's spin: Q + iU for spin 2. For spin 0 it is real in any case.

        Raises
        ------
        ParameterError
            If there is no such scale, a parameter breaks its rule, the grid has not the bandlimit
            that the scale needs, or both grid and nside are given.

        Examples
        --------
        >>> import numpy as np
        >>> transform = SpinWaveletTransform(32, directions=3, real=True)
        >>> wavelet = transform.wavelet_map(3, (np.pi, np.pi / 2, 0.0), sampling="mwss")
        >>> [int(i) for i in np.unravel_index(np.argmax(np.abs(wavelet)), wavelet.shape)]
        [16, 32]
        """
        transform = self._map_transform(sampling, nside)
        flm = rotated_harmonics(self.wavelets, scale, rotation)
        if flm.size > transform.bandlimit**2:
            msg = (
                f"sampling={sampling!r} must have a bandlimit of at least that of scale {scale}, "
                f"{int(np.sqrt(flm.size))}; raise it."
            )
            raise ParameterError(msg)
        return transform.synthesis(resize(flm, transform.bandlimit))

    def _map_transform(
        self, sampling: str | Sampling | None, nside: int | None
    ) -> SpinHarmonicTransform | HealpixTransform:
        if nside is None:
            grid = self._grid if sampling is None else sampling
            size = grid.bandlimit if isinstance(grid, Sampling) else self.bandlimit
            return SpinHarmonicTransform(
                size, self.spin, sampling=grid, real=self.real, threads=self.threads
            )
        if sampling is not None:
            msg = f"sampling={sampling!r} cannot be given with nside={nside!r}; drop one."
            raise ParameterError(msg)
        return HealpixTransform(
            nside, self.bandlimit, self.spin, real=self.real, threads=self.threads
        )

    def analysis(self, maps: Array) -> WaveletCoefficients:
        """Compute coefficients from maps, shape (..., rings, phi); see `analysis_harmonic`."""
        self._check_memory("analysis", np.shape(maps)[:-2])
        flm = self.harmonic.analysis(maps)
        self._warn_of_lost_degrees(flm)
        return self._decompose(lambda _: flm, adjoint=False)

    def synthesis(self, coefficients: WaveletCoefficients) -> Array:
        """Compute maps, shape (..., rings, phi), from wavelet coefficients: inverts `analysis`."""
        self._check_coefficients("synthesis", coefficients)
        return self.harmonic.synthesis(self.synthesis_harmonic(coefficients))

    def adjoint_analysis(self, coefficients: WaveletCoefficients) -> Array:
        """Apply the adjoint of `analysis`: coefficients to maps."""
        self._check_coefficients("adjoint_analysis", coefficients)
        return self.harmonic.adjoint_analysis(self.adjoint_analysis_harmonic(coefficients))

    def adjoint_synthesis(self, maps: Array) -> WaveletCoefficients:
        """Apply the adjoint of `synthesis`: maps to coefficients."""
        self._check_memory("adjoint_synthesis", np.shape(maps)[:-2])
        return self.adjoint_synthesis_harmonic(self.harmonic.adjoint_synthesis(maps))
