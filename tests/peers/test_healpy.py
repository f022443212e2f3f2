"""HEALPix syntheses against healpy."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.harmonics import eb_to_spin, index
from spinsdw.ring_transform import HealpixTransform
from spinsdw.sampling import HealpixRings
from tests.helpers import assert_close, needs_compiler, random_like, random_real_flm

healpy = pytest.importorskip("healpy")

SIZES = [(1, 2), (2, 5), (4, 8), (4, 16)]
SIZES += [pytest.param(32, 96, marks=needs_compiler), pytest.param(64, 128, marks=needs_compiler)]


def tolerance(bandlimit):
    """Two sums over degree, whose colatitudes are rounded each in its own way."""
    return 32 * bandlimit + 64


def to_peer(flm, bandlimit):
    return flm[index(*healpy.Alm.getlm(bandlimit - 1))]


@pytest.mark.parametrize("nside", [1, 2, 3, 16])
def test_points_agree(nside):
    rings = HealpixRings(nside)
    theta, phi = healpy.pix2ang(nside, np.arange(rings.n_pixels))
    assert_close(np.repeat(rings.colatitudes, rings.n_phi), theta, ulps=8)
    points = np.arange(rings.n_pixels) - np.repeat(rings.starts, rings.n_phi)
    first = np.repeat(rings.first_longitudes, rings.n_phi)
    assert_close(first + 2 * np.pi * points / np.repeat(rings.n_phi, rings.n_phi), phi, ulps=8)


@pytest.mark.parametrize(("nside", "bandlimit"), SIZES)
@pytest.mark.parametrize("real", [False, True])
def test_scalar_synthesis_agrees(nside, bandlimit, real):
    flm = random_real_flm(bandlimit)
    found = HealpixTransform(nside, bandlimit, real=real).synthesis(flm)
    desired = healpy.alm2map(to_peer(flm, bandlimit), nside, lmax=bandlimit - 1)
    assert_close(found, desired, ulps=tolerance(bandlimit))


@pytest.mark.parametrize(("nside", "bandlimit"), SIZES[1:])
@pytest.mark.parametrize("spin", [1, 2, 3])
def test_spin_synthesis_agrees(nside, bandlimit, spin):
    """Q + iU = sum_lm -(E_lm + i B_lm) sYlm."""
    pair = [random_real_flm(bandlimit, seed=seed) for seed in range(2)]
    for flm in pair:
        flm[: spin**2] = 0
    found = HealpixTransform(nside, bandlimit, spin).synthesis(eb_to_spin(*pair))
    alms = [to_peer(flm, bandlimit) for flm in pair]
    q, u = healpy.alm2map_spin(alms, nside, spin, bandlimit - 1)
    assert_close(found, q + 1j * u, ulps=tolerance(bandlimit))


@pytest.mark.parametrize(("nside", "bandlimit"), SIZES)
def test_adjoint_is_the_peers_analysis_without_weights(nside, bandlimit):
    """Its plain estimate is the adjoint times the area of a pixel."""
    values = random_like(np.empty(12 * nside**2))
    flm = HealpixTransform(nside, bandlimit, real=True).adjoint_synthesis(values)
    desired = healpy.map2alm(values, lmax=bandlimit - 1, iter=0)
    found = to_peer(flm, bandlimit) * 4 * np.pi / values.size
    assert_close(found, desired, ulps=tolerance(bandlimit))
