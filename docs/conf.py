"""Sphinx's configuration of the documentation: offline, from Markdown and docstrings."""

from __future__ import annotations

import sys
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import docstrings  # noqa: E402
import gallery_films  # noqa: E402
import imperfection_tables  # noqa: E402

docstrings.write_room_pages(HERE / "api", "crane_env", "baselines")
imperfection_tables.write(HERE / "api")

project = "OILCrane"
author = "The OILCrane founders"
copyright = author
release = metadata.version("oilcrane")
extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "myst_parser",
    "sphinx_gallery.gen_gallery",
    "docstrings",
]
highlight_language = "none"  # equations in docstrings; code says what it is
smartquotes = False  # theta' is a derivative
exclude_patterns = ["build", "examples"]
suppress_warnings = ["config.cache"]  # the gallery's films are a function, which is not cached

html_theme = "furo"
html_title = "OILCrane"
html_static_path = ["_static"]
html_css_files = ["oilcrane.css"]
html_show_sphinx = False

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
# MathJax would be fetched from afar; MathML is drawn by the browser itself.
html_math_renderer = "mathml"

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints_format = "short"
add_module_names = False
toc_object_entries = False
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "image_scrapers": ("matplotlib", gallery_films.scraper),
    "download_all_examples": False,
    "show_memory": False,
    "write_computation_times": False,
    "show_signature": False,
    "min_reported_time": 3600,
    "abort_on_example_error": True,
}
