"""Read RGB profiles of a matrix and curves (ICC.1:2022), and convert colours by them."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.srgb import decode_srgb

#: A curve for values of 0..1, and for floats above 1.
Curve = Callable[[NDArray[np.float64]], NDArray[np.float64]]

_COLOURS: Final = ("r", "g", "b")
# Of a curve that is inverted: as fine as numbers of 16 bits.
_STEPS: Final = 1 << 16
# Half an 8-bit level, encoded. A profile that differs by less from sRGB counts as sRGB.
_SAME: Final = 0.5 / 255
# Tags, of 12 bytes each. Profiles have about 20; a damaged one may claim billions.
_MAX_TAGS: Final = 1000
# The matrix from linear Rec. 709 (BT.709-6) to XYZ.
_REC_709: Final = np.array(
    [
        [0.4123907992659595, 0.3575843393838780, 0.1804807884018343],
        [0.2126390058715104, 0.7151686787677559, 0.0721923153607337],
        [0.0193308187155918, 0.1191947797946259, 0.9505321522496608],
    ]
)
# The matrix of the linear Bradford adaptation (ICC.1:2022, annex E).
_BRADFORD: Final = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
# The white of profiles (ICC.1:2022, 7.2.16).
_D50: Final = np.array([0.9642, 1.0, 0.8249])
# g, a, b, c, d, e, f of Y = (a X + b)^g + e if X >= d, otherwise c X + f: for each type of a
# parametric curve, the number of its parameters and how they make the seven.
_PARAMETRIC: Final[dict[int, tuple[int, Callable[..., tuple[float, ...]]]]] = {
    0: (1, lambda g: (g, 1, 0, 0, 0, 0, 0)),
    1: (3, lambda g, a, b: (g, a, b, 0, -b / a, 0, 0)),
    2: (4, lambda g, a, b, c: (g, a, b, 0, -b / a, c, c)),
    3: (5, lambda g, a, b, c, d: (g, a, b, c, d, 0, 0)),
    4: (7, lambda *seven: seven),
}


class Profile(NamedTuple):
    """The curves of red, green and blue, and the matrix from their results to linear Rec. 709."""

    curves: tuple[Curve, Curve, Curve]
    matrix: NDArray[np.float64]

    def decode(self, colours: NDArray[Any]) -> NDArray[np.float32]:
        """Return linear Rec. 709, not clipped, from integers or floats (H, W, 3)."""
        if colours.dtype.kind == "f":
            light = np.stack(
                [
                    curve(colours[:, :, index].astype(float))
                    for index, curve in enumerate(self.curves)
                ],
                axis=-1,
            )
            return (light @ self.matrix.T).astype(np.float32)
        scale = np.iinfo(colours.dtype).max
        levels = np.arange(scale + 1) / scale
        linear = np.empty(colours.shape, np.float32)
        for channel, curve in enumerate(self.curves):
            table = np.clip(curve(levels), 0, 1).astype(np.float32)
            linear[:, :, channel] = table[colours[:, :, channel]]
        made: NDArray[np.float32] = linear @ self.matrix.T.astype(np.float32)
        return made

    def from_rec_709(self, light: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return linear Rec. 709 (H, W, 3) with the profile's own primaries, not clipped."""
        made: NDArray[np.floating] = light @ np.linalg.inv(self.matrix).T.astype(light.dtype)
        return made

    def encode(self, light: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return linear floats (H, W, 3) of the profile's own primaries on its curves, in 0..1."""
        levels = np.linspace(0, 1, _STEPS + 1)
        made = np.empty(light.shape, np.float32)
        for channel, curve in enumerate(self.curves):
            made[:, :, channel] = np.interp(light[:, :, channel], curve(levels), levels)
        return made

    @property
    def is_invertible(self) -> bool:
        """Whether each curve rises, and the primaries span a space."""
        levels = np.linspace(0, 1, _STEPS + 1)
        made = [curve(levels) for curve in self.curves]
        # (A damaged profile may have a curve that falls, or three equal primaries.)
        is_rising = all((np.diff(one) >= 0).all() and one[-1] > one[0] for one in made)
        return is_rising and bool(np.linalg.cond(self.matrix) < 1e6)

    @property
    def is_srgb(self) -> bool:
        """Whether the profile means sRGB, within half a level of 8 bits."""
        levels = np.arange(0, 256, 51, dtype=np.uint8)
        probe = np.stack(np.meshgrid(levels, levels, levels), -1).reshape(6, 36, 3)
        plain = probe / 255
        expected = decode_srgb(plain)
        # Where the curve is flat, the same encoded difference is a smaller linear one.
        slope = np.maximum((decode_srgb(plain + 0.01) - expected) / 0.01, 1 / 12.92)
        return bool((np.abs(self.decode(probe) - expected) <= _SAME * slope).all())


def read_profile(content: bytes) -> Profile:
    """Return a profile of a matrix and curves; ValueError if it is damaged or of another kind."""
    if content[16:24] != b"RGB XYZ ":
        raise ValueError("the profile is not from RGB to XYZ")
    try:
        tags = _tags(content)
        curves = [_curve(tags[f"{colour}TRC".encode()]) for colour in _COLOURS]
        columns = [_xyz(tags[f"{colour}XYZ".encode()]) for colour in _COLOURS]
    except (KeyError, struct.error, ZeroDivisionError) as error:
        raise ValueError("the profile is damaged or has no matrix and curves") from error
    red, green, blue = curves
    return Profile((red, green, blue), _to_rec_709(_D50) @ np.stack(columns, axis=1))


def _to_rec_709(white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix from XYZ of a white to linear Rec. 709."""
    adapt = np.diag((_BRADFORD @ _REC_709.sum(axis=1)) / (_BRADFORD @ white)) @ _BRADFORD
    made: NDArray[np.float64] = np.linalg.inv(_REC_709) @ np.linalg.inv(_BRADFORD) @ adapt
    return made


def from_chromaticities(chromaticities: Sequence[float]) -> NDArray[np.float64]:
    """Return the matrix from linear colours of x and y of red, green, blue, white to Rec. 709.

    White becomes white, by the Bradford adaptation.
    """
    x, y = np.reshape(chromaticities, (4, 2)).T
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y])
    columns = xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])
    made: NDArray[np.float64] = _to_rec_709(xyz[:, 3]) @ columns
    return made


def from_lab(values: NDArray[np.unsignedinteger], space: str) -> NDArray[np.float32]:
    """Return linear Rec. 709, not clipped, from a TIFF file's L*, a* and b* of D50, (H, W, 3).

    `space`: "CIELAB", whose a* and b* are signed (TIFF 6.0, section 23), or "ICCLAB", where they
    have an offset (TIFF technical note 4).
    """
    bits = 8 * values.dtype.itemsize
    numbers = values.astype(np.float64)
    light, ab = numbers[:, :, :1], numbers[:, :, 1:] / (1 << (bits - 8))
    if space == "CIELAB":
        light = light / ((1 << bits) - 1)
        ab = np.where(ab < 128, ab, ab - 256)
    else:
        light = light / (255 << (bits - 8))
        ab = ab - 128
    y = (100 * light[:, :, 0] + 16) / 116
    roots = np.stack([y + ab[:, :, 0] / 500, y, y - ab[:, :, 1] / 200], -1)
    # CIE 15:2018, 8.2.1.1.
    xyz = np.where(roots > 6 / 29, roots**3, (roots - 4 / 29) * 3 * (6 / 29) ** 2) * _D50
    made: NDArray[np.float32] = (xyz @ _to_rec_709(_D50).T).astype(np.float32)
    return made


def _tags(content: bytes) -> dict[bytes, bytes]:
    """Return the contents of a profile's tags by signature."""
    (count,) = struct.unpack_from(">I", content, 128)
    tags = {}
    for index in range(min(count, _MAX_TAGS)):
        signature, start, size = struct.unpack_from(">4sII", content, 132 + 12 * index)
        tags[signature] = content[start : start + size]
    return tags


def _read_fixed(content: bytes, start: int, count: int) -> tuple[float, ...]:
    """Return numbers of the type s15Fixed16."""
    return tuple(value / 65536 for value in struct.unpack_from(f">{count}i", content, start))


def _xyz(content: bytes) -> tuple[float, ...]:
    if content[:4] != b"XYZ ":
        raise ValueError("the profile's matrix is damaged")
    return _read_fixed(content, 8, 3)


def _curve(content: bytes) -> Curve:
    """Return the curve of a tag of the type curv or para (ICC.1:2022, 10.6 and 10.18)."""
    if content[:4] == b"curv":
        (count,) = struct.unpack_from(">I", content, 8)
        entries = np.array(struct.unpack_from(f">{count}H", content, 12))
        if count < 2:
            # No entry: the identity. One entry: an exponent with eight fractional bits.
            return _parametric((entries[0] / 256 if count else 1, 1, 0, 0, 0, 0, 0))
        return lambda x: np.interp(x, np.linspace(0, 1, count), entries / 65535)
    (kind,) = struct.unpack_from(">H", content, 8)
    if content[:4] != b"para" or kind not in _PARAMETRIC:
        raise ValueError("the profile's curves are of an unknown type")
    count, seven = _PARAMETRIC[kind]
    return _parametric(seven(*_read_fixed(content, 12, count)))


def _parametric(seven: tuple[float, ...]) -> Curve:
    g, a, b, c, d, e, f = seven

    def curve(x: NDArray[np.float64]) -> NDArray[np.float64]:
        with np.errstate(divide="ignore", over="ignore"):
            power = np.maximum(a * x + b, 0) ** g + e
        return np.where(x >= d, power, c * x + f)

    return curve
