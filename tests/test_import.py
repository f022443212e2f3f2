"""Importing costs nothing, and every public name is where the table says."""

from __future__ import annotations

import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

import spinsdw

HEAVY = ("numba", "healpy", "astropy", "matplotlib", "scipy", "ducc0", "dask")


def run_python(*arguments):
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, check=True, timeout=120
    )


def imported_packages(*arguments):
    """Return the top-level packages that ``python *arguments`` imports, told by -X importtime."""
    report = run_python("-X", "importtime", *arguments).stderr
    modules = [line.rsplit("|", 1)[1].strip() for line in report.splitlines() if "|" in line]
    return {module.split(".")[0] for module in modules}


def test_importing_the_package_loads_no_heavy_package():
    assert not imported_packages("-c", "import spinsdw; dir(spinsdw)").intersection(HEAVY)


def test_help_of_the_command_line_loads_no_heavy_package():
    assert not imported_packages("-m", "spinsdw.cli", "--help").intersection(HEAVY)


@pytest.mark.parametrize("name", sorted(set(spinsdw.__all__) - {"__version__"}))
def test_public_name_is_the_object_its_home_defines(name):
    assert getattr(spinsdw, name).__module__.startswith(spinsdw._HOMES[name])


def test_all_is_the_table_of_homes_and_the_version():
    assert spinsdw.__all__ == sorted({*spinsdw._HOMES, "__version__"})
    assert set(spinsdw.__all__) <= set(dir(spinsdw))


def test_version_is_the_one_installed():
    assert spinsdw.__version__ == metadata.version("spinsdw")


def test_unknown_name_is_refused_by_name():
    with pytest.raises(AttributeError, match="has no attribute 'Wavelet'; dir"):
        _ = spinsdw.Wavelet


def test_every_folder_of_modules_is_a_package():
    """Folders without __init__.py would be left out of what is installed."""
    folders = {path.parent for path in Path(spinsdw.__file__).parent.rglob("*.py")}
    assert all((folder / "__init__.py").is_file() for folder in folders)
