"""The methods that are judged, by name: those of the package, and NaMaster."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.purity.bands import SeparatorBands
from benchmarks.purity.namaster import NaMasterBands
from benchmarks.purity.settings import Setting
from benchmarks.purity.skies import MODELS, SkyModel
from spinsdw.separation.registry import METHODS
from spinsdw.simulation import ARCMIN

__all__ = ["NAMASTER", "Entry", "catalogue"]

Array = np.ndarray
Entry = Callable[[Array, Setting], object]
"""Mask and setting -> what `judge` takes."""

NAMASTER = "NaMaster"
APODISATIONS = tuple((profile, width) for profile in ("C1", "C2") for width in (1, 2, 4, 6, 9, 14))
# Tapers of the smooth harmonic estimator, degrees; too wide for a survey, it is narrowed.
WIDTHS = (2, 4, 6, 9, 14)


def _namaster(profile: str, width: float) -> Entry:
    return lambda mask, setting: NaMasterBands(mask, setting, profile, width)


def _own(method: object, directions: int = 1) -> Entry:
    return lambda mask, setting: SeparatorBands.of_method(
        method, mask, setting, directions=directions
    )


def _wiener(model: SkyModel) -> Entry:
    """Give the Wiener filter the spectra and the noise that the full skies have."""
    spectra = dict(zip(("e_spectrum", "b_spectrum"), model.spectra["full"], strict=True))
    return _own(METHODS["wiener"](**spectra, noise_level=model.noise * ARCMIN))


def catalogue(name: str, model: str = "cmb") -> list[tuple[str, Entry]]:
    """Return the variants of a method: the label of its results, and how to make it.

    ``name`` is a method of `spinsdw.separation`, with ":3" for three directions; or "namaster",
    which has a variant for every apodisation, as "harmonic-pure" has for every width. "wiener" is
    given the true spectra of the full skies of a model.
    """
    if name == "namaster":
        return [(NAMASTER, _namaster(*choice)) for choice in APODISATIONS]
    method, _, directions = name.partition(":")
    if method not in METHODS:
        msg = f"method {method!r} is not known; use namaster or one of {', '.join(METHODS)}."
        raise SystemExit(msg)
    if name == "wiener":
        return [(name, _wiener(MODELS[model]()))]
    if name == "harmonic-pure":
        kind = METHODS[name]
        return [(name, _own(kind(width=float(np.radians(width))))) for width in WIDTHS]
    label = f"{method}, N = {directions}" if directions else method
    return [(label, _own(method, int(directions or 1)))]
