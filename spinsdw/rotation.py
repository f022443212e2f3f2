"""Rotation of harmonic coefficients, of fields of any spin."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.harmonics import orders, read_flm
from spinsdw.parallel import resolve_threads, run_tasks, threads_for
from spinsdw.signals import check_flag, writable

__all__ = ["check_rotation", "rotate_flm"]

Array = np.ndarray[Any, Any]

# Rows m of one task, which share the blocks they read; a chunk of degrees starts them all.
_ROWS = 16


def check_rotation(rotation: Sequence[float]) -> tuple[float, float, float]:
    """Return Euler angles as floats with 0 <= beta <= pi, the same rotation.

    Parameters
    ----------
    rotation : sequence of 3 floats
        alpha, beta, gamma in radians, zyz (eq-wigner).

    Returns
    -------
    tuple of 3 floats

    Raises
    ------
    ParameterError
        If it is not three finite numbers.

    Examples
    --------
    >>> check_rotation((0, -1, 0)) == (np.pi, 1.0, np.pi)
    True
    """
    values = np.asarray(rotation)
    is_usable = values.shape == (3,) and values.dtype.kind in "biuf"
    if not is_usable or not np.isfinite(values).all():
        msg = (
            f"rotation={rotation!r} must be three finite angles (alpha, beta, gamma); "
            "give Euler angles in radians, about z, y and z."
        )
        raise ParameterError(msg)
    alpha, beta, gamma = (float(value) for value in values)
    # The nearest multiple of 2 pi: the remainder is exact.
    beta = float(np.remainder(beta, 2 * np.pi)) if not -np.pi <= beta <= np.pi else beta
    beta = beta - 2 * np.pi if beta > np.pi else beta
    if beta < 0:
        # d^l_mn(-beta) = (-1)^(m-n) d^l_mn(beta)
        return alpha + np.pi, -beta, gamma + np.pi
    return alpha, beta, gamma


@functools.lru_cache(maxsize=8)
def _tables(bandlimit: int) -> tuple[Array, Array]:
    """tau_l with tau_l tau_{l-1} = l, l <= L, and the square roots of the numbers up to 2 L + 1."""
    tau = np.ones(bandlimit + 2)
    for parity in (0, 1):
        el = np.arange(2 + parity, bandlimit + 2, 2)
        tau[el] = np.cumprod(el / (el - 1))
    return tau, np.sqrt(np.arange(2.0 * bandlimit + 2))


@dataclass(frozen=True, eq=False)
class _Rotator:
    """What rotating one set of coefficients takes."""

    bandlimit: int
    angles: tuple[float, float, float]
    real: bool
    threads: int

    @property
    def _starts(self) -> Array:
        """Number of the first block of each chunk of degrees, and of all."""
        from spinsdw.compiled.rotation_sums import CHUNK, LANES

        n_chunks = -(-self.bandlimit // CHUNK)
        orders = np.minimum(CHUNK * np.arange(1, n_chunks + 1), self.bandlimit)
        return np.concatenate([[0], np.cumsum(-(-orders // LANES))]).astype(np.int64)

    def _blocks(self, flm: Array, starts: Array) -> Array:
        from spinsdw.compiled.rotation_sums import CHUNK, LANES, fill_blocks

        rows = 4 if self.real else 6
        blocks = np.empty((int(starts[-1]), CHUNK, rows, LANES))
        phases = np.exp(-1j * self.angles[2] * np.arange(self.bandlimit))
        tasks = [
            functools.partial(
                fill_blocks,
                tile,
                self.bandlimit,
                self.real,
                flm,
                phases,
                _tables(self.bandlimit),
                starts,
                blocks,
            )
            for tile in range(int(starts[-1] - starts[-2]))
        ]
        run_tasks(tasks, self.threads)
        return blocks

    def rotate(self, flm: Array, out: Array) -> None:
        """Fill ``out`` with the rotated coefficients."""
        from spinsdw.compiled.rotation_sums import fill_rotated

        if self.angles[1] == 0.0:
            turn = self.angles[0] + self.angles[2]
            np.multiply(flm, np.exp(-1j * turn * orders(self.bandlimit)), out=out)
            return
        starts = self._starts
        blocks = self._blocks(flm, starts)
        alpha, beta, _ = self.angles
        half = np.array([np.cos(beta / 2), np.sin(beta / 2)])
        phases = np.exp(-1j * alpha * np.arange(self.bandlimit))
        rows = range(0, self.bandlimit, _ROWS)
        run_tasks(
            [
                functools.partial(
                    fill_rotated,
                    m,
                    min(m + _ROWS, self.bandlimit),
                    self.bandlimit,
                    half,
                    _tables(self.bandlimit),
                    phases,
                    starts,
                    blocks,
                    out,
                )
                for m in rows
            ],
            self.threads,
        )


def rotate_flm(
    flm: Array, rotation: Sequence[float], *, real: bool = False, threads: int | None = None
) -> Array:
    """Rotate fields of any spin: g_lm = sum_n D^l_mn(alpha, beta, gamma) f_ln (eq-rotation).

    The field is turned, not the axes: about z by gamma, then about y by beta, then about z by
    alpha. What was at the north pole comes to colatitude beta and longitude alpha.

    Parameters
    ----------
    flm : array_like, shape (..., bandlimit**2)
        [(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]; leading axes are a batch.
        The spin does not matter.
    rotation : sequence of 3 floats
        Euler angles alpha, beta, gamma in radians, zyz. The inverse is (-gamma, -beta, -alpha),
        which is also the adjoint.
    real : bool, default False
        Whether the fields are real scalars, f_{l,-m} = (-1)^m conj(f_lm): half the work. Of their
        coefficients those with m >= 0 are read.
    threads : int, optional
        Threads to use; all cores when None. Results do not depend on it.

    Returns
    -------
    ndarray, shape (..., bandlimit**2), complex128
        The rotated coefficients.

    Raises
    ------
    ParameterError
        If the rotation is not three finite numbers.
    ShapeError
        If the last axis is not a perfect square long.
    DataError
        If a coefficient is not a finite number.

    Notes
    -----
    Cost O(L^3), by a recursion in degree for d^l_mn(beta). The relative error stays below L times
    machine epsilon, and below L^1.5 where beta is within 1 / L of 0 or pi.

    Examples
    --------
    A zonal field turned by a right angle about y has its pole on the equator.

    >>> turned = rotate_flm([0, 0, 1, 0], (0, np.pi / 2, 0))
    >>> bool(np.allclose(turned, [0, 0.5**0.5, 0, -(0.5**0.5)], rtol=0, atol=1e-15))
    True
    """
    angles = check_rotation(rotation)
    values, bandlimit = read_flm(flm)
    count = threads_for(bandlimit, resolve_threads(threads))
    rotator = _Rotator(bandlimit, angles, check_flag(real, "real"), count)
    batch = writable(values).reshape(-1, bandlimit**2)
    found = np.empty_like(batch)
    for one, out in zip(batch, found, strict=True):
        rotator.rotate(one, out)
    return found.reshape(values.shape)
