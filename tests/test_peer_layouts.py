"""The layouts of s2wav, s2fft and so3 by direct sums, and their inverses; S2LET is in tests/peers.

s2wav and s2fft are not needed: their layouts are laws, written out here.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from spinsdw.directionality import CurveletDirectionality
from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.peer_layouts import (
    coefficients_to_s2let,
    coefficients_to_s2wav,
    flm_to_s2fft,
    s2fft_to_flm,
    s2fft_to_wigner,
    s2let_to_coefficients,
    s2wav_to_coefficients,
    so3_to_wigner,
    wigner_to_s2fft,
    wigner_to_so3,
)
from spinsdw.sampling import resolve_sampling
from spinsdw.tiling import NeedletTiling, ScaleDiscretisedTiling
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import (
    direct_function,
    direct_map,
    euler_grid,
    random_flm,
    random_real_flm,
    wavelet_wigner,
)

# bandlimit, spin, directions, dilation, lowest scale, sampling, multiresolution
CASES = [
    (8, 0, 1, 2.0, 0, "mw", True),
    (8, 2, 3, 2.0, 0, "mw", True),
    (8, -1, 2, 2.0, 0, "mwss", True),
    (9, 1, 6, 2.0, 0, "mw", True),
    (8, 3, 4, 2.0, 2, "mw", True),
    (10, 2, 5, 3.0, 1, "mwss", False),
    (12, 0, 3, 1.5, 2, "mw", True),
]
every_case = pytest.mark.parametrize(
    ("bandlimit", "spin", "directions", "dilation", "lowest", "sampling", "multiresolution"), CASES
)


def make(bandlimit, spin, directions, dilation, lowest, sampling, multiresolution, real=False):
    tiling = ScaleDiscretisedTiling(
        bandlimit, dilation=dilation, lowest_scale=lowest, quadrature="s2let"
    )
    return SpinWaveletTransform(
        bandlimit,
        spin,
        directions,
        sampling=sampling,
        multiresolution=multiresolution,
        tiling=tiling,
        real=real,
    )


def s2wav_grid(transform, j):
    """L_j = min(ceil(lam^(max(j, 1) + 1)), L); N_j = min(N, L_j), raised to the parity of N."""
    if not transform.multiresolution:
        return transform.bandlimit, transform.directions
    size = min(math.ceil(transform.dilation ** (max(j, 1) + 1)), transform.bandlimit)
    directions = min(transform.directions, size)
    return size, directions + (directions + transform.directions) % 2


@every_case
def test_s2wav_layout_is_the_wigner_synthesis_at_its_angles(
    bandlimit, spin, directions, dilation, lowest, sampling, multiresolution
):
    """f_wav[j][g, t, p] = W^j(phi_p, theta_t, 2 pi g / (2 N_j - 1)) on the grid of L_j."""
    transform = make(bandlimit, spin, directions, dilation, lowest, sampling, multiresolution)
    flm = random_flm(bandlimit, spin)
    f_wav, _ = coefficients_to_s2wav(transform, transform.analysis_harmonic(flm))
    orders = transform.wavelets.orientations_of(transform.scales[0]).orders
    assert len(f_wav) == len(transform.scales)
    for j, found in zip(transform.scales, f_wav, strict=True):
        size, count = s2wav_grid(transform, j)
        grid = resolve_sampling(sampling, size)
        gammas = 2 * np.pi * np.arange(2 * count - 1) / (2 * count - 1)
        assert found.shape == (gammas.size, *grid.shape)
        assert found.dtype == np.complex128
        wigner = wavelet_wigner(flm, transform.wavelets, j)
        desired = direct_function(wigner, orders, euler_grid(grid, gammas))
        np.testing.assert_allclose(found.ravel(), desired, rtol=0, atol=1e-12)


@every_case
def test_s2wav_keeps_the_scaling_part_at_the_spin_of_the_signal(
    bandlimit, spin, directions, dilation, lowest, sampling, multiresolution
):
    """f_scal = sum_lm eta_l f_lm sYlm on the grid of min(ceil(lam^J0), L)."""
    transform = make(bandlimit, spin, directions, dilation, lowest, sampling, multiresolution)
    flm = random_flm(bandlimit, spin)
    _, f_scal = coefficients_to_s2wav(transform, transform.analysis_harmonic(flm))
    size = min(math.ceil(dilation**lowest), bandlimit) if multiresolution else bandlimit
    grid = resolve_sampling(sampling, size)
    el = np.repeat(np.arange(bandlimit), 2 * np.arange(bandlimit) + 1)
    scaled = (flm * transform.wavelets.tiling.scaling_kernel[el])[: size**2]
    desired = direct_map(scaled, spin, grid.colatitudes, grid.longitudes)
    assert f_scal.shape == grid.shape
    np.testing.assert_allclose(f_scal, desired, rtol=0, atol=1e-12)


@every_case
def test_s2wav_coefficients_come_back(
    bandlimit, spin, directions, dilation, lowest, sampling, multiresolution
):
    transform = make(bandlimit, spin, directions, dilation, lowest, sampling, multiresolution)
    ours = transform.analysis_harmonic(random_flm(bandlimit, spin))
    found = s2wav_to_coefficients(transform, *coefficients_to_s2wav(transform, ours))
    assert found.parameters == ours.parameters
    for key, shape in ours.shapes.items():
        one, other = (c.scaling if key == "scaling" else c[key] for c in (found, ours))
        assert one.shape == shape
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


@pytest.mark.parametrize("directions", [1, 2, 3, 5])
def test_real_signals_stay_real_there_and_back(directions):
    transform = make(8, 0, directions, 2.0, 0, "mw", True, real=True)
    ours = transform.analysis_harmonic(random_real_flm(8))
    for there, back in (
        (coefficients_to_s2let, s2let_to_coefficients),
        (coefficients_to_s2wav, s2wav_to_coefficients),
    ):
        found = back(transform, *there(transform, ours))
        assert found[2].dtype == np.float64
        assert (found - ours).norm() < 1e-13 * ours.norm()


def test_imaginary_parts_are_no_real_signal():
    transform = make(8, 0, 2, 2.0, 0, "mw", True, real=True)
    f_wav, f_scal = coefficients_to_s2let(
        transform, transform.analysis_harmonic(random_real_flm(8))
    )
    with pytest.raises(DataError, match="have imaginary parts but the transform has real=True"):
        s2let_to_coefficients(transform, 1j * f_wav, f_scal)


def test_orders_that_no_wavelet_holds_are_dropped():
    """The peers can store both parities of n; their synthesis multiplies one by zero."""
    transform = make(8, 2, 3, 2.0, 1, "mw", True)
    ours = transform.analysis_harmonic(random_flm(8, 2))
    f_wav, f_scal = coefficients_to_s2wav(transform, ours)
    gammas = 2 * np.pi * np.arange(5) / 5
    odd = [maps + np.exp(1j * gammas)[:, None, None] for maps in f_wav]
    found = s2wav_to_coefficients(transform, odd, f_scal)
    assert (found - ours).norm() < 1e-13 * ours.norm()


def test_exact_quadrature_is_taken_where_the_scales_agree():
    transform = SpinWaveletTransform(16, 2, 3, lowest_scale=1)
    f_wav, _ = coefficients_to_s2let(transform, transform.analysis_harmonic(random_flm(16, 2)))
    assert f_wav.ndim == 1
    needlets = SpinWaveletTransform(16, 2, 3, tiling=NeedletTiling(16))
    assert coefficients_to_s2wav(needlets, needlets.analysis_harmonic(random_flm(16, 2)))


def test_scales_that_the_peer_does_not_have_are_refused():
    """At L = lam^k + 1 the peers have an empty scale more."""
    transform = SpinWaveletTransform(17, 2, 3)
    coefficients = transform.analysis_harmonic(random_flm(17, 2))
    for there in (coefficients_to_s2let, coefficients_to_s2wav):
        with pytest.raises(ParameterError, match=r"use ScaleDiscretisedTiling\(.*quadrature='s2"):
            there(transform, coefficients)


def test_curvelets_have_no_place_there():
    transform = SpinWaveletTransform(8, directionality=CurveletDirectionality())
    with pytest.raises(ParameterError, match="is none that the peer has; use directions=N"):
        coefficients_to_s2wav(transform, transform.analysis_harmonic(random_flm(8)))


def test_peers_take_one_signal_on_their_grid():
    transform = make(8, 2, 3, 2.0, 1, "mwss", True)
    batch = transform.analysis_harmonic(random_flm(8, 2, batch=(2,)))
    with pytest.raises(ParameterError, match="sampling='mwss' must be 'mw'"):
        coefficients_to_s2let(transform, batch)
    with pytest.raises(ShapeError, match=r"have the batch \(2,\) but the peer takes one signal"):
        coefficients_to_s2wav(transform, batch)


def test_sizes_of_the_peer_are_checked():
    transform = make(8, 2, 3, 2.0, 1, "mw", True)
    f_wav, f_scal = coefficients_to_s2let(transform, transform.analysis_harmonic(random_flm(8, 2)))
    with pytest.raises(ShapeError, match=r"f_wav has shape \(3,\)"):
        s2let_to_coefficients(transform, f_wav[:3], f_scal)
    with pytest.raises(ShapeError, match="f_scal has 2 values"):
        s2let_to_coefficients(transform, f_wav, f_scal[:2])
    scales, scaling = coefficients_to_s2wav(
        transform, transform.analysis_harmonic(random_flm(8, 2))
    )
    with pytest.raises(ShapeError, match="f_wav has 1 scales"):
        s2wav_to_coefficients(transform, scales[:1], scaling)
    with pytest.raises(ShapeError, match="scale 1 has shape"):
        s2wav_to_coefficients(transform, [one[:2] for one in scales], scaling)


@pytest.mark.parametrize("bandlimit", [1, 2, 3, 8])
@pytest.mark.parametrize("batch", [(), (2,)])
def test_s2fft_has_a_rectangle_of_degree_and_order(bandlimit, batch):
    """rectangle[l, m + L - 1] = f_lm."""
    flm = random_flm(bandlimit, batch=batch)
    found = flm_to_s2fft(flm)
    assert found.shape == (*batch, bandlimit, 2 * bandlimit - 1)
    for el in range(bandlimit):
        for m in range(-el, el + 1):
            assert np.all(found[..., el, m + bandlimit - 1] == flm[..., el * el + el + m])
    assert np.count_nonzero(found) == flm.size
    assert np.array_equal(s2fft_to_flm(found), flm)


@pytest.mark.parametrize(("orders", "directions"), [((0,), 1), ((-2, 0, 2), 3), ((-1, 1), 4)])
def test_wigner_coefficients_go_by_order_degree_and_order(orders, directions):
    """flmn[N - 1 + n, l, L - 1 + m]; padded: (N - 1 + n) L^2 + l^2 + l + m."""
    bandlimit = 5
    ours = np.array([random_flm(bandlimit, n, seed=n + 9) for n in orders])
    rectangle = wigner_to_s2fft(ours, orders, directions)
    padded = wigner_to_so3(ours, orders, directions)
    compact = wigner_to_so3(ours, orders, directions, storage="compact")
    assert (
        compact.size
        == (2 * directions - 1) * (3 * bandlimit**2 - directions * (directions - 1)) // 3
    )
    place = 0
    for n in range(1 - directions, directions):
        for el in range(bandlimit):
            for m in range(-el, el + 1):
                value = ours[orders.index(n), el * el + el + m] if n in orders else 0
                assert rectangle[directions - 1 + n, el, bandlimit - 1 + m] == value
                assert padded[(directions - 1 + n) * bandlimit**2 + el * el + el + m] == value
                if el >= abs(n):
                    assert compact[place] == value
                    place += 1
    assert np.array_equal(s2fft_to_wigner(rectangle, orders), ours)
    assert np.array_equal(so3_to_wigner(padded, orders, bandlimit), ours)
    assert np.array_equal(so3_to_wigner(compact, orders, bandlimit, storage="compact"), ours)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: s2fft_to_flm(np.ones((2, 2))), ShapeError, "must be .*bandlimit, 2 bandlimit"),
        (lambda: s2fft_to_wigner(np.ones((2, 2, 3)), (0,)), ShapeError, "2 directions - 1 long"),
        (lambda: s2fft_to_wigner(np.ones((3, 2, 3)), (2,)), ParameterError, "below directions=2"),
        (lambda: wigner_to_so3(np.ones((2, 4)), (0,), 2), ShapeError, "a row for each"),
        (lambda: wigner_to_so3(np.ones((1, 4)), (0,), 2, storage="x"), ParameterError, "storage="),
        (lambda: so3_to_wigner(np.ones(5), (0,), 2), ShapeError, "belongs to no N"),
    ],
)
def test_what_is_no_layout_is_refused(call, error, message):
    with pytest.raises(error, match=message):
        call()
