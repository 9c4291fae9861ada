"""How Sphinx builds these pages: ``make docs``."""

from __future__ import annotations

import runpy
import shutil
from importlib.metadata import version as _version
from pathlib import Path
from typing import Any

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

project = "vkbloom"
release = _version("vkbloom")
copyright = "the vkbloom authors, MIT licence"

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
]
exclude_patterns = ["README.md", "evidence/*_table.md"]

# Sphinx reads what is in this folder alone. The notebooks are shown with the outputs that they are
# stored with (tools/run_notebooks.py).
_here = Path(__file__).parent
(_here / "examples").mkdir(exist_ok=True)
for _notebook in (_here.parent / "examples").glob("*.ipynb"):
    shutil.copy(_notebook, _here / "examples")
runpy.run_path(str(_here / "fault_pictures.py"))["write"](_here / "examples" / "faults")
nb_execution_mode = "off"
nb_merge_streams = True
default_role = "py:obj"

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3

autosummary_generate = True
autodoc_typehints = "none"
# Members of classes are listed by the template, once.
numpydoc_show_class_members = False
templates_path = ["templates"]


def _make_accessible(*arguments: Any) -> None:
    """Give headings of the navigation a level, and let keys scroll code that is wider than a page.

    Sphinx writes neither; axe-core finds both (tests/docs/test_first_page.py).
    """
    context = arguments[3]
    for name in ("furo_navigation_tree", "body"):
        text = context.get(name, "")
        text = text.replace('role="heading">', 'role="heading" aria-level="2">')
        context[name] = text.replace("<pre>", '<pre tabindex="0">')


def setup(app: Sphinx) -> None:
    """Flowcharts are for GitHub and editors; here their text is shown."""
    app.add_lexer("mermaid", TextLexer)
    # After the theme's own handler, which makes the navigation.
    app.connect("html-page-context", _make_accessible, priority=900)


html_theme = "furo"
html_title = f"vkbloom {release}"
html_static_path: list[str] = []
# The schema of `vkbloom check --json`, beside the pages.
html_extra_path = ["../python/vkbloom/testing/check.schema.json"]
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
