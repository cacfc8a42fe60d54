"""glTF files with geometry that is compressed by Draco."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gltf_file import GltfFile

from dermis.mesh.primitives import uv_sphere

EXTENSION = "KHR_draco_mesh_compression"
BALL = uv_sphere(0.12, 24, 12)
_JOINTS, _WEIGHTS = 10, 11
_KINDS = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2, "TEXCOORD_0": 3}  # of Draco's attributes


class DracoFile:
    """Tree of a glTF file with a compressed ball of 240 mm; `primitive` is its primitive."""

    def __init__(self, *, skinned: bool = False, coloured: bool = False) -> None:
        import DracoPy

        self.file, count = GltfFile(), len(BALL.positions)
        more: dict[str, Any] = {}
        if skinned:
            weights = np.column_stack(
                [np.linspace(0, 1, count), 1 - np.linspace(0, 1, count), *np.zeros((2, count))]
            )
            joints = np.tile(np.array([0, 1, 0, 0], np.uint8), (count, 1))
            more["generic_attributes"] = {_JOINTS: joints, _WEIGHTS: weights.astype(np.float32)}
        if coloured:
            more["colors"] = np.tile(np.array([200, 100, 50, 255], np.uint8), (count, 1))
        data = DracoPy.encode(
            BALL.positions,
            BALL.triangles.astype(np.uint32),
            quantization_bits=16,
            preserve_order=True,
            tex_coord=BALL.uv.astype(np.float64),
            normals=BALL.normals.astype(np.float64),
            **more,
        )
        self.decoded = DracoPy.decode(data)
        identifiers = {name: self._identifier(kind) for name, kind in _KINDS.items() if kind != 2 or coloured}
        if skinned:
            identifiers |= {"JOINTS_0": _JOINTS, "WEIGHTS_0": _WEIGHTS}
        arrays = {
            name: self.decoded.get_attribute_by_unique_id(one)["data"] for name, one in identifiers.items()
        }
        self.primitive: dict[str, Any] = {
            "attributes": {name: self._accessor(array) for name, array in arrays.items()},
            "indices": self._accessor(self.decoded.faces.astype("<u2").reshape(-1, 1)),
            "extensions": {EXTENSION: {"bufferView": self.file._view(data), "attributes": identifiers}},
        }
        mesh = self.file.add("meshes", primitives=[self.primitive])
        self.nodes = [self.file.add("nodes", mesh=mesh, name="ball")]
        if skinned:
            self.nodes += [self.file.add("nodes", name=name) for name in ("neck", "head")]
            self.file.tree["nodes"][0]["skin"] = self.file.add("skins", joints=[1, 2])
        self.file.tree |= {"extensionsUsed": [EXTENSION], "extensionsRequired": [EXTENSION]}

    def _identifier(self, kind: int) -> int:
        (found,) = [one["unique_id"] for one in self.decoded.attributes if one["attribute_type"] == kind]
        return int(found)

    def _accessor(self, array: np.ndarray) -> int:
        more = (
            {"normalized": True}
            if array.dtype == np.uint8 and array.shape[1] == 4 and array.max() > 1
            else {}
        )
        return self.file._accessor(array.shape, array.dtype.newbyteorder("<").str.replace("|", "<"), **more)

    def write(self, path: Path) -> Path:
        """Write the file as .glb."""
        return self.file.write(path, *self.nodes)
