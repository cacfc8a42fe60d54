"""Small glTF files made by hand: numbers in one buffer, as text or as .glb."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

COMPONENTS = {"<i1": 5120, "<u1": 5121, "<i2": 5122, "<u2": 5123, "<u4": 5125, "<f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class GltfFile:
    """Tree of a file and its buffer; `numbers` and `sparse` add accessors and return their index."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.more_buffers: list[dict[str, int]] = []
        self.more_scenes: list[dict[str, Any]] = []
        self.tree: dict[str, Any] = {"asset": {"version": "2.0"}}
        for key in ("bufferViews", "accessors", "meshes", "nodes", "skins", "animations"):
            self.tree[key] = []

    def _view(self, data: bytes, **more: Any) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        views = self.tree["bufferViews"]
        views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more})
        self.data += data
        return len(views) - 1

    def _accessor(self, shape: tuple[int, ...], kind: str, **more: Any) -> int:
        told = {"count": shape[0], "type": KINDS[shape[1]], "componentType": COMPONENTS[kind]}
        self.tree["accessors"].append(told | more)
        return len(self.tree["accessors"]) - 1

    def numbers(self, values: ArrayLike, kind: str = "<f4", *, normalized: bool = False, gap: int = 0) -> int:
        """Add rows of numbers, with a gap [byte] after each."""
        rows = np.asarray(values, kind)
        rows = rows.reshape(len(rows), -1)
        size = rows.itemsize * rows.shape[1]
        spread = np.zeros((len(rows), size + gap), np.uint8)
        spread[:, :size] = np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), size)
        view = self._view(spread.tobytes(), **({"byteStride": size + gap} if gap else {}))
        more = {"normalized": True} if normalized else {}
        return self._accessor(rows.shape, kind, bufferView=view, **more)

    def sparse(self, values: ArrayLike) -> int:
        """Add rows of numbers, storing only the non-zero rows."""
        rows = np.asarray(values, "<f4")
        index = np.flatnonzero(rows.any(axis=1)).astype("<u2")
        told = {
            "count": len(index),
            "indices": {"bufferView": self._view(index.tobytes()), "componentType": 5123},
            "values": {"bufferView": self._view(rows[index].tobytes())},
        }
        return self._accessor(rows.shape, "<f4", sparse=told)

    def add(self, kind: str, **entry: Any) -> int:
        """Add a mesh, node, skin or animation."""
        self.tree[kind].append(entry)
        return len(self.tree[kind]) - 1

    def write(self, path: Path, *roots: int) -> Path:
        """Write the file with a scene of the given nodes."""
        tree = {key: value for key, value in self.tree.items() if value}
        tree["buffers"] = [{"byteLength": len(self.data)}, *self.more_buffers]
        if roots:
            tree |= {"scene": 0, "scenes": [{"nodes": list(roots)}, *self.more_scenes]}
        if path.suffix == ".glb":
            text = json.dumps(tree).encode()
            text += b" " * (-len(text) % 4)
            self.data += b"\0" * (-len(self.data) % 4)
            chunks = ((b"JSON", text), (b"BIN\0", bytes(self.data)))
            body = b"".join(struct.pack("<I4s", len(one), kind) + one for kind, one in chunks)
            path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
        else:
            uri = base64.b64encode(self.data).decode()
            tree["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{uri}"
            path.write_text(json.dumps(tree))
        return path


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
SQUARE_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def add_mesh(
    file: GltfFile,
    positions: ArrayLike = SQUARE,
    triangles: ArrayLike = SQUARE_TRIANGLES,
    targets: dict[str, int] | None = None,
    attributes: dict[str, int] | None = None,
    **more: Any,
) -> int:
    """Add a mesh of one primitive with uv from its x and y; targets are accessors by name."""
    places = np.asarray(positions, float)
    uv = (places[:, :2] - places[:, :2].min()) / np.ptp(places[:, :2])
    primitive: dict[str, Any] = {
        "attributes": {"POSITION": file.numbers(places), "TEXCOORD_0": file.numbers(uv)} | (attributes or {}),
        "indices": file.numbers(np.ravel(triangles)[:, None], "<u2"),
    }
    if targets:
        primitive["targets"] = [{"POSITION": index} for index in targets.values()]
        more |= {"extras": {"targetNames": list(targets)}}
    return file.add("meshes", primitives=[primitive], **more)
