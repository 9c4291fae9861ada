"""What notebooks show: plain text with padded cells."""

from __future__ import annotations

import re
from typing import Any

import vkbloom
from tests.images import noise_image


def test_notebooks_get_plain_text_with_padded_cells(renderer: vkbloom.Renderer) -> None:
    """Some notebooks refuse a subclass of str, and have no padding of their own."""
    image = noise_image(16, 16, 3)
    shown: list[Any] = [
        renderer.apply(image),
        renderer.plan(image, vkbloom.Pyramid(levels=2)),
        vkbloom.presets,
        vkbloom.testing.report(lambda given: given, size=(32, 32), laws=("gain",)),
        vkbloom.fit(image, image, vkbloom.Pyramid(), ["intensity"], renderer=renderer, max_calls=3),
    ]
    for one in shown:
        page = one._repr_html_()
        assert type(page) is str, one
        cells = re.findall(r"<t[dh]\b[^>]*>", page)
        assert all("padding" in cell for cell in cells), one
