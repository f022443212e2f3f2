"""Write the tables and pictures of docs/purity: ``python -m benchmarks.purity.report``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.purity.families import Family, families
from benchmarks.purity.figures import save_figures
from benchmarks.purity.measures import Result
from benchmarks.purity.ratio import RatioTest
from benchmarks.purity.results import FOLDER, read_results, results_path
from benchmarks.purity.settings import SETTINGS, Setting
from benchmarks.purity.surveys import SURVEYS

__all__ = ["all_tables", "main", "tables"]

Array = np.ndarray
DOCS = Path(__file__).resolve().parents[2] / "docs"

# Measured before with NaMaster 3.0 at nside 128 (limit 1e-4) and 256 (limit 1e-5), on masks of the
# same kind but not these; best apodisation of each band. Shown where NaMaster itself was not run.
QUOTED = {
    ("A", 1e-4): (0, 0.00, 0.32, 0.75, 0.88, 0.90),
    ("B", 1e-4): (0, 0.41, 0.67, 0.78, 0.92, 0.94),
    ("C", 1e-4): (0, 0, 0, 0.47, 0.74, 0.80),
    ("A", 1e-5): (0, 0, 0, 0.47, 0.86, 0.89, 0.79),
    ("B", 1e-5): (0, 0, 0.34, 0.77, 0.89, 0.92, 0.92),
    ("C", 1e-5): (0, 0, 0, 0.31, 0.70, 0.73, 0.74),
}
QUOTED_LABEL = "NaMaster, quoted"


def share(value: float) -> str:
    """Write 0.953 as .95, and 0 as a dot where nothing is kept."""
    if not value > 0:
        return "·"
    return f"{value:.2f}".removeprefix("0") if value < 0.995 else "1.00"


def power(value: float) -> str:
    """Write 0.0123 as 1e-2."""
    if not np.isfinite(value):
        return "none"
    mantissa, exponent = f"{value:.0e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def number(value: float) -> str:
    """Write a number of order 1 with two digits."""
    if not np.isfinite(value):
        return "none"
    return f"{value:.2f}" if value < 9.95 else f"{value:.0f}"


def table(title: str, header: list[str], rows: Iterable[list[str]]) -> list[str]:
    """Return the lines of a simple table."""
    rows = [header, *rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    rule = "  ".join("=" * width for width in widths)
    text = [
        "  ".join(value.ljust(width) for value, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    lines = [rule, text[0], rule, *text[1:], rule]
    return [f".. table:: {title}", "", *(f"   {line}" for line in lines), ""]


def _header(scales: tuple[int, ...]) -> list[str]:
    return ["method", *(f"l = {2**j}" for j in scales)]


def _rows(
    found: list[Family], values: Callable[[Family], Array], write: Callable[[float], str]
) -> Iterator[list[str]]:
    for family in found:
        yield [family.label, *map(write, values(family))]


def _quoted_row(found: list[Family], survey: str, limit: float) -> list[list[str]]:
    numbers = QUOTED.get((survey, limit))
    count = len(found[0].scales)
    if numbers is None or any(family.label == "NaMaster" for family in found):
        return []
    padded = [*map(share, numbers), *["none"] * count]
    return [[QUOTED_LABEL, *padded[:count]]]


def _survey_tables(results: list[Result], survey: str) -> list[str]:
    found = families(results, survey)
    if not found:
        return []
    head = _header(found[0].scales)
    name = f"Mask {survey}, {SURVEYS[survey][0]}, {found[0].results[0].sky_fraction:.1%} of the sky"
    text = [name, "~" * len(name), ""]
    for limit in (1e-4, 1e-5):
        rows = list(_rows(found, lambda family, limit=limit: family.f_ret(limit), share))
        rows += _quoted_row(found, survey, limit)
        text += table(f"Sky kept, f_ret, at a leakage below {power(limit)}", head, rows)
    for title, measure, write in (
        ("Leakage r_leak at d > 1°", "r_leak", power),
        ("Error of B, eps, at d > 1° on the full simulation", "eps", number),
        ("Noise nz at d > 1°, relative to the full sky", "nz", number),
    ):
        rows = _rows(found, lambda family, m=measure: family.at(m, 1), write)
        text += table(title, head, rows)
    rows = _rows(found, lambda family: family.at("f_eff", 1), share)
    return text + table("Sky that counts, f_eff, at d > 1°", head, rows)


def _linear(results: list[Result]) -> list[str]:
    """Leakage from sep(E + X) - sep(X), where it was measured."""
    chosen = [result for result in results if "difference^2" in result.sums]
    if not chosen:
        return []
    head = ["method", "mask", *(f"l = {2**j}" for j in chosen[0].scales)]
    rows = [
        [result.method, result.survey, *map(number, ratio)]
        for result in chosen
        for ratio in [result.at("r_leak_linear", 1) / result.at("r_leak", 1)]
    ]
    title = "Leakage of sep(E + X) - sep(X) over that of E alone, at d > 1°"
    return ["Linearity", "~~~~~~~~~", "", *table(title, head, rows)]


def _shear(results: list[Result]) -> list[str]:
    found = families(results, "D", "shear")
    if not found:
        return []
    head = _header(found[0].scales)
    text = ["Cosmic shear behind mask D", "~~~~~~~~~~~~~~~~~~~~~~~~~~", ""]
    rows = _rows(found, lambda family: family.at("r_leak", 1), power)
    text += table("Leakage at d > 1°, in units of a B of 1 % of E", head, rows)
    pure = [family for family in found if family.label in {"NaMaster", "harmonic-pure"}]
    for peer in pure:
        rows = _rows(
            [family for family in found if family is not peer],
            lambda family, peer=peer: np.array([_gain(family, peer, j) for j in family.scales]),
            power,
        )
        text += table(
            f"How much more {peer.label} leaks at equal sky, median along its curve", head, rows
        )
    rows = _rows(found, lambda family: family.at("eps", 1), number)
    text += table("Error of the injected B, eps, at d > 1°", head, rows)
    rows = _rows(found, lambda family: family.at("nz", 1), number)
    return text + table("Shape noise nz at d > 1°, relative to the full sky", head, rows)


def _gain(mine: Family, peer: Family, scale: int) -> float:
    """Leakage of a peer over mine at the same f_eff: the largest that the peer reaches below mine.

    At each of the peer's points the method's least leakage with at least that sky; the median.
    """
    sky, leak = peer.frontier(scale)
    own_sky, own_leak = mine.frontier(scale)
    ratios = [
        there / own_leak[own_sky >= here].min()
        for here, there in zip(sky, leak, strict=True)
        if np.any(own_sky >= here)
    ]
    return float(np.median(ratios)) if ratios else np.nan


def _times(results: list[Result]) -> list[str]:
    names = [name for name in SURVEYS if families(results, name)]
    groups = {name: families(results, name) for name in names}
    labels = list(dict.fromkeys(family.label for found in groups.values() for family in found))
    rows = []
    for label in labels:
        row = [label]
        for name in names:
            times = [family.seconds for family in groups[name] if family.label == label]
            row.append(f"{times[0]:.2f} s" if times else "none")
        rows.append(row)
    head = ["method", *(f"mask {name}" for name in names)]
    return ["Time", "~~~~", "", *table("Wall time of one map, in a stack", head, rows)]


def _ratio_row(test: RatioTest, tests: list[RatioTest]) -> list[str]:
    bound = [other.sigma for other in tests if other.method == "wiener"]
    return [
        test.method,
        f"{test.shift:+.1e} ± {test.shift_error:.0e}",
        f"{test.shift / test.sigma:+.2f}",
        f"{test.sigma:.2e}",
        f"{test.sigma / test.true_sigma:.2f}",
        f"{test.sigma / bound[0]:.2f}" if bound else "none",
    ]


def _ratio_tables(setting: Setting, folder: Path) -> list[str]:
    text = []
    for survey in SURVEYS:
        path = folder / f"ratio-{survey}-{setting.name}.json"
        if not path.is_file():
            continue
        records = json.loads(path.read_text(encoding="utf-8"))
        tests = [RatioTest.from_json(record["test"]) for record in records]
        rows = [_ratio_row(test, tests) for test in tests]
        head = [
            "method",
            "shift of r",
            "shift / sigma(r)",
            "sigma(r)",
            "over the true B's",
            "over wiener's",
        ]
        title = f"r behind mask {survey}, {tests[0].found.size} skies of r = 0.01"
        text += [title, "~" * len(title), "", *table(title, head, rows)]
    return text


def _footer(setting: Setting, folder: Path) -> list[str]:
    records = json.loads(results_path(setting.name, folder).read_text(encoding="utf-8"))
    runs = [record["run"] for record in records]
    seeds = sorted({seed for record in records for seed in record["result"]["seeds"]})
    dates = sorted({run["date"] for run in runs})
    revisions = sorted({run["revision"] for run in runs})
    versions = runs[-1]["versions"]
    known = ", ".join(f"{name} {value}" for name, value in versions.items() if value)
    return [
        f"HEALPix with nside {setting.nside}, bandlimit {setting.bandlimit}, a Gaussian beam of "
        f"{np.degrees(setting.beam):g}°; seeds {seeds[0]} to {seeds[-1]}; {known}; revisions "
        f"{', '.join(revisions)}; {' to '.join(dict.fromkeys([dates[0], dates[-1]]))}.",
        "",
    ]


def tables(setting: Setting, folder: Path = FOLDER) -> str:
    """Return every table of a setting as reStructuredText."""
    results = read_results(setting.name, folder)
    title = f"Results, nside {setting.nside}"
    lines = [title, "-" * len(title), "", *_footer(setting, folder)]
    for survey in SURVEYS:
        lines += _survey_tables(results, survey)
    lines += [*_shear(results), *_ratio_tables(setting, folder), *_linear(results)]
    return "\n".join([*lines, *_times(results)])


def _kept() -> list[str]:
    """Return the settings that have results, the finest first."""
    return [name for name in ("record", "quick") if results_path(name).is_file()]


def all_tables() -> str:
    """Return the tables of every setting that has results."""
    return "\n".join(tables(SETTINGS[name]) for name in _kept())


def main() -> None:
    """Write docs/purity_tables.inc and the pictures from the results that are kept."""
    (DOCS / "purity_tables.inc").write_text(all_tables(), encoding="utf-8")
    # Pictures compare: they show the resolution at which most methods were judged.
    results = max((read_results(name) for name in _kept()), key=len)
    names = save_figures(results, DOCS / "_static")
    print(f"Wrote purity_tables.inc from {', '.join(_kept())} and {len(names)} pictures.")


if __name__ == "__main__":
    main()
