"""Results on disk: one file for each setting, every result with the run that it came from."""

from __future__ import annotations

import datetime
import json
import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from benchmarks.purity.measures import Result

__all__ = ["FOLDER", "add_result", "describe_run", "read_results", "results_path"]

FOLDER = Path(__file__).with_name("results")
PACKAGES = ("spinsdw", "numpy", "healpy", "pymaster")


def results_path(setting: str, folder: Path = FOLDER) -> Path:
    """Return the file that holds the results of a setting."""
    return folder / f"{setting}.json"


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _revision() -> str:
    command = ["git", "rev-parse", "--short", "HEAD"]
    try:
        return subprocess.run(
            command, cwd=FOLDER.parent, capture_output=True, text=True, check=True
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def describe_run() -> dict[str, Any]:
    """Return when and with which versions a result was found."""
    return {
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "revision": _revision(),
        "python": platform.python_version(),
        "cores": os.cpu_count(),
        "versions": {package: _version(package) for package in PACKAGES},
    }


def _read(path: Path) -> list[dict[str, Any]]:
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []


def read_results(setting: str, folder: Path = FOLDER) -> list[Result]:
    """Return every result kept of a setting."""
    return [Result.from_json(record["result"]) for record in _read(results_path(setting, folder))]


def _key(result: dict[str, Any]) -> tuple:
    return tuple(result[name] for name in ("method", "choices", "survey", "model"))


def add_result(result: Result, folder: Path = FOLDER) -> None:
    """Keep a result: joined with one of other seeds, in place of one that shares seeds."""
    path = results_path(result.setting, folder)
    records = _read(path)
    mine = result.to_json()
    old = [record for record in records if _key(record["result"]) == _key(mine)]
    for record in old:
        kept = Result.from_json(record["result"])
        if not set(kept.seeds) & set(result.seeds):
            mine = (kept + result).to_json()
    records = [record for record in records if record not in old]
    records.append({"run": describe_run(), "result": mine})
    records.sort(key=lambda record: _key(record["result"]))
    lines = ",\n".join(json.dumps(record, separators=(",", ":")) for record in records)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}.part")
    part.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    part.replace(path)
