"""Tilings: how the degrees are shared out between the scaling function and the scales."""

from __future__ import annotations

from spinsdw.tiling.base import LowpassTiling, Tiling
from spinsdw.tiling.custom import CustomTiling
from spinsdw.tiling.dilated import DilatedTiling
from spinsdw.tiling.hybrid import HybridTiling
from spinsdw.tiling.needlet import NeedletTiling
from spinsdw.tiling.scale_discretised import ScaleDiscretisedTiling
from spinsdw.tiling.spline import SplineTiling

__all__ = [
    "CustomTiling",
    "DilatedTiling",
    "HybridTiling",
    "LowpassTiling",
    "NeedletTiling",
    "ScaleDiscretisedTiling",
    "SplineTiling",
    "Tiling",
]
