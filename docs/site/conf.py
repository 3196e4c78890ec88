# SPDX-License-Identifier: Apache-2.0
"""The documentation as a website (scripts/docs), from the repository's Markdown in place."""
from pathlib import Path

ROOT = Path(__file__).parents[2]

project = "covary"
author = copyright = "The covary contributors"  # noqa: A001
root_doc = "docs/index"
extensions = ["myst_parser", "sphinx_copybutton"]
include_patterns = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "docs/**.md", "benchmarks/**.md"]
exclude_patterns = ["build/**", "dist/**", "out/**"]
myst_enable_extensions = ["html_image"]
myst_heading_anchors = 4
suppress_warnings = ["myst.header", "misc.highlighting_failure"]

html_theme = "furo"
html_title = "covary"
html_static_path = [str(ROOT / "docs/site/static")]
html_css_files = ["wipe.css"]
html_js_files = ["wipe.js"]
html_copy_source = False
html_show_sphinx = False
