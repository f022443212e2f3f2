"""Compile every public path at a small size, so that no later call has to wait for it.

The compiled loops are made for types, not for sizes: once a path has run at a small bandlimit, and
its machine code is cached, it starts at once at any other, in this process and in later ones.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from spinsdw.grid_sums import LARGE_BANDLIMIT
from spinsdw.healpix import map_to_flm, pixel_directions
from spinsdw.masks import cap_mask
from spinsdw.polarisation import EBSeparator
from spinsdw.rotation import rotate_flm
from spinsdw.sampling import MW
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform

__all__ = ["warm_up"]

Array = np.ndarray[Any, Any]

BANDLIMIT = 8
NSIDE = 4
# A grid for each kind of quadrature, with and without mirrored rings.
SAMPLING_NAMES = ("mw", "mwss", "gl")
# One direction, an even and an odd number of them: their orders run through different branches.
DIRECTIONS = (1, 2, 3)
# Circles of the first are transformed as they are, those of the second are padded before.
CIRCLES = (BANDLIMIT, 21)


def warm_up(threads: int | None = None) -> dict[str, float]:
    """Run every transform and the separation once at a small size.

    Parameters
    ----------
    threads : int, optional
        Threads to use; all cores when None.

    Returns
    -------
    dict of str to float
        What was run, and the wall time it took in seconds: up to a minute in all where nothing is
        cached, far below a second where everything is.

    Raises
    ------
    ParameterError
        If `threads` is not a positive integer.

    Examples
    --------
    >>> all(seconds > 0 for seconds in warm_up().values())
    True
    """
    paths: dict[str, Callable[[int | None], None]] = {
        "spin transforms": _spin_transforms,
        "large spin transforms": _large_spin_transforms,
        "rotations": _rotations,
        "Wigner transforms": _wigner_transforms,
        "wavelet transforms": _wavelet_transforms,
        "single precision": _single_precision,
        "HEALPix fits": _healpix_fits,
        "separations": _separations,
    }
    seconds = {}
    for name, path in paths.items():
        start = time.perf_counter()
        path(threads)
        seconds[name] = time.perf_counter() - start
    return seconds


def _spin_transforms(threads: int | None) -> None:
    for sampling in SAMPLING_NAMES:
        make = partial(SpinHarmonicTransform, BANDLIMIT, sampling=sampling, threads=threads)
        for transform in (make(0), make(0, real=True), make(2), make(-2)):
            maps = transform.synthesis(np.zeros(BANDLIMIT**2, dtype=np.complex128))
            transform.adjoint_analysis(transform.analysis(maps))
            transform.adjoint_synthesis(maps)
            for points in (np.ones(2), np.ones(2 * BANDLIMIT)):
                values = transform.synthesis_at(np.zeros(BANDLIMIT**2), points, points)
                transform.adjoint_synthesis_at(values, points, points)


def _large_spin_transforms(threads: int | None) -> None:
    for real, dtype in product((False, True), ("complex128", "complex64")):
        transform = SpinHarmonicTransform(LARGE_BANDLIMIT, real=real, threads=threads, dtype=dtype)
        maps = transform.synthesis(np.zeros(LARGE_BANDLIMIT**2, dtype=np.complex128))
        transform.adjoint_analysis(transform.analysis(maps))
        transform.adjoint_synthesis(maps)


def _rotations(threads: int | None) -> None:
    flm = np.zeros(BANDLIMIT**2, dtype=np.complex128)
    rotate_flm(flm, (0.0, 1.0, 0.0), threads=threads)


def _wigner_transforms(threads: int | None) -> None:
    for sampling in SAMPLING_NAMES:
        for orders, real in (((0,), True), ((-1, 1), True), ((-2, 0, 2), False), ((1, 2), False)):
            transform = WignerTransform(
                BANDLIMIT, orders, sampling=sampling, real=real, threads=threads
            )
            zeros = np.zeros((len(orders), BANDLIMIT**2), dtype=np.complex128)
            functions = transform.synthesis(zeros)
            transform.adjoint_analysis(transform.analysis(functions))
            transform.adjoint_synthesis(functions)


def _wavelet_transforms(threads: int | None) -> None:
    for sampling in SAMPLING_NAMES:
        for directions in DIRECTIONS:
            for spin, real in ((0, False), (0, True), (2, False)):
                transform = SpinWaveletTransform(
                    BANDLIMIT, spin, directions, sampling=sampling, real=real, threads=threads
                )
                _run_wavelets(transform)


def _run_wavelets(transform: SpinWaveletTransform) -> None:
    maps = transform.harmonic.synthesis(np.zeros(transform.bandlimit**2, dtype=np.complex128))
    coefficients = transform.analysis(maps)
    transform.synthesis(coefficients)
    transform.adjoint_analysis(coefficients)
    transform.adjoint_synthesis(maps)


def _single_precision(threads: int | None) -> None:
    for sampling, bandlimit in product(SAMPLING_NAMES, CIRCLES):
        for real in (False, True):
            transform = SpinWaveletTransform(
                bandlimit,
                0,
                directions=2,
                sampling=sampling,
                real=real,
                threads=threads,
                dtype="complex64",
            )
            _run_wavelets(transform)


def _healpix_fits(threads: int | None) -> None:
    ones = np.ones(12 * NSIDE**2)
    map_to_flm(ones, BANDLIMIT, threads=threads)
    map_to_flm(ones + 0j, BANDLIMIT, threads=threads)
    map_to_flm(ones + 0j, BANDLIMIT, 2, threads=threads)


def _separations(threads: int | None) -> None:
    grid = MW(BANDLIMIT)
    caps = (
        cap_mask(grid.colatitudes[:, None], np.zeros(grid.n_phi), centre=(0, 0), radius=2.5),
        cap_mask(*pixel_directions(NSIDE), centre=(0, 0), radius=2.5),
    )
    for mask in caps:
        for directions in DIRECTIONS:
            separator = EBSeparator(mask=mask, directions=directions, threads=threads)
            separator.bands(separator.separate(mask, 0 * mask))
