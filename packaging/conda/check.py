"""Render the recipe by rattler-build's library, and compare what it needs with pyproject.toml."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from typing import Final

from rattler_build import PlatformConfig, RenderConfig, Stage0Recipe, VariantConfig

HERE: Final = Path(__file__).parent
PLATFORMS: Final = ("linux-64", "linux-aarch64")


def floors(requirements: list[str]) -> dict[str, str]:
    """Return the least version of each package, as conda and pip write it: `name >= 1`, `name >=1`."""
    found = (re.match(r"([\w.-]+)\s*(?:>=\s*([\w.]+))?", one) for one in requirements)
    return {one[1]: one[2] or "" for one in found if one}


def main() -> None:
    """Check the recipe."""
    project = tomllib.loads((HERE.parents[1] / "pyproject.toml").read_text())["project"]
    expected = {
        **floors(project["dependencies"]),
        **floors(project["optional-dependencies"]["cli"]),
        "python": project["requires-python"].removeprefix(">=").strip(),
    }
    recipe = Stage0Recipe.from_file(HERE / "recipe.yaml")
    compilers = {"c_compiler": ["gcc"], "c_stdlib": ["sysroot"]}
    for platform in PLATFORMS:
        config = RenderConfig(PlatformConfig(target_platform=platform))
        (variant,) = recipe.render(VariantConfig(compilers), config)
        made = variant.recipe.to_dict()
        run = floors([str(one) for one in made["requirements"]["run"]])
        wrong = {name: run.get(name) for name in expected if run.get(name) != expected[name]}
        if made["package"]["version"] != project["version"] or wrong:
            sys.exit(f"recipe.yaml: {made['package']}, {wrong}; pyproject.toml: {expected}")
        print(f"recipe.yaml renders for {platform}: {made['package']['version']}, needs {run}")


if __name__ == "__main__":
    main()
