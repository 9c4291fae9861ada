"""PyTorch: depthwise convolutions, on the CPU in 32-bit floats, on a GPU in half floats."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.inputs import REC709
from benchmarks.peers import COPY, GpuWork, ImageBloom, round_to


class _Blur:
    """Threshold, two depthwise convolutions and, optionally, the sum; images (1, C, H, W)."""

    def __init__(self, kernel: NDArray[np.float32], channels: int, device: str, dtype: Any) -> None:
        self._torch = importlib.import_module("torch")
        weights = self._torch.tensor(kernel, device=device).to(dtype)
        taps = len(kernel)
        self._columns = weights.reshape(1, 1, taps, 1).repeat(channels, 1, 1, 1)
        self._rows = weights.reshape(1, 1, 1, taps).repeat(channels, 1, 1, 1)
        self._radius = taps // 2
        self._channels = channels

    def glow(self, image: Any, threshold: float) -> Any:
        luminance = sum(weight * image[:, i : i + 1] for i, weight in enumerate(REC709))
        return self._torch.where(luminance > threshold, image, 0)

    def blur(self, image: Any) -> Any:
        functional = self._torch.nn.functional
        radius, groups = self._radius, self._channels
        padded = functional.pad(image, (0, 0, radius, radius), mode="replicate")
        columns = functional.conv2d(padded, self._columns, groups=groups)
        padded = functional.pad(columns, (radius, radius, 0, 0), mode="replicate")
        return functional.conv2d(padded, self._rows, groups=groups)


def image_bloom(
    image: NDArray[Any], kernel: NDArray[np.float32], threshold: float, threads: int
) -> dict[str, ImageBloom]:
    """Return blooms of images like `image`, on the CPU."""
    torch = importlib.import_module("torch")
    torch.set_num_threads(threads)
    blur = _Blur(kernel, image.shape[2], "cpu", torch.float32)
    scale = 255 if image.dtype == np.uint8 else 1

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        with torch.inference_mode():
            # The channels stay last in memory, which avoids two transpositions.
            single = torch.from_numpy(picture).permute(2, 0, 1)[None].float()
            result = single + blur.blur(blur.glow(single, threshold * scale))
            values: NDArray[Any] = result[0].permute(1, 2, 0).numpy()
        return round_to(values, picture.dtype)

    return {"PyTorch": bloom}


def synchronized(call: Callable[[int], Any], device: str) -> Callable[[int], Any]:
    """Return a call that waits for the device, so that the wall clock counts all of its work."""
    if device == "cpu":
        return call
    wait = importlib.import_module("torch").cuda.synchronize

    def once(turn: int) -> Any:
        result = call(turn)
        wait()
        return result

    return once


def _on_device(torch: Any, work: Any, fetch: Any) -> GpuWork:
    """Return work on the device, timed by events."""

    def call(_: int) -> Any:
        start, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
        with torch.inference_mode():
            start.record()
            result = work()
            end.record()
        end.synchronize()
        return result, start, end

    def seconds(result: Any) -> float:
        _, start, end = result
        return float(start.elapsed_time(end)) * 1e-3

    return GpuWork(call, seconds, fetch)


def gpu_bloom(
    image: NDArray[Any], kernel: NDArray[np.float32], threshold: float
) -> dict[str, GpuWork]:
    """Return the bloom and the blur alone of an image on the GPU."""
    torch = importlib.import_module("torch")
    if not torch.cuda.is_available():
        raise RuntimeError("torch finds no CUDA device")
    # Convolutions in the image's format; cuDNN selects its fastest algorithm.
    torch.backends.cudnn.benchmark = True
    blur = _Blur(kernel, image.shape[2], "cuda", torch.float16)
    source = torch.tensor(image, device="cuda").permute(2, 0, 1)[None].contiguous()
    glow = blur.glow(source, threshold)

    def fetch(result: Any) -> NDArray[Any]:
        picture: NDArray[Any] = result[0][0].permute(1, 2, 0).contiguous().cpu().numpy()
        return picture

    def bloom() -> Any:
        return source + blur.blur(blur.glow(source, threshold))

    return {
        "PyTorch conv2d": _on_device(torch, bloom, fetch),
        "PyTorch conv2d, blur alone": _on_device(torch, lambda: blur.blur(glow), fetch),
    }


def gpu_convolution(
    image: NDArray[np.float16],
    kernel: NDArray[np.float32],
    padded: tuple[int, int],
    threshold: float,
) -> dict[str, GpuWork]:
    """Return the bloom of an image (H, W, 4) by Fourier transforms, and the convolution alone.

    The kernel (3, h, w) has its centre at [0, 0], and the padded size. There is also a copy of
    the image's bytes on the device.
    """
    torch = importlib.import_module("torch")
    if not torch.cuda.is_available():
        raise RuntimeError("torch finds no CUDA device")
    source = torch.tensor(image, device="cuda")
    spectrum = torch.fft.rfft2(torch.tensor(kernel, device="cuda"))
    weights = torch.tensor([*REC709, 0.0], device="cuda", dtype=torch.float16)
    height, width = image.shape[:2]
    target = torch.empty_like(source)

    def glow_of() -> Any:
        return torch.where((source @ weights > threshold)[..., None], source, 0)

    def convolve(glow: Any) -> Any:
        # Three real transforms: alpha is not convolved.
        planes = glow[..., :3].permute(2, 0, 1).float()
        spectra = torch.fft.rfft2(planes, padded)
        spectra *= spectrum
        return torch.fft.irfft2(spectra, padded)[:, :height, :width].permute(1, 2, 0)

    def alone() -> Any:
        result = torch.empty_like(source)
        result[..., :3] = convolve(glow)
        result[..., 3] = 1
        return result

    def bloom() -> Any:
        result = source.clone()
        result[..., :3] += convolve(glow_of())
        return result

    def copy() -> Any:
        return target.copy_(source)

    def fetch(result: Any) -> NDArray[Any]:
        picture: NDArray[Any] = result[0].cpu().numpy()
        return picture

    glow = glow_of()
    return {
        "torch.fft": _on_device(torch, bloom, fetch),
        "torch.fft, convolution alone": _on_device(torch, alone, fetch),
        COPY: _on_device(torch, copy, fetch),
    }


def pyramid(image: Any, levels: int) -> Any:
    """Return the bloom of ``Pyramid(levels)`` of a tensor (1, 3, H, W).

    Its sides are multiples of two to the power of `levels`.
    """
    torch = importlib.import_module("torch")
    functional = torch.nn.functional
    outer, inner = (
        torch.tensor(one, device=image.device) for one in (_line(2.0, 0.25, 0.5), _line(1.0, 0.5))
    )
    down = 0.5 * (torch.outer(outer, outer) + torch.outer(inner, inner))
    tent = torch.tensor([0.25, 0.5, 0.25], device=image.device)
    kernels = [one.expand(3, 1, *one.shape).contiguous() for one in (down, torch.outer(tent, tent))]
    chain = [image]
    for _ in range(levels):
        padded = functional.pad(chain[-1], (2, 2, 2, 2), mode="replicate")
        chain.append(functional.conv2d(padded, kernels[0], stride=2, groups=3))

    def enlarge(level: Any) -> Any:
        padded = functional.pad(level, (2, 2, 2, 2), mode="replicate")
        filtered = functional.conv2d(padded, kernels[1], groups=3)
        double = functional.interpolate(filtered, scale_factor=2, mode="bilinear")
        return double[..., 2:-2, 2:-2]

    up = chain[-1]
    for level in chain[-2:0:-1]:
        up = level + enlarge(up)
    return enlarge(up) / levels


def _line(distance: float, side: float, middle: float = 0.0) -> list[float]:
    """Return the weights of six texels for taps between the middle two and beside them."""
    weights = [0.0] * 6
    for offset, share in ((-distance, side), (0.0, middle), (distance, side)):
        for texel in (2, 3):
            weights[texel + int(offset)] += share / 2
    return weights
