"""The table of features in the documentation says nothing that no test proves."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def load_generator():
    path = ROOT / "docs" / "feature_table.py"
    spec = importlib.util.spec_from_file_location("feature_table", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


TABLE = load_generator()
ROWS = TABLE.read_rows()
each_row = pytest.mark.parametrize("row", ROWS, ids=[row["feature"] for row in ROWS])

# Facts that no test could prove: the metadata of the package says them.
UNTESTED = {"Installation", "Licence"}


@each_row
def test_every_test_that_is_named_exists(row):
    for file, name in TABLE.proofs_of(row):
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert name.startswith("test_")
        assert name in functions, f"{file} has no {name}"


@each_row
def test_every_yes_has_a_test_and_every_no_has_none(row):
    has_proof = bool(row.get("proof"))
    assert has_proof == (row["ours"] != "-" and row["feature"] not in UNTESTED)


@each_row
def test_rows_have_known_columns_alone(row):
    assert set(row) <= {"feature", "proof", *TABLE.PACKAGES}
    assert all(row[name] for name in row)


def test_features_differ():
    names = [row["feature"] for row in ROWS]
    assert len(set(names)) == len(names)


def test_table_has_a_cell_for_every_package():
    lines = TABLE.table(ROWS).splitlines()
    starts = [i for i, line in enumerate(lines) if line.startswith("   * -")]
    assert len(starts) == len(ROWS) + 1
    for start, stop in zip(starts, [*starts[1:], len(lines)], strict=True):
        assert sum(line.strip().lstrip("* ").startswith("- ") for line in lines[start:stop]) == 8


def test_every_link_of_the_table_has_its_section(tmp_path):
    TABLE.write(tmp_path)
    table = (tmp_path / "features.inc").read_text(encoding="utf-8")
    proofs = (tmp_path / "proofs.rst").read_text(encoding="utf-8")
    targets = [line.split("<")[1].split(">")[0] for line in table.splitlines() if ":ref:" in line]
    assert len(targets) == sum(bool(row.get("proof")) for row in ROWS)
    assert all(f".. _{target}:" in proofs for target in targets)
