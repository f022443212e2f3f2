import re
import sys
from importlib.metadata import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import feature_table

_facts = metadata("spinsdw")
project = _facts["Name"]
author = _facts["Author"]
release = version = _facts["Version"]
project_copyright = f"2026, {author}"

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
    "myst_parser",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "gallery/*.ipynb", "gallery/*.py", "gallery/*.md5"]
templates_path = ["_templates"]
default_role = "py:obj"
# Docstrings write absolute values as they are: |s| < L.
rst_prolog = "\n".join(rf".. |{name}| replace:: \|{name}\|" for name in "lmnqs")

# Equations are numbered by page: (1.3) is the third of the first numbered page.
numfig = True
numfig_secnum_depth = 1

autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings say types, shapes and units
numpydoc_show_class_members = False

html_theme = "pydata_sphinx_theme"
html_title = project
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": False, "secondary_sidebar_items": ["page-toc"]}

sphinx_gallery_conf = {
    "examples_dirs": "../tutorials",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",  # every tutorial runs
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "remove_config_comments": True,
}


def _link_equations(*event):
    """Turn the labels that docstrings cite, such as eq-wavelet, into numbered links."""
    lines = event[-1]
    pattern = r"\((eq(?:-[a-z]+)+)\)|\b(eq(?:-[a-z]+)+)\b"
    lines[:] = [re.sub(pattern, r":eq:`\1\2`", line) for line in lines]


def setup(app):
    """Tell Sphinx what is done to docstrings, and write the table of features."""
    app.connect("builder-inited", lambda _: feature_table.write())
    app.connect("autodoc-process-docstring", _link_equations)
