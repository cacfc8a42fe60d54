"""The numbers of a glTF file that is being written, and its bytes."""

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
"""What a buffer view holds, where it holds nothing else."""
CLAMPED_SAMPLER = {"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}
"""A sampler that repeats nothing, with mips."""
_TYPES = {"|u1": 5121, "<u2": 5123, "<u4": 5125, "<f4": 5126}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_MAX_SHORT_COUNT = 65535  # the number itself begins a strip anew


@dataclass
class BufferBuilder:
    """The file's one buffer as it grows, with the views and accessors into it."""

    data: bytearray = field(default_factory=bytearray)
    views: list[Tree] = field(default_factory=list)
    accessors: list[Tree] = field(default_factory=list)
    _zero_accessors: dict[int, int] = field(default_factory=dict)

    def add_view(self, part: bytes, target: int | None = None) -> int:
        """The number of a new view of these bytes."""
        self.data += b"\0" * (-len(self.data) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(part)}
        self.views.append(entry if target is None else entry | {"target": target})
        self.data += part
        return len(self.views) - 1

    def add_accessor(self, rows: Numbers, target: int | None = None, *, bounded: bool = False) -> int:
        """The number of a new accessor; rows : (n, k), float32 or unsigned.

        bounded : tell the least and the largest of each column
        """
        values = _little_endian(rows)
        more = _bounds(values) if bounded else {}
        return self._append_accessor(values, {"bufferView": self.add_view(values.tobytes(), target)} | more)

    def add_triangles(self, index: Numbers, count: int) -> int:
        """An accessor of corners (f, 3) among so many vertices."""
        return self.add_accessor(index.reshape(-1, 1).astype(_index_dtype(count)), INDICES)

    def add_displacements(self, row: Numbers, columns: Sequence[Numbers], count: int) -> list[int]:
        """Accessors of `count` rows of three of which most are 0, whichever form is the smaller.

        row : (m,) those that are not, in order
        columns : each (m, 3) their values
        """
        if not len(row):
            return [self._zero_accessor(count)] * len(columns)
        index = row.astype(_index_dtype(count))
        if len(row) * (12 + index.itemsize) >= 12 * count:
            return [self._dense_accessor(row, values, count) for values in columns]
        places = {"bufferView": self.add_view(_little_endian(index).tobytes())}
        places["componentType"] = _TYPES[_little_endian(index).dtype.str]
        found = []
        for values in columns:
            stored = _little_endian(values)
            told = {"bufferView": self.add_view(stored.tobytes())}
            sparse = {"count": len(row), "indices": dict(places), "values": told}
            low, high = np.minimum(stored.min(axis=0), 0), np.maximum(stored.max(axis=0), 0)
            more = {"sparse": sparse, "min": low.tolist(), "max": high.tolist()}
            found.append(self._append_accessor(np.broadcast_to(np.zeros(1, "<f4"), (count, 3)), more))
        return found

    def _zero_accessor(self, count: int) -> int:
        """One accessor for all of so many zeros; it takes no room."""
        if count not in self._zero_accessors:
            none = np.broadcast_to(np.zeros(1, "<f4"), (count, 3))
            self._zero_accessors[count] = self._append_accessor(none, {"min": [0.0] * 3, "max": [0.0] * 3})
        return self._zero_accessors[count]

    def _dense_accessor(self, row: Numbers, values: Numbers, count: int) -> int:
        whole = np.zeros((count, 3), "<f4")
        whole[row] = values
        return self.add_accessor(whole, VERTICES, bounded=True)

    def _append_accessor(self, values: Numbers, more: FrozenTree) -> int:
        told = {"componentType": _TYPES[values.dtype.str], "type": _KINDS[values.shape[1]]}
        self.accessors.append({"count": len(values), **told, **more})
        return len(self.accessors) - 1


def _little_endian(rows: Numbers) -> Numbers:
    """The same with the bytes in a file's order."""
    return np.ascontiguousarray(rows, rows.dtype.newbyteorder("<"))


def _bounds(values: Numbers) -> dict[str, list[float]]:
    return {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}


def _index_dtype(count: int) -> str:
    """The smallest type for numbers of so many things."""
    return "<u2" if count <= _MAX_SHORT_COUNT else "<u4"


def resolve_textures(value: Any, places: Mapping[str, int]) -> Any:
    """The tree with pictures' names, as {"index": name}, replaced by their textures' numbers."""
    if isinstance(value, Mapping):
        return {
            key: places[one] if key == "index" and one in places else resolve_textures(one, places)
            for key, one in value.items()
        }
    return value


def glb_bytes(tree: FrozenTree, binary: bytes | bytearray) -> bytes:
    """A .glb file of a tree and its one buffer."""
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = bytes(binary) + b"\0" * (-len(binary) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body))
    chunks = ((b"JSON", text), (b"BIN\0", body))
    return head + b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
