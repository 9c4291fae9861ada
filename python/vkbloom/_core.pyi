from collections.abc import Callable, Iterable
from types import ModuleType
from typing import Any, NoReturn, final, overload

import numpy as np
from numpy.typing import NDArray

from vkbloom._errors import AdapterNotFoundError as AdapterNotFoundError
from vkbloom._errors import DeviceLostError as DeviceLostError
from vkbloom._errors import Error as Error
from vkbloom._errors import OutOfMemoryError as OutOfMemoryError
from vkbloom._errors import ShaderError as ShaderError
from vkbloom._errors import ValidationError as ValidationError

VALUES: dict[str, tuple[float, float, float]]
GLARE_VALUES: dict[str, tuple[float, float, float]]
CHOICES: dict[str, tuple[str, ...]]
METHODS: tuple[str, ...]
STAGES: tuple[str, ...]
EXPOSURES: tuple[str, ...]
TAAS: tuple[str, ...]
TAA_NUMBERS: tuple[str, ...]
TAA_PHASES: int
EXPOSURE_NUMBERS: tuple[str, ...]
FORMATS: tuple[str, ...]
SETTINGS_BLOCK: dict[str, tuple[int, str, int]]
STAGE_BLOCK: dict[str, tuple[int, str, int]]
MAX_WEIGHTS: int
MAX_LAYERS: int
MAX_STAGES: int
MAX_GHOSTS: int

_AdapterTuple = tuple[str, str, str, str, str, bytes, bool, str, str, int, bool]
_Array = NDArray[Any]
_ExportedImage = (
    tuple[Exported, int, tuple[int, int, int], tuple[int, int, int], int]
    | tuple[Exported, int, tuple[int, int, int], tuple[int, int, int], int, int, int]
)
_Pass = tuple[str, str, tuple[str, ...], tuple[str, ...], str, int]

def connect(
    errors: ModuleType, describe_unknown: Callable[[str, object, Iterable[str]], str], /
) -> None: ...
def fail_without_adapter(text: str, /) -> NoReturn: ...
def adapters(driver: str, /) -> list[_AdapterTuple]: ...
def end_instances() -> None: ...
def image_source(
    image: _Array | _ExportedImage,
    emission: _Array | _ExportedImage | None = None,
    mask: NDArray[np.float32] | None = None,
    levels: tuple[_Array | _ExportedImage, ...] = (),
    motion_x: NDArray[np.float32] | _ExportedImage | None = None,
    motion_y: NDArray[np.float32] | _ExportedImage | None = None,
    depth: NDArray[np.float32] | _ExportedImage | None = None,
    /,
) -> Source: ...
def scene_contents(
    block: bytes, pictures: bytes, arrays: tuple[NDArray[Any], ...], /
) -> SceneContents: ...
def scene_source(contents: SceneContents, block: bytes, /) -> Source: ...
def plan(
    source: Source, settings: object, names: tuple[str, ...] | None, variants: str = "fragment", /
) -> Plan: ...
def read_dlpack(
    capsule: object, /
) -> tuple[int, tuple[int, int], tuple[int, int, int], tuple[int, ...], tuple[int, ...] | None]: ...
def dry_run(steps: tuple[tuple[Source, Plan], ...], /) -> list[list[_Pass]]: ...
def resource_owner() -> object: ...

@final
class Renderer:
    def __new__(
        cls,
        adapter: int,
        driver: str,
        validation: bool,
        variants: str,
        frame_seconds: float,
        read_cache: Callable[[bytes], bytes | None],
        /,
    ) -> Renderer: ...
    @property
    def closed(self) -> bool: ...
    @property
    def lost(self) -> bool: ...
    @property
    def info(self) -> _AdapterTuple: ...
    @property
    def pipeline_count(self) -> int: ...
    @property
    def transposes(self) -> tuple[int, int]: ...
    @property
    def cached(self) -> tuple[int, int, int]: ...
    def close(self) -> None: ...
    def pipeline_cache(self) -> bytes: ...
    @overload
    def plan(self, source: Source, settings: object, names: tuple[str, ...] | None, /) -> Plan: ...
    @overload
    def plan(
        self,
        source: Source,
        settings: object,
        names: None,
        cotangents: tuple[str, ...],
        results: str,
        sums: tuple[str, ...] = (),
        /,
    ) -> Plan | None: ...
    @overload
    def run(
        self,
        source: Source,
        plans: tuple[Plan, ...],
        arrays: tuple[tuple[_Array | Exported | None, ...], ...],
        in_place: bool = False,
        show: None = None,
        histories: tuple[Source | None, ...] | None = None,
        /,
    ) -> Submission: ...
    @overload
    def run(
        self,
        source: Source,
        plans: tuple[Plan],
        arrays: tuple[tuple[None]],
        in_place: bool,
        show: tuple[int, int, int, bool],
        histories: tuple[Source | None, ...] | None = None,
        /,
    ) -> Submission | None: ...
    def upload(self, source: Source, spare: Source | None, recycled: bool, /) -> Source: ...
    @property
    def instance(self) -> int: ...
    def open_screen(self, surface: int, /) -> int: ...
    def close_screen(self, screen: int, /) -> None: ...
    def pages(self, size: int, /) -> Pages: ...
    def cuda(self) -> tuple[int, int]: ...
    def cuda_name(self, ordinal: int, /) -> str: ...
    def in_context(self, function: Callable[[], Any], /) -> Any: ...
    def export(self, size: int, /) -> Exported: ...
    def snapshot(
        self, address: int, size: int, stream: int = 0, later: bool = False, /
    ) -> Exported: ...

@final
class Source:
    @property
    def kind(self) -> tuple[tuple[int, int, int], str]: ...
    @property
    def resident(self) -> bool: ...
    @property
    def exported(self) -> bool: ...

@final
class SceneContents: ...

@final
class Plan:
    @property
    def outputs(self) -> tuple[tuple[str, tuple[int, ...], str], ...]: ...
    @property
    def histories(self) -> tuple[tuple[str, tuple[int, ...], str], ...]: ...
    @property
    def passes(self) -> list[_Pass]: ...
    @property
    def image_size(self) -> int: ...
    def shares_images(self, other: Plan, /) -> bool: ...
    def is_of(self, source: Source, /) -> bool: ...

@final
class Submission:
    @property
    def ordered(self) -> bool: ...
    @property
    def exports_ordered(self) -> bool: ...
    def wait(self) -> tuple[list[dict[str, float]], tuple[int, ...]]: ...
    @property
    def histories(self) -> tuple[Source, ...] | None: ...

@final
class Exported:
    @property
    def address(self) -> int: ...
    @property
    def ordinal(self) -> int: ...
    def capsule(
        self,
        shape: tuple[int, ...],
        code: int,
        bits: int,
        versioned: bool,
        offset: int,
        stream: int,
        /,
    ) -> Any: ...
    def complete(self) -> None: ...
    def clone(self, size: int, offset: int, /) -> Exported: ...
    def copy_bytes(self, to: int, source: int, size: int, /) -> None: ...

@final
class Pages:
    def __len__(self) -> int: ...
    def __buffer__(self, flags: int, /) -> memoryview: ...
