"""The methods of E/B separation: one file each, and what they share.

An object of one of these classes is a method with its free choices; `spinsdw.EBSeparator` takes it
as ``method``, or its name, which stands for the defaults:

- fits of E and B: ``"hybrid"`` is `Hybrid`, ``"projection"`` `Projection`, ``"wiener"`` `Wiener`;
- smooth masks: ``"pure"`` is `Pure`, ``"harmonic-pure"`` `HarmonicPure`;
- weights: ``"pseudo"`` is `Pseudo`, ``"needlets"`` `SpinNeedlets`;
- to compare with: ``"masked"`` is `Masked`, ``"recycling"`` `Recycling`.
"""

from __future__ import annotations

from spinsdw.separation.harmonic_pure import HarmonicPure
from spinsdw.separation.hybrid import Hybrid
from spinsdw.separation.masked import Masked
from spinsdw.separation.needlets import SpinNeedlets
from spinsdw.separation.projection import Projection
from spinsdw.separation.pseudo import Pseudo
from spinsdw.separation.pure import Pure
from spinsdw.separation.recycling import Recycling
from spinsdw.separation.wiener import Wiener

__all__ = [
    "HarmonicPure",
    "Hybrid",
    "Masked",
    "Projection",
    "Pseudo",
    "Pure",
    "Recycling",
    "SpinNeedlets",
    "Wiener",
]
