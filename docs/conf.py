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
    "sphinx.ext.intersphinx",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.mermaid",
]
exclude_patterns = [
    "README.md",
    "evidence/*_table.md",
    "examples/*.md",
    "examples/gallery_source",
    # Downloads of the gallery.
    "examples/gallery/**.ipynb",
]

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
_write_looks = runpy.run_path(str(_here / "look_pictures.py"))["write"]
_write_looks(_here / "examples" / "looks", small="VKBLOOM_DOCS_SMALL" in os.environ)
runpy.run_path(str(_here / "photo_pictures.py"))["write"](_here / "examples" / "photos")
_write_laws = runpy.run_path(str(_here / "law_table.py"))["write"]
_write_laws(_here / "examples" / "laws.md")
_write_laws(_here / "examples" / "exposure_laws.md", "exposure")
# Links to other projects, and to the source: in the repository if pyproject.toml names one, else on
# pages of their own.
_links = runpy.run_path(str(_here / "links.py"))
intersphinx_mapping = _links["write_inventories"](_here / "examples" / "inventories")
_repository = _links["repository"]()
extensions.append("sphinx.ext.linkcode" if _repository else "sphinx.ext.viewcode")
numpydoc_xref_param_type = True
numpydoc_xref_ignore = "all"
numpydoc_xref_aliases = _links["aliases"]()


def linkcode_resolve(domain: str, info: dict[str, str]) -> str | None:
    """Return the address of the lines that define an entry of the API."""
    page: str | None = _links["source_page"](_repository, info["module"], info["fullname"])
    return page


# The gallery runs in copies, beside which its examples write their files. Cores draw it.
os.environ["VKBLOOM_ADAPTER"] = "software"
_examples = _here / "examples" / "gallery_source"
shutil.copytree(_here.parent / "examples" / "gallery", _examples, dirs_exist_ok=True)
sphinx_gallery_conf = {
    "examples_dirs": "examples/gallery_source",
    "gallery_dirs": "examples/gallery",
    "backreferences_dir": "examples/backreferences",
    "doc_module": ("vkbloom",),
    "reference_url": {"vkbloom": None},
    "filename_pattern": r"\.py",
    "within_subsection_order": "FileNameSortKey",
    "subsection_order": [
        f"examples/gallery_source/{name}"
        for name in ("photography", "games", "research", "teaching")
    ],
    "abort_on_example_error": False,
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
}

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
# The build needs no PyTorch for the page of its operators.
autodoc_mock_imports = ["torch"]
autodoc_typehints = "none"
# Members of classes are listed by the template, once.
numpydoc_show_class_members = False
templates_path = ["templates"]

_navigation = runpy.run_path(str(_here / "navigation.py"))

# Thumbnails are larger than sphinx-gallery's, and their links have a text for screen readers.
_THUMBNAILS = """
body .sphx-glr-thumbnails { grid-template-columns: repeat(auto-fill, minmax(13em, 1fr)) }
body .sphx-glr-thumbcontainer img { max-height: none; max-width: none; width: 100%; height: auto }
body .sphx-glr-thumbcontainer p a span { display: block; width: 1px; height: 1px; overflow: hidden;
  clip-path: inset(50%) }
"""
_STYLES = {
    "api/": _THUMBNAILS,
    "examples/gallery/": _THUMBNAILS,
    # Paths in the table may break, so that it is no wider than the page.
    "presets": """td:nth-child(2):nth-last-child(2), td:nth-child(3):last-child
{ overflow-wrap: anywhere; min-width: 15em }""",
}


def _make_accessible(*arguments: Any) -> None:
    """Give headings of the navigation a level, and let keys scroll code that is wider than a page.

    Sphinx writes neither; axe-core finds both (tests/docs/test_first_page.py).
    """
    page, context = arguments[1], arguments[3]
    context["furo_navigation_tree"] = _navigation["mark"](context["furo_navigation_tree"], page)
    for start, style in _STYLES.items():
        if page.startswith(start):
            context["metatags"] = context.get("metatags", "") + f"<style>{style}</style>"
    for name in ("furo_navigation_tree", "body"):
        text = context.get(name, "")
        text = text.replace('role="heading">', 'role="heading" aria-level="2">')
        context[name] = text.replace("<pre>", '<pre tabindex="0">')


def setup(app: Sphinx) -> None:
    """Change pages when they are written."""
    # Before the theme's own handler, which asks for the tree.
    app.connect("html-page-context", _navigation["share"], priority=400)
    # After the theme's own handler, which makes the navigation.
    app.connect("html-page-context", _make_accessible, priority=900)
    if not _repository:
        app.connect("viewcode-follow-imported", lambda _, *name: _links["module_of"](*name))


html_theme = "furo"
html_title = f"vkbloom {release}"
html_static_path: list[str] = []
# The schemas of `vkbloom check --json` and `vkbloom flare --json`, beside the pages.
html_extra_path = [f"../python/vkbloom/testing/{name}.schema.json" for name in ("check", "flare")]
html_copy_source = False
# A choice of versions, for pages that tools/docs_versions.py puts beside those of other versions.
# (Read the Docs has its own.)
if os.environ.get("VKBLOOM_DOCS_VERSIONS"):
    _sidebars = ("brand", "search", "scroll-start", "navigation", "scroll-end", "variant-selector")
    html_sidebars = {"**": [f"sidebar/{one}.html" for one in _sidebars]}
    html_sidebars["**"].insert(1, "versions.html")
html_theme_options = {"navigation_with_keys": True}
