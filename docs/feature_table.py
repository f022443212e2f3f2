"""Write the table of features and the page of their proofs from ``features.toml``."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

DOCS = Path(__file__).parent
PACKAGES = ("ours", "s2let", "s2wav", "s2fft", "ssht", "ducc0", "healpy")


def read_rows():
    """Return the rows of the table, each a mapping."""
    return tomllib.loads((DOCS / "features.toml").read_text(encoding="utf-8"))["row"]


def proofs_of(row):
    """Return (file, name) of each test that proves a row, the file relative to the root."""
    return [tuple(proof.split("::")) for proof in row.get("proof", [])]


def _slug(row):
    return "proof-" + re.sub(r"[^a-z0-9]+", "-", row["feature"].lower()).strip("-")


def _cells(row):
    ours = f":ref:`{row['ours']} <{_slug(row)}>`" if row.get("proof") else row["ours"]
    return [row["feature"], ours, *(row.get(name, "-") for name in PACKAGES[1:])]


def table(rows):
    """Return the table as reST."""
    head = [
        "feature",
        "spinsdw",
        "S2LET, pys2let",
        "s2wav",
        "s2fft",
        "SSHT, so3",
        "ducc0",
        "healpy",
    ]
    lines = [".. list-table::", "   :header-rows: 1", "   :widths: 22 14 12 12 12 12 12 12", ""]
    for cells in (head, *map(_cells, rows)):
        lines += [f"   {'*' if i == 0 else ' '} - {cell}" for i, cell in enumerate(cells)]
    return "\n".join(lines) + "\n"


def proofs(rows):
    """Return the page that shows the tests, as reST."""
    lines = [":orphan:", "", "Proofs of the features", "======================", ""]
    lines += ["Each row of :doc:`/features` that says yes, with the tests that hold it.", ""]
    for row in rows:
        if not row.get("proof"):
            continue
        title = row["feature"]
        lines += [f".. _{_slug(row)}:", "", title, "-" * len(title), ""]
        for file, name in proofs_of(row):
            lines += [f"``{file}``", "", f".. literalinclude:: ../../{file}"]
            lines += ["   :language: python", f"   :pyobject: {name}", ""]
    return "\n".join(lines)


def write(directory=DOCS / "generated"):
    """Write both files, where they have changed."""
    directory.mkdir(exist_ok=True)
    rows = read_rows()
    for name, text in (("features.inc", table(rows)), ("proofs.rst", proofs(rows))):
        path = directory / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
