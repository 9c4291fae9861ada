"""Plans: the framebuffers and passes of a request, known before it is rendered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vkbloom._public import public
from vkbloom._settings.pass_sentences import pass_sentence
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import Settings
from vkbloom._views import markup

if TYPE_CHECKING:
    from vkbloom import _core

Framebuffer = tuple[tuple[int, ...], np.dtype[Any]]


class Pass(NamedTuple):
    """One pass of a plan.

    Attributes
    ----------
    name : str
        The key of `Frames.timings`. Passes that draw into the same images, and the steps of one
        result, have the same name and one time.
    shader : str
        The SPIR-V module of the shader, such as "blur_frag".
    reads, writes : tuple of str
        Names of images: framebuffers and intermediate images. That of an intermediate image begins
        with a dot if a framebuffer has the same name.
    variant : str
        The variant that this class of devices runs instead of the method's own pass. "fragment":
        the pass itself, drawn by a fragment shader.
    """

    name: str
    shader: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    variant: str


@public("vkbloom")
@dataclass(frozen=True, repr=False)
class Plan:
    """The passes and framebuffers of one request: one source with one settings.

    Made by `Renderer.plan`. Two plans are equal if all attributes except `passes` are equal: these
    depend on the renderer's device.

    Attributes
    ----------
    source : {"image", "forward", "deferred"}
        An image, or a scene with this shading.
    size : (int, int)
        Width and height of the frame in pixels.
    dtype : numpy.dtype or None
        Of an image.
    channels : int or None
        Of an image: 3 or 4.
    mask, emission : bool
        Whether the image has one (`Renderer.upload`).
    settings : Settings
    framebuffers : mapping of str to (tuple of int, numpy.dtype)
        Shape and dtype of each requested framebuffer, in the order of the data flow.
    passes : tuple of Pass
        In the order in which they run on a new renderer. A renderer skips passes whose results are
        up to date.
    """

    source: str
    size: tuple[int, int]
    dtype: np.dtype[Any] | None
    channels: int | None
    mask: bool
    emission: bool
    settings: Settings
    framebuffers: Mapping[str, Framebuffer] = field(hash=False)
    passes: tuple[Pass, ...] = field(compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "framebuffers", MappingProxyType(dict(self.framebuffers)))

    def __reduce__(self) -> tuple[Any, ...]:
        fields = {**vars(self), "framebuffers": dict(self.framebuffers)}
        return type(self), tuple(fields.values())

    @property
    def sentences(self) -> Mapping[str, str]:
        """What each pass does, in one sentence, by the pass's name."""
        of_scene = self.source != "image"
        return {
            one.name: sentence_of(self.settings, one.name, of_scene=of_scene) for one in self.passes
        }

    def __repr__(self) -> str:
        return (
            f"<vkbloom.Plan of {self._title}: {len(self.passes)} passes, "
            f"{len(self.framebuffers)} framebuffers>"
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What is not exact: of a `psf.Varying` the number of kernels and their error."""
        facts = self.settings._facts(self.size)
        if "psf_error" not in facts:
            return ()
        return (
            f"psf: {facts['psf_kernels']:g} kernels, with an error of {facts['psf_error']:.2g}",
        )

    @property
    def _title(self) -> str:
        width, height = self.size
        kind = f"{self.dtype} image" if self.source == "image" else f"{self.source} scene"
        return f"{kind}, {width} x {height}, {self.settings.method}"

    def to_mermaid(self) -> str:
        """Return the passes as a Mermaid flowchart."""
        images = dict.fromkeys(name for step in self.passes for name in (*step.reads, *step.writes))
        lines = ["flowchart LR"]
        for name in images:
            if name in self.framebuffers:
                shape, dtype = self.framebuffers[name]
                lines.append(f'{name}["{name}<br>{shape[1]} x {shape[0]}, {dtype}"]')
            else:
                lines.append(f"{name}({name})")
        for number, step in enumerate(self.passes):
            lines.append(f'pass{number}{{{{"{step.name}<br>{step.shader}"}}}}')
            reads = f"{' & '.join(step.reads)} --> " if step.reads else ""
            lines.append(f"{reads}pass{number} --> {' & '.join(step.writes)}")
        return "\n    ".join(lines)

    def _repr_html_(self) -> str:
        """Return a table of the passes."""
        sentences = self.sentences
        rows = [[*(_text(part) for part in step), sentences[step.name]] for step in self.passes]
        head = (*Pass._fields, "what it does")
        caption = "; ".join((self._title, *self.notes))
        return str(markup.table(rows, head, caption=caption))


def sentence_of(settings: Settings, name: str, *, of_scene: bool) -> str:
    """Return what a pass does, in one sentence, by its name."""
    is_custom = METHODS.is_added(settings.method)
    return pass_sentence(settings, name, of_scene=of_scene, is_custom=is_custom)


def framebuffers_of(plan: _core.Plan) -> dict[str, Framebuffer]:
    """Return shape and dtype of each framebuffer of a plan of the core."""
    return {name: (shape, np.dtype(dtype)) for name, shape, dtype in plan.outputs}


def _text(part: str | tuple[str, ...]) -> str:
    return part if isinstance(part, str) else ", ".join(part)
