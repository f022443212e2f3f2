"""How a wavelet depends on azimuth: its orders, its orientations, and steering between them."""

from __future__ import annotations

from spinsdw.directionality.base import Directionality
from spinsdw.directionality.curvelet import CurveletDirectionality
from spinsdw.directionality.orientations import Orientations
from spinsdw.directionality.ridgelet import RidgeletDirectionality
from spinsdw.directionality.steerable import SteerableDirectionality

__all__ = [
    "CurveletDirectionality",
    "Directionality",
    "Orientations",
    "RidgeletDirectionality",
    "SteerableDirectionality",
]
