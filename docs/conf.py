"""How Sphinx builds these pages: ``make docs``."""

from __future__ import annotations

import os
import runpy
import shutil
from importlib.metadata import version as _version
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

project = "vkbloom"
release = _version("vkbloom")
copyright = "the vkbloom authors, MIT licence"

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_copybutton",
    "sphinxcontrib.mermaid",
]
exclude_patterns = ["README.md", "evidence/*_table.md", "examples/*.md"]

# Sphinx reads what is in this folder alone. The notebooks are shown with the outputs that they are
# stored with (tools/run_notebooks.py).
_here = Path(__file__).parent
(_here / "examples").mkdir(exist_ok=True)
for _notebook in (_here.parent / "examples").glob("*.ipynb"):
    shutil.copy(_notebook, _here / "examples")
runpy.run_path(str(_here / "class_pictures.py"))["write"](_here / "examples" / "class")
runpy.run_path(str(_here / "exposure_pictures.py"))["write"](_here / "examples" / "exposure")
runpy.run_path(str(_here / "fault_pictures.py"))["write"](_here / "examples" / "faults")
runpy.run_path(str(_here / "field_pictures.py"))["write"](_here / "examples" / "field")
runpy.run_path(str(_here / "flare_pictures.py"))["write"](_here / "examples" / "flare")
runpy.run_path(str(_here / "look_pictures.py"))["write"](_here / "examples" / "looks")
_write_laws = runpy.run_path(str(_here / "law_table.py"))["write"]
_write_laws(_here / "examples" / "laws.md")
_write_laws(_here / "examples" / "exposure_laws.md", "exposure")
nb_execution_mode = "off"
nb_merge_streams = True
default_role = "py:obj"

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
# The browser draws flowcharts. MERMAID: a file of mermaid, for pages without a network.
myst_fence_as_directive = ["mermaid"]
if _mermaid := os.environ.get("MERMAID"):
    mermaid_use_local = _mermaid

autosummary_generate = True
autodoc_typehints = "none"
# Members of classes are listed by the template, once.
numpydoc_show_class_members = False
templates_path = ["templates"]


def _make_accessible(*arguments: Any) -> None:
    """Give headings of the navigation a level, and let keys scroll code that is wider than a page.

    Sphinx writes neither; axe-core finds both (tests/docs/test_first_page.py). Paths in the
    table of presets may break, so that it is no wider than the page.
    """
    page, context = arguments[1], arguments[3]
    if page == "presets":
        cells = "td:nth-child(2):nth-last-child(2), td:nth-child(3):last-child"
        style = f"<style>{cells} {{ overflow-wrap: anywhere; min-width: 15em }}</style>"
        context["metatags"] = context.get("metatags", "") + style
    for name in ("furo_navigation_tree", "body"):
        text = context.get(name, "")
        text = text.replace('role="heading">', 'role="heading" aria-level="2">')
        context[name] = text.replace("<pre>", '<pre tabindex="0">')


def setup(app: Sphinx) -> None:
    """Change pages when they are written."""
    # After the theme's own handler, which makes the navigation.
    app.connect("html-page-context", _make_accessible, priority=900)


html_theme = "furo"
html_title = f"vkbloom {release}"
html_static_path: list[str] = []
# The schemas of `vkbloom check --json` and `vkbloom flare --json`, beside the pages.
html_extra_path = [f"../python/vkbloom/testing/{name}.schema.json" for name in ("check", "flare")]
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
