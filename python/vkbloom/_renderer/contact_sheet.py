"""What notebooks show of framebuffers: a picture, and a contact sheet as HTML."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._framebuffers import leading
from vkbloom._renderer.framebuffers import Framebuffers
from vkbloom._renderer.plans import sentence_of
from vkbloom._settings.settings import expansion_of_final
from vkbloom._views import markup, pictures
from vkbloom._views.markup import element


def leading_png(frames: Framebuffers) -> bytes:
    """Return the picture of `final`, or else of the last image, or else of the last framebuffer.

    It is that of `pictures.picture`: encoded, if the settings' encoding was applied to it.
    """
    return pictures.png(_picture(frames, leading(frames)))


def contact_sheet_html(frames: Framebuffers) -> str:
    """Return a contact sheet of all framebuffers, with the pass times, as HTML.

    Pictures are made as in `leading_png`, without alpha, and averaged to at most 320 pixels.
    """
    shown = (
        (
            name,
            _picture(frames, name, pictures.thumbnail_size(array))[:, :, :3],
            _facts(frames, name),
        )
        for name, array in frames.items()
    )
    facts = ", ".join(f"{key} {value}" for key, value in frames.info.items())
    sheet = element(
        "div",
        pictures.thumbnails(shown),
        *([_times(frames)] if frames.timings else []),
        element(
            "div",
            facts,
            element("br"),
            element("code", repr(frames.settings), style=pictures.CODE),
            style="margin-top:10px;opacity:.8",
        ),
        style="color:inherit;color-scheme:light dark;font-size:13px;max-width:68em",
    )
    return str(sheet)


def _times(frames: Framebuffers) -> markup.Markup:
    """Return a table of the passes that ran: time, share of the whole, and what each does.

    Times are NaN on a queue without timestamps.
    """
    whole = sum(seconds for seconds in frames.timings.values() if seconds > 0)
    of_scene = not {"scene", "albedo"}.isdisjoint(frames.timings)
    rows = [
        (
            name,
            f"{1e3 * seconds:.3f} ms" if seconds >= 0 else "not measured",
            markup.share_bar(seconds / whole) if seconds > 0 else "",
            sentence_of(frames.settings, name, of_scene=of_scene),
        )
        for name, seconds in frames.timings.items()
    ]
    head = ("pass", f"time on {frames.info.get('adapter', 'the device')}", "share", "what it does")
    total = f", {1e3 * whole:.3f} ms together" if whole else ""
    return markup.table(rows, head, caption=f"{_count(len(rows))}{total}")


def _count(passes: int) -> str:
    return "1 pass" if passes == 1 else f"{passes} passes"


def _picture(
    frames: Framebuffers, name: str, size: tuple[int, int] | None = None
) -> NDArray[np.uint8]:
    """Return a framebuffer as an 8-bit (H, W, C) picture, resized to (width, height)."""
    encoding = frames.settings.encoding if name == "final" else "none"
    is_final = name == "final"
    expand = expansion_of_final(frames.settings, frames.info.get("expand")) if is_final else 1.0
    return pictures.picture(frames[name], name, encoding=encoding, size=size, expand=expand)


def _facts(frames: Framebuffers, name: str) -> str:
    """Return size and dtype of a framebuffer, what its name does not tell, and its range."""
    array = frames[name]
    note = frames.settings.glow_note if name == "glow" else ""
    facts = (f"{array.shape[1]} x {array.shape[0]}", str(array.dtype), note, _range_of(array))
    return ", ".join(filter(None, facts))


def _range_of(array: NDArray[Any]) -> str:
    """Return the range of finite floats without alpha as text; "" for integers."""
    if array.dtype == np.uint8:
        return ""
    values = np.atleast_3d(array)[:, :, :3]
    finite = np.isfinite(values)
    if not finite.any():
        return "nothing finite"
    low = values.min(where=finite, initial=np.inf)
    high = values.max(where=finite, initial=-np.inf)
    return f"{low:.4g} to {high:.4g}" + ("" if finite.all() else ", some not finite")
