"""Turn a results file into the tables and figures of the performance page.

``python benchmarks/report.py`` reads benchmarks/results.json and writes
docs/performance_tables.inc and docs/_static/performance_*.png.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from figures import save_figures

__all__ = ["growth_exponent", "main", "tables", "write_report"]

Row = dict[str, Any]
Rows = list[Row]

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results.json"
OURS = "spinsdw"
COMPARED = ("wavelets", "pys2let", "harmonic", "healpix", "geometry")
NAMES = {"healpix": "HEALPix ", "harmonic": "spin ", "batch": "batch, "}

CAPTIONS = {
    "bandlimit": "Time of a wavelet transform against the bandlimit.",
    "directions": "Time of a wavelet transform against the number of directions.",
    "maps": "Time of a wavelet transform that starts from, or ends in, a map.",
    "harmonic": "Time of the spin transform of one map on the McEwen-Wiaux grid.",
    "accuracy": "Error of a round trip from random coefficients of unit variance.",
}


def duration(seconds: float) -> str:
    """Write three digits, in seconds or milliseconds."""
    value, unit = (seconds, "s") if seconds >= 1 else (1e3 * seconds, "ms")
    digits = 0 if value >= 99.95 else 1 if value >= 9.995 else 2
    return f"{value:.{digits}f} {unit}"


def times(ratio: float) -> str:
    """Write a ratio of times, in bold where the peer is faster."""
    text = f"{ratio:.1f}" if ratio >= 9.95 else f"{ratio:.2f}"
    return f"**{text}**" if is_loss(ratio) else text


def is_loss(ratio: float) -> bool:
    """Tell whether the peer is faster, to the digits that are printed."""
    return round(ratio, 2) < 1


def size_text(count: float) -> str:
    return f"{count / 2**20:.0f} MiB" if count >= 10 * 2**20 else f"{count / 2**20:.1f} MiB"


def table(title: str, groups: Iterable[tuple[str, list[str]]], rows: list[list[str]]) -> list[str]:
    """Write a simple table whose columns stand in named groups; no names, no second header."""
    groups = list(groups)
    header = [name for _, names in groups for name in names]
    columns = zip(header, *rows, strict=True)
    widths = [max(len(value) for value in column) for column in columns]
    spans, start = [], 0
    for name, names in groups:
        last = start + len(names) - 1
        # The last column of a group grows where the group's name needs room.
        missing = len(name) - sum(widths[start : last + 1]) - 2 * (len(names) - 1)
        widths[last] += max(0, missing)
        spans.append(sum(widths[start : last + 1]) + 2 * (len(names) - 1))
        start = last + 1
    rule = "  ".join("=" * width for width in widths)
    text = [_line(row, widths) for row in [header, *rows]]
    over = [_line([name for name, _ in groups], spans), "  ".join("-" * span for span in spans)]
    lines = [rule, *(over if any(name for name, _ in groups) else []), text[0], rule]
    lines += [*text[1:], rule]
    return [f".. table:: {title}", "", *(f"   {line}" for line in lines), ""]


def _line(values: Iterable[str], widths: Iterable[int]) -> str:
    return "  ".join(value.ljust(width) for value, width in zip(values, widths, strict=True))


def _peer(row: Row) -> str:
    """Return the name of the second contestant; the first is ours."""
    return list(row["seconds"])[1]


def _ratio(row: Row) -> float:
    """How many times as long the peer takes."""
    ours, peer = row["seconds"].values()
    return peer / ours


def _comparison(title: str, rows: Rows, keys: list[str]) -> list[str]:
    """One line a size, one group of columns a number of threads."""
    threads = sorted({row["threads"] for row in rows})
    peer = _peer(rows[0])
    groups = [("size", keys)]
    groups += [(_thread_text(count), [OURS, peer, "ratio"]) for count in threads]
    lines: dict[tuple, list[str]] = {}
    for row in sorted(rows, key=lambda row: row["threads"]):
        line = lines.setdefault(tuple(row[key] for key in keys), [])
        line += [duration(row["seconds"][OURS]), duration(row["seconds"][peer]), times(_ratio(row))]
    body = [[*map(str, size), *line] for size, line in lines.items()]
    return table(title, groups, body)


def _thread_text(count: int) -> str:
    return "1 thread" if count == 1 else f"{count} threads"


def _comparisons(rows: Rows, keys: list[str]) -> list[str]:
    """One table for each direction and signal."""
    text = []
    for direction in dict.fromkeys(row["direction"] for row in rows):
        for signal in dict.fromkeys(row["signal"] for row in rows):
            chosen = [
                row for row in rows if row["direction"] == direction and row["signal"] == signal
            ]
            if chosen:
                name = direction[0].upper() + direction[1:]
                text += _comparison(f"{name}, {signal}", chosen, keys)
    return text


def _losses(jobs: dict[str, Rows]) -> list[str]:
    """Say where a peer is faster, and how many times as long we take; worst first."""
    found: dict[str, list[tuple[float, str]]] = {}
    for job in (*COMPARED, "batch"):
        for row in jobs.get(job, []):
            slower = 1 / _ratio(row)
            if is_loss(_ratio(row)):
                sizes = ", ".join(
                    f"{key} = {row[key]}" for key in ("nside", "L", "N") if key in row
                )
                what = f"{NAMES.get(job, '')}{row['direction']}, {row['signal']}"
                key = f"{what}, {_thread_text(row['threads'])}, against {_peer(row)}"
                found.setdefault(key, []).append((slower, sizes))
    title = ["Where it loses", "--------------", ""]
    if not found:
        return [*title, "Nowhere in this run: no peer was faster in any row below.", ""]
    lines = []
    for key, cases in sorted(found.items(), key=lambda item: -max(item[1])[0]):
        places = "; ".join(f"{slower:.2f} at {sizes}" for slower, sizes in sorted(cases)[::-1])
        lines.append(f"- {key}: {places}.")
    return [*title, "Here it takes longer, by these factors:", "", *lines, ""]


def _summary(jobs: dict[str, Rows]) -> list[str]:
    """Range of the ratios of each kind of transform."""
    lines = []
    for job in COMPARED:
        rows = jobs.get(job, [])
        for direction in dict.fromkeys(row["direction"] for row in rows):
            chosen = [row for row in rows if row["direction"] == direction]
            ratios = [_ratio(row) for row in chosen]
            name = NAMES.get(job, "")
            middle = times(float(np.median(ratios))).strip("*")
            line = [f"{name}{direction}", _peer(chosen[0]), str(len(chosen))]
            lines.append([*line, times(min(ratios)), middle, times(max(ratios))])
    if not lines:
        return []
    head = [("", ["transform", "peer", "rows", "least", "median", "most"])]
    title = "How many times as long the peer takes"
    return ["In short", "--------", "", *table(title, head, lines)]


def _machine(machine: Row, jobs: dict[str, Row]) -> list[str]:
    versions = ", ".join(f"{k} {v}" for k, v in machine["versions"].items() if v)
    dates = sorted({job["date"][:10] for job in jobs.values()})
    revisions = ", ".join(dict.fromkeys(str(job["revision"]) for job in jobs.values()))
    loads = [job["load"] for job in jobs.values() if job["load"] is not None]
    plans = ", ".join(dict.fromkeys(job["plan"] for job in jobs.values()))
    bits = 64 * machine["vector_width"]
    lines = [
        f":Processor: {machine['cpu']}, {machine['cores']} cores, vectors of {bits} bits",
        f":System: {machine['system']}, Python {machine['python']}",
        f":Versions: {versions}",
        f":Measured: {dates[0] if len(dates) == 1 else f'{dates[0]} to {dates[-1]}'}, "
        f'revision {revisions}, sizes "{plans}"',
    ]
    if loads:
        lines.append(f":Load: {min(loads):.1f} to {max(loads):.1f} at the start of the jobs")
    return [*lines, ""]


def growth_exponent(sizes: Iterable[float], seconds: Iterable[float]) -> float:
    """Return the slope of log(seconds) over log(size), by least squares."""
    return float(np.polyfit(np.log(list(sizes)), np.log(list(seconds)), 1)[0])


def _linear_fit(sizes: list[float], seconds: list[float]) -> tuple[float, float, float]:
    """Return seconds = a + b size by least squares, and the largest relative deviation."""
    b, a = np.polyfit(sizes, seconds, 1)
    fitted = a + b * np.array(sizes)
    return float(a), float(b), float(np.max(np.abs(fitted / np.array(seconds) - 1)))


def _growth(rows: Rows) -> list[str]:
    lines, text = [], []
    for row in rows:
        sizes = [float(name) for name in row["seconds"]]
        seconds = list(row["seconds"].values())
        if row["over"] == "L":
            ends = [
                f"{growth_exponent(sizes[i : i + 2], seconds[i : i + 2]):.2f}"
                for i in range(len(sizes) - 1)
            ]
            exponent = f"{growth_exponent(sizes, seconds):.2f}"
            lines.append([row["direction"], exponent, ", ".join(ends)])
        else:
            a, b, off = _linear_fit(sizes, seconds)
            text.append(
                f"- {row['direction']}, L = {row['L']}, N = {sizes[0]:.0f} to {sizes[-1]:.0f}: "
                f"{duration(b)} for each direction and {duration(abs(a))} "
                f"{'besides' if a >= 0 else 'less'}; no time is more than {off:.0%} off."
            )
    head = [("", ["direction", "exponent", "from one bandlimit to the next"])]
    sizes_text = ", ".join(next(row for row in rows if row["over"] == "L")["seconds"])
    title = f"Fitted exponents of L, N = 3, L = {sizes_text}"
    return [*table(title, head, lines), "In N the time is a straight line:", "", *text, ""]


def _threads(rows: Rows) -> list[str]:
    lines = []
    for row in rows:
        counts = sorted({int(name.split()[1]) for name in row["seconds"]})
        least, most = counts[0], counts[-1]
        gains = [
            row["seconds"][f"{name} {least}"] / row["seconds"][f"{name} {most}"]
            for name in (OURS, "ducc0")
        ]
        lines.append([row["direction"], str(row["L"]), *(f"{gain:.2f}" for gain in gains)])
    title = f"{_thread_text(least)} against {most}: how many times as fast, spin 2, N = 3"
    return table(title, [("", ["direction", "L", OURS, "ducc0"])], lines)


def _batch(rows: Rows) -> list[str]:
    lines = []
    for row in rows:
        line = [row["direction"], str(row["L"]), str(row["threads"])]
        line += [duration(seconds) for seconds in row["seconds"].values()]
        lines.append([*line, times(_ratio(row))])
    names = ["direction", "L", "threads", "one call", "single calls", "ratio"]
    return table(f"{rows[0]['maps']} maps, spin 2, N = {rows[0]['N']}", [("", names)], lines)


def _memory(rows: Rows) -> list[str]:
    lines = []
    for row in rows:
        held = row["input"] + row["output"]
        estimate = row["estimate"]
        told = size_text(estimate) if isinstance(estimate, int | float) else "none"
        line = [row["direction"], row["dtype"], str(row["L"]), str(row["N"]), size_text(held)]
        lines.append([*line, size_text(row["growth"]), f"{row['growth'] / held:.2f}", told])
    names = ["direction", "stored as", "L", "N", "input + output", "growth", "ratio", "estimate"]
    return table("Growth of a process to its peak, input and output included", [("", names)], lines)


def _accuracy(rows: Rows) -> list[str]:
    lines = [
        [row["what"], row["signal"], str(row["L"]), f"{row['largest']:.1e}", f"{row['rms']:.1e}"]
        for row in rows
    ]
    names = ["round trip", "signal", "L", "largest", "root mean square"]
    title = "Error of a round trip over the largest coefficient"
    return table(title, [("", names)], lines)


def _startup(rows: Rows) -> list[str]:
    parts = ["import", "load", "first", "second"]
    lines = [[row["cache"], *(duration(row[part]) for part in parts)] for row in rows]
    names = ["cache", "``import spinsdw``", "making a transform", "first use", "second use"]
    title = f"Seconds of a new process, spin 2, N = 3, L = {rows[0]['L']}, back and forth"
    return table(title, [("", names)], lines)


SECTIONS: dict[str, tuple[str, tuple[str, ...], Callable[[Rows], list[str]]]] = {
    "wavelets": (
        "Wavelet transforms",
        ("bandlimit", "directions"),
        lambda rows: _comparisons(rows, ["L", "N"]),
    ),
    "pys2let": ("From maps, against pys2let", ("maps",), lambda rows: _comparisons(rows, ["L"])),
    "harmonic": ("Spin transforms", ("harmonic",), lambda rows: _comparisons(rows, ["L"])),
    "healpix": ("HEALPix", (), lambda rows: _comparisons(rows, ["nside"])),
    "geometry": (
        "Rotations, points, other grids",
        (),
        lambda rows: _comparisons(rows, ["L"]),
    ),
    "batch": ("Batches", (), _batch),
    "healpix batch": (
        "Batches on HEALPix",
        (),
        lambda rows: _comparisons(rows, ["nside"]),
    ),
    "threads": ("Threads", (), _threads),
    "growth": ("Growth", (), _growth),
    "memory": ("Memory", (), _memory),
    "accuracy": ("Accuracy", ("accuracy",), _accuracy),
    "startup": ("Start-up", (), _startup),
}


def tables(results: Row, figures: Iterable[str] = CAPTIONS) -> str:
    """Write the page's generated part as reStructuredText, with the named figures."""
    jobs = {name: job["rows"] for name, job in results["jobs"].items() if job["rows"]}
    text = [".. Generated by benchmarks/report.py from benchmarks/results.json.", ""]
    text += _machine(results["machine"], results["jobs"])
    text += [*_summary(jobs), *_losses(jobs)]
    for name, (title, pictures, write) in SECTIONS.items():
        if name not in jobs:
            continue
        text += [title, "-" * len(title), ""]
        for picture in pictures:
            if picture in figures:
                text += [f".. figure:: _static/performance_{picture}.png", "   :width: 100%"]
                text += [f"   :alt: {CAPTIONS[picture]}", "", f"   {CAPTIONS[picture]}", ""]
        text += write(jobs[name])
    return "\n".join(line.rstrip() for line in text)


def write_report(results: Row, docs: Path) -> None:
    """Write tables and figures below a documentation folder."""
    jobs = {name: job["rows"] for name, job in results["jobs"].items()}
    saved = save_figures(jobs, docs / "_static")
    (docs / "performance_tables.inc").write_text(tables(results, saved), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--input", type=Path, default=RESULTS)
    parser.add_argument("--docs", type=Path, default=ROOT / "docs")
    choices = parser.parse_args()
    write_report(json.loads(choices.input.read_text(encoding="utf-8")), choices.docs)


if __name__ == "__main__":
    main()
