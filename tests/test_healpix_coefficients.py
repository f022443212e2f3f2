"""Wavelet coefficients at HEALPix pixels, against direct sums over Wigner coefficients."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.directionality import CurveletDirectionality, RidgeletDirectionality
from spinsdw.errors import ParameterError, ShapeError
from spinsdw.healpix import coefficients_to_healpix, flm_to_map, pixel_directions
from spinsdw.sampling import SAMPLINGS
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import direct_function, random_flm, random_real_flm, wavelet_wigner

NSIDE = 2


def direct_maps(transform, flm, scale):
    """W(phi_p, theta_p, gamma_k) at every pixel, shape (orientations, pixels)."""
    orientations = transform.wavelets.orientations_of(scale)
    theta, phi = pixel_directions(NSIDE)
    wigner = wavelet_wigner(flm, transform.wavelets, scale)
    return np.array(
        [
            direct_function(wigner, orientations.orders, (phi, theta, gamma))
            for gamma in orientations.angles
        ]
    )


@pytest.mark.parametrize(
    ("bandlimit", "spin", "directions", "sampling"),
    [(1, 0, 1, "mw"), (3, 1, 3, "mwss"), (9, 2, 3, "mw"), (8, -1, 4, "gl"), (8, 0, 8, "mw")],
)
@pytest.mark.parametrize("multiresolution", [True, False])
def test_every_scale_is_exact_at_the_pixels(bandlimit, spin, directions, sampling, multiresolution):
    transform = SpinWaveletTransform(
        bandlimit, spin, directions, sampling=sampling, multiresolution=multiresolution
    )
    flm = random_flm(bandlimit, spin)
    coefficients = transform.analysis_harmonic(flm)
    for scale in transform.scales:
        found = coefficients_to_healpix(transform, coefficients, scale, NSIDE)
        desired = direct_maps(transform, flm, scale)
        assert found.shape == (directions, 12 * NSIDE**2)
        np.testing.assert_allclose(found, desired, rtol=0, atol=1e-13 * bandlimit)


@pytest.mark.parametrize("directions", [1, 2, 3, 4])
def test_real_signals_have_real_maps(directions):
    transform = SpinWaveletTransform(8, 0, directions, real=True)
    flm = random_real_flm(8)
    coefficients = transform.analysis_harmonic(flm)
    for scale in transform.scales:
        found = coefficients_to_healpix(transform, coefficients, scale, NSIDE)
        desired = direct_maps(transform, flm, scale)
        assert found.dtype == np.float64
        np.testing.assert_allclose(found, desired, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "directionality",
    [CurveletDirectionality(), CurveletDirectionality(centred=True), RidgeletDirectionality()],
    ids=repr,
)
def test_curvelets_and_ridgelets_have_their_own_orientations(directionality):
    transform = SpinWaveletTransform(8, 0, directionality=directionality)
    flm = random_flm(8)
    flm[transform.wavelets.lost_degrees[np.repeat(np.arange(8), 2 * np.arange(8) + 1)]] = 0
    coefficients = transform.analysis_harmonic(flm)
    for scale in transform.scales:
        found = coefficients_to_healpix(transform, coefficients, scale, NSIDE)
        desired = direct_maps(transform, flm, scale)
        np.testing.assert_allclose(found, desired, rtol=0, atol=1e-12)


@pytest.mark.parametrize("real", [False, True])
def test_scaling_part_is_a_scalar_field(real):
    """W^phi_lm = eta_l f_lm."""
    transform = SpinWaveletTransform(8, 0, 3, lowest_scale=2, real=real)
    flm = random_real_flm(8)
    coefficients = transform.analysis_harmonic(flm)
    found = coefficients_to_healpix(transform, coefficients, "scaling", NSIDE)
    el = np.repeat(np.arange(8), 2 * np.arange(8) + 1)
    desired = flm_to_map(flm * transform.tiling.scaling_kernel[el], NSIDE)
    assert np.iscomplexobj(found) != real
    np.testing.assert_allclose(found, desired, rtol=0, atol=1e-13)


def test_batches_are_kept():
    transform = SpinWaveletTransform(8, 2, 3)
    signals = random_flm(8, 2, batch=(2, 2))
    together = coefficients_to_healpix(transform, transform.analysis_harmonic(signals), 2, NSIDE)
    assert together.shape == (2, 2, 3, 48)
    alone = coefficients_to_healpix(transform, transform.analysis_harmonic(signals[1, 0]), 2, NSIDE)
    np.testing.assert_allclose(together[1, 0], alone, rtol=0, atol=1e-14)
    empty = transform.analysis_harmonic(signals[:0, 0])
    assert coefficients_to_healpix(transform, empty, 2, NSIDE).shape == (0, 3, 48)


def test_bad_scales_resolutions_and_coefficients_are_refused():
    transform = SpinWaveletTransform(8, 2, 3)
    coefficients = transform.analysis_harmonic(random_flm(8, 2))
    for scale in (9, "wavelets", None, [1]):
        with pytest.raises(ParameterError, match="is not held; give 'scaling' or one of"):
            coefficients_to_healpix(transform, coefficients, scale, NSIDE)
    with pytest.raises(ParameterError, match="nside="):
        coefficients_to_healpix(transform, coefficients, 1, 0)
    with pytest.raises(ShapeError, match="use the transform that made them"):
        coefficients_to_healpix(SpinWaveletTransform(16, 2, 3), coefficients, 1, NSIDE)


@pytest.mark.parametrize("sampling", list(SAMPLINGS))
@pytest.mark.parametrize("options", [{}, {"multiresolution": False}, {"real": True}], ids=repr)
def test_coefficients_know_enough_of_themselves(sampling, options):
    for size in (1, 2, 7, 8):
        transform = SpinWaveletTransform(size, 0, min(size, 2), sampling=sampling, **options)
        coefficients = transform.analysis_harmonic(random_real_flm(size, batch=(2,)))
        for part in transform.shapes:
            expected = coefficients_to_healpix(transform, coefficients, part, NSIDE)
            assert np.array_equal(coefficients.to_healpix(part, NSIDE), expected)


def test_coefficients_of_curvelets_and_parts_of_a_spin_signal_know_it_too():
    """Re W of a spin signal is a real function of rotations: its maps are real parts"""
    transform = SpinWaveletTransform(9, 2, directionality=CurveletDirectionality())
    coefficients = transform.analysis_harmonic(random_flm(9, 2))
    for j in transform.scales:
        expected = coefficients_to_healpix(transform, coefficients, j, NSIDE)
        assert np.array_equal(coefficients.to_healpix(j, NSIDE), expected)
        real = coefficients.map(np.real).to_healpix(j, NSIDE)
        assert real.dtype == np.float64
        np.testing.assert_allclose(real, expected.real, rtol=0, atol=1e-12)


def test_coefficients_say_what_they_cannot_evaluate():
    coefficients = SpinWaveletTransform(8).analysis_harmonic(np.ones(64))
    for part in (9, "scale", None):
        with pytest.raises(ParameterError, match=f"scale={part!r} is not held"):
            coefficients.to_healpix(part, NSIDE)
    other = WaveletCoefficients(coefficients.scaling, {1: coefficients[1]}, {"directions": 1})
    with pytest.raises(ParameterError, match="sampling='' is not known"):
        other.to_healpix(1, NSIDE)
    turned = {1: coefficients[1].swapaxes(-1, -2)}
    wrong = WaveletCoefficients(coefficients.scaling, turned, coefficients.parameters)
    with pytest.raises(ShapeError, match=r"scale 1 has shape \(1, 7, 4\); it must be"):
        wrong.to_healpix(1, NSIDE)
