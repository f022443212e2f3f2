"""The architecture as a test: who may import whom.

A module imports only from the layers below its own; modules of one layer may import each other
where that makes no circle.
"""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "spinsdw"

LAYERS = (  # bottom to top
    {"compiled"},
    {"errors"},
    {"memory"},
    {"files"},
    {"datasets"},
    {"fourier"},
    {"parallel"},
    {"ring_engine"},
    {"parity_engine"},
    {"harmonics"},
    {"signals", "shrinkage"},
    {"rotation"},
    {"sampling"},
    {"refined_sums"},
    {"grid_sums", "ring_blocks"},
    {"point_sums"},
    {"tiling"},
    {"directionality"},
    {"orientation_sums", "steering"},
    {"wavelets"},
    {"rotated_wavelets", "wavelet_parameters", "wigner_parts"},
    {"wavelet_frame"},
    {"ring_transform", "spin_transform"},
    {"wigner_transform"},
    {"rotation_group"},
    {"coefficients", "scale_sums"},
    {"coefficient_checks"},
    {"wavelet_transform"},
    {"vector_spaces"},
    {"operators"},
    {"energy", "peer_layouts", "statistics"},
    {"healpix"},
    {"masks", "footprints"},
    {"maps_io"},
    {"simulation"},
    {"separation"},
    {"polarisation"},
    {"warmup"},
    {"projections"},
    {"plotting"},
    {"ensemble"},
    {"cli"},
)
LATE = {  # what a method hands over to a layer above when it is called, and only then
    "spinsdw.coefficients": {"spinsdw.healpix.coefficients"},
    "spinsdw.tiling.base": {"spinsdw.plotting"},
}
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}

HOMES = {  # the only parts that may import these packages
    "numba": {"compiled"},
    "llvmlite": {"compiled"},
    "ducc0": {"fourier"},
    "healpy": {"healpix", "masks", "projections"},
    "astropy": {"maps_io"},
    "matplotlib": {"plotting"},
    "dask": {"ensemble"},
    "distributed": {"ensemble"},
    "zarr": {"ensemble", "maps_io"},
    "click": {"cli"},
    "rich": {"cli"},
}


def module_name(path):
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


# The root is left out: it names every public module, and nothing may import it.
PATHS = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}
MODULES = [name for name in PATHS if name != "spinsdw"]


def imports(name):
    """Return every absolute name that module ``name`` imports, wherever in the file it does so."""
    found = set()
    for node in ast.walk(ast.parse(PATHS[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            origin = "." * node.level + (node.module or "")
            members = {f"{origin}.{alias.name}" for alias in node.names}
            found |= {member if member in PATHS else origin for member in members}
    return found - LATE.get(name, set())


def part(name):
    return name.split(".")[1]


@pytest.mark.parametrize("name", MODULES)
def test_module_imports_only_downward(name):
    assert part(name) in RANK, "give the new module its layer in LAYERS"
    inner = {other for other in imports(name) if other.startswith("spinsdw.")}
    upward = {other for other in inner if RANK[part(other)] > RANK[part(name)]}
    assert not upward


@pytest.mark.parametrize("name", MODULES)
def test_module_imports_by_absolute_name_and_never_through_the_root(name):
    assert not {other for other in imports(name) if other == "spinsdw" or other.startswith(".")}


@pytest.mark.parametrize("name", MODULES)
def test_outside_package_is_imported_only_at_its_home(name):
    packages = {other.split(".")[0] for other in imports(name)}
    assert not {p for p in packages & set(HOMES) if part(name) not in HOMES[p]}


def test_imports_make_no_circle():
    graph = {name: imports(name) & set(MODULES) - {name} for name in MODULES}
    assert len(list(TopologicalSorter(graph).static_order())) == len(MODULES)
