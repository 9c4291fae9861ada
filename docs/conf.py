"""How Sphinx builds these pages: ``make docs``."""

from __future__ import annotations

from importlib.metadata import version as _version

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

project = "vkbloom"
release = _version("vkbloom")
copyright = "the vkbloom authors, MIT licence"

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
]
exclude_patterns = ["README.md", "measured_table.md"]
default_role = "py:obj"

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3

autosummary_generate = True
autodoc_typehints = "none"
# Members of classes are listed by the template, once.
numpydoc_show_class_members = False
templates_path = ["templates"]


def setup(app: Sphinx) -> None:
    """Flowcharts are for GitHub and editors; here their text is shown."""
    app.add_lexer("mermaid", TextLexer)


html_theme = "furo"
html_title = f"vkbloom {release}"
html_static_path: list[str] = []
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
