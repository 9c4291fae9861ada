"""A contract of import-linter (``[tool.importlinter]`` in ``pyproject.toml``)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class NoImportsOfTheRoot(Contract):
    """Modules import each other, not the package that has all: ``import vkbloom; vkbloom.X``.

    - `package`: The package.
    - `extension`: Its module that is no Python, and not in the graph: it counts as an import
      of the package.
    """

    package = fields.StringField()
    extension = fields.StringField()

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Find the statements that import the package, or what is no module of it."""
        found = [
            f"{detail['importer']}, line {detail['line_number']}: {detail['line_contents']}"
            for detail in _details(graph)
            if not self._is_of_modules(graph, detail)
        ]
        return ContractCheck(kept=not found, metadata={"found": sorted(set(found))})

    def _is_of_modules(self, graph: ImportGraph, detail: Any) -> bool:
        line = detail["line_contents"].partition("#")[0].strip()
        if detail["imported"] != self.package:
            # `import vkbloom.psf` makes `vkbloom` a name, too.
            return not line.startswith("import ")
        names = re.fullmatch(rf"from {self.package} import ([\w, ]+)", line)
        return names is not None and all(
            name == self.extension or f"{self.package}.{name}" in graph.modules
            for name in names[1].replace(" ", "").split(",")
        )

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print the statements."""
        for statement in check.metadata["found"]:
            output.print_error(statement)


def _details(graph: ImportGraph) -> Iterator[Any]:
    for importer in graph.modules:
        for imported in graph.find_modules_directly_imported_by(importer):
            yield from graph.get_import_details(importer=importer, imported=imported)
