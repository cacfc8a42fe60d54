"""Decompression of Draco-compressed geometry in glTF files."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Numbers
from dermis.base.disk import Arrays
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.base.native_decoding import run_decoder
from dermis.formats import size_limits as limits
from dermis.formats.gltf.document import Document, Tree

DRACO_EXTENSION = "KHR_draco_mesh_compression"
_TRIANGLES_MODE = 4
_DECODER_MODULE = "dermis.formats.gltf.draco_decoder"
_SIZE_ADVICE = "Decimate it, or export without compression"


class _Primitive(NamedTuple):
    """Compressed primitive: its JSON tree, and the JSON tree of its compression extension."""

    tree: Tree
    extension: Tree


def decompress(document: Document) -> None:
    """Store the compressed attributes and indices of a document's primitives as plain accessors.

    Primitives that are also stored without compression are left as they are.

    Raises DermisError if the package DracoPy is missing, for damaged data, and for data whose size differs
    from the size that the accessors state.
    """
    found = [
        _compressed_primitive(document, one)
        for mesh in document.top_level_array("meshes")
        for one in mesh["primitives"]
    ]
    primitives = [one for one in found if one is not None]
    if not primitives:
        return
    import_extra("DracoPy", f"{document.path}: geometry compressed by Draco")
    _check_sizes(document, [one.tree for one in primitives])
    views = [document.read_view(one.extension["bufferView"]) for one in primitives]
    request = {str(number): np.frombuffer(view, np.uint8) for number, view in enumerate(views)}
    size = sum(map(len, views))
    answer = run_decoder(_DECODER_MODULE, request, size, document.path, "valid geometry compressed by Draco")
    for number, primitive in enumerate(primitives):
        _store_attributes(document, primitive, answer, str(number))


def _compressed_primitive(document: Document, primitive: Tree) -> _Primitive | None:
    """Return the compressed form of a primitive; None if the primitive is also stored without compression."""
    extension = (primitive.get("extensions") or {}).get(DRACO_EXTENSION)
    positions = document.top_level_object("accessors", primitive["attributes"]["POSITION"])
    if extension is None or "bufferView" in positions:
        return None
    return _Primitive(primitive, extension)


def _check_sizes(document: Document, primitives: list[Tree]) -> None:
    """Refuse primitives with too many vertices or triangles in total, according to their accessors."""
    vertices = [
        document.top_level_object("accessors", one["attributes"]["POSITION"])["count"] for one in primitives
    ]
    corners = [
        document.top_level_object("accessors", one["indices"])["count"]
        for one in primitives
        if "indices" in one
    ]
    limits.check_limit(document.path, sum(vertices), limits.MAX_VERTICES, "vertices", _SIZE_ADVICE)
    limits.check_limit(document.path, sum(corners) // 3, limits.MAX_TRIANGLES, "triangles", _SIZE_ADVICE)


def _store_attributes(
    document: Document, primitive: _Primitive, decoded_arrays: Arrays, mesh_name: str
) -> None:
    tree, compressed = primitive
    for attribute, identifier in compressed["attributes"].items():
        _replace_accessor(
            document, tree["attributes"][attribute], decoded_arrays[f"{mesh_name}/{identifier}"], attribute
        )
    if "indices" in tree:
        triangles = decoded_arrays[f"{mesh_name}/triangles"]
        _replace_accessor(document, tree["indices"], triangles.reshape(-1, 1), "indices of triangles")
        tree["mode"] = _TRIANGLES_MODE


def _replace_accessor(
    document: Document, accessor_index: int, decoded_values: Numbers, items_noun: str
) -> None:
    shape = document.accessor_shape(accessor_index)
    if decoded_values.shape != shape:
        actual = f"its compressed {items_noun} are {' x '.join(map(str, decoded_values.shape))} numbers"
        refuse(
            document.path, f"{shape[0]} x {shape[1]} as its accessor states", actual, limits.DAMAGED_ADVICE
        )
    document.replace_values(accessor_index, decoded_values)
