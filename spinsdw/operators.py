"""Transforms as `scipy.sparse.linalg.LinearOperator`, for solvers that know vectors alone.

An operator takes and gives vectors; its ``domain`` and ``range`` turn what a transform takes and
gives into vectors and back. The dot product of vectors is that of the stored arrays, so adjoints
are those of the transforms (eq-adjoint).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse.linalg import LinearOperator

from spinsdw.errors import ParameterError
from spinsdw.ring_transform import HealpixTransform
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.vector_spaces import (
    ArraySpace,
    CoefficientSpace,
    PartSpace,
    VectorSpace,
    harmonic_space,
    wigner_space,
)
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform

__all__ = ["TransformOperator", "analysis_operator", "frame_operator", "synthesis_operator"]

Array = np.ndarray[Any, Any]
Transform: TypeAlias = (
    SpinWaveletTransform | SpinHarmonicTransform | WignerTransform | HealpixTransform
)

_DOORS = ("pixel", "harmonic", "wigner")


class TransformOperator(LinearOperator):  # type: ignore[misc] # scipy carries no types
    """A linear transform between two vector spaces, with its adjoint.

    Parameters
    ----------
    call, adjoint : callable
        What takes the objects of one space to those of the other, single or in a batch.
    domain, range_ : VectorSpace
        The spaces of what ``call`` takes and gives.

    Attributes
    ----------
    domain, range : VectorSpace
        Their ``to_vector`` and ``from_vector`` go from objects to vectors and back.
    shape : tuple of int
        Entries of the vectors given and taken.
    dtype : dtype
        complex128, or float64 of real transforms, whose coefficients are packed: a complex vector
        is taken as real and imaginary part.
    """

    def __init__(
        self,
        call: Callable[[Any], Any],
        adjoint: Callable[[Any], Any],
        domain: VectorSpace,
        range_: VectorSpace,
    ) -> None:
        super().__init__(np.result_type(domain.dtype, range_.dtype), (range_.size, domain.size))
        self.domain, self.range = domain, range_
        self._call, self._call_adjoint = call, adjoint

    def _apply(
        self, call: Callable[[Any], Any], vectors: Array, spaces: tuple[VectorSpace, VectorSpace]
    ) -> Array:
        """Apply a transform to columns."""
        if self.dtype.kind == "f" and np.iscomplexobj(vectors):
            real, imaginary = (
                self._apply(call, part, spaces) for part in (vectors.real, vectors.imag)
            )
            return real + 1j * imaginary
        source, target = spaces
        found = target.to_vector(call(source.from_vector(vectors.T))).T
        # A transform that stores single precision gives it, and is asked in double all the same.
        return np.asarray(found, dtype=self.dtype)

    def _matmat(self, vectors: Array) -> Array:
        return self._apply(self._call, vectors, (self.domain, self.range))

    def _rmatmat(self, vectors: Array) -> Array:
        return self._apply(self._call_adjoint, vectors, (self.range, self.domain))

    def _matvec(self, vector: Array) -> Array:
        return self._apply(self._call, vector.ravel(), (self.domain, self.range))

    def _rmatvec(self, vector: Array) -> Array:
        return self._apply(self._call_adjoint, vector.ravel(), (self.range, self.domain))

    def _adjoint(self) -> TransformOperator:
        return TransformOperator(self._call_adjoint, self._call, self.range, self.domain)


def _door_of(transform: Transform, door: str | None) -> str:
    """Return the door of a wavelet transform, and "" for the transforms that have one only."""
    if not isinstance(transform, Transform):
        msg = (
            f"transform={transform!r} must be a SpinWaveletTransform, SpinHarmonicTransform, "
            "WignerTransform or HealpixTransform; make one."
        )
        raise ParameterError(msg)
    if not isinstance(transform, SpinWaveletTransform):
        if door is not None:
            msg = f"door={door!r} is for wavelet transforms, and others have one; leave it out."
            raise ParameterError(msg)
        return ""
    if door not in {None, *_DOORS}:
        msg = f"door={door!r} must be one of {', '.join(_DOORS)}; pixel is from maps to samples."
        raise ParameterError(msg)
    return door or "pixel"


def _spaces(transform: Transform, door: str) -> tuple[VectorSpace, VectorSpace]:
    """Return the spaces of what a transform analyses and of what it makes of it."""
    real = transform.real
    if isinstance(transform, SpinWaveletTransform):
        if door == "pixel":
            signals: VectorSpace = ArraySpace(transform.harmonic.shape, real)
        else:
            signals = harmonic_space(transform.bandlimit, real=real)
        return signals, PartSpace(transform) if door == "wigner" else CoefficientSpace(transform)
    signals = ArraySpace(transform.shape, real)
    if isinstance(transform, WignerTransform):
        return signals, wigner_space(transform.bandlimit, transform.orders, real=real)
    return signals, harmonic_space(transform.bandlimit, real=real)


def _method(transform: Transform, name: str, door: str) -> Callable[[Any], Any]:
    suffix = "" if door in {"", "pixel"} else f"_{door}"
    method: Callable[[Any], Any] = getattr(transform, name + suffix)
    return method


def analysis_operator(transform: Transform, door: str | None = None) -> TransformOperator:
    """Return the analysis of a transform as an operator.

    Parameters
    ----------
    transform : SpinWaveletTransform, SpinHarmonicTransform or WignerTransform
    door : {"pixel", "harmonic", "wigner"}, optional
        Of a wavelet transform: from maps to samples of the coefficients (by default), from
        harmonic coefficients to samples, or from these to Wigner coefficients.

    Returns
    -------
    TransformOperator
        From signals to coefficients. Its ``H`` is the adjoint analysis. Maps have more samples
        than a band-limited signal has numbers: least squares through the pixel door give a map of
        the right harmonic coefficients, and through the other doors these.

    Raises
    ------
    ParameterError
        If the transform is another, has no analysis, or has no such door.

    Examples
    --------
    >>> from scipy.sparse.linalg import lsmr
    >>> operator = analysis_operator(SpinWaveletTransform(8, spin=2, directions=2), "harmonic")
    >>> operator.shape, operator.dtype
    ((549, 64), dtype('complex128'))
    >>> flm = np.ones(64)
    >>> flm[:4] = 0
    >>> solution = lsmr(operator, operator @ flm, atol=1e-12, btol=1e-12)[0]
    >>> bool(np.allclose(solution, flm, rtol=0, atol=1e-9))
    True
    """
    door = _door_of(transform, door)
    if isinstance(transform, HealpixTransform):
        msg = (
            f"transform={transform!r} has no analysis; take the adjoint of its synthesis_operator, "
            "or healpix.map_to_flm."
        )
        raise ParameterError(msg)
    signals, coefficients = _spaces(transform, door)
    return TransformOperator(
        _method(transform, "analysis", door),
        _method(transform, "adjoint_analysis", door),
        signals,
        coefficients,
    )


def synthesis_operator(transform: Transform, door: str | None = None) -> TransformOperator:
    """Return the synthesis of a transform as an operator.

    Parameters
    ----------
    transform : SpinWaveletTransform, SpinHarmonicTransform, WignerTransform or HealpixTransform
    door : {"pixel", "harmonic", "wigner"}, optional
        As for `analysis_operator`.

    Returns
    -------
    TransformOperator
        From coefficients to signals. Its ``H`` is the adjoint synthesis.

    Raises
    ------
    ParameterError
        If the transform is another, or has no such door.

    Examples
    --------
    >>> transform = SpinHarmonicTransform(8, real=True)
    >>> operator = synthesis_operator(transform)
    >>> operator.shape, operator.dtype
    ((120, 64), dtype('float64'))
    >>> maps = operator.range.from_vector(operator @ np.eye(64)[0])
    >>> maps.shape, float((maps[3, 5] * np.sqrt(4 * np.pi)).round(12))
    ((8, 15), 1.0)
    """
    door = _door_of(transform, door)
    signals, coefficients = _spaces(transform, door)
    return TransformOperator(
        _method(transform, "synthesis", door),
        _method(transform, "adjoint_synthesis", door),
        coefficients,
        signals,
    )


def frame_operator(transform: SpinWaveletTransform) -> TransformOperator:
    """Return the frame operator of the wavelets, on harmonic coefficients (eq-frame-operator).

    Unlike ``A.H @ A`` of an analysis operator, which adds up samples, it is made of integrals over
    the sphere and over rotations: a number for each degree, which is 1 for tight frames. Its
    extreme eigenvalues are ``transform.wavelets.frame_bounds``.

    Parameters
    ----------
    transform : SpinWaveletTransform

    Returns
    -------
    TransformOperator
        Equal to its adjoint.

    Raises
    ------
    ParameterError
        If it is no wavelet transform.

    Examples
    --------
    >>> transform = SpinWaveletTransform(8, directions=2, original_spin=1)
    >>> operator = frame_operator(transform)
    >>> [float(bound) for bound in np.round(transform.wavelets.frame_bounds, 10)]
    [2.0, 56.0]
    >>> float((operator @ np.eye(64)[-1])[-1].real.round(10))
    56.0
    """
    if not isinstance(transform, SpinWaveletTransform):
        msg = f"transform={transform!r} must be a SpinWaveletTransform; make one."
        raise ParameterError(msg)
    space = harmonic_space(transform.bandlimit, real=transform.real)
    response = transform.wavelets.frame_response
    factor = np.repeat(response, 2 * np.arange(transform.bandlimit) + 1)

    def multiply(flm: Array) -> Array:
        return flm * factor

    return TransformOperator(multiply, multiply, space, space)
