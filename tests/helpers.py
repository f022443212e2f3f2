"""What the tests share: the tolerance rule, random signals and slow direct sums."""

from __future__ import annotations

import numpy as np

EPS = np.finfo(float).eps


def assert_close(actual, desired, ulps):
    """Assert that |actual - desired| <= ulps * eps * max|desired|, element by element."""
    scale = max(float(np.max(np.abs(desired), initial=0.0)), np.finfo(float).tiny)
    np.testing.assert_allclose(actual, desired, rtol=0, atol=ulps * EPS * scale)


def random_flm(bandlimit, spin=0, *, seed=0, batch=()):
    """Draw complex unit-variance coefficients, zero below |spin|; shape (*batch, bandlimit**2)."""
    rng = np.random.default_rng(seed)
    shape = (*batch, bandlimit**2)
    flm = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    flm[..., : min(abs(spin), bandlimit) ** 2] = 0
    return flm
