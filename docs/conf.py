"""Configuration of Sphinx: written pages, and gallery, settings, reference and bibliography from the code."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE)]

project = "dermis"
author = "The dermis authors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "generated_pages", "turning_head"]
exclude_patterns = ["templates", "images"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
suppress_warnings = [
    "myst.xref_missing"
]  # links to source files of the project, which only exist in the repository

html_theme = "furo"
html_title = "dermis"
html_theme_options: dict[str, Any] = {"source_repository": ""}
html_show_sphinx = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {name: name for name in ("ArrayLike", "Floats", "Doubles", "Mapping")}
napoleon_google_docstring = False
napoleon_use_rtype = False
