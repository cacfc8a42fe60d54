"""Construction of the binary buffer of an exported glTF file, with buffer views and accessors."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dermis.base.arrays import Numbers
from dermis.formats.gltf.document import FrozenTree, Tree

VERTICES, INDICES = 34962, 34963
"""Kinds of data in a buffer view, which glTF calls its target."""
CLAMPED_SAMPLER = {"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}
"""Sampler with mip levels and without repetition."""
_COMPONENT_TYPES = {"|u1": 5121, "<u2": 5123, "<u4": 5125, "<f4": 5126}
_ELEMENT_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_MAX_SHORT_COUNT = 65535  # most vertices with 16-bit indices, of which 65535 means primitive restart


@dataclass
class BufferBuilder:
    """Binary buffer of an exported glTF file that grows, with its buffer views and accessors."""

    data: bytearray = field(default_factory=bytearray)
    views: list[Tree] = field(default_factory=list)
    accessors: list[Tree] = field(default_factory=list)
    _zero_accessors: dict[int, int] = field(default_factory=dict)

    def add_view(self, data: bytes, target: int | None = None) -> int:
        """Append bytes to the buffer and return the index of their buffer view.

        target : `VERTICES` or `INDICES`; None for other data
        """
        self.data += b"\0" * (-len(self.data) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.views.append(entry if target is None else entry | {"target": target})
        self.data += data
        return len(self.views) - 1

    def add_accessor(self, rows: Numbers, target: int | None = None, *, bounded: bool = False) -> int:
        """Append n elements of k components, (n, k), and return the index of their accessor.

        rows : float32 or unsigned integers
        target : `VERTICES` or `INDICES`; None for other data
        bounded : whether to store each component's minimum and maximum, which glTF requires for positions
        """
        values = _to_little_endian(rows)
        bounds = _component_bounds(values) if bounded else {}
        view = self.add_view(values.tobytes(), target)
        return self._append_accessor(values, {"bufferView": view} | bounds)

    def add_triangles(self, index: Numbers, count: int) -> int:
        """Append the vertex indices of triangles, (f, 3), and return the index of their accessor.

        count : number of vertices of the primitive, by which the smallest sufficient integer type is chosen
        """
        return self.add_accessor(index.reshape(-1, 1).astype(_index_dtype(count)), INDICES)

    def add_displacements(self, row: Numbers, columns: Sequence[Numbers], count: int) -> list[int]:
        """Append arrays (count, 3) that are mostly 0, and return the indices of their accessors.

        The arrays are stored as sparse accessors, or as dense accessors if these are smaller.

        row : (m,) indices of the rows that are not 0, in increasing order, the same for all arrays
        columns : for each array, the values (m, 3) of the rows in `row`
        count : number of vertices
        """
        if not len(row):
            return [self._zero_accessor(count)] * len(columns)
        index = row.astype(_index_dtype(count))
        if len(row) * (12 + index.itemsize) >= 12 * count:
            return [self._dense_accessor(row, values, count) for values in columns]
        indices = {"bufferView": self.add_view(_to_little_endian(index).tobytes())}
        indices["componentType"] = _COMPONENT_TYPES[_to_little_endian(index).dtype.str]
        accessors = []
        for values in columns:
            stored = _to_little_endian(values)
            view = {"bufferView": self.add_view(stored.tobytes())}
            sparse = {"count": len(row), "indices": dict(indices), "values": view}
            low, high = np.minimum(stored.min(axis=0), 0), np.maximum(stored.max(axis=0), 0)
            entries = {"sparse": sparse, "min": low.tolist(), "max": high.tolist()}
            zeros = np.broadcast_to(np.zeros(1, "<f4"), (count, 3))
            accessors.append(self._append_accessor(zeros, entries))
        return accessors

    def _zero_accessor(self, count: int) -> int:
        """Return the index of an accessor of zero vectors (count, 3), which takes no space in the buffer."""
        if count not in self._zero_accessors:
            zeros = np.broadcast_to(np.zeros(1, "<f4"), (count, 3))
            self._zero_accessors[count] = self._append_accessor(zeros, {"min": [0.0] * 3, "max": [0.0] * 3})
        return self._zero_accessors[count]

    def _dense_accessor(self, row: Numbers, values: Numbers, count: int) -> int:
        dense = np.zeros((count, 3), "<f4")
        dense[row] = values
        return self.add_accessor(dense, VERTICES, bounded=True)

    def _append_accessor(self, values: Numbers, entries: FrozenTree) -> int:
        layout = {
            "componentType": _COMPONENT_TYPES[values.dtype.str],
            "type": _ELEMENT_TYPES[values.shape[1]],
        }
        self.accessors.append({"count": len(values), **layout, **entries})
        return len(self.accessors) - 1


def _to_little_endian(rows: Numbers) -> Numbers:
    """Return a contiguous array in little-endian byte order, which glTF requires."""
    return np.ascontiguousarray(rows, rows.dtype.newbyteorder("<"))


def _component_bounds(values: Numbers) -> dict[str, list[float]]:
    return {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}


def _index_dtype(count: int) -> str:
    """Return the smallest integer type for indices of `count` vertices."""
    return "<u2" if count <= _MAX_SHORT_COUNT else "<u4"


def resolve_textures(value: Any, textures: Mapping[str, int]) -> Any:
    """Return a JSON tree in which references {"index": picture name} become glTF texture indices.

    textures : texture index by picture name
    """
    if isinstance(value, Mapping):
        return {
            key: textures[item] if key == "index" and item in textures else resolve_textures(item, textures)
            for key, item in value.items()
        }
    return value


def glb_bytes(tree: FrozenTree, binary: bytes | bytearray) -> bytes:
    """Return the bytes of a .glb file that contains a JSON tree and one binary buffer."""
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = bytes(binary) + b"\0" * (-len(binary) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body))
    chunks = ((b"JSON", text), (b"BIN\0", body))
    return head + b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
