"""Maps of the true B, of what a method finds and of what is left, band by band.

``python -m benchmarks.purity.pictures hybrid --setting record`` writes docs/_static/purity_maps_*.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.purity.bands import Bands
from benchmarks.purity.catalogue import catalogue
from benchmarks.purity.settings import SETTINGS, Setting
from benchmarks.purity.skies import Skies
from benchmarks.purity.surveys import SURVEYS, survey_mask
from spinsdw.projections import Projection, project_map

__all__ = ["main", "maps_figure", "masks_figure"]

Array = np.ndarray
DOCS = Path(__file__).resolve().parents[2] / "docs"

# Colatitude and longitude of the middle of a picture, and how far it reaches, degrees.
VIEWS = {"A": (0, 0, 90), "B": (147.5, 0, 42), "C": (135, 40, 24), "D": (122, -10, 58)}
SHOWN = (3, 5, 7)
PIXELS = 360


def disc_of_sky(values: Array, survey: str) -> Array:
    """Return the equal-area picture of a HEALPix map around a survey, NaN outside the disc."""
    theta, phi, radius = np.radians(VIEWS[survey])
    projection = Projection("equal_area", centre=(theta, phi), radius=radius, rows=PIXELS)
    return project_map(values, projection)


def _draw(panel: Axes, values: Array, mask: Array, survey: str, limit: float) -> None:
    picture = disc_of_sky(np.where(mask > 0, values, np.nan), survey)
    panel.imshow(picture, cmap="RdBu_r", vmin=-limit, vmax=limit)
    panel.set_facecolor("#d4d4d4")
    panel.set_xticks([])
    panel.set_yticks([])
    panel.spines[:].set_visible(False)


def maps_figure(bands: dict[str, Bands], survey: str, setting: Setting, seed: int) -> Figure:
    """Draw the true B, and the B and the rest of every method, of one noise-free full sky."""
    mask = np.asarray(survey_mask(survey, setting.nside))
    skies = Skies("cmb", setting)
    true = skies.truth("full", seed)
    found = {name: method(*skies.stack("full", [seed]))[0] for name, method in bands.items()}
    rows = [setting.scales.index(j) for j in SHOWN if j in setting.scales]
    columns = 1 + 2 * len(found)
    figure = Figure(figsize=(2.3 * columns, 2.45 * len(rows)), layout="constrained")
    axes = figure.subplots(len(rows), columns, squeeze=False)
    for line, row in zip(axes, rows, strict=True):
        limit = float(np.percentile(np.abs(true[row][mask > 0]), 99.5))
        maps = {"true B": true[row]}
        for name, values in found.items():
            maps[f"{name}: B"] = values[row]
            maps[f"{name}: B - true B"] = values[row] - true[row]
        for panel, (title, values) in zip(line, maps.items(), strict=True):
            _draw(panel, values, mask, survey, limit)
            if row == rows[0]:
                panel.set_title(title, fontsize="small")
        line[0].set_ylabel(f"l = {2 ** setting.scales[row]}, ±{limit:.1g} uK", fontsize="small")
    return figure


def masks_figure(nside: int = 256) -> Figure:
    """Draw the four masks, observed sky white."""
    figure = Figure(figsize=(9.6, 3.0), layout="constrained")
    for panel, name in zip(figure.subplots(1, len(SURVEYS)), SURVEYS, strict=True):
        mask = np.asarray(survey_mask(name, nside))
        panel.imshow(disc_of_sky(mask, name), cmap="Greys_r", vmin=-0.5, vmax=1)
        panel.set_title(f"{name}, {mask.mean():.1%} of the sky", fontsize="small")
        panel.set_xlabel(f"{2 * VIEWS[name][2]}° across", fontsize="small")
        panel.set_xticks([])
        panel.set_yticks([])
        panel.spines[:].set_visible(False)
    return figure


def main() -> None:
    """Write the pictures of the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.purity.pictures")
    parser.add_argument("methods", nargs="+", help="one or two are enough for a page")
    parser.add_argument("--setting", choices=SETTINGS, default="quick")
    parser.add_argument("--surveys", nargs="+", choices=SURVEYS, default=["A", "B"])
    parser.add_argument("--folder", type=Path, default=DOCS / "_static")
    choices = parser.parse_args()
    setting = SETTINGS[choices.setting]
    plain = {"metadata": {"Software": None}, "dpi": 110}
    masks_figure().savefig(choices.folder / "purity_masks.png", **plain)
    for survey in choices.surveys:
        mask = survey_mask(survey, setting.nside)
        bands = {
            label: make(mask, setting)
            for name in choices.methods
            for label, make in catalogue(name)
        }
        figure = maps_figure(bands, survey, setting, setting.test_seeds[0])
        figure.savefig(choices.folder / f"purity_maps_{survey}.png", **plain)


if __name__ == "__main__":
    main()
