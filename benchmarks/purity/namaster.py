"""NaMaster's pure B as a method of the benchmark, where pymaster can be imported.

NaMaster is under the BSD licence and no dependency of the package. What is judged is its purified
field: the coefficients of the B of an apodised mask, cut into the bands.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass

import numpy as np

from benchmarks.purity.settings import Setting
from benchmarks.purity.skies import band_maps
from spinsdw.healpix import alm_to_flm

__all__ = ["NaMasterBands", "namaster_is_there"]

Array = np.ndarray


def namaster_is_there() -> bool:
    """Tell whether pymaster can be imported."""
    return importlib.util.find_spec("pymaster") is not None


@dataclass(frozen=True, eq=False)
class NaMasterBands:
    """Purified B of a mask with one apodisation: "C1" or "C2" and its width in degrees."""

    mask: Array
    setting: Setting
    profile: str
    width: float

    def __post_init__(self) -> None:
        import pymaster

        apodised = pymaster.mask_apodization(self.mask, self.width, apotype=self.profile)
        object.__setattr__(self, "apodised", apodised)

    def __str__(self) -> str:
        return f"{self.profile}, {self.width:g} deg"

    def __call__(self, q: Array, u: Array) -> Array:
        """Return the B of every band, shape (batch, scales, npix)."""
        return self.evaluate(self.separate(q, u))

    def separate(self, q: Array, u: Array) -> list[Array]:
        """Return the purified B of every map; what is timed."""
        return [self._b_alm(*maps) for maps in zip(q, u, strict=True)]

    def evaluate(self, b_alms: list[Array]) -> Array:
        """Return the B of every band, shape (batch, scales, npix)."""
        setting = self.setting
        return band_maps(np.array([alm_to_flm(alm, setting.bandlimit) for alm in b_alms]), setting)

    def _b_alm(self, q: Array, u: Array) -> Array:
        import pymaster

        highest = self.setting.bandlimit - 1
        limits = {"lmax": highest, "lmax_mask": highest}
        maps = [q * self.mask, u * self.mask]
        field = pymaster.NmtField(self.apodised, maps, spin=2, purify_b=True, n_iter=3, **limits)
        return field.get_alms()[1]
