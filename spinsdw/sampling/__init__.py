"""Where the points of a map are: the samplings of the sphere."""

from __future__ import annotations

from spinsdw.sampling.base import Sampling
from spinsdw.sampling.equiangular import MW, MWSS
from spinsdw.sampling.gauss_legendre import GaussLegendre
from spinsdw.sampling.healpix_rings import HealpixRings
from spinsdw.sampling.names import SAMPLINGS, resolve_sampling
from spinsdw.sampling.uniform_rings import ClenshawCurtis, DriscollHealy, Fejer1
from spinsdw.sampling.weighted import WeightedRings

__all__ = [
    "MW",
    "MWSS",
    "SAMPLINGS",
    "ClenshawCurtis",
    "DriscollHealy",
    "Fejer1",
    "GaussLegendre",
    "HealpixRings",
    "Sampling",
    "WeightedRings",
    "resolve_sampling",
]
