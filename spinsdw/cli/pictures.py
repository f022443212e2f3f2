"""Draw what a separation was given and what it found."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.cli.outputs import PICTURES
from spinsdw.cli.summary import TRUSTED, part_degrees
from spinsdw.errors import MissingPackageError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from spinsdw.cli.inputs import Inputs
    from spinsdw.polarisation import EBMaps

__all__ = ["check_matplotlib", "draw_pictures"]

Array = np.ndarray[Any, Any]


def check_matplotlib() -> None:
    """Raise MissingPackageError, before any work, where pictures cannot be drawn."""
    if find_spec("matplotlib") is None:
        msg = "pictures need matplotlib; pip install 'spinsdw[plot]' or give --no-pictures."
        raise MissingPackageError(msg)


def draw_pictures(
    folder: Path,
    inputs: Inputs,
    maps: EBMaps,
    *,
    bands: Mapping[int | str, tuple[Array, Array]],
    remark: str = "",
) -> None:
    """Draw Q, U, the mask, E, B, and B scale by scale.

    Parameters
    ----------
    folder : Path
        Where to; an existing directory without pictures.
    inputs : Inputs
        Q, U and the mask.
    maps : EBMaps
        E, B and their weights, RING order.
    bands : mapping
        What `EBSeparator.bands` returned for `maps`.
    remark : str
        A line above every picture.
    """
    from spinsdw.plotting import figure_grid, mollweide_figure, save_figure

    mask = np.ones(inputs.q.shape) if inputs.mask is None else inputs.mask
    stokes = _style(inputs.q, inputs.u, mask, unit=inputs.maps.unit)
    trusted = _trusted(maps.weight, mask)
    fields = _style(maps.E, maps.B, trusted, unit=inputs.maps.unit) | {"mask": trusted}
    where = "" if inputs.mask is None else f" where the weight is above {TRUSTED}"
    figures = (
        mollweide_figure(inputs.q, title="Stokes Q", **stokes),
        mollweide_figure(inputs.u, title="Stokes U", **stokes),
        mollweide_figure(mask, title="Mask", unit="weight", limits=(0, 1), colour_map="Blues"),
        mollweide_figure(maps.E, title=f"E{where}", **fields),
        mollweide_figure(maps.B, title=f"B{where}", **fields),
        figure_grid(_panels(maps, bands, mask), unit=inputs.maps.unit, colour_map="RdBu_r"),
    )
    for figure, name in zip(figures, PICTURES, strict=True):
        if remark:
            figure.suptitle(remark, fontsize="small")
        save_figure(figure, folder / name)


def _trusted(weight: Array, mask: Array) -> Array:
    """Return where to show a result, 1 or 0: where it is good, or else where it was observed."""
    good = weight > TRUSTED
    return np.asarray(good if good.any() else mask > 0, dtype=np.float64)


def _style(first: Array, second: Array, where: Array, *, unit: str) -> dict[str, Any]:
    """Return colours that make two maps comparable in a part of the sky."""
    moduli = np.abs([first[where > 0], second[where > 0]])
    end = float(np.percentile(moduli, 99.5)) or float(moduli.max()) or 1.0
    return {"unit": unit, "limits": (-end, end), "colour_map": "RdBu_r"}


def _panels(
    maps: EBMaps, bands: Mapping[int | str, tuple[Array, Array]], mask: Array
) -> dict[str, Array]:
    """Return title and map of B, nan where hidden, for the scales of which anything is good."""
    panels = {}
    for key, (_, b) in bands.items():
        # The scaling part has no map of its weights.
        kept = maps.info.kept_fraction[key]
        weight = kept * mask if isinstance(key, str) else maps.weights[key]
        low, high = part_degrees(key, maps.coefficients.parameters)
        if np.any(weight > TRUSTED) and low <= high:
            name = "scaling part" if isinstance(key, str) else f"scale {key}"
            panels[f"B, {name}, degrees {low} to {high}"] = np.where(weight > TRUSTED, b, np.nan)
    return panels or {"B": np.where(mask > 0, maps.B, np.nan)}
