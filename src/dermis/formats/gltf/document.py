"""Access to the JSON tree and the buffers of .glb, .vrm and .gltf files.

Strided and sparse accessors, and normalised integers, are decoded.
"""

from __future__ import annotations

import base64
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dermis.base.arrays import Doubles, Numbers
from dermis.base.errors import refuse
from dermis.base.reading import MALFORMED_DATA_ERRORS, parse_json, read_file, refuse_parse_errors
from dermis.formats.parts import is_binary_gltf, to_floats
from dermis.formats.referenced_files import resolve_uri
from dermis.formats.size_limits import MAX_ACCESSOR_COMPONENTS, MAX_FILE_BYTES, MAX_JSON_VALUES, check_limit

Tree = dict[str, Any]
FrozenTree = Mapping[str, Any]
"""JSON object written by another program; its values are checked where they are used."""

_GLB_MAGIC = 0x46546C67
_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_COMPONENT_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COMPONENT_COUNTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_MIN_COMPONENTS_PER_READ = 512  # smallest number of components that one read of an accessor counts as
_TOP_LEVEL_ARRAYS = [
    "accessors",
    "animations",
    "buffers",
    "bufferViews",
    "images",
    "materials",
    "meshes",
    "nodes",
    "samplers",
    "scenes",
    "skins",
    "textures",
]


@dataclass
class Document:
    """JSON tree and binary data of a glTF file, with access to its accessors.

    tree : JSON of the file
    binary : binary chunk of a .glb or .vrm file, empty for a .gltf file
    """

    path: Path
    tree: Tree
    binary: bytes = b""
    _buffers: dict[int, bytes] = field(default_factory=dict)
    _read_components: int = 0

    def top_level_array(self, array_name: str) -> list[Tree]:
        """Return a top-level array of the JSON tree, such as "nodes"; empty if the file has none."""
        listed: list[Tree] = self.tree.get(array_name, [])
        return listed

    def top_level_object(self, array_name: str, object_index: object) -> Tree:
        """Return the object at `object_index` in a top-level array of the JSON tree, such as "meshes".

        Raises ValueError for an invalid index.
        """
        return self.top_level_array(array_name)[
            checked_index(object_index, len(self.top_level_array(array_name)), array_name)
        ]

    def read_buffer(self, buffer_index: int) -> bytes:
        """Return the bytes of a buffer, which may be in the .glb file, in a data URI or in another file."""
        if buffer_index not in self._buffers:
            uri = self.top_level_object("buffers", buffer_index).get("uri")
            if uri is None and buffer_index > 0:
                raise ValueError(f"buffer {buffer_index} has no data in the file")
            self._buffers[buffer_index] = self._read_uri(uri)
        return self._buffers[buffer_index]

    def read_view(self, view_index: int) -> memoryview:
        """Return the bytes of a buffer view."""
        view = self.top_level_object("bufferViews", view_index)
        start, length = (
            _checked_byte_or_value_count(view.get("byteOffset", 0)),
            _checked_byte_or_value_count(view["byteLength"]),
        )
        data = memoryview(self.read_buffer(view["buffer"]))[start : start + length]
        if len(data) != length:
            raise ValueError(f"buffer view {view_index} ends outside of its buffer")
        return data

    def accessor_shape(self, accessor_index: int) -> tuple[int, int]:
        """Return the number of elements of an accessor, and the number of components of an element."""
        accessor = self.top_level_object("accessors", accessor_index)
        return _checked_byte_or_value_count(accessor["count"]), _COMPONENT_COUNTS[accessor["type"]]

    def replace_values(self, accessor_index: int, new_values: Numbers) -> None:
        """Replace the values of an accessor.

        new_values : array of the accessor's shape, which this function converts to the accessor's type
        """
        accessor = self.top_level_object("accessors", accessor_index)
        data = new_values.astype(_COMPONENT_TYPES[accessor["componentType"]]).tobytes()
        buffers, views = (self.tree.setdefault(key, []) for key in ("buffers", "bufferViews"))
        self._buffers[len(buffers)] = data
        views.append({"buffer": len(buffers), "byteLength": len(data)})
        buffers.append({"byteLength": len(data)})
        accessor.pop("sparse", None)
        accessor |= {"bufferView": len(views) - 1, "byteOffset": 0}

    def read_values(self, accessor_index: int) -> Numbers:
        """Return the elements (n, k) of an accessor in their stored type: n elements of k components."""
        accessor, shape = (
            self.top_level_object("accessors", accessor_index),
            self.accessor_shape(accessor_index),
        )
        kind = np.dtype(_COMPONENT_TYPES[accessor["componentType"]])
        self._read_components += max(shape[0] * shape[1], _MIN_COMPONENTS_PER_READ)
        if self._read_components > MAX_ACCESSOR_COMPONENTS:
            actual = f"accessor {accessor_index} exceeds the limit"
            advice = "Export it with fewer instances or targets, or decimated"
            limit = f"accessors of at most {MAX_ACCESSOR_COMPONENTS / 1e6:.0f} million numbers"
            refuse(self.path, limit, actual, advice)
        if "bufferView" in accessor:
            stride = _checked_byte_or_value_count(
                self.top_level_object("bufferViews", accessor["bufferView"]).get("byteStride", 0)
            )
            values = self._view_array(accessor, shape, kind, stride)
        else:
            values = np.zeros(shape, kind)
        if "sparse" not in accessor:
            return values
        return self._substitute_sparse(values, accessor["sparse"])

    def read_floats(self, accessor_index: int) -> Doubles:
        """Return the elements (n, k) of an accessor as floats: n elements of k components.

        Normalised integers are decoded to [0, 1] or [-1, 1].
        """
        values = self.read_values(accessor_index)
        if not self.top_level_object("accessors", accessor_index).get("normalized", False):
            return values.astype(np.float64)
        return to_floats(values)

    def _substitute_sparse(self, dense_values: Numbers, sparse_tree: Tree) -> Numbers:
        count = _checked_byte_or_value_count(sparse_tree["count"])
        if count > len(dense_values):
            raise ValueError(f"{count} of {len(dense_values)} values are listed as sparse")
        index_type = np.dtype(_COMPONENT_TYPES[sparse_tree["indices"]["componentType"]])
        index = self._view_array(sparse_tree["indices"], (count, 1), index_type).ravel()
        result = dense_values.copy()
        result[index] = self._view_array(
            sparse_tree["values"], (count, dense_values.shape[1]), dense_values.dtype
        )
        return result

    def _view_array(
        self,
        view_reference: Tree,
        array_shape: tuple[int, int],
        dtype: np.dtype[np.number],
        stride_bytes: int = 0,
    ) -> Numbers:
        """Return an array of shape `array_shape`, (n, k), and type `dtype` from a buffer view.

        view_reference : JSON object with "bufferView" and "byteOffset"
        stride_bytes : distance between the starts of rows [byte]; 0 if they are contiguous
        """
        data, start = (
            self.read_view(view_reference["bufferView"]),
            _checked_byte_or_value_count(view_reference.get("byteOffset", 0)),
        )
        size = dtype.itemsize
        if 0 in array_shape:
            return np.zeros(array_shape, dtype)
        return np.ndarray(array_shape, dtype, data, start, (stride_bytes or size * array_shape[1], size))

    def _read_uri(self, uri: str | None) -> bytes:
        if uri is None:
            return self.binary
        remaining = MAX_FILE_BYTES - sum(map(len, self._buffers.values()))
        if uri.startswith("data:"):
            data = base64.b64decode(uri.partition(",")[2])
        else:
            data = read_file(resolve_uri(self.path, uri), "a buffer", remaining, f"{self.path}, {uri[:80]!r}")
        if len(data) > remaining:
            actual = "they have more"
            refuse(self.path, f"buffers of at most {MAX_FILE_BYTES >> 20} MiB", actual, "Make them smaller")
        return data


def checked_index(json_index: object, object_count: int, object_noun: str) -> int:
    """Return an index after checking that it is an integer from 0 to `object_count` - 1.

    object_noun : plural noun for the indexed objects, for the error

    Raises ValueError for an invalid index.
    """
    if not (isinstance(json_index, int) and 0 <= json_index < object_count):
        raise ValueError(
            f"there are {object_count} {object_noun}, and {str(json_index)[:40]!r} is none of them"
        )
    return json_index


def _checked_byte_or_value_count(json_number: object) -> int:
    if not (isinstance(json_number, int) and 0 <= json_number <= MAX_FILE_BYTES):
        raise ValueError(f"got {str(json_number)[:40]!r} for a number of bytes or values")
    return json_number


def read_document(path: Path) -> Document:
    """Read a .glb, .vrm or .gltf file.

    Raises DermisError when the file is not a glTF file, is truncated, or is too large.
    """
    data = read_file(path, "a glTF file", MAX_FILE_BYTES)
    with refuse_parse_errors(path, "a glTF file", *MALFORMED_DATA_ERRORS):
        if not is_binary_gltf(path):
            return Document(path, _parse_json_tree(path, data))
        magic, version, length = struct.unpack_from("<III", data)
        if magic != _GLB_MAGIC or version != 2:
            raise ValueError("it does not start like a .glb file of version 2")
        if length > len(data):
            raise ValueError(f"it should have {length} bytes and has {len(data)}")
        chunks = dict(_glb_chunks(data))
        return Document(path, _parse_json_tree(path, chunks[_JSON_CHUNK]), chunks.get(_BINARY_CHUNK, b""))


def _parse_json_tree(path: Path, json_text: bytes) -> Tree:
    """Parse the JSON of a file and check that its top-level arrays contain objects."""
    values = sum(json_text.count(mark) for mark in (b",", b"[", b"{"))
    advice = "Export it with fewer nodes, materials or clips"
    check_limit(path, values, MAX_JSON_VALUES, "values in its JSON", advice)
    tree = parse_json(json_text, path, "a glTF file")
    if not isinstance(tree, dict):
        raise ValueError("its JSON is not an object")
    for key in _TOP_LEVEL_ARRAYS:
        listed = tree.get(key, [])
        if not (isinstance(listed, list) and all(isinstance(one, dict) for one in listed)):
            raise ValueError(f"its {key} are not a list of objects")
    return tree


def _glb_chunks(glb_data: bytes) -> list[tuple[int, bytes]]:
    """Return the type and the bytes of each chunk of a .glb file, in reverse order.

    A dictionary made from this list thus contains the first chunk of each type.
    """
    chunks, offset = [], 12
    while offset + 8 <= len(glb_data):
        length, kind = struct.unpack_from("<II", glb_data, offset)
        content = glb_data[offset + 8 : offset + 8 + length]
        if len(content) != length:
            raise ValueError("a chunk is truncated")
        chunks.append((kind, content))
        offset += 8 + length
    return chunks[::-1]
