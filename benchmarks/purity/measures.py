"""How pure, how faithful and how noisy: sums over regions and skies, and what follows from them.

R(d) holds the observed pixels farther than d from the nearest masked one, the same for every
method. With Bhat the band of a method, B the true one, and sums over R and over all skies,

    r_leak(d)  = sum Bhat^2 [E alone] / sum Bhat^2 [B alone],
    rho_B(d)   = sum Bhat B / sqrt(sum Bhat^2 sum B^2) [B alone],
    f_eff(d)   = (sky in R / sky observed) rho_B^2,
    f_ret(t)   = largest f_eff(d) of the d with r_leak(d) < t,
    eps(d)     = sqrt(sum (Bhat - B)^2 / sum B^2) [full],    rho(d) likewise,
    nz(d)      = (sum Bhat^2 [noise] / sum Bhat^2 [B alone]) / (the same of the full sky's B).

r_leak is in units of r, and no rescaling of a method changes it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

__all__ = ["DISTANCES", "Regions", "Result", "Sums"]

Array = np.ndarray
Sums = dict[str, Array]

DISTANCES = (
    *(0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.2, 1.4, 1.6, 1.8, 2, 2.5, 3, 3.5, 4),
    *(5, 6, 7, 8, 9, 10, 12.5, 15, 20),
)
"""Degrees; a step matters most near the edge, where most of a small survey lies."""


@dataclass(frozen=True, eq=False)
class Regions:
    """Sums over R(d) for every distance at once.

    Parameters
    ----------
    depth : ndarray, shape (npix,)
        Distance of every pixel to the nearest masked one, radians, 0 where masked.
    """

    depth: Array

    @property
    def _place(self) -> Array:
        """How many of the distances each pixel is beyond."""
        return np.searchsorted(np.radians(DISTANCES), self.depth, side="left")

    def sums(self, values: Array) -> Array:
        """Return the sums over every R(d) of values of shape (rows, npix), shape (rows, d)."""
        place, size = self._place, len(DISTANCES) + 1
        cells = np.array([np.bincount(place, weights=row, minlength=size) for row in values])
        return np.cumsum(cells[:, ::-1], axis=1)[:, ::-1][:, 1:]

    @property
    def shares(self) -> Array:
        """Sky in R(d) over sky observed, shape (d,)."""
        pixels = self.sums(np.ones((1, self.depth.size)))[0]
        return pixels / pixels[0]


def _ratio(above: Array, below: Array) -> Array:
    return np.divide(above, below, out=np.full(np.shape(above), np.nan), where=below > 0)


@dataclass(frozen=True, eq=False)
class Result:
    """What was summed over the skies of some seeds, and the measures of it.

    Attributes
    ----------
    method, choices : str
        Label of the method, and its free choices.
    survey, model, setting : str
        Names of mask, sky model and setting.
    seeds : tuple of int
        The seeds of the skies.
    scales : tuple of int
        The scales j, peaks at l = 2^j.
    sky_fraction : float
        Of the mask.
    shares : ndarray, shape (d,)
        Sky in R(d) over sky observed.
    sums : dict of str to ndarray, shape (scales, d)
        By name: "E^2", "B^2", "B.true", "true^2", and so on.
    seconds : float
        Wall time of all separations, without preparation.
    separations : int
        How many maps were separated in that time.
    """

    method: str
    choices: str
    survey: str
    model: str
    setting: str
    seeds: tuple[int, ...]
    scales: tuple[int, ...]
    sky_fraction: float
    shares: Array = field(repr=False)
    sums: Sums = field(repr=False)
    seconds: float
    separations: int

    def __add__(self, other: Result) -> Result:
        """Join the skies of two runs of one method."""
        for name in ("method", "choices", "survey", "model", "setting"):
            mine, its = getattr(self, name), getattr(other, name)
            if mine != its:
                msg = f"{name} is {mine!r} and {its!r}; only runs of one method add up."
                raise ValueError(msg)
        if set(self.seeds) & set(other.seeds) or self.sums.keys() != other.sums.keys():
            msg = "the runs share seeds or hold different sums; add runs of different seeds."
            raise ValueError(msg)
        return replace(
            self,
            seeds=self.seeds + other.seeds,
            sums={name: total + other.sums[name] for name, total in self.sums.items()},
            seconds=self.seconds + other.seconds,
            separations=self.separations + other.separations,
        )

    @property
    def distances(self) -> Array:
        """The distances d, degrees."""
        return np.array(DISTANCES)

    @property
    def r_leak(self) -> Array:
        """Leakage in units of the model's B, shape (scales, d); NaN where nothing was kept."""
        return _ratio(self.sums["E^2"], self.sums["B^2"])

    @property
    def r_leak_linear(self) -> Array:
        """The same from sep(E + X) - sep(X), where it was measured."""
        return _ratio(self.sums["difference^2"], self.sums["B^2"])

    @property
    def rho_b(self) -> Array:
        """Correlation with the true B on skies of B alone, shape (scales, d)."""
        return self._correlation("B")

    @property
    def rho(self) -> Array:
        """Correlation with the true B on the full simulation, shape (scales, d)."""
        return self._correlation("full")

    def _correlation(self, kind: str) -> Array:
        power = self.sums[f"{kind}^2"] * self.sums[f"{kind}: true^2"]
        return _ratio(self.sums[f"{kind}.true"], np.sqrt(power))

    @property
    def eps(self) -> Array:
        """Error relative to the true B on the full simulation, shape (scales, d)."""
        return np.sqrt(_ratio(self.sums["full: error^2"], self.sums["full: true^2"]))

    @property
    def nz(self) -> Array:
        """Noise over B, relative to the full sky, shape (scales, d)."""
        mine = _ratio(self.sums["noise^2"], self.sums["B^2"])
        return _ratio(mine, _ratio(self.sums["noise: true^2"], self.sums["B: true^2"]))

    @property
    def f_eff(self) -> Array:
        """Sky that counts, shape (scales, d); 0 where nothing was kept."""
        rho = np.nan_to_num(self.rho_b)
        return self.shares * np.where(rho > 0, rho, 0) ** 2

    def f_ret(self, limit: float) -> Array:
        """Return the largest f_eff with a leakage below a limit, shape (scales,)."""
        return np.max(np.where(self.r_leak < limit, self.f_eff, 0), axis=1)

    def at(self, measure: str, distance: float) -> Array:
        """Return a measure such as "r_leak" at one of the distances, shape (scales,)."""
        return getattr(self, measure)[:, DISTANCES.index(distance)]

    def to_json(self) -> dict[str, Any]:
        """Return what json can write: sums with five digits."""
        record = asdict(self)
        record["shares"] = _digits(self.shares)
        record["sums"] = {name: _digits(total) for name, total in self.sums.items()}
        return record

    @classmethod
    def from_json(cls, record: dict[str, Any]) -> Result:
        """Undo `to_json`."""
        changed = {
            "seeds": tuple(record["seeds"]),
            "scales": tuple(record["scales"]),
            "shares": np.array(record["shares"]),
            "sums": {name: np.array(total) for name, total in record["sums"].items()},
        }
        return cls(**{**record, **changed})


def _digits(values: Array) -> list:
    return np.vectorize(lambda value: float(f"{value:.5g}"))(values).tolist()
