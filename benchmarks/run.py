"""Measure spinsdw against its peers: ``python benchmarks/run.py --standard``.

Every job's rows are printed as they come and written to a JSON file after each job, with the
machine, the versions and the date; ``python benchmarks/report.py`` makes the documentation's tables
and figures from that of a standard or full run. ``--full`` takes about an hour on two cores and
8 GB of memory, ``--standard`` some twenty minutes, ``--quick`` a minute or two. Nothing else should
run meanwhile. Jobs that are named are measured alone and join the others in the file.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import subprocess
import time
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

# Numpy asks for huge pages. Fresh ones cost a virtual machine whose host takes back what is free
# up to twice the time of the transform that fills them, or nothing, by chance: small ones cost
# ours and the peers' arrays the same every time. Numpy reads this when it is imported.
os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")

import geometry
import resources
import speed
from plans import PLANS, Plan

from spinsdw.parallel import resolve_threads

__all__ = ["JOBS", "describe_machine", "main", "measure", "show"]

Row = dict[str, Any]
Job = Callable[[Plan], Iterator[Row]]

RESULTS = Path(__file__).with_name("results.json")
OTHER_RESULTS = RESULTS.parents[1] / "build" / "benchmarks.json"
PACKAGES = ("spinsdw", "numba", "llvmlite", "numpy", "ducc0", "pys2let")

JOBS: dict[str, Job] = {
    "startup": resources.startup,
    "accuracy": resources.accuracy,
    "memory": resources.memory,
    "healpix": speed.healpix,
    "harmonic": speed.harmonic,
    "geometry": geometry.geometry,
    "wavelets": speed.wavelets,
    "batch": speed.batch,
    "healpix batch": speed.healpix_batch,
    "threads": speed.threads,
    "growth": speed.growth,
    "pys2let": speed.pys2let,
}


def _cpu_model() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in text.splitlines() if "model name" in line]
    return names[0] if names else platform.machine()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def describe_machine() -> Row:
    """Return what the times depend on: the processor and the versions."""
    from spinsdw.compiled.vectors import WIDTH

    return {
        "cpu": _cpu_model(),
        "cores": resolve_threads(None),
        "vector_width": WIDTH,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "versions": {package: _version(package) for package in PACKAGES},
    }


def _revision() -> str | None:
    """Return the commit that is measured, with a mark where the package was changed since."""

    def git(*command: str) -> str:
        command = ("git", "-C", str(RESULTS.parents[1]), *command)
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    try:
        commit = git("rev-parse", "--short", "HEAD")
        changed = git("status", "--porcelain", "--", "spinsdw")
    except (OSError, subprocess.CalledProcessError):
        return None
    return f"{commit} with changes" if changed else commit


def show(job: str, row: Row) -> None:
    """Print one row on one line."""
    seconds = row.get("seconds", {})
    what = " ".join(f"{key}={value}" for key, value in row.items() if not isinstance(value, dict))
    times = ", ".join(f"{name} {value:.3g} s" for name, value in seconds.items())
    print(f"{job:9s} {what} {times}".rstrip(), flush=True)


def measure(name: str, plan: Plan, report: Callable[[str, Row], None] = show) -> Row:
    """Run one job and return its rows, with the date, the revision and the load at its start."""
    start, date = time.perf_counter(), datetime.datetime.now(datetime.UTC)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    rows = []
    for row in JOBS[name](plan):
        report(name, row)
        rows.append(row)
    return {
        "date": date.isoformat(timespec="seconds"),
        "revision": _revision(),
        "load": load,
        "seconds": time.perf_counter() - start,
        "rows": rows,
    }


def _earlier_jobs(path: Path, machine: Row) -> dict[str, Row]:
    """Return the jobs of a file that the new ones join; they must be of the same machine."""
    if not path.exists():
        return {}
    found = json.loads(path.read_text(encoding="utf-8"))
    if found["machine"] != machine:
        msg = f"{path} holds results of another machine or version; give another --output."
        raise SystemExit(msg)
    jobs: dict[str, Row] = found["jobs"]
    return jobs


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("jobs", nargs="*", help=f"all when none is named: {', '.join(JOBS)}")
    size = parser.add_mutually_exclusive_group()
    for name in PLANS:
        size.add_argument(f"--{name}", dest="plan", action="store_const", const=name)
    parser.set_defaults(plan="quick")
    parser.add_argument("--threads", type=int, nargs="+", help="numbers of threads, such as 1 2")
    parser.add_argument(
        "--output", type=Path, help=f"{RESULTS.name} for --standard and --full, or in build/"
    )
    choices = parser.parse_args()
    if choices.output is None:
        # The results that are kept are never those of a quick run.
        kept = choices.plan in {"standard", "full"}
        choices.output = RESULTS if kept else OTHER_RESULTS
    unknown = set(choices.jobs) - set(JOBS)
    if unknown:
        parser.error(f"jobs {sorted(unknown)} are not among {', '.join(JOBS)}")
    return choices


def main() -> None:
    choices = _arguments()
    plan, machine = PLANS[choices.plan], describe_machine()
    if choices.threads:
        plan = plan.with_threads(tuple(choices.threads))
    jobs = _earlier_jobs(choices.output, machine) if choices.jobs else {}
    choices.output.parent.mkdir(parents=True, exist_ok=True)
    for name in choices.jobs or JOBS:
        jobs[name] = {"plan": choices.plan, **measure(name, plan)}
        text = json.dumps({"machine": machine, "jobs": jobs}, indent=1)
        choices.output.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
