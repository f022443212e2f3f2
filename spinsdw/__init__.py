"""Spin scale-discretised wavelets on the sphere.

The public names load on first use, so that ``import spinsdw`` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from spinsdw.coefficients import WaveletCoefficients
    from spinsdw.directionality import (
        CurveletDirectionality,
        RidgeletDirectionality,
        SteerableDirectionality,
    )
    from spinsdw.polarisation import EBErrors, EBMaps, EBSeparator
    from spinsdw.spin_transform import SpinHarmonicTransform
    from spinsdw.tiling import ScaleDiscretisedTiling
    from spinsdw.wavelet_transform import SpinWaveletTransform
    from spinsdw.wavelets import Wavelets
    from spinsdw.wigner_transform import WignerTransform

    __version__: str

__all__ = [
    "CurveletDirectionality",
    "EBErrors",
    "EBMaps",
    "EBSeparator",
    "RidgeletDirectionality",
    "ScaleDiscretisedTiling",
    "SpinHarmonicTransform",
    "SpinWaveletTransform",
    "SteerableDirectionality",
    "WaveletCoefficients",
    "Wavelets",
    "WignerTransform",
    "__version__",
]

_HOMES = {
    "CurveletDirectionality": "spinsdw.directionality",
    "EBErrors": "spinsdw.polarisation",
    "EBMaps": "spinsdw.polarisation",
    "EBSeparator": "spinsdw.polarisation",
    "RidgeletDirectionality": "spinsdw.directionality",
    "ScaleDiscretisedTiling": "spinsdw.tiling",
    "SpinHarmonicTransform": "spinsdw.spin_transform",
    "SpinWaveletTransform": "spinsdw.wavelet_transform",
    "SteerableDirectionality": "spinsdw.directionality",
    "WaveletCoefficients": "spinsdw.coefficients",
    "Wavelets": "spinsdw.wavelets",
    "WignerTransform": "spinsdw.wigner_transform",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        return import_module("importlib.metadata").version("spinsdw")
    if name not in _HOMES:
        msg = f"module 'spinsdw' has no attribute {name!r}; dir(spinsdw) lists the public names."
        raise AttributeError(msg)
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
