"""Run every benchmark and the report once at tiny size: they still run, and nothing about speed."""

from __future__ import annotations

import tempfile
from pathlib import Path

from plans import PLANS
from report import write_report
from run import JOBS, describe_machine, measure

__all__ = ["main"]


def main() -> None:
    plan = PLANS["smoke"]
    jobs = {}
    for name in JOBS:
        jobs[name] = {"plan": "smoke", **measure(name, plan, lambda *_: None)}
        print(
            f"{name}: {len(jobs[name]['rows'])} rows in {jobs[name]['seconds']:.1f} s", flush=True
        )
    with tempfile.TemporaryDirectory() as folder:
        write_report({"machine": describe_machine(), "jobs": jobs}, Path(folder))
    print("Every benchmark runs.")


if __name__ == "__main__":
    main()
