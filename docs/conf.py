"""The site, which `make docs` writes to docs/_build; what is generated is written by _extensions."""

from __future__ import annotations

import os
import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_extensions"), str(HERE.parent)]

# Compiled functions have no docstring that Sphinx could read, plain ones do.
os.environ["NUMBA_DISABLE_JIT"] = "1"

_PROJECT = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]

project = "indexer-diagnosis"
author = "the authors of indexer-diagnosis"
project_copyright = "MIT licence"
version = release = _PROJECT["version"]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "generated_pages",
    "docstrings",
    "llms_txt",
]
exclude_patterns = ["_build", "_extensions"]
root_doc = "index"
language = "en"
# Two classes of one name are told apart by their pages; docstrings name them without a module.
suppress_warnings = ["ref.python"]

myst_enable_extensions = ["colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_preserve_defaults = True
# What scikit-learn adds to every estimator, in words that link to its own site.
autodoc_default_options = {"exclude-members": "set_fit_request, set_score_request"}
add_module_names = False
# Else every class and method stands in the table of contents, which each page carries whole: three times the build.
toc_object_entries = False
python_display_short_literal_types = True
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "furo"
html_title = "indexer-diagnosis"
html_short_title = _PROJECT["description"]
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = True
html_copy_source = True

copybutton_exclude = ".linenos, .gp, .go"
