"""glTF 2.0 and GLB files: the container, checked access to the JSON, accessors and buffers.

Everything that is used is checked where it is read; other members may have any value. Files are not
trusted: a URI must not lead out of the file's folder, sizes are checked before memory
is allocated, and every defect becomes a ValueError that names the file.

Section numbers are those of the "glTF 2.0 Specification", version 2.0.1, Khronos Group.
"""

from __future__ import annotations

import base64
import binascii
import json
import os
import re
import reprlib
import struct
from collections.abc import Sequence
from pathlib import Path, PureWindowsPath
from typing import Any, Final, NoReturn, TypeAlias
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import MAX_FLOAT

Floats: TypeAlias = NDArray[np.float64]

FLOAT: Final = 5126
INTEGERS: Final = (5121, 5123, 5125)
EMISSIVE_STRENGTH: Final = "KHR_materials_emissive_strength"
TEXTURE_TRANSFORM: Final = "KHR_texture_transform"
# A limit, since a small file can need any amount of memory: several nodes can use one mesh, and a
# sparse accessor stores no zeros. This many baked vertices take 0.6 GB.
MAX_VERTICES: Final = 2**24
_COMPONENTS: Final = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS: Final = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_EXTENSIONS: Final = frozenset({EMISSIVE_STRENGTH, TEXTURE_TRANSFORM})
# Of compressed bytes. The number of texels is checked when the image is decoded.
_MAX_IMAGE_BYTES: Final = 2**30


class Parsed:
    """An object of the JSON, with its members as attributes; a missing one is None."""

    def __init__(self, members: dict[str, Any]) -> None:
        self.__dict__.update(members)

    def __getattr__(self, name: str) -> Any:
        return None

    def __repr__(self) -> str:
        return repr(self.__dict__)


class GltfFile:
    """An opened file: its parsed JSON, its buffers, and the list of things that are not loaded."""

    def __init__(self, path: Path) -> None:
        self.path = path
        # A dict, which keeps the order and names each thing once.
        self.left_out: dict[str, None] = {}
        self._buffers: dict[object, bytes] = {}
        data = path.read_bytes()
        text, self._blob = self._split_glb(data) if data[:4] == b"glTF" else (data, None)
        self.root = self._parse(text)

    def fail(self, what: str) -> NoReturn:
        """Raise a ValueError that names the file and what is wrong with it."""
        raise ValueError(f"{self.path}: {what}")

    # The container and its header

    def _parse(self, text: bytes) -> Parsed:
        try:
            # Some exporters pad the JSON chunk with NUL, where 4.4.3.2 requires spaces.
            document = json.loads(
                text.rstrip(b"\0").decode("utf-8-sig"),
                object_hook=_read_parts,
                parse_float=_number,
            )
        except (ValueError, RecursionError) as error:
            raise ValueError(
                f"{self.path}: not a glTF 2.0 document ({type(error).__name__}: {error})"
            ) from error
        if not isinstance(document, Parsed):
            self.fail("not a glTF 2.0 document: a JSON object is needed")
        self._check_asset(document)
        return document

    def _split_glb(self, data: bytes) -> tuple[bytes, bytes | None]:
        """Split a GLB (4.4) into its JSON and its binary chunk."""
        if len(data) < 20:
            self.fail(f"truncated: {len(data)} bytes are not a complete GLB header")
        _, version, length = struct.unpack_from("<4sII", data)
        if version != 2:
            self.fail(f"GLB version {version}; 2 is needed")
        if length > len(data) or length < 20:
            self.fail(f"truncated: its header gives {length} bytes, it has {len(data)}")
        chunks: list[tuple[bytes, bytes]] = []
        offset = 12
        while offset + 8 <= length:
            size, kind = struct.unpack_from("<I4s", data, offset)
            offset += 8
            if size > length - offset:
                self.fail(f"damaged: chunk {len(chunks)} of {size} bytes ends beyond the file")
            chunks.append((kind, data[offset : offset + size]))
            offset += size
        if chunks[0][0] != b"JSON":
            self.fail("damaged: its first chunk is not JSON")
        # The binary chunk is the second one (4.4.3.3); others are ignored.
        blob = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == b"BIN\0" else None
        return chunks[0][1], blob

    def _check_asset(self, document: Parsed) -> None:
        # Optional in glTF 1.0.
        asset = document.asset if isinstance(document.asset, Parsed) else Parsed({})
        version = asset.version
        if not isinstance(version, str) or not version.startswith("2."):
            given = "missing" if version is None else reprlib.repr(version)
            self.fail(f"glTF version (asset.version) is {given}; 2.0 is needed")
        minimum = "2.0" if asset.minVersion is None else asset.minVersion
        if not isinstance(minimum, str) or not re.fullmatch(r"1\.\d+|2\.0", minimum):
            self.fail(f"needs at least glTF {reprlib.repr(minimum)}; 2.0 is supported")
        for field in ("extensionsRequired", "extensionsUsed"):
            names = getattr(document, field)
            names = [] if names is None else names
            if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
                self.fail(f"{field} is not a list of names")
            unknown = [name for name in names if name not in _EXTENSIONS]
            if unknown and field == "extensionsRequired":
                self.fail(f"needs extensions that are not supported: {', '.join(unknown)}")
            for name in unknown:
                self.leave_out(f"extension {name}")
        if document.animations:
            self.leave_out("animations")

    # Checked access to the parsed JSON

    def leave_out(self, what: str) -> None:
        """Note something in the file that is not loaded."""
        self.left_out[what] = None

    def items(self, field: str) -> list[Parsed]:
        """Return one of the root's lists; an empty one if it is missing."""
        items = getattr(self.root, field)
        items = [] if items is None else items
        if not isinstance(items, list):
            self.fail(f"{field} is not a list")
        return items

    def item(self, field: str, index: object, user: str) -> Parsed:
        """Return one entry of a list of the root. Messages name `user`, which refers to it."""
        items = self.items(field)
        if not items:
            self.fail(f"{user}: index into {field} is {reprlib.repr(index)}; there are none")
        item = items[self.integer(index, f"{user}: index into {field}", 0, len(items) - 1)]
        return self.part(item, f"{field}[{index}]")

    def part(self, value: object, what: str) -> Parsed:
        """Return `value` if it is an object; an empty one for None."""
        if value is None:
            return Parsed({})
        if not isinstance(value, Parsed):
            self.fail(f"{what} is not an object")
        return value

    def extension(self, owner: Parsed, name: str, what: str) -> Parsed | None:
        """Return an extension of an object; None if it has none of this name."""
        given = getattr(self.part(owner.extensions, f"{what}.extensions"), name)
        return None if given is None else self.part(given, f"{what}.{name}")

    def integer(self, value: object, what: str, low: int, high: int) -> int:
        """Return `value` if it is an integer in low..high."""
        # In Python a bool is an int, in JSON it is not.
        if not isinstance(value, int) or isinstance(value, bool):
            self.fail(f"{what} is {reprlib.repr(value)}; an integer is needed")
        if not low <= value <= high:
            self.fail(f"{what} is {reprlib.repr(value)}; {low}..{high} is possible")
        return value

    def floats(
        self, value: object, what: str, usual: Sequence[float], *, low: float = -MAX_FLOAT
    ) -> Floats:
        """Return a list as an array if it has as many finite numbers as what None stands for."""
        value = list(usual) if value is None else value
        if not isinstance(value, list) or len(value) != len(usual):
            self.fail(f"{what} is {reprlib.repr(value)}; {len(usual)} numbers are needed")
        for number in value:
            if isinstance(number, bool) or not isinstance(number, (int, float)):
                self.fail(f"{what} holds {reprlib.repr(number)}; a number is needed")
            # False for NaN. Works for integers that are too large for a float.
            if not low <= number <= MAX_FLOAT:
                self.fail(f"{what} holds {reprlib.repr(number)}, which is out of range")
        return np.array(value, np.float64)

    # Accessors and buffers

    def vectors(self, index: object, what: str, count: int | None = None) -> Floats:
        """Read the first three components of a vertex attribute.

        Texture coordinates have two. Colours and texture coordinates may be normalized integers;
        all other attributes must be floats.
        """
        attribute = what.rpartition(".")[2]
        shapes = {"COLOR_0": ("VEC3", "VEC4"), "TEXCOORD": ("VEC2",)}
        kind = attribute if attribute in shapes else attribute.partition("_")[0]
        values = self.accessor(
            index,
            what,
            shapes.get(kind, ("VEC3",)),
            (FLOAT, 5121, 5123) if kind in shapes else (FLOAT,),
        )
        if count is not None and len(values) != count:
            self.fail(f"damaged: {what} has {len(values)} entries for {count} vertices")
        vectors: Floats = values[:, :3].astype(np.float64)
        if values.dtype.kind == "u":
            if not self.item("accessors", index, what).normalized:
                self.fail(f"{what}: integers that are not normalized")
            vectors /= np.iinfo(values.dtype).max
        if not np.isfinite(vectors).all():
            self.fail(f"damaged: {what} holds NaN or infinity")
        return vectors

    def accessor(
        self, index: object, what: str, shapes: tuple[str, ...], components: tuple[int, ...]
    ) -> NDArray[Any]:
        """Return an accessor's elements ``(count, width)`` in their stored type (3.6.2)."""
        accessor = self.item("accessors", index, what)
        what = f"accessors[{index}] ({what})"
        if accessor.type not in shapes or accessor.componentType not in components:
            self.fail(
                f"{what} is {reprlib.repr(accessor.type)} of component type "
                f"{reprlib.repr(accessor.componentType)}; {' or '.join(shapes)} of "
                f"{', '.join(map(str, components))} is needed"
            )
        dtype = np.dtype(_COMPONENTS[accessor.componentType])
        width = _WIDTHS[accessor.type]
        count = self.integer(accessor.count, f"{what}.count", 1, 3 * MAX_VERTICES)
        if accessor.bufferView is None:
            elements: NDArray[Any] = np.zeros((count, width), dtype)
        else:
            elements = self._elements(accessor, count, width, dtype, what)
        if accessor.sparse is None:
            return elements
        return self._with_sparse(accessor.sparse, elements, what)

    def _with_sparse(self, sparse: object, elements: NDArray[Any], what: str) -> NDArray[Any]:
        """Return `elements` with those replaced that the sparse part contains (3.6.2.3)."""
        sparse = self.part(sparse, f"{what}.sparse")
        indices, values = sparse.indices, sparse.values
        if not isinstance(indices, Parsed) or not isinstance(values, Parsed):
            self.fail(f"damaged: {what}.sparse lacks its indices or its values")
        count = self.integer(sparse.count, f"{what}.sparse.count", 1, len(elements))
        if indices.componentType not in INTEGERS:
            self.fail(
                f"{what}.sparse.indices is of component type "
                f"{reprlib.repr(indices.componentType)}; {INTEGERS} is possible"
            )
        kind = np.dtype(_COMPONENTS[indices.componentType])
        found = self._elements(indices, count, 1, kind, f"{what}.sparse.indices")
        where = found.ravel().astype(np.int64)
        if where.max() >= len(elements) or (np.diff(where) <= 0).any():
            self.fail(f"damaged: {what}.sparse.indices do not ascend within {len(elements)}")
        replaced = elements.copy()
        width, what = elements.shape[1], f"{what}.sparse.values"
        replaced[where] = self._elements(values, count, width, elements.dtype, what)
        return replaced

    def _elements(
        self, part: Parsed, count: int, width: int, dtype: np.dtype[Any], what: str
    ) -> NDArray[Any]:
        """Return a view ``(count, width)`` of a part's bufferView, after a check of its bounds."""
        view = self.item("bufferViews", part.bufferView, what)
        user = f"bufferViews[{part.bufferView}]"
        data = self._buffer(view.buffer, user)
        start = self.integer(view.byteOffset or 0, f"{user}.byteOffset", 0, len(data))
        length = self.integer(view.byteLength, f"{user}.byteLength", 1, len(data) - start)
        inside = self.integer(part.byteOffset or 0, f"{what}.byteOffset", 0, length)
        size = width * dtype.itemsize
        stride = size
        if view.byteStride is not None:
            stride = self.integer(view.byteStride, f"{user}.byteStride", max(4, size), 252)
        end = inside + (count - 1) * stride + size
        if end > length:
            self.fail(f"damaged: {what} ends at byte {end} of {user}, which has {length}")
        return np.ndarray(
            (count, width),
            dtype,
            buffer=data,
            offset=start + inside,
            strides=(stride, dtype.itemsize),
        )

    def _buffer(self, index: object, user: str) -> bytes:
        """Return the `byteLength` bytes of a buffer."""
        buffer = self.item("buffers", index, user)
        if index in self._buffers:
            return self._buffers[index]
        what = f"buffers[{index}]"
        length = self.integer(buffer.byteLength, f"{what}.byteLength", 1, 2**63 - 1)
        if buffer.uri is None:
            if index != 0 or self._blob is None:
                self.fail(f"damaged: {what} has no URI, and there is no binary chunk for it")
            data = self._blob
        else:
            data = self._resource(buffer.uri, length, what)
        if len(data) < length:
            self.fail(f"damaged: {what} has {len(data)} bytes of {length}")
        self._buffers[index] = data[:length]
        return self._buffers[index]

    def image_bytes(self, index: object, user: str) -> bytes:
        """Return the encoded bytes of an image, from a bufferView, a data URI or a file."""
        image = self.item("images", index, user)
        what = f"images[{index}]"
        if (image.uri is None) == (image.bufferView is None):
            self.fail(f"damaged: {what} needs either a URI or a bufferView")
        if image.uri is None:
            view = self.item("bufferViews", image.bufferView, what)
            length = self.integer(
                view.byteLength, f"bufferViews[{image.bufferView}].byteLength", 1, 2**63 - 1
            )
            whole = Parsed({"bufferView": image.bufferView})
            return self._elements(whole, length, 1, np.dtype(np.uint8), what).tobytes()
        return self._resource(image.uri, None, what)

    def _resource(self, uri: object, length: int | None, what: str) -> bytes:
        """Return the bytes in a data URI, or `length` (None: all) of those of a file."""
        if not isinstance(uri, str):
            self.fail(f"{what}.uri is not a string")
        if uri[:5].lower() == "data:":
            return self._data_uri(uri, what)
        return self._outer_file(uri, length, what)

    def _data_uri(self, uri: str, what: str) -> bytes:
        header, comma, payload = uri.partition(",")
        if not comma or not header.lower().endswith(";base64"):
            self.fail(f"{what}: a data URI that is not base64")
        try:
            return base64.b64decode(unquote(payload), validate=True)
        except (binascii.Error, ValueError) as error:
            raise ValueError(f"{self.path}: damaged: base64 of {what}: {error}") from error

    def _outer_file(self, uri: str, length: int | None, what: str) -> bytes:
        """Read `length` bytes (None: all) of a file in the glTF file's folder or below it."""
        name = unquote(uri)
        shown = reprlib.repr(uri)
        if re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", uri) or PureWindowsPath(name).drive:
            self.fail(f"{what}: URI {shown} has a scheme or a drive; only relative paths are read")
        # A backslash separates folders only on some systems. Here it always does.
        parts = re.split(r"[/\\]", name)
        if "\0" in name or name.startswith(("/", "\\")):
            self.fail(f"{what}: URI {shown} leads out of the file's folder")
        folder = self.path.parent.resolve()
        try:
            # "sub/.." is removed before links are resolved (RFC 3986, 5.2.4).
            target = Path(os.path.normpath(folder.joinpath(*parts))).resolve()
        except (OSError, RuntimeError) as error:
            raise OSError(f"{self.path}: {what}: URI {shown}: {error}") from error
        if not target.is_relative_to(folder):
            self.fail(f"{what}: URI {shown} leads out of the file's folder")
        try:
            if target.exists() and not target.is_file():
                self.fail(f"{what}: URI {shown} is not a file")
            with target.open("rb") as file:
                size = os.fstat(file.fileno()).st_size
                if length is None and size > _MAX_IMAGE_BYTES:
                    self.fail(f"{what}: {shown} has {size} bytes, which are too many")
                if length is not None and size < length:
                    self.fail(f"damaged: {what}: {shown} has {size} bytes of {length}")
                return file.read(size if length is None else length)
        except OSError as error:
            raise OSError(
                error.errno, f"{error.strerror} ({what} of {self.path})", str(target)
            ) from error


def _read_parts(members: dict[str, Any]) -> Parsed:
    """Return an object without null, which some exporters write for what is missing."""
    return Parsed({name: value for name, value in members.items() if value is not None})


def _number(text: str) -> float:
    """Return an int for an integer with a fractional part of 0, as some exporters write it."""
    number = float(text)
    return int(number) if number.is_integer() and abs(number) < 2**53 else number
