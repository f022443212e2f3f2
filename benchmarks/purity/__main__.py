"""Judge methods and keep the results: ``python -m benchmarks.purity --setting quick``."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from benchmarks.purity.catalogue import catalogue
from benchmarks.purity.judge import judge
from benchmarks.purity.measures import Result
from benchmarks.purity.results import FOLDER, add_result
from benchmarks.purity.settings import SETTINGS
from benchmarks.purity.skies import MODELS
from benchmarks.purity.surveys import SURVEYS, survey_mask
from spinsdw.errors import ParameterError
from spinsdw.separation.registry import METHODS

__all__ = ["main"]


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.purity", description=__doc__)
    parser.add_argument("--setting", choices=SETTINGS, default="quick")
    parser.add_argument("--surveys", nargs="+", choices=SURVEYS, default=list(SURVEYS))
    parser.add_argument("--methods", nargs="+", default=list(METHODS), help="names, or namaster")
    parser.add_argument("--model", choices=MODELS, default="cmb")
    parser.add_argument("--seeds", nargs=2, type=int, help="first seed, and the one after the last")
    parser.add_argument("--linearity", action="store_true", help="sep(E + X) - sep(X) as well")
    parser.add_argument("--batch", type=int, default=5, help="maps separated in one call")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where results are kept")
    return parser.parse_args()


def summary(result: Result) -> str:
    """Return the measures of a result as lines of text."""
    degrees = "  ".join(f"l = {2**j:<4d}" for j in result.scales)
    lines = [f"{result.method} ({result.choices}), {result.survey}, {result.model}", f"  {degrees}"]
    rows = {
        "r_leak, d > 1": result.at("r_leak", 1),
        "f_eff, d > 1": result.at("f_eff", 1),
        "eps, d > 1": result.at("eps", 1),
        "nz, d > 1": result.at("nz", 1),
        "f_ret(1e-4)": result.f_ret(1e-4),
        "f_ret(1e-5)": result.f_ret(1e-5),
    }
    if "difference^2" in result.sums:
        rows["r_leak, linear"] = result.at("r_leak_linear", 1)
    for name, values in rows.items():
        lines.append("  " + "  ".join(f"{value:8.2g}" for value in values) + f"  {name}")
    seconds = result.seconds / result.separations
    return "\n".join([*lines, f"  {seconds:.2f} s per map, {len(result.seeds)} seeds"])


def main() -> None:
    """Judge every method asked for on every mask asked for."""
    choices = _arguments()
    setting = SETTINGS[choices.setting]
    seeds = range(*choices.seeds) if choices.seeds else setting.test_seeds
    options = {"model": choices.model, "linearity": choices.linearity, "batch": choices.batch}
    for survey in choices.surveys:
        mask = survey_mask(survey, setting.nside)
        for name in choices.methods:
            variants = catalogue(name, choices.model)
            for label, make in variants:
                start = time.perf_counter()
                try:
                    method = make(mask, setting)
                    result = judge(method, survey, setting, seeds, label=label, **options)
                except ParameterError as error:
                    if len(variants) == 1:
                        raise
                    print(f"{label}, {survey}: one choice left out: {error}\n")
                    continue
                add_result(result, choices.folder)
                took = time.perf_counter() - start
                print(f"{summary(result)}, {took:.0f} s in all\n", flush=True)


if __name__ == "__main__":
    main()
