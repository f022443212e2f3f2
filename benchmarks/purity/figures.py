"""Pictures of results: leakage against sky kept, and the sky kept of every band."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from benchmarks.purity.families import Family, families
from benchmarks.purity.measures import Result
from benchmarks.purity.surveys import SURVEYS

__all__ = ["leakage_figure", "retained_figure", "save_figures"]

# Okabe and Ito's colours, told apart by every kind of sight; ours are solid, others' are dashed.
STYLES = {
    "masked": ("0.6", "--", "x"),
    "needlets": ("#CC79A7", "--", "v"),
    "pseudo": ("#56B4E9", "-", "^"),
    "NaMaster": ("#D55E00", "--", "s"),
    "harmonic-pure": ("#E69F00", "--", "D"),
    "pure": ("#009E73", "-", "P"),
    "recycling": ("#8C564B", "--", "*"),
    "projection": ("#7B6FD0", "-", "d"),
    "hybrid": ("#0072B2", "-", "o"),
    "wiener": ("black", ":", "+"),
}
FLOOR = 1e-9


def _style(label: str) -> dict:
    colour, line, marker = STYLES.get(label.split(",", maxsplit=1)[0], ("0.3", "-", "."))
    return {"color": colour, "linestyle": line, "marker": marker}


def _grid(count: int, columns: int, size: tuple[float, float]) -> tuple[Figure, list[Axes]]:
    rows = -(-count // columns)
    figure = Figure(figsize=(size[0] * columns, size[1] * rows), layout="constrained")
    axes = list(figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel())
    for panel in axes[count:]:
        panel.remove()
    for panel in axes[:count]:
        panel.grid(visible=True, which="major", color="0.9")
        panel.spines[["top", "right"]].set_visible(False)
    return figure, axes[:count]


def _label(panel: Axes, below: str, left: str) -> None:
    """Name the axes of the panels at the rim."""
    place = panel.get_subplotspec()
    if place.is_last_row():
        panel.set_xlabel(below)
    if place.is_first_col():
        panel.set_ylabel(left)


def _legend(figure: Figure, axes: Iterable[Axes], columns: int) -> None:
    """One legend below all panels, for every line that any of them has."""
    entries = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(
        entries.values(), entries, loc="outside lower center", ncols=columns, frameon=False
    )


def leakage_figure(found: list[Family], title: str) -> Figure:
    """Draw r_leak against f_eff, one panel for each band, one point for each distance."""
    scales = found[0].scales
    figure, axes = _grid(len(scales), 4 if len(scales) > 6 else 3, (3.1, 2.7))
    for panel, scale in zip(axes, scales, strict=True):
        for family in found:
            sky, leak = family.frontier(scale)
            panel.plot(sky, np.maximum(leak, FLOOR), label=family.label, **_style(family.label))
        panel.set_title(f"l = {2**scale}", fontsize="medium")
        panel.axhline(1e-4, color="0.7", linewidth=0.8, zorder=0)
    axes[0].set_yscale("log")
    axes[0].set_xlim(0, 1)
    for panel in axes:
        panel.yaxis.set_major_locator(LogLocator(numticks=9))
        panel.yaxis.set_minor_locator(NullLocator())
        panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0e}"))
        _label(panel, "sky that counts, f_eff", "leakage r_leak")
    figure.suptitle(title, fontsize="medium")
    _legend(figure, axes, 5)
    return figure


def retained_figure(groups: dict[str, list[Family]], limit: float) -> Figure:
    """Draw f_ret of every band, one panel for each mask."""
    figure, axes = _grid(len(groups), 2, (4.6, 3.0))
    for panel, (survey, found) in zip(axes, groups.items(), strict=True):
        degrees = [2**scale for scale in found[0].scales]
        for family in found:
            panel.plot(degrees, family.f_ret(limit), label=family.label, **_style(family.label))
        panel.set_title(f"{survey}: {SURVEYS[survey][0]}", fontsize="small")
        panel.set_xscale("log", base=2)
        panel.set_xticks(degrees, labels=[str(degree) for degree in degrees])
        panel.xaxis.minorticks_off()
    axes[0].set_ylim(-0.03, 1.03)
    for panel in axes:
        _label(panel, "l at the peak of the band", f"sky kept at r_leak < {limit:.0e}")
    _legend(figure, axes, 5)
    return figure


def save_figures(results: list[Result], folder: Path) -> list[str]:
    """Save every picture that has data; return the names of the files."""
    folder.mkdir(parents=True, exist_ok=True)
    groups = {name: families(results, name) for name in SURVEYS}
    groups = {name: found for name, found in groups.items() if found}
    shear = families(results, "D", "shear")
    saved = {}
    with mpl.rc_context({"font.size": 9, "lines.markersize": 4, "lines.linewidth": 1.2}):
        for name, found in groups.items():
            saved[f"purity_leakage_{name}"] = leakage_figure(found, f"Mask {name}")
        if shear:
            saved["purity_leakage_shear"] = leakage_figure(shear, "Mask D, cosmic shear")
        for limit in (1e-4, 1e-5):
            saved[f"purity_kept_{limit:.0e}".replace("e-0", "e-")] = retained_figure(groups, limit)
        for name, figure in saved.items():
            # No date and no version inside: the same numbers make the same file.
            figure.savefig(folder / f"{name}.png", dpi=110, metadata={"Software": None})
    return list(saved)
