"""Spin transforms, and wavelet coefficients as convolutions, against ducc0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from spinsdw.directionality import (
    CurveletDirectionality,
    RidgeletDirectionality,
    SteerableDirectionality,
)
from spinsdw.harmonics import eb_to_spin, index, spin_to_eb
from spinsdw.sampling import WeightedRings
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import (
    assert_close,
    euler_grid,
    random_like,
    random_real_flm,
    relative_error,
    sizes_and_spins,
)

ducc0 = pytest.importorskip("ducc0")


@dataclass(frozen=True)
class Fejer2(WeightedRings):
    """Fejer's second rule, which the package has not: rings at the inner points of [0, pi]."""

    name: ClassVar[str] = "fejer2"

    @property
    def n_rings(self):
        return 2 * self.bandlimit - 1

    @property
    def colatitudes(self):
        return np.pi * np.arange(1, self.n_rings + 1) / (self.n_rings + 1)

    @property
    def rule(self):
        odd = np.arange(1, self.n_rings + 1, 2)
        sines = np.sin(np.outer(self.colatitudes, odd)) @ (1 / odd)
        return 4 / (self.n_rings + 1) * np.sin(self.colatitudes) * sines


GEOMETRIES = {"mw": "MW", "mwss": "CC", "dh": "F1", "gl": "GL", "cc": "CC", "fejer1": "F1"}

every_case = pytest.mark.parametrize(
    ("bandlimit", "spin"), sizes_and_spins([4, 8, 32, 128], [0, 1, 2, 3])
)
each_grid = pytest.mark.parametrize("sampling", GEOMETRIES)


def tolerance(bandlimit):
    """Two transforms, each with the rounding of its colatitudes."""
    return 16 * bandlimit + 32


def to_peer(flm, bandlimit, orders=None):
    """The coefficients of m >= 0, degree running fastest."""
    columns = range(bandlimit if orders is None else orders)
    return np.concatenate([flm[index(np.arange(m, bandlimit), m)] for m in columns])


def random_pair(bandlimit, spin):
    """Draw E and B, real fields; spin 0 has the first alone."""
    pair = [random_real_flm(bandlimit, seed=seed) for seed in range(2)]
    for flm in pair:
        flm[: spin**2] = 0
    return pair if spin else pair[:1]


@each_grid
@every_case
def test_synthesis_agrees(bandlimit, spin, sampling):
    """Q + iU = sum_lm -(E_lm + i B_lm) sYlm for s > 0; spin 0 has no sign."""
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=sampling)
    pair = random_pair(bandlimit, spin)
    maps = ducc0.sht.synthesis_2d(
        alm=np.array([to_peer(flm, bandlimit) for flm in pair]),
        spin=spin,
        lmax=bandlimit - 1,
        geometry=GEOMETRIES[sampling],
        ntheta=transform.shape[0],
        nphi=transform.shape[1],
    )
    flm = eb_to_spin(*pair) if spin else pair[0]
    desired = maps[0] + 1j * maps[1] if spin else maps[0] + 0j
    assert_close(transform.synthesis(flm), desired, ulps=tolerance(bandlimit))


@each_grid
@every_case
def test_analysis_of_band_limited_maps_agrees(bandlimit, spin, sampling):
    """The peer takes twice the rings and their weights."""
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=sampling)
    pair = random_pair(bandlimit, spin)
    flm = eb_to_spin(*pair) if spin else pair[0]
    values = transform.synthesis(flm)
    alm = ducc0.sht.analysis_2d(
        map=np.stack([values.real, values.imag]) if spin else values.real[None],
        spin=spin,
        lmax=bandlimit - 1,
        geometry=GEOMETRIES[sampling],
    )
    found = spin_to_eb(transform.analysis(values)) if spin else [transform.analysis(values)]
    peer = np.array([to_peer(flm, bandlimit) for flm in found])
    assert_close(peer, alm, ulps=tolerance(bandlimit))


@each_grid
@every_case
def test_adjoint_synthesis_agrees(bandlimit, spin, sampling):
    """<S (a, b), (Q, U)> = Re <-(a + ib), S* (Q + iU)>, with random a and b."""
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=sampling)
    values = random_like(np.empty(transform.shape, dtype=complex))
    maps = np.stack([values.real, values.imag]) if spin else values.real[None]
    alm = ducc0.sht.adjoint_synthesis_2d(
        map=maps, spin=spin, lmax=bandlimit - 1, geometry=GEOMETRIES[sampling]
    )
    flm = transform.adjoint_synthesis(values if spin else values.real)
    opposite = np.conj(to_peer(flm[index(*mirrored(bandlimit))], bandlimit))
    signs = np.concatenate([np.full(bandlimit - m, (-1.0) ** m) for m in range(bandlimit)])
    plus, minus = to_peer(flm, bandlimit), signs * opposite
    pair = [-(plus + minus) / 2, 1j * (plus - minus) / 2] if spin else [plus]
    assert_close(np.array(pair), alm, ulps=tolerance(bandlimit))


def mirrored(bandlimit):
    """Degree and minus the order of every place."""
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    return el, el * el + el - np.arange(bandlimit**2)


@pytest.mark.parametrize(
    ("bandlimit", "directionality"),
    [
        *((32, SteerableDirectionality(directions)) for directions in (1, 2, 3, 4)),
        (20, CurveletDirectionality()),
        (20, CurveletDirectionality(centred=True)),
        (32, RidgeletDirectionality()),
    ],
    ids=str,
)
def test_wavelet_coefficients_are_convolutions(bandlimit, directionality):
    """Of a real sky with a beam psi, pointed at (beta, alpha) and turned by gamma."""
    transform = SpinWaveletTransform(bandlimit, real=True, directionality=directionality)
    sky = random_real_flm(bandlimit)
    sky[np.repeat(transform.wavelets.lost_degrees, 2 * np.arange(bandlimit) + 1)] = 0
    coefficients = transform.analysis_harmonic(sky)
    for scale in (3, 5):
        rows = transform.wavelets.wavelet_harmonics(scale)
        orientations = transform.wavelets.orientations_of(scale)
        beam = np.zeros(bandlimit**2, dtype=complex)
        for n, row in zip(orientations.orders, rows, strict=True):
            el = np.arange(abs(n), row.size)
            beam[index(el, n)] = row[el]
        grid = transform.grid_of(transform.bandlimits[scale])
        alpha, beta, gamma = euler_grid(grid, orientations.angles)
        convolver = ducc0.totalconvolve.Interpolator(
            to_peer(sky, bandlimit)[None],
            to_peer(beam, bandlimit, orientations.largest_order + 1)[None],
            False,
            lmax=bandlimit - 1,
            kmax=orientations.largest_order,
            npoints=alpha.size,
            epsilon=1e-12,
            nthreads=1,
        )
        desired = convolver.interpol(np.stack([beta, alpha, gamma], axis=-1))[0]
        # The peer interpolates, to the accuracy asked for.
        assert relative_error(coefficients[scale].ravel(), desired) < 1e-12


@pytest.mark.parametrize("spin", [0, 2])
def test_synthesis_at_points_agrees(spin):
    bandlimit, rng = 64, np.random.default_rng(0)
    transform = SpinHarmonicTransform(bandlimit, spin)
    pair = random_pair(bandlimit, spin)
    points = np.stack([np.arccos(rng.uniform(-1, 1, 500)), rng.uniform(0, 6, 500)], axis=1)
    values = ducc0.sht.synthesis_general(
        alm=np.array([to_peer(flm, bandlimit) for flm in pair]),
        spin=spin,
        lmax=bandlimit - 1,
        loc=points,
        epsilon=1e-12,
    )
    flm = eb_to_spin(*pair) if spin else pair[0]
    found = transform.synthesis_at(flm, *points.T)
    assert relative_error(found, values[0] + 1j * values[1] if spin else values[0]) < 4e-12


@pytest.mark.parametrize(("bandlimit", "spin"), sizes_and_spins([1, 2, 7, 32], [0, 1, 2]))
def test_a_sampling_of_ones_own_is_the_peers_further_grid(bandlimit, spin):
    """Fejer's second rule, by a subclass: the same maps, and the same coefficients of them"""
    grid = Fejer2(bandlimit)
    transform = SpinHarmonicTransform(bandlimit, spin, sampling=grid)
    pair = random_pair(bandlimit, spin)
    options = {"spin": spin, "lmax": bandlimit - 1, "geometry": "F2"}
    alm = np.array([to_peer(flm, bandlimit) for flm in pair])
    maps = ducc0.sht.synthesis_2d(alm=alm, ntheta=grid.n_rings, nphi=grid.n_phi, **options)
    flm = eb_to_spin(*pair) if spin else pair[0]
    desired = maps[0] + 1j * maps[1] if spin else maps[0] + 0j
    assert_close(transform.synthesis(flm), desired, ulps=tolerance(bandlimit))
    again = ducc0.sht.analysis_2d(map=maps, **options)
    found = transform.analysis(desired)
    assert_close(found, flm, ulps=tolerance(bandlimit))
    fields = spin_to_eb(found) if spin else [found]
    for one, other in zip(fields, again, strict=True):
        assert_close(to_peer(one, bandlimit), other, ulps=2 * tolerance(bandlimit))
