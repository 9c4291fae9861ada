from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

VALUES: dict[str, tuple[float, float, float]]
CHOICES: dict[str, tuple[str, ...]]
MAX_WEIGHTS: int
MAX_LAYERS: int

_Adapter = tuple[str, str, str, str, str, bytes, bool]
_Array = NDArray[Any]
_Camera = tuple[tuple[float, float, float], tuple[float, float, float], float, float, float]
_Texture = tuple[tuple[_Array, ...], str, str, str, str, str]
_Mesh = tuple[
    NDArray[np.float32],
    NDArray[np.uint32],
    NDArray[np.float32] | None,
    NDArray[np.float32] | None,
    tuple[tuple[int, int, int], ...],
]
_Scene = tuple[int, _Mesh, _Mesh | None, tuple[_Array, ...], tuple[_Texture, ...]]
_Result = tuple[dict[str, _Array], dict[str, float], tuple[int, int]]
_Allocate = Callable[[str, tuple[int, ...], str], _Array]

class Error(Exception):
    vk_call: str | None
    vk_result: int | None

class AdapterNotFoundError(Error, RuntimeError): ...
class DeviceLostError(Error): ...
class OutOfMemoryError(Error, MemoryError): ...
class ValidationError(Error): ...
class ShaderError(Error): ...

def adapters(driver: str, /) -> list[_Adapter]: ...
def describe(
    settings: object, size: tuple[int, int], has_sky: bool, shading: str, /
) -> dict[str, Any]: ...

class Renderer:
    def __new__(
        cls,
        adapter: str,
        driver: str,
        validation: bool,
        forms: str,
        frame_seconds: float,
        read_cache: Callable[[bytes], bytes | None],
        /,
    ) -> Renderer: ...
    @property
    def closed(self) -> bool: ...
    @property
    def info(self) -> _Adapter: ...
    @property
    def pipeline_count(self) -> int: ...
    @property
    def cached(self) -> tuple[int, int, int]: ...
    def close(self) -> None: ...
    def new_array(
        self,
        empty: Callable[[tuple[int, ...], str], _Array],
        shape: tuple[int, ...],
        dtype: str,
        /,
    ) -> _Array: ...
    def pipeline_cache(self) -> bytes: ...
    def render(
        self,
        scene: _Scene,
        camera: _Camera,
        size: tuple[int, int],
        shading: str,
        time: float,
        glow_intensity: float,
        names: tuple[str, ...] | None,
        /,
    ) -> Batch: ...
    def apply(self, image: _Array, names: tuple[str, ...] | None, /) -> Batch: ...

class Batch:
    @property
    def size(self) -> int: ...
    def add(self, settings: object, allocate: _Allocate, /) -> bool: ...
    def submit(self) -> None: ...
    def collect(self) -> list[_Result]: ...
