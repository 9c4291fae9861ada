"""Pairs for training: HDR images with and without the glare of a lens, by seed.

The lens is an iris with dust and scratches, whose diffraction is the bloom, with ghosts, a halo and
streaks. Each pair is a dict:

- ``clean``: the image, (H, W, 3), linear light
- ``glared``: the image with glare; ``clean + glare``
- ``glare``: the glare alone
- ``mask``: (H, W) bool, where the glare is more than `VISIBLE`
- ``settings``: all settings as JSON, for `vkbloom.Settings.from_json`

`TrainingPairs` has ``len()`` and indices, as datasets of PyTorch have, and can be pickled: each
worker that a DataLoader starts by "spawn" opens its own renderer. Without PyTorch it is a sequence.
Images that are tensors of CUDA stay on their GPU.

As a program, it writes pairs into a folder::

    python examples/training_pairs.py image.exr ... --out pairs --count 100
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

import vkbloom

#: Glare of less luminance is not in the mask.
VISIBLE = 0.02
#: Different irises of one seed. Their kernels are made once.
LENSES = 16
#: Weights of red, green and blue in the luminance (Rec. ITU-R BT.709).
LUMINANCE = (0.2126, 0.7152, 0.0722)


@functools.lru_cache(LENSES)
def lens(seed: int, number: int) -> Any:
    """Return the point spread of an iris: `number` of the lenses of a seed."""
    rng = np.random.default_rng((seed, number))
    mask = vkbloom.psf.iris(
        blades=int(rng.integers(5, 10)),
        rotation=float(rng.uniform(0, 72)),
        roundness=float(rng.uniform(0, 0.8)),
        dust=int(rng.integers(0, 60)),
        scratches=int(rng.integers(0, 30)),
        seed=int(rng.integers(2**31)),
        size=256,
    )
    f_number = float(rng.uniform(4, 16))
    return vkbloom.psf.aperture(mask, f_number=f_number, wavelengths=(611, 549, 467))


def random_settings(seed: int, index: int) -> vkbloom.Settings:
    """Return the settings of a pair."""
    rng = np.random.default_rng((seed, LENSES, index))
    stages: list[Any] = []
    if rng.random() < 0.7:
        stages.append(vkbloom.Ghosts(intensity=float(rng.uniform(0.01, 0.1))))
    if rng.random() < 0.5:
        directions = int(rng.integers(1, 4)) * 2
        stages.append(
            vkbloom.Streaks(directions=directions, intensity=float(rng.uniform(0.01, 0.1)))
        )
    if rng.random() < 0.3:
        stages.append(vkbloom.Halo(intensity=float(rng.uniform(0.005, 0.03))))
    return vkbloom.Convolution(
        lens(seed, int(rng.integers(LENSES))),
        # The light of these lenses ends before. Without it, kernels are of twice the image's size.
        kernel_size=(1023, 1023),
        threshold=float(rng.uniform(0.8, 2.0)),
        intensity=float(rng.uniform(0.05, 0.5)),
        # Glare is smooth. A smaller scale would miss single bright pixels.
        bloom_scale=0.5,
        format="rgba16float",
        glare=tuple(stages),
    )


@functools.lru_cache
def weights_like(dtype: Any, device: Any) -> Any:
    """Return the weights of the luminance as a tensor; to make one waits for the GPU."""
    import torch  # noqa: PLC0415  only for tensors

    return torch.tensor(LUMINANCE, dtype=dtype, device=device)


def make_pair(renderer: vkbloom.Renderer, image: Any, settings: vkbloom.Settings) -> dict[str, Any]:
    """Return the pair of an image: arrays of NumPy, or tensors of its GPU."""
    made = renderer.apply(image, settings, framebuffers="final")["final"]
    if isinstance(made, vkbloom.DeviceArray):
        import torch  # noqa: PLC0415  only for tensors

        glared: Any = torch.from_dlpack(made)
        weights: Any = weights_like(glared.dtype, glared.device)
    else:
        glared, weights = made, np.array(LUMINANCE, made.dtype)
    glare = glared - image
    return {
        "clean": image,
        "glared": glared,
        "glare": glare,
        "mask": glare @ weights > VISIBLE,
        "settings": settings.to_json(),
    }


class TrainingPairs:
    """Pairs of images, by index: each image with `per_image` settings.

    - `images`: Paths, arrays (H, W, 3), or tensors.
    - `seed`: The same seed gives the same pairs.
    - `adapter`: As for `vkbloom.Renderer`.
    """

    def __init__(
        self, images: Sequence[Any], *, per_image: int = 1, seed: int = 0, adapter: str = "auto"
    ) -> None:
        self.images, self.per_image, self.seed, self.adapter = images, per_image, seed, adapter
        self._renderer: vkbloom.Renderer | None = None

    def __len__(self) -> int:
        return len(self.images) * self.per_image

    def __getitem__(self, index: int) -> dict[str, Any]:
        if not 0 <= index < len(self):
            raise IndexError(f"index: {index} is out of range, 0 to {len(self) - 1}")
        if self._renderer is None:
            self._renderer = vkbloom.Renderer(self.adapter)
        image = self.images[index // self.per_image]
        if isinstance(image, str | Path):
            image = vkbloom.read(image)[..., :3].astype(np.float32)
        return make_pair(self._renderer, image, random_settings(self.seed, index))

    def __getstate__(self) -> dict[str, Any]:
        # A renderer belongs to its process.
        return {**self.__dict__, "_renderer": None}


@click.command()
@click.argument("images", nargs=-1, required=True, type=click.Path(exists=True))
@click.option("--out", default="pairs", help="The folder to write into.")
@click.option("--count", default=16, help="Pairs for each image.")
@click.option("--seed", default=0)
@click.option("--adapter", default="auto")
def main(images: tuple[str, ...], out: str, count: int, seed: int, adapter: str) -> None:
    """Write training pairs: clean, glared and glare as OpenEXR, mask as PNG, settings as JSON."""
    pairs = TrainingPairs(images, per_image=count, seed=seed, adapter=adapter)
    for index in range(len(pairs)):
        pair = pairs[index]
        folder = Path(out) / f"{index:06d}"
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("clean", "glared", "glare"):
            vkbloom.write(folder / f"{name}.exr", pair[name].astype(np.float16))
        mask = np.repeat(pair["mask"][..., None], 3, axis=2)
        vkbloom.write(folder / "mask.png", (255 * mask).astype(np.uint8))
        (folder / "settings.json").write_text(pair["settings"])


if __name__ == "__main__":
    main()
