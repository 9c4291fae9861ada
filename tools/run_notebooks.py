"""Run the example notebooks and store them with their outputs, which the documentation shows.

python tools/run_notebooks.py examples/*.ipynb

Views of widgets are left out: without a running kernel they show nothing.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbclient
import nbformat

import vkbloom

WIDGET = "application/vnd.jupyter.widget-view+json"


def without_widgets(outputs: list[Any]) -> list[Any]:
    """Return outputs without views of widgets."""
    return [output for output in outputs if WIDGET not in output.get("data", {})]


def run(path: Path) -> None:
    """Run one notebook in an empty folder and store it."""
    notebook = nbformat.read(path, 4)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        client = nbclient.NotebookClient(
            notebook, timeout=120, kernel_name="python3", resources=resources, record_timing=False
        )
        client.execute()
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs = without_widgets(cell.outputs)
    # What differs between machines and says nothing: the kernel's version, the widgets' state.
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    nbformat.write(notebook, path)
    print(f"{path}: {path.stat().st_size / 1024:.0f} kB")


def main() -> None:
    """Run the notebooks that are named."""
    # The kernel runs in another process and has to find this package.
    os.environ["PYTHONPATH"] = str(Path(vkbloom.__file__).parents[1])
    os.environ.setdefault("VKBLOOM_ADAPTER", "software")
    for name in sys.argv[1:]:
        run(Path(name))


if __name__ == "__main__":
    main()
