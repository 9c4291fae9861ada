"""The passes of a custom method for one frame, as rows for the core."""

from __future__ import annotations

import dataclasses
import itertools
from collections import Counter
from collections.abc import Mapping
from typing import Final

from vkbloom._custom.blocks import Directive
from vkbloom._custom.buffers import Buffer
from vkbloom._custom.expressions import ExpressionError, Values, evaluate, round_half_away
from vkbloom._custom.file import CustomFile
from vkbloom._custom.names import BLOOM, GLOW, HOOKED, MAX_NAME_LENGTH, RESIZING, STAGES
from vkbloom._custom.passes import CustomPass
from vkbloom._custom.rows import Resources, Row
from vkbloom._custom.shaders import BLACK, COPY, DIFFERENCE, Shaders, package_shader
from vkbloom._custom.textures import FileTexture

Size = tuple[int, int]
#: A pass that changes a resource has another turn in each request.
TURNS: Final = itertools.count(1)
#: What the core calls the finished picture and the bloom.
PICTURE: Final = "main"
BLOOM_IMAGE: Final = "bloom"
MAX_SIDE: Final = 16384
#: Names that no saved texture has: of images of the package, whether the frame has them or not. The
#: core renames those of its other images, in the same way.
TAKEN: Final = {
    *("image", "emission", "mask", "glow", "final", "scene", "hdr", "depth"),
    *(PICTURE, BLOOM_IMAGE),
}


@dataclasses.dataclass(frozen=True)
class PassImage:
    """An image that passes read: its name, and its size."""

    name: str
    size: Size


@dataclasses.dataclass(frozen=True)
class FrameValues:
    """What a frame has: sizes, the parameters' numbers, and the number of frames before it."""

    frame: Size
    buffers: Size
    values: Mapping[str, float]
    seed: int
    index: int
    resources: Resources


@dataclasses.dataclass(frozen=True)
class Step:
    """A pass that runs, with the images that it reads and writes."""

    item: CustomPass
    stage: str
    saved: str | None
    image: PassImage
    sizes: Mapping[str, PassImage]


class Planner:
    """Goes through the passes of a file in the order in which they run."""

    def __init__(self, file: CustomFile, request: FrameValues) -> None:
        self._file = file
        self._request = request
        self._words = file.words(dict(request.values))
        self._picture = PassImage("MAIN", request.frame)
        self._saved: dict[str, PassImage] = {}
        # The picture as each stage left it.
        self._left: dict[str, PassImage] = {}
        self.steps: list[Step] = []
        for stage in STAGES:
            self._saved.pop(stage, None)
            self._left[stage] = self._picture
            for item in (item for item in file.passes if stage in item.stages):
                if item.when is None or self._value(item.when, stage) != 0:
                    self._run(stage, item)
        self._check_size()

    def _run(self, stage: str, item: CustomPass) -> None:
        images = self._images(stage)
        for binding in item.bindings:
            if binding.value not in {*images, *self._file.embedded, *self._file.histories}:
                raise binding.refusal("was not saved, since the WHEN of its pass is 0")
        size = (self._side(item.width, stage, 0), self._side(item.height, stage, 1))
        saved = item.result_at(stage)
        if saved is None and stage not in RESIZING and size != self._picture.size:
            raise self._file.source.fault(
                item.line,
                f"the picture's size is {size} after this pass, not {self._picture.size}; only the "
                f"stages {', '.join(RESIZING)} can change it",
            )
        image = PassImage(f"{len(self.steps)}.{saved or PICTURE}"[:MAX_NAME_LENGTH], size)
        self.steps.append(Step(item, stage, saved, image, images))
        if saved is None:
            self._picture = self._left[stage] = image
        else:
            self._saved[saved] = image

    def _images(self, stage: str) -> dict[str, PassImage]:
        """Return the images that a pass of a stage finds, by name."""
        images = {GLOW: PassImage(GLOW, self._request.buffers), **self._left, **self._saved}
        images[HOOKED] = images[stage] = self._picture
        if "MAIN" in images:
            images["MAINPRESUB"] = images["MAIN"]
        return images

    def _value(self, expression: Directive, stage: str) -> float:
        """Return the value of an expression at this place."""
        sizes = {name: image.size for name, image in self._images(stage).items()}
        sizes["OUTPUT"] = sizes["NATIVE_CROPPED"] = self._request.frame
        try:
            return evaluate(expression.value, Values(sizes, self._words))
        except ExpressionError as error:
            raise expression.fault(error) from None

    def _side(self, expression: Directive | None, stage: str, axis: int) -> int:
        """Return a side of a pass's result."""
        if expression is None:
            return self._picture.size[axis]
        side = round_half_away(self._value(expression, stage))
        if not 1 <= side <= MAX_SIDE:
            raise expression.fault(f"a side of {side} pixels is out of range, 1 to {MAX_SIDE}")
        return side

    def _check_size(self) -> None:
        """Check that the picture ends with the frame's size."""
        size, frame = self._picture.size, self._request.frame
        if size == frame or self._file.saves_bloom:
            return
        last = next(step for step in self.steps if step.image == self._picture)
        raise self._file.source.fault(
            last.item.line, f"the picture's size is {size} at the end, not the frame's, {frame}"
        )


def plan_rows(file: CustomFile, shaders: Shaders, request: FrameValues) -> tuple[Row, ...]:
    """Return the rows of a frame."""
    steps = Planner(file, request).steps
    names = framebuffers(file, steps)
    kept = histories(file, steps)
    rows = []
    for number, step in enumerate(steps):
        shader, core_shader = shaders.of(step.item, step.stage, request.values)
        given = {
            **request.values,
            "vkb_target": step.image.size,
            "input_size": request.frame,
            "target_size": request.frame,
            "frame": request.index * len(steps) + number + 1,
            "random": random_number(request.seed, request.index * len(steps) + number),
            **{name: image.size for name, image in {**step.sizes, **kept}.items()},
        }
        name = names.get(step.image.name, step.image.name)
        shown = name not in (step.image.name, PICTURE)
        images = [step.sizes[image].name for image in shader.images if image not in kept]
        reads = tuple(names.get(image, image) for image in images)
        before = tuple(names[kept[image].name] for image in shader.images if image in kept)
        block = step.item.compute.block if step.item.compute else None
        params = shader.pack(given)
        blocks: list[FileTexture | Buffer] = [*shader.textures, *shader.buffers]
        bound = tuple(request.resources[given_block.name] for given_block in blocks)
        turn = next(TURNS) if any(given_block.storage for given_block in blocks) else 0
        size = step.image.size
        rows.append(Row(name, core_shader, size, reads, shown, params, block, bound, turn, before))
    written = {row.name for row in rows}
    frame = request.frame
    if file.saves_bloom and BLOOM_IMAGE not in written:
        rows.append(package_row(BLACK, BLOOM_IMAGE, frame, ()))
    elif not file.saves_bloom:
        if PICTURE not in written:
            rows.append(package_row(COPY, PICTURE, frame, ("MAIN",)))
        rows.append(package_row(DIFFERENCE, BLOOM_IMAGE, frame, (PICTURE, "MAIN")))
    return tuple(rows)


def histories(file: CustomFile, steps: list[Step]) -> dict[str, PassImage]:
    """Return the images whose content the next frame reads, by the names that passes bind."""
    saved = {step.saved: step.image for step in steps}
    for step in steps:
        for binding in step.item.bindings:
            if file.histories.get(binding.value, step.saved) not in saved:
                raise binding.refusal("was not saved, since the WHEN of its pass is 0")
    return {name: saved[of] for name, of in file.histories.items() if of in saved}


def package_row(shader: int, name: str, size: Size, reads: tuple[str, ...]) -> Row:
    """Return the row of one of the package's passes."""
    return Row(name, package_shader(shader), size, reads, name == BLOOM_IMAGE)


def framebuffers(file: CustomFile, steps: list[Step]) -> dict[str, str]:
    """Return the names of the results that the core or the user know, by the image's own name.

    If several passes save the same name, the last one is the framebuffer.
    """
    last = {step.saved: step.image.name for step in steps}
    picture = last.pop(None, None)
    labels = labels_of({saved for stage, item in file.runs() if (saved := item.result_at(stage))})
    names = {image: labels[saved] for saved, image in last.items() if saved}
    if picture is not None and not file.saves_bloom:
        names[picture] = PICTURE
    return names


def labels_of(saved: set[str]) -> dict[str, str]:
    """Return the names of framebuffers, by those of the saved textures.

    These are the names in lower case; as they are written if they differ only in case. Names of the
    package get the prefix saved_; or saved__, if that name is saved, too.
    """
    counts = Counter(name.lower() for name in saved - {BLOOM})
    labels = {name: name.lower() if counts[name.lower()] == 1 else name for name in saved - {BLOOM}}
    given = set(labels.values())
    for name, label in labels.items():
        if label in TAKEN:
            labels[name] = f"saved{'__' if f'saved_{label}' in given else '_'}{label}"
    return {**labels, BLOOM: BLOOM_IMAGE}


def random_number(seed: int, count: int) -> float:
    """Return a number in [0, 1) for a pass: a hash (PCG, Jarzynski and Olano, JCGT 9(3), 2020)."""
    state = (seed * 747796405 + count * 2891336453 + 1) & 0xFFFFFFFF
    state = (state * 747796405 + 2891336453) & 0xFFFFFFFF
    word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737 & 0xFFFFFFFF
    return ((word >> 22) ^ word) / 2**32
