"""`WaveletCoefficients`: the scaling part and one array per scale, with their parameters."""

from __future__ import annotations

import math
import numbers
import operator
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from spinsdw.directionality import Orientations
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.sampling import resolve_sampling
from spinsdw.shrinkage import check_level, check_rule, fitting, shrink
from spinsdw.signals import check_flag, refuse_masked
from spinsdw.steering import strongest_orientations

__all__ = ["WaveletCoefficients"]

Array = np.ndarray[Any, Any]

_SINGLE = (np.dtype(np.complex64), np.dtype(np.float32))
# Rows that a sum over values of single precision converts at a time.
_ROWS = 64


def _held(values: Array, name: str) -> Array:
    """Return a view that cannot be written through."""
    if np.ma.is_masked(values):
        msg = f"{name} has masked entries, and every value must be known; fill them first."
        raise DataError(msg)
    view = np.asarray(values).view()
    view.setflags(write=False)
    return view


def _is_number(value: object) -> bool:
    """Tell whether a value is one number: Python's, or an array without axes."""
    if isinstance(value, np.ndarray):
        return value.ndim == 0 and value.dtype.kind in "biufc"
    return isinstance(value, numbers.Complex)


def _keeping(values: Array, factor: Any) -> np.dtype[Any] | None:
    """Return the type of values times a factor where they are single: single. None: as ever."""
    if values.dtype not in _SINGLE:
        return None
    is_complex = np.result_type(values, factor).kind == "c"
    return np.dtype(np.complex64 if is_complex else np.float32)


def _square_sum(values: Array) -> float:
    """Return the sum of the squared moduli in double precision, a few rows at a time."""
    if values.dtype not in _SINGLE:
        return float(np.vdot(values, values).real)
    rows = values.reshape(-1, values.shape[-1])
    wide = np.complex128 if values.dtype.kind == "c" else np.float64
    parts = (rows[first : first + _ROWS].astype(wide) for first in range(0, len(rows), _ROWS))
    return sum(float(np.vdot(part, part).real) for part in parts)


class WaveletCoefficients:
    """Wavelet and scaling coefficients of one signal, or of a batch of signals.

    Parameters
    ----------
    scaling : ndarray, shape (..., rings, phi)
        Scaling coefficients, a scalar field.
    wavelets : mapping of int to ndarray, shape (..., directions, rings, phi)
        Coefficients of each scale j at orientations k pi / N. Of curvelets a scale has
        orientations of its own, fewer the coarser it is.
    parameters : mapping
        What made them: bandlimit, spin, directions, dilation, lowest_scale, sampling,
        multiresolution, real; tiling and directionality, texts, where these are of another kind,
        the latter with order_step, the distance of its orders; and original_spin, where there is
        one.

    Raises
    ------
    ShapeError
        If a scale has not the directions of the parameters, or not the batch of the scaling part.
    DataError
        If an entry is masked.

    Notes
    -----
    The arrays are held as they are, not copied, and can only be read: take ``a[j].copy()`` to
    change one.
    Those of single precision stay so under factors, whatever the factors' type.
    Arithmetic acts on every number: ``a + b``, ``a - b``, ``2 * a``, and ``a * {j: factor}`` scale
    by scale, "scaling" being the key of the scaling part; `map` applies any function and
    `threshold` shrinks. `norm` is a sum over the samples; the integrals that analysis preserves are
    in `spinsdw.energy`.

    Examples
    --------
    >>> import numpy as np
    >>> from spinsdw.wavelet_transform import SpinWaveletTransform
    >>> transform = SpinWaveletTransform(16, spin=2, directions=3)
    >>> coefficients = transform.analysis_harmonic(np.ones(256))
    >>> coefficients[2].shape
    (3, 8, 15)
    >>> (2 * coefficients - coefficients - coefficients).norm()
    0.0
    """

    __slots__ = ("_parameters", "_scaling", "_wavelets")
    # Let numpy scalars and arrays leave multiplication to this class.
    __array_ufunc__ = None

    def __init__(
        self, scaling: Array, wavelets: Mapping[int, Array], parameters: Mapping[str, Any]
    ) -> None:
        self._scaling = _held(scaling, "scaling part")
        self._wavelets = {int(j): _held(wavelets[j], f"scale {j}") for j in sorted(wavelets)}
        self._parameters = MappingProxyType(dict(parameters))
        for j, values in self._wavelets.items():
            batch_agrees = values.shape[:-3] == self._scaling.shape[:-2]
            if values.ndim < 3 or not self._may_have(values.shape[-3]) or not batch_agrees:
                directions = self._parameters.get("directions")
                msg = (
                    f"scale {j} has shape {values.shape}; it must be (..., {directions}, rings, "
                    f"phi) with the batch of the scaling part, {self._scaling.shape[:-2]}."
                )
                raise ShapeError(msg)

    def _may_have(self, orientations: int) -> bool:
        """Tell whether a scale can have so many: of curvelets the coarser ones have fewer."""
        directions: Any = self._parameters.get("directions")
        if "directionality" in self._parameters:
            return 1 <= orientations <= directions
        return orientations == directions

    # Built anew from its parts: the mapping of the parameters cannot be pickled itself.
    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._scaling, self._wavelets, dict(self._parameters))

    @property
    def scaling(self) -> Array:
        """Scaling coefficients, shape (..., rings, phi); read-only."""
        return self._scaling

    @property
    def scales(self) -> tuple[int, ...]:
        """The scales j held, increasing: from large to small structures."""
        return tuple(self._wavelets)

    @property
    def parameters(self) -> Mapping[str, Any]:
        """What made the coefficients; read-only."""
        return self._parameters

    @property
    def shapes(self) -> dict[int | str, tuple[int, ...]]:
        """Shape of the scaling part and of every scale."""
        return {key: values.shape for key, values in self._items()}

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(values.nbytes for _, values in self._items())

    def _items(self) -> Iterator[tuple[int | str, Array]]:
        yield "scaling", self._scaling
        yield from self._wavelets.items()

    def __getitem__(self, scale: int) -> Array:
        """Return the coefficients of a scale, shape (..., directions, rings, phi); read-only."""
        try:
            return self._wavelets[scale]
        except (KeyError, TypeError):
            msg = f"scale={scale!r} is not held; the scales are {self.scales}."
            raise ParameterError(msg) from None

    def __len__(self) -> int:
        return len(self._wavelets)

    def __iter__(self) -> Iterator[int]:
        return iter(self._wavelets)

    def __repr__(self) -> str:
        kept = ("bandlimit", "spin", "directions", "dilation", "lowest_scale", "sampling")
        parameters = ", ".join(
            f"{name}={self._parameters[name]!r}" for name in kept if name in self._parameters
        )
        lines = [f"WaveletCoefficients({parameters}): {self.nbytes / 2**20:.3g} MiB"]
        lines += [
            f"  {'scaling' if key == 'scaling' else f'scale {key}'}: "
            f"{' x '.join(map(str, values.shape))} {values.dtype}"
            for key, values in self._items()
        ]
        return "\n".join(lines)

    def _with(self, function: Callable[[int | str, Array], Array]) -> WaveletCoefficients:
        scaling = function("scaling", self._scaling)
        wavelets = {j: function(j, values) for j, values in self._wavelets.items()}
        return WaveletCoefficients(scaling, wavelets, self._parameters)

    def copy(self) -> WaveletCoefficients:
        """Return coefficients with arrays of their own."""
        return self._with(lambda _, values: values.copy())

    def reshape_batch(self, shape: tuple[int, ...]) -> WaveletCoefficients:
        """Return the same numbers with other leading axes.

        Parameters
        ----------
        shape : tuple of int
            The batch wanted, of as many signals as now; ``()`` for one signal.

        Returns
        -------
        WaveletCoefficients
            Views of the arrays where numpy can give them.

        Raises
        ------
        ShapeError
            If the number of signals differs.
        """
        batch = self._scaling.shape[:-2]
        if math.prod(batch) != math.prod(shape):
            msg = (
                f"shape={shape} holds {math.prod(shape)} signals, but the batch {batch} has "
                f"{math.prod(batch)}; keep their number."
            )
            raise ShapeError(msg)

        def reshape(key: int | str, values: Array) -> Array:
            own = values.shape[-2:] if key == "scaling" else values.shape[-3:]
            return values.reshape(*shape, *own)

        return self._with(reshape)

    def map(
        self, function: Callable[[Array], Array] | Mapping[Any, Callable[[Array], Array]]
    ) -> WaveletCoefficients:
        """Apply a function of arrays to the scaling part and to every scale, or one to each.

        Parameters
        ----------
        function : callable or mapping of int or "scaling" to callable
            Takes an array and returns one of the same shape. Parts that a mapping leaves out stay
            as they are.

        Returns
        -------
        WaveletCoefficients
            The results.

        Raises
        ------
        ShapeError
            If a function changes a shape.
        ParameterError
            If a key of the mapping names no part.

        Examples
        --------
        >>> wavelets = {0: np.ones((1, 1, 1)), 1: np.ones((1, 2, 3))}
        >>> one = WaveletCoefficients(np.zeros((1, 1)), wavelets, {"directions": 1})
        >>> float(one.map({1: np.negative})[1].sum())
        -6.0
        """
        functions = function
        if isinstance(functions, Mapping):
            self._check_keys(functions, "functions")

        def apply(key: int | str, values: Array) -> Array:
            call = functions.get(key) if isinstance(functions, Mapping) else functions
            if call is None:
                return values
            found = call(values)
            refuse_masked(found, "what function returned")
            result = np.asarray(found)
            if result.shape != values.shape:
                msg = (
                    f"function turned the shape {values.shape} of {key} into {result.shape}; "
                    "it must keep it."
                )
                raise ShapeError(msg)
            return result

        return self._with(apply)

    def norm(self) -> float:
        """Return the root of the sum of squares of all stored numbers (not an integral)."""
        return math.sqrt(sum(_square_sum(values) for _, values in self._items()))

    def _combine(
        self, other: WaveletCoefficients, operation: Callable[[Array, Array], Array]
    ) -> WaveletCoefficients:
        if self.shapes != other.shapes:
            msg = f"coefficients with shapes {self.shapes} and {other.shapes} cannot be combined."
            raise ShapeError(msg)
        if dict(self._parameters) != dict(other._parameters):
            msg = (
                f"coefficients of different transforms cannot be combined: "
                f"{dict(self._parameters)} and {dict(other._parameters)}."
            )
            raise ParameterError(msg)
        others = dict(other._items())
        return self._with(lambda key, values: operation(values, others[key]))

    def __add__(self, other: WaveletCoefficients) -> WaveletCoefficients:
        if not isinstance(other, WaveletCoefficients):
            return NotImplemented
        return self._combine(other, operator.add)

    def __sub__(self, other: WaveletCoefficients) -> WaveletCoefficients:
        if not isinstance(other, WaveletCoefficients):
            return NotImplemented
        return self._combine(other, operator.sub)

    def _check_keys(self, given: Mapping[Any, Any], name: str) -> None:
        unknown = set(given) - {"scaling", *self.scales}
        if unknown:
            msg = f"{name} for {sorted(map(str, unknown))} match no scale of {self.scales}."
            raise ParameterError(msg)

    def _weigh(self, factors: Mapping[Any, Any]) -> WaveletCoefficients:
        self._check_keys(factors, "factors")

        def multiply(key: int | str, values: Array) -> Array:
            factor = fitting(factors.get(key, 1.0), values, key, "factor")
            return np.multiply(values, factor, dtype=_keeping(values, factor))

        return self._with(multiply)

    def threshold(
        self, thresholds: float | Mapping[Any, Any], *, rule: str = "hard"
    ) -> WaveletCoefficients:
        """Shrink the coefficients that are small: hard, soft or by the garrote in between.

        Parameters
        ----------
        thresholds : float or mapping of int or "scaling" to float or array
            T >= 0. A number holds for every scale and leaves the scaling part; a mapping holds for
            the parts it names, by a number or by an array that broadcasts to the part's shape.
        rule : {"hard", "soft", "garrote"}
            What multiplies w where ``|w| > T``: 1, ``1 - T / |w|`` or ``1 - T**2 / |w|**2``. Zero
            elsewhere. The modulus is shrunk, so that phases stay.

        Returns
        -------
        WaveletCoefficients
            The shrunk coefficients.

        Raises
        ------
        ParameterError
            If the rule or a part is not known.
        ShapeError
            If an array does not broadcast to its part.
        DataError
            If a threshold is negative or not a number.

        Examples
        --------
        >>> one = WaveletCoefficients(np.ones((1, 1)), {0: np.full((1, 1, 1), -3.0)},
        ...                           {"directions": 1})
        >>> float(one.threshold(1.0, rule="soft")[0].item())
        -2.0
        """
        check_rule(rule)
        given = thresholds if isinstance(thresholds, Mapping) else dict.fromkeys(self, thresholds)
        self._check_keys(given, "thresholds")

        def shrink_part(key: int | str, values: Array) -> Array:
            if key not in given:
                return values
            level = fitting(given[key], values, key, "threshold")
            return shrink(values, check_level(level, key), rule)

        return self._with(shrink_part)

    def __mul__(self, factor: complex | Mapping[Any, Any]) -> WaveletCoefficients:
        if isinstance(factor, Mapping):
            return self._weigh(factor)
        if not _is_number(factor):
            return NotImplemented
        return self._with(
            lambda _, values: np.multiply(values, factor, dtype=_keeping(values, factor))
        )

    __rmul__ = __mul__

    def __truediv__(self, divisor: complex) -> WaveletCoefficients:
        if not _is_number(divisor):
            return NotImplemented
        return self._with(
            lambda _, values: np.true_divide(values, divisor, dtype=_keeping(values, divisor))
        )

    def __neg__(self) -> WaveletCoefficients:
        return self._with(lambda _, values: -values)

    def steer(self, angle: float) -> dict[int, Array]:
        """Compute every scale's coefficients at one orientation, exactly.

        W(gamma) = sum_k z(gamma - gamma_k) W(gamma_k), z(g) = (1/N) sum_n e^{i n g} over the
        orders of the wavelet.

        Parameters
        ----------
        angle : float
            gamma in radians.

        Returns
        -------
        dict of int to ndarray, shape (..., rings, phi)
            The coefficients of each scale at that orientation.

        Raises
        ------
        ParameterError
            If the angle is not one real number.
        DataError
            If it is not finite.
        """
        if np.ndim(angle) != 0 or np.asarray(angle).dtype.kind not in "iuf":
            msg = f"angle={angle!r} must be one real number, in radians; steer once for each."
            raise ParameterError(msg)
        found = {}
        for j, values in self._wavelets.items():
            weights = self._orientations(j).steering_weights(angle)
            stored = _keeping(values, weights) or weights.dtype
            found[j] = np.einsum("k,...ktp->...tp", weights.astype(stored), values)
        return found

    def strongest_orientation(
        self, scale: int, *, modulus: bool | None = None
    ) -> tuple[Array, Array]:
        """Find the orientation of the strongest response at every place, and that response.

        The maximum over all gamma of W(gamma), which steering makes a trigonometric polynomial, to
        rounding (eq-strongest).

        Parameters
        ----------
        scale : int
            One of ``scales``.
        modulus : bool, optional
            Whether to maximise the modulus, or the value itself, which must be real then. By
            default the modulus of complex coefficients and the value of real ones.

        Returns
        -------
        angles, strengths : ndarray, shape (..., rings, phi), float64
            gamma in radians, and W or its modulus there. Angles are below pi, after which all
            repeats; those of the values of even N, to which half a turn gives the other sign, and
            those of curvelets that are not centred, below 2 pi. Where all are equal the angle
            means nothing.

        Raises
        ------
        ParameterError
            If there is no such scale, or ``modulus`` is no bool.
        DataError
            If the value of complex coefficients is asked for.

        Examples
        --------
        >>> from spinsdw.wavelet_transform import SpinWaveletTransform
        >>> transform = SpinWaveletTransform(16, spin=2, directions=3)
        >>> coefficients = transform.analysis_harmonic(np.ones(256))
        >>> angles, strengths = coefficients.strongest_orientation(3)
        >>> angles.shape
        (16, 31)
        >>> steered = coefficients.steer(angles[4, 5])[3][4, 5]
        >>> bool(np.isclose(abs(steered), strengths[4, 5], rtol=1e-14))
        True
        """
        values = self[scale]
        is_complex = np.iscomplexobj(values)
        modulus = is_complex if modulus is None else check_flag(modulus, "modulus")
        if is_complex and not modulus:
            msg = (
                f"modulus=False needs real coefficients, and scale {scale} is complex; take the "
                "modulus, or map np.real over the coefficients."
            )
            raise DataError(msg)
        return strongest_orientations(values, self._orientations(scale), modulus=modulus)

    def to_healpix(self, scale: int | str, nside: int, *, threads: int | None = None) -> Array:
        """Evaluate the coefficients of one scale at the pixel centres of HEALPix, exactly.

        What `healpix.coefficients_to_healpix` does, by what the coefficients know of themselves.

        Parameters
        ----------
        scale : int or "scaling"
            The part wanted.
        nside : int
            Resolution; it may be coarse, for no transform back is meant.
        threads : int, optional
            Threads to use; all cores when None.

        Returns
        -------
        ndarray, shape (..., directions, 12 * nside**2)
            RING order, each orientation a map, of the type of the coefficients; without the axis of
            directions for the scaling part.

        Raises
        ------
        ParameterError
            If there is no such part, ``nside`` is no HEALPix resolution, or the coefficients name
            no sampling of this package.
        ShapeError
            If the part's shape is not that of the sampling.

        Examples
        --------
        >>> from spinsdw.wavelet_transform import SpinWaveletTransform
        >>> transform = SpinWaveletTransform(16, spin=2, directions=3)
        >>> transform.analysis_harmonic(np.ones(256)).to_healpix(2, nside=4).shape
        (3, 192)
        """
        from spinsdw.healpix.coefficients import samples_to_healpix

        is_scaling = isinstance(scale, str) and scale == "scaling"
        values = self._scaling if is_scaling else self[scale]  # type: ignore[index]
        # All grids have 2 L - 1 points a ring, and MWSS has 2 L.
        grid = resolve_sampling(self._parameters.get("sampling", ""), (values.shape[-1] + 1) // 2)
        if values.shape[-2:] != grid.shape:
            name = "scaling part" if is_scaling else f"scale {scale}"
            rings, phi = grid.shape
            msg = (
                f"{name} has shape {values.shape}; it must be (..., {rings}, {phi}), as {grid!r} "
                "has it."
            )
            raise ShapeError(msg)
        orientations = None if is_scaling else self._orientations(scale)  # type: ignore[arg-type]
        return samples_to_healpix(values, grid, orientations, nside, threads=threads)

    def _orientations(self, scale: int) -> Orientations:
        count = self._wavelets[scale].shape[-3]
        return Orientations(count, self._parameters.get("order_step", 2))
