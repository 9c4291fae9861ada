"""Settings, scenes and renderers as notebooks show them."""

from __future__ import annotations

import base64
import dataclasses
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.framebuffers import decode
from tests.images import noise_image
from vkbloom import Renderer, Scene, Separable, Settings, presets
from vkbloom._scene.skybox import Cubemap

VOID = {"img", "br"}


class Reader(HTMLParser):
    """Texts of a page, its tags checked for being closed in order."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.texts: list[str] = []
        self.feed(page)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert not any(name.startswith("on") for name, _ in attrs)
        self.tags.add(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def read(shown: Any) -> Reader:
    page: str = shown._repr_html_()
    reader = Reader(page)
    assert not reader.tags & {"script", "style", "link", "iframe"}
    # Text takes the page's colour, in whichever theme.
    assert set(re.findall(r"[\";]color:([^;\"]+)", page)) == {"inherit"}
    return reader


@pytest.mark.parametrize("settings", [Separable(), *presets.values()], ids=["default", *presets])
def test_settings_show_what_is_not_the_default_first(settings: Settings) -> None:
    texts = read(settings).texts
    fold = next(index for index, text in enumerate(texts) if text.endswith("their defaults"))
    fields = dataclasses.fields(settings)
    changed = [field.name for field in fields if getattr(settings, field.name) != field.default]
    assert texts[0] == type(settings).__name__
    assert [name for name in texts[1:fold] if name.isidentifier()] == changed
    assert texts[fold] == f"{len(fields) - len(changed)} fields at their defaults"
    assert len(texts) == fold + 1 + 2 * (len(fields) - len(changed))


def test_settings_show_values_and_defaults() -> None:
    texts = read(Separable(blur_scale=2.5, tonemap="aces")).texts
    assert texts[1:5] == ["tonemap", "'aces' (default 'none')", "blur_scale", "2.5 (default 1.0)"]


def test_texts_are_escaped() -> None:
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Noted(Separable):
        note: str = "</td>"

    page = Noted(note="<script>")._repr_html_()
    assert "<script>" not in page
    assert read(Noted(note="<script>")).texts[2] == "'<script>' (default '</td>')"


@pytest.mark.parametrize("dtype", ["uint8", "float32"])
def test_a_scene_shows_its_sky(scene: Scene, dtype: str, tmp_path: Path) -> None:
    faces = np.zeros((6, 200, 200, 4), dtype)
    for index, face in enumerate(faces):
        face[...] = index * (40 if dtype == "uint8" else 40 / 255)
    shown = dataclasses.replace(scene, skybox=Cubemap((faces,)))
    texts = read(shown).texts
    assert f"200 x 200 {dtype}, levels: 1" in texts
    found = re.findall(r'base64,([^"]+)" alt="sky (..)"', shown._repr_html_())
    assert [name for _, name in found] == ["+x", "-x", "+y", "-y", "+z", "-z"]
    for index, (data, _) in enumerate(found):
        picture = decode(base64.b64decode(data, validate=True), tmp_path)
        assert (picture == index * 40).all()
        # Thinned out to about the size that they are shown at.
        assert picture.shape == (100, 100, 3)
    assert "img" not in read(dataclasses.replace(scene, skybox=None)).tags


def test_a_renderer_shows_its_adapter(new_renderer: Callable[[], Renderer]) -> None:
    renderer = new_renderer()
    texts = read(renderer).texts
    assert texts[0] == "Renderer"
    assert texts[texts.index("adapter") + 1] == renderer.info.name
    assert texts[texts.index("state") + 1] == "open"
    renderer.close()
    assert "closed" in read(renderer).texts


def test_notebooks_get_plain_text_with_padded_cells() -> None:
    """Some notebooks refuse a subclass of str, and have no padding of their own."""
    image = noise_image(16, 16, 3)
    with Renderer() as renderer:
        shown = [
            renderer,
            renderer.apply(image),
            renderer.plan(image, vkbloom.Pyramid(levels=2)),
            vkbloom.Pyramid(levels=2),
            Scene.ufo(),
            presets,
            vkbloom.testing.report(lambda given: given, size=(32, 32), laws=("gain",)),
            vkbloom.fit(
                image, image, vkbloom.Pyramid(), ["intensity"], renderer=renderer, max_calls=3
            ),
        ]
    for one in shown:
        page = one._repr_html_()
        assert type(page) is str, one
        cells = re.findall(r"<t[dh]\b[^>]*>", page)
        assert all("padding" in cell for cell in cells), one
