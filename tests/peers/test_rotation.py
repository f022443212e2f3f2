"""Rotation against healpy, ducc0 and SSHT, which use the same Euler angles."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.harmonics import index
from spinsdw.rotation import rotate_flm
from tests.helpers import EPS, needs_compiler, random_flm, random_real_flm, relative_error

ROTATIONS = [(0.3, 1.1, 0.7), (-1.0, 2.8, 3.0), (0.2, 0.01, 0.1)]

each_size = pytest.mark.parametrize(
    "bandlimit",
    [4, pytest.param(33, marks=needs_compiler), pytest.param(200, marks=needs_compiler)],
)
each_rotation = pytest.mark.parametrize("rotation", ROTATIONS)


def to_peer(flm, bandlimit):
    """The coefficients of m >= 0, degree running fastest."""
    return np.concatenate([flm[index(np.arange(m, bandlimit), m)] for m in range(bandlimit)])


@each_size
@each_rotation
def test_ducc_agrees(bandlimit, rotation):
    """It takes the angles in the order in which they are applied."""
    ducc0 = pytest.importorskip("ducc0")
    flm = random_real_flm(bandlimit)
    desired = ducc0.sht.rotate_alm(to_peer(flm, bandlimit), bandlimit - 1, *rotation[::-1])
    found = to_peer(rotate_flm(flm, rotation, real=True), bandlimit)
    assert relative_error(found, desired) <= (bandlimit + 8) ** 1.5 * EPS


@each_size
@each_rotation
def test_healpy_agrees(bandlimit, rotation):
    healpy = pytest.importorskip("healpy")
    flm = random_real_flm(bandlimit)
    alm = to_peer(flm, bandlimit)
    healpy.rotate_alm(alm, *rotation[::-1], lmax=bandlimit - 1)
    found = to_peer(rotate_flm(flm, rotation, real=True), bandlimit)
    # The peer loses digits.
    assert relative_error(found, alm) < 1e-11


@each_size
@each_rotation
def test_ssht_agrees(bandlimit, rotation):
    pyssht = pytest.importorskip("pyssht")
    if bandlimit > 100:
        pytest.skip("the peer needs L**3 numbers")
    flm = random_flm(bandlimit)
    desired = pyssht.rotate_flms(flm, *rotation, bandlimit)
    assert relative_error(rotate_flm(flm, rotation), desired) < 1e-13
