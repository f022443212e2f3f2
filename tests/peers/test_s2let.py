"""Wavelet transforms against the C library S2LET."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.harmonics import resize
from spinsdw.peer_layouts import coefficients_to_s2let, s2let_to_coefficients, wigner_to_so3
from spinsdw.tiling import ScaleDiscretisedTiling
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import (
    EPS,
    assert_close,
    needs_compiler,
    random_flm,
    random_like,
    wavelet_wigner,
)

pys2let = pytest.importorskip("pys2let")

# dilation, bandlimit, lowest scale, directions, spin, whether every scale is sampled at L.
# The peer's layout is at fault where N > L_j, so the lowest scale keeps dilation**(J0+1) >= N.
SMALL = [
    (2.0, 16, 0, 1, 0, 0),
    (2.0, 16, 0, 2, 2, 0),
    (2.0, 16, 1, 3, -2, 1),
    (3.0, 16, 1, 4, 1, 0),
]
LARGE = [
    (2.0, 32, 2, 3, 0, 0),
    (2.0, 32, 2, 3, 2, 0),
    (2.0, 32, 2, 4, 2, 1),
    (2.0, 33, 2, 5, -3, 0),
    (3.0, 30, 1, 6, -2, 0),
    (1.5, 24, 2, 3, 2, 0),
    (1.5, 40, 3, 2, 0, 1),
    (2.0, 128, 2, 3, 2, 0),
    (2.0, 128, 2, 4, 0, 1),
]
CASES = SMALL + [pytest.param(*case, marks=needs_compiler) for case in LARGE]
every_case = pytest.mark.parametrize(
    ("dilation", "bandlimit", "lowest_scale", "directions", "spin", "upsample"), CASES
)


def make_transform(dilation, bandlimit, lowest_scale, directions, spin, upsample, **options):
    """Take the peer's tiling: its quadrature, and its empty scale too many where it has one."""
    tiling = ScaleDiscretisedTiling(
        bandlimit, dilation=dilation, lowest_scale=lowest_scale, quadrature="s2let"
    )
    return SpinWaveletTransform(
        bandlimit, spin, directions, multiresolution=not upsample, tiling=tiling, **options
    )


def split_scales(transform, values):
    """Cut the peer's array into scales of shape (2N - 1 gammas, rings, phi)."""
    gammas, scales, start = 2 * transform.directions - 1, {}, 0
    for scale in transform.scales:
        shape = (gammas, *transform.shapes[scale][1:])
        stop = start + int(np.prod(shape))
        scales[scale] = values[start:stop].reshape(shape)
        start = stop
    assert start == values.size
    return scales


@every_case
def test_analysis_agrees(dilation, bandlimit, lowest_scale, directions, spin, upsample):
    """At all of the peer's gammas, 2 pi k / (2N - 1): we steer to them."""
    arguments = (dilation, bandlimit, lowest_scale, directions, spin, upsample)
    transform = make_transform(*arguments)
    signal = transform.harmonic.synthesis(random_flm(bandlimit, spin))
    coefficients = transform.analysis(signal)
    wavelets, scaling = pys2let.analysis_px2wav(signal.ravel(), *arguments)
    size = np.max(np.abs(wavelets))
    # Two harmonic transforms and one on SO(3) each, at 4 L ulps.
    atol = (16 * bandlimit + 32) * EPS * size
    for scale, peer in split_scales(transform, wavelets).items():
        for k, values in enumerate(peer):
            ours = coefficients.steer(2 * np.pi * k / len(peer))[scale]
            np.testing.assert_allclose(ours, values, rtol=0, atol=atol, err_msg=str(scale))
    np.testing.assert_allclose(coefficients.scaling.ravel(), scaling, rtol=0, atol=atol)


@every_case
def test_synthesis_agrees(dilation, bandlimit, lowest_scale, directions, spin, upsample):
    """Of coefficients changed at random, scale by scale, so that no analysis made them."""
    arguments = (dilation, bandlimit, lowest_scale, directions, spin, upsample)
    transform = make_transform(*arguments)
    flm = random_flm(bandlimit, spin)
    coefficients = transform.analysis_harmonic(flm)
    factors = {scale: np.cos(scale) for scale in transform.scales} | {"scaling": 2.0}
    changed = coefficients * factors
    gammas = 2 * np.pi * np.arange(2 * directions - 1) / (2 * directions - 1)
    steered = [changed.steer(gamma) for gamma in gammas]
    wavelets = [one[scale].ravel() for scale in transform.scales for one in steered]
    desired = pys2let.synthesis_wav2px(
        np.concatenate(wavelets), changed.scaling.ravel(), *arguments
    )
    found = transform.synthesis(changed)
    assert_close(found.ravel(), desired, ulps=16 * bandlimit + 32)


@pytest.mark.parametrize(("spin", "original_spin"), [(2, 2), (0, 2), (2, -2), (-1, 3), (0, -1)])
@pytest.mark.parametrize("directions", [1, 2, 3])
def test_spin_lowered_analysis_agrees(directions, spin, original_spin):
    """Both multiply by (-1)^r sqrt((l+r)!/(l-r)!); the signal begins where both have it."""
    arguments = (2.0, 16, 1, directions, spin, 0)
    transform = make_transform(*arguments, original_spin=original_spin)
    signal = transform.harmonic.synthesis(random_flm(16, max(abs(spin), abs(original_spin))))
    coefficients = transform.analysis(signal)
    wavelets, scaling = pys2let.analysis_px2wav(signal.ravel(), *arguments, False, original_spin)
    atol = (16 * 16 + 32) * EPS * np.max(np.abs(wavelets))
    for scale, peer in split_scales(transform, wavelets).items():
        for k, values in enumerate(peer):
            ours = coefficients.steer(2 * np.pi * k / len(peer))[scale]
            np.testing.assert_allclose(ours, values, rtol=0, atol=atol, err_msg=str(scale))
    np.testing.assert_allclose(coefficients.scaling.ravel(), scaling, rtol=0, atol=atol)


@pytest.mark.parametrize(("spin", "original_spin"), [(2, 2), (0, 2), (2, -2), (-1, 3)])
@pytest.mark.parametrize("directions", [1, 3])
def test_spin_lowered_synthesis_agrees_with_the_opposite_original_spin(
    directions, spin, original_spin
):
    """The peer's analysis with r is undone by its synthesis with -r, which is ours of r."""
    arguments = (2.0, 16, 1, directions, spin, 0)
    transform = make_transform(*arguments, original_spin=original_spin)
    flm = random_flm(16, max(abs(spin), abs(original_spin)))
    changed = transform.analysis_harmonic(flm) * {2: 0.5, 3: -1.0, "scaling": 2.0}
    gammas = 2 * np.pi * np.arange(2 * directions - 1) / (2 * directions - 1)
    steered = [changed.steer(gamma) for gamma in gammas]
    wavelets = [one[scale].ravel() for scale in transform.scales for one in steered]
    desired = pys2let.synthesis_wav2px(
        np.concatenate(wavelets), changed.scaling.ravel(), *arguments, False, -original_spin
    )
    found = transform.synthesis(changed)
    # Factors up to 18! / 12! come and go again.
    assert_close(found.ravel(), desired, ulps=16 * (16 * 16 + 32))


@pytest.mark.parametrize("spin", [0, 2, -1])
@pytest.mark.parametrize("upsample", [0, 1])
def test_adjoint_synthesis_agrees_for_one_direction(spin, upsample):
    """With N = 1 both store one gamma, and the plain dot products are the same.

    Compared in what a synthesis sees, for the peer extends maps that are not band-limited its own
    way.
    """
    arguments = (2.0, 16, 2, 1, spin, upsample)
    transform = make_transform(*arguments)
    noise = random_like(np.empty(transform.harmonic.shape, dtype=complex))
    ours = transform.adjoint_synthesis(noise)
    wavelets, scaling = pys2let.synthesis_adjoint_px2wav(noise.ravel(), *arguments)
    peer = split_scales(transform, wavelets)
    # <A f, A' g> = <f, A* A' g>: pair both with the coefficients of signals.
    for seed in range(3):
        probe = transform.analysis_harmonic(random_flm(16, spin, seed=seed))
        one = np.vdot(probe.scaling, ours.scaling)
        other = np.vdot(probe.scaling, scaling.reshape(probe.scaling.shape))
        for scale in transform.scales:
            one += np.vdot(probe[scale], ours[scale])
            other += np.vdot(probe[scale], peer[scale])
        assert abs(one - other) < 1e-13 * probe.norm() * ours.norm()


@pytest.mark.parametrize("spin", [0, 2])
def test_adjoint_analysis_of_coefficients_agrees_for_one_direction(spin):
    arguments = (2.0, 16, 2, 1, spin, 0)
    transform = make_transform(*arguments)
    noise = transform.analysis_harmonic(random_flm(16, spin)).map(random_like)
    wavelets = np.concatenate([noise[scale].ravel() for scale in transform.scales])
    peer = pys2let.analysis_adjoint_wav2px(wavelets, noise.scaling.ravel(), *arguments)
    ours = transform.adjoint_analysis(noise)
    # In what a synthesis sees: the adjoint synthesis of both.
    found = transform.harmonic.adjoint_synthesis(ours)
    desired = transform.harmonic.adjoint_synthesis(peer.reshape(ours.shape))
    assert_close(found, desired, ulps=16 * 16 + 32)


@pytest.mark.parametrize("directions", [1, 2, 3, 4])
def test_full_sky_identity_holds_in_the_peer_too(directions):
    """W^E = -Re W_P and W^B = -Im W_P of E and B analysed by spin-0 wavelets, ours against its."""
    bandlimit = 16
    transform = make_transform(2.0, bandlimit, 2, directions, 2, 0)
    p_lm = random_flm(bandlimit, 2)
    ours = transform.analysis_harmonic(p_lm)
    scalar = make_transform(2.0, bandlimit, 2, directions, 0, 0)
    signal = scalar.harmonic.synthesis(-p_lm)
    wavelets, _ = pys2let.analysis_px2wav(signal.ravel(), 2.0, bandlimit, 2, directions, 0, 0)
    for scale, peer in split_scales(scalar, wavelets).items():
        for k, values in enumerate(peer):
            steered = ours.steer(2 * np.pi * k / len(peer))[scale]
            np.testing.assert_allclose(-steered, values, rtol=0, atol=1e-12)


# The peer itself works where N > L_j; only its `wav_ind` is wrong there.
LAYOUTS = [
    (2.0, 16, 0, 6, 0, 0),
    (2.0, 17, 0, 5, 2, 0),
    (3.0, 16, 1, 4, -1, 0),
    (1.5, 12, 2, 3, 2, 0),
    (2.0, 16, 1, 2, 1, 1),
]
every_layout = pytest.mark.parametrize(
    ("dilation", "bandlimit", "lowest_scale", "directions", "spin", "upsample"), LAYOUTS
)


@every_layout
def test_exported_coefficients_are_the_peers(
    dilation, bandlimit, lowest_scale, directions, spin, upsample
):
    arguments = (dilation, bandlimit, lowest_scale, directions, spin, upsample)
    transform = make_transform(*arguments)
    flm = random_flm(bandlimit, spin)
    found = coefficients_to_s2let(transform, transform.analysis_harmonic(flm))
    signal = transform.harmonic.synthesis(flm)
    desired = pys2let.analysis_px2wav(signal.ravel(), *arguments)
    for ours, peer in zip(found, desired, strict=True):
        assert_close(ours, peer, ulps=32 * bandlimit + 64)


@every_layout
def test_imported_coefficients_are_ours(
    dilation, bandlimit, lowest_scale, directions, spin, upsample
):
    arguments = (dilation, bandlimit, lowest_scale, directions, spin, upsample)
    transform = make_transform(*arguments)
    flm = random_flm(bandlimit, spin)
    signal = transform.harmonic.synthesis(flm)
    peer = pys2let.analysis_px2wav(signal.ravel(), *arguments)
    found = s2let_to_coefficients(transform, *peer)
    ours = transform.analysis_harmonic(flm)
    assert found.parameters == ours.parameters
    assert (found - ours).norm() < 1e-13 * ours.norm()


@every_layout
def test_the_peer_synthesises_what_is_exported(
    dilation, bandlimit, lowest_scale, directions, spin, upsample
):
    """Of coefficients changed scale by scale, which are no analysis of anything.

    They stay band-limited: samples that are not, the peer extends over the pole in its own way.
    """
    arguments = (dilation, bandlimit, lowest_scale, directions, spin, upsample)
    transform = make_transform(*arguments)
    coefficients = transform.analysis_harmonic(random_flm(bandlimit, spin))
    changed = coefficients * {scale: np.cos(scale) for scale in transform.scales}
    desired = pys2let.synthesis_wav2px(*coefficients_to_s2let(transform, changed), *arguments)
    found = transform.synthesis(changed)
    assert_close(found.ravel(), desired, ulps=32 * bandlimit + 64)


@pytest.mark.parametrize(("directions", "spin"), [(3, 2), (4, 0), (1, -1)])
def test_wigner_coefficients_in_the_peers_layout_are_its(directions, spin):
    """analysis_lm2lmn: the scales one after the other, each so3's compact storage."""
    arguments = (2.0, 16, 2, directions, spin, 0)
    transform = make_transform(*arguments)
    flm = random_flm(16, spin)
    peer, _ = pys2let.analysis_lm2lmn(flm, *arguments)
    orders = transform.wavelets.orientations_of(transform.scales[0]).orders
    parts = []
    for scale in transform.scales:
        size = transform.bandlimits[scale] ** 2
        wigner = wavelet_wigner(flm, transform.wavelets, scale)[:, :size]
        parts.append(wigner_to_so3(wigner, orders, directions, storage="compact"))
    assert_close(np.concatenate(parts), peer, ulps=16)


def join_parts(transform, parts, *, upsample):
    """Lay Wigner coefficients out as the peer: compact, at the bandlimit that it takes."""
    rows = []
    for scale in transform.scales:
        padded = resize(parts[scale], transform.bandlimits[scale])
        orders = transform.wavelets.orientations_of(scale).orders
        rows.append(wigner_to_so3(padded, orders, transform.directions, storage="compact"))
    size = transform.bandlimit if upsample else transform.tiling.scaling_bandlimit
    return np.concatenate(rows), resize(parts["scaling"], size)


@every_case
def test_wigner_door_agrees(dilation, bandlimit, lowest_scale, directions, spin, upsample):
    """Analysis, synthesis and both adjoints between f_lm and W_lmn, of any coefficients."""
    arguments = (dilation, bandlimit, lowest_scale, directions, spin, upsample)
    transform = make_transform(*arguments)
    flm = random_flm(bandlimit, spin)
    parts = transform.analysis_wigner(flm)
    noise = {key: random_like(values, seed=1) * (values != 0) for key, values in parts.items()}
    for found, peer in (
        (parts, pys2let.analysis_lm2lmn),
        (transform.adjoint_synthesis_wigner(flm), pys2let.synthesis_adjoint_lm2lmn),
    ):
        for ours, theirs in zip(
            join_parts(transform, found, upsample=upsample), peer(flm, *arguments), strict=True
        ):
            assert_close(ours, theirs, ulps=16)
    vectors = join_parts(transform, noise, upsample=upsample)
    for ours, peer in (
        (transform.synthesis_wigner(noise), pys2let.synthesis_lmn2lm),
        (transform.adjoint_analysis_wigner(noise), pys2let.analysis_adjoint_lmn2lm),
    ):
        assert_close(ours, peer(*vectors, *arguments), ulps=64)


@pytest.mark.parametrize(
    ("directions", "spin", "upsample"), [(2, 2, 0), (3, 0, 0), (4, -1, 0), (3, 2, 1)]
)
def test_adjoints_agree_for_any_directions(directions, spin, upsample):
    """The peer stores 2N - 1 gammas, W' = E W with E^T E = (2N - 1)/N, so its adjoints are ours

        A'^T W' = (2N - 1)/N A^T W,    S'^T f = N/(2N - 1) E S^T f

    of the wavelets; of the scaling part without a factor. Compared in what a synthesis sees.
    """
    arguments = (2.0, 16, 2, directions, spin, upsample)
    transform = make_transform(*arguments)
    ratio = (2 * directions - 1) / directions
    factors = dict.fromkeys(transform.scales, ratio)
    some = transform.analysis_harmonic(random_flm(16, spin, seed=1)) * {3: 0.3, "scaling": 2.0}
    peer = pys2let.analysis_adjoint_wav2px(*coefficients_to_s2let(transform, some), *arguments)
    ours = transform.adjoint_analysis(some * factors)
    found = transform.harmonic.adjoint_synthesis(ours)
    desired = transform.harmonic.adjoint_synthesis(peer.reshape(ours.shape))
    assert_close(found, desired, ulps=64 * 16)

    noise = random_like(np.empty(transform.harmonic.shape, dtype=complex))
    stored = pys2let.synthesis_adjoint_px2wav(noise.ravel(), *arguments)
    peer = s2let_to_coefficients(transform, *stored) * factors
    ours = transform.adjoint_synthesis(noise)
    for seed in range(3):
        probe = transform.analysis_harmonic(random_flm(16, spin, seed=seed))
        one, other = (
            np.vdot(probe.scaling, found.scaling)
            + sum(np.vdot(probe[scale], found[scale]) for scale in transform.scales)
            for found in (ours, peer)
        )
        assert abs(one - other) < 1e-13 * probe.norm() * ours.norm()
