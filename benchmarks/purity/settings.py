"""At what resolution, with which beam and from which seeds the methods are judged."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from spinsdw import ScaleDiscretisedTiling

__all__ = ["SETTINGS", "Setting"]

LOWEST_SCALE = 2


@dataclass(frozen=True)
class Setting:
    """A resolution with its seeds; choices are tuned on some seeds and judged on others.

    Attributes
    ----------
    name : str
        "tiny", "quick" or "record".
    nside, bandlimit : int
        HEALPix resolution of the maps, and of the skies' harmonic content.
    beam : float
        Full width at half maximum, radians.
    tuning_seeds, test_seeds : range
        Disjoint.
    """

    name: str
    nside: int
    bandlimit: int
    beam: float
    tuning_seeds: range
    test_seeds: range

    @functools.cached_property
    def tiling(self) -> ScaleDiscretisedTiling:
        """The kernels kappa_j: dilation 2, from scale 2 on."""
        return ScaleDiscretisedTiling(self.bandlimit, lowest_scale=LOWEST_SCALE)

    @property
    def scales(self) -> tuple[int, ...]:
        """The scales judged: those whose kernel the bandlimit does not cut, peak l = 2^j."""
        highest = int(math.log2(self.bandlimit - 1)) - 1
        return tuple(range(LOWEST_SCALE, highest + 1))

    @property
    def degrees(self) -> tuple[int, ...]:
        """The degree at which each scale peaks."""
        return tuple(2**j for j in self.scales)


_CHOICES = (
    ("tiny", 16, 33, 6.0, range(100, 101), range(200, 202)),
    ("quick", 128, 257, 1.0, range(100, 105), range(200, 205)),
    ("record", 256, 513, 0.5, range(100, 105), range(200, 210)),
)
SETTINGS = {
    name: Setting(name, nside, bandlimit, float(np.radians(beam)), tuning, test)
    for name, nside, bandlimit, beam, tuning, test in _CHOICES
}
