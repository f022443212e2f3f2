"""Where the points of a map are: the samplings of the sphere."""

from __future__ import annotations

from spinsdw.sampling.base import Sampling
from spinsdw.sampling.equiangular import MW, MWSS
from spinsdw.sampling.healpix_rings import HealpixRings
from spinsdw.sampling.names import resolve_sampling

__all__ = ["MW", "MWSS", "HealpixRings", "Sampling", "resolve_sampling"]
