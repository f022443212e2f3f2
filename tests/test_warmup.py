"""Warming up compiles all there is to compile."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from spinsdw.errors import ParameterError
from spinsdw.warmup import warm_up

# Every public path at sizes, directions and threads that the warm-up does not use.
WORK = """
import numpy as np
from spinsdw.healpix import flm_to_map, healpix_to_mw, map_to_flm, mw_to_healpix
from spinsdw.masks import galactic_cut
from spinsdw.polarisation import EBSeparator
from spinsdw.rotation import rotate_flm
from spinsdw.sampling import SAMPLINGS
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wigner_transform import WignerTransform

L = 21
def around(transform, coefficients):
    values = transform.synthesis(coefficients)
    transform.adjoint_analysis(transform.analysis(values))
    transform.adjoint_synthesis(values)

for real in (True, False):
    rotate_flm(np.zeros((2, L * L)), (1, 2, 3), real=real)
    for size, dtype in ((200, "complex64"), (400, "complex128"), (400, "complex64")):
        around(
            SpinHarmonicTransform(size, 0 if real else -2, real=real, dtype=dtype),
            np.zeros((2, size * size), dtype=complex),
        )
for orders, real in (((-3, 0, 3), True), ((0, 1, 4), False)):
    around(
        WignerTransform(400, orders, real=real), np.zeros((len(orders), 400**2), dtype=complex)
    )
for sampling in SAMPLINGS:
    for spin, real in ((0, True), (0, False), (1, False), (-3, False)):
        around(
            SpinHarmonicTransform(L, spin, sampling=sampling, real=real, threads=3),
            np.zeros((2, L * L), dtype=complex),
        )
        points = np.linspace(0, 3, 40)
        transform = SpinHarmonicTransform(L, spin, real=real)
        for part in (points[3:7], points):
            values = transform.synthesis_at(np.zeros((2, L * L)), part, part)
            transform.adjoint_synthesis_at(values, part, part)
    for orders, real in (((-3, 0, 3), True), ((0, 1, 4), False), ((-5,), False)):
        around(
            WignerTransform(L, orders, sampling=sampling, real=real, threads=1),
            np.zeros((len(orders), L * L), dtype=complex),
        )
    for directions, dtype in ((1, "complex128"), (4, "complex128"), (5, "complex64")):
        for spin, real in ((0, True), (0, False), (2, False), (-1, False)):
            wavelets = SpinWaveletTransform(
                L, spin, directions, sampling=sampling, real=real, dtype=dtype,
                multiresolution=directions != 4,
            )
            flm = np.zeros(L * L, dtype=complex)
            maps = wavelets.harmonic.synthesis(flm)
            found = wavelets.analysis(maps)
            wavelets.synthesis(found)
            wavelets.adjoint_analysis(found)
            wavelets.adjoint_synthesis(maps)
    if sampling not in ("mw", "mwss"):
        continue
    q = np.zeros(SpinHarmonicTransform(L, 2, sampling=sampling).shape)
    mask = np.ones_like(q)
    mask[8:10] = 0
    EBSeparator(mask=mask, directions=4).separate(q, q)

sky = np.ones(12 * 16**2)
sky.flags.writeable = False
for spin, values in ((0, sky), (0, sky + 0j), (2, sky + 0j), (1, sky[::-1] + 0j)):
    flm, _ = map_to_flm(values, L, spin)
    flm_to_map(flm, 8, spin)
flm_to_map(map_to_flm(sky, L)[0], 8, real=True)
grid, _ = healpix_to_mw(sky, L)
mw_to_healpix(grid, 8)
for directions in (1, 4):
    for nest in (False, True):
        separator = EBSeparator(mask=galactic_cut(16, 0.3), directions=directions, nest=nest)
        separator.bands(separator.separate(sky, sky))
"""


def test_warming_up_tells_the_seconds_of_each_path():
    seconds = warm_up(threads=2)
    assert len(seconds) == 8
    assert all(value > 0 for value in seconds.values())


def test_warming_up_checks_the_number_of_threads():
    with pytest.raises(ParameterError, match="threads=0 must be a positive integer"):
        warm_up(threads=0)


@pytest.mark.slow
def test_nothing_is_left_to_compile_after_warming_up(tmp_path):
    """A process that comes after the warm-up finds all its machine code in the cache."""
    environment = {**os.environ, "SPINSDW_CACHE": str(tmp_path), "NUMBA_DISABLE_JIT": "0"}

    def machine_code(script):
        run = subprocess.run(
            [sys.executable, "-c", script], env=environment, check=False, timeout=600
        )
        assert run.returncode == 0
        return sorted(path.name for path in tmp_path.rglob("*.nbc"))

    warm = machine_code("from spinsdw.warmup import warm_up; warm_up()")
    assert warm
    assert machine_code(WORK) == warm
