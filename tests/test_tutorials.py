"""Every tutorial is a lesson that runs as it stands, on public names only."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers import needs_compiler

TUTORIALS = sorted((Path(__file__).parents[1] / "tutorials").glob("*.py"))
each_tutorial = pytest.mark.parametrize("path", TUTORIALS, ids=[path.stem for path in TUTORIALS])


def parse(path):
    return ast.parse(path.read_text(encoding="utf-8"))


@each_tutorial
def test_tutorial_opens_with_an_underlined_title(path):
    title, underline, *_ = ast.get_docstring(parse(path)).split("\n")
    assert underline == "=" * len(title)


@each_tutorial
def test_tutorial_uses_public_names_only(path):
    nodes = list(ast.walk(parse(path)))
    names = [node.attr for node in nodes if isinstance(node, ast.Attribute)]
    for node in nodes:
        if isinstance(node, ast.alias):
            names += node.name.split(".")
    assert not [name for name in names if name.startswith("_")]


@needs_compiler
@each_tutorial
def test_tutorial_runs_without_a_warning(path, tmp_path):
    command = [sys.executable, "-W", "error", str(path)]
    subprocess.run(command, cwd=tmp_path, check=True, timeout=900)
