"""The hosts of the explorer's page: its own server, JupyterLab and marimo."""

from __future__ import annotations

import asyncio
import json
import os
import queue
import re
import secrets
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import vkbloom
from vkbloom._explorer.server import Server
from vkbloom._explorer.viewer import Viewer

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE = 60.0  # seconds: waiting costs nothing where a busy machine answers at last


@contextmanager
def served(new_viewer: Callable[[], Viewer]) -> Iterator[str]:
    """Serve the page from a thread, and yield its address."""
    started: queue.Queue[tuple[str, asyncio.AbstractEventLoop, asyncio.Event]] = queue.Queue()

    async def main() -> None:
        server, stopped = Server(new_viewer), asyncio.Event()
        started.put((server.url, asyncio.get_running_loop(), stopped))
        await stopped.wait()
        await server.stop()

    thread = threading.Thread(target=lambda: asyncio.run(main()))
    thread.start()
    url, loop, stopped = started.get(timeout=PATIENCE)
    try:
        yield url
    finally:
        loop.call_soon_threadsafe(stopped.set)
        thread.join()


@contextmanager
def jupyterlab(folder: Path, cells: Sequence[str], environment: Mapping[str, str]) -> Iterator[str]:
    """Run JupyterLab on a notebook of some cells, and yield where it is open.

    No file of the user is read or written. The theme is that of the system or the browser.
    """
    notebook = {
        "cells": [
            {
                "cell_type": "code",
                "id": f"cell-{index}",
                "metadata": {},
                "execution_count": None,
                "outputs": [],
                "source": source,
            }
            for index, source in enumerate(cells)
        ],
        "metadata": {
            "kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    opened = folder / "notebooks"
    opened.mkdir()
    (opened / "bloom.ipynb").write_text(json.dumps(notebook))
    settings = folder / "settings" / "@jupyterlab" / "apputils-extension"
    settings.mkdir(parents=True)
    (settings / "themes.jupyterlab-settings").write_text('{"adaptive-theme": true}')
    (settings / "notification.jupyterlab-settings").write_text('{"fetchNews": "false"}')
    # jsonschema does without this module, which compiles grammars for five seconds.
    (folder / "rfc3987_syntax.py").write_text("raise ImportError")
    token = secrets.token_hex()
    variables = {
        **os.environ,
        "JUPYTER_CONFIG_DIR": str(folder / "config"),
        "JUPYTER_DATA_DIR": str(folder / "data"),
        "JUPYTER_RUNTIME_DIR": str(folder / "runtime"),
        "JUPYTERLAB_SETTINGS_DIR": str(folder / "settings"),
        "JUPYTERLAB_WORKSPACES_DIR": str(folder / "workspaces"),
        "IPYTHONDIR": str(folder / "ipython"),
        "JUPYTER_TOKEN": token,
        # The kernel runs elsewhere, and has to find the package that runs here.
        "PYTHONPATH": os.pathsep.join((str(Path(vkbloom.__file__).parents[1]), str(folder))),
        **environment,
    }
    options = ["--no-browser", "--allow-root", "--ip=127.0.0.1", "--port=0"]
    log = folder / "log"
    with log.open("w") as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "jupyterlab", *options],
            cwd=opened,
            env=variables,
            stdout=output,
            stderr=output,
        )
    try:
        deadline = time.monotonic() + PATIENCE
        while not (found := re.search(r"http://127\.0\.0\.1:\d+/", log.read_text())):
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < deadline, log.read_text()
            time.sleep(0.1)
        yield f"{found[0]}lab/tree/bloom.ipynb?reset&token={token}"
    finally:
        process.terminate()
        process.wait(PATIENCE)


MARIMO = """
import marimo

app = marimo.App()


@app.cell
def _():
    import marimo as mo
    import vkbloom

    explorer = mo.ui.anywidget(vkbloom.explore(size=(64, 36)))
    explorer
    return explorer, mo, vkbloom


@app.cell
def _(explorer, mo):
    mo.md(f"loops: {explorer.value['settings']['loops']}, {explorer.settings.loops}")


@app.cell
def _(vkbloom):
    vkbloom.default_renderer().plan(vkbloom.Scene.ufo(), vkbloom.Separable(), (64, 36))


if __name__ == "__main__":
    app.run()
"""


@contextmanager
def marimo(folder: Path, theme: str) -> Iterator[str]:
    """Run a notebook of marimo as an app in a theme, and yield where it is."""
    (folder / "bloom.py").write_text(MARIMO)
    (folder / "pyproject.toml").write_text(f'[tool.marimo.display]\ntheme = "{theme}"\n')
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "marimo", "run", "--headless", "--host", "127.0.0.1"]
    package = str(Path(vkbloom.__file__).parents[1])
    environment = {**os.environ, "HOME": str(folder), "PYTHONPATH": package}
    with (folder / "log").open("w") as log:
        process = subprocess.Popen(
            [*command, "--port", str(port), "bloom.py"],
            cwd=folder,
            env=environment,
            stdout=log,
            stderr=log,
        )
    try:
        deadline = time.monotonic() + PATIENCE
        while "URL:" not in (folder / "log").read_text():
            assert process.poll() is None, (folder / "log").read_text()
            assert time.monotonic() < deadline, (folder / "log").read_text()
            time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(PATIENCE)
