"""Tilings and wavelets against the C library S2LET."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from spinsdw.directionality import SteerableDirectionality
from spinsdw.harmonics import degrees, index
from spinsdw.tiling import CustomTiling, NeedletTiling, ScaleDiscretisedTiling, SplineTiling
from spinsdw.wavelet_transform import SpinWaveletTransform
from spinsdw.wavelets import Wavelets
from tests.helpers import EPS, assert_close, needs_compiler, random_flm, random_real_flm

pys2let = pytest.importorskip("pys2let")

SCALE_DISCRETISED, NEEDLET, SPLINE = 1, 2, 3


@pytest.fixture
def switch():
    """Choose the peer's kind of tiling, a global of its library, and set it back afterwards."""
    library = ctypes.CDLL(pys2let.pys2let.__file__)
    choose = library.s2let_switch_wavtype
    choose.argtypes, choose.restype = [ctypes.c_int], None
    yield choose
    choose(SCALE_DISCRETISED)


def kernels(tiling):
    return np.array([tiling.kernel(scale) for scale in tiling.scales]).T


@pytest.mark.parametrize("lowest_scale", [0, 2])
@pytest.mark.parametrize("dilation", [1.2, 1.5, 2.0, 3.0, 5.0])
@pytest.mark.parametrize("bandlimit", [32, 125, 128, 129, 300])
def test_compatible_kernels_agree_to_rounding(bandlimit, dilation, lowest_scale):
    """Kappa itself, not its square, although rounding of 1 - k shows in it as 1e-8."""
    tiling = ScaleDiscretisedTiling(
        bandlimit, dilation=dilation, lowest_scale=lowest_scale, quadrature="s2let"
    )
    eta, kappa = pys2let.axisym_wav_l(dilation, bandlimit, lowest_scale)
    assert tiling.highest_scale == pys2let.pys2let_j_max(dilation, bandlimit, lowest_scale)
    assert_close(tiling.scaling_kernel, eta, ulps=16)
    assert_close(kernels(tiling), kappa, ulps=16)


@pytest.mark.parametrize("dilation", [1.2, 1.5, 2.0, 3.0, 4.0])
def test_exact_kernels_agree_to_the_error_of_300_trapezia(dilation):
    tiling = ScaleDiscretisedTiling(64, dilation=dilation)
    kappa = pys2let.axisym_wav_l(dilation, 64, 0)[1]
    assert np.abs(kernels(tiling) - kappa[:, : len(tiling.scales)]).max() < 6e-5


@pytest.mark.parametrize(("bandlimit", "dilation"), [(513, 2.0), (125, 5.0)])
def test_peer_has_one_empty_scale_more(bandlimit, dilation):
    kappa = pys2let.axisym_wav_l(dilation, bandlimit, 0)[1]
    tiling = ScaleDiscretisedTiling(bandlimit, dilation=dilation)
    assert kappa.shape[1] == len(tiling.scales) + 1
    assert not np.any(kappa[:, -1])


@pytest.mark.parametrize(
    ("dilation", "bandlimit", "lowest_scale", "directions", "spin"),
    [
        (2.0, 32, 0, 1, 0),
        (2.0, 32, 2, 4, 2),
        (2.0, 33, 1, 5, -2),
        (3.0, 50, 0, 6, 1),
        (1.5, 40, 2, 3, 3),
        (2.0, 16, 0, 12, 2),
        (2.0, 33, 0, 33, 0),
    ],
)
def test_wavelets_agree_to_rounding(dilation, bandlimit, lowest_scale, directions, spin):
    """psi_lm and phi_l, signs and phases included, N > L_j as well."""
    tiling = ScaleDiscretisedTiling(
        bandlimit, dilation=dilation, lowest_scale=lowest_scale, quadrature="s2let"
    )
    wavelets = Wavelets(tiling, SteerableDirectionality(directions), spin)
    phi, psi = pys2let.wavelet_tiling(dilation, bandlimit, directions, lowest_scale, spin)
    assert_close(wavelets.scaling_harmonics, phi, ulps=16)
    for scale in wavelets.scales:
        rows = wavelets.wavelet_harmonics(scale)
        full = np.zeros(bandlimit**2, dtype=complex)
        for n, row in zip(wavelets.directionality.orders, rows, strict=True):
            el = np.arange(abs(n), row.size)
            full[index(el, np.full(el.size, n))] = row[abs(n) :]
        assert_close(full, psi[:, scale - lowest_scale], ulps=16)


@pytest.mark.parametrize("spin", [0, 1, 2, -2])
@pytest.mark.parametrize("original_spin", [-3, -2, -1, 1, 2, 3])
def test_spin_lowered_wavelets_agree_to_rounding(original_spin, spin):
    """The peer's tiling ignores the original spin, its analysis does not."""
    bandlimit, lowest_scale = 16, 2
    flm, el = random_flm(bandlimit), degrees(bandlimit)
    detail, smooth = pys2let.analysis_lm2lmn(
        flm, 2.0, bandlimit, lowest_scale, 1, spin, 1, False, original_spin
    )
    tiling = ScaleDiscretisedTiling(bandlimit, lowest_scale=lowest_scale, quadrature="s2let")
    wavelets = Wavelets(tiling, SteerableDirectionality(1), spin, original_spin=original_spin)
    factor = np.sqrt(4 * np.pi / (2 * el + 1))
    assert_close(factor * wavelets.scaling_harmonics[el] * flm, smooth, ulps=64)
    for scale, peer in zip(wavelets.scales, detail.reshape(-1, bandlimit**2), strict=True):
        psi = np.zeros(bandlimit, dtype=complex)
        row = wavelets.wavelet_harmonics(scale)[0]
        psi[: row.size] = row
        assert_close(8 * np.pi**2 / (2 * el + 1) * np.conj(psi[el]) * flm, peer, ulps=64)


@pytest.mark.parametrize(("dilation", "bandlimit"), [(2.0, 64), (3.0, 50)])
def test_needlets_agree_to_the_error_of_300_trapezia(switch, dilation, bandlimit):
    switch(NEEDLET)
    eta, kappa = pys2let.axisym_wav_l(dilation, bandlimit, 1)
    tiling = NeedletTiling(bandlimit, dilation=dilation, lowest_scale=1)
    assert np.abs(tiling.scaling_kernel - eta).max() < 1e-4
    assert np.abs(kernels(tiling) - kappa).max() < 1e-4


@pytest.mark.parametrize("lowest_scale", [1, 3])
def test_splines_agree_up_to_the_numbering(switch, lowest_scale):
    """The peer cuts off at L / lam**(J-j-1): for L = lam**J, its scale j - 1 is ours j.

    Its top filter reaches beyond L, so that its two last scales make up our last.
    """
    switch(SPLINE)
    eta, kappa = pys2let.axisym_wav_l(2.0, 64, lowest_scale - 1)
    tiling = SplineTiling(64, lowest_scale=lowest_scale)
    merged = np.hstack([kappa[:, :-2], np.hypot(kappa[:, -2:-1], kappa[:, -1:])])
    # The peer's plain sum of cubes cancels: 1e-15 in the square is 1e-14 in a value of 0.05.
    assert_close(tiling.scaling_kernel**2, eta**2, ulps=64)
    assert_close(kernels(tiling) ** 2, merged**2, ulps=64)


@needs_compiler
@pytest.mark.parametrize(("directions", "lowest_scale"), [(1, 1), (3, 1), (2, 0)])
@pytest.mark.parametrize(("dilations", "transitions"), [((3.0, 2.0), (10,)), ((4.0, 2.0), (8,))])
def test_hybrid_and_manual_tilings_of_the_peer_are_custom_tilings(
    directions, lowest_scale, dilations, transitions
):
    """Its kernels keep our check, and its analysis with kernels by hand is ours."""
    bandlimit = 32
    scaling, wavelets, scaling_limit, limits, *_ = pys2let.construct_hybrid_tiling(
        bandlimit, lowest_scale, np.array(dilations), np.array(transitions, dtype=np.int32)
    )
    tiling = CustomTiling(scaling, wavelets.T)
    transform = SpinWaveletTransform(bandlimit, 0, directions, tiling=tiling, real=True)
    flm = random_real_flm(bandlimit)
    ours = transform.analysis_harmonic(flm)
    peer, peer_scaling = pys2let.analysis_lm2wav_manualtiling(
        pys2let.lm2lm_hp(flm, bandlimit),
        bandlimit,
        directions,
        0,
        scaling,
        wavelets.T.ravel(),
        int(scaling_limit),
        limits,
    )
    atol = (16 * bandlimit + 32) * EPS * np.max(np.abs(peer))
    np.testing.assert_allclose(ours.scaling.ravel(), peer_scaling, rtol=0, atol=atol)
    gammas, start = 2 * directions - 1, 0
    for scale, size in zip(ours.scales, limits, strict=True):
        shape = (gammas, int(size), 2 * int(size) - 1)
        values = peer[start : start + np.prod(shape)].reshape(shape)
        start += values.size
        assert ours[scale].shape[1:] == shape[1:]
        for k in range(gammas):
            steered = ours.steer(2 * np.pi * k / gammas)[scale]
            np.testing.assert_allclose(steered, values[k], rtol=0, atol=atol)
    assert start == peer.size
