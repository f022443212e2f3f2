"""The tensor-to-scalar ratio, end to end: from Q and U behind a mask to r and its error.

Skies hold lensed E, lensing B, tensors of r = 0.01 and noise of 2 uK arcmin.  The data are the band
powers p_j, the means over R(d) of Bhat_j^2.  With the response p = m + (r - 0.01) D the estimator
is

    r = 0.01 + (D^T C^-1 D)^-1 D^T C^-1 (p - m).

m and C are mean and covariance of skies WITHOUT E and of other seeds, D the mean of tensors alone:
what leaks from E is not in the model, so that it shows as a shift of r.  The same estimator with
its own m, C and D is applied to the true B of the same skies: to the true bands plus those of the
same noise as the full sky has it. The two differ by what the mask and the method do, and by nothing
else; the shift is the mean of their difference.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.purity.bands import Bands
from benchmarks.purity.catalogue import catalogue
from benchmarks.purity.results import FOLDER, describe_run
from benchmarks.purity.settings import SETTINGS, Setting
from benchmarks.purity.skies import Skies
from benchmarks.purity.surveys import SURVEYS, survey_mask
from spinsdw.masks import distance_to_edge

__all__ = ["Powers", "RatioTest", "estimate_ratio", "main", "measure_ratio"]

Array = np.ndarray

RATIO = 0.01
# Of the skies with E, of those that calibrate, and of the tensors: no seed twice.
SEEDS = {"data": (1000, 1100), "rest": (2000, 2100), "tensors": (3000, 3040)}


@dataclass(frozen=True, eq=False)
class Powers:
    """Band powers of the three kinds of skies, each of shape (skies, scales)."""

    data: Array
    rest: Array
    tensors: Array


def estimate_ratio(powers: Powers) -> Array:
    """Return r of every sky of the data."""
    mean, response = powers.rest.mean(axis=0), powers.tensors.mean(axis=0)
    # A band in which nothing is kept has no power and no say.
    kept = response > 0
    mean, response = mean[kept], response[kept]
    covariance = np.atleast_2d(np.cov(powers.rest[:, kept], rowvar=False))
    weights = np.linalg.solve(covariance, response)
    return RATIO + (powers.data[:, kept] - mean) @ weights / (weights @ response)


@dataclass(frozen=True, eq=False)
class RatioTest:
    """r of every sky from a method and from the true B."""

    method: str
    found: Array
    true: Array

    @property
    def shift(self) -> float:
        """Mean of r minus that from the true B."""
        return float(np.mean(self.found - self.true))

    @property
    def shift_error(self) -> float:
        """Standard error of the shift: of the mean over the skies, and of m from as many others."""
        return float(np.std(self.found - self.true, ddof=1) * np.sqrt(2 / self.found.size))

    @property
    def sigma(self) -> float:
        """Standard deviation of r."""
        return float(np.std(self.found, ddof=1))

    @property
    def true_sigma(self) -> float:
        """Standard deviation of r from the true B in the same region."""
        return float(np.std(self.true, ddof=1))

    def to_json(self) -> dict[str, Any]:
        """Return what json can write."""
        values = {name: np.round(getattr(self, name), 6).tolist() for name in ("found", "true")}
        return {"method": self.method, **values}

    @classmethod
    def from_json(cls, record: dict[str, Any]) -> RatioTest:
        """Undo `to_json`."""
        return cls(record["method"], np.array(record["found"]), np.array(record["true"]))


def _chunks(name: str, count: float, batch: int) -> Iterator[list[int]]:
    first, last = SEEDS[name]
    last = first + round(count * (last - first))
    for start in range(first, last, batch):
        yield list(range(start, min(start + batch, last)))


def _maps(skies: Skies, name: str, seeds: list[int]) -> tuple[Array, Array]:
    if name == "tensors":
        return skies.stack("B", seeds)
    kind = "full" if name == "data" else "full B"
    q, u = np.array(skies.stack(kind, seeds)) + np.array(skies.stack("noise", seeds))
    return q, u


def _truth(skies: Skies, name: str, seed: int) -> Array:
    if name == "tensors":
        return skies.truth("B", seed)
    return skies.truth("full", seed) + skies.truth("noise", seed)


def _powers(make: Callable[[str, list[int]], Array], region: Array, count: float) -> Powers:
    """Collect band powers of bands of shape (seeds, scales, npix)."""
    found = {
        name: np.concatenate(
            [
                np.mean(make(name, seeds)[..., region] ** 2, axis=-1)
                for seeds in _chunks(name, count, 10)
            ]
        )
        for name in SEEDS
    }
    return Powers(**found)


def _true_powers(skies: Skies, region: Array, count: float, key: str) -> Powers:
    """Band powers of the true B, kept in a file of the temporary directory."""
    path = Path(tempfile.gettempdir()) / f"spinsdw-ratio-{key}.npz"
    if not path.is_file():
        powers = _powers(
            lambda name, seeds: np.array([_truth(skies, name, seed) for seed in seeds]),
            region,
            count,
        )
        np.savez(path, **vars(powers))
    return Powers(**np.load(path))


def measure_ratio(  # noqa: PLR0913 - what is measured, on which skies, and where
    bands: Bands,
    survey: str,
    setting: Setting,
    *,
    label: str,
    distance: float = 1.0,
    share: float = 1.0,
) -> RatioTest:
    """Estimate r from every sky, with a method and with the true B.

    Parameters
    ----------
    bands : callable
        The method, as `judge` takes it.
    survey : str
        Name of the mask.
    setting : Setting
        Resolution and beam.
    label : str
        Name of the method.
    distance : float
        Degrees from the edge at which R begins.
    share : float
        Share of the skies to take, for a quick look.
    """
    region = distance_to_edge(survey_mask(survey, setting.nside)) > np.radians(distance)
    skies = Skies("cmb", setting, keep=False)
    key = f"{setting.name}-{survey}-{distance:g}-{share:g}"
    true = _true_powers(skies, region, share, key)
    mine = _powers(lambda name, seeds: bands(*_maps(skies, name, seeds)), region, share)
    return RatioTest(label, estimate_ratio(mine), estimate_ratio(true))


def summary(test: RatioTest) -> str:
    """Return the numbers of a test as a line of text."""
    return (
        f"{test.method}: shift {test.shift:+.2e} +- {test.shift_error:.1e}, sigma(r) "
        f"{test.sigma:.2e}; true B: mean {test.true.mean():.4f}, sigma(r) {test.true_sigma:.2e}"
    )


def _keep(test: RatioTest, path: Path) -> None:
    records = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []
    records = [record for record in records if record["test"]["method"] != test.method]
    records.append({"run": describe_run(), "test": test.to_json()})
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ",\n".join(json.dumps(record, separators=(",", ":")) for record in records)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def main() -> None:
    """Run the test for methods of the catalogue."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.purity.ratio")
    parser.add_argument("methods", nargs="+")
    parser.add_argument("--setting", choices=SETTINGS, default="quick")
    parser.add_argument("--survey", choices=SURVEYS, default="B")
    parser.add_argument("--share", type=float, default=1.0, help="share of the skies")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    choices = parser.parse_args()
    setting = SETTINGS[choices.setting]
    mask = survey_mask(choices.survey, setting.nside)
    for name in choices.methods:
        for label, make in catalogue(name):
            options = {"label": label, "share": choices.share}
            test = measure_ratio(make(mask, setting), choices.survey, setting, **options)
            print(summary(test), flush=True)
            _keep(test, choices.folder / f"ratio-{choices.survey}-{setting.name}.json")


if __name__ == "__main__":
    main()
