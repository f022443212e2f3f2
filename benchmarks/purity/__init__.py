"""How pure, faithful and quiet a method's B is behind a mask: the benchmark of E/B separation.

>>> from benchmarks.purity import judge
>>> result = judge("pseudo", "A", "quick")  # doctest: +SKIP
>>> result.f_ret(1e-4), result.at("r_leak", 1)  # doctest: +SKIP

From the command line, each step by itself::

    python -m benchmarks.purity --setting record --methods masked recycling hybrid --linearity
    python -m benchmarks.purity --setting record --model shear --surveys D --methods hybrid namaster
    python -m benchmarks.purity.ratio hybrid wiener --setting record
    python -m benchmarks.purity.pictures masked hybrid --setting record
    python -m benchmarks.purity.report

`settings` says at which resolution, `surveys` has the masks, `skies` the simulations, `bands` what
is compared, `measures` the definitions, `judge` runs them.
"""

from __future__ import annotations

from benchmarks.purity.bands import SeparatorBands
from benchmarks.purity.judge import judge
from benchmarks.purity.measures import DISTANCES, Result
from benchmarks.purity.settings import SETTINGS, Setting
from benchmarks.purity.skies import Skies, band_maps
from benchmarks.purity.surveys import SURVEYS, survey_mask

__all__ = [
    "DISTANCES",
    "SETTINGS",
    "SURVEYS",
    "Result",
    "SeparatorBands",
    "Setting",
    "Skies",
    "band_maps",
    "judge",
    "survey_mask",
]
