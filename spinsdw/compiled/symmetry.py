"""The symmetry of real fields."""

from __future__ import annotations

from spinsdw.compiled.jit import kernel

__all__ = ["fill_negative_m"]


@kernel
def fill_negative_m(L, flm):
    """f_{l,-m} = (-1)^m conj(f_lm) for m > 0, and Im f_l0 = 0; flm: (fields, L*L)."""
    for field in range(flm.shape[0]):
        values = flm[field]
        for el in range(L):
            centre = el * el + el
            values[centre] = values[centre].real
            for m in range(1, el + 1):
                value = values[centre + m].conjugate()
                values[centre - m] = -value if m & 1 else value
