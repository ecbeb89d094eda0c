# Sphinx; see scripts/site. Breathe reads what Doxygen makes of the headers.
import os

project = "depthservo"
extensions = ["myst_parser", "breathe"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["site"]
myst_heading_anchors = 4
html_theme = "sphinx_rtd_theme"
html_show_sourcelink = False
html_copy_source = False
highlight_language = "none"
breathe_projects = {"depthservo": os.environ.get("DEPTHSERVO_XML", "")}
breathe_default_project = "depthservo"
html_static_path = ["static"]
html_css_files = ["site.css"]
