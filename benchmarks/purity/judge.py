"""Judge a method of separation: separate skies of every kind and sum what comes out."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

import numpy as np

from benchmarks.purity.bands import Bands, SeparatorBands
from benchmarks.purity.measures import Regions, Result, Sums
from benchmarks.purity.settings import SETTINGS, Setting
from benchmarks.purity.skies import KINDS, Skies
from benchmarks.purity.surveys import survey_mask
from spinsdw import EBSeparator
from spinsdw.masks import distance_to_edge

__all__ = ["judge"]

Array = np.ndarray


def judge(  # noqa: PLR0913 - what is judged, on which skies, and how
    method: object,
    survey: str,
    setting: Setting | str = "quick",
    seeds: Iterable[int] | None = None,
    *,
    model: str = "cmb",
    label: str | None = None,
    linearity: bool = False,
    batch: int = 5,
) -> Result:
    """Return how a method does on the skies of some seeds behind one mask.

    Parameters
    ----------
    method : str, object of spinsdw.separation, EBSeparator or callable
        What is judged; a callable takes Q and U, shape (batch, npix), and returns the B of every
        band, shape (batch, scales, npix).
    survey : str
        "A", "B", "C" or "D".
    setting : Setting or str
        "quick" or "record".
    seeds : iterable of int, optional
        The setting's test seeds when None; tune on ``setting.tuning_seeds``.
    model : str
        "cmb" or "shear".
    label : str, optional
        What results call the method.
    linearity : bool
        Measure the leakage from sep(E + X) - sep(X) as well, X being the B of the full simulation
        and noise: it is the same for linear methods.
    batch : int
        How many maps are separated in one call.
    """
    setting = SETTINGS[setting] if isinstance(setting, str) else setting
    seeds = tuple(setting.test_seeds if seeds is None else seeds)
    mask = survey_mask(survey, setting.nside)
    bands = _bands_of(method, mask, setting)
    # What a method prepares for a mask is not timed with its maps.
    bands(*np.zeros((2, 1, mask.size)))
    timed = _Timed(bands)
    regions = Regions(distance_to_edge(mask))
    sums: Sums = {}
    for start in range(0, len(seeds), batch):
        chunk = list(seeds[start : start + batch])
        for name, values in _squares(timed, Skies(model, setting), chunk, linearity):
            sums[name] = sums.get(name, 0) + regions.sums(values)
    return Result(
        method=label or _label(bands),
        choices=_choices(bands),
        survey=survey,
        model=model,
        setting=setting.name,
        seeds=seeds,
        scales=setting.scales,
        sky_fraction=float(mask.mean()),
        shares=regions.shares,
        sums=sums,
        seconds=timed.seconds,
        separations=timed.separations,
    )


def _bands_of(method: object, mask: Array, setting: Setting) -> Bands:
    if isinstance(method, EBSeparator):
        return SeparatorBands(method, setting)
    if callable(method):
        return method
    return SeparatorBands.of_method(method, mask, setting)


def _separator(bands: Bands) -> EBSeparator | None:
    return bands.separator if isinstance(bands, SeparatorBands) else None


def _label(bands: Bands) -> str:
    separator = _separator(bands)
    return str(separator.method.name if separator else bands)


def _choices(bands: Bands) -> str:
    separator = _separator(bands)
    if separator is None:
        return str(bands)
    directions = separator.directions
    return str(separator.method) + (f", directions={directions}" if directions > 1 else "")


class _Timed:
    """A method and the time it has taken, if it can be told without that of the bands."""

    def __init__(self, bands: Bands) -> None:
        self.bands, self.seconds, self.separations = bands, 0.0, 0

    def __call__(self, q: Array, u: Array) -> Array:
        start = time.perf_counter()
        first = getattr(self.bands, "separate", self.bands)
        found = first(q, u)
        self.seconds += time.perf_counter() - start
        self.separations += len(q)
        return found if first is self.bands else self.bands.evaluate(found)


def _squares(
    bands: Bands, skies: Skies, seeds: list[int], linearity: bool
) -> Iterator[tuple[str, Array]]:
    """Yield names and products summed over seeds, shape (scales, npix)."""
    for kind in KINDS:
        found = bands(*skies.stack(kind, seeds))
        yield f"{kind}^2", np.sum(found**2, axis=0)
        if kind == "E":
            continue
        for seed, mine in zip(seeds, found, strict=True):
            true = skies.truth(kind, seed)
            yield f"{kind}: true^2", true**2
            if kind != "noise":
                yield f"{kind}.true", mine * true
            if kind == "full":
                yield "full: error^2", (mine - true) ** 2
    if linearity:
        e_only, rest = np.array(skies.stack("E", seeds)), _rest(skies, seeds)
        difference = bands(*(e_only + rest)) - bands(*rest)
        yield "difference^2", np.sum(difference**2, axis=0)


def _rest(skies: Skies, seeds: list[int]) -> Array:
    """Q and U of what is not E: the B of the full simulation, and noise, shape (2, seeds, npix)."""
    return np.array(skies.stack("full B", seeds)) + np.array(skies.stack("noise", seeds))
