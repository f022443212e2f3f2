"""What the tests share: the tolerance rule, random signals and slow direct sums."""

from __future__ import annotations

import functools
import math
import os
from fractions import Fraction

import numpy as np
import pytest

EPS = np.finfo(float).eps
IS_UNCOMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in {"", "0"}

needs_compiler = pytest.mark.skipif(IS_UNCOMPILED, reason="needs compiled code")


def sizes(*bandlimits):
    """Give bandlimits to parametrise with; those above 16 run only where code is compiled."""
    return [pytest.param(L, marks=needs_compiler) if L > 16 else L for L in bandlimits]


def sizes_and_spins(bandlimits, spins):
    """Give every pair of bandlimit and spin that is possible, as `sizes` does."""
    pairs = [(L, s) for L in bandlimits for s in spins if abs(s) < L]
    return [pytest.param(*pair, marks=needs_compiler if pair[0] > 16 else ()) for pair in pairs]


def assert_close(actual, desired, ulps):
    """Assert that |actual - desired| <= ulps * eps * max|desired|, element by element."""
    scale = max(float(np.max(np.abs(desired), initial=0.0)), np.finfo(float).tiny)
    np.testing.assert_allclose(actual, desired, rtol=0, atol=ulps * EPS * scale)


def relative_error(actual, desired):
    """Return the root of the sum of squares of the difference, relative to that of ``desired``."""
    return float(np.linalg.norm(actual - desired) / np.linalg.norm(desired))


def random_flm(bandlimit, spin=0, *, seed=0, batch=()):
    """Draw complex unit-variance coefficients, zero below |spin|; shape (*batch, bandlimit**2)."""
    rng = np.random.default_rng(seed)
    shape = (*batch, bandlimit**2)
    flm = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    flm[..., : min(abs(spin), bandlimit) ** 2] = 0
    return flm


def random_real_flm(bandlimit, *, seed=0, batch=()):
    """Draw the coefficients of a real field: f_{l,-m} = (-1)**m conj(f_lm)."""
    flm = random_flm(bandlimit, seed=seed, batch=batch)
    for el in range(bandlimit):
        m = np.arange(-el, el + 1)
        row = flm[..., el**2 : (el + 1) ** 2]
        row[...] = (row + (-1.0) ** m * row[..., ::-1].conj()) / 2
    return flm


def random_like(array, seed=0):
    """Draw values of unit variance in the shape and kind, real or complex, of an array."""
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(array.shape)
    return values + 1j * rng.standard_normal(array.shape) if np.iscomplexobj(array) else values


def exact_small_d(el, m, n, cosine):
    """d^l_mn where cos(theta) is the fraction ``cosine``: a sum of exact fractions, one rounding.

    d^l_mn = sqrt((l+m)!(l-m)!(l+n)!(l-n)!) sum_k (-1)^(m-n+k) c^(2l+n-m-2k) s^(m-n+2k)
             / ((l+n-k)! k! (m-n+k)! (l-m-k)!),    c, s = cos, sin of theta / 2.
    """
    first, last = max(0, n - m), min(el + n, el - m)
    c2, s2 = (1 + Fraction(cosine)) / 2, (1 - Fraction(cosine)) / 2
    if last < first or (s2 == 0 and m != n) or (c2 == 0 and m != -n):
        return 0.0
    total = Fraction(0)
    for k in range(first, last + 1):
        below = math.prod(math.factorial(i) for i in (el + n - k, k, m - n + k, el - m - k))
        # Whole powers of c^2 and s^2: the rest, c^a s^b with a, b in {0, 1}, is the same in all.
        power = c2 ** ((2 * el + n - m - 2 * k) // 2) * s2 ** ((m - n + 2 * k) // 2)
        total += (-1) ** (m - n + k) * power / below
    square = total**2 * math.prod(math.factorial(el + i) for i in (m, -m, n, -n))
    if (m - n) % 2:
        square *= c2 * s2
    # Scaled by a power of 4, for its square may be below the range of floats.
    power = (square.numerator.bit_length() - square.denominator.bit_length()) // 2
    return math.copysign(math.ldexp(math.sqrt(square / Fraction(4) ** power), power), total)


@functools.cache
def _axis_vectors(el):
    """Eigenvectors of J_y, in columns; its eigenvalues are the integers -l..l, increasing."""
    m = np.arange(-el, el)
    raising = np.diag(np.sqrt((el - m) * (el + m + 1.0)), -1)
    return np.linalg.eigh((raising - raising.T) / 2j)[1]


def small_d(el, n, angles):
    """d^l_mn(angles), shape (*angles.shape, 2l+1), for m = -l..l: exp(-i theta J_y), diagonalised.

    No recursion in degree, so no error that the package's recursion could share.
    """
    angles = np.asarray(angles, dtype=float)
    if abs(n) > el:
        return np.zeros((*angles.shape, 2 * el + 1))
    vectors = _axis_vectors(el)
    phases = np.exp(-1j * angles[..., None] * np.arange(-el, el + 1))
    return ((phases * vectors[el + n].conj()) @ vectors.T).real


def direct_columns(flm, spin, colatitudes):
    """F_m = (-1)^s sum_l sqrt((2l+1)/4pi) f_lm d^l_{m,-s}, shape (..., rings, m = 1-L..L-1)."""
    bandlimit = math.isqrt(flm.shape[-1])
    columns = np.zeros((*flm.shape[:-1], len(colatitudes), 2 * bandlimit - 1), dtype=complex)
    for el in range(bandlimit):
        factor = (-1.0) ** spin * np.sqrt((2 * el + 1) / (4 * np.pi))
        row = factor * flm[..., None, el**2 : (el + 1) ** 2]
        columns[..., bandlimit - 1 - el : bandlimit + el] += row * small_d(el, -spin, colatitudes)
    return columns


def direct_map(flm, spin, colatitudes, longitudes):
    """sum_m F_m(theta) e^{i m phi}, shape (..., rings, phi)."""
    columns = direct_columns(flm, spin, colatitudes)
    m = np.arange(columns.shape[-1]) - columns.shape[-1] // 2
    return columns @ np.exp(1j * np.outer(m, longitudes))


def direct_function(coefficients, orders, angles):
    """sum_lmn (2l+1)/(8pi^2) W_lmn e^{i m alpha} d^l_mn(beta) e^{i n gamma}, shape (..., points).

    ``coefficients``: (..., orders, L*L); ``angles``: alpha, beta, gamma, each of shape (points,).
    """
    alpha, beta, gamma = angles
    total = 0.0
    for el in range(math.isqrt(coefficients.shape[-1])):
        phases = np.exp(1j * np.outer(alpha, np.arange(-el, el + 1)))
        for i, n in enumerate(orders):
            row = coefficients[..., i, el**2 : (el + 1) ** 2]
            values = row @ (phases * small_d(el, n, beta)).T
            total = total + (2 * el + 1) / (8 * np.pi**2) * values * np.exp(1j * n * gamma)
    return total


def euler_grid(sampling, gammas):
    """alpha, beta, gamma of every sample in the order (gamma, ring, phi), each flattened."""
    gamma, beta, alpha = np.meshgrid(
        gammas, sampling.colatitudes, sampling.longitudes, indexing="ij"
    )
    return alpha.ravel(), beta.ravel(), gamma.ravel()


def wavelet_wigner(flm, wavelets, scale):
    """W_lmn = 8pi^2/(2l+1) f_lm conj(psi_ln), shape (..., orders, bandlimit**2)."""
    psi = wavelets.wavelet_harmonics(scale)
    found = np.zeros((*flm.shape[:-1], psi.shape[0], flm.shape[-1]), complex)
    for el in range(psi.shape[1]):
        row = flm[..., None, el**2 : (el + 1) ** 2]
        factor = 8 * np.pi**2 / (2 * el + 1) * psi[:, el, None].conj()
        found[..., el**2 : (el + 1) ** 2] = factor * row
    return found
