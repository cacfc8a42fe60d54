"""A .glb or .gltf file as its tree and its numbers.

An accessor may lie anywhere in a buffer, with gaps, be mostly zero or the same as another (sparse), and hold
integers that stand for fractions.
"""

from __future__ import annotations

import base64
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.formats import Array, fractions

Tree = dict[str, Any]

_MAGIC = 0x46546C67
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_MOST = 1 << 26  # numbers that a file may ask for without holding them


@dataclass
class Document:
    """A file that was read.

    tree : its JSON
    binary : the chunk that a .glb file holds besides
    """

    path: Path
    tree: Tree
    binary: bytes = b""
    _buffers: dict[int, bytes] = field(default_factory=dict)

    def all(self, key: str) -> list[Tree]:
        """Things of one kind, none where the file has none."""
        return list(self.tree.get(key, []))

    def buffer(self, index: int) -> bytes:
        """One of its buffers, wherever it lies."""
        if index not in self._buffers:
            self._buffers[index] = self._read(self.tree["buffers"][index].get("uri"))
        return self._buffers[index]

    def view(self, index: int) -> memoryview:
        """The bytes of a buffer view, all of them."""
        view = self.tree["bufferViews"][index]
        start, length = view.get("byteOffset", 0), view["byteLength"]
        data = memoryview(self.buffer(view["buffer"]))[start : start + length]
        if start < 0 or len(data) != length:
            raise ValueError(f"buffer view {index} ends outside of its buffer")
        return data

    def numbers(self, index: int) -> NDArray[Any]:
        """(n, k) the values of an accessor as they are stored; sparse ones in their places."""
        accessor = self.tree["accessors"][index]
        kind, width = np.dtype(_TYPES[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        shape = int(accessor["count"]), width
        if "bufferView" in accessor:
            stride = self.tree["bufferViews"][accessor["bufferView"]].get("byteStride", 0)
            values = self._rows(accessor, shape, kind, stride)
        elif 0 <= shape[0] * width <= _MOST:
            values = np.zeros(shape, kind)
        else:
            raise ValueError(f"accessor {index} asks for {shape[0]} values and holds none")
        if "sparse" not in accessor:
            return values
        return self._with_sparse(values, accessor["sparse"])

    def real(self, index: int) -> Array:
        """(n, k) the values of an accessor; integers that are normalised are fractions of the largest."""
        values = self.numbers(index)
        if not self.tree["accessors"][index].get("normalized", False):
            return values.astype(np.float64)
        return fractions(values)

    def _with_sparse(self, values: NDArray[Any], sparse: Tree) -> NDArray[Any]:
        count = int(sparse["count"])
        places = np.dtype(_TYPES[sparse["indices"]["componentType"]])
        index = self._rows(sparse["indices"], (count, 1), places).ravel()
        changed = values.copy()
        changed[index] = self._rows(sparse["values"], (count, values.shape[1]), values.dtype)
        return changed

    def _rows(
        self, place: Tree, shape: tuple[int, int], kind: np.dtype[Any], stride: int = 0
    ) -> NDArray[Any]:
        """(n, k) numbers that begin at a place in a buffer view; stride [byte] 0 where they lie close."""
        data, start = self.view(place["bufferView"]), place.get("byteOffset", 0)
        size = kind.itemsize
        if 0 in shape:
            return np.zeros(shape, kind)
        return np.ndarray(shape, kind, data, start, (stride or size * shape[1], size))

    def _read(self, uri: str | None) -> bytes:
        if uri is None:
            return self.binary
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        return (self.path.parent / unquote(uri)).read_bytes()


def read_document(path: Path) -> Document:
    """The file's tree and binary chunk.

    Raises ValueError, KeyError or struct.error when it is no glTF or is cut short.
    """
    data = path.read_bytes()
    if path.suffix.lower() != ".glb":
        return Document(path, _object(data))
    magic, version, length = struct.unpack_from("<III", data)
    if magic != _MAGIC or version != 2:
        raise ValueError("it does not begin as a .glb file of version 2")
    if length > len(data):
        raise ValueError(f"it should have {length} bytes and has {len(data)}")
    chunks = dict(_chunks(data))
    return Document(path, _object(chunks[_JSON]), chunks.get(_BINARY, b""))


def _object(text: bytes) -> Tree:
    tree = json.loads(text)
    if not isinstance(tree, dict):
        raise ValueError("its JSON is no object")
    return tree


def _chunks(data: bytes) -> list[tuple[int, bytes]]:
    """Kind and content of each chunk, the last of a kind first, so that of two the first counts."""
    found, place = [], 12
    while place + 8 <= len(data):
        length, kind = struct.unpack_from("<II", data, place)
        content = data[place + 8 : place + 8 + length]
        if len(content) != length:
            raise ValueError("a chunk is cut short")
        found.append((kind, content))
        place += 8 + length
    return found[::-1]
