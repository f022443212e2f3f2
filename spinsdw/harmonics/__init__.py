"""The algebra of spherical-harmonic coefficients, without any sampling.

Coefficients of a field of any spin are one array ``flm`` whose last axis has ``bandlimit**2``
entries, in the order ``[(el, m) for el in range(bandlimit) for m in range(-el, el + 1)]``. Axes
before the last are a batch. Equation labels are those of ``docs/conventions``.
"""

from __future__ import annotations

from spinsdw.harmonics.algebra import (
    conjugate_field,
    eb_to_spin,
    is_real_field,
    lower_spin,
    multiply_by_degree,
    polarisation_factor,
    power_spectrum,
    raise_spin,
    spin_to_eb,
)
from spinsdw.harmonics.layout import (
    bandlimit_of,
    check_bandlimit,
    check_flm,
    check_integer,
    degrees,
    index,
    orders,
    read_flm,
    resize,
)

__all__ = [
    "bandlimit_of",
    "check_bandlimit",
    "check_flm",
    "check_integer",
    "conjugate_field",
    "degrees",
    "eb_to_spin",
    "index",
    "is_real_field",
    "lower_spin",
    "multiply_by_degree",
    "orders",
    "polarisation_factor",
    "power_spectrum",
    "raise_spin",
    "read_flm",
    "resize",
    "spin_to_eb",
]
