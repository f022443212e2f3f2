"""The figures of the performance page, from the rows of a results file."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

__all__ = ["FIGURES", "save_figures"]

Row = dict[str, Any]
Rows = list[Row]

# Okabe and Ito's colours, told apart by every kind of sight; ours are solid, a peer's are dashed.
STYLES = {
    "spinsdw": {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    "ducc0": {"color": "#D55E00", "linestyle": "--", "marker": "s"},
    "pys2let": {"color": "#009E73", "linestyle": "--", "marker": "^"},
}
SIGNAL_FILL = {"spin 2": "full", "real scalar": "none"}


def _pick(rows: Iterable[Row], **wanted: Any) -> Rows:
    return [row for row in rows if all(row.get(key) == value for key, value in wanted.items())]


def _panels(titles: list[str], ylabel: str) -> tuple[Figure, list[Axes]]:
    """Panels side by side, with one vertical axis for all: times are to be compared."""
    figure = Figure(figsize=(max(5.5, 4.6 * len(titles)), 4.1), layout="constrained")
    axes = list(figure.subplots(1, len(titles), sharey=True, squeeze=False)[0])
    axes[0].set_ylabel(ylabel)
    for panel, title in zip(axes, titles, strict=True):
        panel.set_title(title, fontsize="medium")
        panel.grid(visible=True, which="major", color="0.9")
        panel.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _scale(panel: Axes, ticks: Iterable[int], xlabel: str) -> None:
    """Logarithmic axes; the horizontal ticks are the values that were measured."""
    panel.set_xscale("log", base=2)
    panel.set_yscale("log")
    panel.set_xticks(sorted(set(ticks)), labels=[str(tick) for tick in sorted(set(ticks))])
    panel.xaxis.minorticks_off()
    panel.set_xlabel(xlabel)
    low, high = panel.get_ylim()
    subs = (1.0,) if high > 1000 * low else (1.0, 2.0, 5.0)
    panel.yaxis.set_major_locator(LogLocator(subs=subs))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0e}"))
    panel.yaxis.set_minor_locator(NullLocator())


def _in_seconds(panel: Axes) -> None:
    """Write the times of the vertical axis in full: 0.02 rather than 2e-02."""
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _draw_times(panel: Axes, rows: Rows, x: str, xlabel: str, label: str = "") -> None:
    """Draw one line for each package, over the field ``x`` of the rows."""
    signal = rows[0]["signal"]
    for name in rows[0]["seconds"]:
        points = sorted((row[x], row["seconds"][name]) for row in rows)
        text = f"{name}{label}"
        fill = SIGNAL_FILL.get(signal, "full")
        panel.plot(*zip(*points, strict=True), label=text, fillstyle=fill, **STYLES[name])
    _scale(panel, [row[x] for row in rows], xlabel)
    _in_seconds(panel)


def _draw_cube(panel: Axes, rows: Rows) -> None:
    """Draw a guide of slope 3 below the data, ending at the last bandlimit."""
    size = sorted({row["L"] for row in rows})
    last = [row for row in rows if row["L"] == size[-1]]
    end = 0.5 * min(min(row["seconds"].values()) for row in last)
    sizes = np.array(size[-3:], dtype=float)
    panel.plot(sizes, end * (sizes / size[-1]) ** 3, color="0.5", linewidth=1)
    middle = (sizes[-1] * sizes[0]) ** 0.5
    place = (middle, end * (middle / size[-1]) ** 3)
    offset = {"xytext": (8, -6), "textcoords": "offset points", "va": "top"}
    panel.annotate("slope of $L^3$", place, color="0.4", fontsize="small", **offset)


def _over_bandlimit(jobs: dict[str, Rows]) -> Figure | None:
    rows = _pick(jobs.get("wavelets", []), threads=1)
    if not rows:
        return None
    counts = {row["N"] for row in rows}
    directions = 3 if 3 in counts else max(counts)
    titles = ["harmonic to wavelet", "wavelet to harmonic"]
    figure, axes = _panels([f"{title}, N = {directions}" for title in titles], "seconds, 1 thread")
    for panel, title in zip(axes, titles, strict=True):
        for signal in SIGNAL_FILL:
            chosen = _pick(rows, N=directions, direction=title, signal=signal)
            _draw_times(panel, chosen, "L", "bandlimit L", f", {signal}")
        _draw_cube(panel, _pick(rows, N=directions, direction=title))
    axes[0].legend(frameon=False, fontsize="small")
    return figure


def _over_directions(jobs: dict[str, Rows]) -> Figure | None:
    rows = _pick(jobs.get("wavelets", []), threads=1, signal="spin 2")
    if not rows:
        return None
    sizes = sorted({row["L"] for row in rows})
    shown = sizes[-2] if len(sizes) > 1 else sizes[-1]
    titles = ["harmonic to wavelet", "wavelet to harmonic"]
    figure, axes = _panels([f"{title}, L = {shown}" for title in titles], "seconds, 1 thread")
    for panel, title in zip(axes, titles, strict=True):
        _draw_times(panel, _pick(rows, L=shown, direction=title), "N", "directions N", ", spin 2")
    axes[0].legend(frameon=False, fontsize="small")
    return figure


def _over_maps(jobs: dict[str, Rows]) -> Figure | None:
    rows = jobs.get("pys2let", [])
    if not rows:
        return None
    titles = ["map to wavelet", "wavelet to map"]
    figure, axes = _panels([f"{title}, N = 3" for title in titles], "seconds, 1 thread")
    for panel, title in zip(axes, titles, strict=True):
        _draw_times(panel, _pick(rows, direction=title), "L", "bandlimit L", ", spin 2")
    axes[0].legend(frameon=False, fontsize="small")
    return figure


def _harmonic(jobs: dict[str, Rows]) -> Figure | None:
    rows = _pick(jobs.get("harmonic", []), threads=1)
    if not rows:
        return None
    titles = ["synthesis", "analysis"]
    figure, axes = _panels([f"{title}, one map" for title in titles], "seconds, 1 thread")
    for panel, title in zip(axes, titles, strict=True):
        for signal in SIGNAL_FILL:
            chosen = _pick(rows, direction=title, signal=signal)
            _draw_times(panel, chosen, "L", "bandlimit L", f", {signal}")
        _draw_cube(panel, _pick(rows, direction=title))
    axes[0].legend(frameon=False, fontsize="small")
    return figure


def _accuracy(jobs: dict[str, Rows]) -> Figure | None:
    rows = _pick(jobs.get("accuracy", []), signal="spin 2")
    if not rows:
        return None
    figure, (panel,) = _panels(["round trip, spin 2"], "largest error / largest coefficient")
    colours = {"spin transform": "#0072B2", "spin transform, ducc0": "#D55E00"}
    for what in dict.fromkeys(row["what"] for row in rows):
        points = sorted((row["L"], row["largest"]) for row in rows if row["what"] == what)
        line = "--" if "ducc0" in what else "-"
        colour = colours.get(what, "#CC79A7")
        panel.plot(*zip(*points, strict=True), marker="o", label=what, color=colour, linestyle=line)
    _scale(panel, [row["L"] for row in rows], "bandlimit L")
    panel.legend(frameon=False, fontsize="small")
    return figure


FIGURES: dict[str, Callable[[dict[str, Rows]], Figure | None]] = {
    "bandlimit": _over_bandlimit,
    "directions": _over_directions,
    "maps": _over_maps,
    "harmonic": _harmonic,
    "accuracy": _accuracy,
}


def save_figures(jobs: dict[str, Rows], folder: Path) -> list[str]:
    """Save ``performance_<name>.png`` for every figure that has data; return those names."""
    folder.mkdir(parents=True, exist_ok=True)
    saved = []
    with mpl.rc_context({"font.size": 10, "lines.markersize": 5, "lines.linewidth": 1.5}):
        for name, draw in FIGURES.items():
            figure = draw(jobs)
            if figure is not None:
                # No date and no version inside: the same numbers make the same file.
                figure.savefig(
                    folder / f"performance_{name}.png", dpi=120, metadata={"Software": None}
                )
                saved.append(name)
    return saved
