"""The documentation site: `make docs`."""

project = "tiago-twin"
copyright = "the authors of tiago-twin, Apache-2.0"
extensions = ["myst_parser"]
html_theme = "furo"
html_title = "tiago-twin"
html_copy_source = False
exclude_patterns = ["_site", "README.md", "requirements.txt"]
myst_heading_anchors = 4
# Links to files of the repository that are no pages of the site, and examples in languages without a highlighter.
suppress_warnings = ["myst.xref_missing", "misc.highlighting_failure"]
