"""Render the recipe for all machines by rattler-build's library, which knows its form."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from rattler_build import PlatformConfig, RenderConfig, Stage0Recipe, VariantConfig

RECIPE: Final = Path(__file__).with_name("recipe.yaml")
#: What conda-forge's own configuration says.
COMPILERS: Final = {"c_compiler": ["gcc"], "c_stdlib": ["sysroot"]}


def main() -> None:
    """Render it."""
    recipe = Stage0Recipe.from_file(RECIPE)
    for platform in ("linux-64", "linux-aarch64"):
        config = RenderConfig(PlatformConfig(target_platform=platform))
        (variant,) = recipe.render(VariantConfig(COMPILERS), config)
        made = variant.recipe.to_dict()
        print(f"{RECIPE.name} renders for {platform}: {made['package']}, {made['requirements']}")


if __name__ == "__main__":
    main()
