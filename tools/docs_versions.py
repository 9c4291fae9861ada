"""Put built pages beside those of other versions: tools/docs_versions.py BUILT FOLDER.

FOLDER/VERSION has the pages of a version, FOLDER/versions.js the choice that each page shows, and
FOLDER/index.html leads to the newest release. `make docs-version` builds pages that show the
choice. They can be read from a server or from the disk.
"""

from __future__ import annotations

import argparse
import json
import shutil
from importlib import metadata
from pathlib import Path
from typing import Final

from packaging.version import Version

#: The page in the other version, or its first page where that has none of this name.
SCRIPT: Final = """\
const versions = %s;
const place = document.getElementById("versions");
const label = document.createElement("label");
const choice = document.createElement("select");
for (const version of Object.keys(versions)) {
  choice.add(new Option(version, version, false, version === place.dataset.version));
}
choice.addEventListener("change", () => {
  const page = versions[choice.value].includes(place.dataset.page) ? place.dataset.page : "index";
  location.href = `${place.dataset.root}/../${choice.value}/${page}.html`;
});
label.append("Version ", choice);
place.append(label);
"""
FIRST: Final = """\
<!doctype html>
<html lang="en"><meta charset="utf-8"><title>vkbloom</title>
<meta http-equiv="refresh" content="0; url={version}/index.html">
<p><a href="{version}/index.html">vkbloom {version}</a></p></html>
"""


def write_choice(folder: Path) -> None:
    """Write what leads from one version to another, the newest first."""
    found = {Version(page.parent.name): page.parent for page in folder.glob("*/index.html")}
    pages = {
        str(version): sorted(
            str(page.relative_to(found[version]).with_suffix(""))
            for page in found[version].rglob("*.html")
        )
        for version in sorted(found, reverse=True)
    }
    (folder / "versions.js").write_text(SCRIPT % json.dumps(pages, indent=1))
    first = next((name for name in pages if not Version(name).is_prerelease), next(iter(pages)))
    (folder / "index.html").write_text(FIRST.format(version=first))


def main() -> None:
    """Add a version."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("built", type=Path, help="the pages, as Sphinx wrote them")
    parser.add_argument("folder", type=Path, help="the folder of all versions")
    parser.add_argument("--version", default=metadata.version("vkbloom"))
    options = parser.parse_args()
    target = options.folder / str(Version(options.version))
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(options.built, target, ignore=shutil.ignore_patterns(".doctrees", ".buildinfo"))
    write_choice(options.folder)
    print(f"{target}: added to {options.folder / 'index.html'}")


if __name__ == "__main__":
    main()
