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

VERTEX_TARGET, INDEX_TARGET = 34962, 34963
"""Codes for vertex data and for triangle indices in a buffer view; glTF calls such a code a target."""
CLAMPED_SAMPLER = {"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}
"""glTF texture sampler with mip levels; the texture is not repeated beyond its edges."""
_COMPONENT_TYPES = {"|u1": 5121, "<u2": 5123, "<u4": 5125, "<f4": 5126}
_ELEMENT_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_MAX_UINT16_VERTICES = 65535  # most vertices with 16-bit indices, of which 65535 means primitive restart


@dataclass
class BufferBuilder:
    """Growing binary buffer of an exported glTF file, with its buffer views and accessors."""

    data: bytearray = field(default_factory=bytearray)
    views: list[Tree] = field(default_factory=list)
    accessors: list[Tree] = field(default_factory=list)
    _zero_accessors: dict[int, int] = field(default_factory=dict)

    def add_view(self, view_bytes: bytes, buffer_target: int | None = None) -> int:
        """Append bytes to the buffer and return the index of their buffer view.

        buffer_target : `VERTEX_TARGET` or `INDEX_TARGET`; None for other data
        """
        self.data += b"\0" * (-len(self.data) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(view_bytes)}
        self.views.append(entry if buffer_target is None else entry | {"target": buffer_target})
        self.data += view_bytes
        return len(self.views) - 1

    def add_accessor(
        self, elements: Numbers, buffer_target: int | None = None, *, with_bounds: bool = False
    ) -> int:
        """Append elements to the buffer and return the index of their accessor.

        elements : (n, k) n elements of k components, float32 or unsigned integers
        buffer_target : `VERTEX_TARGET` or `INDEX_TARGET`; None for other data
        with_bounds : whether to store each component's minimum and maximum, which glTF requires for positions
        """
        values = _to_little_endian(elements)
        bounds = _component_bounds(values) if with_bounds else {}
        view = self.add_view(values.tobytes(), buffer_target)
        return self._append_accessor(values, {"bufferView": view} | bounds)

    def add_normalised(self, fractions: Numbers, buffer_target: int | None = None) -> int:
        """Append numbers from 0 to 1, (n, k), as 16-bit integers and return the index of their accessor."""
        levels = np.rint(np.clip(fractions, 0.0, 1.0) * 65535).astype("<u2")
        index = self.add_accessor(levels, buffer_target)
        self.accessors[index]["normalized"] = True
        return index

    def add_triangles(self, corner_vertices: Numbers, vertex_count: int) -> int:
        """Append the vertex indices of triangles, (f, 3), and return the index of their accessor.

        vertex_count : number of vertices of the primitive, which determines the type of the indices
        """
        return self.add_accessor(
            corner_vertices.reshape(-1, 1).astype(_index_dtype(vertex_count)), INDEX_TARGET
        )

    def add_displacements(
        self, moved_vertex: Numbers, displacements: Sequence[Numbers], vertex_count: int
    ) -> list[int]:
        """Append arrays of displacements (vertex_count, 3), and return the indices of their accessors.

        The arrays are stored as sparse accessors, or as dense accessors if these are smaller.

        moved_vertex : (m,) increasing indices of the displaced vertices, the same for all arrays
        displacements : for each array, the displacements (m, 3) of these vertices
        vertex_count : number of vertices
        """
        if not len(moved_vertex):
            return [self._zero_accessor(vertex_count)] * len(displacements)
        index = moved_vertex.astype(_index_dtype(vertex_count))
        if len(moved_vertex) * (12 + index.itemsize) >= 12 * vertex_count:
            return [self._dense_accessor(moved_vertex, values, vertex_count) for values in displacements]
        indices = {"bufferView": self.add_view(_to_little_endian(index).tobytes())}
        indices["componentType"] = _COMPONENT_TYPES[_to_little_endian(index).dtype.str]
        accessors = []
        for values in displacements:
            stored = _to_little_endian(values)
            view = {"bufferView": self.add_view(stored.tobytes())}
            sparse = {"count": len(moved_vertex), "indices": dict(indices), "values": view}
            low, high = np.minimum(stored.min(axis=0), 0), np.maximum(stored.max(axis=0), 0)
            entries = {"sparse": sparse, "min": low.tolist(), "max": high.tolist()}
            zeros = np.broadcast_to(np.zeros(1, "<f4"), (vertex_count, 3))
            accessors.append(self._append_accessor(zeros, entries))
        return accessors

    def _zero_accessor(self, vertex_count: int) -> int:
        """Return the index of an accessor of `vertex_count` zero vectors that uses no buffer space."""
        if vertex_count not in self._zero_accessors:
            zeros = np.broadcast_to(np.zeros(1, "<f4"), (vertex_count, 3))
            self._zero_accessors[vertex_count] = self._append_accessor(
                zeros, {"min": [0.0] * 3, "max": [0.0] * 3}
            )
        return self._zero_accessors[vertex_count]

    def _dense_accessor(self, moved_vertex: Numbers, displacement: Numbers, vertex_count: int) -> int:
        dense = np.zeros((vertex_count, 3), "<f4")
        dense[moved_vertex] = displacement
        return self.add_accessor(dense, VERTEX_TARGET, with_bounds=True)

    def _append_accessor(self, elements: Numbers, accessor_entries: FrozenTree) -> int:
        layout = {
            "componentType": _COMPONENT_TYPES[elements.dtype.str],
            "type": _ELEMENT_TYPES[elements.shape[1]],
        }
        self.accessors.append({"count": len(elements), **layout, **accessor_entries})
        return len(self.accessors) - 1


def _to_little_endian(array: Numbers) -> Numbers:
    """Return a contiguous array in little-endian byte order, which glTF requires."""
    return np.ascontiguousarray(array, array.dtype.newbyteorder("<"))


def _component_bounds(elements: Numbers) -> dict[str, list[float]]:
    return {"min": elements.min(axis=0).tolist(), "max": elements.max(axis=0).tolist()}


def _index_dtype(vertex_count: int) -> str:
    """Return the smallest integer type for indices of `vertex_count` vertices."""
    return "<u2" if vertex_count <= _MAX_UINT16_VERTICES else "<u4"


def resolve_textures(json_value: Any, texture_indices: Mapping[str, int]) -> Any:
    """Return a copy of a JSON tree in which {"index": picture name} becomes {"index": texture index}.

    texture_indices : dictionary from picture name to texture index
    """
    if isinstance(json_value, Mapping):
        return {
            key: texture_indices[item]
            if key == "index" and item in texture_indices
            else resolve_textures(item, texture_indices)
            for key, item in json_value.items()
        }
    return json_value


def glb_bytes(json_tree: FrozenTree, binary_chunk: bytes | bytearray) -> bytes:
    """Return the bytes of a .glb file that contains a JSON tree and one binary buffer."""
    text = json.dumps(json_tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = bytes(binary_chunk) + b"\0" * (-len(binary_chunk) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body))
    chunks = ((b"JSON", text), (b"BIN\0", body))
    return head + b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
